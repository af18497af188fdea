//! Joints of bodies that show a single point: the curves and surfaces on which each joint moves it.
//!
//! The best seen feature is judged: at rest (rigid), on a line (prismatic), a circle (revolute), a helix (screw), in a
//! plane (planar), on a sphere (spherical), anywhere (free). The evidence is of the same form as for poses, but three
//! numbers are seen per frame instead of six; an orientation that nobody saw takes no part.

use jointscope_motion::{RelativeMotion, evenly, leaps, quantile};
use nalgebra::{DMatrix, DVector, Matrix3, Point3, Unit, Vector3};

use crate::lower_pair::{bend_cost, far_hinge_cost, misfit};
use crate::{Axis, AxisUncertainty, Confidence, Departure, Evidence, FitError, Joint, JointFit, Mobility, Positions};

/// Frames below which a path says nothing.
const FEWEST: usize = 4;
/// Most frames that are judged; of longer paths so many are taken, evenly.
const MOST_FRAMES: usize = 400;
/// Frames that count as independent where play decides.
const INDEPENDENT_FRAMES: usize = 60;
/// Least noise, as a share of the travel.
const LEAST_NOISE: f64 = 2e-5;
/// Size of a body that shows one point, metres, for the play of rest.
const UNKNOWN_SIZE: f64 = 0.1;
/// Squared departure beyond which a joint is not the right one: paths of single points tell less.
const ADEQUATE: f64 = 3.0;
/// Rounds of fitting a circle or helix.
const ROUNDS: usize = 60;
/// Coordinates that slow departures have in a recording, for the uncertainty of axes.
const SLOW_FRAMES: f64 = 12.0;

/// The path of the best seen feature, in axes of its own.
struct Path {
    recording_frames: usize,
    frames: Vec<usize>,
    /// Places in the path's axes about its centre, the direction of the widest spread first.
    places: Vec<Vector3<f64>>,
    kept: Vec<bool>,
    axes: Matrix3<f64>,
    centre: Vector3<f64>,
    noise: f64,
    play: f64,
    rest_play: f64,
    /// Frames left out because the point leaps away in them.
    left_out: usize,
    /// Share of the frames in which it does, also where it is so large that none was left out.
    leap_share: f64,
}

