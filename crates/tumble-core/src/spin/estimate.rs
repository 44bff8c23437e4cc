//! What a spin shows, solved from what was kept of it.

use nalgebra::{SMatrix, Vector3};

use crate::real::{Real, count, real};
use crate::spin::axis::{self, AxisFit, TurningRates, floored};
use crate::spin::estimator::{SpinEstimator, Turned};
use crate::spin::failure::Failure;
use crate::spin::level_free::{self, GYROSCOPE, Knowledge, LevelFree};
use crate::spin::quantities::assemble;
use crate::spin::rests::Rests;
use crate::spin::scale::{Scales, common_scale, doubted_scale, scales};

/// A number with its 1-sigma; infinite sigma where the data do not show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value<T: Real> {
    /// The number.
    pub value: T,
    /// 1-sigma; the largest number there is where nothing is known.
    pub sigma: T,
}

impl<T: Real> Value<T> {
    pub(super) fn unknown() -> Self {
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
    /// Whether the level-free bias is the result: at least one full turn, or a part that shows it well enough, and nobody
    /// said that the floor is level.
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
pub(super) const LEAST_TURN: f64 = 0.2;
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
    let rates = TurningRates {
        cloud: *spin.cloud(),
        frame: *spin.frame(),
        counted_bias: guide.bias,
    };
    let (_, instability) = spin.settings().bias_instability;
    let axis = axis::fit(&rates, &rests.rate(instability), &guide.up);
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
pub(super) fn walk<T: Real>(axis: &AxisFit<T>, turned: &Turned<T>, blocks: u32) -> T {
    axis.block_variance * turned.duration() / count(blocks.max(1))
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
        origin: rests.first_force(),
        axis: *axis,
        counted_bias: *counted_bias,
        scale: common_scale(scales, spin.settings().scale_sigma),
        bias_variance: axis.covariance[(2, 2)],
        walk_variance: walk * real(WALK_SHARE) / spin.turned().duration(),
        rest_variance: rests
            .line_variance(spin.settings().bias_instability.0)
            .map(|v| floored(v, LEAST)),
        turning_variance: spin
            .turning()
            .variance()
            .unwrap_or(rest_variance * half)
            .map(|v| floored(v, LEAST)),
    }
}

/// Smallest variance of a specific force that is divided by, (m/s^2)^2.
const LEAST: f64 = 1e-12;

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
pub(super) fn widening<T: Real>(fit: &LevelFree<T>) -> T {
    const UNLIKELY: f64 = 2.0;
    let reduced = crate::regression::reduced(fit.solution.chi_square, fit.degrees_of_freedom);
    if reduced > real(UNLIKELY) {
        reduced
    } else {
        T::one()
    }
}
