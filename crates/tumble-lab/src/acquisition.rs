//! Step 1 on the host: a recording of any length becomes the rests and turns of one unit.

use nalgebra::Vector3;
use tumble_core::noise::{AllanLadder, Interval, Noise};
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::{Segment, Segmenter, SegmenterSettings, Stretch};
use tumble_core::stillness::Scatter;

use crate::consistency::{RateVerdict, judge_rate};
use crate::health::{Channels, Fault, FaultKind};
use crate::trace::Trace;

/// Names of the channels, as users know them.
pub const CHANNEL_NAMES: [&str; CHANNELS] = [
    "accelerometer x",
    "accelerometer y",
    "accelerometer z",
    "gyroscope x",
    "gyroscope y",
    "gyroscope z",
];

/// Why a stretch that looked like a rest is not one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotARest {
    /// The scatter was above the sensor's own noise: vibration.
    Vibrating,
    /// The specific force drifted: a slow turn.
    Drifting,
    /// The angular rate differed from that of the rests beside it: a slow turn about the vertical.
    Turning,
}

/// A recording, or one of its files.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// When it began, s since the origin.
    pub start: f64,
    /// Name of the file where there is one a pose; empty for a continuous recording.
    pub name: String,
}

/// What one unit showed.
#[derive(Clone, Debug)]
pub struct Acquired {
    /// Time of the first sample, s of the recording's own clock; all other times count from it.
    pub origin: f64,
    /// One for a continuous recording, one a file otherwise.
    pub parts: Vec<Part>,
    /// Stretches at rest.
    pub rests: Vec<Stretch<f64>>,
    /// `turns[i]` lies between `rests[i]` and `rests[i + 1]`.
    pub turns: Vec<Stretch<f64>>,
    /// Stretches that looked like rests, with the reason why they are none.
    pub refused: Vec<(Stretch<f64>, NotARest)>,
    /// Noise of the six channels.
    pub noise: [Noise<f64>; CHANNELS],
    /// The recording at a glance.
    pub trace: Trace,
    /// What is wrong with channels.
    pub faults: Vec<Fault>,
    /// Finite samples taken in.
    pub samples: u64,
    /// Samples passed over because a channel was not a number.
    pub not_finite: u64,
    /// Time of the first sample that was not later than the one before, s of the recording's own clock.
    pub first_backwards: Option<f64>,
    /// Lowest, mean and highest temperature, degC.
    pub temperature: Option<[f64; 3]>,
}

impl Acquired {
    /// Noise of the accelerometer.
    pub fn force_noise(&self) -> [Noise<f64>; 3] {
        [self.noise[0], self.noise[1], self.noise[2]]
    }

    /// Noise of the gyroscope.
    pub fn rate_noise(&self) -> [Noise<f64>; 3] {
        [self.noise[3], self.noise[4], self.noise[5]]
    }

    /// From the start of the first rest to the end of the last, s since the origin.
    pub fn session(&self) -> Interval<f64> {
        let start = self.rests.first().map_or(0.0, |rest| seconds(rest.start));
        let end = self.rests.last().map_or(0.0, |rest| seconds(rest.end));
        Interval { start, end }
    }

    /// All that happened after rest `i` and before rest `j`.
    pub fn between(&self, i: usize, j: usize) -> Option<Stretch<f64>> {
        let mut span = *self.turns.get(i)?;
        for k in i + 1..j {
            span.append(self.rests.get(k)?);
            span.append(self.turns.get(k)?);
        }
        Some(span)
    }

    /// Rests `first ..= last` as one, without what lies between them.
    pub fn joined(&self, first: usize, last: usize) -> Option<Stretch<f64>> {
        let mut rest = *self.rests.get(first)?;
        for next in self.rests.get(first + 1..=last)? {
            rest.moments.merge(&next.moments);
            rest.end = next.end;
        }
        Some(rest)
    }
}

/// Microseconds since the origin as seconds.
#[allow(clippy::cast_precision_loss)]
pub fn seconds(microseconds: u64) -> f64 {
    microseconds as f64 * 1e-6
}

/// When a stretch took place, s since the origin.
pub fn interval(stretch: &Stretch<f64>) -> Interval<f64> {
    Interval {
        start: seconds(stretch.start),
        end: seconds(stretch.end),
    }
}

/// Takes in a recording chunk by chunk.
pub struct Acquisition {
    settings: SegmenterSettings<f64>,
    segmenter: Segmenter<f64>,
    origin: Option<f64>,
    part_start: f64,
    part_offset: f64,
    part_name: String,
    latest: f64,
    leading: bool,
    found: Acquired,
    channels: Channels,
    allan: AllanLadder<f64>,
    temperature: (u64, f64, f64, f64),
}

