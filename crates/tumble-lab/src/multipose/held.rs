//! Rests in the hand: a unit that trembles keeps its mean orientation (docs/theory/multipose.md, section 9).
//!
//! Means over windows with soft edges do not see a tremor of some hertz. Where they stay, the unit rested; how far they
//! scatter is how uncertain its mean is.

use nalgebra::{UnitQuaternion, Vector3};
use tumble_core::noise::Noise;
use tumble_core::real::seconds;
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::SegmenterSettings;
use tumble_core::soft_mean::rise;

use super::rest_selection::BY_HAND;
use super::samples::MultiposeSamples;
use crate::acquisition::{Restlessness, Tremor};
use crate::distributions::median;

/// Half the length of a window, and the length of the edges of a rest, s.
const EDGE: f64 = 0.4;

/// From one window to the next while rests are sought, s.
const STEP: f64 = 0.1;

/// Root mean square of the angular rate about its mean, rad/s, beyond which nobody holds a unit still.
const SHAKEN: f64 = 0.2;

/// Angular rate, rad/s, by which a rest may differ from the median of all: beyond it the unit turned about the vertical.
const TURNING: f64 = 0.02;

/// Amplitude of the angular rate, rad/s, from which a rest is one that trembles, and over the sample noise.
const TREMBLES: (f64, f64) = (2e-3, 1.0);

/// Windows of all rests count as so many of one's own.
const POOLED: f64 = 4.0;

/// Lag of the autocorrelation that shows amplitude and frequency of a tremor, s: a sixth of its fastest period.
const LAG: f64 = 0.015;

/// Length, s, of a plain mean that white noise varies as much as the mean of a window: `(int b)^2 / int b^2`.
const WINDOW: f64 = EDGE * 35.0 / 26.0;

/// Channels of a sample.
fn channels(samples: &MultiposeSamples<'_>, k: usize) -> [f64; CHANNELS] {
    let ([fx, fy, fz], [wx, wy, wz]) = (samples.force[k], samples.rate[k]);
    [fx, fy, fz, wx, wy, wz]
}

/// Soft edge that is held beyond its ends.
fn edge(x: f64) -> f64 {
    rise(x.clamp(0.0, 1.0)) // eq. 33
}

/// First sample and the one after the last of a stretch in which the unit kept its mean orientation.
pub type HeldSpan = (usize, usize);

/// Middle of a window, s, where the first sample is at `first`.
#[allow(clippy::cast_precision_loss)]
fn middle_of(window: usize, first: f64) -> f64 {
    first + EDGE + STEP * window as f64
}

/// Number of whole steps in so many s.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn window_at(time: f64) -> usize {
    (time / STEP).max(0.0) as usize
}

/// Windows that samples lie in, in order: a gap costs nothing, however long it is.
fn sampled_windows(time: &[f64], first: f64) -> impl Iterator<Item = usize> {
    let mut next = 0;
    time.iter().flat_map(move |time| {
        let (from, to) = (window_at(time - first - 2.0 * EDGE), window_at(time - first) + 1);
        let begin = next.max(from);
        next = begin.max(to);
        begin..next
    })
}

/// All stretches, `shortest` s or longer, in which the unit kept its mean orientation, whether or not it trembled.
#[must_use]
pub fn held_spans(samples: &MultiposeSamples<'_>, shortest: f64) -> Vec<HeldSpan> {
    let (Some(first), Some(last)) = (samples.time.first(), samples.time.last()) else {
        return Vec::new();
    };
    let noise = sample_noise(samples);
    let limits = SegmenterSettings::<f64>::default().stillness;
    let last = window_at(last - first - 2.0 * EDGE);
    let windows: Vec<_> = sampled_windows(samples.time, *first)
        .take_while(|k| *k < last)
        .map(|k| (k, HeldWindow::about(samples, middle_of(k, *first))))
        .collect();
    let stays = |rest: &HeldWindow, window: &HeldWindow| {
        let within = |from: usize, drift: f64| {
            let apart = |i: usize| (rest.mean[i] - window.mean[i]).powi(2);
            let noise = |i: usize| noise[i].powi(2) / window.samples;
            let sum = |of: &dyn Fn(usize) -> f64| (from..from + 3).map(of).sum::<f64>().sqrt();
            sum(&apart) <= BY_HAND * drift + limits.sigmas * sum(&noise)
        };
        within(0, limits.specific_force_drift) && within(3, limits.angular_rate_drift)
    };
    let mut spans = Vec::new();
    let mut k = 0;
    while k < windows.len() {
        let (number, window) = &windows[k];
        let Some(begun) = window.as_ref().filter(|window| window.calm()) else {
            k += 1;
            continue;
        };
        let mut rest = begun.clone();
        let mut end = k + 1;
        while let Some((following, Some(window))) = windows.get(end) {
            if *following != number + (end - k) || !window.calm() || !stays(&rest, window) {
                break;
            }
            rest.merge(window);
            end += 1;
        }
        let span = trimmed(samples, (rest.first, rest.end));
        if span.0 < span.1 && samples.time[span.1 - 1] - samples.time[span.0] >= shortest {
            spans.push(span);
            // The next rest shares no window with this one.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let apart = (2.0 * EDGE / STEP) as usize;
            k = end + apart - 1;
        } else {
            k += 1;
        }
    }
    without_turns(samples, spans, &noise)
}

