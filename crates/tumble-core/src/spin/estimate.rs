//! What a spin shows, solved from what was kept of it.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::real::{Real, count, real};
use crate::spin::axis::{self, AxisFit, RestingRate};
use crate::spin::estimator::{Direction, SpinEstimator, Turned};
use crate::spin::failure::Failure;
use crate::spin::level_free::{
    self, ACCELEROMETER, GYROSCOPE, Knowledge, LEVER_ARM, LevelFree, SCALE, UPHILL,
};
use crate::spin::published::{self, Published, Readings};
use crate::spin::rests::Rests;

/// A number with its 1-sigma; infinite sigma where the data do not show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value<T: Real> {
    /// The number.
    pub value: T,
    /// 1-sigma; the largest number there is where nothing is known.
    pub sigma: T,
}

impl<T: Real> Value<T> {
    fn unknown() -> Self {
        Self {
            value: T::zero(),
            sigma: T::max_value().unwrap_or(T::zero()),
        }
    }

    /// Whether anything is known of it.
    pub fn is_known(&self) -> bool {
        self.sigma < T::max_value().unwrap_or(T::zero())
    }
}

/// Angles truly turned, from dock to dock or from wheel odometry, where known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueAngle<T: Real> {
    /// Clockwise, rad, positive.
    pub clockwise: Option<T>,
    /// Counter-clockwise, rad.
    pub counter_clockwise: Option<T>,
    /// 1-sigma of each, rad.
    pub sigma: T,
}

/// Bias of three axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bias<T: Real> {
    /// m/s^2 or rad/s, case frame.
    pub value: Vector3<T>,
    /// 1-sigma.
    pub sigma: Vector3<T>,
    /// Whether the data show it.
    pub observed: bool,
}

/// Everything a spin shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinEstimate<T: Real> {
    /// How far the robot turned.
    pub turned: Turned<T>,
    /// Time at rest, s.
    pub resting_time: T,
    /// Samples at rest and turning.
    pub samples: u32,
    /// Scatter of one sample: accelerometer at rest and turning, m/s^2, gyroscope at rest and turning, rad/s.
    pub noise: [Vector3<T>; 4],
    /// Gyroscope bias, rad/s.
    pub gyroscope_bias: Bias<T>,
    /// Accelerometer bias whatever the floor, m/s^2.
    pub level_free: Bias<T>,
    /// Accelerometer bias if the floor is level, m/s^2.
    pub published: Bias<T>,
    /// Whether the level-free bias is the result: at least one full turn, and nobody said that the floor is level.
    pub level_free_is_default: bool,
    /// Covariance of `[accelerometer bias, gyroscope bias]` of that result.
    pub covariance: SMatrix<T, 6, 6>,
    /// Turning axis, unit length, case frame.
    pub up: Vector3<T>,
    /// Roll of the IMU against the floor, rad.
    pub roll: Value<T>,
    /// Pitch of the IMU against the floor, rad.
    pub pitch: Value<T>,
    /// Tilt of the floor, rad.
    pub floor_tilt: Value<T>,
    /// Uphill, rad counter-clockwise from forward, at the heading of the first rest.
    pub uphill_bearing: Value<T>,
    /// Position of the IMU from the turning axis, m, case frame, across the axis.
    pub lever_arm: Bias<T>,
    /// Scale error of the gyroscope about the axis, from harmonics and true angles.
    pub scale: Value<T>,
    /// The same clockwise alone, from the true angle.
    pub scale_clockwise: Value<T>,
    /// The same counter-clockwise alone.
    pub scale_counter_clockwise: Value<T>,
    /// Rate about the axis while the robot seemed to stand still, as the harmonics have it, rad/s.
    pub slow_turn: Value<T>,
    /// Whether that rate is none of chance's, and was taken off the gyroscope bias.
    pub turned_while_still: bool,
    /// Sum of squared normalised residuals of the model against the free harmonics.
    pub chi_square: T,
    /// Its degrees of freedom.
    pub degrees_of_freedom: u32,
    /// The fit, for those who draw it.
    pub fit: LevelFree<T>,
}

impl<T: Real> SpinEstimate<T> {
    /// Accelerometer bias by the method of choice.
    pub fn accelerometer_bias(&self) -> &Bias<T> {
        if self.level_free_is_default {
            &self.level_free
        } else {
            &self.published
        }
    }
}

