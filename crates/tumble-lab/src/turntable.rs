//! The turntable procedure on whole recordings: the reference first, then any number of targets.

use nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3};
use tumble_core::gravity::vertical_earth_rate;
use tumble_core::model::{Covariance, Decomposition, ErrorModel, ModelError};
use tumble_core::noise::{Interval, Noise};
use tumble_core::regression::Unsolvable;
use tumble_core::rotation::Procrustes;
use tumble_core::turntable::fit::{Knowledge, Observation, TriadFit, fit};
use tumble_core::turntable::mounting::{MountingFit, PoseMean, fit_mounting};
use tumble_core::turntable::reference::{EarthFit, GyroscopeRest, SphereFit, fit_earth, fit_sphere};
use tumble_core::turntable::truth::{
    Attitude, ForceObservation, RateObservation, ReferenceTurn, RestPair, Truth, at_rest, from_poses,
    from_reference, turning, with_specific_force,
};

use crate::acquisition::{Acquired, interval};
use crate::pairing::{Clocks, Pairing, PairingError, pair};

/// How to calibrate.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Local gravity, m/s^2.
    pub gravity: f64,
    /// Latitude, rad, where it is known: it fixes the upward part of the Earth's rotation.
    pub latitude: Option<f64>,
    /// Where the truth comes from.
    pub truth: Truth,
    /// How the clocks are related.
    pub clocks: Clocks,
    /// Whether to fit the gyroscope's sensitivity to specific force.
    pub g_sensitivity: bool,
}

/// Why there is no calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TurntableError {
    /// Fewer rests than the unknowns need.
    TooFewRests {
        /// Rests found, or seen by both units.
        found: usize,
        /// Rests needed.
        needed: usize,
    },
    /// The rests point in too few directions.
    DirectionsTooAlike,
    /// The target could not be laid beside the reference.
    Pairing(PairingError),
    /// The truth asked for needs the mounting angle, which needs a pose list.
    NeedsPoses,
    /// The axes of a triad form a left-handed set, or coincide.
    Axes(ModelError),
    /// Something was not finite.
    Unsolvable,
}

impl From<Unsolvable> for TurntableError {
    fn from(_: Unsolvable) -> Self {
        Self::Unsolvable
    }
}

impl From<PairingError> for TurntableError {
    fn from(error: PairingError) -> Self {
        Self::Pairing(error)
    }
}

impl From<ModelError> for TurntableError {
    fn from(error: ModelError) -> Self {
        Self::Axes(error)
    }
}

/// Rests that twelve unknowns of three axes need.
pub const FEWEST_RESTS: usize = 4;

/// The reference, understood.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Bias of its accelerometer.
    pub sphere: SphereFit<f64>,
    /// Bias of its gyroscope and the Earth's rotation.
    pub earth: EarthFit<f64>,
    /// Attitude at each rest against the first.
    pub attitudes: Vec<Attitude<f64>>,
    /// Mounting angle, where poses are known.
    pub mounting: Option<MountingFit<f64>>,
}

/// Mean and covariance of the specific force at rest `k`.
fn force_at(unit: &Acquired, k: usize) -> (Vector3<f64>, Matrix3<f64>) {
    let rest = &unit.rests[k];
    (
        rest.specific_force(),
        mean_covariance(&unit.force_noise(), &interval(rest), &unit.session()),
    )
}

/// Covariance of a mean over an interval.
fn mean_covariance(noise: &[Noise<f64>; 3], over: &Interval<f64>, session: &Interval<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::from_fn(|i, _| noise[i].covariance(over, over, session)))
}

/// 1-sigma of the mean specific force at rest `k`, m/s^2.
pub fn force_sigma(unit: &Acquired, k: usize) -> Vector3<f64> {
    force_at(unit, k).1.diagonal().map(f64::sqrt)
}

