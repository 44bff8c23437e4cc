//! Step 3, and the better ways: what the target ought to have read.
//!
//! | truth | u at pose k | holds |
//! |---|---|---|
//! | `Ideal` | `g up_k`: poses as commanded, mounting ignored | M absorbs the mounting |
//! | `RotateMeasurement` | `g up_k`, with `R_e^-1 y` for the reading: the published compensation | to first order |
//! | `RotateTruth` | `R_e g up_k` | exactly, for a perfect table |
//! | `Reference` | `r_k - b_r`, on the sphere of radius g: what the reference saw at that very pose | exactly |

use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3, Vector4};

use crate::noise::{Interval, Noise};
use crate::products::Length;
use crate::real::Real;
use crate::rotation::cross_matrix;
use crate::turntable::mounting::MountingFit;
use crate::turntable::observation::Observation;
use crate::turntable::reference::{EarthFit, SphereFit, earth_variance};

/// Where the truth comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TruthSource {
    /// Poses as commanded; the mounting angle is ignored.
    Ideal,
    /// The published compensation: readings turned back by the mounting angle.
    RotateMeasurement,
    /// Poses as commanded, turned by the mounting angle.
    RotateTruth,
    /// Truth measured by the reference.
    Reference,
}

/// One rest as reference and target saw it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommonRest<T: Real> {
    /// When the target stood still, s on the reference's clock.
    pub interval: Interval<T>,
    /// Mean of the reference, m/s^2.
    pub reference: Vector3<T>,
    /// Covariance of that mean.
    pub reference_covariance: Matrix3<T>,
    /// Mean of the target, m/s^2.
    pub target: Vector3<T>,
    /// Unit vector up in the table frame, where the pose is known.
    pub up: Option<Vector3<T>>,
}

/// Specific force observed at a rest, with the errors shared by all rests: bias of the reference, or its mounting.
pub type ForceObservation<T> = Observation<T, 4, 3>;

/// Angular rate over a rest or a turn, with the errors shared by all: bias of the reference, rotation of the Earth.
pub type RateObservation<T> = Observation<T, 4, 6>;

fn regressor<T: Real>(u: &Vector3<T>) -> SVector<T, 4> {
    Vector4::new(u.x, u.y, u.z, T::one())
}

/// Truth from what the reference saw, drawn to the sphere of radius g along its own uncertainty, as far as the
/// reference keeps to that sphere at all (docs/theory/turntable.md, eq. 8 to 10).
pub fn from_reference<T: Real>(
    pair: &CommonRest<T>,
    sphere: &SphereFit<T>,
    gravity: T,
) -> ForceObservation<T> {
    let covariance = pair.reference_covariance;
    let seen = pair.reference - sphere.bias;
    let length = seen.length();
    let direction = seen / length;
    let spread = covariance * direction;
    let gain = spread / (direction.dot(&spread) + sphere.model_variance()); // eq. 8: h
    let u = seen - gain * (length - gravity); // eq. 8
    Observation {
        interval: pair.interval,
        regressor: regressor(&u),
        reading: pair.target,
        reading_variance: Vector3::zeros(),
        truth_covariance: covariance - gain * spread.transpose(), // eq. 9
        sensitivity: gain * direction.transpose() - Matrix3::identity(), // eq. 10
    }
}

/// Truth from the list of poses; `None` where the pose is not known.
pub fn from_poses<T: Real>(
    truth: TruthSource,
    pair: &CommonRest<T>,
    mounting: &MountingFit<T>,
    gravity: T,
) -> Option<ForceObservation<T>> {
    let up = pair.up?;
    let turned = mounting.rotation * up;
    let (u, reading, sensitivity) = match truth {
        TruthSource::RotateMeasurement => {
            let reading = mounting.rotation.inverse() * pair.target; // eq. 21
            // The mounting's error is given in the case frame, u in the table's.
            let sensitivity = -cross_matrix(&up) * mounting.rotation.inverse().matrix() * gravity;
            (up * gravity, reading, sensitivity)
        }
        TruthSource::RotateTruth => (turned * gravity, pair.target, -cross_matrix(&turned) * gravity),
        TruthSource::Ideal | TruthSource::Reference => (up * gravity, pair.target, Matrix3::zeros()),
    };
    let direction = u / gravity;
    let across = Matrix3::identity() - direction * direction.transpose();
    Some(Observation {
        interval: pair.interval,
        regressor: regressor(&u),
        reading,
        reading_variance: Vector3::zeros(),
        truth_covariance: across * mounting.pose_variance,
        sensitivity,
    })
}

/// Attitude of the case at a rest against the first rest; `None` if the turns between were not seen whole.
pub type Attitude<T> = Option<UnitQuaternion<T>>;