impl Acquisition {
    /// Nothing seen yet.
    pub fn new(settings: SegmenterSettings<f64>) -> Self {
        let none = Noise::none();
        Self {
            settings,
            segmenter: Segmenter::new(settings),
            origin: None,
            part_start: 0.0,
            part_offset: 0.0,
            part_name: String::new(),
            latest: f64::NEG_INFINITY,
            leading: true,
            found: Acquired {
                origin: 0.0,
                parts: Vec::new(),
                rests: Vec::new(),
                turns: Vec::new(),
                refused: Vec::new(),
                noise: [none; CHANNELS],
                trace: Trace::new(),
                faults: Vec::new(),
                samples: 0,
                not_finite: 0,
                first_backwards: None,
                temperature: None,
            },
            channels: Channels::new(),
            allan: AllanLadder::new(),
            temperature: (0, f64::INFINITY, 0.0, f64::NEG_INFINITY),
        }
    }

    /// Takes in successive samples: `time` (n) s, `force` (n x 3) m/s^2, `rate` (n x 3) rad/s.
    pub fn push(&mut self, time: &[f64], force: &[[f64; 3]], rate: &[[f64; 3]], temperature: Option<&[f64]>) {
        let Some(&first) = time.iter().find(|t| t.is_finite()) else {
            self.found.not_finite += time.len() as u64;
            return;
        };
        if self.origin.is_none() {
            self.origin = Some(first);
            self.part_start = first;
            self.found.parts.push(Part {
                start: self.part_offset,
                name: self.part_name.clone(),
            });
        }
        let origin = self.part_start - self.part_offset;
        if self.found.parts.len() == 1 {
            self.found.origin = origin;
        }
        for ((&t, f), w) in time.iter().zip(force).zip(rate) {
            let y = [f[0], f[1], f[2], w[0], w[1], w[2]];
            let sum = t + y.iter().sum::<f64>();
            if !sum.is_finite() {
                self.found.not_finite += 1;
                continue;
            }
            if t <= self.latest {
                self.found.first_backwards.get_or_insert(t);
                continue;
            }
            self.latest = t;
            self.found.samples += 1;
            // Processors convert to signed integers in one step, to unsigned ones in several.
            #[allow(clippy::cast_possible_truncation)]
            let microseconds = (((t - origin) * 1e6 + 0.5) as i64).max(0).cast_unsigned();
            self.channels.push_sample(microseconds, &y);
            let segment = self.segmenter.push_channels(microseconds, &y);
            if self.segmenter.has_block() {
                self.look();
            }
            if let Some(segment) = segment {
                self.keep(segment);
            }
        }
        for &t in temperature.unwrap_or_default() {
            if t.is_finite() {
                let (n, low, sum, high) = self.temperature;
                self.temperature = (n + 1, low.min(t), sum + t, high.max(t));
            }
        }
    }

    /// Starts a file of a recording that comes as one file a pose. Its clock may start anew.
    pub fn begin_part(&mut self, name: &str) {
        self.drain();
        name.clone_into(&mut self.part_name);
        if self.origin.is_some() {
            // One empty second between parts keeps rests apart; no turn is known between them.
            self.part_offset += (self.latest - self.part_start).max(0.0) + 1.0;
            self.origin = None;
            self.latest = f64::NEG_INFINITY;
            self.leading = true;
            self.segmenter = Segmenter::new(self.settings);
        }
    }

    /// Ends the recording.
    pub fn finish(mut self) -> Acquired {
        self.drain();
        let ([fx, fy, fz], [wx, wy, wz]) = (
            self.allan.fit_jointly([0, 1, 2]),
            self.allan.fit_jointly([3, 4, 5]),
        );
        self.found.noise = [fx, fy, fz, wx, wy, wz];
        let (n, low, sum, high) = self.temperature;
        #[allow(clippy::cast_precision_loss)]
        if n > 0 {
            self.found.temperature = Some([low, sum / n as f64, high]);
        }
        let floor = self.segmenter.floor();
        sift(&mut self.found, |found, i| {
            disturbed(&found.rests[i], &self.settings, floor)
        });
        // In a wrong unit g-sensitivity looks like slow turns; the unit is the thing to complain of then.
        if matches!(
            judge_rate(&self.found),
            RateVerdict::Consistent | RateVerdict::Unknown
        ) {
            sift(&mut self.found, |found, i| {
                is_turning(found, i).then_some(NotARest::Turning)
            });
        }
        self.found.faults = self.channels.faults(&self.found.rests, &self.found.turns);
        leave_out_saturated(&mut self.found);
        self.found
    }

    fn drain(&mut self) {
        while let Some(segment) = self.segmenter.finish() {
            self.keep(segment);
            self.look();
        }
        // What came after the last rest leads nowhere.
        self.found
            .turns
            .truncate(self.found.rests.len().saturating_sub(1));
        self.look();
        self.allan.merge(self.segmenter.allan());
    }

    fn look(&mut self) {
        if let Some(block) = self.segmenter.take_block() {
            self.found.trace.push(block);
            self.channels.push_block(block);
        }
    }

