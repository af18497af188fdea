//! Depth changes that a single camera compresses: told from a body's rigidity, and undone.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Matrix6xX, Point3, SMatrix, UnitQuaternion, Vector3, Vector6};

use crate::noise::believed_drift;
use crate::poses::Shape;
use crate::robust::{MEDIAN_LENGTH, SCALE, WILD, register_robustly};
use crate::{Body, DepthGainSetting, Observation, Pose, Tracks, evenly, quantile};

/// Gains that fits begin with, and those that are believed.
const STARTS: [f64; 4] = [0.55, 0.75, 1.0, 1.3];
const LEAST: f64 = 0.2;
const MOST: f64 = 3.0;
/// Frames that the gain is told from.
const FRAMES: usize = 150;
/// Iterations of a fit, and relative change of its cost at which it ends.
const ITERATIONS: usize = 30;
const CONVERGED: f64 = 1e-9;
/// Rounds in which samples are weighed anew.
const ROUNDS: usize = 4;
/// Relative standard error from which a gain counts as unseen.
const VAGUE: f64 = 0.05;
/// Standard errors by which a gain must differ from 1 for depths to be changed.
const CLEAR: f64 = 3.0;

/// What is known of the compression of a body's depth changes.
///
/// # Convention
/// The camera is at the origin of the recording's coordinates and looks along z. A body that is at depth `Z(t)` is seen
/// at `z(t) = Z(0) + gain (Z(t) - Z(0))`, feature by feature, frame 0 being the first one that poses the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthGain {
    /// The gain that was undone; 1 where depths were left as they are.
    pub gain: f64,
    /// Its standard error, where it was estimated and the body's rigidity tells it.
    pub standard_error: Option<f64>,
    /// Whether the gain is known: given, or told by the body's rigidity, which needs a turn out of the image plane.
    pub observable: bool,
}

impl DepthGain {
    const UNSEEN: Self = Self { gain: 1.0, standard_error: None, observable: false };
}

/// A body whose depth changes were restored.
#[derive(Debug, Clone)]
pub struct Undone {
    /// The body, by the gain that is believed.
    pub body: Body,
    /// The gain.
    pub gain: DepthGain,
    /// The body by a gain that is a standard error larger; `None` where the error is not known.
    pub by_larger_gain: Option<Body>,
}

impl Undone {
    fn untouched(body: &Body) -> Self {
        Self { body: body.clone(), gain: DepthGain::UNSEEN, by_larger_gain: None }
    }
}

/// Undoes the compression of a body's depth changes; `None` where nothing is asked for.
///
/// The gain is told by the body's rigidity alone: poses, shape and gain are fitted to all samples, wild ones apart. The
/// body is left as it is where the gain is not told, or does not differ from 1 by more than chance.
///
/// # References
/// docs/method.md, "One camera".
pub fn undo_depth_gain(body: &Body, setting: DepthGainSetting) -> Option<Undone> {
    let known = match setting {
        DepthGainSetting::None => return None,
        DepthGainSetting::Estimate => None,
        DepthGainSetting::Known(gain) => Some(gain),
    };
    let Observation::Points { labels, tracks } = body.observation() else { return Some(Undone::untouched(body)) };
    if tracks.rest() {
        return Some(Undone::untouched(body));
    }
    let starts = known.map_or(STARTS.to_vec(), |gain| vec![gain]);
    let begun = starts.into_iter().filter_map(|gain| {
        let mut bundle = Bundle::begun(tracks, gain, known.is_some())?;
        bundle.weigh(0..1)?;
        Some(bundle)
    });
    let best = begun.min_by(|a, b| a.typical().total_cmp(&b.typical()));
    let Some(best) = best.and_then(|mut best| best.weigh(1..ROUNDS).map(|()| best)) else {
        return Some(Undone::untouched(body));
    };
    let told = match known {
        Some(gain) => DepthGain { gain, standard_error: None, observable: true },
        None => best.told(),
    };
    let by = |gain: f64| {
        let places = Tracks::new(tracks.features(), best.undone(tracks, gain)).ok()?;
        Body::from_points(body.name(), labels.clone(), places).ok()
    };
    let restored = if told.gain == 1.0 { Some(body.clone()) } else { by(told.gain) };
    let Some(restored) = restored else { return Some(Undone::untouched(body)) };
    Some(Undone {
        body: restored,
        gain: told,
        by_larger_gain: told.standard_error.and_then(|error| by(told.gain + error)),
    })
}

/// Poses, shape and gain of a body, fitted together.
struct Bundle<'t> {
    tracks: &'t Tracks,
    frames: Vec<usize>,
    poses: Vec<Pose>,
    /// Places of the features in the recording's coordinates at the first frame.
    shape: Shape,
    gain: f64,
    fixed: bool,
    /// Of every sample of `frames`, 0 for those that are missing or wild.
    weights: Vec<f64>,
}