/// Turned angle without which there is no axis, rad.
const LEAST_TURN: f64 = 0.2;
/// Sigma of an accelerometer bias beyond which it counts as not shown, m/s^2: a floor tilt of 3 deg.
const LARGEST_USEFUL_SIGMA: f64 = 0.5;
/// Sigma of the gyroscope bias along the axis where the rest is not believed, rad/s.
const BIAS_UNKNOWN: f64 = 0.1;
/// The random walk of the heading as a constant rate over the spin: its variance over that of the end point.
const WALK_SHARE: f64 = 1.2;

/// Solves for everything.
///
/// # Errors
/// [`Failure::NoRest`], [`Failure::NoTurn`], [`Failure::FloorTooSteep`], [`Failure::Unsolvable`].
pub fn solve<T: Real>(
    spin: &SpinEstimator<T>,
    true_angle: Option<&TrueAngle<T>>,
) -> Result<SpinEstimate<T>, Failure<T>> {
    let (knowledge, scales) = prepare(spin, true_angle)?;
    let (fit, slow_turn, turned_while_still) = decide(spin, &knowledge)?;
    let estimate = assemble(spin, &knowledge, &fit, &scales, (slow_turn, turned_while_still));
    let (tilt, limit) = (&estimate.floor_tilt, spin.settings().largest_floor_tilt);
    if tilt.value - tilt.sigma * real(3.0) > limit {
        return Err(Failure::FloorTooSteep {
            tilt: tilt.value,
            limit,
        });
    }
    Ok(estimate)
}

/// How heading should be counted from here on, rad a rad and rad a second.
///
/// Before a full turn was made the rest is believed: harmonics of a part of a turn can be bent to many shapes.
///
/// # Errors
/// As of [`solve`].
pub fn heading_correction<T: Real>(spin: &SpinEstimator<T>) -> Result<(T, T), Failure<T>> {
    let (knowledge, _) = prepare(spin, None)?;
    let fit = if spin.turned().span() < real(core::f64::consts::TAU) {
        fit(spin, &knowledge)?
    } else {
        decide(spin, &knowledge)?.0
    };
    Ok((fit.heading_correction(T::one(), T::zero()), fit.by_time))
}

fn prepare<T: Real>(
    spin: &SpinEstimator<T>,
    true_angle: Option<&TrueAngle<T>>,
) -> Result<(Knowledge<T>, Scales<T>), Failure<T>> {
    let (rests, guide) = spin.rests().zip(spin.guide()).ok_or(Failure::NoRest)?;
    let turned = spin.turned();
    if turned.angle() < real(LEAST_TURN) || spin.cloud().points() < 3 {
        return Err(Failure::NoTurn {
            turned: turned.angle(),
        });
    }
    let axis = axis::fit(spin.cloud(), &rests.rate(), &guide.up);
    let walk = walk(&axis, turned, spin.cloud().points());
    let scales = scales(&axis, &guide.bias, turned, true_angle, walk);
    let knowledge = knowledge(spin, rests, &axis, &guide.bias, walk, &scales);
    Ok((knowledge, scales))
}

fn fit<T: Real>(spin: &SpinEstimator<T>, knowledge: &Knowledge<T>) -> Result<LevelFree<T>, Failure<T>> {
    let rests = spin.rests().ok_or(Failure::NoRest)?;
    level_free::fit(rests.harmonics(), spin.turning(), knowledge).map_err(|_| Failure::Unsolvable)
}

/// The fit that believes the rest, or the one that does not where the harmonics say so.
fn decide<T: Real>(
    spin: &SpinEstimator<T>,
    knowledge: &Knowledge<T>,
) -> Result<(LevelFree<T>, Value<T>, bool), Failure<T>> {
    let believing = fit(spin, knowledge)?;
    let doubting = fit(
        spin,
        &Knowledge {
            bias_variance: real(BIAS_UNKNOWN * BIAS_UNKNOWN),
            scale: doubted_scale(knowledge, spin.settings().scale_sigma),
            ..*knowledge
        },
    )?;
    let (slow_turn, found) = slow_turn(&doubting, knowledge);
    Ok((if found { doubting } else { believing }, slow_turn, found))
}

/// Random walk of the heading, rad^2/s.
fn walk<T: Real>(axis: &AxisFit<T>, turned: &Turned<T>, blocks: u32) -> T {
    axis.block_variance * turned.duration() / count(blocks.max(1))
}

