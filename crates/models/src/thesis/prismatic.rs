//! `thesis-prismatic`: all trajectories inside one straight tube, and of one length.

use jointscope_motion::{Columns, RelativeMotion, Trajectory, extent, farthest_of_rows, path_length};
use nalgebra::{Point3, Unit, Vector3, distance_squared};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::lanes::{Tallied, along_tube};
use super::{above_rounding, positions, q_function, trajectories};
use crate::{Axis, Confidence, FitError, Joint, JointFit, JointModel, Positions, joint_model};

/// Prismatic joint: every feature moves along one straight line, all in the same direction and by the same length.
///
/// `confidence = lines_equal · cylinder_fit`. All trajectories are shifted to start where the longest one starts.
/// `cylinder_fit` is the share of their points inside a tube around the line from start to farthest point, taken in
/// sections along the tube, the weakest of which counts. `lines_equal = 1 - Q(mean length / greatest length, μ, λ)`.
///
/// Convention: the direction points from the first position to the farthest one, where positions are positive; the
/// axis goes through the moving body's centroid at the first frame.
///
/// Degenerate cases: without any motion there is no direction and the confidence is 0. The confidence never exceeds
/// Φ(2.8) = 0.9974. Arcs below 45° lie inside a tube of a tenth of their chord, so that a far hinge of short sweep is
/// called prismatic.
///
/// References: thesis section 5.2, equations (13)-(20); (13) as `T_i(P_j) - T_i(P_0) + T_R(P_0)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ThesisPrismatic {
    /// Radius of the tube, as a share of its length.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub tube_radius: f64,
    /// Sections along the tube; 1 counts all points together, as in equation (15).
    #[schemars(range(min = 1, max = 1_000_000))]
    pub sections: usize,
    /// What a section without any point says.
    pub empty_sections: EmptySections,
    /// What becomes of points before the start or beyond the end of the tube.
    pub overshoot: Overshoot,
    /// Which trajectory is the longest one, to which the others are aligned.
    pub longest: Longest,
    /// μ of equation (19): the mean relative length that is half convincing.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub equal_mean: f64,
    /// λ of equation (19): how sharply the score rises there.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub equal_steepness: f64,
    /// Adapt the number of sections to the number of samples (footnote 2 of the thesis): as many equal sections as
    /// have `section_samples` samples each on average, at most 100, neighbours merged until each has that many.
    pub adaptive_sections: bool,
    /// Least samples of a section when sections adapt.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub section_samples: usize,
}

/// What a section of the tube without any point says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EmptySections {
    /// Nothing.
    Skip,
    /// That the motion is not prismatic.
    Zero,
}

/// What becomes of points that lie before the start or beyond the end of the tube.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Overshoot {
    /// They count in the first or last section.
    Clamp,
    /// They do not count.
    Drop,
}

/// Which trajectory is the longest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Longest {
    /// The one with the largest distance between two of its points.
    Extent,
    /// The one with the longest path.
    Path,
}

impl Default for ThesisPrismatic {
    fn default() -> Self {
        Self {
            tube_radius: 0.1,
            sections: 10,
            empty_sections: EmptySections::Skip,
            overshoot: Overshoot::Clamp,
            longest: Longest::Extent,
            equal_mean: 0.93,
            equal_steepness: 40.0,
            adaptive_sections: false,
            section_samples: 20,
        }
    }
}

/// The tube's end, in its lengths, beyond what rounding makes of the farthest point.
pub(super) const END: f64 = 1.0 + 1e-12;

joint_model!(ThesisPrismatic, "thesis-prismatic", "equal straight trajectories inside a tube (thesis 5.2)");

impl JointModel for ThesisPrismatic {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let seen = match motion.columns().filter(|columns| columns.frames() > 1) {
            Some(columns) => self.see_rows(columns),
            None => self.see(&trajectories(motion, 2)?),
        };
        let Some(Seen { tube, cylinder_fit, mean_length, off_line, features, alone, slides }) = seen else {
            return Ok(JointFit::new(Confidence::ZERO, Joint::default())
                .with_part("cylinder_fit", 0.0)
                .with_part("lines_equal", 0.0));
        };
        let lines_equal = 1.0 - q_function(mean_length, self.equal_mean, self.equal_steepness);

