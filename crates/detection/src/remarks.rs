//! What must be said of a pair, in sentences.

use std::collections::BTreeMap;

use jointscope_models::JointFit;
use jointscope_motion::{PoseSeries, RelativeMotion};
use jointscope_scoring::Verdict;

use crate::detector::Taking;
use crate::{JointKind, ModelFinding, PairDetection};

/// Frames below which no joint is determined: three points define a circle, and more must confirm it.
const FEW_FRAMES: usize = 6;
/// The same of tracked poses, whose noise is told by their third differences.
const FEW_POSES: usize = 12;

/// Range of a motion, in standard deviations of the noise, that is none.
const BELOW_NOISE: f64 = 3.0;

/// Share of frames in which bodies leap apart from which more are suspected than were left out; of a single point, which
/// nothing confirms, it is less.
const MOST_LEAPS: f64 = 0.04;
const MOST_LEAPS_OF_A_POINT: f64 = 0.03;

/// Tells the richer joint that the data show beyond the verdict's.
pub(crate) fn richer_note(verdict: &Verdict, models: &BTreeMap<String, ModelFinding>) -> Option<String> {
    /// Least millimetres or degrees that are told.
    const LEAST: f64 = 0.005;
    let name = verdict.richer.as_ref()?;
    let fit = |name: &String| models.get(name)?.as_ref().ok();
    let (simple, richer) = (fit(&verdict.joint)?, fit(name)?);
    let misfit = |fit: &JointFit| -> Option<String> {
        let distance = 1e3 * fit.parts.get("misfit_distance")?;
        let angle = fit.parts.get("misfit_angle").map_or(0.0, |angle| angle.to_degrees());
        let told = [(distance, "mm"), (angle, "degrees")].into_iter().filter(|(amount, _)| *amount >= LEAST);
        let told: Vec<String> = told.map(|(amount, unit)| format!("{amount:.2} {unit}")).collect();
        Some(if told.is_empty() { "noise".into() } else { format!("{} beyond noise", told.join(" and ")) })
    };
    let pitch = richer.joint.axis.and_then(|axis| axis.pitch).filter(|pitch| *pitch != 0.0);
    let pitch = pitch.map_or(String::new(), |pitch| format!(" of {:.2} mm per radian", 1e3 * pitch));
    Some(format!("{} within {}; {name}{pitch} fits better, within {}", verdict.joint, misfit(simple)?, misfit(richer)?))
}

/// Said where the scale of a body without poses is unknown.
pub(crate) const UNSOUGHT: &str = "the scale between the bodies is not sought, which takes poses of both: what is no joint \
                                   at the scale that was seen may be one at another; track three features that are not on \
                                   one line on each body";

/// Said where the verdict's joint does best at an end of the range of scales.
pub(crate) fn beyond_the_range(verdict: &Verdict) -> String {
    format!(
        "`{}` does best at the last of the scales that are tried, and may do better beyond: give a wider range, `from` and \
         `to` under [scale]",
        verdict.joint
    )
}

/// Said where no joint connects a pair at the scales that were tried, but one does at another.
pub(crate) fn connected_beyond(joint: &str, factor: f64) -> String {
    format!(
        "`{joint}` fits at {factor:.3}, which is beyond the scales that were tried: give a wider range, `from` and `to` under \
         [scale]"
    )
}

/// Tells the scale that was found, or that none shows.
pub(crate) fn scale_note(pair: &PairDetection) -> Option<String> {
    let scale = pair.scale.as_ref()?;
    let Some(factor) = scale.factor else {
        return Some(match scale.alike {
            _ if pair.kind() == JointKind::Disconnected => {
                "no scale between the bodies shows where no joint connects them".into()
            }
            Some([least, most]) => {
                let (joint, moving) = (&pair.verdict.joint, &pair.moving);
                format!(
                    "the scale between the bodies does not show: `{joint}` does equally well with what is seen of {moving} \
                     times {least:.4} to {most:.4}"
                )
            }
            None => "the scale between the bodies does not show in this motion: both must move, and not as if they were one \
                     with the camera"
                .into(),
        });
    };
    // Two digits of the error, and as many of the factor.
    let enough = |error: f64| (4..12).find(|places| error >= 10.0 * 0.1_f64.powi(i32::from(*places))).unwrap_or(12_u8);
    let places = usize::from(scale.standard_error.map_or(4, enough));
    let error = scale.standard_error.map_or(String::new(), |error| format!(" (± {error:.places$})"));
    let (moving, reference) = (&pair.moving, &pair.reference);
    Some(format!("what is seen of {moving} times {factor:.places$}{error} agrees with {reference} in scale"))
}

