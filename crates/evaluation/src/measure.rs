//! What is measured of many verdicts.

use std::collections::BTreeSet;

use serde::Serialize;

use crate::{class, measurement::Measurement};

/// What is measured of many verdicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Share whose joint is right among the eight types, percent.
    Types,
    /// Share whose joint is right among the four classes, percent: the mean of the shares of every class, so that the
    /// many joints of the class `other` count no more than those of another class.
    Classes,
    /// Share of all verdicts whose joint is right among the four classes, percent.
    Classified,
    /// Root mean square angle between the fitted and the true revolute axis, degrees.
    Angle,
    /// Root mean square distance of the true revolute axis from the fitted one, at the moving body, millimetres.
    Distance,
    /// Median of that angle, degrees.
    MedianAngle,
    /// Median of that distance, millimetres.
    MedianDistance,
    /// The median angle over that of the row's first cell.
    AngleGrowth,
    /// The median distance over that of the row's first cell.
    DistanceGrowth,
    /// Mean square of the axis's angle over what the model states for it.
    NormalisedAngle,
    /// Mean square of the axis's distance over what the model states for it.
    NormalisedDistance,
    /// Share in which the order of the bodies makes no difference, percent.
    Symmetric,
    /// Root mean square error of the scales that show, percent.
    ScaleError,
    /// Share whose scale is said to show, percent.
    ScaleShown,
    /// Share whose scale is said not to show, percent.
    ScaleNotShown,
    /// Root mean square error of the moving bodies' depth gains, percent.
    GainError,
    /// Share of the class `other` that is taken for rigid, prismatic or revolute, percent.
    FalseJoints,
    /// That share less that of the row's first cell.
    FalseJointsAdded,
    /// Mean number of pairs, per seed, whose joint is right among the four classes.
    PairsRight,
    /// Mean of the reported noise over the true noise.
    Noise,
    /// That ratio where it is farthest from 1.
    WorstNoise,
    /// Mean of what the true joint's model leaves unexplained, per degree of freedom.
    ChiSquared,
}

/// A value that was measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Score {
    /// In the unit of its measure.
    pub value: f64,
    /// Verdicts that should have counted, but lack what is measured.
    pub missing: usize,
}

impl Measure {
    /// Name with the unit, for the head of a column.
    pub fn title(self) -> &'static str {
        match self {
            Self::Types => "types [%]",
            Self::Classes => "classes [%]",
            Self::Classified => "classified [%]",
            Self::Angle => "angle [deg]",
            Self::Distance => "distance [mm]",
            Self::MedianAngle => "median angle [deg]",
            Self::MedianDistance => "median distance [mm]",
            Self::AngleGrowth => "angle / first",
            Self::DistanceGrowth => "distance / first",
            Self::NormalisedAngle => "normalised angle",
            Self::NormalisedDistance => "normalised distance",
            Self::Symmetric => "symmetric [%]",
            Self::ScaleError => "scale [%]",
            Self::ScaleShown => "shown [%]",
            Self::ScaleNotShown => "not shown [%]",
            Self::GainError => "gain [%]",
            Self::FalseJoints => "false joints [%]",
            Self::FalseJointsAdded => "added [%]",
            Self::PairsRight => "pairs right",
            Self::Noise => "noise / true",
            Self::WorstNoise => "worst",
            Self::ChiSquared => "chi2 / freedom",
        }
    }

    /// Decimals that are worth reading.
    pub fn decimals(self) -> usize {
        match self {
            Self::Types
            | Self::Classes
            | Self::Classified
            | Self::Symmetric
            | Self::PairsRight
            | Self::ScaleShown
            | Self::ScaleNotShown
            | Self::FalseJoints
            | Self::FalseJointsAdded => 1,
            Self::Noise | Self::WorstNoise | Self::ChiSquared | Self::ScaleError => 3,
            _ => 2,
        }
    }

    /// The value over measurements of one cell; `first` are those of the row's first cell. `None` where the column or
    /// its models do not give what is measured.
    pub(crate) fn score(self, all: &[&Measurement], first: &[&Measurement], tells_types: bool) -> Option<Score> {
        let hinges = all.iter().filter(|m| m.expected == "revolute");
        match self {
            Self::Types if !tells_types => None,
            Self::Types => share(all.iter().map(|m| m.found == m.expected)),
            Self::Classes => balanced(all),
            Self::Classified => share(all.iter().map(|m| in_right_class(m))),
            Self::Symmetric => share(all.iter().filter_map(|m| m.symmetric)),
            Self::ScaleError => over(all.iter(), |m| Some(100.0 * m.scale_error?), root_mean_square),
            Self::ScaleShown => share(all.iter().filter_map(|m| m.shows_scale)),
            Self::ScaleNotShown => share(all.iter().filter_map(|m| Some(!m.shows_scale?))),
            Self::GainError => over(all.iter(), |m| Some(100.0 * m.gain_error?), root_mean_square),
            Self::FalseJoints => {
                share(all.iter().filter(|m| class(&m.expected) == "other").map(|m| !in_right_class(m)))
            }
            Self::FalseJointsAdded => {
                let (here, there) =
                    (Self::FalseJoints.score(all, &[], false)?, Self::FalseJoints.score(first, &[], false)?);
                Some(Score { value: here.value - there.value, missing: 0 })
            }
            Self::PairsRight => pairs_right(all),
            Self::Angle => over(hinges, angle, root_mean_square),
            Self::Distance => over(hinges, distance, root_mean_square),
            Self::MedianAngle => over(hinges, angle, median),
            Self::MedianDistance => over(hinges, distance, median),
            Self::AngleGrowth => growth(Self::MedianAngle, all, first),
            Self::DistanceGrowth => growth(Self::MedianDistance, all, first),
            Self::NormalisedAngle => over(hinges, |m| squared_ratio(m.axis?.angle, m.stated?.angle?), mean),
            Self::NormalisedDistance => over(hinges, |m| squared_ratio(m.axis?.distance, m.stated?.distance?), mean),
            Self::Noise => over(all.iter(), |m| m.noise_ratio, mean),
            Self::WorstNoise => over(all.iter(), |m| m.noise_ratio, farthest_from_one),
            Self::ChiSquared => over(all.iter(), |m| m.chi_squared_per_freedom, mean),
        }
    }
}

