//! One unit's samples, less those that cannot be used, and means of them over windows.

use nalgebra::{SVector, Vector3};

use crate::sensor_range::{NEAR_END, PILED_UP, SMALLEST_RANGE};

/// Rate and specific force.
pub const MEASURED: usize = 6;

/// The same, and the six different products of two rates: xx, xy, xz, yy, yz, zz.
pub const WITH_PRODUCTS: usize = 12;

/// A step in time longer than so many usual ones is a gap.
const LONGEST_STEP: f64 = 2.5;

/// Windows that any log may be cut into, however few its samples are.
const FEWEST: usize = 1 << 14;

/// The samples of one unit, by its own clock.
#[derive(Clone, Debug)]
pub struct UnitSamples<'a> {
    time: &'a [f64],
    force: &'a [[f64; 3]],
    rate: &'a [[f64; 3]],
    /// True for each sample if the step that begins with it may be used.
    sound: Vec<bool>,
    /// Usual time between two samples, s.
    pub interval: f64,
    /// Samples with a channel at the end of its range.
    pub saturated: usize,
    /// Samples with a channel that is not a number.
    pub not_finite: usize,
}

/// Means over one window. The window is long, but two in a row make a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowMoments<const N: usize> {
    /// Mean.
    pub mean: SVector<f64, N>,
    /// First moment about the middle, over the square of the length.
    pub moment: SVector<f64, N>,
}

/// Means under a triangle over two windows in a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle<const N: usize> {
    /// Mean (docs/theory/align.md, eq. 2).
    pub mean: SVector<f64, N>,
    /// Mean of the derivative in time (docs/theory/align.md, eq. 3).
    pub slope: SVector<f64, N>,
    /// Mean of the second derivative under a cubic bell over the same windows (docs/theory/align.md, eq. 19).
    pub curvature: SVector<f64, N>,
    /// Mean of the third derivative under a quartic bell over the same windows (docs/theory/align.md, eq. 19).
    pub jerk: SVector<f64, N>,
}

impl<const N: usize> WindowMoments<N> {
    /// The same window with the specific force of another.
    pub fn with_force_of(mut self, other: &Self) -> Self {
        for channel in 3..MEASURED {
            self.mean[channel] = other.mean[channel];
            self.moment[channel] = other.moment[channel];
        }
        self
    }
}

impl<const N: usize> Triangle<N> {
    /// Over a window and the following one, both `length` s long.
    pub fn over(first: &WindowMoments<N>, second: &WindowMoments<N>, length: f64) -> Self {
        let (rise, moments) = (second.mean - first.mean, first.moment + second.moment);
        Self {
            mean: (first.mean + second.mean) * 0.5 + first.moment - second.moment, // eq. 2
            slope: rise / length,                                                  // eq. 3
            curvature: (second.moment - first.moment) * (12.0 / length.powi(2)),   // eq. 19
            jerk: (moments * 90.0 - rise * 15.0) / length.powi(3),                 // eq. 19
        }
    }
}

impl<'a> UnitSamples<'a> {
    /// Judges every sample; the three slices are of one length, times ascend.
    pub fn new(time: &'a [f64], force: &'a [[f64; 3]], rate: &'a [[f64; 3]]) -> Self {
        let interval = usual_step(time);
        let ranges = [0, 1].map(|triad| {
            let rows = if triad == 0 { force } else { rate };
            core::array::from_fn::<_, 3, _>(|axis| range(rows, axis, SMALLEST_RANGE[triad]))
        });
        let at_end = |i: usize| {
            let reached = |y: &[f64; 3], ends: &[(f64, f64); 3]| {
                y.iter().zip(ends).any(|(y, (low, high))| y <= low || y >= high)
            };
            reached(&force[i], &ranges[0]) || reached(&rate[i], &ranges[1])
        };
        let finite = |i: usize| time[i].is_finite() && force[i].iter().chain(&rate[i]).all(|y| y.is_finite());
        let saturated: Vec<bool> = (0..time.len()).map(at_end).collect();
        let usable: Vec<bool> = (0..time.len()).map(|i| finite(i) && !saturated[i]).collect();
        let longest = LONGEST_STEP * interval;
        let sound = (1..time.len())
            .map(|i| usable[i - 1] && usable[i] && (0.0..=longest).contains(&(time[i] - time[i - 1])))
            .collect();
        Self {
            time,
            force,
            rate,
            sound,
            interval,
            saturated: saturated.iter().filter(|found| **found).count(),
            not_finite: (0..time.len()).filter(|i| !finite(*i)).count(),
        }
    }

