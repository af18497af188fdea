//! The named scenes.

use crate::nominal::{KINDS, nominal, turntable};
use crate::table2::table2;
use crate::{EXPERIMENTS, Scene, SceneError, SceneOptions, Simulation, experiments};

/// Names of all scenes, each with a summary of one line.
pub fn names() -> Vec<(&'static str, &'static str)> {
    let kinds = KINDS.iter().map(|kind| (kind.name(), summary(kind.name())));
    let others = ["turntable", "table2"].into_iter().map(|name| (name, summary(name)));
    let experiments = EXPERIMENTS.iter().map(|experiment| (experiment.scene, experiment.summary));
    kinds.chain(others).chain(experiments).collect()
}

fn summary(name: &str) -> &'static str {
    match name {
        "rigid" => "two bodies that move as one",
        "prismatic" => "a part slides straight along a moving base",
        "revolute" => "a part turns about an axis of a moving base",
        "screw" => "a part turns about an axis of a moving base and advances in proportion",
        "cylindrical" => "a part turns about an axis of a moving base and slides along it",
        "planar" => "a part slides and turns on a plane of a moving base",
        "spherical" => "a part turns about a point of a moving base",
        "disconnected" => "two bodies that move independently",
        "universal" => "a part turns about two crossing axes, as in a Cardan coupling, on a moving base",
        "elliptical" => "a part moves like the bar of an elliptic trammel on a moving base",
        "turntable" => "a flat disc turns about its own axis on a moving base",
        _ => "the thesis's test with noise (section 6.2): a slider runs past a base that is seen exactly",
    }
}

/// Builds a named scene, to be changed or simulated.
///
/// # Errors
/// [`SceneError::UnknownScene`], [`SceneError::OutOfRange`], [`SceneError::NotApplicable`].
pub fn scene(name: &str, options: &SceneOptions) -> Result<Scene, SceneError> {
    options.check()?;
    if let Some(kind) = KINDS.into_iter().find(|kind| kind.name() == name) {
        return nominal(kind, options);
    }
    if let Some(experiment) = EXPERIMENTS.iter().find(|experiment| experiment.scene == name) {
        return experiments::build(experiment, options);
    }
    match name {
        "turntable" => turntable(options),
        "table2" => table2(options),
        _ => {
            let known = names().into_iter().map(|(name, _)| name).collect::<Vec<_>>().join(", ");
            Err(SceneError::UnknownScene { name: name.into(), known })
        }
    }
}