fn angle(measurement: &Measurement) -> Option<f64> {
    measurement.axis.map(|axis| axis.angle.to_degrees())
}

fn distance(measurement: &Measurement) -> Option<f64> {
    measurement.axis.map(|axis| 1000.0 * axis.distance)
}

fn squared_ratio(error: f64, stated: f64) -> Option<f64> {
    (stated > 0.0).then(|| (error / stated).powi(2))
}

fn share(right: impl Iterator<Item = bool>) -> Option<Score> {
    let right: Vec<bool> = right.collect();
    let count = right.iter().filter(|right| **right).count();
    (!right.is_empty()).then(|| Score { value: 100.0 * count as f64 / right.len() as f64, missing: 0 })
}

fn in_right_class(measurement: &Measurement) -> bool {
    class(&measurement.found) == class(&measurement.expected)
}

/// The mean over the classes of the share that is right.
fn balanced(all: &[&Measurement]) -> Option<Score> {
    let classes: BTreeSet<&str> = all.iter().map(|m| class(&m.expected)).collect();
    let of_class = |name: &str| share(all.iter().filter(|m| class(&m.expected) == name).map(|m| in_right_class(m)));
    let shares: Vec<f64> = classes.into_iter().filter_map(of_class).map(|score| score.value).collect();
    (!shares.is_empty()).then(|| Score { value: mean(&shares), missing: 0 })
}

fn pairs_right(all: &[&Measurement]) -> Option<Score> {
    let right = all.iter().filter(|m| in_right_class(m)).count();
    let seeds: BTreeSet<u64> = all.iter().map(|m| m.seed).collect();
    (!seeds.is_empty()).then(|| Score { value: right as f64 / seeds.len() as f64, missing: 0 })
}

/// Sums up what measurements give, if any of them does.
fn over<'m>(
    all: impl Iterator<Item = &'m &'m Measurement>,
    value: impl Fn(&Measurement) -> Option<f64>,
    sum_up: impl Fn(&[f64]) -> f64,
) -> Option<Score> {
    let values: Vec<Option<f64>> = all.map(|m| value(m).filter(|value| value.is_finite())).collect();
    let there: Vec<f64> = values.iter().copied().flatten().collect();
    let missing = values.len() - there.len();
    (!there.is_empty()).then(|| Score { value: sum_up(&there), missing })
}

fn growth(of: Measure, all: &[&Measurement], first: &[&Measurement]) -> Option<Score> {
    let (here, there) = (of.score(all, &[], false)?, of.score(first, &[], false)?);
    let ratio = here.value / there.value;
    ratio.is_finite().then_some(Score { value: ratio, missing: here.missing + there.missing })
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn root_mean_square(values: &[f64]) -> f64 {
    mean(&values.iter().map(|value| value * value).collect::<Vec<_>>()).sqrt()
}

fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { f64::midpoint(values[middle - 1], values[middle]) }
}

fn farthest_from_one(values: &[f64]) -> f64 {
    let badness = |value: f64| value.ln().abs();
    values.iter().fold(1.0, |worst, &value| if badness(value) > badness(worst) { value } else { worst })
}

#[cfg(test)]
pub(crate) mod tests {
    use jointscope_models::AxisUncertainty;

    use super::*;
    use crate::AxisError;

