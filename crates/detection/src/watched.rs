//! A body of a recording, and what is wrong with it, in sentences.

use jointscope_motion::{
    Body, BodyMotion, Deformation, DepthGain, MotionSettings, NoiseSetting, Observation, Registration,
};

/// A body's motion, and what must be said of it in every pair that it is in.
pub(crate) struct Watched<'r> {
    pub(crate) motion: BodyMotion<'r>,
    pub(crate) depth_gain: Option<DepthGain>,
    pub(crate) notes: Vec<String>,
    /// Why no pair of this body is determined, if so.
    pub(crate) doubt: Option<String>,
}

impl<'r> Watched<'r> {
    pub(crate) fn of(
        motion: BodyMotion<'r>,
        body: &Body,
        depth_gain: Option<DepthGain>,
        frame_numbers: &[u64],
        settings: &MotionSettings,
    ) -> Self {
        let name = motion.name();
        let unposed = motion.unposed().map(|reason| format!("{name}: {reason}; only its positions count"));
        let mut notes: Vec<String> = unposed.into_iter().chain(far_away(&motion)).collect();
        let labels = match body.observation() {
            Observation::Points { labels, .. } => labels.as_slice(),
            _ => &[],
        };
        notes.extend(left_out(&motion, labels));
        let of_points = matches!(body.observation(), Observation::Points { .. });
        notes.extend(depth_gain.filter(|_| of_points).and_then(|gain| undone(name, gain)));
        if of_points {
            notes.extend(noise_too_small(&motion, settings.noise));
        }
        if settings.registration == Registration::Shape {
            notes.extend(not_rigid(&motion));
        }
        let few = few_and_wild(&motion);
        let doubt = motion.outlier().and_then(|outlier| {
            Some(format!(
                "{name}: feature `{}` in frame {} is {:.3} m from where the rest of the body puts it, with a noise of \
                 {:.4} m; such samples spoil verdicts and axes, leave them out",
                labels.get(outlier.feature)?,
                frame_numbers[outlier.frame],
                outlier.distance,
                outlier.noise
            ))
        });
        let restless = motion.restless().map(|share| {
            format!(
                "{name}: the tracked orientation jumps in {:.0} % of the frames, too many to tell which are right",
                100.0 * share
            )
        });
        let absurd = of_points.then(|| absurd_noise(&motion, settings.noise)).flatten();
        let hardly = of_points.then(|| hardly_posed(&motion, settings.registration)).flatten();
        let repeated = of_points.then(|| repeated(&motion, labels)).flatten();
        let doubt = absurd.or(doubt).or(few).or(restless).or(hardly).or(repeated);
        Self { motion, depth_gain, notes, doubt }
    }
}

/// Says what was done about depth changes that a single camera compresses.
fn undone(name: &str, gain: DepthGain) -> Option<String> {
    match gain {
        DepthGain { observable: false, .. } => Some(format!(
            "{name}: whether its depth changes are compressed is not seen; a turn out of the image plane would tell"
        )),
        DepthGain { gain: 1.0, .. } => None,
        DepthGain { gain, standard_error: Some(error), .. } => {
            Some(format!("{name}: depth changes were compressed to {gain:.3} (± {error:.3}), which was undone"))
        }
        DepthGain { gain, .. } => Some(format!("{name}: depth changes were compressed to {gain:.3}, which was undone")),
    }
}

/// Says so if the noise that was set would hide the body itself.
fn absurd_noise(motion: &BodyMotion<'_>, setting: NoiseSetting) -> Option<String> {
    let (NoiseSetting::Known(sigma), size) = (setting, motion.size()) else { return None };
    (size > 0.0 && sigma > size).then(|| {
        format!(
            "{}: `noise` under [motion] is {sigma} m, and the body itself measures {size:.3} m: everything is taken for \
             noise; it is metres per coordinate, and \"estimate\" finds it",
            motion.name()
        )
    })
}

/// Says so if the noise that was set is less than what the features show from frame to frame.
fn noise_too_small(motion: &BodyMotion<'_>, setting: NoiseSetting) -> Option<String> {
    /// How many times less.
    const LESS: f64 = 2.0;
    let NoiseSetting::Known(sigma) = setting else { return None };
    let shown = motion.deformation()?.noise / 3_f64.sqrt();
    (shown > LESS * sigma).then(|| {
        format!(
            "{}: `noise` under [motion] is {sigma} m, and its features scatter by {shown:.5} m per coordinate: noise counts \
             as motion; \"estimate\" finds it",
            motion.name()
        )
    })
}

/// Says so if a body is clearly not rigid as it is seen.
fn not_rigid(motion: &BodyMotion<'_>) -> Option<String> {
    /// Departure, in units of the noise from frame to frame, that noise which drifts does not reach unless successive
    /// errors are correlated by more than 0.9.
    const BEYOND_NOISE: f64 = 4.5;
    /// The same as a share of the body's size: five times what rigid bodies of real recordings show.
    const SOFT: f64 = 0.01;
    let Deformation { distance, noise } = motion.deformation()?;
    (distance > BEYOND_NOISE * noise && distance > SOFT * motion.size()).then(|| {
        format!(
            "{}: its features do not keep their distances ({:.1} mm beyond noise): a single camera may have compressed its \
             depth (`depth_gain`), it is more than one body (`inspect --suggest-bodies`), or soft, as skin is",
            motion.name(),
            1e3 * distance
        )
    })
}

