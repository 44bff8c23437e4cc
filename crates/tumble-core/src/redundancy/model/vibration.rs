//! Vibration of the set over its usual: it raises the noise of all pairs, and no unit may raise it alone.

use super::means::{LeakyMean, LeakyMeans};
use super::motion::MotionOfSet;
use super::table::{BLOCK, BLOCK_SCALE, BLOCK_SECONDS, COUNT, LEARNT_SECONDS, LEAST_NOISE, LEAST_SCATTER};
use super::window::UnitWindow;
use crate::real::{Real, real};
use crate::redundancy::components::{larger, smaller};
use crate::sample::CHANNELS;

/// Variances of a unit that are usual, by sensor; zero before any is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Usual<T: Real>([T; 2]);

impl<T: Real> Usual<T> {
    /// Nothing is usual.
    pub fn none() -> Self {
        Self([T::zero(); 2])
    }

    /// Tests whether something is usual.
    pub fn is_known(&self) -> bool {
        let [force, _] = self.0;
        force > T::zero()
    }

    /// Variances over the usual ones, no less than the least standard deviations; 1 before anything is usual.
    pub fn ratio(&self, variances: &[T; 2], least: [f64; 2]) -> [T; 2] {
        let mut ratios = *variances;
        for ((ratio, usual), least) in ratios.iter_mut().zip(&self.0).zip(least) {
            *ratio = if *usual > T::zero() {
                *ratio / larger(*usual, real(least * least))
            } else {
                T::one()
            };
        }
        ratios
    }

    /// Moves towards the variances of a block.
    pub fn learn(&mut self, variances: &[T; 2]) {
        let [_, _, seconds] = LEARNT_SECONDS;
        for (usual, variance) in self.0.iter_mut().zip(variances) {
            let share = if *usual > T::zero() {
                real(BLOCK_SECONDS / seconds)
            } else {
                T::one()
            };
            *usual += share * (*variance - *usual);
        }
    }
}

/// Second differences of one series of windows of a unit, which contain neither a constant fault nor a ramp.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Swings<T: Real> {
    before: [[T; CHANNELS]; 2],
    mean: LeakyMean<T, 2>,
    usual: Usual<T>,
}

impl<T: Real> Swings<T> {
    fn none() -> Self {
        Self {
            before: [[T::zero(); CHANNELS]; 2],
            mean: LeakyMean::new(),
            usual: Usual::none(),
        }
    }

    /// Takes the values of a window; two before it have to be known (docs/theory/set.md, eq. 19).
    fn take(&mut self, values: &[T; CHANNELS], windows: u32, are_whole: bool) {
        let [last, oldest] = self.before;
        if windows > 1 {
            let mut squares = [T::zero(); 2];
            for (channel, ((now, last), oldest)) in values.iter().zip(last).zip(oldest).enumerate() {
                let second = *now - last - last + oldest;
                if let Some(sum) = squares.get_mut(channel / 3) {
                    *sum += second * second * real(1.0 / 18.0);
                }
            }
            self.mean.take(are_whole.then_some(&squares), BLOCK.into());
        }
        self.before = [*values, last];
    }
}

/// Vibration of one unit: of its samples, and of its windows, which sampled slower than they swing look slow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vibration<T: Real> {
    /// Deviation from the set, and the readings themselves: two units have one deviation.
    swings: [Swings<T>; 2],
    whole: [bool; 2],
    scatter: LeakyMeans<T, 2>,
    /// Scatter of samples in motion and at rest.
    usual: [Usual<T>; 2],
}

impl<T: Real> Vibration<T> {
    /// Nothing is known.
    pub fn new() -> Self {
        Self {
            swings: [Swings::none(); 2],
            whole: [false; 2],
            scatter: LeakyMeans::new(),
            usual: [Usual::none(); 2],
        }
    }

    /// Takes a window, of which there were so many before; one that no unit has is a pause of the platform, and no loss.
    pub fn take(&mut self, window: &UnitWindow<T>, motion: &MotionOfSet<T>, windows: u32, is_pause: bool) {
        let mut deviation = window.reading;
        let [force, rate] = motion.readings();
        for (value, of_set) in deviation.iter_mut().zip(force.iter().chain(&rate)) {
            *value -= *of_set;
        }
        let [last, oldest] = self.whole;
        let are_whole = window.is_whole && last && oldest;
        for (swings, values) in self.swings.iter_mut().zip([&deviation, &window.reading]) {
            swings.take(values, windows, are_whole);
        }
        self.whole = [window.is_whole, last];
        if !is_pause {
            self.scatter.take(window.is_whole.then_some(&window.scatter));
        }
    }