/// 1-sigma of the mean angular rate at rest `k`, rad/s.
pub fn rate_sigma(unit: &Acquired, k: usize) -> Vector3<f64> {
    mean_covariance(&unit.rate_noise(), &interval(&unit.rests[k]), &unit.session())
        .diagonal()
        .map(f64::sqrt)
}

/// Understands the reference. `ups[k]` is the up direction of rest `k` in the table frame, where its pose is known.
///
/// # Errors
/// [`TurntableError`] as it says.
pub fn understand(
    unit: &Acquired,
    ups: &[Option<Vector3<f64>>],
    settings: &Settings,
) -> Result<Reference, TurntableError> {
    if unit.rests.len() < FEWEST_RESTS {
        return Err(TurntableError::TooFewRests {
            found: unit.rests.len(),
            needed: FEWEST_RESTS,
        });
    }
    let forces: Vec<_> = (0..unit.rests.len()).map(|k| force_at(unit, k)).collect();
    let sphere = fit_sphere(&forces, settings.gravity)?;
    if sphere.observed.contains(&false) {
        return Err(TurntableError::DirectionsTooAlike);
    }
    let attitudes = attitudes(unit);
    let gyroscope: Vec<_> = (0..unit.rests.len())
        .map(|k| GyroscopeRest {
            mean: unit.rests[k].angular_rate(),
            covariance: mean_covariance(&unit.rate_noise(), &interval(&unit.rests[k]), &unit.session()),
            start_from_here: attitudes[k],
        })
        .collect();
    let vertical = settings.latitude.map(|latitude| {
        let up = (forces[0].0 - sphere.bias).normalize();
        (up, vertical_earth_rate(latitude))
    });
    Ok(Reference {
        sphere,
        earth: fit_earth(&gyroscope, vertical)?,
        attitudes,
        mounting: fit_mounting(&poses(unit, ups), settings.gravity),
    })
}

/// Bias from the sphere of a unit's own rests: how well it does without any reference.
pub fn own_sphere(unit: &Acquired, gravity: f64) -> Option<SphereFit<f64>> {
    let forces: Vec<_> = (0..unit.rests.len()).map(|k| force_at(unit, k)).collect();
    fit_sphere(&forces, gravity).ok()
}

fn attitudes(unit: &Acquired) -> Vec<Attitude<f64>> {
    let mut here = Some(UnitQuaternion::identity());
    let mut attitudes = vec![here];
    for turn in &unit.turns {
        here = here
            .filter(|_| turn.complete)
            .map(|attitude| attitude * turn.start_from_end);
        attitudes.push(here);
    }
    attitudes
}

/// The rests whose pose is known.
pub fn poses(unit: &Acquired, ups: &[Option<Vector3<f64>>]) -> Vec<PoseMean<f64>> {
    let known = ups.iter().enumerate().filter_map(|(k, up)| Some((k, (*up)?)));
    known
        .map(|(k, up)| {
            let (measured, covariance) = force_at(unit, k);
            PoseMean {
                measured,
                up,
                sigma: (covariance.trace() / 3.0).sqrt(),
            }
        })
        .collect()
}

/// Calibration of one triad with all that goes with it.
#[derive(Clone, Debug)]
pub struct Triad {
    /// M and b.
    pub model: ErrorModel<f64>,
    /// Of `[M row by row, b]`.
    pub covariance: Covariance<f64>,
    /// Whether the data showed each of `[M row by row, b]`.
    pub observed: [bool; 12],
    /// `M = K L Q`.
    pub parts: Decomposition<f64>,
    /// Of `[bias, scale, non-orthogonality, mounting]`.
    pub parts_covariance: Covariance<f64>,
    /// g-sensitivity and its sigma.
    pub g_sensitivity: Option<(Matrix3<f64>, Matrix3<f64>)>,
    /// Directions decided by the data.
    pub rank: usize,
    /// Factor on the variances because the residuals exceed the noise; one where they do not.
    pub widened: f64,
    /// Sum of squared normalised residuals.
    pub chi_square: f64,
    /// Rows less unknowns.
    pub degrees_of_freedom: u32,
    /// Residual and 1-sigma of each interval.
    pub residuals: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// What each residual belongs to.
    pub labels: Vec<Label>,
}

