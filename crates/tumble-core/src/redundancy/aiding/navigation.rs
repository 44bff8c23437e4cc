//! Attitude and velocity of one unit between aiding measurements: the hypothesis that this unit is right.
//!
//! An error-state filter runs on the readings of the unit alone (docs/theory/set.md, section 9).

use nalgebra::{UnitQuaternion, Vector3};

use crate::products::Length;
use crate::real::{Real, count, real, tabulated};
use crate::redundancy::aiding::course::{CourseSearch, turned_back};
use crate::redundancy::aiding::errors::{Covariance, Errors, Moves};
use crate::redundancy::aiding::track::Track;
use crate::rotation::{rotation_by_series as rotation_of, rotation_onto};

/// Least noise densities of specific force and angular rate, m/s^2/sqrt(Hz) and rad/s/sqrt(Hz), and the share of that of samples, were
/// these white, which windows leave of vibration (docs/theory/set.md, table 1).
const LEAST_NOISE: [f32; 2] = [0.01, 2e-4];
const LEFT_OF_VIBRATION: f32 = 0.3;

/// Random walk of the errors of angular rate and specific force, rad/s and m/s^2 per square root of a second.
const RATE_WANDERS: f32 = 5e-5;
const FORCE_WANDERS: f32 = 5e-4;

/// Initial sigmas: of tilt, rad, of the errors of angular rate, rad/s, and specific force, m/s^2, and of the delay, s.
const LEVELLED: f32 = 0.2;
const RATE_UNKNOWN: f32 = 0.02;
const FORCE_UNKNOWN: f32 = 0.4;
const DELAYED: f32 = 0.1;

/// Horizontal acceleration of a platform, m/s^2, over one second, in motion and at rest: the filter levels by
/// it while no velocity is measured.
const ACCELERATES: [f32; 2] = [3.0, 0.05];

/// Sigmas of an innovation beyond which it moves the state no further.
const TAPERED: f64 = 3.0;

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

/// Course of the level frame: the angle about the vertical from it to the frame of aided velocities.
#[derive(Clone, Copy, Debug, PartialEq)]
enum LevelCourse<T: Real> {
    /// No horizontal velocity was measured.
    Unaided,
    /// The angle is sought.
    Sought(CourseSearch<T>),
    /// Sine and cosine of the angle.
    Known([T; 2]),
    /// Velocities are those along the axes of the primary, which need none.
    AlongPrimary,
}

/// Readings of a unit over a window.
pub(super) struct NavigationStep<'a, T: Real> {
    /// m/s^2 and rad/s, axes and place of the primary.
    pub reading: &'a [Vector3<T>; 2],
    /// Squared noise densities of its samples, (m/s^2)^2 s and (rad/s)^2 s.
    pub noise: &'a [T; 2],
    /// Length of the window, s.
    pub length: T,
    /// m/s^2.
    pub gravity: T,
    /// True if the set rests.
    pub rests: bool,
}

/// Measurement of one quantity.
pub(super) struct Innovation<T: Real> {
    /// Measured value minus the prediction.
    pub value: T,
    /// Its variance.
    pub variance: T,
    /// Derivatives by each error.
    row: Errors<T>,
    across: Errors<T>,
}

impl<T: Real> Innovation<T> {
    /// Sigmas by which the measurement differs.
    pub fn sigmas(&self) -> T {
        self.value / self.variance.square_root()
    }
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
    /// Variance of either horizontal axis, (m/s)^2; `None` where one was not measured.
    fn level_variance(&self) -> Option<T> {
        let sigma = self.sigma.x.max(self.sigma.y);
        sigma.is_finite().then_some(sigma * sigma)
    }
}

/// Attitude, velocity and biases of one unit, estimated from its readings and from aiding measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Navigation<T: Real> {
    level_from_primary: UnitQuaternion<T>,
    /// Velocity in the level frame, m/s.
    velocity: Vector3<T>,
    /// Errors of angular rate, rad/s, and specific force, m/s^2.
    rate_error: Vector3<T>,
    force_error: Vector3<T>,
    /// Delay of aiding measurements, s.
    delay: T,
    covariance: Covariance<T>,
    /// Rotation vector of the latest window, rad, and acceleration, level frame, m/s^2.
    turn: Vector3<T>,
    acceleration: Vector3<T>,
    track: Track<T>,
    course: LevelCourse<T>,
    /// Reference direction, once a heading was processed.
    north: Option<North<T>>,
}

