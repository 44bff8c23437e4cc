//! Checks of one sensor of a unit, reading by reading.

use crate::real::{Real, count, real, tabulated};
use crate::redundancy::components::{larger, smaller};
use crate::redundancy::health::fault::HealthFault;
use crate::redundancy::leaky::{Lapse, Leaky, ticks};
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::HealthSettings;

/// State of the platform, as readings that change show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surroundings {
    /// The state is unknown.
    Unknown,
    /// The platform may have come to rest, or moves smoothly.
    Quiet,
    /// The platform rests: repetitions prove nothing.
    Rest,
    /// The platform moves.
    Motion,
}

/// Circumstances of the readings of a sample.
pub(super) struct Context<'a, T: Real> {
    /// Time since the previous sample.
    pub lapse: Lapse,
    pub surroundings: Surroundings,
    /// Additional delay of the detection of a rest if windows are longer than those of the settings,
    /// microseconds.
    pub shown_late: u32,
    pub settings: &'a HealthSettings<T>,
}

/// Next reading of a sensor, with its context.
pub(super) struct Reading<'a, T: Real> {
    pub sensor: Sensor,
    pub values: [T; 3],
    pub axes: &'a [bool; 3],
    /// End of the range, if known.
    pub end: Option<T>,
    pub context: &'a Context<'a, T>,
}

/// Share of the range above which a reading is at its end: converters have a count less on one side than on the
/// other.
const END: f64 = 0.9995;

/// Share of the range above which a repeated reading is at its end, whatever the data sheet states.
const NEAR_END: f64 = 0.97;

/// Smallest range, m/s^2 and rad/s: 2 g and 125 deg/s are the smallest of common parts.
const SMALLEST_RANGE: [f32; 2] = [18.5, 2.1];

/// Successive repetitions at the largest reading ever that show an end of the range.
const CLIPPED: u8 = 4;

/// Counts by which another axis must move before a repetition is independent of the resolution.
const COUNTS: f64 = 4.0;

impl<T: Real> Reading<'_, T> {
    fn channel(&self, axis: u8) -> u8 {
        match self.sensor {
            Sensor::Accelerometer => axis,
            Sensor::Gyroscope => axis.saturating_add(3),
        }
    }

    fn spike(&self) -> T {
        self.context.settings.spike.of(self.sensor)
    }

    /// Compares the axes with their latest values; missing axes are zero. Branches on random readings are slow,
    /// so the axis concerned is determined only after a fault.
    fn look(&self, latest: &[T; 3]) -> Look<T> {
        let ([x, y, z], [x_before, y_before, z_before]) = (self.values, *latest);
        let zero = T::zero();
        let largest = larger(larger(larger(zero, x.abs()), y.abs()), z.abs());
        let moved = [(x - x_before).abs(), (y - y_before).abs(), (z - z_before).abs()];
        let [x_moved, y_moved, z_moved] = moved;
        Look {
            finite: x * zero + y * zero + z * zero == zero,
            at_end: largest >= self.end(),
            change: larger(larger(larger(zero, x_moved), y_moved), z_moved),
            repeats: (x_moved == zero) | (y_moved == zero) | (z_moved == zero),
            largest,
        }
    }

    /// Smallest change of an axis that changed; `most` if none changed by less.
    fn smallest_change(&self, latest: &[T; 3], most: T) -> T {
        let mut smallest = most;
        for (value, before) in self.values.iter().zip(latest) {
            let moved = (*value - *before).abs();
            if moved > T::zero() {
                smallest = smaller(smallest, moved);
            }
        }
        smallest
    }

    /// Axes that repeat their values, except at the end of the range.
    fn repeats(&self, latest: &[T; 3]) -> [bool; 3] {
        let end = self.end();
        let mut repeats = *self.axes;
        for ((repeats, value), before) in repeats.iter_mut().zip(&self.values).zip(latest) {
            *repeats &= (value == before) & (value.abs() < end);
        }
        repeats
    }

    /// Magnitude above which a reading is at the end of its range; infinite if unknown.
    fn end(&self) -> T {
        self.end.map_or(real(f64::INFINITY), |end| end * real(END))
    }

    /// Number of axes.
    fn present(&self) -> u16 {
        self.axes.iter().map(|has| u16::from(*has)).sum()
    }

    /// First channel whose value meets a condition, with that value.
    fn first(&self, is_so: impl Fn(T) -> bool) -> Option<(u8, T)> {
        let mut axes = (0..).zip(&self.values).zip(self.axes);
        let ((axis, value), _) = axes.find(|((_, value), has)| **has && is_so(**value))?;
        Some((self.channel(axis), *value))
    }
}

