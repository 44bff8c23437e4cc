//! A set by one model, of any number of units in either precision, behind one face; and whole logs through it.

use tumble_core::real::{Real, real};
use tumble_core::redundancy::model::error::SecondaryErrors;
use tumble_core::redundancy::model::monitor::{SetEvent, SetEventKind, SetMonitor};
use tumble_core::redundancy::model::test::Exceedance;
use tumble_core::redundancy::unit_count::{UnitCount, Units};
use tumble_core::sample::Sample;

use crate::redundancy::replay::ReplayUnit;
use crate::setting::wide;

/// Rows of what is known of a gyroscope, and of an accelerometer: triangles with their right sides
/// (docs/theory/set.md, eq. 7).
pub type KnownRows = ([f64; 22], [f64; 135]);

/// A monitor of a set.
pub trait DynSet: Send + Sync {
    /// Takes a sample, in the axes of the primary.
    fn push(&mut self, unit: usize, sample: &Sample<f64>, events: &mut Vec<SetEvent<f64>>);
    /// States what is known of the errors of a secondary.
    fn set_errors(&mut self, unit: usize, known: &KnownRows);
    /// Known errors of a secondary; `None` of the primary, and where they are relative to a primary that is wrong.
    fn errors(&self, unit: usize) -> Option<KnownRows>;
    /// Memory of the monitor, bytes.
    fn state_bytes(&self) -> usize;
}

impl<T: Real, const UNITS: usize> DynSet for SetMonitor<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    fn push(&mut self, unit: usize, sample: &Sample<f64>, events: &mut Vec<SetEvent<f64>>) {
        let sample = Sample {
            time: sample.time,
            specific_force: sample.specific_force.map(real),
            angular_rate: sample.angular_rate.map(real),
        };
        SetMonitor::push(self, unit, &sample, &mut |event| events.push(widened(event)));
    }

    fn set_errors(&mut self, unit: usize, (rate, force): &KnownRows) {
        SetMonitor::set_errors(
            self,
            unit,
            &SecondaryErrors::stored(&rate.map(real), &force.map(real)),
        );
    }

    fn errors(&self, unit: usize) -> Option<KnownRows> {
        let (rate, force) = SetMonitor::errors(self, unit)?.information();
        Some((rate.map(wide), force.map(wide)))
    }

    fn state_bytes(&self) -> usize {
        size_of::<Self>()
    }
}

fn widened<T: Real>(event: &SetEvent<T>) -> SetEvent<f64> {
    let wide_finding = |finding: &Exceedance<T>| Exceedance {
        ratio: wide(finding.ratio),
        apart: wide(finding.apart),
        sensor: finding.sensor,
        seconds: wide(finding.seconds),
    };
    let kind = match &event.kind {
        SetEventKind::Unhealthy {
            reason,
            finding,
            together,
        } => SetEventKind::Unhealthy {
            reason: *reason,
            finding: finding.as_ref().map(wide_finding),
            together: *together,
        },
        SetEventKind::Disagree { other, finding } => SetEventKind::Disagree {
            other: *other,
            finding: wide_finding(finding),
        },
        SetEventKind::Healthy => SetEventKind::Healthy,
        SetEventKind::Agree { other, sensor } => SetEventKind::Agree {
            other: *other,
            sensor: *sensor,
        },
        SetEventKind::Selected { why } => SetEventKind::Selected { why: *why },
    };
    SetEvent {
        time: event.time,
        unit: event.unit,
        kind,
    }
}

/// Builds the monitor of a number of units; `None` where there is no such set.
pub fn build<T: Real>(units: usize, finds_delays: bool) -> Option<Box<dyn DynSet>> {
    Some(match units {
        2 => Box::new(SetMonitor::<T, 2>::new(finds_delays)),
        3 => Box::new(SetMonitor::<T, 3>::new(finds_delays)),
        4 => Box::new(SetMonitor::<T, 4>::new(finds_delays)),
        5 => Box::new(SetMonitor::<T, 5>::new(finds_delays)),
        6 => Box::new(SetMonitor::<T, 6>::new(finds_delays)),
        7 => Box::new(SetMonitor::<T, 7>::new(finds_delays)),
        8 => Box::new(SetMonitor::<T, 8>::new(finds_delays)),
        _ => return None,
    })
}

/// s by which logs end apart: the silence of one that ends so much before the last is no fault.
const ENDS: f64 = 0.5;

/// s by which samples are ordered: when each came, or its stamp.
fn order<'a>(log: &ReplayUnit<'a>) -> &'a [f64] {
    log.arrival.unwrap_or(log.time)
}

/// Time of the last sample that counts, s.
fn end(logs: &[ReplayUnit<'_>]) -> f64 {
    let ends = || logs.iter().filter_map(|log| order(log).last()).copied();
    let last = ends().fold(f64::NEG_INFINITY, f64::max);
    ends().filter(|end| *end > last - ENDS).fold(last, f64::min)
}

/// Pushes the samples of all units in the order in which they came, stamped in us after `origin`, s.
pub fn fly(monitor: &mut dyn DynSet, logs: &[ReplayUnit<'_>], origin: f64) -> Vec<SetEvent<f64>> {
    let mut events = Vec::new();
    let mut next = vec![0; logs.len()];
    let end = end(logs);
    loop {
        let waiting = logs.iter().zip(&next).enumerate();
        let times = waiting.filter_map(|(unit, (log, at))| Some((unit, *order(log).get(*at)?)));
        let first = times.min_by(|(_, one), (_, other)| one.total_cmp(other));
        let Some((unit, _)) = first.filter(|(_, time)| *time <= end) else {
            return events;
        };
        let at = next[unit];
        next[unit] += 1;
        let stamp = ((logs[unit].time[at] - origin) * 1e6).round();
        if stamp.is_finite() && stamp >= 0.0 {
            let sample = Sample {
                time: stamp as u64,
                specific_force: logs[unit].specific_force[at].into(),
                angular_rate: logs[unit].angular_rate[at].into(),
            };
            monitor.push(unit, &sample, &mut events);
        }
    }
}
