//! Steps, ramps and knocks in a record at rest: changes of level and short excursions that its noise does not explain.
//!
//! A change of level shows in differences of neighbouring means, which scatter by root two times the Allan deviation,
//! whatever the noise is made of, random walk as well as white noise. So each length of mean is held against its own
//! scatter, read from a quantile that a few disturbances do not move (docs/theory/noise.md, eq. 32 to 34).

use super::watch::{Watched, Window};
use crate::distributions::student_quantile;

/// Chance that a channel of a log without disturbances shows one.
const FALSE_ALARM: f64 = 1e-3;
/// Share of the differences that the scatter is read from, and the sigmas below which a normal variable lies that often.
const SHARE: f64 = 0.9;
const SIGMAS_OF_SHARE: f64 = 1.644_853_6;
/// Independent differences that a length of mean has at least.
const FEWEST: usize = 12;
/// Share of the independent differences that count as degrees of freedom of a scatter read from a quantile.
const EFFICIENCY: f64 = 0.6;
/// Share of a window that was at rest, so that its mean counts.
const LEAST_FILLED: f64 = 0.6;
/// Share of a change of level that the shortest clear difference shows, if the change is sudden.
const SUDDEN: f64 = 0.75;
/// Blocks on both sides of a step that are left out: it may lie in any of them.
const BESIDE_STEP: usize = 1;
/// Sigmas of a sample from which on it is a knock, and of the logarithm of the variance of a block.
const KNOCK: f64 = 8.0;
const SHAKEN: f64 = 7.0;
/// Sigmas below which a normal variable lies in nine of ten cases.
const SIGMAS_OF_NINE_IN_TEN: f64 = 1.281_551_6;
/// Samples of a block from which on its variance counts.
const FEWEST_SAMPLES: f64 = 8.0;
/// Longest time without rest, s, that is a knock rather than motion, and beyond which levels are not compared.
const LONGEST_KNOCK: f64 = 10.0;
/// Disturbances of a channel beyond which they are its noise.
pub const MOST: usize = 24;

tumble_core::vocabulary! {
    /// Kind of a disturbance of a channel.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum DisturbanceKind {
        /// The level changes at once, and stays.
        Step = "step",
        /// It changes over a while, and stays.
        Ramp = "ramp",
        /// Readings leave it for a moment.
        Knock = "knock",
    }
}

/// One disturbance of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelDisturbance {
    /// Which channel.
    pub channel: usize,
    /// In which log.
    pub log: usize,
    /// Kind of the disturbance.
    pub kind: DisturbanceKind,
    /// First and last instant that it may have touched, s.
    pub time: [f64; 2],
    /// Change of level, or largest excursion, with its sign.
    pub size: f64,
    /// 1-sigma of the change of level; of an excursion, scatter of a sample.
    pub sigma: f64,
}

/// A place that stands out, blocks.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// The block that begins the later of the two means.
    at: usize,
    /// Blocks in each.
    width: usize,
    difference: f64,
    sigma: f64,
    /// Over the threshold.
    score: f64,
}

/// Level of one channel over blocks.
struct LevelSeries<'a> {
    windows: &'a [Window],
    values: Vec<f64>,
    counts: Vec<f64>,
    /// Number of the part, of one log and without long motion, that each block belongs to.
    parts: Vec<usize>,
    /// Sums up to each block.
    sums: Vec<f64>,
    filled: Vec<f64>,
    /// Samples of a full block.
    full: f64,
}

/// Disturbances of a channel, the most clear first, and whether there are more than are listed.
pub fn disturbances(watched: &Watched, channel: usize) -> (Vec<ChannelDisturbance>, bool) {
    let windows = watched.windows(channel);
    let mut found = knocks(&windows, channel);
    let mut series = LevelSeries::new(&windows, &found);
    let scatters = series.scatters();
    while found.len() <= MOST {
        let Some(place) = series.clearest(&scatters) else {
            break;
        };
        let disturbance = series.classify(place, channel, &scatters);
        series.take_out(&disturbance, place);
        found.push(disturbance);
    }
    let more = found.len() > MOST;
    found.truncate(MOST);
    (found, more)
}