/// Comparison of a reading with the latest one.
struct Look<T: Real> {
    /// True if all values are finite.
    finite: bool,
    /// True if an axis is at the end of its range.
    at_end: bool,
    /// Largest change; none without a previous reading.
    change: T,
    /// True if an axis repeats its value.
    repeats: bool,
    /// Largest magnitude of an axis.
    largest: T,
}

/// Check of a reading.
pub(super) struct ReadingCheck<T: Real> {
    /// True if the reading may enter a mean.
    pub usable: bool,
    /// True if the reading is finite and does not repeat on all axes.
    pub is_live: bool,
    /// Fault of the sensor.
    pub fault: Option<HealthFault<T>>,
    /// True if an earlier fault persists.
    pub lasts: bool,
    /// Repetition of the previous reading, if this one changed and the sensor can distinguish.
    pub again: Option<u8>,
}

/// State of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SensorWatch<T: Real> {
    /// Latest reading that was no spike; NaN before the first.
    latest: [T; 3],
    /// Usual change from one reading to the next.
    usual_change: T,
    /// Smallest change ever: at least the resolution.
    step: T,
    /// Largest magnitude of a reading ever.
    largest: T,
    /// Change of the latest departure.
    departure: T,
    /// Time over which all axes repeated.
    repeating: Leaky,
    /// Time without a usable reading.
    useless: Leaky,
    /// A fixed time for each spike.
    spiking: Leaky,
    /// Successive readings that repeat on all axes.
    repeated: u16,
    /// Successive readings that repeated the largest magnitude; [`CLIPPED`] once they have shown an end of the
    /// range.
    clipped: u8,
    /// Successive readings that each axis repeated while another axis moved.
    stuck: [u8; 3],
    /// Axis on which the latest reading departed and has not returned, or [`NONE`].
    departed: u8,
    /// True if the sensors of other units are at the ends of their ranges too, so that saturation is no fault.
    overloaded: bool,
}

const NONE: u8 = 3;

/// Least number of bad readings that excludes a sensor.
const FEWEST: u16 = 4;

/// Least number of repetitions of a frozen sensor: if the noise is half a count, all three axes repeat by
/// chance every eighth time.
const FEWEST_REPEATED: u16 = 16;

/// Time that each spike counts for, and the limit of their sum: four at a time, or more than one a second.
const SPIKE: u64 = 1_000_000;
const SPIKES: u64 = 3_500_000;

/// Least ratio of a spike to the usual change of readings, which shaking does not reach.
const TIMES_USUAL: f64 = 5.0;

/// Share of a spike within which a reading has returned.
const BACK: f64 = 0.5;

/// Largest change in the average, in spikes, which keeps sums finite.
const WILDEST: f64 = 100.0;

/// Readings over which the usual change is averaged.
const AVERAGED: f64 = 16.0;

/// Share of a spike by which an axis must move before a repetition of another is unexpected: 0.1 m/s^2 and
/// 0.025 rad/s by default. Counts of quantised readings are smaller, so axes at rest may repeat.
const MOVING: f64 = 0.0025;

/// Change in counts below which readings repeat for a while as the platform stops, before windows show the
/// rest.
const COARSE: f64 = 16.0;

/// Change in counts above which the resolution does not matter.
const FINE: f64 = 256.0;

/// Share of readings that is assumed to change in motion before any change.
const UNSEEN: f64 = 0.125;

/// Successive readings that an axis may repeat while another moves.
const STUCK: u8 = 32;

impl<T: Real> SensorWatch<T> {
    pub fn new() -> Self {
        Self {
            latest: [real(f64::NAN); 3],
            usual_change: T::zero(),
            step: real(f64::INFINITY),
            largest: T::zero(),
            departure: T::zero(),
            repeating: Leaky::default(),
            useless: Leaky::default(),
            spiking: Leaky::default(),
            repeated: 0,
            clipped: 0,
            stuck: [0; 3],
            departed: NONE,
            overloaded: false,
        }
    }

    /// Resets the comparison after missing readings.
    pub fn forget(&mut self) {
        self.latest = [real(f64::NAN); 3];
        self.repeating.empty();
        self.repeated = 0;
        self.stuck = [0; 3];
        self.departed = NONE;
    }