/// A place with its depth change restored, for a feature that was at this depth at the first frame.
fn unstretched(place: &Point3<f64>, depth: f64, gain: f64) -> Point3<f64> {
    Point3::new(place.x, place.y, depth + (place.z - depth) / gain)
}

impl<'t> Bundle<'t> {
    /// Weighs all samples anew, round after round, and fits; in the last rounds what is wild counts no more.
    fn weigh(&mut self, rounds: std::ops::Range<usize>) -> Option<()> {
        for round in rounds {
            let lengths = self.lengths();
            let mut seen: Vec<f64> = lengths.iter().copied().filter(|length| !length.is_nan()).collect();
            if seen.is_empty() {
                return None;
            }
            let sigma = (quantile(&mut seen, 0.5) / MEDIAN_LENGTH).max(1e-12);
            let soft = round + 2 < ROUNDS;
            let weight = |length: &f64| match length / sigma {
                far if far.is_nan() => 0.0,
                far if soft => (SCALE.powi(2) / (SCALE.powi(2) + far * far)).powi(2),
                far => f64::from(far < WILD),
            };
            self.weights = lengths.iter().map(weight).collect();
            self.settle()?;
        }
        Some(())
    }

    /// The typical distance of samples from the fit, which wild ones do not reach.
    fn typical(&self) -> f64 {
        let mut seen: Vec<f64> = self.lengths().into_iter().filter(|length| !length.is_nan()).collect();
        if seen.is_empty() { f64::INFINITY } else { quantile(&mut seen, 0.5) }
    }

    /// By registration of what this gain makes of the depths as they were first seen.
    fn begun(tracks: &'t Tracks, gain: f64, fixed: bool) -> Option<Self> {
        let features = tracks.features();
        let mut depths = vec![f64::NAN; features];
        let mut places = vec![Point3::from([f64::NAN; 3]); tracks.frames() * features];
        for frame in 0..tracks.frames() {
            for (feature, place) in tracks.seen(frame) {
                if depths[feature].is_nan() {
                    depths[feature] = place.z;
                }
                places[frame * features + feature] = unstretched(place, depths[feature], gain);
            }
        }
        let registered = register_robustly(&Tracks::new(features, places).ok()?).ok()?;
        let posed: Vec<usize> = (0..tracks.frames()).filter(|frame| registered.poses[*frame].is_some()).collect();
        let frames: Vec<usize> = evenly(posed.len(), FRAMES).into_iter().map(|index| posed[index]).collect();
        let poses: Vec<Pose> = frames.iter().filter_map(|frame| registered.poses[*frame]).collect();
        // What is seen twice only says nothing beyond its own place.
        let often = |feature: usize| frames.iter().filter(|frame| tracks.is_visible(**frame, feature)).count() > 2;
        let shape: Shape =
            registered.shape.into_iter().enumerate().map(|(f, place)| place.filter(|_| often(f))).collect();
        if frames.len() < 3 || shape.iter().flatten().count() < 3 {
            return None;
        }
        let weights = vec![1.0; frames.len() * features];
        Some(Self { tracks, frames, poses, shape, gain, fixed, weights })
    }

    /// The samples that the fit explains: index of the frame, feature, observed and true place, and the one it had first.
    fn samples(&self) -> impl Iterator<Item = (usize, usize, &Point3<f64>, Point3<f64>, f64)> {
        self.frames.iter().zip(&self.poses).enumerate().flat_map(move |(index, (frame, pose))| {
            self.tracks.seen(*frame).filter_map(move |(feature, observed)| {
                let place = self.shape[feature]?;
                Some((index, feature, observed, pose * place, place.z))
            })
        })
    }

    fn residual(&self, observed: &Point3<f64>, place: &Point3<f64>, depth: f64) -> Vector3<f64> {
        observed - Point3::new(place.x, place.y, depth + self.gain * (place.z - depth))
    }

    /// Distance of every sample of the frames from where the fit puts it, NaN where there is none.
    fn lengths(&self) -> Vec<f64> {
        let mut lengths = vec![f64::NAN; self.weights.len()];
        for (index, feature, observed, place, depth) in self.samples() {
            lengths[index * self.shape.len() + feature] = self.residual(observed, &place, depth).norm();
        }
        lengths
    }

    fn cost(&self) -> f64 {
        let square = |(index, feature, observed, place, depth): (usize, usize, &Point3<f64>, Point3<f64>, f64)| {
            self.weights[index * self.shape.len() + feature] * self.residual(observed, &place, depth).norm_squared()
        };
        self.samples().map(square).sum()
    }

