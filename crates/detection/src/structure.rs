//! From the joints of pairs to one mechanism.

use jointscope_models::{Axis, Mobility, Positions};
use jointscope_motion::{
    Body, Observation, Pose,
    nalgebra::{DMatrix, Point3, Unit, Vector3},
    stay_but_for,
};

use crate::{JointKind, ModelFinding, PairDetection};

/// A tree of joints, from which all that was detected follows, or nearly so.
///
/// # Definition
/// The joints of the tree are those whose evidence, taken together, is largest: a maximum spanning tree over all pairs,
/// weighed by how much likelier the joint makes their motion than no joint would. A pair beside the tree that has fewer
/// freedoms than the joints on the way between its bodies closes a loop; every other one follows from that way.
///
/// # Convention
/// Bodies and pairs are indices into [`Detection::bodies`](crate::Detection::bodies) and
/// [`Detection::pairs`](crate::Detection::pairs).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Structure {
    /// The body from which the mechanism is seen: the one named, or one at rest, or the one in the middle.
    pub base: usize,
    /// How every other body hangs on one that comes before it: parents stand before their children.
    pub branches: Vec<Branch>,
    /// Pairs that are not in the tree.
    pub indirect: Vec<Indirect>,
    /// Joints that moved in proportion.
    pub couplings: Vec<Coupling>,
}

/// How a body hangs on another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Branch {
    /// The body that comes first.
    pub parent: usize,
    /// The body that hangs on it.
    pub child: usize,
    /// The pair whose joint connects them; `None` where nothing connects the child, and all that hangs on it, to the
    /// base. The parent is then the base.
    pub pair: Option<usize>,
}

/// A pair that is not in the tree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Indirect {
    /// The pair.
    pub pair: usize,
    /// The pairs on the way from its reference to its moving body; empty if no joints lead there.
    pub way: Vec<usize>,
    /// Whether the pair's joint allows less than that way: then it is a joint as well, and closes a loop.
    pub closes_loop: bool,
}

/// Two joints of one freedom that moved in proportion, to and fro: `position = ratio · other's position + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// The pair of the joint that follows.
    pub pair: usize,
    /// The pair of the joint that is followed.
    pub of: usize,
    /// Metres or radians of the one per metre or radian of the other.
    pub ratio: f64,
    /// Position of the one where that of the other is 0, metres or radians.
    pub offset: f64,
}

impl Structure {
    /// Bodies that move as one, every group as a list; the base's first.
    pub fn links(&self, pairs: &[PairDetection]) -> Vec<Vec<usize>> {
        let mut links = vec![vec![self.base]];
        for branch in &self.branches {
            let rigid = branch.pair.is_some_and(|pair| pairs[pair].kind() == JointKind::Rigid);
            match links.iter_mut().find(|link| link.contains(&branch.parent)) {
                Some(link) if rigid => link.push(branch.child),
                _ => links.push(vec![branch.child]),
            }
        }
        links
    }

    /// The structure of judged pairs.
    ///
    /// `poses` are `recording_from_body`; `base` is the body asked for.
    pub(crate) fn of(
        bodies: &[Body],
        poses: &[Vec<Option<Pose>>],
        pairs: &[PairDetection],
        base: Option<usize>,
    ) -> Self {
        let index = |name: &str| bodies.iter().position(|body| body.name() == name).unwrap_or(0);
        let ends: Vec<[usize; 2]> = pairs.iter().map(|pair| [index(&pair.reference), index(&pair.moving)]).collect();
        let tree = spanning(bodies.len(), pairs, &ends);
        let base = base.unwrap_or_else(|| base_of(bodies, poses, pairs, &tree, &ends));
        let branches = branches(base, bodies.len(), &tree, &ends);
        let parents = parents(bodies.len(), &branches);
        let beside = (0..pairs.len()).filter(|pair| !tree.contains(pair));
        let indirect = beside.map(|pair| {
            let way = way(ends[pair], &parents);
            let direct = pairs[pair].kind().freedoms();
            let closes_loop = pairs[pair].determined
                && pairs[pair].kind().connects()
                && !way.is_empty()
                && direct < freedoms(&way, pairs, &ends, poses);
            Indirect { pair, way, closes_loop }
        });
        let indirect = indirect.collect();
        Self { base, branches, indirect, couplings: couplings(&tree, pairs) }
    }
}