/// Simulates a named scene.
///
/// # Errors
/// As [`scene`] and [`Scene::simulate`].
pub fn simulate(name: &str, options: &SceneOptions) -> Result<Simulation, SceneError> {
    let mut simulation = scene(name, options)?.simulate(options.seed)?;
    simulation.truth.options = options.clone();
    Ok(simulation)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use jointscope_motion::{Body, Observation};

    use super::*;
    use crate::BodyShape;

    #[test]
    fn every_scene_has_a_name_of_its_own_and_can_be_simulated() {
        let names = names();
        assert_eq!(names.len(), 10 + 2 + 10);
        assert_eq!(names.iter().map(|(name, _)| name).collect::<BTreeSet<_>>().len(), names.len());
        for (name, summary) in names {
            assert!(!summary.is_empty() && !summary.contains('\n'));
            let simulation = simulate(name, &SceneOptions::default()).expect(name);
            assert_eq!(simulation.truth.scene, name);
            assert_eq!(simulation.poses.len(), simulation.recording.bodies().len());
        }
    }

    #[test]
    fn an_unknown_name_lists_all_scenes() {
        let error = simulate("frigde", &SceneOptions::default()).expect_err("unknown").to_string();
        assert!(error.starts_with("there is no scene `frigde`; the scenes are rigid, prismatic, "), "{error}");
        assert!(error.contains("fridge"));
    }

    #[test]
    fn the_same_seed_gives_the_same_recording_and_another_seed_another() {
        let few = |seed| SceneOptions { seed, dropout: Some(0.2), outlier_features: Some(0.2), ..Default::default() };
        let many = |seed| SceneOptions { skin: Some(0.01), filter: Some(1.5), play: Some(0.01), ..few(seed) };
        let bent = |seed| SceneOptions { bend: Some(0.1), ..many(seed) };
        let shaped = |seed| SceneOptions { body_shape: Some(BodyShape::Line), ..bent(seed) };
        let tracked = |seed| {
            let poses = SceneOptions { seed, poses: true, flips: Some(0.2), filter: Some(1.0), ..Default::default() };
            SceneOptions { outlier_samples: Some(0.1), dropout: Some(0.2), bend: Some(0.1), ..poses }
        };
        let kinds: [&dyn Fn(u64) -> SceneOptions; 5] = [&few, &many, &bent, &shaped, &tracked];
        for (name, _) in names() {
            for (number, options) in kinds.iter().enumerate() {
                let [one, same, other] = [7, 7, 8].map(|seed| simulate(name, &options(seed)));
                let (Ok(one), Ok(same), Ok(other)) = (one, same, other) else {
                    assert!(number > 1 && (number == 2 || !KINDS.iter().any(|kind| kind.name() == name)), "{name}");
                    continue;
                };
                assert_eq!(format!("{:?}", one.recording), format!("{:?}", same.recording), "{name}");
                assert_eq!(one.truth, same.truth);
                assert_ne!(format!("{:?}", one.recording), format!("{:?}", other.recording), "{name}");
            }
        }
    }

    #[test]
    fn changing_one_option_leaves_everything_else_as_it_was() {
        let quiet = simulate("screw", &SceneOptions { noise: Some(0.0), ..Default::default() }).expect("screw");
        let noisy = simulate("screw", &SceneOptions { noise: Some(0.01), ..Default::default() }).expect("screw");
        let thinned = SceneOptions { noise: Some(0.01), dropout: Some(0.3), ..Default::default() };
        let thinned = simulate("screw", &thinned).expect("screw");
        assert_eq!(quiet.poses, noisy.poses);
        assert_eq!(quiet.truth.pairs, noisy.truth.pairs);
        let tracks = |body: &Body| match body.observation() {
            Observation::Points { tracks, .. } => tracks.clone(),
            _ => panic!("points"),
        };
        let (full, thin) = (tracks(&noisy.recording.bodies()[1]), tracks(&thinned.recording.bodies()[1]));
        for frame in 0..50 {
            assert!(thin.seen(frame).all(|(feature, point)| full.get(frame, feature) == Some(point)));
        }
    }

    #[test]
    fn imperfections_leave_everything_else_as_it_was() {
        let exact = SceneOptions { noise: Some(0.0), ..Default::default() };
        let noisy = SceneOptions { noise: Some(0.01), ..Default::default() };
        let samples = |options: SceneOptions| {
            let simulation = simulate("screw", &options).expect("screw");
            let tracks = simulation.recording.bodies().iter().map(|body| match body.observation() {
                Observation::Points { tracks, .. } => tracks.clone(),
                _ => panic!("points"),
            });
            let all: Vec<_> = tracks.flat_map(|tracks| (0..50).flat_map(move |f| tracks.frame(f).to_vec())).collect();
            (all, simulation.truth.pairs)
        };
        let (still, pairs) = samples(exact.clone());
        let (noisy_still, _) = samples(noisy.clone());
        for change in [
            &|options| SceneOptions { skin: Some(0.01), ..options } as SceneOptions,
            &|options| SceneOptions { bend: Some(0.1), ..options },
            &|options| SceneOptions { body_shape: Some(BodyShape::NearLine), ..options },
        ] as [&dyn Fn(SceneOptions) -> SceneOptions; 3]
        {
            let (changed, changed_pairs) = samples(change(exact.clone()));
            let (noisy_changed, _) = samples(change(noisy.clone()));
            assert_ne!(changed, still);
            assert_eq!((&changed_pairs[0].axis, &changed_pairs[0].joint), (&pairs[0].axis, &pairs[0].joint));
            for (index, place) in still.iter().enumerate() {
                let (noise, same) = (noisy_still[index] - place, noisy_changed[index] - changed[index]);
                assert!((noise - same).norm() < 1e-12, "the noise stays");
            }
        }
        let [plain, flipped] = [None, Some(0.2)].map(|flips| {
            let options = SceneOptions { poses: true, flips, ..noisy.clone() };
            let simulation = simulate("screw", &options).expect("screw");
            let Observation::Poses(poses) = simulation.recording.bodies()[1].observation() else { panic!("poses") };
            (poses.clone(), simulation.truth.pairs)
        });
        assert_eq!(plain.1, flipped.1);
        let kept = plain.0.iter().zip(&flipped.0).filter(|(plain, flipped)| plain == flipped).count();
        assert_eq!(kept, 40, "only what is flipped changes");
    }

    #[test]
    fn without_noise_every_body_is_rigid() {
        for (name, _) in names() {
            let options =
                SceneOptions { noise: Some(0.0), depth_gain: Some(1.0), frames: Some(40), ..Default::default() };
            let simulation = simulate(name, &options).expect(name);
            for body in simulation.recording.bodies() {
                let Observation::Points { tracks, .. } = body.observation() else { panic!("points") };
                let distance =
                    |frame: usize, a: usize, b: usize| (tracks.frame(frame)[a] - tracks.frame(frame)[b]).norm();
                for (frame, feature) in (0..40).flat_map(|frame| (1..tracks.features()).map(move |f| (frame, f))) {
                    let change = distance(frame, 0, feature) - distance(0, 0, feature);
                    // Relative to the distance from the camera, at which the positions are rounded.
                    assert!(change.abs() < 1e-12 * tracks.frame(0)[0].coords.norm(), "{name}: {change:e}");
                }
            }
        }
    }

    #[test]
    fn a_body_that_loses_all_its_samples_is_an_error() {
        let options = SceneOptions { dropout: Some(0.999), features: Some(1), frames: Some(2), ..Default::default() };
        let error = simulate("rigid", &options).expect_err("nothing left").to_string();
        assert!(error.starts_with("body `base` has no sample"), "{error}");
    }
}