#[derive(Clone, Copy)]
struct Scales<T: Real> {
    clockwise: Value<T>,
    counter_clockwise: Value<T>,
}

/// Scale error of each direction: `(angle seen - bias left over) / true angle - 1`.
fn scales<T: Real>(
    axis: &AxisFit<T>,
    counted: &Vector3<T>,
    turned: &Turned<T>,
    truth: Option<&TrueAngle<T>>,
    walk: T,
) -> Scales<T> {
    let drift = (axis.bias - counted).dot(&axis.floor.column(2));
    let one = |direction: &Direction<T>, sign: T, angle: Option<T>| {
        let Some((truth, angle)) = truth.zip(angle).filter(|(_, angle)| *angle > real(LEAST_TURN)) else {
            return Value::unknown();
        };
        let time = direction.duration;
        let seen = direction.angle - sign * drift * time;
        let variance = truth.sigma * truth.sigma + axis.covariance[(2, 2)] * time * time + walk * time;
        Value {
            value: seen / angle - T::one(),
            sigma: variance.sqrt() / angle,
        }
    };
    Scales {
        clockwise: one(&turned.clockwise, -T::one(), truth.and_then(|t| t.clockwise)),
        counter_clockwise: one(
            &turned.counter_clockwise,
            T::one(),
            truth.and_then(|t| t.counter_clockwise),
        ),
    }
}

/// One scale for both directions: the weighted mean with what is believed of any gyroscope.
fn common_scale<T: Real>(scales: &Scales<T>, sigma: T) -> (T, T) {
    let (mut weight, mut sum) = (T::one() / (sigma * sigma), T::zero());
    for scale in [&scales.clockwise, &scales.counter_clockwise] {
        if scale.is_known() {
            let each = T::one() / (scale.sigma * scale.sigma);
            weight += each;
            sum += each * scale.value;
        }
    }
    (sum / weight, T::one() / weight.sqrt())
}

/// Over turns in one direction a scale error looks like a slow turn at rest: one is not to be found for want of the
/// other. A scale that a true angle has shown stands.
fn doubted_scale<T: Real>(knowledge: &Knowledge<T>, believed: T) -> (T, T) {
    const DOUBTED: f64 = 5.0;
    let (scale, sigma) = knowledge.scale;
    let told = sigma < believed * real(0.5);
    (scale, if told { sigma } else { sigma * real(DOUBTED) })
}

fn knowledge<T: Real>(
    spin: &SpinEstimator<T>,
    rests: &Rests<T>,
    axis: &AxisFit<T>,
    counted_bias: &Vector3<T>,
    walk: T,
    scales: &Scales<T>,
) -> Knowledge<T> {
    let rest_variance = rests.block_variance(0);
    let half = real::<T>(0.5);
    Knowledge {
        gravity: spin.settings().gravity,
        origin: rests.first_force().0,
        axis: *axis,
        counted_bias: *counted_bias,
        scale: common_scale(scales, spin.settings().scale_sigma),
        bias_variance: axis.covariance[(2, 2)],
        walk_variance: walk * real(WALK_SHARE) / spin.turned().duration(),
        rest_variance: floored(&rest_variance),
        turning_variance: floored(&spin.turning().variance().unwrap_or(rest_variance * half)),
    }
}

/// Sensors without any noise exist only in tests; a variance of zero would divide by it.
fn floored<T: Real>(variance: &Vector3<T>) -> Vector3<T> {
    variance.map(|v| v.max(real(1e-12)))
}

/// The rate at rest that the harmonics ask for, and whether chance could not have made it. Harmonics that fit the model
/// neither way ask for nothing.
fn slow_turn<T: Real>(doubting: &LevelFree<T>, knowledge: &Knowledge<T>) -> (Value<T>, bool) {
    const SIGMAS: f64 = 5.0;
    const DRIFT: f64 = 3e-4;
    const FITS: f64 = 4.0;
    let i = GYROSCOPE + 2;
    if !doubting.solution.observed(i) {
        return (Value::unknown(), false);
    }
    let variance = doubting.solution.covariance[(i, i)];
    let value = -doubting.solution.x[i];
    let chance = (variance + knowledge.bias_variance).sqrt();
    let reduced = crate::regression::reduced(doubting.solution.chi_square, doubting.degrees_of_freedom);
    let found = value.abs() > chance * real(SIGMAS) + real(DRIFT) && reduced < real(FITS);
    (Value { value, sigma: chance }, found)
}