    #[inline(never)]
    pub fn push(&mut self, reading: &Reading<'_, T>) -> ReadingCheck<T> {
        let look = reading.look(&self.latest);
        self.spiking.drain(reading.context.lapse.whole);
        let useless = self.find_useless(look.at_end || !look.finite, reading);
        if !look.finite || *reading.axes == [false; 3] {
            let bad = useless
                .then(|| reading.first(|value| !value.is_finite()))
                .flatten();
            return ReadingCheck {
                usable: false,
                is_live: look.finite,
                fault: bad.map(|(channel, _)| HealthFault::NotFinite { channel }),
                lasts: useless,
                again: None,
            };
        }
        let given = self.repeated;
        let frozen = self.find_frozen(&look, reading);
        let worn = useless && look.at_end && !self.overloaded;
        let spikes = self.find_spikes(look.change, reading);
        let away = self.departed != NONE;
        let again = self.again(given, away);
        if !away {
            self.observe(&look, reading);
            self.latest = reading.values;
        }
        // Details of a fault are determined only if there is one, because that is slow and rare.
        let fault = if frozen || worn || spikes.is_some() {
            self.fault(frozen, worn, spikes, reading)
        } else {
            None
        };
        ReadingCheck {
            usable: !away && !frozen && !look.at_end,
            is_live: !away && (!frozen || self.repeating.is_empty()),
            fault,
            lasts: useless || self.spiking.is_over(ticks(SPIKES)),
            again,
        }
    }

    /// End of the range: the stated one, or a smaller one that readings have shown.
    #[inline]
    pub fn end(&self, stated: Option<T>) -> Option<T> {
        if self.clipped < CLIPPED {
            return stated;
        }
        Some(stated.map_or(self.largest, |stated| smaller(stated, self.largest)))
    }

    /// Learns resolution and range.
    #[inline]
    fn observe(&mut self, look: &Look<T>, reading: &Reading<'_, T>) {
        let most = look.change;
        if most > T::zero() && most <= self.step * real(FINE) {
            self.step = smaller(self.step, reading.smallest_change(&self.latest, most));
        }
        if look.largest > self.largest {
            (self.largest, self.clipped) = (look.largest, 0);
        } else if self.clipped < CLIPPED {
            let again = look.repeats && look.largest == self.largest && self.is_extreme(look, reading);
            self.clipped = if again { self.clipped + 1 } else { 0 };
        }
    }

    /// Returns whether an axis repeats its largest reading ever, while neither resolution nor rest explains
    /// that.
    #[cold]
    fn is_extreme(&self, look: &Look<T>, reading: &Reading<'_, T>) -> bool {
        let mut axes = reading.values.iter().zip(&self.latest);
        let repeats = axes.any(|(value, before)| value == before && value.abs() == self.largest);
        let near = reading
            .end
            .is_some_and(|end| self.largest >= end * real(NEAR_END));
        let smallest = tabulated::<T>(*reading.sensor.of(&SMALLEST_RANGE));
        let moves = look.change > self.step * real(COUNTS) && self.largest > self.step * real(FINE);
        repeats && (near || (moves && self.largest >= smallest))
    }

    /// Repetition of the previous reading, if all axes changed too much to repeat by chance.
    #[inline]
    fn again(&self, given: u16, away: bool) -> Option<u8> {
        let distinguishes = self.repeated == 0 && !away && self.usual_change > self.step * real(COUNTS);
        distinguishes.then(|| u8::try_from(given).unwrap_or(u8::MAX))
    }

    #[cold]
    fn fault(
        &self,
        frozen: bool,
        worn: bool,
        spikes: Option<u8>,
        reading: &Reading<'_, T>,
    ) -> Option<HealthFault<T>> {
        if frozen {
            return Some(self.frozen(reading));
        }
        let at_end = reading
            .first(|value| worn && value.abs() >= reading.end())
            .map(|(channel, value)| HealthFault::Saturated { channel, value });
        let spiky = || {
            let channel = reading.channel(spikes?);
            let value = self.departure;
            Some(HealthFault::Spikes { channel, value })
        };
        at_end.or_else(spiky)
    }

    /// Returns the fault of the whole sensor if all axes repeat, or else of the stuck axis.
    fn frozen(&self, reading: &Reading<'_, T>) -> HealthFault<T> {
        let mut axes = (0_u8..).zip(&self.stuck).zip(&reading.values);
        let repeating = !self.repeating.is_empty();
        match axes.find(|((_, stuck), _)| !repeating && **stuck >= STUCK) {
            Some(((axis, _), value)) => HealthFault::Stuck {
                channel: reading.channel(axis),
                value: *value,
            },
            None => HealthFault::Frozen {
                sensor: reading.sensor,
                duration: self.repeating.seconds(),
            },
        }
    }

    /// Returns whether readings were unusable for too long.
    fn find_useless(&mut self, is_useless: bool, reading: &Reading<'_, T>) -> bool {
        if !is_useless && self.useless.is_empty() {
            return false;
        }
        let limit = ticks(reading.context.settings.saturated);
        if is_useless {
            self.useless.fill(reading.context.lapse.whole, limit, FEWEST);
        } else {
            self.useless.drain(reading.context.lapse.quarter);
        }
        self.useless.is_over(limit)
    }