/// The interval a residual belongs to, by index of the reference's rests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Label {
    /// A rest.
    Rest(usize),
    /// The turn between two rests.
    Turn(usize, usize),
}

/// A target, calibrated.
#[derive(Clone, Debug)]
pub struct Target {
    /// How it was laid beside the reference.
    pub pairing: Pairing,
    /// Accelerometer.
    pub accelerometer: Triad,
    /// Gyroscope.
    pub gyroscope: Triad,
}

/// Calibrates one target.
///
/// # Errors
/// [`TurntableError`] as it says.
pub fn calibrate(
    reference_unit: &Acquired,
    reference: &Reference,
    unit: &Acquired,
    ups: &[Option<Vector3<f64>>],
    settings: &Settings,
) -> Result<Target, TurntableError> {
    let pairing = pair(reference_unit, unit, settings.clocks)?;
    if pairing.pairs.len() < FEWEST_RESTS {
        return Err(TurntableError::TooFewRests {
            found: pairing.pairs.len(),
            needed: FEWEST_RESTS,
        });
    }
    let accelerometer = accelerometer(reference_unit, reference, unit, &pairing, ups, settings)?;
    let nominal = accelerometer.parts.mounting;
    let gyroscope = gyroscope(reference_unit, reference, unit, &pairing, &nominal, settings)?;
    Ok(Target {
        pairing,
        accelerometer,
        gyroscope,
    })
}

/// A stretch of the target in time of the reference.
fn on_reference(pairing: &Pairing, own: &Interval<f64>) -> Interval<f64> {
    Interval {
        start: pairing.clock.to_reference(own.start),
        end: pairing.clock.to_reference(own.end),
    }
}

fn session(pairing: &Pairing) -> Interval<f64> {
    let of = |pair: Option<&crate::pairing::Pair>| {
        pair.map_or(Interval { start: 0.0, end: 1.0 }, |pair| {
            on_reference(pairing, &interval(&pair.stretch))
        })
    };
    Interval {
        start: of(pairing.pairs.first()).start,
        end: of(pairing.pairs.last()).end,
    }
}

/// Largest plausible bias of a target accelerometer, m/s^2, and of a target gyroscope, rad/s.
const LARGEST_BIAS: (f64, f64) = (20.0, 1.0);

fn accelerometer(
    reference_unit: &Acquired,
    reference: &Reference,
    unit: &Acquired,
    pairing: &Pairing,
    ups: &[Option<Vector3<f64>>],
    settings: &Settings,
) -> Result<Triad, TurntableError> {
    let mut labels = Vec::new();
    let mut observations: Vec<ForceObservation<f64>> = Vec::new();
    for pair in &pairing.pairs {
        let (mean, covariance) = force_at(reference_unit, pair.reference);
        let rest = RestPair {
            interval: on_reference(pairing, &interval(&pair.stretch)),
            reference: mean,
            reference_covariance: covariance,
            target: pair.stretch.specific_force(),
            up: ups.get(pair.reference).copied().flatten(),
        };
        let observation = match (settings.truth, &reference.mounting) {
            (Truth::Reference, _) => Some(from_reference(&rest, &reference.sphere, settings.gravity)),
            (truth, Some(mounting)) => from_poses(truth, &rest, mounting, settings.gravity),
            (_, None) => return Err(TurntableError::NeedsPoses),
        };
        if let Some(observation) = observation {
            labels.push(Label::Rest(pair.reference));
            observations.push(observation);
        }
    }
    if observations.len() < FEWEST_RESTS {
        return Err(TurntableError::TooFewRests {
            found: observations.len(),
            needed: FEWEST_RESTS,
        });
    }
    let shared = match (settings.truth, &reference.mounting) {
        (Truth::RotateMeasurement | Truth::RotateTruth, Some(mounting)) => mounting.covariance,
        // The ideal poses share no error that anybody knows of; the prior must only not be singular.
        (Truth::Ideal, _) => Matrix3::identity() * 1e-18,
        _ => reference.sphere.covariance * reference.sphere.excess(),
    };
    let knowledge = Knowledge {
        noise: unit.force_noise(),
        session: session(pairing),
        nominal: nominal(&observations).ok_or(TurntableError::DirectionsTooAlike)?,
        largest_bias: LARGEST_BIAS.0,
        shared,
    };
    let solved = fit::<f64, 4, 3, 15>(&observations, &knowledge)?;
    if solved.observed.contains(&false) {
        return Err(TurntableError::DirectionsTooAlike);
    }
    let systematic = match settings.truth {
        Truth::Reference => reference.sphere.model_variance() / (settings.gravity * settings.gravity),
        _ => 0.0,
    };
    finish(&solved, &observations, labels, &knowledge, systematic)
}

