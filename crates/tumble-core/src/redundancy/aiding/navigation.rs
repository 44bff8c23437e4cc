//! Attitude and velocity of the set between aiding measurements, and their change by each unit alone.
//!
//! One error-state filter runs on the median readings of the set. A sensor in place of the median changes the
//! state linearly in its deviation, so each sensor needs ten numbers, and all share one covariance.

use nalgebra::{UnitQuaternion, Vector2, Vector3};

use crate::products::Length;
use crate::real::{Real, count, real, tabulated};
use crate::redundancy::aiding::errors::{Covariance, Errors, Moves};
use crate::redundancy::aiding::track::Track;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::ForceAndRate;
use crate::rotation::{rotation_by_series as rotation_of, rotation_onto};

/// Noise densities of the angular rate, rad/s/sqrt(Hz), and of the specific force of the set, m/s^2/sqrt(Hz):
/// at rest, and as shares of the angular rate and of the acceleration (docs/theory/isolation.md, table 2).
const RATE_NOISE: [f32; 2] = [2e-4, 5e-4];
const FORCE_NOISE: [f32; 2] = [0.01, 0.005];

/// Random walk of the errors of angular rate and vertical specific force, rad/s and m/s^2 per square root of a
/// second.
const RATE_WANDERS: f32 = 5e-5;
const FORCE_WANDERS: f32 = 5e-4;

/// Initial sigma of the attitude, rad, and of the rate error after a rest, rad/s.
const LEVELLED: f64 = 0.3;
const RATE_AT_REST: f64 = 5e-4;

/// Horizontal acceleration of a platform, m/s^2, over one second, in motion and at rest: the filter levels by
/// it while the horizontal velocity is unknown.
const ACCELERATES: [f32; 2] = [3.0, 0.05];

/// Conditions for finding the heading: the horizontal velocity has changed by `CHANGED` sigmas within `WITHIN`
/// seconds, and the integrated change agrees with the aided one to `ALIKE` sigmas.
const CHANGED: f64 = 8.0;
const WITHIN: f64 = 10.0;
const ALIKE: f64 = 3.0;

/// Number of headings whose mean gives their reference direction, and the time constant with which it is
/// followed later, s.
const HEADINGS: u16 = 20;
const NORTH_OVER: f64 = 600.0;

/// Least horizontal part of the x axis of the primary that defines a heading.
const LEAST_HORIZONTAL: f64 = 0.5;

/// Reference direction of aiding headings, in the level frame.
#[derive(Clone, Copy, Debug, PartialEq)]
struct North<T: Real> {
    /// Angle from headings of the level frame to those of the aiding measurement, rad.
    offset: T,
    /// Number of headings averaged, up to `HEADINGS`.
    headings: u16,
}

/// Direction of the horizontal velocity of the aiding measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Heading<T: Real> {
    /// The direction is unknown.
    Sought {
        /// Horizontal velocity, integrated and aided, at the start of the search, m/s.
        integrated: Vector2<T>,
        aided: Vector2<T>,
        /// Time since then, s.
        since: T,
    },
    /// The direction is known in the level frame.
    Known,
}

impl<T: Real> Heading<T> {
    /// Starts the search for the heading.
    fn sought_from(integrated: Vector2<T>, aided: Vector2<T>) -> Self {
        Self::Sought {
            integrated,
            aided,
            since: T::zero(),
        }
    }
}

/// Readings of the set over a window, and deviations of each sensor of each unit.
pub(super) struct NavigationStep<'a, T: Real, const UNITS: usize> {
    /// Median reading of the set, m/s^2 and rad/s.
    pub measured: [&'a Vector3<T>; 2],
    /// Deviation of each unit from it; zero for a unit that is faulty or has no reading.
    pub deviations: &'a [[Vector3<T>; 2]; UNITS],
    /// Length of the window, s.
    pub length: T,
    /// m/s^2.
    pub gravity: T,
    /// True if the set rests.
    pub rests: bool,
}

/// Measurement of one quantity.
pub(super) struct Innovation<T: Real> {
    /// Measured value minus the prediction of the set.
    pub of_set: T,
    /// Its variance.
    pub variance: T,
    /// Derivatives by each error.
    row: Errors<T>,
    across: Errors<T>,
}