/// Without its ends, over which a window weighs too little to show that the unit moved.
fn trimmed(samples: &MultiposeSamples<'_>, (first, end): HeldSpan) -> HeldSpan {
    let (from, to) = (
        samples.time[first] + 0.5 * EDGE,
        samples.time[end - 1] - 0.5 * EDGE,
    );
    let from = samples.time.partition_point(|t| *t < from);
    (from, samples.time.partition_point(|t| *t <= to).max(from))
}

/// Leaves out what differs in its rate from all others: a turn about the vertical leaves gravity where it is.
fn without_turns(
    samples: &MultiposeSamples<'_>,
    spans: Vec<HeldSpan>,
    noise: &[f64; CHANNELS],
) -> Vec<HeldSpan> {
    let rates: Vec<_> = spans
        .iter()
        .map(|span| {
            let [_, _, _, x, y, z] = soft_mean(samples, *span);
            Vector3::new(x, y, z)
        })
        .collect();
    let usual = Vector3::from_fn(|i, _| {
        let mut values: Vec<f64> = rates.iter().map(|rate| rate[i]).collect();
        median(&mut values).unwrap_or(0.0)
    });
    let limit = TURNING + libm::hypot(libm::hypot(noise[3], noise[4]), noise[5]);
    let each = spans.into_iter().zip(rates);
    each.filter(|(_, rate)| (rate - usual).norm() < limit)
        .map(|(span, _)| span)
        .collect()
}

/// Noise of single samples of each channel, from second differences, of which slow motion takes no part.
fn sample_noise(samples: &MultiposeSamples<'_>) -> [f64; CHANNELS] {
    let n = samples.time.len();
    std::array::from_fn(|i| {
        let bend = |k: usize| {
            let [a, b, c] = [k, k + 1, k + 2].map(|k| channels(samples, k)[i]);
            (a - 2.0 * b + c).abs()
        };
        let mut bends: Vec<f64> = (0..n.saturating_sub(2)).map(bend).collect();
        median(&mut bends).unwrap_or(0.0) / 0.6745 / 6.0_f64.sqrt()
    })
}

/// Means over a window with soft edges, or over several.
#[derive(Clone)]
struct HeldWindow {
    first: usize,
    end: usize,
    mean: [f64; CHANNELS],
    /// Number of samples that would have a mean as certain.
    samples: f64,
    /// Mean square of the angular rate about its mean, (rad/s)^2.
    shaking: f64,
    windows: f64,
}

impl HeldWindow {
    fn about(samples: &MultiposeSamples<'_>, centre: f64) -> Option<Self> {
        let first = samples.time.partition_point(|t| *t < centre - EDGE);
        let end = samples.time.partition_point(|t| *t < centre + EDGE);
        if end - first < 4 {
            return None;
        }
        let (mut sum, mut squares, mut total, mut weights) = ([0.0; CHANNELS], 0.0, 0.0, 0.0);
        for k in first..end {
            let weight = edge(1.0 - (samples.time[k] - centre).abs() / EDGE);
            let y = channels(samples, k);
            for (sum, y) in sum.iter_mut().zip(y) {
                *sum += weight * y;
            }
            total += weight * (y[3] * y[3] + y[4] * y[4] + y[5] * y[5]);
            weights += weight;
            squares += weight * weight;
        }
        let mean = sum.map(|sum| sum / weights);
        let of_mean = mean[3] * mean[3] + mean[4] * mean[4] + mean[5] * mean[5];
        Some(Self {
            first,
            end,
            mean,
            samples: weights * weights / squares,
            shaking: total / weights - of_mean,
            windows: 1.0,
        })
    }

    fn calm(&self) -> bool {
        self.shaking < SHAKEN * SHAKEN
    }

    fn merge(&mut self, next: &Self) {
        self.windows += 1.0;
        for (mean, next) in self.mean.iter_mut().zip(next.mean) {
            *mean += (next - *mean) / self.windows;
        }
        self.end = next.end;
    }
}

