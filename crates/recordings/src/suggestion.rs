//! Markers put together to rigid bodies by the constancy of their distances.
//!
//! # Definition
//! The *variation* of a pair of markers is half of the range of their distance, without the outermost 2 % at either end,
//! over the frames that show both. It is measured in units of what noise and soft tissue make of a rigid pair,
//! `√((3 σ)² + (0.005 R)²)`, where `σ` is the noise of the distance, from second differences over successive frames, and
//! `R` the median distance of all pairs. Markers are merged by complete linkage: the height of a group is the largest
//! variation in it, so that every pair of a group is as rigid as its height says. A group is a body if it has at least
//! three markers, its height is small, and it lies deep below the height at which it merges with anything else. Of groups
//! in groups those count whose depths, times their markers, sum to most.
//!
//! # Degenerate cases
//! A marker that is nearly as rigid with a second body as with its own, such as one on a hinge's axis or at a human
//! joint, is ambiguous and in no body. Bodies that never move against each other are one. Pairs that are hardly ever
//! seen together say nothing; groups need half of their pairs. What pairwise distances cannot tell, a mirrored shape,
//! does not occur in continuous motion.

use jointscope_motion::{Body, BodyMotion, MotionSettings, Tracks, evenly};
use nalgebra::Point3;

use crate::Markers;

mod linkage;

/// Frames that are looked at, spread evenly over the recording.
const FRAMES: usize = 600;

/// Markers beyond which pairs are too many to be compared.
pub(crate) const MOST_MARKERS: usize = 2000;

/// Frames that must show both markers of a pair for its variation to be known.
const COMMON_FRAMES: usize = 8;

/// Share of the distances that is left out at either end of their range: frames in which markers were confused.
const OUTERMOST: f64 = 0.02;

/// The noise of a distance makes a range of about this many standard deviations.
const NOISE: f64 = 3.;

/// What skin and clamps may give, as a share of the median distance.
const SOFT: f64 = 0.005;

/// Largest height of a body, in units of what noise and soft tissue explain.
const TALLEST: f64 = 3.;

/// Height from which nobody would call a pair of markers rigid: a variation of a twentieth of their distance.
const LOOSE: f64 = 10.;

/// Least ratio of the height at which a body merges with something else to its own.
const SEPARATION: f64 = 1.6;

/// Ratio beyond which more separation means no more.
const SEPARATE: f64 = 100.;

/// Bodies have an orientation.
const LEAST_MARKERS: usize = 3;

/// Bodies that markers seem to make.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Suggestion {
    /// The bodies, in order of their first markers.
    pub bodies: Vec<SuggestedBody>,
    /// Markers that keep their distances to more than one body, such as one on a hinge's axis.
    pub ambiguous: Vec<usize>,
    /// Of these, the most that keep their distances to each other: one body, such as all that rests beside what moves;
    /// none if they are fewer than three.
    pub together: Vec<usize>,
}

/// Markers that keep their distances to each other.
#[derive(Debug, Clone, PartialEq)]
pub struct SuggestedBody {
    /// What its markers' names have in common, or `body 1`, `body 2` …
    pub name: String,
    /// Its markers, by their place in the file.
    pub markers: Vec<usize>,
    /// The largest variation of a distance between two of them, metres.
    pub variation: f64,
    /// Standard deviation of a coordinate of its markers from where a rigid shape has it, metres.
    pub residual: f64,
}

/// Puts markers together that keep their distances; none if there are more than 2000.
pub fn suggest(markers: &Markers) -> Suggestion {
    let count = markers.markers.len();
    if !(LEAST_MARKERS..=MOST_MARKERS).contains(&count) {
        return Suggestion::default();
    }
    let pairs = Pairs::of(markers);
    let groups = linkage::groups(count, |a, b| pairs.height(a, b));
    let mut bodies = chosen(&groups);
    let ambiguous = settle(&mut bodies, &pairs, count);
    bodies.retain(|body| body.len() >= LEAST_MARKERS);
    bodies.sort_unstable();
    let suggested = bodies.into_iter().filter_map(|body| {
        let (body, residual) = registered(&body, markers)?;
        let variation = largest(&body, |a, b| pairs.variation[a * count + b]);
        // Distances that hold while the shape does not: pairs that were never seen together.
        let rigid = body.len() >= LEAST_MARKERS && residual <= TALLEST * pairs.unit_of(&body);
        rigid.then(|| SuggestedBody { name: String::new(), markers: body, variation, residual })
    });
    let mut bodies: Vec<SuggestedBody> = suggested.collect();
    name(&mut bodies, markers);
    let together = together(&ambiguous, &pairs, markers);
    Suggestion { bodies, ambiguous, together }
}