        let slides = match slides {
            Some(slides) => positions::by_frame(motion, slides.into_iter()),
            None => positions::slides(motion, tube.direction),
        };
        let (direction, reverse) =
            if positions::points_backwards(&slides) { (-tube.direction, true) } else { (tube.direction, false) };
        let slides = Positions::of_one_freedom(slides);
        let axis = Axis { point: motion.first_centroid(), direction: Some(direction), pitch: None };
        let joint = Joint { axis: Some(axis), positions: Some(if reverse { slides.reversed() } else { slides }) };
        let mut fit = JointFit::new(Confidence::new(lines_equal * cylinder_fit)?, joint)
            .with_part("cylinder_fit", cylinder_fit)
            .with_part("lines_equal", lines_equal)
            .with_part("mean_relative_length", mean_length)
            .with_part("length", tube.length)
            .with_residual(off_line);
        if alone > 0 {
            fit.notes.push(format!(
                "{alone} of {features} features never share a frame with the longest one and were left out"
            ));
        }
        Ok(fit)
    }

    fn parts(&self) -> &'static [&'static str] {
        &["cylinder_fit", "lines_equal", "mean_relative_length", "length"]
    }
}

/// What the trajectories show of a slide.
struct Seen {
    tube: Tube,
    /// Share of points inside the tube, in the section where it is least.
    cylinder_fit: f64,
    /// Mean over features of their length relative to the longest.
    mean_length: f64,
    /// Root mean square distance of the samples from the line, metres.
    off_line: f64,
    features: usize,
    /// Features that never share a frame with the longest one.
    alone: usize,
    /// How far the features went along the tube in every frame, metres, where that was seen along with it.
    slides: Option<Vec<f64>>,
}

impl ThesisPrismatic {
    /// `None` without any motion.
    fn see(&self, tracks: &[Trajectory<'_>]) -> Option<Seen> {
        let extents: Vec<f64> = tracks.iter().map(|t| extent(t.points)).collect();
        let longest = match self.longest {
            Longest::Extent => first_longest(extents.iter().copied()),
            Longest::Path => first_longest(tracks.iter().map(|t| path_length(t.points))),
        };
        let tube = Tube::along(tracks[longest].points.iter().copied())?;
        let samples = || tracks.iter().flat_map(|t| aligned(t, &tracks[longest])).map(|p| tube.place(&p));
        let (sum, count) = samples().fold((0.0, 0), |(sum, count), (_, off)| (sum + off * off, count + 1));
        Some(Seen {
            cylinder_fit: self.cylinder_fit(samples()),
            mean_length: mean_relative_length(tracks, &extents, longest),
            off_line: (sum / f64::from(count.max(1))).sqrt() * tube.length,
            features: tracks.len(),
            alone: tracks.iter().filter(|t| common(t, &tracks[longest]).next().is_none()).count(),
            tube,
            slides: None,
        })
    }

    /// The same of features that are always seen.
    fn see_rows(&self, columns: Columns<'_>) -> Option<Seen> {
        let count = columns.features() as f64;
        let summaries = columns.summaries();
        let extents = summaries.iter().map(|one| one.extent);
        let longest = match self.longest {
            Longest::Extent => first_longest(extents.clone()),
            Longest::Path => first_longest(summaries.iter().map(|one| one.path)),
        };
        let (start, magnitude) = (summaries[longest].first, summaries[longest].magnitude);
        let tube = columns.of(longest, |rows| {
            Tube::between(start, rows.point(farthest_of_rows(rows.coordinates, &start)), magnitude)
        })?;
        let sections = self.section_count(columns.frames() * columns.features());
        let line = tube.direction.into_inner() * tube.length;
        let mut tallied = Tallied::new(line, self.tube_radius, self.overshoot, sections, columns.frames());
        let mut squares = 0.0;
        columns.in_turn(|frame, rows| {
            let starts = rows.iter().zip(summaries);
            squares += starts.map(|(rows, known)| along_tube(*rows, known.first, frame, &mut tallied)).sum::<f64>();
        });
        let slides = tallied.slides(columns.features());
        let greatest = extents.clone().fold(0.0, f64::max);
        Some(Seen {
            cylinder_fit: self.weakest(tallied.sections()),
            mean_length: extents.map(|own| own / greatest).sum::<f64>() / count,
            off_line: above_rounding((squares / (count * columns.frames() as f64)).sqrt() * tube.length, columns),
            features: columns.features(),
            alone: 0,
            tube,
            slides: Some(slides),
        })
    }

    fn section_count(&self, samples: usize) -> usize {
        if self.adaptive_sections { (samples / self.section_samples).clamp(1, 100) } else { self.sections }
    }

    /// Share of points inside the tube, in the section where it is least.
    fn cylinder_fit(&self, samples: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
        let count = self.section_count(samples.clone().count());
        let mut sections = vec![Section::default(); count];
        for (along, off) in samples {
            if self.overshoot == Overshoot::Drop && !(0.0..=END).contains(&along) {
                continue;
            }
            // A negative share becomes section 0, as clamping demands.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let index = ((along * count as f64) as usize).min(count - 1);
            sections[index].all += 1;
            sections[index].inside += usize::from(off < self.tube_radius);
        }
        self.weakest(sections)
    }

    fn weakest(&self, mut sections: Vec<Section>) -> f64 {
        if self.adaptive_sections {
            sections = merged(&sections, self.section_samples);
        }
        let share = |section: &Section| match (section.all, self.empty_sections) {
            (0, EmptySections::Skip) => None,
            (0, EmptySections::Zero) => Some(0.0),
            _ => Some(section.inside as f64 / section.all as f64),
        };
        sections.iter().filter_map(share).reduce(f64::min).unwrap_or(0.0)
    }
}

/// The first of the longest.
fn first_longest(lengths: impl Iterator<Item = f64>) -> usize {
    let longer = |best: (usize, f64), (index, length)| if length > best.1 { (index, length) } else { best };
    lengths.enumerate().fold((0, f64::NEG_INFINITY), longer).0
}

/// Points counted in a section of the tube.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Section {
    all: usize,
    inside: usize,
}

