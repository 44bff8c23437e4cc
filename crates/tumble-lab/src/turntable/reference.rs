//! Errors of the reference itself, fitted before any target: biases, attitudes, mounting.

use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
use tumble_core::gravity::vertical_earth_rate;
use tumble_core::model::ModelCovariance;
use tumble_core::noise::{Interval, Noise};
use tumble_core::turntable::mounting::{MountingFit, PoseMean, fit_mounting};
use tumble_core::turntable::reference::{EarthFit, GyroscopeRest, SphereFit, fit_earth, fit_sphere};
use tumble_core::turntable::truth::Attitude;

use super::error::TurntableError;
use super::reference_drift::{ReferenceDrift, settled_sphere};
use super::settings::{FEWEST_RESTS, TurntableSettings};
use crate::acquisition::plateaus::LARGEST_REFERENCE_BIAS;
use crate::acquisition::{Acquired, interval};

/// Up direction of each rest of the reference in the table frame, where its pose is known.
pub type Ups = [Option<Vector3<f64>>];

/// The reference with its biases, attitudes and mounting.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Bias of its accelerometer.
    pub sphere: SphereFit<f64>,
    /// Change of that bias over the session, where its rests show one.
    pub drift: Option<ReferenceDrift>,
    /// Bias of its gyroscope and the Earth's rotation.
    pub earth: EarthFit<f64>,
    /// Attitude at each rest against the first.
    pub attitudes: Vec<Attitude<f64>>,
    /// Mounting angle, where poses are known.
    pub mounting: Option<MountingFit<f64>>,
    /// Rates that the table was commanded, where they are the truth of gyroscopes.
    pub table: Option<TableTruth>,
    /// Uncertainty of its corrected readings.
    pub uncertainty: ReferenceUncertainty,
    /// True if that uncertainty explains the deviation of `|r - b|` from g.
    pub norm_explained: bool,
    /// The reference, deviated along each principal direction of its uncertainty; empty where that is not stated.
    pub(super) deviated: Vec<DeviatedReference>,
}

/// Commanded rate of each constant rate of the reference, and what the Earth adds.
#[derive(Clone, Debug, PartialEq)]
pub struct TableTruth {
    /// Magnitude at each constant rate of the reference, rad/s; zero where the table stood.
    pub by_rate: Vec<f64>,
    /// 1-sigma of what all of them are wrong by alike, relative.
    pub accuracy: f64,
    /// Up at the first rest; any direction where there is no rest.
    pub(super) up: Vector3<f64>,
}

/// Covariance of `[E row by row, e]` of each triad of the corrected reference; `None` where nobody states it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceUncertainty {
    /// Accelerometer: 1 and m/s^2.
    pub accelerometer: Option<ModelCovariance<f64>>,
    /// Gyroscope: 1 and rad/s.
    pub gyroscope: Option<ModelCovariance<f64>>,
}

/// The reference as it would be if it erred by a small share of one principal direction of its uncertainty.
#[derive(Clone, Debug)]
pub struct DeviatedReference {
    pub(super) unit: Acquired,
    pub(super) reference: Reference,
}

impl Reference {
    /// Mean and covariance of the specific force at rest `k`, without the drift of its bias.
    pub(super) fn force_at(&self, unit: &Acquired, k: usize) -> (Vector3<f64>, Matrix3<f64>) {
        let force = force_at(unit, k);
        match &self.drift {
            Some(drift) => drift.taken_off(&interval(&unit.rests[k]), force),
            None => force,
        }
    }

    /// Factor on the variance of its bias, because it misses the sphere by more than noise and stated uncertainty explain.
    pub fn excess(&self) -> f64 {
        if self.norm_explained {
            1.0
        } else {
            self.sphere.excess()
        }
    }

    /// Variance of its length of gravity, (m/s^2)^2, that neither noise nor stated uncertainty explains.
    pub(super) fn unexplained_variance(&self) -> f64 {
        if self.norm_explained {
            0.0
        } else {
            self.sphere.model_variance()
        }
    }
}

/// Mean and covariance of the specific force at rest `k`.
pub(super) fn force_at(unit: &Acquired, k: usize) -> (Vector3<f64>, Matrix3<f64>) {
    let rest = &unit.rests[k];
    (
        rest.specific_force(),
        mean_covariance(&unit.force_noise(), &interval(rest), &unit.session())
            + Matrix3::from_diagonal(&unit.excess_variance(k, 0)),
    )
}