impl Path {
    fn of(motion: &RelativeMotion<'_>) -> Result<Self, FitError> {
        let trajectories = motion.trajectories();
        // Of features seen equally often, one that moves more tells more.
        let worth = |feature: usize| {
            let trajectory = trajectories.get(feature);
            let points: Vec<Vector3<f64>> = trajectory.points.iter().map(|p| p.coords).collect();
            (points.len() as f64 / motion.frames().len() as f64)
                * (1.0 + 0.1 * if points.len() > 1 { misfit::vector_range(&points) } else { 0.0 })
        };
        let best = (0..trajectories.len()).max_by(|&a, &b| worth(a).total_cmp(&worth(b)));
        let found = best.map_or(0, |feature| trajectories.get(feature).points.len());
        let (Some(best), true) = (best, found >= FEWEST) else {
            return Err(FitError::TooFewFrames { needed: FEWEST, found });
        };
        let trajectory = trajectories.get(best);
        let of_bodies = motion.moving().noise().position.unwrap_or(0.0);
        let of_reference = motion.reference().noise().position.unwrap_or(0.0);
        let places: Vec<Vector3<f64>> = trajectory.points.iter().map(|p| p.coords).collect();
        let leaps = leaps(&places, LEAST_NOISE * misfit::vector_range(&places));
        let left_out = leaps.frames.iter().filter(|leap| **leap).count();
        let taken: Vec<usize> = evenly(found, MOST_FRAMES).into_iter().filter(|&k| !leaps.frames[k]).collect();
        let frames = taken.iter().map(|&k| trajectory.frames[k]).collect();
        let points: Vec<Vector3<f64>> = taken.iter().map(|&k| trajectory.points[k].coords).collect();
        let middle = Vector3::from_fn(|axis, _| quantile(&mut points.iter().map(|p| p[axis]).collect::<Vec<_>>(), 0.5));
        let mut distances: Vec<f64> = points.iter().map(|p| (p - middle).norm()).collect();
        let reach = 2.0 * quantile(&mut distances.clone(), 0.95) + 1e-12;
        let mut kept: Vec<bool> = distances.drain(..).map(|distance| distance <= reach).collect();
        let near: Vec<Vector3<f64>> = points.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(p, _)| *p).collect();
        let travel = misfit::vector_range(&near);
        let noise = of_bodies.hypot(of_reference).max(LEAST_NOISE * travel).max(f64::MIN_POSITIVE.sqrt());
        let (mut centre, mut axes, mut places) = (middle, Matrix3::identity(), Vec::new());
        for _ in 0..3 {
            let near = || points.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(p, _)| p);
            centre = near().sum::<Vector3<f64>>() / near().count().max(1) as f64;
            let scatter = near().map(|p| (p - centre) * (p - centre).transpose()).sum::<Matrix3<f64>>();
            let eigen = scatter.symmetric_eigen();
            let mut order = [0, 1, 2];
            order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
            let column = |k: usize| eigen.eigenvectors.column(order[k]).into_owned();
            axes = Matrix3::from_columns(&[column(0), column(1), column(0).cross(&column(1))]);
            places = points.iter().map(|p| axes.tr_mul(&(p - centre))).collect();
            let off: Vec<f64> = places.iter().map(|p: &Vector3<f64>| p.y.hypot(p.z)).collect();
            kept = misfit::isolated(&off, noise).into_iter().map(|wrong| !wrong).collect();
        }
        let play = motion.moving().play();
        let size = motion.reference().size();
        let of_travel = play.travel * travel + play.size * size + play.distance;
        Ok(Self {
            recording_frames: motion.recording_frames(),
            left_out,
            leap_share: leaps.share,
            frames,
            places,
            kept,
            axes,
            centre,
            noise,
            play: of_travel,
            rest_play: play.size * size.max(UNKNOWN_SIZE) + play.distance,
        })
    }

    fn count(&self) -> f64 {
        self.places.len() as f64
    }

    /// Where a point of the path's axes is in the reference.
    fn out(&self, place: Vector3<f64>) -> Point3<f64> {
        Point3::from(self.centre + self.axes * place)
    }

    fn direction(&self, along: Vector3<f64>) -> Unit<Vector3<f64>> {
        Unit::new_normalize(self.axes * along)
    }

    /// Mean square of every coordinate about its mean.
    fn variances(&self) -> Vector3<f64> {
        let near = || self.places.iter().zip(&self.kept).filter(|(_, kept)| **kept).map(|(p, _)| p);
        let count = near().count().max(1) as f64;
        let mean = near().sum::<Vector3<f64>>() / count;
        near().map(|p| (p - mean).component_mul(&(p - mean))).sum::<Vector3<f64>>() / count
    }

    /// The fit with its evidence, from the residual lengths, the directions they have, and the variances of the
    /// positions.
    fn fit(
        &self,
        residuals: &[f64],
        held: f64,
        spreads: &[f64],
        mobility: Mobility,
        play: f64,
        joint: Joint,
    ) -> Result<JointFit, FitError> {
        let square = if held > 0.0 { misfit::mean_square(residuals, self.noise) } else { 0.0 };
        let count = self.count();
        let excess = (square - held * self.noise.powi(2)).max(0.0);
        let cost = |variance: &f64| 1.0 + (1.0 + variance / self.noise.powi(2)).ln();
        let plays = play > 0.0;
        let fixed = (mobility.parameters as f64 - 2.0 * spreads.len() as f64).max(0.0);
        let evidence = Evidence {
            chi_squared: count * square / self.noise.powi(2),
            freedom: (held * count - fixed).max(0.0),
            configuration_cost: count * spreads.iter().map(cost).sum::<f64>(),
            prior_cost: 0.0,
            mobility,
            observations: (3 * self.places.len().min(INDEPENDENT_FRAMES)) as f64,
            correlation_time: 1.0,
            departure: plays.then(|| Departure {
                squared: excess / play.powi(2),
                per_noise: if held > 0.0 { count * (play / self.noise).powi(2) } else { f64::INFINITY },
                adequate: ADEQUATE,
            }),
        };
        let confidence = Confidence::new((-0.5 * evidence.own_charge()).exp().clamp(0.0, 1.0))?;
        let mut fit = JointFit::new(confidence, joint)
            .with_part("misfit_distance", excess.sqrt())
            .with_part("departure", evidence.departure.map_or(0.0, |departure| departure.squared))
            .with_part("chi_squared_per_freedom", evidence.chi_squared_per_freedom())
            .with_residual((residuals.iter().map(|r| r * r).sum::<f64>() / count).sqrt())
            .with_part("leap_share", self.leap_share);
        fit.evidence = Some(evidence);
        fit.notes.push("a single point: the orientation is not seen".into());
        if self.left_out > 0 {
            fit.notes.push(format!("frames in which the point leaps away and back were left out: {}", self.left_out));
        }
        Ok(fit)
    }

    /// Positions per frame of the recording, counted from the first, along the direction of the farthest; and whether
    /// the direction had to be turned.
    fn positions(&self, values: &[f64]) -> (Positions, bool) {
        let mut rows = vec![None; self.recording_frames];
        for (frame, value) in self.frames.iter().zip(values) {
            rows[*frame] = Some(value - values[0]);
        }
        let seen = || rows.iter().flatten();
        let backwards = -seen().copied().fold(0.0, f64::min) > seen().copied().fold(0.0, f64::max);
        let positions = Positions::of_one_freedom(rows);
        (if backwards { positions.reversed() } else { positions }, backwards)
    }
}