/// How much the sigmas are widened where the model does not fit the harmonics.
fn widening<T: Real>(fit: &LevelFree<T>) -> T {
    const UNLIKELY: f64 = 2.0;
    let reduced = crate::regression::reduced(fit.solution.chi_square, fit.degrees_of_freedom);
    if reduced > real(UNLIKELY) {
        reduced
    } else {
        T::one()
    }
}

fn assemble<T: Real>(
    spin: &SpinEstimator<T>,
    knowledge: &Knowledge<T>,
    fit: &LevelFree<T>,
    scales: &Scales<T>,
    (slow_turn, turned_while_still): (Value<T>, bool),
) -> SpinEstimate<T> {
    let covariance = fit.solution.covariance * widening(fit);
    let joint = biases(&fit.floor, &covariance);
    let (roll, pitch) = axis::tilt(&fit.up);
    let tilt_sigma = |i: usize| covariance[(level_free::AXIS + i, level_free::AXIS + i)].sqrt();
    let (published, published_covariance) = published(spin, knowledge, &joint);
    let full_turn = spin.turned().span() >= real(core::f64::consts::TAU);
    let level_free_is_default = full_turn && !spin.settings().level_floor;
    let earth = fit.up * spin.settings().earth_rate_up;
    let x = &fit.solution.x;
    let (floor_tilt, uphill_bearing) = uphill(knowledge, x, &covariance);
    SpinEstimate {
        turned: *spin.turned(),
        resting_time: spin.rests().map_or(T::zero(), Rests::time),
        samples: spin.samples(),
        noise: noise(spin),
        gyroscope_bias: Bias {
            value: fit.gyroscope_bias - earth,
            sigma: Vector3::from_fn(|i, _| joint[(3 + i, 3 + i)].sqrt()),
            observed: true,
        },
        level_free: bias(
            x.fixed_rows::<3>(ACCELEROMETER).into_owned(),
            Vector3::from_fn(|i, _| joint[(i, i)].sqrt()),
        ),
        published,
        level_free_is_default,
        covariance: if level_free_is_default {
            joint
        } else {
            published_covariance
        },
        up: fit.up,
        roll: Value {
            value: roll,
            sigma: tilt_sigma(1) / pitch.cos().abs().max(real(1e-6)),
        },
        pitch: Value {
            value: pitch,
            sigma: tilt_sigma(0),
        },
        floor_tilt,
        uphill_bearing,
        lever_arm: lever_arm(fit, &covariance),
        scale: scale(fit, knowledge, &covariance),
        scale_clockwise: scales.clockwise,
        scale_counter_clockwise: scales.counter_clockwise,
        slow_turn,
        turned_while_still,
        chi_square: fit.solution.chi_square,
        degrees_of_freedom: fit.degrees_of_freedom,
        fit: *fit,
    }
}

/// Scatter of one sample, accelerometer and gyroscope, at rest and turning.
fn noise<T: Real>(spin: &SpinEstimator<T>) -> [Vector3<T>; 4] {
    let at_rest = |first: usize| {
        spin.rests()
            .map_or(Vector3::zeros(), |rests| rests.sample_variance(first))
            .map(|v| v.sqrt())
    };
    let [fx, fy, fz, wx, wy, wz] = spin.turning_noise().map(|v| v.sqrt());
    [
        at_rest(0),
        Vector3::new(fx, fy, fz),
        at_rest(3),
        Vector3::new(wx, wy, wz),
    ]
}

/// Covariance of both biases in the case frame.
fn biases<T: Real>(
    floor: &Matrix3<T>,
    covariance: &SMatrix<T, { level_free::UNKNOWNS }, { level_free::UNKNOWNS }>,
) -> SMatrix<T, 6, 6> {
    let mut turn = SMatrix::<T, 6, 6>::identity();
    turn.fixed_view_mut::<3, 3>(3, 3).copy_from(floor);
    turn * covariance.fixed_view::<6, 6>(0, 0) * turn.transpose()
}

fn bias<T: Real>(value: Vector3<T>, sigma: Vector3<T>) -> Bias<T> {
    Bias {
        value,
        sigma,
        observed: sigma.max() < real(LARGEST_USEFUL_SIGMA),
    }
}