/// The pairs of the maximum spanning forest, in the order of their weight (Kruskal).
fn spanning(bodies: usize, pairs: &[PairDetection], ends: &[[usize; 2]]) -> Vec<usize> {
    let mut order: Vec<(usize, f64)> = (0..pairs.len())
        .filter(|&pair| pairs[pair].kind().connects())
        .map(|pair| (pair, weight(&pairs[pair])))
        .collect();
    // Equal ones stay in the order of pairs.
    order.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut group: Vec<usize> = (0..bodies).collect();
    let mut tree = Vec::new();
    for (pair, _) in order {
        let [a, b] = ends[pair].map(|body| group[body]);
        if a != b {
            group.iter_mut().filter(|group| **group == b).for_each(|group| *group = a);
            tree.push(pair);
        }
    }
    tree
}

/// How much likelier the joint is than none, in units of -2 log likelihood; from models without evidence, how sure.
fn weight(pair: &PairDetection) -> f64 {
    let evidence = |finding: &ModelFinding| finding.as_ref().ok()?.evidence;
    let all = || pair.models.values().filter_map(evidence);
    let least = all().map(|evidence| evidence.noise_cost()).fold(f64::INFINITY, f64::min);
    let cost = |evidence: jointscope_models::Evidence| {
        let noise = evidence.noise_cost() - least;
        let misfit = evidence.departure.map_or(noise, |departure| departure.charge(noise));
        misfit + evidence.mobility.parameters as f64 * evidence.observations.max(1.0).ln() + evidence.prior_cost
    };
    let free = all().find(|evidence| is_free(evidence.mobility));
    let chosen = pair.models.get(&pair.verdict.joint).and_then(evidence);
    match free.zip(chosen) {
        Some((free, chosen)) => cost(free) - pair.verdict.cost.unwrap_or_else(|| cost(chosen)),
        None => -(1.0 - pair.verdict.confidence).max(f64::MIN_POSITIVE).ln(),
    }
}

fn is_free(mobility: Mobility) -> bool {
    mobility.turns == 3 && mobility.slides == 3
}

/// The body from which a mechanism is best seen: the first one at rest, or the one with most joints.
fn base_of(
    bodies: &[Body],
    poses: &[Vec<Option<Pose>>],
    pairs: &[PairDetection],
    tree: &[usize],
    ends: &[[usize; 2]],
) -> usize {
    let posed = |body: usize| poses[body].iter().any(Option::is_some);
    let noise = |body: usize| {
        let of_pair = |(pair, [reference, moving]): (&PairDetection, &[usize; 2])| match body {
            body if body == *reference => pair.noise_reference.position,
            body if body == *moving => pair.noise_moving.position,
            _ => None,
        };
        pairs.iter().zip(ends).find_map(of_pair).unwrap_or(0.0)
    };
    let joints = |body: usize| tree.iter().filter(|&&pair| ends[pair].contains(&body)).count();
    let resting = (0..bodies.len()).find(|&body| posed(body) && rests(&bodies[body], noise(body)));
    let central = || (0..bodies.len()).max_by_key(|&body| (posed(body), joints(body), std::cmp::Reverse(body)));
    resting.or_else(central).unwrap_or(0)
}

/// Whether a body stays in its place but for noise, metres per coordinate.
fn rests(body: &Body, noise: f64) -> bool {
    match body.observation() {
        Observation::AtRest(_) => true,
        Observation::Points { tracks, .. } => tracks.rest_but_for(noise),
        Observation::Poses(poses) => {
            let places: Vec<Vector3<f64>> = poses.iter().flatten().map(|pose| pose.translation.vector).collect();
            stay_but_for(&places, noise)
        }
    }
}