/// The largest group of markers that is as rigid as a body must be.
fn together(among: &[usize], pairs: &Pairs, markers: &Markers) -> Vec<usize> {
    let groups = linkage::groups(among.len(), |a, b| pairs.height(among[a], among[b]));
    let rigid = groups.iter().filter(|group| group.markers.len() >= LEAST_MARKERS && group.height <= TALLEST);
    let largest = rigid.max_by_key(|group| group.markers.len());
    let body = largest.map(|group| group.markers.iter().map(|&marker| among[marker]).collect::<Vec<_>>());
    let found = body.and_then(|body| registered(&body, markers));
    let sound =
        found.filter(|(body, residual)| body.len() >= LEAST_MARKERS && *residual <= TALLEST * pairs.unit_of(body));
    sound.map(|(body, _)| body).unwrap_or_default()
}

/// How rigid a body is.
pub(crate) struct Measured {
    /// The largest variation of a distance of its markers, metres.
    pub variation: f64,
    /// Standard deviation of a coordinate from where a rigid shape has it, metres.
    pub residual: f64,
    /// Whether most of the distances vary by far more than noise and soft tissue explain.
    pub falls_apart: bool,
}

/// Measures how rigid a body is; `None` if it is never seen.
pub(crate) fn measured(body: &[usize], markers: &Markers) -> Option<Measured> {
    if body.len() > MOST_MARKERS {
        return None;
    }
    let (_, residual) = registered(body, markers)?;
    let frames = looked_at(markers.frames());
    let numbers: Vec<u64> = frames.iter().map(|&frame| markers.frame_numbers[frame]).collect();
    let count = markers.markers.len();
    let (mut distances, mut medians, mut variations) = (Vec::new(), Vec::new(), Vec::new());
    for (i, &a) in body.iter().enumerate() {
        for &b in &body[i + 1..] {
            let row = |frame: &usize| &markers.positions[frame * count..(frame + 1) * count];
            distances.clear();
            distances.extend(frames.iter().map(|frame| (row(frame)[a] - row(frame)[b]).norm()));
            let noise = noise(&distances, &numbers);
            distances.retain(|distance| distance.is_finite());
            if distances.len() >= COMMON_FRAMES {
                variations.push((half_range(&mut distances), noise));
                medians.push(distances[distances.len() / 2]);
            }
        }
    }
    let soft = SOFT * median(&mut medians).unwrap_or(0.);
    let loose = variations.iter().filter(|(half, noise)| *half > LOOSE * (NOISE * noise).hypot(soft)).count();
    let variation = variations.iter().map(|(half, _)| *half).fold(0., f64::max);
    Some(Measured { variation, residual, falls_apart: 2 * loose > variations.len() })
}

/// Half of the range of distances, without the outermost.
fn half_range(distances: &mut [f64]) -> f64 {
    distances.sort_unstable_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
    let outermost = (OUTERMOST * distances.len() as f64) as usize;
    0.5 * (distances[distances.len() - 1 - outermost] - distances[outermost])
}

/// What is known of pairs of markers.
struct Pairs {
    count: usize,
    /// Metres; NaN where it is not known.
    variation: Vec<f64>,
    /// Noise of the distance, metres; 0 where it is not known.
    noise: Vec<f64>,
    soft: f64,
}

impl Pairs {
    fn of(markers: &Markers) -> Self {
        let count = markers.markers.len();
        let frames = looked_at(markers.frames());
        let numbers: Vec<u64> = frames.iter().map(|&frame| markers.frame_numbers[frame]).collect();
        let rows: Vec<&[Point3<f64>]> =
            frames.iter().map(|frame| &markers.positions[frame * count..(frame + 1) * count]).collect();
        let (mut variation, mut noise_of) = (vec![f64::NAN; count * count], vec![0.; count * count]);
        let (mut distances, mut medians) = (Vec::new(), Vec::new());
        for a in 0..count {
            for b in a + 1..count {
                distances.clear();
                distances.extend(rows.iter().map(|row| (row[a] - row[b]).norm()));
                let noise = noise(&distances, &numbers);
                distances.retain(|distance| distance.is_finite());
                if distances.len() < COMMON_FRAMES {
                    continue;
                }
                let half = half_range(&mut distances);
                for cell in [a * count + b, b * count + a] {
                    (variation[cell], noise_of[cell]) = (half, noise);
                }
                medians.push(distances[distances.len() / 2]);
            }
        }
        Self { count, variation, noise: noise_of, soft: SOFT * median(&mut medians).unwrap_or(0.) }
    }

