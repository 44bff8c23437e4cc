//! Aiding measurements of the motion of the set.

use crate::real::Real;
use crate::redundancy::aiding::{Aiding, AidingEvidence, AidingRejection, Trust};
use crate::redundancy::monitor::event::{Event, EventKind};
use crate::redundancy::monitor::{Monitor, Report};

/// What was heard of aiding measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AidingChannel<T: Real, const UNITS: usize> {
    /// Once there was any.
    pub aiding_evidence: Option<AidingEvidence<T, UNITS>>,
    /// How often what one said was left out, and a bit for each reason that was told of.
    left_out: u32,
    told: u8,
}

impl<T: Real, const UNITS: usize> AidingChannel<T, UNITS> {
    /// Nothing.
    pub fn none() -> Self {
        Self {
            aiding_evidence: None,
            left_out: 0,
            told: 0,
        }
    }

    fn listen(&mut self, time: u64, aiding: &Aiding<T>) -> Result<Option<Trust<T>>, AidingRejection> {
        aiding.check(UNITS)?;
        self.aiding_evidence
            .get_or_insert_with(AidingEvidence::new)
            .take(time, aiding)
    }

    /// Counts what is left out; whether its reason is new.
    fn leave_out(&mut self, why: AidingRejection) -> bool {
        self.left_out = self.left_out.saturating_add(1);
        let bit = 1_u8.checked_shl(why as u32).unwrap_or(0);
        let told = self.told & bit != 0;
        self.told |= bit;
        !told
    }
}

impl<T: Real, const UNITS: usize, const AT_ONCE: usize> Monitor<T, UNITS, AT_ONCE, 1> {
    /// Takes in what something else on board says of a time, microseconds of the common clock: that at which it was so, not at
    /// which it came. It may be up to a second old. What cannot be used is left out, and an event says why, once for each
    /// reason.
    pub fn aiding(&mut self, time: u64, aiding: &Aiding<T>, report: Report<'_, T>) {
        let [aiding_channel] = &mut self.aiding_channel;
        let kind = match aiding_channel.listen(time, aiding) {
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

    /// How often what an aiding measurement said was left out.
    pub fn aiding_measurements_left_out(&self) -> u32 {
        let [aiding_channel] = &self.aiding_channel;
        aiding_channel.left_out
    }
}