impl<T: Real> Navigation<T> {
    /// Starts level by the specific force, m/s^2, at an arbitrary heading.
    pub fn start(force: &Vector3<T>) -> Self {
        let variance = |sigma: f32| tabulated::<T>(sigma) * tabulated::<T>(sigma);
        let levelled = variance(LEVELLED);
        let variances = Errors {
            attitude: Vector3::new(levelled, levelled, T::zero()),
            rate: Vector3::repeat(variance(RATE_UNKNOWN)),
            force: Vector3::repeat(variance(FORCE_UNKNOWN)),
            delay: variance(DELAYED),
            ..Errors::none()
        };
        Self {
            level_from_primary: rotation_onto(force, &Vector3::z()),
            velocity: Vector3::zeros(),
            rate_error: Vector3::zeros(),
            force_error: Vector3::zeros(),
            delay: T::zero(),
            covariance: Covariance::of_variances(&variances),
            turn: Vector3::zeros(),
            acceleration: Vector3::zeros(),
            track: Track::new(),
            course: LevelCourse::Unaided,
            north: None,
        }
    }

    /// Advances the state by a window.
    pub fn advance(&mut self, step: &NavigationStep<'_, T>) {
        let ([f, w], h) = (step.reading, step.length);
        let turn: Vector3<T> = (w - self.rate_error) * h;
        let coning: Vector3<T> = self.turn.cross(&turn) * real::<T>(1.0 / 12.0);
        let half: Vector3<T> = turn * real::<T>(0.5);
        let middle = self.level_from_primary * rotation_of(&half);
        self.level_from_primary = middle * rotation_of(&(half + coning)); // set.md, eq. 28
        self.turn = turn;
        let force: Vector3<T> = middle * (f - self.force_error);
        self.acceleration = force - Vector3::z() * step.gravity;
        self.velocity += self.acceleration * h; // set.md, eq. 28
        self.track.push(&self.velocity, &self.acceleration);
        let moves = Moves {
            velocity_by_attitude: force.cross_matrix() * -h,
            by_reading: *middle.to_rotation_matrix().matrix() * -h,
        };
        self.covariance.spread(&moves, &noise(step.noise, h));
        match &mut self.course {
            LevelCourse::Unaided => self.level(&force, step.rests, h),
            LevelCourse::Sought(search) => search.carry(&moves, h, step.rests),
            LevelCourse::Known(_) | LevelCourse::AlongPrimary => {}
        }
    }

    /// Levels by the specific force over a window of `length` s.
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

    /// Updates the state with a measurement; an outlier moves it no further than a large one that is plausible.
    pub fn update(&mut self, innovation: &Innovation<T>) {
        let sigmas = innovation.sigmas().abs();
        let taper = real::<T>(TAPERED) / sigmas.max(real(TAPERED));
        self.covariance.narrow(&innovation.across, innovation.variance);
        let gain = innovation.value * taper / innovation.variance;
        self.correct(&Errors::none().plus(&innovation.across, gain)); // set.md, eq. 31
    }

    fn correct(&mut self, errors: &Errors<T>) {
        self.level_from_primary = rotation_of(&errors.attitude) * self.level_from_primary;
        self.level_from_primary.renormalize_fast();
        self.velocity += errors.velocity;
        self.track.change(|before| before + errors.velocity);
        self.rate_error += errors.rate;
        self.force_error += errors.force;
        self.delay += errors.delay;
    }

    /// Returns whether all elements are finite.
    pub fn is_finite(&self) -> bool {
        let state = self.velocity.iter().chain(self.rate_error.iter());
        state
            .chain(self.level_from_primary.coords.iter())
            .all(T::is_finite)
    }

    fn measured(&self, row: Errors<T>, value: T, variance: T) -> Innovation<T> {
        let across = self.covariance.across(&row);
        Innovation {
            value,
            variance: row.dot(&across) + variance, // set.md, eq. 31
            row,
            across,
        }
    }

    /// Velocity at the time of an aiding measurement less its delay, level frame, m/s.
    fn velocity_at(&self, aided: &Aided<T>) -> Option<Vector3<T>> {
        let then = self.track.at(aided.windows, &self.velocity, aided.length)?;
        Some(then - self.acceleration * self.delay)
    }