/// Samples far from the mean of their block, and short motion between rests, by blocks.
fn knocks(windows: &[Window], channel: usize) -> Vec<ChannelDisturbance> {
    let mut scatter: Vec<f64> = windows.iter().filter_map(Window::scatter).collect();
    let Some(sigma) = quantile(&mut scatter, 0.5).filter(|sigma| *sigma > 0.0) else {
        return Vec::new();
    };
    let shaken = shaken(&mut scatter, sigma);
    let is_shaken = |window: &Window| {
        window.count >= FEWEST_SAMPLES && window.scatter().is_some_and(|scatter| scatter > shaken)
    };
    let mut found: Vec<ChannelDisturbance> = Vec::new();
    let mut level = None;
    for window in windows {
        let size = excursion(window, level);
        if window.count > 0.0 {
            level = Some(window.mean);
        }
        if size.abs() < KNOCK * sigma && !is_shaken(window) {
            continue;
        }
        match found.last_mut() {
            Some(last) if last.log == window.log && window.time[0] - last.time[1] <= apart(window) => {
                last.time[1] = window.time[1];
                if size.abs() > last.size.abs() {
                    last.size = size;
                }
            }
            _ => found.push(ChannelDisturbance {
                channel,
                log: window.log,
                kind: DisturbanceKind::Knock,
                time: window.time,
                size,
                sigma,
            }),
        }
    }
    found.retain(|each| each.time[1] - each.time[0] <= LONGEST_KNOCK);
    found
}

/// Standard deviation of the samples of a block beyond which noise does not take it, whatever its correlation.
fn shaken(scatter: &mut [f64], sigma: f64) -> f64 {
    let high = quantile(scatter, 0.9).unwrap_or(sigma);
    sigma * (high / sigma).powf(SHAKEN / SIGMAS_OF_NINE_IN_TEN) // eq. 34
}

/// Sample that is furthest from the mean of the block, or, in motion, from the level before it.
fn excursion(window: &Window, level: Option<f64>) -> f64 {
    let resting = if window.count > 0.0 {
        window.excursion()
    } else {
        0.0
    };
    let moving = window.moved.zip(level).map_or(0.0, |([low, high], level)| {
        if high - level > level - low {
            high - level
        } else {
            low - level
        }
    });
    if moving.abs() > resting.abs() {
        moving
    } else {
        resting
    }
}

/// Time between blocks that count as neighbours, s.
fn apart(window: &Window) -> f64 {
    (window.time[1] - window.time[0]).max(0.5)
}

/// Number of the part of each block: another log, a long gap and long motion begin a new one.
fn parts(windows: &[Window]) -> Vec<usize> {
    let (mut part, mut last): (usize, Option<&Window>) = (0, None);
    windows
        .iter()
        .map(|window| {
            if window.count > 0.0 {
                let continues =
                    |last: &Window| last.log == window.log && window.time[0] - last.time[1] <= LONGEST_KNOCK;
                part += usize::from(last.is_some_and(|last| !continues(last)));
                last = Some(window);
            }
            part
        })
        .collect()
}

impl<'a> LevelSeries<'a> {
    fn new(windows: &'a [Window], knocks: &[ChannelDisturbance]) -> Self {
        let within = |window: &Window| {
            let touches = |each: &ChannelDisturbance| {
                each.log == window.log && each.time[0] <= window.time[1] && window.time[0] <= each.time[1]
            };
            knocks.iter().any(touches)
        };
        let counts: Vec<f64> = windows
            .iter()
            .map(|window| if within(window) { 0.0 } else { window.count })
            .collect();
        let full = counts.iter().copied().fold(0.0, f64::max);
        let mut series = Self {
            windows,
            values: windows.iter().map(|window| window.mean).collect(),
            counts,
            parts: parts(windows),
            sums: Vec::new(),
            filled: Vec::new(),
            full,
        };
        series.add_up();
        series
    }

    fn add_up(&mut self) {
        let origin = self.values.first().copied().unwrap_or(0.0);
        self.sums = vec![0.0];
        self.filled = vec![0.0];
        for (value, count) in self.values.iter().zip(&self.counts) {
            self.sums
                .push(self.sums[self.sums.len() - 1] + (value - origin) * count);
            self.filled.push(self.filled[self.filled.len() - 1] + count);
        }
    }

    fn len(&self) -> usize {
        self.values.len()
    }

    /// Mean over blocks; None where too few samples were at rest.
    fn mean(&self, first: usize, end: usize) -> Option<f64> {
        let count = self.filled[end] - self.filled[first];
        let enough = count >= LEAST_FILLED * self.full * (end - first) as f64 && count > 0.0;
        enough.then(|| (self.sums[end] - self.sums[first]) / count)
    }

    /// The mean of `width` blocks from one on, less that of as many before it.
    fn difference(&self, at: usize, width: usize) -> Option<f64> {
        if at < width || at + width > self.len() || self.parts[at - width] != self.parts[at + width - 1] {
            return None;
        }
        Some(self.mean(at, at + width)? - self.mean(at - width, at)?)
    }

