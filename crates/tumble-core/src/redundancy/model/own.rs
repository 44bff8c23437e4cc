//! Faults that the samples of a unit show by themselves: silence, repetition, noise, loss.

use super::motion::MotionOfSet;
use super::table::{FLOOR, HOP_SECONDS, LOSSY_SCALE, MOVED, NOISY, REPEATS, SCALES, WHOLE};
use super::test::Exceedance;
use super::vibration::Vibration;
use super::window::UnitWindow;
use crate::real::{Real, count, real};
use crate::redundancy::components::larger;
use crate::redundancy::sensor::SENSORS;
use crate::sample::CHANNELS;

crate::vocabulary! {
    /// Reason for which a unit is at fault.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Reason {
        /// It sends no samples while others do.
        Late = "late",
        /// It repeats its readings while others change.
        Frozen = "frozen",
        /// Its samples scatter more than usual and more than those of others.
        Noisy = "noisy",
        /// It loses too many samples.
        Lossy = "lossy",
        /// It disagrees with others, which agree.
        OutOfFamily = "out of family",
        /// Its error is none of a sound unit.
        OutOfLimits = "out of limits",
        /// It changed from rest to rest.
        Rest = "rest",
    }
}

/// Channels that may repeat, and all of them at one time.
const REPEATING: usize = CHANNELS + 1;

/// Own evidence of one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Own<T: Real> {
    /// Most equal readings in succession in health, then in this block and in the one before.
    repeated: [[u8; REPEATING]; 3],
    /// Readings of the set when the latest repetition of each channel began.
    began: [T; CHANNELS],
    /// Windows in succession in which the samples of each sensor were noisy.
    noisy: [u8; 2],
}

/// Windows and vibration of all units at one time.
pub struct Others<'a, T: Real, const UNITS: usize> {
    /// Window of each unit.
    pub windows: &'a [UnitWindow<T>; UNITS],
    /// s of silence after which each unit is late.
    pub late_after: &'a [T; UNITS],
    /// Scatter of this window over the usual, by sensor; zero of windows that are not whole.
    pub scatter: &'a [[T; 2]; UNITS],
    /// Units that count.
    pub is_active: &'a [bool; UNITS],
    /// Smallest change of the readings of each unit that is none of zero, by sensor, m/s^2 and rad/s.
    pub resolution: &'a [[T; 2]; UNITS],
    /// Motion of the set.
    pub motion: &'a MotionOfSet<T>,
    /// True if the set is at rest.
    pub is_rest: bool,
    /// Number of windows so far.
    pub windows_so_far: u32,
}

/// Repetitions of each channel, and of all at one time.
fn repetitions(repeated: &[u8; CHANNELS]) -> [u8; REPEATING] {
    let [a, b, c, d, e, f] = *repeated;
    let all = repeated.iter().fold(u8::MAX, |least, each| least.min(*each));
    [a, b, c, d, e, f, all]
}

impl<T: Real> Own<T> {
    /// Nothing is known.
    pub fn new() -> Self {
        Self {
            repeated: [[0; REPEATING]; 3],
            began: [T::zero(); CHANNELS],
            noisy: [0; 2],
        }
    }

    /// Takes a window, in which the set moved so.
    pub fn take(&mut self, repeated: &[u8; CHANNELS], motion: &MotionOfSet<T>) {
        let [_, block, _] = &mut self.repeated;
        for (most, now) in block.iter_mut().zip(repetitions(repeated)) {
            *most = (*most).max(now);
        }
        let readings = motion.readings();
        let channels = self.began.iter_mut().zip(repeated);
        for ((began, _), now) in channels
            .zip(readings.as_flattened())
            .filter(|((_, repeated), _)| **repeated == 0)
        {
            *began = *now;
        }
    }

    /// Learns from the block before, if it was calm, and begins the next.
    pub fn end_block(&mut self, was_calm: bool) {
        let [most, block, waiting] = &mut self.repeated;
        if was_calm {
            for (most, waiting) in most.iter_mut().zip(*waiting) {
                *most = (*most).max(waiting);
            }
        }
        (*waiting, *block) = (*block, [0; REPEATING]);
    }

    /// Faults of one of several units, by reason: late, frozen, noisy, with the scatter, and lossy, with the share of windows that lack samples (docs/theory/set.md,
    /// section 7).
    pub fn faults<const UNITS: usize>(
        &mut self,
        unit: usize,
        vibration: &Vibration<T>,
        at: &Others<'_, T, UNITS>,
    ) -> [Option<(Reason, Option<Exceedance<T>>)>; 4] {
        let noise = self.noise(unit, at);
        [
            at.is_late(unit).then_some((Reason::Late, None)),
            self.is_frozen(unit, at).then_some((Reason::Frozen, None)),
            noise.map(|noise| (Reason::Noisy, Some(noise))),
            loss(vibration, at.windows_so_far).map(|loss| (Reason::Lossy, Some(loss))),
        ]
    }