/// Weights of a rest: one, but for its edges.
fn weights<'a>(samples: &'a MultiposeSamples<'_>, (first, end): HeldSpan) -> impl Iterator<Item = f64> + 'a {
    let (from, to) = (samples.time[first], samples.time[end - 1]);
    samples.time[first..end]
        .iter()
        .map(move |t| edge((t - from) / EDGE) * edge((to - t) / EDGE)) // eq. 33
}

/// Mean of each channel over a rest with soft edges.
pub(super) fn soft_mean(samples: &MultiposeSamples<'_>, span: HeldSpan) -> [f64; CHANNELS] {
    let (mut sum, mut total) = ([0.0; CHANNELS], 0.0);
    for (k, weight) in (span.0..span.1).zip(weights(samples, span)) {
        for (sum, y) in sum.iter_mut().zip(channels(samples, k)) {
            *sum += weight * y;
        }
        total += weight;
    }
    sum.map(|sum| sum / total)
}

/// Trembling of a rest; `None` where it lies still.
pub(super) fn tremor(samples: &MultiposeSamples<'_>, (first, end): HeldSpan) -> Option<Tremor> {
    let n = end - first;
    let duration = samples.time[end - 1] - samples.time[first];
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss
    )]
    let (step, lag) = {
        let step = duration / (n - 1) as f64;
        (step, ((LAG / step).round() as usize).max(1))
    };
    let rates = &samples.rate[first..end];
    #[allow(clippy::cast_precision_loss)]
    let mean = rates
        .iter()
        .fold(Vector3::zeros(), |sum, w| sum + Vector3::from(*w))
        / n as f64;
    let at = |k: usize| Vector3::from(rates[k]) - mean;
    let correlation = |lag: usize| {
        #[allow(clippy::cast_precision_loss)]
        let count = (n - lag) as f64;
        (0..n - lag).map(|k| at(k).dot(&at(k + lag))).sum::<f64>() / (3.0 * count)
    };
    if n <= 4 * lag {
        return None;
    }
    let (whole, once, twice) = (correlation(0), correlation(lag), correlation(2 * lag));
    // White noise is in the first of the three alone.
    let ratio = twice / once;
    let cosine = (0.25 * (ratio + (ratio * ratio + 8.0).sqrt())).clamp(0.0, 1.0); // eq. 34
    let square = if once > 0.0 && cosine > 0.1 {
        once / cosine
    } else {
        whole.max(0.0)
    };
    let amplitude = (2.0 * square).sqrt();
    let noise = (whole - square).max(0.0).sqrt();
    #[allow(clippy::cast_precision_loss)]
    let frequency = libm::acos(cosine) / (std::f64::consts::TAU * step * lag as f64);
    (amplitude > TREMBLES.0.max(TREMBLES.1 * noise)).then_some(Tremor { amplitude, frequency })
}

/// White noise of the mean of each rest as windows with soft edges within it show, unit^2 / Hz, each pulled towards that of
/// all (docs/theory/multipose.md, eq. 35).
fn slow_noise(samples: &MultiposeSamples<'_>, spans: &[HeldSpan]) -> Vec<[f64; CHANNELS]> {
    let each: Vec<_> = spans.iter().map(|span| differences(samples, *span)).collect();
    let (all, count) = each
        .iter()
        .fold(([0.0; CHANNELS], 0.0), |(sum, all), (squares, count)| {
            (std::array::from_fn(|i| sum[i] + squares[i]), all + count)
        });
    let density = |squares: f64, count: f64| 0.5 * WINDOW * squares / f64::max(count, 1.0);
    each.iter()
        .map(|(squares, own)| {
            std::array::from_fn(|i| {
                let pooled = density(all[i], count);
                (POOLED * pooled + density(squares[i], *own) * own) / (POOLED + own) // eq. 35
            })
        })
        .collect()
}

/// Puts the white noise that windows show in place of that of single blocks, which a tremor is in.
pub(super) fn take_slow_noise(
    noise: &mut [Noise<f64>; CHANNELS],
    samples: &MultiposeSamples<'_>,
    spans: &[HeldSpan],
) {
    let each = slow_noise(samples, spans);
    #[allow(clippy::cast_precision_loss)]
    let count = each.len().max(1) as f64;
    for (i, noise) in noise.iter_mut().enumerate() {
        *noise = Noise {
            white: each.iter().map(|density| density[i]).sum::<f64>() / count,
            flicker: 0.0,
            flicker_shown: 0.0,
            flicker_sigma: 0.0,
        };
    }
}