/// Velocity of an aiding measurement.
#[derive(Clone, Copy)]
pub(super) struct Aided<T: Real> {
    /// m/s.
    pub value: Vector3<T>,
    /// Sigma, m/s; infinite where the axis was not measured.
    pub sigma: Vector3<T>,
    /// Age in windows, negative if in the future.
    pub windows: T,
    /// Length of a window, s.
    pub length: T,
}

/// Heading of an aiding measurement.
#[derive(Clone, Copy)]
pub(super) struct AidedHeading<T: Real> {
    /// rad.
    pub value: T,
    /// rad.
    pub sigma: T,
    /// Age in windows, negative if in the future.
    pub windows: T,
}

impl<T: Real> Aided<T> {
    fn is_level(&self) -> bool {
        self.sigma.x.is_finite() && self.sigma.y.is_finite()
    }
}

/// Attitude and velocity of the set, estimated from its readings and from aiding measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Navigation<T: Real, const UNITS: usize> {
    level_from_primary: UnitQuaternion<T>,
    /// Velocity in the level frame, m/s.
    velocity: Vector3<T>,
    /// Errors of the set: of angular rate, rad/s, and of vertical specific force, m/s^2.
    rate_error: Vector3<T>,
    vertical_error: T,
    covariance: Covariance<T>,
    /// Change of the state if one sensor of one unit replaced that of the set.
    deviations: [[Errors<T>; 2]; UNITS],
    /// Rotation vector of the latest window, rad.
    turn: Vector3<T>,
    track: Track<T>,
    heading: Heading<T>,
    /// Reference direction, once a heading was processed.
    north: Option<North<T>>,
    /// True if any velocity was processed, and if any was in the axes of the primary.
    begun: bool,
    along_primary: bool,
}

impl<T: Real, const UNITS: usize> Navigation<T, UNITS> {
    /// Starts level by the specific force of the set, at an arbitrary heading; `rate_error` is the zero rate,
    /// rad/s.
    pub fn start(
        force: &Vector3<T>,
        rate_error: &Vector3<T>,
        rests: bool,
        tolerated: &ForceAndRate<T>,
    ) -> Self {
        let up = Vector3::z();
        let level = rotation_onto(force, &up);
        let levelled = real::<T>(LEVELLED) * real(LEVELLED);
        let rate = if rests {
            real(RATE_AT_REST)
        } else {
            tolerated.angular_rate
        };
        let variances = Errors {
            attitude: Vector3::new(levelled, levelled, T::zero()),
            rate: Vector3::repeat(rate * rate),
            vertical: tolerated.specific_force * tolerated.specific_force,
            ..Errors::none()
        };
        Self {
            level_from_primary: level,
            velocity: Vector3::zeros(),
            rate_error: *rate_error,
            vertical_error: T::zero(),
            covariance: Covariance::of_variances(&variances),
            deviations: [[Errors::none(); 2]; UNITS],
            turn: Vector3::zeros(),
            track: Track::new(),
            heading: Heading::sought_from(Vector2::zeros(), Vector2::zeros()),
            north: None,
            begun: false,
            along_primary: false,
        }
    }

    /// Advances the state by a window.
    pub fn advance(&mut self, step: &NavigationStep<'_, T, UNITS>) {
        let ([f, w], h) = (step.measured, step.length);
        let turn: Vector3<T> = (w - self.rate_error) * h;
        let coning: Vector3<T> = self.turn.cross(&turn) * real::<T>(1.0 / 12.0);
        let half: Vector3<T> = turn * real::<T>(0.5);
        let middle = self.level_from_primary * rotation_of(&half);
        self.level_from_primary = middle * rotation_of(&(half + coning)); // isolation.md, eq. 16
        self.turn = turn;
        let force: Vector3<T> = middle * *f;
        let acceleration: Vector3<T> = force - Vector3::z() * (step.gravity + self.vertical_error);
        self.velocity += acceleration * h; // isolation.md, eq. 16
        self.track.push(&self.velocity, &acceleration);
        let level = *middle.to_rotation_matrix().matrix();
        let moves = Moves {
            velocity_by_attitude: force.cross_matrix() * -h,
            attitude_by_rate: level * -h,
            velocity_by_vertical: -h,
        };
        self.covariance
            .spread(&moves, &noise(&(turn / h), &acceleration, h));
        for (deviations, measured) in self.deviations.iter_mut().zip(step.deviations) {
            let [of_force, of_rate] = deviations;
            let [force, rate] = measured;
            *of_force = moves.carry(of_force);
            of_force.velocity += level * force * h; // isolation.md, eq. 18
            *of_rate = moves.carry(of_rate);
            of_rate.attitude += level * rate * h; // isolation.md, eq. 18
        }
        if let Heading::Sought { since, .. } = &mut self.heading {
            *since += h;
            if !self.along_primary {
                self.level(&force, step.rests, h);
            }
        }
    }