/// Says so if the bodies were apart in single frames.
pub(crate) fn leapt(series: &PoseSeries) -> Option<String> {
    match series.leaps() {
        0 => None,
        1 => Some("in 1 frame the bodies leap apart and are back in the next; it was left out".into()),
        count => Some(format!("in {count} frames the bodies leap apart and are back in the next; they were left out")),
    }
}

/// Why models could not judge, and what the verdict's has to say; what several say once.
pub(crate) fn told_by(models: &BTreeMap<String, ModelFinding>, verdict: &Verdict) -> Vec<String> {
    let mut told: Vec<(String, Vec<&str>)> = Vec::new();
    let of_verdict = models.get(&verdict.joint).and_then(|finding| finding.as_ref().ok());
    let says = |note: &String| of_verdict.is_some_and(|fit| fit.notes.contains(note));
    for (name, finding) in models {
        let notes = match finding {
            Ok(fit) => fit.notes.iter().filter(|note| says(note)).cloned().collect(),
            Err(error) => vec![error.to_string()],
        };
        for note in notes {
            match told.iter_mut().find(|(known, _)| *known == note) {
                Some((_, names)) => names.push(name),
                None => told.push((note, vec![name])),
            }
        }
    }
    let all = |names: &[&str]| names.len() > 1 && names.len() == models.len();
    let sentence = |(note, names): (String, Vec<&str>)| {
        if all(&names) { format!("all models: {note}") } else { format!("{}: {note}", names.join(", ")) }
    };
    told.into_iter().map(sentence).collect()
}

/// Said where noise moves the bodies against each other by more than they are large, and the joint lets them turn in some
/// directions only: slides drown in such noise, and what it leaves of turns and slides is not told from others. Turns in all
/// directions show.
fn drowned(series: &PoseSeries, of_verdict: Option<&ModelFinding>) -> Option<String> {
    let turns = of_verdict?.as_ref().ok()?.evidence?.mobility.turns;
    let noise = series.ends().iter().map(|end| end.shift_noise).fold(f64::INFINITY, f64::min);
    let radius = series.ends().iter().map(|end| end.radius).fold(0.0, f64::max);
    (turns < 3 && noise > radius).then(|| {
        format!(
            "noise moves the bodies by {noise:.2} m against each other, more than they are large, for their turns are known \
             poorly and they are far apart: slides drown in it; track more features, farther apart"
        )
    })
}

/// Whether what tracked poses show may be their slow errors, of which no difference between successive poses tells how
/// large they are: then little moves, and what does is not all that a joint leaves free.
fn slowly_wrong(series: &PoseSeries, of_verdict: Option<&ModelFinding>) -> bool {
    /// Scatter in standard deviations of the noise from frame to frame; errors that keep nine tenths from frame to frame have
    /// four.
    const LITTLE: f64 = 4.0;
    /// Misfit beyond noise, in standard deviations of it, that is none.
    const NO_MISFIT: f64 = 0.5;
    let within = |part: &str, noise: f64| {
        let misfit = of_verdict.and_then(|finding| finding.as_ref().ok()?.parts.get(part));
        misfit.is_some_and(|misfit| *misfit < NO_MISFIT * noise)
    };
    let fits = within("misfit_distance", series.ends()[0].shift_noise) && within("misfit_angle", series.turn_noise());
    series.tracked() && series.signal() < LITTLE && !fits
}