impl Section {
    pub(super) fn new(all: usize, inside: usize) -> Self {
        Self { all, inside }
    }
}

/// Joins neighbouring sections until each has `least` points; what is left over joins the last.
fn merged(sections: &[Section], least: usize) -> Vec<Section> {
    let join = |a: Section, b: Section| Section { all: a.all + b.all, inside: a.inside + b.inside };
    let (mut done, mut open): (Vec<Section>, Section) = (Vec::new(), Section::default());
    for &section in sections {
        open = join(open, section);
        if open.all >= least {
            done.push(std::mem::take(&mut open));
        }
    }
    match done.last_mut() {
        Some(last) => *last = join(*last, open),
        None => done.push(open),
    }
    done
}

/// The straight line from a trajectory's start to its farthest point.
struct Tube {
    start: Point3<f64>,
    direction: Unit<Vector3<f64>>,
    length: f64,
}

impl Tube {
    fn along(points: impl Iterator<Item = Point3<f64>> + Clone) -> Option<Self> {
        let start = points.clone().next()?;
        let from_start = |p: &Point3<f64>| distance_squared(&start, p);
        let farthest = points.clone().max_by(|a, b| from_start(a).total_cmp(&from_start(b)))?;
        Self::between(start, farthest, points.fold(0.0, |most, p| most.max(p.coords.amax())))
    }

    /// `None` for a motion that is all rounding of coordinates of this magnitude, which has no direction.
    fn between(start: Point3<f64>, farthest: Point3<f64>, magnitude: f64) -> Option<Self> {
        let (direction, length) = Unit::try_new_and_get(farthest - start, 0.0)?;
        (length > 1e-13 * magnitude).then_some(Self { start, direction, length })
    }

    /// Where a point is: share of the length along the line, and distance from it in lengths (equation 14).
    fn place(&self, point: &Point3<f64>) -> (f64, f64) {
        let d = (point - self.start) / self.length;
        let along = self.direction.dot(&d);
        (along, self.direction.cross(&d).norm())
    }
}

/// A trajectory shifted so that it starts on the reference trajectory, equation (13).
///
/// A trajectory that begins late is laid on the reference's position in the first frame that both have; one without
/// any common frame cannot be compared and gives nothing.
fn aligned<'t>(
    trajectory: &Trajectory<'t>,
    reference: &Trajectory<'t>,
) -> impl Iterator<Item = Point3<f64>> + Clone + use<'t> {
    let shift = common(trajectory, reference).next().map(|(own, its)| its - own);
    trajectory.points.iter().filter_map(move |p| Some(p + shift?))
}

