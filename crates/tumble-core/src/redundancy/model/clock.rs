//! Clock of a secondary beside the primary's: a delay and its rate, from angular rates of windows.
//!
//! The first span finds the delay among whole windows, every later one corrects it and its rate by least squares along the
//! derivative, beside a matrix and a bias (docs/theory/set.md, section 8). A span that contradicts them is left out: a clock that jumps, or a fault, is
//! no drift.

use super::table::{
    APPLIED, CLOCK_SIGMAS, CONTRADICTED, HOP, HOP_SECONDS, SHARED, SHOWN, SIGMAS, SIGNIFICANT, SPANS,
    UNCALIBRATED,
};
use super::triangle::InformationTriangle;
use super::window::UnitWindow;
use crate::real::{Real, count, real, seconds};
use crate::redundancy::components::larger;
use crate::redundancy::optional_time::OptionalTime;

/// Windows: largest delay that is sought, and beyond it by one.
const SOUGHT: usize = 3;
/// Delays that are tried.
const TRIED: usize = 2 * SOUGHT + 1;
/// Windows that overlap count as so many fewer.
const CORRELATED: f64 = 2.0;

/// Angular rate of a window, if it is whole, rad/s.
type WholeRate<T> = Option<[T; 3]>;

/// Delay along a line: s, s a second, and the time of the delay.
#[derive(Clone, Copy, Debug, PartialEq)]
struct DelayLine<T: Real> {
    delay: T,
    rate: T,
    at: u64,
}

impl<T: Real> DelayLine<T> {
    fn delay_at(&self, time: u64) -> T {
        self.delay + self.rate * since(time, self.at)
    }
}

/// Scatter of vectors about their mean.
#[derive(Clone, Copy, Debug, PartialEq)]
struct VectorScatter<T: Real> {
    vectors: u16,
    sum: [T; 3],
    squares: T,
}

impl<T: Real> VectorScatter<T> {
    fn none() -> Self {
        Self {
            vectors: 0,
            sum: [T::zero(); 3],
            squares: T::zero(),
        }
    }

    fn take(&mut self, vector: [T; 3]) {
        self.vectors = self.vectors.saturating_add(1);
        for (sum, value) in self.sum.iter_mut().zip(vector) {
            *sum += value;
            self.squares += value * value;
        }
    }

    /// Mean square; `None` where there are few.
    fn mean_square(&self, windows: u32) -> Option<T> {
        let share = T::one() / count(u32::from(self.vectors).max(1));
        let mean = self.sum.map(|sum| sum * share);
        (2 * u32::from(self.vectors) >= windows).then(|| self.squares * share - dot(&mean, &mean))
    }
}

/// Differences of rates by the delay that is tried, and the motion itself.
#[derive(Clone, Copy, Debug, PartialEq)]
struct DelaySearch<T: Real> {
    by_delay: [VectorScatter<T>; TRIED],
    motion: VectorScatter<T>,
}

/// Differences of rates and their derivatives, and what a matrix and a bias leave of both: without these, a turn of an axis
/// looks like a delay in motion that goes round (docs/theory/set.md, eq. 26).
#[derive(Clone, Copy, Debug, PartialEq)]
struct DelayFit<T: Real> {
    /// Rows of rates and 1, with differences and derivatives as right sides.
    explained: InformationTriangle<T, 4, 6, 34>,
    motion: VectorScatter<T>,
    /// Sums of squares of what is left of differences and of derivatives, and of the products of both.
    apart: T,
    along: T,
    products: T,
}

/// Sums of a span in which the delay is found, or corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SpanSums<T: Real> {
    DelaySearch(DelaySearch<T>),
    DelayFit(DelayFit<T>),
}

/// Clock of one secondary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock<T: Real> {
    /// The delay that is known, and the one by which samples are corrected.
    known: DelayLine<T>,
    applied: DelayLine<T>,
    /// us of the unit's own clock from which on the known one is applied.
    applies_from: OptionalTime,
    /// Variances of delay and rate, and what they share in between.
    variance: [T; 3],
    sigma: T,
    sums: SpanSums<T>,
    /// Number of the window with which the span begins, and of the one after it.
    span: [u32; 2],
    /// Rates of the last windows, primary and unit.
    before: [[WholeRate<T>; 2]; SOUGHT],
}

impl<T: Real> Clock<T> {
    /// Nothing is known.
    pub fn new() -> Self {
        let [unknown, _, _, crystal] = CLOCK_SIGMAS.map(real::<T>);
        let none = DelayLine {
            delay: T::zero(),
            rate: T::zero(),
            at: 0,
        };
        Self {
            known: none,
            applied: none,
            applies_from: OptionalTime::NONE,
            variance: [unknown * unknown, T::zero(), crystal * crystal],
            sigma: unknown,
            sums: SpanSums::finding(),
            span: [0, finding()],
            before: [[None; 2]; SOUGHT],
        }
    }

    /// s, 1 sigma of the delay.
    pub fn sigma(&self) -> T {
        self.sigma
    }