    /// Widths of means, scatter of their differences, and the threshold of each.
    fn scatters(&self) -> Vec<(usize, f64, f64)> {
        let widths = std::iter::successors(Some(1_usize), |width| Some(2 * width));
        let widths: Vec<usize> = widths
            .take_while(|width| 2 * width * FEWEST <= self.len())
            .collect();
        let chance = FALSE_ALARM / (2.0 * self.len().max(1) as f64 * widths.len().max(1) as f64);
        widths
            .into_iter()
            .filter_map(|width| {
                let mut sizes: Vec<f64> = (width..self.len())
                    .filter_map(|at| self.difference(at, width))
                    .map(f64::abs)
                    .collect();
                let scatter = quantile(&mut sizes, SHARE)? / SIGMAS_OF_SHARE; // eq. 32
                let freedom = EFFICIENCY * sizes.len() as f64 / (2.0 * width as f64);
                // Chance grows with the places at which a difference may lie, of which neighbours are alike.
                let threshold = student_quantile(1.0 - chance * width as f64, freedom.max(1.0)); // eq. 33
                (scatter > 0.0 && threshold.is_finite()).then_some((width, scatter, threshold))
            })
            .collect()
    }

    /// The difference that is furthest beyond its threshold.
    fn clearest(&self, scatters: &[(usize, f64, f64)]) -> Option<Place> {
        let of_width = |&(width, scatter, threshold): &(usize, f64, f64)| {
            let place = move |at: usize| {
                let difference = self.difference(at, width)?;
                let score = difference.abs() / (scatter * threshold);
                (score > 1.0).then_some(Place {
                    at,
                    width,
                    difference,
                    sigma: scatter,
                    score,
                })
            };
            (width..self.len()).filter_map(place)
        };
        scatters
            .iter()
            .flat_map(of_width)
            .max_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// A change of level that stays, sudden or not, or an excursion.
    fn classify(&self, place: Place, channel: usize, scatters: &[(usize, f64, f64)]) -> ChannelDisturbance {
        let near = place.at.saturating_sub(place.width)..(place.at + place.width).min(self.len());
        // The shortest means that show it clearly locate it.
        let sharpest = scatters.iter().find_map(|&(width, scatter, threshold)| {
            let of_place = |at: usize| Some((at, self.difference(at, width)? * place.difference.signum()));
            let (at, size) = near
                .clone()
                .filter_map(of_place)
                .max_by(|a, b| a.1.total_cmp(&b.1))?;
            (size > scatter * threshold).then_some((at, width, size))
        });
        let (at, width, size) = sharpest.unwrap_or((place.at, place.width, place.difference.abs()));
        let stays = self.stays(at, place);
        let (kind, half) = if !stays {
            (DisturbanceKind::Knock, place.width)
        } else if size >= SUDDEN * place.difference.abs() {
            (DisturbanceKind::Step, BESIDE_STEP)
        } else {
            let lasts = width as f64 * place.difference.abs() / size;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let half = (0.5 * lasts).ceil() as usize + BESIDE_STEP;
            (DisturbanceKind::Ramp, half)
        };
        let first = at.saturating_sub(half);
        let last = (at + half).clamp(first + 1, self.len()) - 1;
        ChannelDisturbance {
            channel,
            log: self.windows[at].log,
            kind,
            time: [self.windows[first].time[0], self.windows[last].time[1]],
            size: place.difference,
            sigma: place.sigma,
        }
    }

    /// True where the level beyond the means that show a change is still another than before them.
    fn stays(&self, at: usize, place: Place) -> bool {
        let width = place.width;
        let beyond = (at + 2 * width).min(self.len());
        let before = at.saturating_sub(2 * width);
        if self.parts[before] != self.parts[beyond - 1] {
            return true;
        }
        let later = self.mean((at + width).min(self.len()), beyond);
        let earlier = self.mean(before, at.saturating_sub(width));
        let level = |first: usize, end: usize| self.mean(first.min(end), end);
        let after = later.or_else(|| level(at, (at + width).min(self.len())));
        let first = earlier.or_else(|| level(at.saturating_sub(width), at));
        match (first, after) {
            (Some(first), Some(after)) => {
                (after - first) * place.difference.signum() > 0.5 * place.difference.abs()
            }
            _ => true,
        }
    }

    /// Takes a disturbance out of what is looked at: its blocks, and the change of level after them.
    fn take_out(&mut self, found: &ChannelDisturbance, place: Place) {
        let touches = |window: &Window| {
            window.log == found.log && window.time[0] <= found.time[1] && found.time[0] <= window.time[1]
        };
        let mut last = place.at;
        for (number, window) in self.windows.iter().enumerate() {
            if touches(window) {
                self.counts[number] = 0.0;
                last = number;
            }
        }
        if found.kind != DisturbanceKind::Knock {
            let part = self.parts[last];
            let later = self.values[last..].iter_mut().zip(&self.parts[last..]);
            later
                .filter(|(_, of)| **of == part)
                .for_each(|(value, _)| *value -= found.size);
        }
        self.add_up();
    }
}

/// Value below which a share of others lies.
fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let place = ((values.len() - 1) as f64 * share) as usize;
    let (_, value, _) = values.select_nth_unstable_by(place, f64::total_cmp);
    Some(*value)
}
