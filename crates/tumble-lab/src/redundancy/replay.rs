//! Arrays through the monitor, in order of time.

use nalgebra::Vector3;
use tumble_core::redundancy::aiding::Aiding;
use tumble_core::redundancy::monitor::Command;
use tumble_core::sample::Sample;

use crate::redundancy::dyn_monitor::{DynMonitor, EventLog, OutputSample, WindowMeans};

/// Samples of one unit; row `i` of each belongs to `time[i]`.
#[derive(Clone, Copy, Debug)]
pub struct ReplayUnit<'a> {
    /// s of the recordings' common clock.
    pub time: &'a [f64],
    /// m/s^2.
    pub specific_force: &'a [[f64; 3]],
    /// rad/s.
    pub angular_rate: &'a [[f64; 3]],
    /// degC, where it is known; not a number where it is not.
    pub temperature: Option<&'a [f64]>,
    /// Added to the time by the monitor, s: samples are handed over in the order this makes.
    pub time_offset: f64,
    /// When each came, s, never earlier than the one before: samples are then handed over in this order instead.
    pub arrival: Option<&'a [f64]>,
}

impl ReplayUnit<'_> {
    /// Unit without samples.
    pub fn silent() -> Self {
        Self {
            time: &[],
            specific_force: &[],
            angular_rate: &[],
            temperature: None,
            time_offset: 0.0,
            arrival: None,
        }
    }

    /// Key by which a row is ordered.
    pub fn turn(&self, row: usize) -> Option<f64> {
        match self.arrival {
            Some(arrival) => arrival.get(row).copied(),
            None => self.common_time(row),
        }
    }

    /// Temperature of a row, degC, unless it is that of the row before.
    fn changed_temperature(&self, row: usize) -> Option<f64> {
        let temperature = self.temperature?;
        let (told, before) = (*temperature.get(row)?, row.checked_sub(1));
        let before = before.and_then(|before| temperature.get(before));
        before
            .is_none_or(|before| before.to_bits() != told.to_bits())
            .then_some(told)
    }

    /// Time of a row on the common clock, s.
    pub fn common_time(&self, row: usize) -> Option<f64> {
        Some(self.time.get(row)? + self.time_offset)
    }
}

/// All units over one window.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayWindow {
    /// Its middle on the common clock, s.
    pub time: f64,
    /// `None` for a unit without samples in it.
    pub means: Vec<Option<WindowMeans>>,
}

/// Result of a replay.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replay {
    /// Events and adopted records.
    pub log: EventLog,
    /// Windows in turn.
    pub windows: Vec<ReplayWindow>,
    /// The output, where it was asked for.
    pub output: Vec<OutputSample>,
    /// Samples of the output, kept or not.
    pub said: u64,
    /// Those of a source that is known to be wrong.
    pub degraded: u64,
}

/// Aiding measurement with its times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Said {
    /// s, when it was so.
    pub time: f64,
    /// Key of the samples with which it came, s; minus infinity where that is not known: it counts from the first
    /// sample of its time on.
    pub turn: f64,
    /// Measurement.
    pub aiding: Aiding<f64>,
}

/// Inputs of a replay besides the samples.
pub struct ReplayOptions<'a> {
    /// s, in order, with the command to give then.
    pub commands: &'a [(f64, Command)],
    /// Aiding measurements, in order.
    pub measurements: &'a [Said],
    /// True if the output is kept.
    pub keep_output: bool,
    /// Time 0 of the monitor, s of the recordings' clock.
    pub origin: f64,
    /// Receives the share that is done, now and then; `false` ends the replay.
    pub progress: &'a mut dyn FnMut(f64) -> bool,
}

/// Samples after which progress is reported.
const PROGRESS_EVERY: usize = 1 << 16;

/// Pushes the samples of all units, in order of time or of arrival. Rows that go back in time are pushed as they stand:
/// what a clock does is for the monitor to judge.
pub fn replay(
    monitor: &mut dyn DynMonitor,
    units: &[ReplayUnit<'_>],
    options: &mut ReplayOptions<'_>,
) -> Replay {
    let mut replay = Replay::default();
    let mut latest = monitor.window();
    let mut next = vec![0_usize; units.len()];
    let mut commands = options.commands.iter().peekable();
    let mut measurements = options.measurements.iter().peekable();
    let total: usize = units.iter().map(|samples| samples.time.len()).sum();
    for pushed in 0..total {
        if pushed.is_multiple_of(PROGRESS_EVERY) && !(options.progress)(share(pushed, total)) {
            break;
        }
        let Some(unit) = earliest(units, &next) else {
            break;
        };
        let (samples, row) = (&units[unit], next[unit]);
        next[unit] += 1;
        let now = samples.time[row] + samples.time_offset;
        while let Some((_, command)) = commands.next_if(|(time, _)| *time <= now) {
            monitor.command(*command);
        }
        let turn = samples.turn(row).unwrap_or(now);
        while let Some(said) = measurements.next_if(|said| said.time <= now && said.turn <= turn) {
            let time = microseconds(said.time - options.origin);
            monitor.aiding(time, &said.aiding, &mut replay.log);
        }
        let sample = Sample {
            time: microseconds(samples.time[row] - options.origin),
            specific_force: Vector3::from(samples.specific_force[row]),
            angular_rate: Vector3::from(samples.angular_rate[row]),
        };
        if let Some(told) = samples.changed_temperature(row) {
            monitor.set_temperature(unit, told);
        }
        let output = monitor.push(unit, &sample, &mut replay.log);
        replay.said += u64::from(output.is_some());
        replay.degraded += u64::from(output.as_ref().is_some_and(|said| said.degraded));
        replay.output.extend(output.filter(|_| options.keep_output));
        replay.keep_window(monitor, units.len(), &mut latest);
    }
    replay
}

impl Replay {
    /// Keeps the window looked at last, unless it is the `latest` one kept, be it in a replay before.
    fn keep_window(&mut self, monitor: &dyn DynMonitor, units: usize, latest: &mut Option<u64>) {
        let window = monitor.window();
        if let Some(number) = window.filter(|_| window != *latest) {
            let means = (0..units).map(|unit| monitor.means(unit)).collect();
            let time = (number as f64 + 0.5) * 1e-6 * monitor.window_length() as f64;
            self.windows.push(ReplayWindow { time, means });
        }
        *latest = window;
    }
}

/// The unit whose next sample, of rows `next`, has the first turn.
pub fn earliest(units: &[ReplayUnit<'_>], next: &[usize]) -> Option<usize> {
    let mut earliest: Option<(usize, f64)> = None;
    for (unit, (samples, row)) in units.iter().zip(next).enumerate() {
        let Some(turn) = samples.turn(*row) else {
            continue;
        };
        if earliest.is_none_or(|(_, other)| turn < other) {
            earliest = Some((unit, turn));
        }
    }
    earliest.map(|(unit, _)| unit)
}

#[allow(clippy::cast_precision_loss)]
fn share(done: usize, total: usize) -> f64 {
    done as f64 / total.max(1) as f64
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn microseconds(seconds: f64) -> u64 {
    (seconds * 1e6).round() as u64
}
