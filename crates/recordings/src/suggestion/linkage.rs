//! Complete linkage: the hierarchy of groups in which every pair is at most so far apart.

/// A group of the hierarchy.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    /// Sorted.
    pub markers: Vec<usize>,
    /// The groups that it was merged from, by their places in the list; `None` for single markers.
    pub parts: [Option<usize>; 2],
    /// The largest distance in it; 1 for single markers.
    pub height: f64,
    /// The height of the group that it was merged into; infinite if it was not.
    pub merged_at: f64,
}

/// All groups of more than one marker, parts before the groups they are merged into.
///
/// Two groups can be merged if at least half of the distances between them are known; `distance` is NaN where not.
pub(super) fn groups(count: usize, distance: impl Fn(usize, usize) -> f64) -> Vec<Group> {
    let mut far: Vec<f64> = (0..count * count).map(|cell| distance(cell / count, cell % count)).collect();
    let mut known: Vec<usize> = far.iter().map(|distance| usize::from(!distance.is_nan())).collect();
    // What each row of the matrix stands for: a group, or a single marker so far.
    let mut members: Vec<Option<Vec<usize>>> = (0..count).map(|marker| Some(vec![marker])).collect();
    let mut group_of: Vec<Option<usize>> = vec![None; count];
    let mut groups: Vec<Group> = Vec::new();
    let size = |members: &[Option<Vec<usize>>], row: usize| members[row].as_ref().map_or(0, Vec::len);
    let nearest = |row: usize, members: &[Option<Vec<usize>>], far: &[f64], known: &[usize]| {
        let others = (0..count).filter(|&other| other != row && members[other].is_some());
        let mergeable = others.filter(|&other| {
            let cell = row * count + other;
            far[cell].is_finite() && 2 * known[cell] >= size(members, row) * size(members, other)
        });
        mergeable.map(|other| (far[row * count + other], other)).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    };
    let mut nearest_of: Vec<Option<(f64, usize)>> =
        (0..count).map(|row| nearest(row, &members, &far, &known)).collect();
    loop {
        let rows = (0..count).filter(|&row| members[row].is_some());
        let closest = rows.filter_map(|row| nearest_of[row].map(|(height, other)| (height, row, other)));
        let Some((height, a, b)) = closest.min_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1))) else {
            return groups;
        };
        let height =
            height.max(group_of[a].map_or(1., |g| groups[g].height)).max(group_of[b].map_or(1., |g| groups[g].height));
        for part in [group_of[a], group_of[b]].into_iter().flatten() {
            groups[part].merged_at = height;
        }
        let mut merged = [members[a].take(), members[b].take()].into_iter().flatten().flatten().collect::<Vec<_>>();
        merged.sort_unstable();
        groups.push(Group {
            markers: merged.clone(),
            parts: [group_of[a], group_of[b]],
            height,
            merged_at: f64::INFINITY,
        });
        members[a] = Some(merged);
        group_of[a] = Some(groups.len() - 1);
        for other in (0..count).filter(|&other| other != a) {
            let cells = [a * count + other, b * count + other];
            // The larger of those that are known.
            let (farther, together) = (far[cells[0]].max(far[cells[1]]), known[cells[0]] + known[cells[1]]);
            for cell in [a * count + other, other * count + a] {
                (far[cell], known[cell]) = (farther, together);
            }
        }
        for row in (0..count).filter(|&row| members[row].is_some()) {
            let stale = row == a || nearest_of[row].is_none_or(|(_, other)| other == a || other == b);
            if stale {
                nearest_of[row] = nearest(row, &members, &far, &known);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_merged_by_their_largest_distances() {
        let places = [0., 1., 3., 10., f64::NAN];
        let groups = groups(5, |a, b| f64::abs(places[a] - places[b]));
        let found: Vec<(&[usize], f64, f64)> =
            groups.iter().map(|group| (&group.markers[..], group.height, group.merged_at)).collect();
        assert_eq!(found, [(&[0, 1][..], 1., 3.), (&[0, 1, 2], 3., 10.), (&[0, 1, 2, 3], 10., f64::INFINITY)]);
    }
}