    /// Levels the set by its specific force over a window of `length` s.
    fn level(&mut self, force: &Vector3<T>, rests: bool, length: T) {
        let [moving, resting] = ACCELERATES.map(tabulated::<T>);
        let sigma = if rests { resting } else { moving };
        for axis in [Vector3::x(), Vector3::y()] {
            let row = Errors {
                attitude: force.cross(&axis),
                ..Errors::none()
            };
            let innovation = self.measured(row, -force.dot(&axis), sigma * sigma / length);
            self.update(&innovation);
        }
    }

    /// Removes a faulty sensor of a unit: the state continues with the mean of the others.
    pub fn leave_out(&mut self, sensor: Sensor, unit: usize, healthy: impl Fn(usize) -> bool) {
        let own = self.deviations.get(unit).map(|deviations| sensor.of(deviations));
        if own.is_none_or(|own| *own == Errors::none()) {
            return;
        }
        let (mut sum, mut others) = (Errors::none(), T::zero());
        for (_, deviations) in self
            .deviations
            .iter()
            .enumerate()
            .filter(|(other, _)| healthy(*other))
        {
            sum = sum.plus(sensor.of(deviations), T::one());
            others += T::one();
        }
        let mean = Errors::none().plus(&sum, T::one() / others.max(T::one()));
        self.correct(&mean);
        for (number, deviations) in self.deviations.iter_mut().enumerate() {
            let deviation = sensor.of_mut(deviations);
            *deviation = if number == unit {
                Errors::none()
            } else {
                deviation.plus(&mean, -T::one())
            };
        }
    }

    /// Change of an innovation if the sensor of a unit replaced that of the set.
    pub fn share(&self, innovation: &Innovation<T>, sensor: Sensor, unit: usize) -> T {
        let deviations = self.deviations.get(unit);
        deviations.map_or(T::zero(), |deviations| innovation.row.dot(sensor.of(deviations)))
    }

    /// Updates the state with a measurement.
    pub fn update(&mut self, innovation: &Innovation<T>) {
        let Innovation {
            of_set,
            variance,
            row,
            across,
        } = innovation;
        for deviation in self.deviations.iter_mut().flatten() {
            *deviation = deviation.plus(across, -row.dot(deviation) / *variance); // isolation.md, eq. 19
        }
        self.covariance.narrow(across, *variance);
        self.correct(&Errors::none().plus(across, *of_set / *variance)); // isolation.md, eq. 19
    }

    fn correct(&mut self, errors: &Errors<T>) {
        self.level_from_primary = rotation_of(&errors.attitude) * self.level_from_primary;
        self.level_from_primary.renormalize_fast();
        self.velocity += errors.velocity;
        self.track.change(|before| before + errors.velocity);
        self.rate_error += errors.rate;
        self.vertical_error += errors.vertical;
    }

    /// Returns whether all elements are finite.
    pub fn is_finite(&self) -> bool {
        let state = self.velocity.iter().chain(self.rate_error.iter());
        state
            .chain(self.level_from_primary.coords.iter())
            .all(T::is_finite)
    }

    fn measured(&self, row: Errors<T>, of_set: T, variance: T) -> Innovation<T> {
        let across = self.covariance.across(&row);
        Innovation {
            of_set,
            variance: row.dot(&across) + variance, // isolation.md, eq. 19
            row,
            across,
        }
    }

    /// Velocity at the time of an aiding measurement, level frame, m/s.
    fn velocity_at(&self, aided: &Aided<T>) -> Option<Vector3<T>> {
        self.track.at(aided.windows, &self.velocity, aided.length)
    }

    /// Innovation along one axis of a velocity in the level frame.
    pub fn along_level(&self, axis: &Vector3<T>, aided: &Aided<T>) -> Option<Innovation<T>> {
        let usable = axis.z != T::zero() || matches!(self.heading, Heading::Known);
        let sigma = along(axis, &aided.sigma)?;
        let velocity = self.velocity_at(aided)?;
        let row = Errors {
            velocity: *axis,
            ..Errors::none()
        };
        let value = along(axis, &aided.value)?;
        usable.then(|| self.measured(row, value - velocity.dot(axis), sigma * sigma))
    }