    /// The variation that noise and soft tissue explain, metres.
    fn unit(&self, a: usize, b: usize) -> f64 {
        (NOISE * self.noise[a * self.count + b]).hypot(self.soft).max(f64::MIN_POSITIVE)
    }

    fn unit_of(&self, body: &[usize]) -> f64 {
        largest(body, |a, b| self.unit(a, b))
    }

    /// The variation in units of what noise and soft tissue explain, 1 at least; NaN where it is not known.
    fn height(&self, a: usize, b: usize) -> f64 {
        let height = self.variation[a * self.count + b] / self.unit(a, b);
        if height.is_nan() { height } else { height.max(1.) }
    }

    /// The height of a marker with a body, without itself; NaN if less than half of its pairs are known.
    fn height_with(&self, marker: usize, body: &[usize]) -> f64 {
        let others = body.iter().filter(|&&other| other != marker);
        let (mut height, mut known, mut of) = (f64::NAN, 0, 0);
        for &other in others {
            let with = self.height(marker, other);
            of += 1;
            known += usize::from(!with.is_nan());
            height = height.max(with);
        }
        if 2 * known >= of { height } else { f64::NAN }
    }
}

/// The largest of something over the pairs of a body that is known of them.
fn largest(body: &[usize], of: impl Fn(usize, usize) -> f64) -> f64 {
    let pairs = body.iter().enumerate().flat_map(|(i, &a)| body[i + 1..].iter().map(move |&b| (a, b)));
    pairs.map(|(a, b)| of(a, b)).fold(0., f64::max)
}

/// The noise of a distance, from its second differences over successive frames: no motion of a rigid pair adds to them.
fn noise(distances: &[f64], frame_numbers: &[u64]) -> f64 {
    /// Median of the size of a standard normal number.
    const MEDIAN_SIZE: f64 = 0.6745;
    /// Variance of `a - 2 b + c`, in variances of one of them.
    const SECOND_DIFFERENCE: f64 = 6.;

    let successive = frame_numbers.windows(3).map(|numbers| numbers[2] - numbers[0] == 2);
    let differences = distances.windows(3).zip(successive).filter(|(_, successive)| *successive);
    let differences = differences.map(|(d, _)| (d[0] - 2. * d[1] + d[2]).abs());
    let mut differences: Vec<f64> = differences.filter(|difference| difference.is_finite()).collect();
    median(&mut differences).map_or(0., |size| size / (MEDIAN_SIZE * SECOND_DIFFERENCE.sqrt()))
}

/// Frames spread evenly over the recording, in runs of successive ones.
fn looked_at(frames: usize) -> Vec<usize> {
    const RUN: usize = 3;

    let runs = evenly(frames / RUN, FRAMES / RUN);
    if frames <= FRAMES {
        (0..frames).collect()
    } else {
        runs.iter().flat_map(|run| run * RUN..(run + 1) * RUN).collect()
    }
}

fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Of the groups in groups those that stand out most.
fn chosen(groups: &[linkage::Group]) -> Vec<Vec<usize>> {
    /// What a group or the best of the groups in it are worth, and which these are.
    struct Best {
        worth: f64,
        groups: Vec<usize>,
    }

    let mut best: Vec<Best> = Vec::with_capacity(groups.len());
    for (index, group) in groups.iter().enumerate() {
        let mut inner = Best { worth: 0., groups: Vec::new() };
        for child in group.parts.into_iter().flatten() {
            inner.worth += best[child].worth;
            inner.groups.append(&mut std::mem::take(&mut best[child].groups));
        }
        let separation = (group.merged_at / group.height).min(SEPARATE);
        let stands_out = group.markers.len() >= LEAST_MARKERS && group.height <= TALLEST && separation >= SEPARATION;
        let worth = group.markers.len() as f64 * separation.ln();
        best.push(if stands_out && worth >= inner.worth { Best { worth, groups: vec![index] } } else { inner });
    }
    let roots = (0..groups.len()).filter(|&index| groups[index].merged_at.is_infinite());
    let roots: Vec<usize> = roots.flat_map(|root| best[root].groups.clone()).collect();
    roots.into_iter().map(|index| groups[index].markers.clone()).collect()
}