    /// Detects a spike when it is over: the reading after it is near the one before it. Returns its axis if
    /// there were too many spikes.
    fn find_spikes(&mut self, change: T, reading: &Reading<'_, T>) -> Option<u8> {
        let spike = larger(reading.spike(), self.usual_change * real(TIMES_USUAL));
        let away = core::mem::replace(&mut self.departed, NONE);
        if away == NONE && change > spike {
            (self.departed, self.departure) = (self.farthest(reading), change);
            return None;
        }
        if away == NONE || change > spike * real(BACK) {
            if self.repeated > 0 {
                // The change is counted when the run of repetitions is over.
                return None;
            }
            let change = smaller(reading.spike() * real(WILDEST), change);
            self.usual_change += (change - self.usual_change) * real(1.0 / AVERAGED);
            return None;
        }
        self.spiking.fill(ticks(SPIKE), ticks(SPIKES), 1);
        self.spiking.is_over(ticks(SPIKES)).then_some(away)
    }

    /// Axis with the largest change.
    fn farthest(&self, reading: &Reading<'_, T>) -> u8 {
        let axes = reading.values.iter().zip(&self.latest).zip(reading.axes);
        let mut most = (0, T::zero());
        for (axis, ((value, before), has)) in (0..).zip(axes) {
            let change = (*value - *before).abs();
            if *has && change > most.1 {
                most = (axis, change);
            }
        }
        most.0
    }

    /// Returns whether all axes repeat for too long, or one while another moves. Repetition means less with
    /// fewer axes and with coarser readings.
    fn find_frozen(&mut self, look: &Look<T>, reading: &Reading<'_, T>) -> bool {
        if !look.repeats {
            self.stuck = [0; 3];
            self.end_run();
            return false;
        }
        let moving = look.change > larger(reading.spike() * real(MOVING), self.resolution() * real(COUNTS));
        let (mut repeating, mut longest) = (0_u16, 0);
        for (stuck, repeats) in self.stuck.iter_mut().zip(reading.repeats(&self.latest)) {
            repeating += u16::from(repeats);
            *stuck = if repeats {
                stuck.saturating_add(u8::from(moving))
            } else {
                0
            };
            longest = longest.max(*stuck);
        }
        let present = reading.present();
        if repeating < present {
            self.end_run();
            return longest >= STUCK;
        }
        self.repeated = self.repeated.saturating_add(1);
        if reading.context.surroundings == Surroundings::Rest {
            self.repeating.empty();
            return false;
        }
        let allowed = reading
            .context
            .settings
            .frozen
            .saturating_add(reading.context.shown_late.into());
        let limit = ticks(allowed).saturating_mul(3) / present.max(1);
        self.repeating
            .fill(reading.context.lapse.whole, limit, FEWEST_REPEATED);
        let coarse = self.usual_change < self.resolution() * real(COARSE);
        let needed = if coarse { limit.saturating_mul(2) } else { limit };
        self.repeating.is_over(needed) && self.is_no_chance(reading.context.surroundings)
    }

    /// Returns whether the resolution cannot explain so many repetitions: readings whose mean change is a share
    /// of a count change at least with the square of that share (docs/theory/redundancy.md, eq. 26).
    fn is_no_chance(&self, surroundings: Surroundings) -> bool {
        let counts = self.usual_change / self.step * real(0.5);
        let share = match surroundings {
            _ if self.step.is_finite() => smaller(T::one(), counts * counts),
            Surroundings::Motion => real(UNSEEN),
            Surroundings::Rest | Surroundings::Quiet | Surroundings::Unknown => return false,
        };
        count::<T>(self.repeated.into()) * share >= count(FEWEST_REPEATED.into()) // redundancy.md, eq. 26
    }

    /// Stores whether saturation is no fault.
    pub fn set_overloaded(&mut self, overloaded: bool) {
        self.overloaded = overloaded;
    }

    /// Returns whether saturation is no fault.
    pub fn is_overloaded(&self) -> bool {
        self.overloaded
    }

    /// Time over which readings could not be used, ticks, lessened by the time since.
    pub fn useless_for(&self) -> u16 {
        self.useless.count()
    }

    /// Returns whether no axis ever changed.
    pub fn never_changed(&self) -> bool {
        !self.step.is_finite()
    }

    /// Resolution, if known.
    fn resolution(&self) -> T {
        if self.step.is_finite() {
            self.step
        } else {
            T::zero()
        }
    }

    /// Ends a run of repetitions: the unchanged readings enter the usual change.
    fn end_run(&mut self) {
        if self.repeated > 0 {
            let readings = count::<T>(self.repeated.into()) * real(1.0 / AVERAGED);
            self.usual_change /= T::one() + readings;
            self.repeated = 0;
        }
        self.repeating.empty();
    }
}