/// M without any error: the rotation between truth and readings.
fn nominal<const P: usize, const Q: usize>(observations: &[Observation<f64, P, Q>]) -> Option<Matrix3<f64>> {
    let mut pairs = Procrustes::new();
    for observation in observations {
        pairs.push(
            &observation.reading,
            &observation.regressor.fixed_rows::<3>(0).into_owned(),
            1.0,
        );
    }
    pairs.solve().map(|fit| fit.rotation.into_inner())
}

fn gyroscope(
    reference_unit: &Acquired,
    reference: &Reference,
    unit: &Acquired,
    pairing: &Pairing,
    nominal: &Rotation3<f64>,
    settings: &Settings,
) -> Result<Triad, TurntableError> {
    let back = match (settings.truth, &reference.mounting) {
        (Truth::RotateMeasurement, Some(mounting)) => mounting.rotation.inverse(),
        _ => Rotation3::identity(),
    };
    let (labels, observations, forces) = rates(reference_unit, reference, unit, pairing, &back);
    let (earth, nominal) = match settings.truth {
        Truth::RotateMeasurement => (turned(&reference.earth.covariance, &back), Rotation3::identity()),
        _ => (reference.earth.covariance, *nominal),
    };
    let knowledge = Knowledge {
        noise: unit.rate_noise(),
        session: session(pairing),
        nominal: nominal.into_inner(),
        largest_bias: LARGEST_BIAS.1,
        shared: earth,
    };
    if settings.g_sensitivity {
        let widened: Vec<_> = observations
            .iter()
            .zip(&forces)
            .map(|(o, f)| with_specific_force(o, f))
            .collect();
        let solved = fit::<f64, 7, 6, 27>(&widened, &knowledge)?;
        return finish(&solved, &widened, labels, &knowledge, 0.0);
    }
    let solved = fit::<f64, 4, 6, 18>(&observations, &knowledge)?;
    finish(&solved, &observations, labels, &knowledge, 0.0)
}

/// A covariance of two vectors, both turned.
fn turned(covariance: &Matrix6<f64>, rotation: &Rotation3<f64>) -> Matrix6<f64> {
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation.matrix());
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(rotation.matrix());
    both * covariance * both.transpose()
}

type Rates = (Vec<Label>, Vec<RateObservation<f64>>, Vec<Vector3<f64>>);