    /// Damped Gauss-Newton steps until the cost rests.
    fn settle(&mut self) -> Option<()> {
        let mut cost = self.cost();
        let mut damping = 1e-4;
        for _ in 0..ITERATIONS {
            let equations = self.linearised();
            let (shape, poses, gain) = (self.shape.clone(), self.poses.clone(), self.gain);
            let mut lowered = None;
            for _ in 0..6 {
                self.step(&equations, damping)?;
                let trial = self.cost();
                if trial <= cost && (LEAST..=MOST).contains(&self.gain) {
                    lowered = Some(trial);
                    damping = (damping / 10.0_f64).max(1e-12);
                    break;
                }
                (self.shape, self.poses, self.gain) = (shape.clone(), poses.clone(), gain);
                damping *= 10.0;
            }
            let Some(trial) = lowered else { break };
            let rests = cost - trial <= CONVERGED * cost;
            cost = trial;
            if rests {
                break;
            }
        }
        cost.is_finite().then_some(())
    }

    /// Where every feature's unknowns begin; the gain's is the last.
    fn unknowns(&self) -> (Vec<Option<usize>>, usize) {
        let mut count = 0;
        let mut next = |place: &Option<Point3<f64>>| {
            place.map(|_| {
                count += 3;
                count - 3
            })
        };
        let columns = self.shape.iter().map(&mut next).collect();
        (columns, count)
    }

    fn linearised(&self) -> Equations {
        let (columns, gain) = self.unknowns();
        let size = gain + 1;
        let middles: Vec<Point3<f64>> = {
            let mut sums = vec![(Vector3::zeros(), 0.0); self.frames.len()];
            for (index, _, _, place, _) in self.samples() {
                sums[index].0 += place.coords;
                sums[index].1 += 1.0;
            }
            sums.into_iter().map(|(sum, count)| Point3::from(sum / f64::max(count, 1.0))).collect()
        };
        let blank = || Frame { normal: Matrix6::zeros(), gradient: Vector6::zeros(), cross: Matrix6xX::zeros(size) };
        let mut frames: Vec<Frame> = self.frames.iter().map(|_| blank()).collect();
        let (mut normal, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
        let squeeze = Vector3::new(1.0, 1.0, self.gain);
        for (index, feature, observed, place, depth) in self.samples() {
            let (weight, Some(column)) = (self.weights[index * self.shape.len() + feature], columns[feature]) else {
                continue;
            };
            if weight == 0.0 {
                continue;
            }
            let residual = self.residual(observed, &place, depth);
            let squeezed = |matrix: Matrix3<f64>| Matrix3::from_diagonal(&squeeze) * matrix;
            let mut by_shape = squeezed(self.poses[index].rotation.to_rotation_matrix().into_inner());
            by_shape[(2, 2)] += 1.0 - self.gain;
            let by_gain = Vector3::new(0.0, 0.0, if self.fixed { 0.0 } else { place.z - depth });
            normal.view_mut((column, column), (3, 3)).zip_apply(&(by_shape.tr_mul(&by_shape) * weight), |a, b| *a += b);
            let both = by_shape.tr_mul(&by_gain) * weight;
            for k in 0..3 {
                normal[(column + k, gain)] += both[k];
                normal[(gain, column + k)] += both[k];
            }
            normal[(gain, gain)] += weight * by_gain.norm_squared();
            gradient.rows_mut(column, 3).zip_apply(&(by_shape.tr_mul(&residual) * weight), |a, b| *a += b);
            gradient[gain] += weight * by_gain.dot(&residual);
            if index == 0 {
                continue;
            }
            let mut by_pose = SMatrix::<f64, 3, 6>::zeros();
            by_pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&squeezed(-(place - middles[index]).cross_matrix()));
            by_pose.fixed_view_mut::<3, 3>(0, 3).copy_from(&squeezed(Matrix3::identity()));
            let frame = &mut frames[index];
            frame.normal += by_pose.tr_mul(&by_pose) * weight;
            frame.gradient += by_pose.tr_mul(&residual) * weight;
            frame.cross.view_mut((0, column), (6, 3)).zip_apply(&(by_pose.tr_mul(&by_shape) * weight), |a, b| *a += b);
            frame.cross.view_mut((0, gain), (6, 1)).zip_apply(&(by_pose.tr_mul(&by_gain) * weight), |a, b| *a += b);
        }
        Equations { normal, gradient, frames, middles, columns }
    }

    fn step(&mut self, equations: &Equations, damping: f64) -> Option<()> {
        let solved = equations.reduced(damping, self.fixed)?;
        let step = &solved.step;
        self.gain += step[step.len() - 1];
        for (place, column) in self.shape.iter_mut().zip(&equations.columns) {
            if let (Some(place), Some(column)) = (place, column) {
                *place += Vector3::new(step[*column], step[column + 1], step[column + 2]);
            }
        }
        for (index, pose) in self.poses.iter_mut().enumerate().skip(1) {
            let frame = &equations.frames[index];
            let left = frame.gradient - &frame.cross * step;
            let moved = solved.inverses[index] * left;
            let turn = UnitQuaternion::new(moved.fixed_rows::<3>(0).into_owned());
            let middle = equations.middles[index].coords;
            let shift = middle + turn * (pose.translation.vector - middle) + moved.fixed_rows::<3>(3);
            *pose = Pose::from_parts(shift.into(), turn * pose.rotation);
        }
        Some(())
    }