/// The point rests.
///
/// # Errors
/// [`FitError::TooFewFrames`].
pub(crate) fn rest(motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
    let path = Path::of(motion)?;
    let residuals: Vec<f64> = path.places.iter().map(Vector3::norm).collect();
    path.fit(
        &residuals,
        3.0,
        &[],
        Mobility { turns: 0, slides: 0, parameters: 3, advances: false, roams: false },
        path.rest_play,
        Joint::default(),
    )
}

/// The point runs on a line, or on an arc that turns by little.
///
/// # Errors
/// [`FitError::TooFewFrames`].
pub(crate) fn line(motion: &RelativeMotion<'_>, bend: f64) -> Result<JointFit, FitError> {
    let path = Path::of(motion)?;
    let residuals: Vec<f64> = path.places.iter().map(|p| p.y.hypot(p.z)).collect();
    let along: Vec<f64> = path.places.iter().map(|p| p.x).collect();
    let (positions, backwards) = path.positions(&along);
    let direction = path.direction(if backwards { -Vector3::x() } else { Vector3::x() });
    let axis = Axis { point: path.out(path.places[0]), direction: Some(direction), pitch: None };
    let joint = Joint { axis: Some(axis), positions: Some(positions) };
    let variances = path.variances();
    let mobility = Mobility { turns: 0, slides: 1, parameters: 6, advances: false, roams: false };
    let mut fit = path.fit(&residuals, 2.0, &[variances.x], mobility, path.play, joint)?;
    let slow = path.noise.powi(2) / path.count() + variances.y.max(path.noise.powi(2)) / SLOW_FRAMES.min(path.count());
    let angle = (2.0 * slow / variances.x.max(f64::MIN_POSITIVE)).sqrt().min(std::f64::consts::FRAC_PI_2);
    fit.axis_uncertainty = Some(AxisUncertainty { angle: Some(angle), distance: None });
    let arc = circle(motion, 1.0)?;
    let turned = arc.parts.get("sweep").copied().unwrap_or(0.0);
    fit.alternatives.extend(arc.evidence.map(|evidence| Evidence { prior_cost: bend_cost(turned, bend), ..evidence }));
    Ok(fit.with_part("bend", turned))
}

/// The point runs on a circle.
///
/// # Errors
/// [`FitError::TooFewFrames`].
pub(crate) fn circle(motion: &RelativeMotion<'_>, sweep: f64) -> Result<JointFit, FitError> {
    round(motion, sweep, false)
}

/// The point runs on a helix.
///
/// # Errors
/// [`FitError::TooFewFrames`].
pub(crate) fn helix(motion: &RelativeMotion<'_>, sweep: f64) -> Result<JointFit, FitError> {
    round(motion, sweep, true)
}