/// Lets every body hang on one that is nearer to the base. Groups without a joint to the base hang on it freely, by the
/// body of most joints.
fn branches(base: usize, bodies: usize, tree: &[usize], ends: &[[usize; 2]]) -> Vec<Branch> {
    let mut placed = vec![false; bodies];
    let mut branches = Vec::new();
    let joints = |body: usize| tree.iter().filter(|&&pair| ends[pair].contains(&body)).count();
    let mut root = Some(base);
    while let Some(from) = root {
        if from != base {
            branches.push(Branch { parent: base, child: from, pair: None });
        }
        placed[from] = true;
        let mut queue = std::collections::VecDeque::from([from]);
        while let Some(parent) = queue.pop_front() {
            // In the order of bodies.
            let mut next: Vec<(usize, usize)> = tree
                .iter()
                .filter_map(|&pair| match ends[pair] {
                    [a, b] if a == parent => Some((b, pair)),
                    [a, b] if b == parent => Some((a, pair)),
                    _ => None,
                })
                .filter(|(child, _)| !placed[*child])
                .collect();
            next.sort_unstable();
            for (child, pair) in next {
                placed[child] = true;
                branches.push(Branch { parent, child, pair: Some(pair) });
                queue.push_back(child);
            }
        }
        let rest = (0..bodies).filter(|&body| !placed[body]);
        root = rest.max_by_key(|&body| (joints(body), std::cmp::Reverse(body)));
    }
    branches
}

/// The joint, and the body at its other end, by which every body hangs on the one before it.
fn parents(bodies: usize, branches: &[Branch]) -> Vec<Option<(usize, usize)>> {
    let mut parents = vec![None; bodies];
    for Branch { parent, child, pair } in branches {
        parents[*child] = pair.map(|pair| (pair, *parent));
    }
    parents
}

/// The pairs on the way through the tree, in order; empty if no joints lead there.
fn way([from, to]: [usize; 2], parents: &[Option<(usize, usize)>]) -> Vec<usize> {
    let up = |body: usize| {
        let mut next = Some((usize::MAX, body));
        std::iter::from_fn(move || {
            let (pair, body) = next?;
            next = parents[body];
            Some((pair, body))
        })
        .collect::<Vec<_>>()
    };
    let (mut there, mut back) = (up(from), up(to));
    if there.last().map(|(_, root)| root) != back.last().map(|(_, root)| root) {
        return Vec::new();
    }
    // What both ways share above the body where they meet is none of the way.
    while there.len() > 1 && back.len() > 1 && there[there.len() - 2].1 == back[back.len() - 2].1 {
        there.pop();
        back.pop();
    }
    there.iter().skip(1).chain(back.iter().skip(1).rev()).map(|(pair, _)| *pair).collect()
}

/// How many ways of moving joints in a row give together: the rank of their twists at a moment when all are seen.
/// Parallel slides give one, turns about one line as well.
fn freedoms(way: &[usize], pairs: &[PairDetection], ends: &[[usize; 2]], poses: &[Vec<Option<Pose>>]) -> usize {
    /// Directions within this angle are one, radians; so are lines whose distance, in metres, is as small.
    const ALIKE: f64 = 0.1;
    let all: usize = way.iter().map(|&pair| pairs[pair].kind().freedoms()).sum();
    let frames = poses.first().map_or(0, Vec::len);
    let references: Vec<usize> = way.iter().map(|&pair| ends[pair][0]).collect();
    let together = |frame: &usize| references.iter().all(|&body| poses[body][*frame].is_some());
    let seen: Vec<usize> = (0..frames).filter(together).collect();
    let Some(&frame) = seen.get(seen.len() / 2) else { return all.min(6) };
    let axes: Vec<(JointKind, Axis)> = way
        .iter()
        .zip(&references)
        .filter_map(|(&pair, &body)| Some((pairs[pair].kind(), pairs[pair].axis?.seen_from(&poses[body][frame]?))))
        .collect();
    let count = axes.len().max(1) as f64;
    let middle = axes.iter().map(|(_, axis)| axis.point.coords).sum::<Vector3<f64>>() / count;
    let twists: Vec<[f64; 6]> = axes.iter().flat_map(|(kind, axis)| twists(*kind, axis, &middle.into())).collect();
    if twists.is_empty() {
        return 0;
    }
    let matrix = DMatrix::from_fn(6, twists.len(), |row, column| twists[column][row]);
    matrix.rank(ALIKE).min(6)
}