    /// Share of the windows of a scale that were whole.
    pub fn whole_share(&self, scale: usize) -> T {
        self.scatter
            .scales()
            .get(scale)
            .map_or(T::zero(), LeakyMean::weight)
    }

    /// Scatter that is usual in motion, or at rest before any motion.
    fn usual_scatter(&self) -> &Usual<T> {
        let [motion, rest] = &self.usual;
        if motion.is_known() { motion } else { rest }
    }

    /// Scatter of the samples of one window over what is usual at rest or in motion; 1 before that is learnt, as units whose
    /// filters differ do not feel one vibration alike.
    pub fn scatter_ratio(&self, scatter: &[T; 2], is_rest: bool) -> [T; 2] {
        let [motion, rest] = &self.usual;
        let usual = if is_rest { rest } else { motion };
        usual.ratio(scatter, LEAST_SCATTER)
    }

    /// Variances over their usual: of samples over a scale, and of windows (eq. 20).
    pub fn ratios(&self, scale: usize, is_pair: bool) -> [[T; 2]; 2] {
        let scatter = self
            .scatter
            .scales()
            .get(scale)
            .map_or([T::zero(); 2], LeakyMean::mean);
        let of = |swings: &Swings<T>| swings.usual.ratio(&swings.mean.mean(), LEAST_NOISE);
        let [deviation, reading] = &self.swings;
        let mut windows = of(deviation);
        if is_pair {
            for (ratio, own) in windows.iter_mut().zip(of(reading)) {
                *ratio = smaller(*ratio, own);
            }
        }
        [self.usual_scatter().ratio(&scatter, LEAST_SCATTER), windows]
    }

    /// Learns what is usual from a block: the scatter, if it was one of rest or one of motion.
    pub fn learn(&mut self, was_rest: bool, was_motion: bool) {
        let [motion, _] = &self.usual;
        for swings in &mut self.swings {
            if was_motion && !motion.is_known() {
                swings.usual = Usual::none();
            }
            if was_motion || !motion.is_known() {
                swings.usual.learn(&swings.mean.mean());
            }
        }
        if let Some(scatter) = self.scatter.scales().get(BLOCK_SCALE)
            && scatter.weight() > T::zero()
        {
            for (usual, was_so) in self.usual.iter_mut().zip([was_motion, was_rest]) {
                if was_so {
                    usual.learn(&scatter.mean());
                }
            }
        }
    }
}

impl<T: Real> Default for Vibration<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// Factor by which vibration raises the variances of all pairs, by scale and sensor: the second smallest of the ratios of
/// active units, or the smallest of two (eq. 20).
pub fn of_set<T: Real, const UNITS: usize>(
    units: [&Vibration<T>; UNITS],
    is_active: &[bool; UNITS],
) -> [[T; 2]; COUNT] {
    let active = is_active.iter().filter(|active| **active).count();
    let which = usize::from(active > 2);
    let mut factors = [[T::one(); 2]; COUNT];
    for (scale, factors) in factors.iter_mut().enumerate() {
        let mut least = [[[None; 2]; 2]; 2];
        for (unit, _) in units.iter().zip(is_active).filter(|(_, active)| **active) {
            let ratios = unit.ratios(scale, UNITS == 2);
            for (least, ratio) in least.as_flattened_mut().iter_mut().zip(ratios.as_flattened()) {
                keep_two(least, *ratio);
            }
        }
        let of_samples_and_windows = least.map(|kinds| kinds.map(|two| two.get(which).copied().flatten()));
        for ratios in of_samples_and_windows {
            for (factor, ratio) in factors.iter_mut().zip(ratios) {
                *factor = larger(*factor, ratio.unwrap_or(T::one()));
            }
        }
    }
    factors
}

/// Keeps the two smallest values, the smallest first.
fn keep_two<T: Real>([first, second]: &mut [Option<T>; 2], value: T) {
    match *first {
        Some(least) if value >= least => {
            if second.is_none_or(|other| value < other) {
                *second = Some(value);
            }
        }
        _ => {
            *second = *first;
            *first = Some(value);
        }
    }
}