    /// Tests whether the delay is known well enough to learn from the unit.
    pub fn is_known(&self) -> bool {
        self.sigma < real(SIGNIFICANT)
    }

    /// Time of a sample by the clock of the primary, us.
    pub fn corrected(&mut self, time: u64) -> u64 {
        if self.applies_from.get().is_some_and(|from| time >= from) {
            (self.applied, self.applies_from) = (self.known, OptionalTime::NONE);
        }
        time.saturating_add_signed(-self.applied.delay_at(time).microseconds())
    }

    /// Takes a window of the primary and of the unit: its number since the first, and in the grid.
    pub fn take(&mut self, number: u32, index: u64, primary: &UnitWindow<T>, unit: &UnitWindow<T>) {
        let [first, end] = self.span;
        if number == first {
            let [variance, ..] = self.variance;
            self.sigma = variance.square_root();
        }
        let rates = [primary, unit].map(|window| {
            let [_, _, _, x, y, z] = window.reading;
            window.is_whole.then_some([x, y, z])
        });
        if number >= first {
            match &mut self.sums {
                SpanSums::DelaySearch(found) => found.take(rates, &self.before),
                SpanSums::DelayFit(left) => left.take(rates, primary, unit),
            }
        }
        let [a, b, _] = self.before;
        self.before = [rates, a, b];
        if number.saturating_add(1) == end {
            self.end_span(number, index);
        }
    }

    /// Ends a span, and begins the next.
    fn end_span(&mut self, number: u32, index: u64) {
        let [first, end] = self.span;
        let middle = index
            .saturating_mul(HOP)
            .saturating_sub(u64::from(number.saturating_sub(first)) * (HOP / 2));
        let [_, after_first, later] = SPANS;
        let (is_known, length) = match self.sums {
            SpanSums::DelaySearch(found) => match found.delay() {
                Some(delay) => {
                    self.start(delay, middle);
                    (true, after_first)
                }
                None => (false, finding()),
            },
            SpanSums::DelayFit(left) => match left.delay(end.saturating_sub(first)) {
                Some((delay, sigma)) => {
                    self.correct(delay, sigma, middle);
                    (true, later)
                }
                None => (false, later),
            },
        };
        let mut begin = end;
        if is_known {
            let from = index.saturating_add(1 + u64::from(APPLIED));
            self.applies_from.replace(from.saturating_mul(HOP));
            begin = end.saturating_add(APPLIED + 1);
        }
        let is_found = is_known || matches!(self.sums, SpanSums::DelayFit(_));
        self.sums = if is_found {
            SpanSums::correcting()
        } else {
            SpanSums::finding()
        };
        self.span = [begin, begin.saturating_add(length)];
    }

    /// Takes the first delay, at a time.
    fn start(&mut self, delay: T, at: u64) {
        let [_, coarse, _, crystal] = CLOCK_SIGMAS.map(real::<T>);
        self.known = DelayLine {
            delay,
            rate: T::zero(),
            at,
        };
        self.variance = [coarse * coarse, T::zero(), crystal * crystal];
    }

    /// Takes the delay that is left in a span and its sigma, s, at a time (eq. 27).
    fn correct(&mut self, left: T, sigma: T, at: u64) {
        let seconds: T = since(at, self.known.at);
        let [mut delay, mut both, mut rate] = self.variance;
        delay += seconds * (both + both + seconds * rate);
        both += seconds * rate;
        let [_, _, least, _] = CLOCK_SIGMAS.map(real::<T>);
        let sigma = larger(sigma, least);
        let variance = delay + sigma * sigma;
        self.known = DelayLine {
            delay: self.known.delay_at(at),
            rate: self.known.rate,
            at,
        };
        let most = real::<T>(CONTRADICTED * CONTRADICTED) * variance;
        if left * left < most {
            let [first, second] = [delay / variance, both / variance];
            self.known.delay += first * left;
            self.known.rate += second * left;
            rate -= second * both;
            both -= first * both;
            delay -= first * delay;
        }
        self.variance = [delay, both, rate];
    }
}

impl<T: Real> Default for Clock<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> SpanSums<T> {
    fn finding() -> Self {
        Self::DelaySearch(DelaySearch {
            by_delay: [VectorScatter::none(); TRIED],
            motion: VectorScatter::none(),
        })
    }

    fn correcting() -> Self {
        let of_matrix = real::<T>(UNCALIBRATED.matrix);
        let [_, bias] = UNCALIBRATED.bias.map(real::<T>);
        let sigmas = [of_matrix, of_matrix, of_matrix, bias];
        Self::DelayFit(DelayFit {
            explained: InformationTriangle::independent(&[[T::zero(); 6]; 4], &sigmas),
            motion: VectorScatter::none(),
            apart: T::zero(),
            along: T::zero(),
            products: T::zero(),
        })
    }
}