/// Rests and turns in order of time, with the mean specific force over each. `back` turns truth and readings alike.
fn rates(
    reference_unit: &Acquired,
    reference: &Reference,
    unit: &Acquired,
    pairing: &Pairing,
    back: &Rotation3<f64>,
) -> Rates {
    let (mut labels, mut observations, mut forces) = (Vec::new(), Vec::new(), Vec::new());
    let bias = reference.sphere.bias;
    for (n, pair) in pairing.pairs.iter().enumerate() {
        let when = on_reference(pairing, &interval(&pair.stretch));
        let rest = at_rest(
            when,
            pair.stretch.angular_rate(),
            &reference.attitudes[pair.reference],
            &reference.earth,
        );
        labels.push(Label::Rest(pair.reference));
        observations.push(turn_back(rest, back));
        forces.push(back * (reference_unit.rests[pair.reference].specific_force() - bias));
        let Some(next) = pairing.pairs.get(n + 1) else {
            continue;
        };
        let Some(seen) = reference_unit
            .between(pair.reference, next.reference)
            .filter(|turn| turn.complete)
        else {
            continue;
        };
        let Some(felt) = unit
            .between(pair.target.1, next.target.0)
            .filter(|turn| turn.complete)
        else {
            continue;
        };
        let turn = ReferenceTurn {
            angle: seen.angle(),
            interval: interval(&seen),
            noise: reference_unit.rate_noise(),
            session: reference_unit.session(),
        };
        let when = on_reference(pairing, &interval(&felt));
        let rate = felt.angle() / felt.duration();
        labels.push(Label::Turn(pair.reference, next.reference));
        observations.push(turn_back(turning(when, rate, &turn, &reference.earth), back));
        forces.push(back * (seen.velocity() / seen.duration() - bias));
    }
    (labels, observations, forces)
}

/// The published compensation: reading and truth turned back into the table frame.
fn turn_back(mut observation: RateObservation<f64>, back: &Rotation3<f64>) -> RateObservation<f64> {
    let u = back * observation.regressor.fixed_rows::<3>(0).into_owned();
    observation.regressor.fixed_rows_mut::<3>(0).copy_from(&u);
    observation.reading = back * observation.reading;
    observation.truth_covariance = back.matrix() * observation.truth_covariance * back.matrix().transpose();
    for half in [0, 3] {
        let by = back.matrix() * observation.sensitivity.fixed_columns::<3>(half) * back.matrix().transpose();
        observation
            .sensitivity
            .fixed_columns_mut::<3>(half)
            .copy_from(&by);
    }
    observation
}

/// Chi-square beyond this many of its own sigma above its mean is no chance.
const UNLIKELY: f64 = 5.0;

/// Factor on the variances where the residuals show more than the noise explains (Birge 1932).
fn widening(chi_square: f64, degrees_of_freedom: u32) -> f64 {
    let freedom = f64::from(degrees_of_freedom);
    if chi_square > freedom + UNLIKELY * (2.0 * freedom).sqrt() && freedom > 0.0 {
        chi_square / freedom
    } else {
        1.0
    }
}

/// `systematic` is the variance of an element of M because the reference errs itself.
fn finish<const P: usize, const Q: usize>(
    solved: &TriadFit<f64, Q>,
    observations: &[Observation<f64, P, Q>],
    labels: Vec<Label>,
    knowledge: &Knowledge<f64, Q>,
    systematic: f64,
) -> Result<Triad, TurntableError> {
    let parts = solved.model.decompose()?;
    let m = solved.model.matrix;
    let residuals = observations.iter().map(|observation| {
        let own = mean_covariance(&knowledge.noise, &observation.interval, &knowledge.session);
        let sigma = (own + m * observation.truth_covariance * m.transpose())
            .diagonal()
            .map(f64::sqrt);
        (solved.residual(observation), sigma)
    });
    let widened = widening(solved.chi_square, solved.degrees_of_freedom);
    let mut covariance = solved.covariance * widened;
    for i in 0..9 {
        covariance[(i, i)] += systematic;
    }
    Ok(Triad {
        model: solved.model,
        covariance,
        observed: solved.observed,
        parts,
        parts_covariance: parts.carry(&covariance),
        g_sensitivity: solved.g_sensitivity.map(|(g, sigma)| (g, sigma * widened.sqrt())),
        rank: solved.rank,
        widened,
        chi_square: solved.chi_square,
        degrees_of_freedom: solved.degrees_of_freedom,
        residuals: residuals.collect(),
        labels,
    })
}