    pub(crate) fn verdict(expected: &str, found: &str) -> Measurement {
        Measurement {
            scene: "revolute",
            seed: 1,
            expected: expected.into(),
            found: found.into(),
            confidence: 0.9,
            determined: true,
            axis: None,
            stated: None,
            noise_ratio: None,
            chi_squared_per_freedom: None,
            scale_error: None,
            shows_scale: None,
            gain_error: None,
            symmetric: None,
            seconds: 0.001,
        }
    }

    fn hinge(degrees: f64, millimetres: f64) -> Measurement {
        let axis = AxisError { angle: degrees.to_radians(), distance: millimetres / 1000.0 };
        let stated = AxisUncertainty { angle: Some(1_f64.to_radians()), distance: Some(0.002) };
        Measurement { axis: Some(axis), stated: Some(stated), ..verdict("revolute", "revolute") }
    }

    fn value(measure: Measure, all: &[Measurement]) -> Option<f64> {
        let all: Vec<&Measurement> = all.iter().collect();
        measure.score(&all, &[], true).map(|score| (score.value * 1e9).round() / 1e9)
    }

    #[test]
    fn types_and_classes_count_what_is_right() {
        let all = [
            verdict("rigid", "rigid"),
            verdict("screw", "cylindrical"),
            verdict("planar", "disconnected"),
            verdict("revolute", "screw"),
        ];
        assert_eq!(value(Measure::Types, &all), Some(25.0));
        assert_eq!(value(Measure::Classified, &all), Some(75.0));
        // Of rigid all, of revolute none, of other all.
        assert_eq!(value(Measure::Classes, &all), Some((200.0 / 3.0 * 1e9_f64).round() / 1e9));
        let all: Vec<&Measurement> = all.iter().collect();
        assert_eq!(Measure::Types.score(&all, &[], false), None, "a rule of four joints is not asked for eight");
        assert_eq!(value(Measure::Classes, &[]), None);
    }

    #[test]
    fn false_joints_are_counted_where_there_is_none() {
        let (none, joint) = (verdict("planar", "cylindrical"), verdict("planar", "prismatic"));
        let hinge = verdict("revolute", "rigid");
        assert_eq!(value(Measure::FalseJoints, &[none.clone(), joint.clone(), hinge.clone()]), Some(50.0));
        assert_eq!(value(Measure::FalseJoints, &[hinge]), None);
        let added = Measure::FalseJointsAdded.score(&[&none, &joint], &[&joint], true);
        assert_eq!(added.map(|score| score.value), Some(-50.0));
    }

    #[test]
    fn axis_errors_are_summed_up_over_hinges_alone_and_missing_ones_are_counted() {
        let all = [hinge(3.0, 1.0), hinge(4.0, 7.0), verdict("revolute", "rigid"), verdict("rigid", "rigid")];
        assert_eq!(value(Measure::Angle, &all), Some((12.5_f64.sqrt() * 1e9).round() / 1e9));
        assert_eq!(value(Measure::Distance, &all), Some(5.0));
        assert_eq!(value(Measure::MedianAngle, &all), Some(3.5));
        assert_eq!(value(Measure::MedianDistance, &all[..1]), Some(1.0));
        assert_eq!(value(Measure::NormalisedAngle, &all), Some(12.5));
        assert_eq!(value(Measure::NormalisedDistance, &all), Some(6.25));
        let all: Vec<&Measurement> = all.iter().collect();
        assert_eq!(Measure::Angle.score(&all, &[], true).map(|score| score.missing), Some(1));
        assert_eq!(Measure::Angle.score(&all[2..], &[], true), None);
        let [few, many] = [hinge(1.0, 2.0), hinge(1.2, 4.0)];
        let growth = |measure: Measure| measure.score(&[&many], &[&few], true).map(|score| score.value);
        assert!((growth(Measure::AngleGrowth).expect("axes") - 1.2).abs() < 1e-12);
        assert!((growth(Measure::DistanceGrowth).expect("axes") - 2.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_a_number_counts_as_missing() {
        let noisy = |ratio| Measurement { noise_ratio: Some(ratio), ..verdict("rigid", "rigid") };
        let all = [noisy(1.1), noisy(0.5), noisy(f64::INFINITY), noisy(f64::NAN), noisy(1.4)];
        assert_eq!((value(Measure::Noise, &all), value(Measure::WorstNoise, &all)), (Some(1.0), Some(0.5)));
        assert_eq!(value(Measure::ChiSquared, &all), None);
    }

    #[test]
    fn pairs_are_counted_per_seed() {
        let of = |seed, found| Measurement { seed, ..verdict("revolute", found) };
        let all = [of(1, "revolute"), of(1, "rigid"), of(2, "revolute"), of(2, "revolute")];
        assert_eq!(value(Measure::PairsRight, &all), Some(1.5));
    }
}