/// Takes ambiguous markers out of bodies, and puts markers that fit one body alone into it; gives the ambiguous ones.
fn settle(bodies: &mut [Vec<usize>], pairs: &Pairs, count: usize) -> Vec<usize> {
    let heights: Vec<f64> = bodies.iter().map(|body| largest(body, |a, b| pairs.height(a, b)).max(1.)).collect();
    let settled: Vec<Vec<usize>> = bodies.to_vec();
    let mut ambiguous = Vec::new();
    for marker in 0..count {
        let home = settled.iter().position(|body| body.contains(&marker));
        let mut fits: Vec<(f64, usize)> = settled
            .iter()
            .enumerate()
            .map(|(index, body)| (pairs.height_with(marker, body), index))
            .filter(|(height, _)| !height.is_nan())
            .collect();
        fits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let own = home.map_or_else(
            || fits.first().copied().filter(|(height, body)| *height <= SEPARATION.sqrt() * heights[*body]),
            |home| Some((pairs.height_with(marker, &settled[home]), home)),
        );
        let Some((height, body)) = own else { continue };
        let rival = fits.iter().find(|(_, other)| *other != body);
        if rival.is_some_and(|(rival, other)| {
            *rival < SEPARATION * height.max(1.) && *rival <= SEPARATION * heights[*other]
        }) {
            ambiguous.push(marker);
            bodies[body].retain(|&other| other != marker);
        } else if home.is_none() {
            bodies[body].push(marker);
            bodies[body].sort_unstable();
        }
    }
    ambiguous
}

/// Registers a body's markers to one rigid shape: those that belong to it, and the standard deviation of a coordinate
/// from where the shape has it, metres. A body without orientation keeps its markers.
fn registered(body: &[usize], markers: &Markers) -> Option<(Vec<usize>, f64)> {
    let count = markers.markers.len();
    let frames = looked_at(markers.frames());
    let places = frames.iter().flat_map(|frame| body.iter().map(move |marker| frame * count + marker));
    let tracks = Tracks::new(body.len(), places.map(|place| markers.positions[place]).collect()).ok()?;
    let labels = body.iter().map(ToString::to_string).collect();
    let observed = Body::from_points("suggested", labels, tracks).ok()?;
    let motion = BodyMotion::of(&observed, &MotionSettings::default());
    let members = body.iter().enumerate().filter(|(feature, _)| !motion.strays().contains(feature));
    Some((members.map(|(_, marker)| *marker).collect(), motion.noise().position.unwrap_or(0.)))
}

/// Gives bodies the names that their markers have in common, or numbers.
fn name(bodies: &mut [SuggestedBody], markers: &Markers) {
    let mut taken: Vec<String> = Vec::new();
    let mut number = 0;
    for body in bodies {
        let own = |marker: usize| markers.markers[marker].body.as_deref();
        let first = own(body.markers[0]).filter(|name| body.markers.iter().all(|&marker| own(marker) == Some(name)));
        // A body of the file of which this is most.
        let of_file = first.filter(|name| {
            let all = markers.markers.iter().filter(|marker| marker.body.as_deref() == Some(name)).count();
            2 * body.markers.len() > all
        });
        let same_body = first.is_some();
        let names = body.markers.iter().map(|&marker| {
            let marker = &markers.markers[marker];
            if same_body { marker.label.as_str() } else { marker.name.as_str() }
        });
        let common = of_file.map_or_else(|| common_beginning(names), ToOwned::to_owned);
        body.name = if common.chars().count() >= 2 && !taken.contains(&common) {
            common
        } else {
            loop {
                number += 1;
                let name = format!("body {number}");
                if !taken.contains(&name) {
                    break name;
                }
            }
        };
        taken.push(body.name.clone());
    }
}

fn common_beginning<'a>(mut names: impl Iterator<Item = &'a str>) -> String {
    let first = names.next().unwrap_or_default().to_owned();
    let common = names.fold(first, |common, name| {
        common.chars().zip(name.chars()).take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
    });
    common.trim_end_matches(|letter: char| !letter.is_alphabetic()).trim().to_owned()
}