    /// Innovation along one axis of a velocity in the axes of the primary.
    pub fn along_primary(&self, axis: &Vector3<T>, aided: &Aided<T>) -> Option<Innovation<T>> {
        let sigma = along(axis, &aided.sigma)?;
        let velocity = self.velocity_at(aided)?;
        // The set has turned since.
        let turned = self.level_from_primary * rotation_of(&(self.turn * -aided.windows));
        let level: Vector3<T> = turned * *axis;
        let row = Errors {
            attitude: level.cross(&velocity),
            velocity: level,
            ..Errors::none()
        };
        let value = along(axis, &aided.value)?;
        Some(self.measured(row, value - level.dot(&velocity), sigma * sigma))
    }

    /// Innovation of a heading, once its reference direction is known; if `calm`, that direction follows
    /// slowly.
    pub fn along_heading(&mut self, aided: &AidedHeading<T>, calm: bool) -> Option<Innovation<T>> {
        let turned = self.level_from_primary * rotation_of(&(self.turn * -aided.windows));
        let ahead: Vector3<T> = turned * Vector3::x();
        let horizontal = ahead.xy().length();
        if horizontal < real(LEAST_HORIZONTAL) {
            return None;
        }
        let of_level = aided.value - ahead.y.atan2(ahead.x);
        let north = self.north.get_or_insert(North {
            offset: of_level,
            headings: 0,
        });
        let beyond = within_half_a_turn(of_level - north.offset);
        if north.headings < HEADINGS {
            north.headings += 1;
            north.offset += beyond / count(north.headings.into());
            if north.headings == HEADINGS {
                let variance = aided.sigma * aided.sigma / count(HEADINGS.into());
                self.covariance.widen(&Errors {
                    attitude: Vector3::z() * variance,
                    ..Errors::none()
                });
            }
            return None;
        }
        if calm {
            north.offset += beyond / real(NORTH_OVER);
        }
        let tilted = -ahead.z / (horizontal * horizontal);
        let row = Errors {
            attitude: Vector3::new(ahead.x * tilted, ahead.y * tilted, T::one()), // isolation.md, eq. 21
            ..Errors::none()
        };
        Some(self.measured(row, beyond, aided.sigma * aided.sigma))
    }

    /// Resets the reference direction of headings.
    pub fn forget_north(&mut self) {
        self.north = None;
    }

    /// Starts with the first velocity in the axes of the primary; later ones change nothing here.
    pub fn begin_along_primary(&mut self, aided: &Aided<T>) {
        if !self.along_primary {
            self.along_primary = true;
            self.begun = true;
            self.heading = Heading::sought_from(Vector2::zeros(), Vector2::zeros());
            let value = self.level_from_primary * finite(&aided.value);
            self.begin(value, &Vector3::repeat(largest(&aided.sigma)), aided);
        }
    }

    /// Starts with a velocity in the level frame, and searches its heading.
    pub fn begin_along_level(&mut self, aided: &Aided<T>) {
        if !self.begun {
            self.begun = true;
            self.begin(
                finite(&aided.value),
                &Vector3::repeat(largest(&aided.sigma)),
                aided,
            );
            self.seek_again(aided);
            return;
        }
        let Heading::Sought {
            integrated,
            aided: before,
            since,
        } = self.heading
        else {
            return;
        };
        if !aided.is_level() {
            return;
        }
        let Some(velocity) = self.velocity_at(aided) else {
            return;
        };
        let change = aided.value.xy() - before;
        let integrated = velocity.xy() - integrated;
        let (by_aiding, by_set) = (change.length(), integrated.length());
        let own = self.covariance.variances().velocity;
        let of_aiding = aided.sigma.x.max(aided.sigma.y);
        let variance = own.x.max(own.y) + of_aiding * of_aiding * real(2.0);
        let sigma = variance.square_root();
        let changed = by_aiding > sigma * real(CHANGED);
        if changed && (by_aiding - by_set).abs() < sigma * real(ALIKE) {
            let angle = integrated.perp(&change).atan2(integrated.dot(&change));
            self.turn_to(angle, variance / (by_aiding * by_aiding));
            self.begin(aided.value, &aided.sigma, aided);
        } else if changed || since > real(WITHIN) {
            self.seek_again(aided);
        }
    }

