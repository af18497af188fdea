//! Time on the standard workloads: W1 registration, W2 one pair, W3 all pairs, and one pair by likelihood.
//!
//! Each group holds, beside ours, what it is to be compared with in the same run: reading the same memory once, and
//! registration by nalgebra's SVD. Results are compared before they are timed.
//!
//! ```sh
//! cargo bench -p jointscope-detection --bench workloads
//! ```

#[path = "peers/svd.rs"]
mod svd;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use jointscope_detection::{Configuration, Detector};
use jointscope_models::Catalog;
use jointscope_motion::{
    Body, BodyMotion, MotionSettings, Observation, Registration, Tracks, register, register_frames,
};
use jointscope_scenes::{
    SceneOptions, simulate,
    workloads::{hinge, kitchen, registrations},
};
use svd::by_svd;

const THESIS: &str = include_str!("../../../configs/thesis.toml");
/// Angle by which the registrations compared may differ, radians: both are exact up to rounding.
const SAME: f64 = 1e-10;

fn sum_of_coordinates(tracks: &Tracks) -> f64 {
    (0..tracks.frames()).flat_map(|frame| tracks.frame(frame)).map(|p| p.x + p.y + p.z).sum()
}

fn registration(criterion: &mut Criterion) {
    const FRAMES: usize = 100_000;
    const FEATURES: usize = 50;
    let workload = registrations(FRAMES, FEATURES, 1001).expect("a workload");
    let (reference, tracks) = (&workload.reference, &workload.tracks);
    let shape: Vec<_> = reference.iter().copied().map(Some).collect();
    let mut poses = vec![None; FRAMES];
    register_frames(&shape, tracks, &mut poses);
    for frame in (0..FRAMES).step_by(997) {
        let in_lanes = poses[frame].expect("solvable");
        let ours = register(reference.iter().zip(tracks.frame(frame))).expect("solvable");
        let theirs = by_svd(reference, tracks.frame(frame)).expect("solvable");
        assert!(ours.rotation.angle_to(&theirs.rotation) < SAME, "frame {frame}");
        assert!(in_lanes.rotation.angle_to(&theirs.rotation) < SAME, "frame {frame}, in lanes");
    }
    let mut group = criterion.benchmark_group("W1 registration");
    group.sample_size(10);
    group.throughput(Throughput::Elements(FRAMES as u64));
    let size = format!("{FRAMES} frames of {FEATURES} features");
    group.bench_function(BenchmarkId::new("read the memory", &size), |b| {
        b.iter(|| sum_of_coordinates(black_box(tracks)));
    });
    group.bench_function(BenchmarkId::new("jointscope, in lanes", &size), |b| {
        b.iter(|| register_frames(&shape, black_box(tracks), &mut poses));
    });
    group.bench_function(BenchmarkId::new("jointscope, one by one", &size), |b| {
        b.iter(|| {
            (0..FRAMES)
                .filter_map(|t| register(reference.iter().zip(tracks.frame(t))).ok())
                .map(|pose| pose.translation.x)
                .sum::<f64>()
        });
    });
    group.bench_function(BenchmarkId::new("nalgebra SVD", &size), |b| {
        b.iter(|| {
            (0..FRAMES).filter_map(|t| by_svd(reference, tracks.frame(t))).map(|pose| pose.translation.x).sum::<f64>()
        });
    });
    group.finish();

    let labels = (0..FEATURES).map(|feature| feature.to_string()).collect();
    let body = Body::from_points("body", labels, tracks.clone()).expect("seen");
    let mut group = criterion.benchmark_group("W1 body");
    group.sample_size(10);
    group.throughput(Throughput::Elements(FRAMES as u64));
    for registration in [Registration::Chained, Registration::First, Registration::Shape] {
        let settings = MotionSettings { registration, ..MotionSettings::default() };
        group.bench_function(BenchmarkId::new(format!("{registration:?}"), &size), |b| {
            b.iter(|| BodyMotion::of(black_box(&body), &settings));
        });
    }
    group.finish();
}

fn detection(criterion: &mut Criterion) {
    let catalog = Catalog::linked().expect("unique names");
    let detector = Detector::new(Configuration::parse(THESIS, &catalog).expect("valid"));
    let one_pair = hinge(437, 40, 1002).expect("a workload").recording;
    let all_pairs = kitchen(50, 1000, 40, 1003).expect("a workload").recording;
    let mut group = criterion.benchmark_group("thesis detection");
    group.sample_size(10);
    for (name, recording) in
        [("W2 one pair, 437 frames of 40 features", one_pair), ("W3 1225 pairs, 1000 frames of 40 features", all_pairs)]
    {
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            group.bench_function(BenchmarkId::new(name, format!("{threads} threads")), |b| {
                b.iter_batched(
                    || recording.clone(),
                    |recording| pool.install(|| detector.detect(recording, None)),
                    criterion::BatchSize::LargeInput,
                );
            });
        }
    }
    group.finish();
}

/// A pair of bodies of the nominal scene: both registrations, and all models and the rule besides.
fn likelihood(criterion: &mut Criterion) {
    let catalog = Catalog::linked().expect("unique names");
    let configuration = Configuration::parse("", &catalog).expect("valid");
    let settings = MotionSettings::default();
    let detector = Detector::new(configuration);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("threads");
    let mut group = criterion.benchmark_group("likelihood detection, 50 frames of 20 features");
    group.sample_size(20);
    for joint in ["rigid", "revolute", "planar", "disconnected"] {
        let options = SceneOptions { seed: 1008, ..SceneOptions::default() };
        let recording = simulate(joint, &options).expect("a scene").recording;
        let found = detector.detect(recording.clone(), None).expect("two bodies").pairs.remove(0);
        assert_eq!(found.verdict.joint, joint);
        group.bench_function(BenchmarkId::new("read the memory", joint), |b| {
            b.iter(|| {
                let tracks = |body: &Body| match body.observation() {
                    Observation::Points { tracks, .. } => sum_of_coordinates(tracks),
                    _ => 0.0,
                };
                black_box(&recording).bodies().iter().map(tracks).sum::<f64>()
            });
        });
        group.bench_function(BenchmarkId::new("both registrations", joint), |b| {
            b.iter(|| {
                let motions = recording.bodies().iter().map(|body| BodyMotion::of(black_box(body), &settings));
                motions.map(|motion| motion.pose_covariances().len()).sum::<usize>()
            });
        });
        group.bench_function(BenchmarkId::new("registrations, eight models and rule", joint), |b| {
            b.iter_batched(
                || recording.clone(),
                |recording| pool.install(|| detector.detect(recording, None)),
                criterion::BatchSize::SmallInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, registration, detection, likelihood);
criterion_main!(benches);
