//! Aiding measurements of the motion of the set.

use crate::real::Real;
use crate::redundancy::aiding::{Aiding, AidingEvidence, AidingRejection, Trust};
use crate::redundancy::monitor::event::{Event, EventKind};
use crate::redundancy::monitor::{Monitor, Report};
use crate::redundancy::unit_count::{UnitCount, Units};

/// State of aiding measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AidingChannel<T: Real, const UNITS: usize> {
    /// Evidence, once there was a measurement.
    pub aiding_evidence: Option<AidingEvidence<T, UNITS>>,
    /// Number of rejected measurements, and one bit for each reason reported.
    left_out: u32,
    reported: u8,
}

impl<T: Real, const UNITS: usize> AidingChannel<T, UNITS> {
    /// Creates the state without a measurement.
    pub fn none() -> Self {
        Self {
            aiding_evidence: None,
            left_out: 0,
            reported: 0,
        }
    }

    /// Resets to the state without a measurement, in place.
    pub fn reset(&mut self) {
        let Self {
            aiding_evidence,
            left_out,
            reported,
        } = self;
        *aiding_evidence = None;
        (*left_out, *reported) = (0, 0);
    }

    fn process(&mut self, time: u64, aiding: &Aiding<T>) -> Result<Option<Trust<T>>, AidingRejection> {
        aiding.check(UNITS)?;
        self.aiding_evidence
            .get_or_insert_with(AidingEvidence::new)
            .take(time, aiding)
    }

    /// Counts a rejected measurement; returns whether its reason is new.
    fn leave_out(&mut self, why: AidingRejection) -> bool {
        self.left_out = self.left_out.saturating_add(1);
        let bit = 1_u8.checked_shl(why as u32).unwrap_or(0);
        let reported = self.reported & bit != 0;
        self.reported |= bit;
        !reported
    }
}

impl<T: Real, const UNITS: usize, const AT_ONCE: usize> Monitor<T, UNITS, AT_ONCE, 1>
where
    Units<UNITS>: UnitCount,
{
    /// Processes an aiding measurement of a time, microseconds of the common clock: the time of measurement,
    /// not of arrival. It may be up to a second old. A measurement that cannot be used is rejected, and an
    /// event reports each reason once.
    pub fn aiding(&mut self, time: u64, aiding: &Aiding<T>, report: Report<'_, T>) {
        let [aiding_channel] = &mut self.aiding_channel;
        let kind = match aiding_channel.process(time, aiding) {
            Ok(None) => return,
            Ok(Some(Trust::Lost { misfit, limit })) => EventKind::AidingDistrusted { misfit, limit },
            Ok(Some(Trust::Regained)) => EventKind::AidingTrusted,
            Err(why) => match aiding_channel.leave_out(why) {
                true => EventKind::AidingLeftOut { why },
                false => return,
            },
        };
        report(Event {
            time: self.clock.now().unwrap_or(time),
            unit: 0,
            kind,
        });
    }

    /// Number of rejected aiding measurements.
    pub fn aiding_measurements_left_out(&self) -> u32 {
        let [aiding_channel] = &self.aiding_channel;
        aiding_channel.left_out
    }
}