    /// What the fit tells of the gain.
    fn told(&self) -> DepthGain {
        let equations = self.linearised();
        let Some(solved) = equations.reduced(0.0, false) else { return DepthGain::UNSEEN };
        let counted = self.weights.iter().filter(|weight| **weight > 0.0).count();
        let freedom = 3.0 * counted as f64 - 6.0 * (self.frames.len() - 1) as f64 - solved.step.len() as f64;
        if freedom < 1.0 {
            return DepthGain::UNSEEN;
        }
        let drift = believed_drift(self.lag_one(), self.frames.len());
        let variance = solved.gain_variance * self.cost() / freedom * (1.0 + drift) / (1.0 - drift);
        let error = variance.sqrt();
        if !(error.is_finite() && error < VAGUE * self.gain) {
            return DepthGain::UNSEEN;
        }
        let gain = if (self.gain - 1.0).abs() > CLEAR * error { self.gain } else { 1.0 };
        DepthGain { gain, standard_error: Some(error), observable: true }
    }

    /// Correlation of the residuals of a feature with its last ones, among the frames that the gain is told from.
    fn lag_one(&self) -> f64 {
        let mut latest: Vec<Option<Vector3<f64>>> = vec![None; self.shape.len()];
        let (mut product, mut square) = (0.0, 0.0);
        for (index, feature, observed, place, depth) in self.samples() {
            if self.weights[index * self.shape.len() + feature] == 0.0 {
                continue;
            }
            let residual = self.residual(observed, &place, depth);
            if let Some(last) = latest[feature].replace(residual) {
                product += last.dot(&residual);
                square += 0.5 * (last.norm_squared() + residual.norm_squared());
            }
        }
        if square > 0.0 { product / square } else { 0.0 }
    }

    /// All samples, of all frames, with their depth changes restored by a gain; features that the fit does not know are missing.
    fn undone(&self, tracks: &Tracks, gain: f64) -> Vec<Point3<f64>> {
        let mut places = vec![Point3::from([f64::NAN; 3]); tracks.frames() * self.shape.len()];
        for frame in 0..tracks.frames() {
            for (feature, place) in tracks.seen(frame) {
                if let Some(first) = self.shape[feature] {
                    places[frame * self.shape.len() + feature] = unstretched(place, first.z, gain);
                }
            }
        }
        places
    }
}

/// Normal equations: of shape and gain, and of every frame's pose with what couples it to them.
struct Equations {
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
    frames: Vec<Frame>,
    middles: Vec<Point3<f64>>,
    columns: Vec<Option<usize>>,
}

struct Frame {
    normal: Matrix6<f64>,
    gradient: Vector6<f64>,
    cross: Matrix6xX<f64>,
}

struct Solved {
    step: DVector<f64>,
    inverses: Vec<Matrix6<f64>>,
    gain_variance: f64,
}

impl Equations {
    /// With the poses eliminated.
    fn reduced(&self, damping: f64, fixed: bool) -> Option<Solved> {
        let size = self.gradient.len();
        let (mut normal, mut gradient) = (self.normal.clone(), self.gradient.clone());
        let mut inverses = Vec::with_capacity(self.frames.len());
        for (index, frame) in self.frames.iter().enumerate() {
            if index == 0 {
                inverses.push(Matrix6::zeros());
                continue;
            }
            let mut own = frame.normal;
            let floor = 1e-12 * own.trace() + f64::MIN_POSITIVE;
            (0..6).for_each(|k| own[(k, k)] += damping * own[(k, k)] + floor);
            let inverse = own.cholesky()?.inverse();
            let carried = inverse * &frame.cross;
            normal.gemm_tr(-1.0, &frame.cross, &carried, 1.0);
            gradient.gemv_tr(-1.0, &carried, &frame.gradient, 1.0);
            inverses.push(inverse);
        }
        let floor = 1e-12 * normal.trace() / size as f64 + f64::MIN_POSITIVE;
        for k in 0..size {
            normal[(k, k)] += damping * self.normal[(k, k)] + floor;
        }
        if fixed {
            normal[(size - 1, size - 1)] += 1.0;
        }
        let factor = normal.cholesky()?;
        let mut unit = DVector::zeros(size);
        unit[size - 1] = 1.0;
        let gain_variance = factor.solve(&unit)[size - 1];
        Some(Solved { step: factor.solve(&gradient), inverses, gain_variance })
    }
}