/// Twists `[ω; v]` about a point by which a joint moves.
fn twists(kind: JointKind, axis: &Axis, about: &Point3<f64>) -> Vec<[f64; 6]> {
    let both = |w: Vector3<f64>, v: Vector3<f64>| [w.x, w.y, w.z, v.x, v.y, v.z];
    let arm = axis.point - about;
    let turn = |w: Vector3<f64>, pitch: f64| both(w, arm.cross(&w) + w * pitch);
    let slide = |v: Vector3<f64>| both(Vector3::zeros(), v);
    let z = axis.direction.map_or_else(Vector3::z, Unit::into_inner);
    let x = z.cross(&Vector3::ith(z.iamin(), 1.0)).normalize();
    let y = z.cross(&x);
    match kind {
        JointKind::Rigid | JointKind::Disconnected => vec![],
        JointKind::Prismatic => vec![slide(z)],
        JointKind::Revolute | JointKind::Elliptical { .. } => vec![turn(z, 0.0)],
        JointKind::Screw { pitch } => vec![turn(z, pitch)],
        JointKind::Cylindrical => vec![turn(z, 0.0), slide(z)],
        JointKind::Planar => vec![turn(z, 0.0), slide(x), slide(y)],
        JointKind::Spherical => [x, y, z].map(|w| turn(w, 0.0)).into(),
        JointKind::Universal => [x, y].map(|w| turn(w, 0.0)).into(),
    }
}

/// Joints of the tree that moved in proportion, to and fro.
fn couplings(tree: &[usize], pairs: &[PairDetection]) -> Vec<Coupling> {
    let mut tree: Vec<usize> = tree.to_vec();
    tree.sort_unstable();
    let of_one = |&pair: &usize| {
        let positions = pairs[pair].positions.as_ref().filter(|positions| positions.freedoms() == 1)?;
        Some((pair, positions))
    };
    let joints: Vec<(usize, &Positions)> = tree.iter().filter_map(of_one).collect();
    let mut couplings: Vec<Coupling> = Vec::new();
    for (number, &(pair, positions)) in joints.iter().enumerate() {
        let mut leaders = joints[..number].iter().filter(|(of, _)| couplings.iter().all(|known| known.pair != *of));
        let found = leaders.find_map(|&(of, others)| {
            let (ratio, offset) = proportion(positions, others)?;
            Some(Coupling { pair, of, ratio, offset })
        });
        couplings.extend(found);
    }
    couplings
}