    /// First and last time, s; zero where there are no samples.
    pub fn span(&self) -> (f64, f64) {
        (
            self.time.first().copied().unwrap_or(0.0),
            self.time.last().copied().unwrap_or(0.0),
        )
    }

    /// The longest step in time: when it begins, s from the first sample, and its length, s; `None` where windows of a length are
    /// no more than its samples, or few.
    pub fn leap(&self, length: f64) -> Option<(f64, f64)> {
        let (first, last) = self.span();
        #[allow(clippy::cast_precision_loss)]
        let most = self.time.len().max(FEWEST) as f64 * length;
        let steps = self
            .time
            .windows(2)
            .map(|pair| (pair[0] - first, pair[1] - pair[0]));
        let longest = steps.max_by(|one, other| one.1.total_cmp(&other.1));
        longest.filter(|_| last - first > most)
    }

    /// Means of rate and specific force over windows from each edge to the next; ascending edges, the unit's own clock.
    pub fn windows(&self, edges: &[f64]) -> Vec<Option<WindowMoments<MEASURED>>> {
        self.means(edges, |i| {
            let (w, f) = (self.rate[i], self.force[i]);
            SVector::from([w[0], w[1], w[2], f[0], f[1], f[2]])
        })
    }

    /// The same, with the products of rates: formed sample by sample, so that they are filtered like the rest.
    pub fn windows_with_products(&self, edges: &[f64]) -> Vec<Option<WindowMoments<WITH_PRODUCTS>>> {
        self.means(edges, |i| {
            let (w, f) = (self.rate[i], self.force[i]);
            SVector::from([
                w[0],
                w[1],
                w[2],
                f[0],
                f[1],
                f[2],
                w[0] * w[0],
                w[0] * w[1],
                w[0] * w[2],
                w[1] * w[1],
                w[1] * w[2],
                w[2] * w[2],
            ])
        })
    }

    /// Integrals of the smooth curve through the samples; none over windows that hold a step that is not sound.
    fn means<const N: usize>(
        &self,
        edges: &[f64],
        sample: impl Fn(usize) -> SVector<f64, N>,
    ) -> Vec<Option<WindowMoments<N>>> {
        let mut step = 0;
        edges
            .windows(2)
            .map(|pair| {
                let (start, end) = (pair[0], pair[1]);
                if !(start >= self.span().0 && end <= self.span().1) {
                    return None;
                }
                while step + 1 < self.sound.len() && self.time[step + 1] <= start {
                    step += 1;
                }
                self.mean(step, start, end, &sample)
            })
            .collect()
    }

    fn mean<const N: usize>(
        &self,
        mut step: usize,
        start: f64,
        end: f64,
        sample: &impl Fn(usize) -> SVector<f64, N>,
    ) -> Option<WindowMoments<N>> {
        let (middle, length) = (0.5 * (start + end), end - start);
        let (mut sum, mut moment) = (SVector::zeros(), SVector::zeros());
        while step < self.sound.len() && self.time[step] < end {
            if !self.sound[step] {
                return None;
            }
            let duration = self.time[step + 1] - self.time[step];
            // Two samples with one time stamp have nothing between them.
            if duration > 0.0 {
                let share = |time: f64| ((time - self.time[step]) / duration).clamp(0.0, 1.0);
                let (of_one, of_share) = self.piece(step, sample).integrals(share(start), share(end));
                sum += of_one * duration;
                moment += (of_share * duration + of_one * (self.time[step] - middle)) * duration;
            }
            step += 1;
        }
        Some(WindowMoments {
            mean: sum / length,
            moment: moment / (length * length),
        })
    }

