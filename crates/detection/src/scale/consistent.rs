//! The scales of all bodies of a recording, agreed on by all pairs that show one.

use jointscope_motion::nalgebra::{DMatrix, DVector};

use super::Belief;

/// The logarithm of a pair's scale as its own motion shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shown {
    pub(crate) pair: (usize, usize),
    pub(crate) logarithm: f64,
    pub(crate) standard_error: f64,
}

/// What pairs together say of the scale between two bodies: `None` if no chain of pairs connects them.
///
/// Least squares over one logarithm per body, of which one in every group is free: N - 1 factors, not N².
pub(crate) fn agree(bodies: usize, shown: &[Shown], (from, to): (usize, usize)) -> Option<Belief> {
    let groups = groups(bodies, shown);
    if groups[from] != groups[to] {
        return None;
    }
    // What is free in a group is its mean, which differences do not see.
    let mut normal = DMatrix::from_fn(bodies, bodies, |i, j| if groups[i] == groups[j] { 1.0 } else { 0.0 });
    let scale = shown.iter().map(weight).fold(0.0, f64::max).max(1.0);
    normal *= scale;
    let mut right = DVector::zeros(bodies);
    for one in shown {
        let ((i, j), weight) = (one.pair, weight(one));
        normal[(i, i)] += weight;
        normal[(j, j)] += weight;
        normal[(i, j)] -= weight;
        normal[(j, i)] -= weight;
        right[j] += weight * one.logarithm;
        right[i] -= weight * one.logarithm;
    }
    let factor = normal.cholesky()?;
    let mut difference = DVector::zeros(bodies);
    difference[to] += 1.0;
    difference[from] -= 1.0;
    let solution = factor.solve(&difference);
    let deviation = difference.dot(&solution).max(0.0).sqrt();
    Some(Belief { mean: solution.dot(&right), deviation })
}

/// By what every body is multiplied to be in one scale with the others: 1 for the `base`, or the first of a group of
/// bodies that chains of pairs connect.
pub(crate) fn factors(bodies: usize, base: Option<usize>, shown: &[Shown]) -> Vec<f64> {
    let groups = groups(bodies, shown);
    let leader = |body: usize| {
        let base = base.filter(|base| groups[*base] == groups[body]);
        base.or_else(|| groups.iter().position(|group| *group == groups[body])).unwrap_or(body)
    };
    let factor = |body: usize| match leader(body) {
        leader if leader == body => 1.0,
        leader => agree(bodies, shown, (leader, body)).map_or(1.0, |belief| belief.mean.exp()),
    };
    (0..bodies).map(factor).collect()
}

fn weight(shown: &Shown) -> f64 {
    shown.standard_error.max(1e-9).powi(-2)
}

/// The number of the group that pairs with a scale connect each body to.
fn groups(bodies: usize, shown: &[Shown]) -> Vec<usize> {
    let mut groups: Vec<usize> = (0..bodies).collect();
    for Shown { pair: (i, j), .. } in shown {
        let (kept, joined) = (groups[*i], groups[*j]);
        groups.iter_mut().filter(|group| **group == joined).for_each(|group| *group = kept);
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(pair: (usize, usize), logarithm: f64, standard_error: f64) -> Shown {
        Shown { pair, logarithm, standard_error }
    }

    #[test]
    fn a_ring_of_three_shares_its_closure_error_by_precision() {
        let ring = [shown((0, 1), 0.10, 0.01), shown((1, 2), 0.20, 0.01), shown((0, 2), 0.33, 0.01)];
        let found: Vec<f64> = ring.iter().map(|one| agree(3, &ring, one.pair).expect("connected").mean).collect();
        // 0.03 is to be shared by three alike, and the factors are those of two bodies.
        for (found, expected) in found.iter().zip([0.11, 0.21, 0.32]) {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
        assert!((found[0] + found[1] - found[2]).abs() < 1e-12);
        let sure = [ring[0], ring[1], shown((0, 2), 0.33, 1e-6)];
        assert!((agree(3, &sure, (0, 2)).expect("connected").mean - 0.33).abs() < 1e-6);
    }

    #[test]
    fn variances_add_along_a_chain_and_nothing_is_said_across_a_gap() {
        let chain = [shown((0, 1), 0.1, 0.03), shown((1, 2), 0.2, 0.04)];
        let belief = agree(4, &chain, (2, 0)).expect("connected");
        assert!((belief.mean + 0.3).abs() < 1e-9 && (belief.deviation - 0.05).abs() < 1e-9, "{belief:?}");
        assert_eq!(agree(4, &chain, (0, 3)), None);
    }

    #[test]
    fn bodies_are_put_into_the_scale_of_the_base_or_of_the_first_of_their_group() {
        let shown = [shown((0, 1), 0.1, 0.01), shown((1, 2), 0.2, 0.01)];
        let logarithms =
            |base| factors(4, base, &shown).into_iter().map(|x| (x.ln() * 1e9).round() / 1e9).collect::<Vec<_>>();
        assert_eq!(logarithms(None), [0.0, 0.1, 0.3, 0.0]);
        assert_eq!(logarithms(Some(2)), [-0.3, -0.2, 0.0, 0.0]);
        assert_eq!(logarithms(Some(3)), [0.0, 0.1, 0.3, 0.0]);
    }
}