/// The simplest joint that was passed over for what may be slow errors of tracked poses.
fn passed_over<'m>(verdict: &Verdict, models: &'m BTreeMap<String, ModelFinding>) -> Option<&'m str> {
    /// Slow errors of trackers, metres and radians, at most: 3 mm and 0.01 rad per coordinate of both bodies that keep nine
    /// tenths from frame to frame are 7 mm and 1.4 degrees apart, root mean square, and flat markers err by 3 degrees.
    const SLOW_SHIFT: f64 = 0.008;
    const SLOW_TURN: f64 = 0.052;
    let found = |name: &str| models.get(name)?.as_ref().ok();
    let mobility = found(&verdict.joint)?.evidence?.mobility;
    let within = |fit: &JointFit, part: &str, most: f64| fit.parts.get(part).is_some_and(|misfit| *misfit < most);
    let simpler = models.keys().filter_map(|name| {
        let fit = found(name)?;
        let near = within(fit, "misfit_distance", SLOW_SHIFT) && within(fit, "misfit_angle", SLOW_TURN);
        let other = fit.evidence?.mobility;
        (near && mobility.contains(&other)).then_some((other.parameters, name.as_str()))
    });
    simpler.min().map(|(_, name)| name)
}

/// Why the data do not decide, in sentences that say what would help.
pub(crate) fn doubts(
    motion: &RelativeMotion<'_>,
    verdict: &Verdict,
    models: &BTreeMap<String, ModelFinding>,
    taking: Taking,
) -> Vec<String> {
    let mut doubts = verdict.doubts.clone();
    let frames = motion.frames().len();
    // Where the bodies move against each other, one of them moves.
    let but_for_noise = || verdict.joint == "rigid" && motion.reference().rests() && motion.moving().rests();
    if frames > 1 && motion.is_at_rest() {
        doubts.push("neither body moves: every joint at rest looks rigid; record them moving".into());
    } else if frames > 1 && but_for_noise() {
        doubts.push("neither body moves beyond noise: every joint at rest looks rigid; record them moving".into());
    }
    if frames < FEW_FRAMES {
        let show = if frames == 1 { "frame shows" } else { "frames show" };
        doubts.push(format!("{frames} {show} both bodies, at least {FEW_FRAMES} are needed; record more"));
    }
    if let Some(series) = verdict.cost.and_then(|_| motion.pose_series()) {
        if series.vague() {
            doubts.push(
                "the turn of a body about the line of its features is not seen; track a feature beside it".into(),
            );
        }
        doubts.extend(drowned(series, models.get(&verdict.joint)));
        if series.is_within_noise(BELOW_NOISE) && verdict.joint != "rigid" {
            doubts.push("the motion stays below the noise; record more motion".into());
        } else if taking != Taking::InNoOrder
            && verdict.joint != "rigid"
            && slowly_wrong(series, models.get(&verdict.joint))
        {
            doubts.push(
                "the tracked poses move little more than their noise from frame to frame, and trackers err slowly by as much: \
                 that may be no motion; record more"
                    .into(),
            );
        }
        if series.smooth()
            && taking != Taking::InNoOrder
            && let Some(simpler) = passed_over(verdict, models)
        {
            doubts.push(format!(
                "the tracked poses have gone through a filter or err slowly, which hides how large their errors are: what \
                 {simpler} leaves may be such; record more motion"
            ));
        }
        if series.tracked() && (FEW_FRAMES..FEW_POSES).contains(&frames) {
            doubts.push(format!(
                "{frames} frames of poses do not tell motion from noise, at least {FEW_POSES} are needed; record more"
            ));
        }
    }
    let of_point = models.values().flatten().find_map(|fit| fit.parts.get("leap_share").copied());
    let of_poses = || motion.pose_series().map(PoseSeries::leap_share);
    let leaps = of_point.map(|share| (share, MOST_LEAPS_OF_A_POINT));
    let leaps = leaps.or_else(|| Some((verdict.cost.and_then(|_| of_poses())?, MOST_LEAPS)));
    if let Some((share, _)) = leaps.filter(|(share, most)| share > most) {
        doubts.push(format!(
            "the bodies leap apart and back in {:.0} % of the frames: more may be wrong than can be told; track better",
            100.0 * share
        ));
    }
    if models.values().all(Result::is_err) {
        doubts.push("no model could judge this motion".into());
    }
    doubts
}