    /// The cubic through two samples whose slopes at both are those of the parabolas through their neighbours: a
    /// polygon takes a thousandth off a motion of 2 Hz at 100 Hz, which units at different rates would not share.
    fn piece<const N: usize>(&self, step: usize, sample: &impl Fn(usize) -> SVector<f64, N>) -> Cubic<N> {
        let (y, next) = (sample(step), sample(step + 1));
        let duration = self.time[step + 1] - self.time[step];
        let rise = next - y;
        let bent = |neighbour: Option<usize>, rise_beyond: &dyn Fn(usize) -> SVector<f64, N>| {
            let beyond = neighbour.filter(|other| self.sound.get(*other).copied().unwrap_or(false));
            let Some(other) = beyond else { return rise };
            let other_duration = self.time[other + 1] - self.time[other];
            if other_duration <= 0.0 {
                return rise;
            }
            let slope = rise_beyond(other) * (duration / other_duration);
            (slope * duration + rise * other_duration) / (duration + other_duration)
        };
        let first = bent(step.checked_sub(1), &|before| y - sample(before));
        let last = bent(Some(step + 1), &|after| sample(after + 1) - next);
        Cubic([
            y,
            first,
            rise * 3.0 - first * 2.0 - last,
            first + last - rise * 2.0,
        ])
    }
}

/// Coefficients of a cubic in the share of a step.
struct Cubic<const N: usize>([SVector<f64, N>; 4]);

impl<const N: usize> Cubic<N> {
    /// Integrals of the cubic, and of the cubic times the share, between two shares.
    fn integrals(&self, from: f64, to: f64) -> (SVector<f64, N>, SVector<f64, N>) {
        let (mut of_one, mut of_share) = (SVector::zeros(), SVector::zeros());
        let (mut low, mut high) = (from, to);
        for (coefficient, power) in self.0.iter().zip([1.0, 2.0, 3.0, 4.0]) {
            of_one += coefficient * ((high - low) / power);
            (low, high) = (low * from, high * to);
            of_share += coefficient * ((high - low) / (power + 1.0));
        }
        (of_one, of_share)
    }
}

/// The first three channels.
pub fn rate_of<const N: usize>(channels: &SVector<f64, N>) -> Vector3<f64> {
    Vector3::new(channels[0], channels[1], channels[2])
}

/// The next three channels.
pub fn force_of<const N: usize>(channels: &SVector<f64, N>) -> Vector3<f64> {
    Vector3::new(channels[3], channels[4], channels[5])
}

/// The step that nineteen of twenty do not exceed: stamps that come in bursts have a median near zero.
fn usual_step(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.retain(|step| step.is_finite());
    if steps.is_empty() {
        return 0.0;
    }
    let most = (steps.len() * 19 / 20).min(steps.len() - 1);
    let (_, usual, _) = steps.select_nth_unstable_by(most, f64::total_cmp);
    *usual
}

/// Lowest and highest value that a channel can read, infinite where it did not get there.
fn range(rows: &[[f64; 3]], axis: usize, smallest: f64) -> (f64, f64) {
    let end = |sign: f64| {
        let readings = || rows.iter().map(|row| sign * row[axis]).filter(|y| y.is_finite());
        let extreme = readings().fold(smallest, f64::max);
        let at = readings().filter(|y| *y == extreme).count();
        let at_or_near = readings().filter(|y| *y >= NEAR_END * extreme).count();
        let piled_up = extreme > smallest && at >= PILED_UP as usize && 2 * at > at_or_near;
        if piled_up {
            sign * extreme
        } else {
            sign * f64::INFINITY
        }
    };
    (end(-1.0), end(1.0))
}