/// Says so if a registration poses next to none of the frames that others would.
fn hardly_posed(motion: &BodyMotion<'_>, registration: Registration) -> Option<String> {
    /// One in so many frames.
    const FEW: usize = 10;
    if registration == Registration::Shape {
        return None;
    }
    let tracks = motion.tracks();
    let shown = (0..tracks.frames()).filter(|&frame| tracks.seen_count(frame) >= 3).count();
    let posed = motion.poses().iter().flatten().count();
    (0 < posed && posed * FEW < shown).then(|| {
        format!(
            "{}: {posed} of {shown} frames with three features or more are posed, those that share three with the one \
             to which they are registered; `registration = \"shape\"` under [motion] poses more",
            motion.name()
        )
    })
}

/// Says so if a feature is another one by another name: its noise is no news of the body.
fn repeated(motion: &BodyMotion<'_>, labels: &[String]) -> Option<String> {
    let tracks = motion.tracks();
    let alike = |one: usize, other: usize| {
        let mut pairs = (0..tracks.frames()).map(|frame| (tracks.get(frame, one), tracks.get(frame, other)));
        pairs.all(|(one, other)| one == other)
    };
    let seen = |feature: usize| (0..tracks.frames()).any(|frame| tracks.is_visible(frame, feature));
    let before = |other: usize| (0..other).find(|&one| alike(one, other)).map(|one| [one, other]);
    let repeats: Vec<[usize; 2]> = (0..tracks.features()).filter_map(before).filter(|[one, _]| seen(*one)).collect();
    let [one, other] = repeats.first()?.map(|feature| labels.get(feature));
    let others = if repeats.len() > 1 { format!(", and {} more", repeats.len() - 1) } else { String::new() };
    Some(format!(
        "{}: feature `{}` is always exactly where `{}` is{others}: repeated features hide how large their noise is, leave \
         them out",
        motion.name(),
        other?,
        one?
    ))
}

/// Says so if samples of a body are wild that shows too few features to tell which.
fn few_and_wild(motion: &BodyMotion<'_>) -> Option<String> {
    /// Features of which the majority can be told in every frame.
    const ENOUGH: usize = 6;
    /// Share of wild samples that even a few features tell apart: single ones stand out of their own path.
    const MANY: f64 = 0.03;
    let (tracks, features) = (motion.tracks(), motion.tracks().features());
    let samples: usize = (0..tracks.frames()).map(|frame| tracks.seen_count(frame)).sum();
    let many = motion.wild_samples() as f64 > MANY * samples as f64;
    (many && features < ENOUGH).then(|| {
        format!(
            "{}: samples are wild, and {features} features are too few to be sure which; track more, or leave them out",
            motion.name()
        )
    })
}

/// Says what of a body was left out as wrong, and how its noise is.
fn left_out(motion: &BodyMotion<'_>, labels: &[String]) -> Vec<String> {
    let name = motion.name();
    let mut notes = Vec::new();
    let strays: Vec<String> =
        motion.strays().iter().filter_map(|&feature| Some(format!("`{}`", labels.get(feature)?))).collect();
    match strays.len() {
        0 => {}
        1 => notes.push(format!("{name}: feature {} disagrees with the body and was left out", strays[0])),
        _ => notes.push(format!("{name}: features {} disagree with the body and were left out", strays.join(", "))),
    }
    match motion.wild_samples() {
        0 => {}
        1 => notes.push(format!("{name}: 1 wild sample was left out")),
        count => notes.push(format!("{name}: {count} wild samples were left out")),
    }
    match motion.jumps() {
        0 => {}
        1 => notes.push(format!("{name}: the tracked pose jumps in 1 frame, which was smoothed or left out")),
        count => {
            notes.push(format!("{name}: the tracked pose jumps in {count} frames, which were smoothed or left out"));
        }
    }
    if motion.unposed().is_none() && motion.line().is_some() {
        notes.push(format!("{name}: its features lie nearly on one line; the turn about it is not seen"));
    }
    let depth = motion.depth_noise();
    if !(0.75..1.3).contains(&depth) {
        notes.push(format!("{name}: noise along the ray from the origin is {depth:.1} times that across it"));
    }
    notes
}

/// Says so if a body is so far away that its unit is likely wrong.
fn far_away(motion: &BodyMotion<'_>) -> Option<String> {
    /// Metres; no camera or marker system looks so far.
    const FAR: f64 = 200.0;
    /// From where on a number is written with its exponent.
    const HUGE: f64 = 1e7;
    let (largest, name) = (motion.tracks().magnitude(), motion.name());
    let told = if largest < HUGE { format!("{largest:.0}") } else { format!("{largest:.3e}") };
    (largest > FAR)
        .then(|| format!("{name}: coordinates reach {told} m; if the file is not in metres, give its `unit`"))
}