/// Sum of the squared differences of windows that lie beside each other, and how many they are.
fn differences(samples: &MultiposeSamples<'_>, (first, end): HeldSpan) -> ([f64; CHANNELS], f64) {
    let mut centre = samples.time[first] + EDGE;
    let mut means = Vec::new();
    while centre + EDGE <= samples.time[end - 1] {
        means.extend(HeldWindow::about(samples, centre).map(|window| window.mean));
        centre += EDGE;
    }
    let mut sum = [0.0; CHANNELS];
    for k in 2..means.len() {
        for i in 0..CHANNELS {
            sum[i] += (means[k][i] - means[k - 2][i]).powi(2);
        }
    }
    #[allow(clippy::cast_precision_loss)]
    let count = means.len().saturating_sub(2) as f64;
    (sum, count)
}

/// By how much the variance of a mean exceeds that of noise, for each rest that trembles, and how it stood at its ends
/// (docs/theory/multipose.md, eq. 35 and 36).
pub(super) fn restlessness(
    samples: &MultiposeSamples<'_>,
    spans: &[HeldSpan],
    noise: &[Noise<f64>; CHANNELS],
) -> Vec<Option<Restlessness>> {
    let tremors: Vec<_> = spans.iter().map(|span| tremor(samples, *span)).collect();
    let trembling: Vec<_> = (0..spans.len()).filter(|k| tremors[*k].is_some()).collect();
    let of_trembling: Vec<_> = trembling.iter().map(|k| spans[*k]).collect();
    let mut found = vec![None; spans.len()];
    for (k, density) in trembling.iter().zip(slow_noise(samples, &of_trembling)) {
        let span = spans[*k];
        let duration = samples.time[span.1 - 1] - samples.time[span.0];
        let effective = effective_duration(samples, span);
        let (from_start, from_end) = attitudes(samples, span);
        found[*k] = tremors[*k].map(|tremor| Restlessness {
            tremor,
            variance: std::array::from_fn(|i| {
                (density[i] / effective - noise[i].white / duration).max(0.0) // eq. 35
            }),
            start_from_mean: from_start,
            end_from_mean: from_end,
        });
    }
    found
}

/// The white noise of a soft mean is that of a mean over so many seconds.
fn effective_duration(samples: &MultiposeSamples<'_>, span: HeldSpan) -> f64 {
    let (mut sum, mut squares, mut n) = (0.0, 0.0, 0.0);
    for weight in weights(samples, span) {
        sum += weight;
        squares += weight * weight;
        n += 1.0;
    }
    sum * sum / squares * (samples.time[span.1 - 1] - samples.time[span.0]) / (n - 1.0)
}

/// Case at the first sample, and at the first after the rest, from the case as it stood in the mean, as the gyroscope has it:
/// from there turns are integrated.
fn attitudes(samples: &MultiposeSamples<'_>, span: HeldSpan) -> (UnitQuaternion<f64>, UnitQuaternion<f64>) {
    let [_, _, _, x, y, z] = soft_mean(samples, span);
    let bias = Vector3::new(x, y, z);
    let (mut angle, mut mean, mut total) = (Vector3::zeros(), Vector3::<f64>::zeros(), 0.0);
    let at = |k: usize| Vector3::from(samples.rate[k]) - bias;
    let step = |k: usize| (at(k - 1) + at(k)) * (0.5 * (samples.time[k] - samples.time[k - 1]));
    for (k, weight) in (span.0..span.1).zip(weights(samples, span)) {
        if k > span.0 {
            angle += step(k);
        }
        mean += angle * weight;
        total += weight;
    }
    if span.1 < samples.time.len() {
        angle += step(span.1);
    }
    mean /= total;
    // A case that turned by an angle sees everything turned back by it.
    let turned = |angle: Vector3<f64>| UnitQuaternion::from_scaled_axis(-angle);
    (turned(-mean), turned(angle - mean)) // eq. 36
}

/// When a span was, s of the recording's own clock.
pub(super) fn times(samples: &MultiposeSamples<'_>, (first, end): HeldSpan) -> (f64, f64) {
    (samples.time[first], samples.time[end - 1])
}

/// True where a span shares time with any rest, s of the recording's own clock.
pub(super) fn is_among(
    span: (f64, f64),
    origin: f64,
    rests: &[tumble_core::segmenter::Segment<f64>],
) -> bool {
    rests.iter().any(|rest| {
        let (start, end) = (
            origin + seconds::<f64>(rest.start),
            origin + seconds::<f64>(rest.end),
        );
        start < span.1 && span.0 < end
    })
}