/// Covariance of a mean over an interval.
pub(super) fn mean_covariance(
    noise: &[Noise<f64>; 3],
    over: &Interval<f64>,
    session: &Interval<f64>,
) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::from_fn(|i, _| noise[i].covariance(over, over, session)))
}

/// 1-sigma of the mean specific force at rest `k`, m/s^2.
pub fn force_sigma(unit: &Acquired, k: usize) -> Vector3<f64> {
    force_at(unit, k).1.diagonal().map(f64::sqrt)
}

/// 1-sigma of the mean angular rate at rest `k`, rad/s.
pub fn rate_sigma(unit: &Acquired, k: usize) -> Vector3<f64> {
    let noise = mean_covariance(&unit.rate_noise(), &interval(&unit.rests[k]), &unit.session());
    (noise.diagonal() + unit.excess_variance(k, 3)).map(f64::sqrt)
}

/// Understands the reference. `ups[k]` is the up direction of rest `k` in the table frame, where its pose is known.
/// Without a gyroscope, the rotation of the Earth is left at zero, and nothing is to be asked of it.
///
/// # Errors
/// Those of [`TurntableError`].
pub fn fit_reference(
    unit: &Acquired,
    ups: &Ups,
    settings: &TurntableSettings,
    gyroscope: bool,
) -> Result<Reference, TurntableError> {
    let rates_only = gyroscope && unit.constant_rates().next().is_some();
    if unit.rests.len() < FEWEST_RESTS && !rates_only {
        return Err(TurntableError::TooFewRests {
            found: unit.rests.len(),
            needed: FEWEST_RESTS,
        });
    }
    let forces: Vec<_> = (0..unit.rests.len()).map(|k| force_at(unit, k)).collect();
    let spans: Vec<_> = unit.rests.iter().map(interval).collect();
    let (sphere, drift) = settled_sphere(&spans, &forces, settings.gravity)?;
    if sphere.observed.contains(&false) && !rates_only {
        return Err(TurntableError::DirectionsTooAlike);
    }
    let attitudes = attitudes(unit);
    let rates: Vec<_> = (0..unit.rests.len())
        .map(|k| GyroscopeRest {
            mean: unit.rests[k].angular_rate(),
            covariance: mean_covariance(&unit.rate_noise(), &interval(&unit.rests[k]), &unit.session())
                + Matrix3::from_diagonal(&unit.excess_variance(k, 3)),
            start_from_here: attitudes[k],
        })
        .collect();
    let vertical = settings.latitude.zip(forces.first()).map(|(latitude, first)| {
        let up = (first.0 - sphere.bias).normalize();
        (up, vertical_earth_rate(latitude))
    });
    Ok(Reference {
        sphere,
        drift,
        earth: if gyroscope && !rates.is_empty() {
            fit_earth(&rates, vertical)?
        } else {
            no_earth()
        },
        attitudes,
        mounting: fit_mounting(&poses(unit, ups), settings.gravity),
        table: None,
        uncertainty: ReferenceUncertainty::default(),
        norm_explained: false,
        deviated: Vec::new(),
    })
}

/// Without rests nothing shows the bias of the reference: it is what its grade allows. The rotation of the Earth is asked
/// of rests only.
fn no_earth() -> EarthFit<f64> {
    let bias = LARGEST_REFERENCE_BIAS * LARGEST_REFERENCE_BIAS;
    let variances = [bias, bias, bias, NONE, NONE, NONE];
    EarthFit {
        bias: Vector3::zeros(),
        earth_rate: Vector3::zeros(),
        covariance: Matrix6::from_diagonal(&variances.into()),
    }
}

/// Variance of what is zero by definition, (rad/s)^2; a prior must only not be singular.
const NONE: f64 = 1e-24;

/// Bias from the sphere of a unit's own rests: how well it does without any reference.
pub fn own_sphere(unit: &Acquired, gravity: f64) -> Option<SphereFit<f64>> {
    let forces: Vec<_> = (0..unit.rests.len()).map(|k| force_at(unit, k)).collect();
    fit_sphere(&forces, gravity).ok()
}

fn attitudes(unit: &Acquired) -> Vec<Attitude<f64>> {
    if unit.rests.is_empty() {
        return Vec::new();
    }
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
pub fn poses(unit: &Acquired, ups: &Ups) -> Vec<PoseMean<f64>> {
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