fn round(motion: &RelativeMotion<'_>, sweep: f64, rises: bool) -> Result<JointFit, FitError> {
    let path = Path::of(motion)?;
    let off = quantile(&mut path.places.iter().map(|p| p.y.hypot(p.z)).collect::<Vec<_>>(), 0.5);
    let tight = 3.0 * path.play.max(path.noise).max(0.3 * off);
    // Some paths leave their circle for a while: of three degrees of robustness the best counts.
    let fits = [tight, 4.0 * tight, 1e9].map(|limit| Round::of(&path.places, limit, rises));
    let [one, two, three] = fits;
    let best = [two, three].into_iter().fold(one, |best, other| {
        let square = |fit: &Round| misfit::mean_square(&fit.residuals(), path.noise);
        if square(&other) < square(&best) { other } else { best }
    });
    let angles = best.angles.clone();
    let turned = misfit::range(angles.iter().copied()).min(std::f64::consts::TAU);
    let mean = angles.iter().sum::<f64>() / path.count();
    let variance = angles.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / path.count();
    let arc = best.radius().powi(2) * variance.min(std::f64::consts::PI.powi(2) / 3.0);
    let (positions, backwards) = path.positions(&angles);
    let normal = best.normal();
    let direction = path.direction(if backwards { -normal } else { normal });
    let axis = Axis {
        point: path.out(best.centre()),
        direction: Some(direction),
        pitch: Some(if rises { best.pitch() } else { 0.0 }),
    };
    let joint = Joint { axis: Some(axis), positions: Some(positions) };
    let mobility =
        Mobility { turns: 1, slides: 0, parameters: if rises { 9 } else { 7 }, advances: rises, roams: false };
    let mut fit = path.fit(&best.residuals(), 2.0, &[arc], mobility, path.play, joint)?;
    let misfit = fit.parts["misfit_distance"];
    let sigma = path.noise.powi(2) + misfit.powi(2) * (path.count() / SLOW_FRAMES).max(1.0);
    fit.axis_uncertainty = Some(best.uncertainty(sigma));
    if let Some(evidence) = &mut fit.evidence {
        evidence.prior_cost += far_hinge_cost(turned.to_degrees(), sweep);
    }
    Ok(fit.with_part("sweep", turned.to_degrees()).with_part("radius", best.radius()))
}

/// The point stays in a plane.
///
/// # Errors
/// [`FitError::TooFewFrames`].
pub(crate) fn plane(motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
    let path = Path::of(motion)?;
    let residuals: Vec<f64> = path.places.iter().map(|p| p.z.abs()).collect();
    let axis = Axis { point: path.out(path.places[0]), direction: Some(path.direction(Vector3::z())), pitch: None };
    let variances = path.variances();
    let mobility = Mobility { turns: 1, slides: 2, parameters: 10, advances: false, roams: true };
    let joint = Joint { axis: Some(axis), positions: None };
    let mut fit = path.fit(&residuals, 1.0, &[variances.x, variances.y], mobility, path.play, joint)?;
    let angle =
        (variances.z.max(path.noise.powi(2)) / SLOW_FRAMES.min(path.count()) / variances.y.max(f64::MIN_POSITIVE))
            .sqrt()
            .min(std::f64::consts::FRAC_PI_2);
    fit.axis_uncertainty = Some(AxisUncertainty { angle: Some(angle), distance: None });
    // A plane is also a sphere of which little is seen.
    let sphere = sphere(motion, 1.0)?;
    let turned = sphere.parts.get("sweep").copied().unwrap_or(0.0);
    fit.alternatives
        .extend(sphere.evidence.map(|evidence| Evidence { prior_cost: (turned / 8.0).powi(2), ..evidence }));
    Ok(fit)
}

