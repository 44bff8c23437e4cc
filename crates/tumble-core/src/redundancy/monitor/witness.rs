//! What witnesses from outside say of the motion of the set.

use crate::real::Real;
use crate::redundancy::monitor::event::{Event, EventKind};
use crate::redundancy::monitor::{Monitor, Report};
use crate::redundancy::witness::{Trust, Witness, WitnessRejection};

impl<T: Real, const UNITS: usize, const AT_ONCE: usize> Monitor<T, UNITS, AT_ONCE> {
    /// Takes in what something else on board says of a time, microseconds of the common clock: that at which it was so, not at
    /// which it came. It may be up to a second old. What cannot be used is left out, and an event says why, once for each
    /// reason.
    pub fn witness(&mut self, time: u64, witness: &Witness<T>, report: Report<'_, T>) {
        let kind = match self.judge.listen(time, witness) {
            Ok(None) => return,
            Ok(Some(Trust::Lost { misfit, limit })) => EventKind::WitnessDistrusted { misfit, limit },
            Ok(Some(Trust::Regained)) => EventKind::WitnessTrusted,
            Err(why) => match self.leave_out(why) {
                true => EventKind::WitnessLeftOut { why },
                false => return,
            },
        };
        report(Event {
            time: self.clock.now().unwrap_or(time),
            unit: 0,
            kind,
        });
    }

    /// How often what a witness said was left out.
    pub fn witnesses_left_out(&self) -> u32 {
        self.witnesses_left_out
    }

    /// Counts what is left out; whether its reason is new.
    fn leave_out(&mut self, why: WitnessRejection) -> bool {
        self.witnesses_left_out = self.witnesses_left_out.saturating_add(1);
        let bit = 1_u8.checked_shl(why as u32).unwrap_or(0);
        let told = self.left_out_told & bit != 0;
        self.left_out_told |= bit;
        !told
    }
}