/// Ratio and offset of positions that move in proportion.
///
/// Two things moved at once may do so by chance: only what turned back, and did so together, counts.
fn proportion(positions: &Positions, others: &Positions) -> Option<(f64, f64)> {
    /// Frames that both must share.
    const FEWEST: usize = 20;
    /// Greatest root mean square departure from proportion, as a share of the range.
    const DEPARTURE: f64 = 0.02;
    /// Times that both must turn back by a fifth of their range.
    const REVERSALS: usize = 2;
    let both: Vec<[f64; 2]> =
        positions.iter().zip(others.iter()).filter_map(|(q, p)| Some([*p?.first()?, *q?.first()?])).collect();
    if both.len() < FEWEST {
        return None;
    }
    let column = |k: usize| both.iter().map(move |row| row[k]);
    let range = |k: usize| column(k).fold(f64::NEG_INFINITY, f64::max) - column(k).fold(f64::INFINITY, f64::min);
    let count = both.len() as f64;
    let [mean_p, mean_q] = [0, 1].map(|k| column(k).sum::<f64>() / count);
    let square: f64 = column(0).map(|p| (p - mean_p).powi(2)).sum();
    let product: f64 = both.iter().map(|[p, q]| (p - mean_p) * (q - mean_q)).sum();
    let ratio = product / square;
    let offset = mean_q - ratio * mean_p;
    let departure = (both.iter().map(|[p, q]| (q - ratio * p - offset).powi(2)).sum::<f64>() / count).sqrt();
    let turns_back = |k: usize| reversals(column(k), 0.2 * range(k)) >= REVERSALS;
    (departure < DEPARTURE * range(1) && turns_back(0) && turns_back(1)).then_some((ratio, offset))
}

/// How often values turn back by more than `least`.
fn reversals(values: impl Iterator<Item = f64>, least: f64) -> usize {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut rising, mut count) = (None, 0);
    for value in values {
        (low, high) = (low.min(value), high.max(value));
        let turned = match rising {
            Some(true) => high - value > least,
            Some(false) => value - low > least,
            None => {
                if high - low > least {
                    rising = Some(value == high);
                    (low, high) = (value, value);
                }
                false
            }
        };
        if turned {
            count += 1;
            rising = rising.map(|rising: bool| !rising);
            (low, high) = (value, value);
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_goes_to_and_fro_together_is_coupled() {
        let wave = |factor: f64, offset: f64| {
            Positions::of_one_freedom((0..100).map(|t| Some(offset + factor * (f64::from(t) * 0.2).sin())))
        };
        let (ratio, offset) = proportion(&wave(-2.0, 0.5), &wave(1.0, 0.0)).expect("in proportion");
        assert!((ratio + 2.0).abs() < 1e-9 && (offset - 0.5).abs() < 1e-9, "{ratio} {offset}");
        let ramp = |factor: f64| Positions::of_one_freedom((0..100).map(|t| Some(factor * f64::from(t))));
        assert_eq!(proportion(&ramp(1.0), &ramp(3.0)), None);
        assert_eq!(proportion(&wave(1.0, 0.0), &ramp(1.0)), None);
    }

    #[test]
    fn ways_through_the_tree_meet_where_they_part() {
        // 0 - 1 - 2, 1 - 3, and 4 apart; pair 10 b leads up from body b.
        let parents = [None, Some((10, 0)), Some((20, 1)), Some((30, 1)), None];
        assert_eq!(way([2, 3], &parents), [20, 30]);
        assert_eq!(way([0, 3], &parents), [10, 30]);
        assert_eq!(way([2, 0], &parents), [20, 10]);
        assert_eq!(way([2, 1], &parents), [20]);
        assert_eq!((way([2, 4], &parents), way([3, 3], &parents)), (vec![], vec![]));
    }

    #[test]
    fn parallel_slides_are_one_freedom_and_parallel_hinges_are_two() {
        let axis = |x: f64| Axis { point: Point3::new(x, 0.0, 0.0), direction: Some(Vector3::z_axis()), pitch: None };
        let rank = |kind: JointKind, places: [f64; 2]| {
            let twists: Vec<[f64; 6]> =
                places.iter().flat_map(|x| twists(kind, &axis(*x), &Point3::origin())).collect();
            DMatrix::from_fn(6, twists.len(), |row, column| twists[column][row]).rank(0.1)
        };
        assert_eq!(rank(JointKind::Prismatic, [0.0, 1.0]), 1);
        assert_eq!(rank(JointKind::Revolute, [0.0, 1.0]), 2);
        assert_eq!(rank(JointKind::Revolute, [1.0, 1.0]), 1);
    }
}