/// At a rest the true angular rate is the Earth's.
pub fn at_rest<T: Real>(
    interval: Interval<T>,
    reading: Vector3<T>,
    attitude: &Attitude<T>,
    earth: &EarthFit<T>,
) -> RateObservation<T> {
    let mut sensitivity = SMatrix::<T, 3, 6>::zeros();
    let (u, truth_covariance) = match attitude {
        Some(start_from_here) => {
            let here_from_start = start_from_here.inverse();
            sensitivity
                .fixed_columns_mut::<3>(3)
                .copy_from(here_from_start.to_rotation_matrix().matrix());
            (here_from_start * earth.earth_rate, Matrix3::zeros())
        }
        None => (Vector3::zeros(), Matrix3::identity() * earth_variance::<T>()),
    };
    Observation {
        interval,
        regressor: regressor(&u),
        reading,
        reading_variance: Vector3::zeros(),
        truth_covariance,
        sensitivity,
    }
}

/// A turn as the reference saw it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceTurn<T: Real> {
    /// Integral of the angular rate, rad.
    pub angle: Vector3<T>,
    /// Variance of the integral besides noise, rad^2.
    pub angle_variance: Vector3<T>,
    /// Over this interval, s.
    pub interval: Interval<T>,
    /// Noise of the three axes of the reference.
    pub noise: [Noise<T>; 3],
    /// From the first interval to the last.
    pub session: Interval<T>,
}

/// Between two rests both units turned by the same angle, whatever their clocks and bandwidths:
/// `int y dt = M int (r - b_r) dt + b T` (docs/theory/turntable.md, eq. 14), here divided by the target's T.
pub fn turning<T: Real>(
    interval: Interval<T>,
    reading: Vector3<T>,
    turn: &ReferenceTurn<T>,
    earth: &EarthFit<T>,
) -> RateObservation<T> {
    let length_ratio = turn.interval.duration() / interval.duration();
    let u = turn.angle / interval.duration() - earth.bias * length_ratio; // eq. 14
    let variance = Vector3::from_fn(|i, _| {
        let noise = turn.noise[i].covariance(&turn.interval, &turn.interval, &turn.session);
        let interpolated = turn.angle_variance[i] / (interval.duration() * interval.duration());
        noise * length_ratio * length_ratio + interpolated
    });
    let mut sensitivity = SMatrix::<T, 3, 6>::zeros();
    sensitivity
        .fixed_columns_mut::<3>(0)
        .copy_from(&(-Matrix3::identity() * length_ratio));
    Observation {
        interval,
        regressor: regressor(&u),
        reading,
        reading_variance: Vector3::zeros(),
        truth_covariance: Matrix3::from_diagonal(&variance),
        sensitivity,
    }
}

/// Adds `shape` to the regressors: by which share of its change over the session a bias deviates then from its mean.
pub fn with_drift<T: Real, const Q: usize>(
    observation: &Observation<T, 4, Q>,
    shape: T,
) -> Observation<T, 5, Q> {
    Observation {
        interval: observation.interval,
        regressor: SVector::from_fn(|i, _| if i < 4 { observation.regressor[i] } else { shape }), // eq. 44
        reading: observation.reading,
        reading_variance: observation.reading_variance,
        truth_covariance: observation.truth_covariance,
        sensitivity: observation.sensitivity,
    }
}

/// Adds a turn of the target in its case, rad, to the errors that the truths share: those of rests behind a slip have it.
pub fn with_slip<T: Real>(observation: &ForceObservation<T>, behind: bool) -> Observation<T, 4, 6> {
    let u = observation.regressor.fixed_rows::<3>(0).into_owned();
    let mut sensitivity = SMatrix::<T, 3, 6>::zeros();
    sensitivity
        .fixed_columns_mut::<3>(0)
        .copy_from(&observation.sensitivity);
    if behind {
        sensitivity
            .fixed_columns_mut::<3>(3)
            .copy_from(&-cross_matrix(&u)); // eq. 57
    }
    Observation {
        interval: observation.interval,
        regressor: observation.regressor,
        reading: observation.reading,
        reading_variance: observation.reading_variance,
        truth_covariance: observation.truth_covariance,
        sensitivity,
    }
}

/// Adds the specific force, m/s^2, to the regressors, for gyroscopes that feel it.
pub fn with_specific_force<T: Real>(rate: &RateObservation<T>, force: &Vector3<T>) -> Observation<T, 7, 6> {
    Observation {
        interval: rate.interval,
        regressor: SVector::from_fn(|i, _| if i < 4 { rate.regressor[i] } else { force[i - 4] }),
        reading: rate.reading,
        reading_variance: rate.reading_variance,
        truth_covariance: rate.truth_covariance,
        sensitivity: rate.sensitivity,
    }
}