    /// Tests whether all channels repeat beside units that change, or one although the set moves by more than its resolution.
    fn is_frozen<const UNITS: usize>(&self, unit: usize, at: &Others<'_, T, UNITS>) -> bool {
        let (Some(window), Some(resolution)) = (at.windows.get(unit), at.resolution.get(unit)) else {
            return false;
        };
        let (repeats, over_usual) = REPEATS;
        let [most, ..] = &self.repeated;
        let readings = at.motion.readings();
        let now = repetitions(&window.repeated);
        let too_often = |channel: usize| match (now.get(channel), most.get(channel)) {
            (Some(now), Some(most)) => *now >= repeats.max(most.saturating_mul(over_usual)),
            _ => false,
        };
        // Two units have one motion, of which a frozen one takes half away.
        let share = real::<T>(if UNITS == 2 { 0.5 } else { 1.0 });
        let has_to_change = |channel: usize| {
            let sensor = channel / 3;
            let least = larger(real::<T>(MOVED) * resolution[sensor], real(FLOOR[sensor]));
            let both = self.began.get(channel).zip(readings.as_flattened().get(channel));
            both.is_some_and(|(began, now)| (*now - *began).abs() > share * least)
        };
        let is_stuck =
            |channel: usize| too_often(channel) && has_to_change(channel) && at.moves(unit, channel);
        let any_moves = (0..CHANNELS).any(|channel| at.moves(unit, channel));
        (too_often(CHANNELS) && any_moves) || (0..CHANNELS).any(is_stuck)
    }

    /// Scatter of a sensor that has been too large for some windows.
    fn noise<const UNITS: usize>(&mut self, unit: usize, at: &Others<'_, T, UNITS>) -> Option<Exceedance<T>> {
        let mut found = None;
        let (over_usual, over_others, [in_motion, at_rest]) = NOISY;
        let windows = if at.is_rest { at_rest } else { in_motion };
        for ((sensor, which), noisy) in SENSORS.into_iter().enumerate().zip(&mut self.noisy) {
            let of = |number: usize| {
                at.scatter
                    .get(number)
                    .map_or(T::zero(), |ratios| ratios[sensor].square_root())
            };
            let others = (0..UNITS).filter(|other| *other != unit && at.is_active.get(*other) == Some(&true));
            let loudest = others.fold(T::one(), |loudest, other| larger(loudest, of(other)));
            let ratio = of(unit) / larger(real(over_usual), real::<T>(over_others) * loudest);
            *noisy = if ratio > T::one() {
                noisy.saturating_add(1)
            } else {
                0
            };
            if *noisy >= windows {
                let scatter = at
                    .windows
                    .get(unit)
                    .map_or(T::zero(), |window| window.scatter[sensor]);
                found = Some(Exceedance {
                    ratio,
                    apart: scatter.square_root(),
                    sensor: which,
                    seconds: count::<T>(windows.into()) * real(HOP_SECONDS),
                });
            }
        }
        found
    }
}

impl<T: Real> Default for Own<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const UNITS: usize> Others<'_, T, UNITS> {
    /// Tests whether a unit is silent while another one has just sent: a pause of all is the platform's.
    fn is_late(&self, unit: usize) -> bool {
        let silences = self.windows.iter().zip(self.late_after);
        let mut each = silences.clone().map(|(window, after)| (window.silence, *after));
        let has_sent = each.clone().any(|(silence, after)| silence < after * real(0.5));
        has_sent && each.nth(unit).is_some_and(|(silence, after)| silence > after)
    }

    /// Tests whether a channel changes in any other unit.
    fn moves(&self, unit: usize, channel: usize) -> bool {
        let (repeats, _) = REPEATS;
        let others = self.windows.iter().zip(self.late_after).enumerate();
        others
            .filter(|(other, _)| *other != unit)
            .any(|(_, (window, after))| {
                let repeated = window.repeated.get(channel).copied().unwrap_or(u8::MAX);
                repeated < repeats / 2 && window.silence < *after
            })
    }
}

/// Share of windows that lack samples, if it is too large.
fn loss<T: Real>(vibration: &Vibration<T>, windows: u32) -> Option<Exceedance<T>> {
    let scale = SCALES.get(LOSSY_SCALE).copied().unwrap_or(u16::MAX);
    let [sensor, _] = SENSORS;
    let lost = T::one() - vibration.whole_share(LOSSY_SCALE);
    let ratio = lost / real(1.0 - WHOLE);
    let lasts = windows >= 2 * u32::from(scale);
    (lasts && ratio > T::one()).then(|| Exceedance {
        ratio,
        apart: lost,
        sensor,
        seconds: count::<T>(scale.into()) * real(HOP_SECONDS),
    })
}