fn published<T: Real>(
    spin: &SpinEstimator<T>,
    knowledge: &Knowledge<T>,
    joint: &SMatrix<T, 6, 6>,
) -> (Bias<T>, SMatrix<T, 6, 6>) {
    let turned = spin.turned();
    let (rate, (force, force_variance)) = spin.rests().map_or(
        (
            RestingRate {
                mean: Vector3::zeros(),
                variance: Vector3::zeros(),
            },
            (Vector3::zeros(), Vector3::zeros()),
        ),
        |rests| (rests.rate(), rests.first_force()),
    );
    let net_duration = turned.counter_clockwise.duration - turned.clockwise.duration;
    let found = published::estimate(&Readings {
        rest: rate,
        specific_force: force,
        specific_force_variance: force_variance,
        turned: turned.vector,
        net_duration,
        turned_variance: walk(&knowledge.axis, turned, spin.cloud().points()) * turned.duration(),
        gravity: knowledge.gravity,
    });
    let Some(Published {
        bias: value,
        covariance,
        ..
    }) = found
    else {
        let unknown = Vector3::repeat(T::max_value().unwrap_or(T::zero()));
        return (bias(Vector3::zeros(), unknown), *joint);
    };
    let mut both = *joint;
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(&covariance);
    both.fixed_view_mut::<3, 3>(0, 3).fill(T::zero());
    both.fixed_view_mut::<3, 3>(3, 0).fill(T::zero());
    (bias(value, covariance.diagonal().map(|v| v.sqrt())), both)
}

/// Tilt of the floor and bearing of uphill.
fn uphill<T: Real>(
    knowledge: &Knowledge<T>,
    x: &SVector<T, { level_free::UNKNOWNS }>,
    covariance: &SMatrix<T, { level_free::UNKNOWNS }, { level_free::UNKNOWNS }>,
) -> (Value<T>, Value<T>) {
    const SHOWN: f64 = 3.0;
    let pull = x.fixed_rows::<2>(UPHILL).into_owned();
    let spread = covariance.fixed_view::<2, 2>(UPHILL, UPHILL).into_owned();
    let size = pull.norm();
    let along = |direction: nalgebra::Vector2<T>| direction.dot(&(spread * direction)).sqrt();
    let unit = if size > T::zero() {
        pull / size
    } else {
        nalgebra::Vector2::x()
    };
    let (lengthwise, crosswise) = (along(unit), along(nalgebra::Vector2::new(-unit.y, unit.x)));
    let sine = (size / knowledge.gravity).min(T::one());
    let cosine = (T::one() - sine * sine).sqrt().max(real(1e-6));
    let tilt = Value {
        value: sine.asin(),
        sigma: lengthwise / (knowledge.gravity * cosine),
    };
    let bearing = if size > crosswise * real(SHOWN) {
        Value {
            value: pull.y.atan2(pull.x),
            sigma: crosswise / size,
        }
    } else {
        Value::unknown()
    };
    (tilt, bearing)
}

fn lever_arm<T: Real>(
    fit: &LevelFree<T>,
    covariance: &SMatrix<T, { level_free::UNKNOWNS }, { level_free::UNKNOWNS }>,
) -> Bias<T> {
    let plane = fit.floor.fixed_columns::<2>(0);
    let spread = plane * covariance.fixed_view::<2, 2>(LEVER_ARM, LEVER_ARM) * plane.transpose();
    Bias {
        value: plane * fit.solution.x.fixed_rows::<2>(LEVER_ARM),
        sigma: spread.diagonal().map(|v| v.max(T::zero()).sqrt()),
        observed: fit.solution.observed(LEVER_ARM) && fit.solution.observed(LEVER_ARM + 1),
    }
}

/// Scale error about the axis, if harmonics or a true angle took most of the ignorance away.
fn scale<T: Real>(
    fit: &LevelFree<T>,
    knowledge: &Knowledge<T>,
    covariance: &SMatrix<T, { level_free::UNKNOWNS }, { level_free::UNKNOWNS }>,
) -> Value<T> {
    let told = knowledge.scale.0 != T::zero();
    if !told && !fit.solution.observed(SCALE) {
        return Value::unknown();
    }
    Value {
        value: fit.solution.x[SCALE],
        sigma: covariance[(SCALE, SCALE)].sqrt(),
    }
}