    fn keep(&mut self, segment: Segment<f64>) {
        match segment {
            Segment::Rest(rest) => self.found.rests.push(rest),
            // What came before the first rest leads from nowhere.
            Segment::Turn(_) if self.found.rests.is_empty() => {}
            Segment::Turn(mut turn) => {
                turn.complete &= !self.leading;
                self.found.turns.push(turn);
            }
        }
        self.leading = false;
    }
}

/// A turn in which a channel reached the end of its range is not known in full.
fn leave_out_saturated(found: &mut Acquired) {
    for fault in found
        .faults
        .iter()
        .filter(|fault| fault.kind == FaultKind::SaturatedInMotion)
    {
        for turn in &mut found.turns {
            let when = interval(turn);
            turn.complete &= when.end < fault.span.0 || fault.span.1 < when.start;
        }
    }
}

/// Takes out what only looked like a rest, now that the whole recording is known.
fn sift(found: &mut Acquired, objection: impl Fn(&Acquired, usize) -> Option<NotARest>) {
    let mut i = 0;
    while i < found.rests.len() {
        let Some(reason) = objection(found, i) else {
            i += 1;
            continue;
        };
        found.refused.push((found.rests[i], reason));
        if i > 0 && i < found.turns.len() {
            let rest = found.rests[i];
            let after = found.turns.remove(i);
            let before = &mut found.turns[i - 1];
            before.append(&rest);
            before.append(&after);
        } else if i < found.turns.len() {
            found.turns.remove(i);
        } else if i > 0 {
            found.turns.truncate(i - 1);
        }
        found.rests.remove(i);
    }
}

/// Drift of the specific force that no rest shows, m/s^3: gravity turning at 0.4 mrad/s.
const LARGEST_SLOPE: f64 = 0.004;

/// Angular rate by which rests may differ from each other, rad/s: a bias does not jump that far in a session.
const LARGEST_RATE_JUMP: f64 = 0.005;

/// How much a gyroscope may feel specific force, rad/s per m/s^2: 0.3 deg/s per g, the worst of consumer grade.
const LARGEST_G_SENSITIVITY: f64 = 5e-4;

/// Drift of specific force, m/s^2, and angular rate, rad/s, within a rest that is not vibration: a bias that warms up, or
/// the last of a turn before the sensor's own noise was known.
const LARGEST_DRIFT: (f64, f64) = (0.02, 0.003);

fn disturbed(
    rest: &Stretch<f64>,
    settings: &SegmenterSettings<f64>,
    floor: Option<Scatter<f64>>,
) -> Option<NotARest> {
    let scatter = Scatter::of(&rest.moments);
    let floor = floor?;
    let limits = &settings.stillness;
    let drift = |drift: f64| drift * drift / 3.0;
    let noisy = |scatter: f64, floor: f64, smallest: f64, allowed: f64| {
        scatter > limits.variance_ratio * floor + smallest * smallest + drift(allowed)
    };
    if noisy(
        scatter.specific_force,
        floor.specific_force,
        limits.smallest_specific_force_scatter,
        LARGEST_DRIFT.0,
    ) || noisy(
        scatter.angular_rate,
        floor.angular_rate,
        limits.smallest_angular_rate_scatter,
        LARGEST_DRIFT.1,
    ) {
        return Some(NotARest::Vibrating);
    }
    let duration = rest.duration();
    let slope_sigma = (12.0 * scatter.specific_force / f64::from(rest.moments.samples())).sqrt() / duration;
    (rest.specific_force_slope().norm() > LARGEST_SLOPE.max(6.0 * slope_sigma)).then_some(NotARest::Drifting)
}

/// A rest whose rate differs from both its neighbours', while these agree, is a slow turn. A turn that never ends
/// cannot be told from bias by rate alone; that one the drift of gravity shows, unless it is about the vertical.
fn is_turning(found: &Acquired, i: usize) -> bool {
    let n = found.rests.len();
    if n < 3 {
        return false;
    }
    let (a, b) = match i {
        0 => (1, 2),
        _ if i + 1 == n => (n - 3, n - 2),
        _ => (i - 1, i + 1),
    };
    let variance = Scatter::of(&found.rests[i].moments).angular_rate;
    let rate = |k: usize| found.rests[k].angular_rate();
    let samples = |k: usize| f64::from(found.rests[k].moments.samples());
    let force = |k: usize| found.rests[k].specific_force();
    let gate = |j: usize, k: usize| {
        let noise = (variance / samples(j) + variance / samples(k)).sqrt();
        LARGEST_RATE_JUMP + LARGEST_G_SENSITIVITY * (force(j) - force(k)).norm() + 6.0 * noise
    };
    let apart = |j: usize, k: usize| -> Vector3<f64> { rate(j) - rate(k) };
    apart(i, a).norm() > gate(i, a) && apart(i, b).norm() > gate(i, b) && apart(a, b).norm() <= gate(a, b)
}