    /// Starts the search for the heading at this velocity.
    fn seek_again(&mut self, aided: &Aided<T>) {
        if self.along_primary {
            return;
        }
        let Some(velocity) = self.velocity_at(aided) else {
            return;
        };
        self.heading = Heading::sought_from(velocity.xy(), finite(&aided.value).xy());
        let horizontal = Errors {
            velocity: Vector3::new(T::one(), T::one(), T::zero()),
            ..Errors::none()
        };
        self.covariance.replace(&horizontal, &Errors::none());
    }

    /// Aligns the level frame with that of the aiding measurement: a turn about the vertical by an angle, rad,
    /// of a variance, rad^2.
    fn turn_to(&mut self, angle: T, variance: T) {
        let turn = rotation_of(&(Vector3::z() * angle));
        self.level_from_primary = turn * self.level_from_primary;
        self.velocity = turn * self.velocity;
        self.track.change(|before| turn * before);
        for deviation in self.deviations.iter_mut().flatten() {
            deviation.attitude = turn * deviation.attitude;
            deviation.velocity = turn * deviation.velocity;
        }
        self.heading = Heading::Known;
        if let Some(north) = &mut self.north {
            north.offset -= angle;
        }
        // The covariance of level directions turns too; both horizontal directions get the larger variance.
        let own = self.covariance.variances();
        let level = own.attitude.x.max(own.attitude.y);
        let attitude = Errors {
            attitude: Vector3::repeat(T::one()),
            ..Errors::none()
        };
        let variances = Errors {
            attitude: Vector3::new(level, level, variance),
            ..Errors::none()
        };
        self.covariance.replace(&attitude, &variances);
    }

    /// Sets the velocity to the aided one.
    fn begin(&mut self, value: Vector3<T>, sigma: &Vector3<T>, aided: &Aided<T>) {
        let change = value - self.velocity_at(aided).unwrap_or(self.velocity);
        self.velocity += change;
        self.track.change(|before| before + change);
        let velocity = Errors {
            velocity: Vector3::repeat(T::one()),
            ..Errors::none()
        };
        let largest = largest(sigma);
        let variance = sigma.map(|sigma| {
            if sigma.is_finite() {
                sigma * sigma
            } else {
                largest * largest
            }
        });
        let variances = Errors {
            velocity: variance,
            ..Errors::none()
        };
        self.covariance.replace(&velocity, &variances);
    }
}

/// Variances that a window adds, for an angular rate, rad/s, and an acceleration, m/s^2, of the set
/// (docs/theory/isolation.md, table 2).
fn noise<T: Real>(rate: &Vector3<T>, acceleration: &Vector3<T>, window: T) -> Errors<T> {
    let density = |[least, share]: [f32; 2], size: T| {
        let (least, more) = (tabulated::<T>(least), size * tabulated::<T>(share));
        Vector3::repeat((least * least + more * more) * window)
    };
    let wanders = |wanders: f32| tabulated::<T>(wanders) * tabulated::<T>(wanders) * window;
    Errors {
        attitude: density(RATE_NOISE, rate.length()),
        velocity: density(FORCE_NOISE, acceleration.length()),
        rate: Vector3::repeat(wanders(RATE_WANDERS)),
        vertical: wanders(FORCE_WANDERS),
    }
}

/// Wraps an angle, rad, to half a turn to either side.
fn within_half_a_turn<T: Real>(angle: T) -> T {
    let turn = real::<T>(core::f64::consts::TAU);
    angle - (angle / turn).round() * turn
}

/// Returns the element along an axis, if it is finite.
fn along<T: Real>(axis: &Vector3<T>, values: &Vector3<T>) -> Option<T> {
    let mut found = axis
        .iter()
        .zip(values.iter())
        .filter(|(axis, _)| **axis != T::zero());
    found
        .next()
        .map(|(_, value)| *value)
        .filter(|value| value.is_finite())
}

fn finite<T: Real>(values: &Vector3<T>) -> Vector3<T> {
    values.map(|value| if value.is_finite() { value } else { T::zero() })
}

fn largest<T: Real>(sigma: &Vector3<T>) -> T {
    let finite = sigma.iter().filter(|sigma| sigma.is_finite());
    finite.fold(T::zero(), |largest, sigma| largest.max(*sigma))
}

/// Sensors whose deviations are stored, with the number of the unit.
pub(super) fn candidates<const UNITS: usize>() -> impl Iterator<Item = (Sensor, usize)> {
    (0..UNITS).flat_map(|unit| SENSORS.into_iter().map(move |sensor| (sensor, unit)))
}

#[cfg(test)]
mod tests;