/// Pairs of positions of two features in the frames that show both.
fn common<'t>(
    a: &Trajectory<'t>,
    b: &Trajectory<'t>,
) -> impl Iterator<Item = (&'t Point3<f64>, &'t Point3<f64>)> + use<'t> {
    let (frames, points) = (b.frames, b.points);
    let mut cursor = 0;
    a.frames.iter().zip(a.points).filter_map(move |(frame, p)| {
        cursor += frames[cursor..].iter().take_while(|other| *other < frame).count();
        (frames.get(cursor) == Some(frame)).then(|| (p, &points[cursor]))
    })
}

/// Mean over features of their length relative to the longest, over the frames that show both.
fn mean_relative_length(tracks: &[Trajectory<'_>], extents: &[f64], longest: usize) -> f64 {
    let reference = &tracks[longest];
    let greatest = extents.iter().copied().fold(0.0, f64::max);
    let relative = |(track, own): (&Trajectory<'_>, &f64)| {
        if track.frames.len() == reference.frames.len() && track.frames == reference.frames {
            return Some(own / greatest);
        }
        let (own, its): (Vec<_>, Vec<_>) = common(track, reference).map(|(p, q)| (*p, *q)).unzip();
        let (own, its) = (extent(&own), extent(&its));
        (its > 0.0).then(|| (own / its).min(its / own))
    };
    let lengths: Vec<f64> = tracks.iter().zip(extents).filter_map(relative).collect();
    lengths.iter().sum::<f64>() / lengths.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weakest_section_counts() {
        let model = ThesisPrismatic::default();
        // 50 points in the first half of the tube, all inside; 4 in the last tenth, 1 of them outside.
        let good = (0..50).map(|i| (f64::from(i) / 100.0, 0.01));
        let last = (0..4).map(|i| (0.95, if i == 0 { 0.2 } else { 0.0 }));
        let samples = good.chain(last);
        assert_eq!(model.cylinder_fit(samples.clone()), 0.75);
        assert_eq!(ThesisPrismatic { sections: 1, ..model.clone() }.cylinder_fit(samples.clone()), 53.0 / 54.0);
        let zero = ThesisPrismatic { empty_sections: EmptySections::Zero, ..model.clone() };
        assert_eq!(zero.cylinder_fit(samples.clone()), 0.0);
        // Adaptive: 54 samples make two sections of 20 or more, of 36 and 18, and 18 joins the first.
        let adaptive = ThesisPrismatic { adaptive_sections: true, ..model };
        assert_eq!(adaptive.cylinder_fit(samples), 53.0 / 54.0);
    }

    #[test]
    fn points_beyond_the_tube_count_at_its_ends_or_not_at_all() {
        let samples = [(-0.2, 0.5), (0.05, 0.0), (1.3, 0.0)].into_iter();
        let clamp = ThesisPrismatic::default();
        assert_eq!(clamp.cylinder_fit(samples.clone()), 0.5);
        assert_eq!(ThesisPrismatic { overshoot: Overshoot::Drop, ..clamp }.cylinder_fit(samples), 1.0);
    }

    #[test]
    fn late_trajectories_are_aligned_where_the_reference_was() {
        let line: Vec<_> = (0..6).map(|i| Point3::new(f64::from(i), 0.0, 0.0)).collect();
        let frames: Vec<usize> = (0..6).collect();
        let shifted: Vec<_> = line.iter().map(|p| p + Vector3::new(0.0, 5.0, 1.0)).collect();
        let reference = Trajectory { frames: &frames, points: &line };
        let late = Trajectory { frames: &frames[3..], points: &shifted[3..] };
        assert_eq!(aligned(&late, &reference).collect::<Vec<_>>(), line[3..].to_vec());
        assert_eq!(mean_relative_length(&[reference, late], &[5.0, 2.0], 0), 1.0);
    }

    #[test]
    fn a_still_trajectory_has_no_tube() {
        assert!(Tube::along([Point3::new(1.0, 2.0, 3.0); 4].into_iter()).is_none());
    }
}