    /// Derivatives of the velocity along a direction of the level frame.
    fn by_velocity(&self, direction: &Vector3<T>) -> Errors<T> {
        Errors {
            velocity: *direction,
            delay: -self.acceleration.dot(direction),
            ..Errors::none()
        } // set.md, eq. 30
    }

    /// Innovation of the vertical of a velocity in a level frame, and of either horizontal axis once the course is known.
    pub fn along_level(&self, axis: usize, aided: &Aided<T>) -> Option<Innovation<T>> {
        let (value, variance) = match (axis, &self.course) {
            // The search takes all axes.
            (_, LevelCourse::Sought(_)) => return None,
            (2, _) => (aided.value.z, aided.sigma.z * aided.sigma.z),
            (_, LevelCourse::Known([sine, cosine])) => {
                let [by_cosine, by_sine] = turned_back(axis, &aided.value.xy());
                (by_cosine * *cosine + by_sine * *sine, aided.level_variance()?)
            }
            _ => return None,
        };
        let direction = unit_along(axis);
        let velocity = self.velocity_at(aided)?;
        variance.is_finite().then(|| {
            self.measured(
                self.by_velocity(&direction),
                value - velocity.dot(&direction),
                variance,
            )
        })
    }

    /// Innovation along one axis of a velocity in the axes of the primary.
    pub fn along_primary(&self, axis: usize, aided: &Aided<T>) -> Option<Innovation<T>> {
        let direction: Vector3<T> = unit_along(axis);
        let (value, sigma) = (*aided.value.get(axis)?, *aided.sigma.get(axis)?);
        if !value.is_finite() || !sigma.is_finite() {
            return None;
        }
        let velocity = self.velocity_at(aided)?;
        // The unit has turned since.
        let turned = self.level_from_primary * rotation_of(&(self.turn * -aided.windows));
        let level: Vector3<T> = turned * direction;
        let row = Errors {
            attitude: level.cross(&velocity),
            ..self.by_velocity(&level)
        };
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
                self.widen_heading(variance);
            }
            return None;
        }
        if calm {
            north.offset += beyond / real(NORTH_OVER);
        }
        let tilted = -ahead.z / (horizontal * horizontal);
        let row = Errors {
            attitude: Vector3::new(ahead.x * tilted, ahead.y * tilted, T::one()), // set.md, eq. 33
            ..Errors::none()
        };
        let innovation = self.measured(row, beyond, aided.sigma * aided.sigma);
        if matches!(self.course, LevelCourse::Sought(_)) {
            self.search_with(&innovation, [T::zero(); 2]);
            return None;
        }
        Some(innovation)
    }

    /// Adds a variance, rad^2, to that of the attitude about the vertical.
    fn widen_heading(&mut self, variance: T) {
        self.covariance.widen(&Errors {
            attitude: Vector3::z() * variance,
            ..Errors::none()
        });
    }

    /// Resets the reference direction of headings.
    pub fn forget_north(&mut self) {
        self.north = None;
    }

    /// Starts with the first velocity in the axes of the primary; later ones change nothing here.
    pub fn begin_along_primary(&mut self, aided: &Aided<T>) {
        if self.course != LevelCourse::AlongPrimary {
            self.course = LevelCourse::AlongPrimary;
            let value = self.level_from_primary * finite(&aided.value);
            self.begin(value, &aided.sigma, aided);
        }
    }

    /// Starts with a velocity in the level frame, or goes on with the search for its course.
    pub fn begin_along_level(&mut self, aided: &Aided<T>) {
        let Some(variance) = aided.level_variance() else {
            if self.course == LevelCourse::Unaided && self.track.is_new() {
                self.begin(finite(&aided.value), &aided.sigma, aided);
            }
            return;
        };
        match &self.course {
            LevelCourse::Unaided => self.seek(aided, finite(&aided.value).z),
            LevelCourse::Sought(search) if search.is_over() => {
                let of_all = search.of_all();
                self.correct(&of_all);
                self.seek(aided, self.velocity.z);
            }
            LevelCourse::Sought(_) => self.search(aided, variance),
            LevelCourse::Known(_) | LevelCourse::AlongPrimary => {}
        }
    }

    /// Begins the search for the course at this velocity, with a vertical one, m/s.
    fn seek(&mut self, aided: &Aided<T>, vertical: T) {
        self.begin(Vector3::z() * vertical, &aided.sigma, aided);
        self.course = LevelCourse::Sought(CourseSearch::new(&aided.value.xy()));
    }

    /// Takes a velocity to the search for the course, axis by axis.
    fn search(&mut self, aided: &Aided<T>, variance: T) {
        for axis in 0..3 {
            let Some(velocity) = self.velocity_at(aided) else {
                return;
            };
            let direction = unit_along(axis);
            let [by_cosine, by_sine] = turned_back(axis, &aided.value.xy());
            let (measured, variance) = if axis == 2 {
                let sigma = aided.sigma.z;
                ([aided.value.z, T::zero(), T::zero()], sigma * sigma)
            } else {
                ([T::zero(), by_cosine, by_sine], variance)
            };
            let [of_all, by_cosine, by_sine] = measured;
            if variance.is_finite() {
                let of_all = of_all - velocity.dot(&direction);
                let innovation = self.measured(self.by_velocity(&direction), of_all, variance);
                self.search_with(&innovation, [by_cosine, by_sine]);
            }
        }
    }

    /// Takes an innovation of the state that began to the search, with its parts by cosine and sine of the course.
    fn search_with(&mut self, innovation: &Innovation<T>, [by_cosine, by_sine]: [T; 2]) {
        if let LevelCourse::Sought(search) = &mut self.course {
            let measured = [innovation.value, by_cosine, by_sine];
            search.take(measured, &innovation.row, &innovation.across, innovation.variance);
            self.covariance.narrow(&innovation.across, innovation.variance);
        }
    }

    /// The search for the course, while it goes on.
    pub fn course_search(&self) -> Option<&CourseSearch<T>> {
        match &self.course {
            LevelCourse::Sought(search) => Some(search),
            _ => None,
        }
    }

    /// Ends the search with a course: its sine and cosine, and its variance, rad^2.
    pub fn choose_course(&mut self, course: [T; 2], variance: T) {
        if let LevelCourse::Sought(search) = self.course {
            self.correct(&search.errors_at(&course));
            self.course = LevelCourse::Known(course);
            self.widen_heading(variance);
        }
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
        let variances = Errors {
            velocity: sigma.map(|sigma| {
                let sigma = if sigma.is_finite() { sigma } else { largest };
                sigma * sigma
            }),
            ..Errors::none()
        };
        self.covariance.replace(&velocity, &variances);
    }
}