/// The point stays on a sphere.
///
/// # Errors
/// [`FitError::TooFewFrames`].
pub(crate) fn sphere(motion: &RelativeMotion<'_>, sweep: f64) -> Result<JointFit, FitError> {
    let path = Path::of(motion)?;
    // |p|² = 2 c·p + (r² - |c|²), linear in centre and radius.
    let (mut normal, mut right) = (nalgebra::Matrix4::zeros(), nalgebra::Vector4::zeros());
    for (place, _) in path.places.iter().zip(&path.kept).filter(|(_, kept)| **kept) {
        let row = nalgebra::Vector4::new(2.0 * place.x, 2.0 * place.y, 2.0 * place.z, 1.0);
        normal += row * row.transpose();
        right += row * place.norm_squared();
    }
    let scale = normal.diagonal().map(|x| x.max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = nalgebra::Matrix4::from_fn(|row, column| normal[(row, column)] * scale[row] * scale[column])
        + nalgebra::Matrix4::identity() * 1e-13;
    let solution = scaled.cholesky().map_or_else(nalgebra::Vector4::zeros, |factor| {
        factor.solve(&right.component_mul(&scale)).component_mul(&scale)
    });
    let centre = solution.fixed_rows::<3>(0).into_owned();
    let radius = (solution[3] + centre.norm_squared()).max(1e-12).sqrt();
    let residuals: Vec<f64> = path.places.iter().map(|p| ((p - centre).norm() - radius).abs()).collect();
    let variances = path.variances();
    let mobility = Mobility { turns: 3, slides: 0, parameters: 11, advances: false, roams: false };
    let axis = Axis { point: path.out(centre), direction: None, pitch: None };
    let joint = Joint { axis: Some(axis), positions: None };
    let mut fit = path.fit(&residuals, 1.0, &[variances.x, variances.y], mobility, path.play, joint)?;
    let seen = misfit::range(path.places.iter().map(|p| p.x)) / radius;
    let turned = seen.to_degrees();
    if let Some(evidence) = &mut fit.evidence {
        evidence.prior_cost += far_hinge_cost(turned, sweep);
    }
    Ok(fit.with_part("sweep", turned).with_part("radius", radius))
}

/// The point goes where it wants.
///
/// # Errors
/// [`FitError::TooFewFrames`].
pub(crate) fn anywhere(motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
    let path = Path::of(motion)?;
    let mobility = Mobility { turns: 3, slides: 3, parameters: 14, advances: true, roams: true };
    let variances = path.variances();
    let residuals = vec![0.0; path.places.len()];
    path.fit(&residuals, 0.0, variances.as_slice(), mobility, path.play, Joint::default())
}

/// A circle or helix in a path's axes, nearest to the points in the sense of robust least squares.
///
/// Parameters: centre x and y, radius, height, two slopes of the plane, rise per radian.
struct Round {
    parameters: DVector<f64>,
    in_plane: Vec<f64>,
    off_plane: Vec<f64>,
    angles: Vec<f64>,
    normal_matrix: DMatrix<f64>,
}

impl Round {
    fn of(places: &[Vector3<f64>], limit: f64, rises: bool) -> Self {
        let size = if rises { 7 } else { 6 };
        let mut round = Self {
            parameters: DVector::zeros(size),
            in_plane: vec![0.0; places.len()],
            off_plane: vec![0.0; places.len()],
            angles: vec![0.0; places.len()],
            normal_matrix: DMatrix::zeros(size, size),
        };
        round.begin(places);
        let mut weights = vec![1.0; places.len()];
        for iteration in 0..ROUNDS {
            round.measure(places);
            if iteration > 3 {
                for ((weight, a), b) in weights.iter_mut().zip(&round.in_plane).zip(&round.off_plane) {
                    *weight = (1.0 + (a * a + b * b) / (limit * limit)).powi(-2);
                }
            }
            let gradient = round.linearise(places, &weights);
            let mut damped = round.normal_matrix.clone();
            for k in 0..size {
                damped[(k, k)] += 1e-9 * damped[(k, k)] + f64::MIN_POSITIVE;
            }
            let Some(step) = damped.cholesky().map(|factor| factor.solve(&gradient)) else { break };
            let size = step.norm();
            if !size.is_finite() {
                break;
            }
            round.parameters += &step;
            if size < 1e-9 * (1e-3 + round.parameters.norm()) && iteration > 5 || round.parameters.amax() > 1e4 {
                break;
            }
        }
        round.measure(places);
        round
    }

    /// The circle of least algebraic distance.
    fn begin(&mut self, places: &[Vector3<f64>]) {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for p in places {
            let row = Vector3::new(2.0 * p.x, 2.0 * p.y, 1.0);
            normal += row * row.transpose();
            right += row * (p.x * p.x + p.y * p.y);
        }
        for k in 0..3 {
            normal[(k, k)] += 1e-12 * normal[(k, k)] + f64::MIN_POSITIVE;
        }
        let s = normal.cholesky().map_or_else(Vector3::zeros, |factor| factor.solve(&right));
        self.parameters[0] = s.x;
        self.parameters[1] = s.y;
        self.parameters[2] = (s.z + s.x * s.x + s.y * s.y).max(1e-12).sqrt();
        self.parameters[3] = quantile(&mut places.iter().map(|p| p.z).collect::<Vec<_>>(), 0.5);
    }

    fn measure(&mut self, places: &[Vector3<f64>]) {
        let p = &self.parameters;
        let rise = if p.len() > 6 { p[6] } else { 0.0 };
        let mut previous: Option<f64> = None;
        for (index, place) in places.iter().enumerate() {
            let (dx, dy) = (place.x - p[0], place.y - p[1]);
            let angle = dy.atan2(dx);
            let turns = previous.map_or(0.0, |before: f64| ((before - angle) / std::f64::consts::TAU).round());
            let angle = angle + std::f64::consts::TAU * turns;
            previous = Some(angle);
            self.angles[index] = angle;
            self.in_plane[index] = dx.hypot(dy) - p[2];
            self.off_plane[index] = place.z - p[3] - p[4] * dx - p[5] * dy - rise * (angle - self.angles[0]);
        }
    }

    fn linearise(&mut self, places: &[Vector3<f64>], weights: &[f64]) -> DVector<f64> {
        let size = self.parameters.len();
        let p = &self.parameters;
        self.normal_matrix.fill(0.0);
        let mut gradient = DVector::zeros(size);
        for (index, place) in places.iter().enumerate() {
            let (dx, dy) = (place.x - p[0], place.y - p[1]);
            let distance = dx.hypot(dy) + 1e-12;
            let radial = [dx / distance, dy / distance, 1.0, 0.0, 0.0, 0.0, 0.0];
            let raised = [-p[4], -p[5], 0.0, 1.0, dx, dy, self.angles[index] - self.angles[0]];
            for (row, residual) in [(radial, self.in_plane[index]), (raised, self.off_plane[index])] {
                for i in 0..size {
                    gradient[i] += weights[index] * row[i] * residual;
                    for j in 0..size {
                        self.normal_matrix[(i, j)] += weights[index] * row[i] * row[j];
                    }
                }
            }
        }
        gradient
    }

    fn residuals(&self) -> Vec<f64> {
        self.in_plane.iter().zip(&self.off_plane).map(|(a, b)| a.hypot(*b)).collect()
    }

    fn radius(&self) -> f64 {
        self.parameters[2].abs()
    }

    fn centre(&self) -> Vector3<f64> {
        Vector3::new(self.parameters[0], self.parameters[1], self.parameters[3])
    }

    fn normal(&self) -> Vector3<f64> {
        Vector3::new(-self.parameters[4], -self.parameters[5], 1.0).normalize()
    }

    fn pitch(&self) -> f64 {
        self.parameters.get(6).copied().unwrap_or(0.0)
    }

    fn uncertainty(&self, variance: f64) -> AxisUncertainty {
        let size = self.parameters.len();
        let scale: Vec<f64> =
            (0..size).map(|k| self.normal_matrix[(k, k)].max(f64::MIN_POSITIVE).sqrt().recip()).collect();
        let scaled = DMatrix::from_fn(size, size, |i, j| {
            self.normal_matrix[(i, j)] * scale[i] * scale[j] + if i == j { 1e-12 } else { 0.0 }
        });
        let Some(inverse) = scaled.cholesky().map(|factor| factor.inverse()) else {
            return AxisUncertainty { angle: Some(std::f64::consts::FRAC_PI_2), distance: Some(1e9) };
        };
        let of = |indices: &[usize]| {
            (variance * indices.iter().map(|&k| inverse[(k, k)] * scale[k] * scale[k]).sum::<f64>()).sqrt()
        };
        AxisUncertainty {
            angle: Some(of(&[4, 5]).min(std::f64::consts::FRAC_PI_2)),
            distance: Some(of(&[0, 1]).min(1e9)),
        }
    }
}
