//! What witnesses from outside say of the motion of the set.

use crate::real::Real;
use crate::redundancy::monitor::event::{Event, EventKind};
use crate::redundancy::monitor::{Monitor, Report};
use crate::redundancy::witness::{Testimony, Trust, Witness, WitnessRejection};

/// What was heard of witnesses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hearing<T: Real, const UNITS: usize> {
    /// Once there was any.
    pub testimony: Option<Testimony<T, UNITS>>,
    /// How often what one said was left out, and a bit for each reason that was told of.
    left_out: u32,
    told: u8,
}

impl<T: Real, const UNITS: usize> Hearing<T, UNITS> {
    /// Nothing.
    pub fn none() -> Self {
        Self {
            testimony: None,
            left_out: 0,
            told: 0,
        }
    }

    fn listen(&mut self, time: u64, witness: &Witness<T>) -> Result<Option<Trust<T>>, WitnessRejection> {
        witness.check(UNITS)?;
        self.testimony
            .get_or_insert_with(Testimony::new)
            .take(time, witness)
    }

    /// Counts what is left out; whether its reason is new.
    fn leave_out(&mut self, why: WitnessRejection) -> bool {
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
    pub fn witness(&mut self, time: u64, witness: &Witness<T>, report: Report<'_, T>) {
        let [hearing] = &mut self.hearing;
        let kind = match hearing.listen(time, witness) {
            Ok(None) => return,
            Ok(Some(Trust::Lost { misfit, limit })) => EventKind::WitnessDistrusted { misfit, limit },
            Ok(Some(Trust::Regained)) => EventKind::WitnessTrusted,
            Err(why) => match hearing.leave_out(why) {
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
        let [hearing] = &self.hearing;
        hearing.left_out
    }
}
