//! Takes in logs of units at rest whose temperature changes: means over short spans, in memory that does not grow.

use tumble_core::moments::Moments;
use tumble_core::resolution::Resolution;
use tumble_core::sample::CHANNELS;

/// Length of the first spans, s; they are joined two by two when there are too many.
const FIRST_SPAN: f64 = 1.0;
/// Samples in a span at least: the scatter of fewer is too uncertain.
const FEWEST_SAMPLES: u32 = 10;
const MOST_SPANS: usize = 1 << 14;
/// Least steps between samples that make a pause.
const PAUSE: f64 = 2.5;

/// Sums over successive samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Which log, in the order in which they were taken in.
    pub session: usize,
    /// First and last sample, s of the log's clock.
    pub time: [f64; 2],
    /// Mean reading of the thermometer, degC.
    pub temperature: f64,
    /// Moments of the six channels, m/s^2, then rad/s.
    pub moments: Moments<f64, CHANNELS>,
}

impl Span {
    fn of(session: usize, time: f64, temperature: f64, sample: &[f64; CHANNELS]) -> Self {
        let mut moments = Moments::new();
        moments.push(sample);
        Self {
            session,
            time: [time; 2],
            temperature,
            moments,
        }
    }

    /// Samples.
    pub fn count(&self) -> f64 {
        f64::from(self.moments.samples())
    }

    /// In its middle, s.
    pub fn middle(&self) -> f64 {
        0.5 * (self.time[0] + self.time[1])
    }

    /// That its samples stand for, s: each for the time to the next.
    pub fn duration(&self) -> f64 {
        let count = self.count();
        (self.time[1] - self.time[0]) * count / (count - 1.0).max(1.0)
    }

    /// Takes in a later span of the same session.
    pub fn append(&mut self, later: &Self) {
        let share = later.count() / (self.count() + later.count());
        self.temperature += (later.temperature - self.temperature) * share;
        self.moments.merge(&later.moments);
        self.time[1] = later.time[1];
    }

    /// Tests whether a sample still belongs to it: it is not long yet, or of few samples. Those of a slow log are apart by
    /// their `step`, s, not by a pause.
    fn holds(&self, time: f64, length: f64, step: f64) -> bool {
        let follows = time - self.time[1] < length.max(PAUSE * step);
        let slow = self.moments.samples() < FEWEST_SAMPLES && follows;
        slow || time - self.time[0] < length
    }

    fn push(&mut self, time: f64, temperature: f64, sample: &[f64; CHANNELS]) {
        self.moments.push(sample);
        self.temperature += (temperature - self.temperature) / self.count();
        self.time[1] = time;
    }
}

/// Takes in logs sample by sample.
#[derive(Clone, Debug)]
pub struct ThermalRecorder {
    spans: Vec<Span>,
    length: f64,
    session: usize,
    open: Option<Span>,
    last_reading: f64,
    step: f64,
    last_time: f64,
    /// Shortest time from one sample to the next, s; infinite before the second.
    shortest: f64,
    resolution: [Resolution<f64, 3>; 2],
}

impl Default for ThermalRecorder {
    fn default() -> Self {
        Self {
            spans: Vec::new(),
            length: FIRST_SPAN,
            session: 0,
            open: None,
            last_reading: f64::NAN,
            step: f64::INFINITY,
            last_time: f64::NAN,
            shortest: f64::INFINITY,
            resolution: [Resolution::new(); 2],
        }
    }
}

impl ThermalRecorder {
    /// Begins another log.
    pub fn begin_session(&mut self) {
        self.close();
        self.session = self.spans.last().map_or(0, |span| span.session + 1);
        self.last_reading = f64::NAN;
        self.last_time = f64::NAN;
        self.shortest = f64::INFINITY;
    }

    /// Takes in a sample: `time` s, increasing, `temperature` degC, and six channels in SI units. A sample that is not
    /// finite is left out.
    pub fn push(&mut self, time: f64, temperature: f64, sample: &[f64; CHANNELS]) {
        if !(time.is_finite() && temperature.is_finite() && sample.iter().all(|value| value.is_finite())) {
            return;
        }
        let [fx, fy, fz, wx, wy, wz] = *sample;
        self.resolution[0].push([fx, fy, fz]);
        self.resolution[1].push([wx, wy, wz]);
        let change = (temperature - self.last_reading).abs();
        if change > 0.0 {
            self.step = self.step.min(change);
        }
        self.last_reading = temperature;
        if time > self.last_time {
            self.shortest = self.shortest.min(time - self.last_time);
        }
        self.last_time = time;
        match &mut self.open {
            Some(open) if open.holds(time, self.length, self.shortest) => {
                open.push(time, temperature, sample)
            }
            _ => {
                self.close();
                self.open = Some(Span::of(self.session, time, temperature, sample));
            }
        }
    }

    /// Smallest difference of successive readings of the thermometer, K: its step, or its noise where that is larger;
    /// infinite where it never changed.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Steps that the readings of accelerometer, m/s^2, and gyroscope, rad/s, are multiples of; `None` where nothing shows one.
    pub fn resolution(&self) -> [Option<f64>; 2] {
        self.resolution.map(|each| each.step())
    }

    /// The spans of all that was taken in, in their order.
    pub fn spans(&self) -> Vec<Span> {
        let mut spans = self.spans.clone();
        spans.extend(self.open);
        spans
    }

    fn close(&mut self) {
        self.spans.extend(self.open.take());
        if self.spans.len() >= MOST_SPANS {
            self.length *= 2.0;
            self.spans = joined(&self.spans, self.length);
        }
    }
}

/// Joins successive spans of a session that fit into a `length`, s.
fn joined(spans: &[Span], length: f64) -> Vec<Span> {
    let mut longer: Vec<Span> = Vec::with_capacity(spans.len() / 2 + 1);
    for span in spans {
        match longer.last_mut() {
            Some(last) if last.session == span.session && span.time[1] - last.time[0] < length => {
                last.append(span)
            }
            _ => longer.push(*span),
        }
    }
    longer
}