impl<T: Real> DelaySearch<T> {
    fn take(&mut self, rates: [WholeRate<T>; 2], before: &[[WholeRate<T>; 2]; SOUGHT]) {
        let [wanted, given] = rates;
        if let Some(wanted) = wanted {
            self.motion.take(wanted);
        }
        for (tried, scatter) in self.by_delay.iter_mut().enumerate() {
            // Windows of the primary are held back for delays that are positive, and else those of the unit.
            let behind = tried.abs_diff(SOUGHT);
            let held = behind.checked_sub(1).and_then(|place| before.get(place));
            let (of_primary, of_unit) = match held {
                None => (wanted, given),
                Some([primary, _]) if tried > SOUGHT => (*primary, given),
                Some([_, unit]) => (wanted, *unit),
            };
            if let (Some(wanted), Some(given)) = (of_primary, of_unit) {
                scatter.take(minus(&given, &wanted));
            }
        }
    }

    /// s; `None` where no delay shows (eq. 25).
    #[allow(clippy::cast_possible_truncation)]
    fn delay(&self) -> Option<T> {
        let mut best: Option<(usize, T)> = None;
        for (tried, scatter) in self.by_delay.iter().enumerate() {
            if let Some(left) = scatter.mean_square(finding())
                && best.is_none_or(|(_, least)| left < least)
            {
                best = Some((tried, left));
            }
        }
        let (tried, least) = best?;
        let motion = self.motion.mean_square(finding())?;
        // Without motion that both share there is nothing to shift.
        if least > real::<T>(SHARED) * motion {
            return None;
        }
        let before = self.by_delay.get(tried.checked_sub(1)?)?.mean_square(finding())?;
        let after = self.by_delay.get(tried + 1)?.mean_square(finding())?;
        let curvature = before - least - least + after;
        let [_, coarse, ..] = CLOCK_SIGMAS.map(real::<T>);
        let vectors = count::<T>(finding()) - count(tried.abs_diff(SOUGHT) as u32);
        let variance = real::<T>(CORRELATED / 3.0 * 2.0 * HOP_SECONDS * HOP_SECONDS) * least;
        if variance > coarse * coarse * vectors * curvature {
            return None; // eq. 25a
        }
        let windows = count::<T>(tried as u32) - count(SOUGHT as u32);
        Some(real::<T>(HOP_SECONDS) * (windows + real::<T>(0.5) * (before - after) / curvature))
    }
}

impl<T: Real> DelayFit<T> {
    fn take(&mut self, rates: [WholeRate<T>; 2], primary: &UnitWindow<T>, unit: &UnitWindow<T>) {
        if let [Some(wanted), Some(given)] = rates {
            let half = real::<T>(0.5);
            let [_, _, _, a, b, c] = primary.change;
            let [_, _, _, x, y, z] = unit.change;
            let along = [(a + x) * half, (b + y) * half, (c + z) * half];
            let [_, sigma] = SIGMAS;
            let weight = real::<T>(1.0 / sigma);
            let mut row = [T::zero(); 10];
            let values = wanted.into_iter().chain([T::one()]);
            let values = values.chain(minus(&given, &wanted)).chain(along);
            row.iter_mut()
                .zip(values)
                .for_each(|(to, value)| *to = value * weight);
            self.explained.add(&mut row); // what is left stands in its right sides
            let [_, _, _, _, a, b, c, x, y, z] = row;
            let (apart, along) = ([a, b, c], [x, y, z]);
            self.apart += dot(&apart, &apart);
            self.along += dot(&along, &along);
            self.products += dot(&apart, &along);
            self.motion.take(wanted);
        }
    }

    /// s, and 1 sigma of it; `None` where the motion of so many windows is too little (eq. 26a).
    fn delay(&self, windows: u32) -> Option<(T, T)> {
        let [_, sigma] = SIGMAS;
        let variance = real::<T>(sigma * sigma);
        let vectors = count::<T>(self.motion.vectors.into());
        if self.apart * variance > real::<T>(SHARED) * vectors * self.motion.mean_square(windows)? {
            return None;
        }
        let along = larger(self.along, real(1e-6));
        let left = larger(self.apart - self.products * self.products / along, T::zero());
        // Noise of derivatives makes a delay too small.
        if along < real::<T>(SHOWN * 0.75 / (HOP_SECONDS * HOP_SECONDS)) * left {
            return None;
        }
        let sigma = (real::<T>(CORRELATED / 3.0) * left / (vectors * along)).square_root();
        (sigma < real(SIGNIFICANT)).then(|| (-self.products / along, sigma))
    }
}

/// Windows of a span in which a delay is found.
const fn finding() -> u32 {
    let [finding, ..] = SPANS;
    finding
}

/// s from one time to another, of either sign.
fn since<T: Real>(time: u64, before: u64) -> T {
    if time >= before {
        seconds(time - before)
    } else {
        -seconds::<T>(before - time)
    }
}

fn minus<T: Real>([a, b, c]: &[T; 3], [x, y, z]: &[T; 3]) -> [T; 3] {
    [*a - *x, *b - *y, *c - *z]
}

fn dot<T: Real>([a, b, c]: &[T; 3], [x, y, z]: &[T; 3]) -> T {
    *a * *x + *b * *y + *c * *z
}