/// Variances that a window of so many s adds, with squared noise densities of samples (docs/theory/set.md, table 1).
fn noise<T: Real>([of_force, of_rate]: &[T; 2], window: T) -> Errors<T> {
    let square = |size: f32| tabulated::<T>(size) * tabulated::<T>(size);
    let [force, rate] = LEAST_NOISE;
    let density = |of_samples: T, least: f32| square(least).max(of_samples * square(LEFT_OF_VIBRATION));
    Errors {
        attitude: Vector3::repeat(density(*of_rate, rate) * window),
        velocity: Vector3::repeat(density(*of_force, force) * window),
        rate: Vector3::repeat(square(RATE_WANDERS) * window),
        force: Vector3::repeat(square(FORCE_WANDERS) * window),
        delay: T::zero(),
    }
}

/// Unit vector along an axis.
fn unit_along<T: Real>(axis: usize) -> Vector3<T> {
    Vector3::from_fn(|row, _| if row == axis { T::one() } else { T::zero() })
}

/// Wraps an angle, rad, to half a turn to either side.
fn within_half_a_turn<T: Real>(angle: T) -> T {
    let turn = real::<T>(core::f64::consts::TAU);
    angle - (angle / turn).round() * turn
}

fn finite<T: Real>(values: &Vector3<T>) -> Vector3<T> {
    values.map(|value| if value.is_finite() { value } else { T::zero() })
}

fn largest<T: Real>(sigma: &Vector3<T>) -> T {
    let finite = sigma.iter().filter(|sigma| sigma.is_finite());
    finite.fold(T::zero(), |largest, sigma| largest.max(*sigma))
}

#[cfg(test)]
mod tests;
