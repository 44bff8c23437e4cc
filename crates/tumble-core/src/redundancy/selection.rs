//! Selection of the source of the output.
//!
//! The primary is the source while it is healthy. A source that has been unhealthy for a time is replaced. The
//! primary returns on command or after a proven time of health, not when it looks healthy for a moment.

use core::cmp::Ordering;

use crate::real::Real;
use crate::redundancy::optional_time::OptionalTime;
use crate::redundancy::settings::SelectionSettings;

/// Remaining use of an unhealthy unit, the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Condition {
    /// No sample has arrived for longer than samples may be late.
    Silent,
    /// The latest reading is unusable: not finite, or the same as many before it.
    Useless,
    /// Readings are sound, but of fewer axes than those of the primary.
    Lacking,
    /// An axis repeats its value.
    Stuck,
    /// Readings cannot be those of the configured unit.
    Refuted,
    /// Readings reach the end of their range sometimes.
    Saturated,
    /// Readings are wrong, but better than none.
    Doubtful,
}

/// Time for which a saturating source is kept, microseconds: shaking affects all units.
const SATURATED_HOLD: u64 = 200_000;

/// Time for which another unit must have been healthy to replace a saturating source, microseconds.
const CALM: u64 = 2_000_000;

/// Candidate for the source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourceCandidate<T: Real> {
    /// True if the unit is healthy.
    pub healthy: bool,
    /// Condition of the unit if it is not healthy.
    pub condition: Condition,
    /// Time for which the unit has been healthy, microseconds.
    pub healthy_for: u64,
    /// True if the unit is the primary, was calibrated against it, or agreed with it at the last rest.
    pub calibrated: bool,
    /// Known error, m/s^2; NaN ranks last.
    pub residual: T,
}

crate::vocabulary! {
    /// Reason for a change of the source.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum SelectionReason {
        /// There was no source, and the primary is usable.
        Start = "start",
        /// The primary was unhealthy for too long, or when a source was needed.
        PrimaryFailed = "primary failed",
        /// A secondary that was the source was unhealthy for too long.
        SourceFailed = "source failed",
        /// The primary has been healthy for long enough.
        PrimaryProven = "primary proven",
        /// A command selected the primary.
        Command = "command",
        /// The source failed, and no other unit is usable.
        NoneFit = "none fit",
    }
}

/// Change of the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// New source, 0 for the primary; `None` if no unit is usable.
    pub source: Option<usize>,
    /// Reason of the change.
    pub reason: SelectionReason,
}

/// Selected source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SelectedSource {
    /// No unit was selected yet.
    Unset,
    /// No unit was usable.
    Nobody,
    /// Number of the unit.
    MountedUnit(u8),
}

/// Selection of the source, with its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Selection {
    failing_since: OptionalTime,
    source: SelectedSource,
    commanded: bool,
}

impl Default for Selection {
    fn default() -> Self {
        Self::new()
    }
}

impl Selection {
    /// Creates a selection without a source.
    pub fn new() -> Self {
        Self {
            failing_since: OptionalTime::NONE,
            source: SelectedSource::Unset,
            commanded: false,
        }
    }

    /// Unit that is the source, 0 for the primary; `None` if there is none.
    pub fn source(&self) -> Option<usize> {
        match self.source {
            SelectedSource::MountedUnit(unit) => Some(unit.into()),
            SelectedSource::Unset | SelectedSource::Nobody => None,
        }
    }

    /// Requests the primary at the next update; if it is unhealthy then, the request is discarded.
    pub fn command_primary(&mut self) {
        self.commanded = true;
    }

    /// Keeps a usable primary as source; a command is discarded.
    pub fn keep_primary(&mut self) {
        self.commanded = false;
        self.failing_since = OptionalTime::NONE;
    }

    /// Returns whether there never was a source, and units have sent for less than `late`, microseconds.
    pub fn awaits_the_first(&mut self, now: u64, late: u64) -> bool {
        self.source == SelectedSource::Unset && !self.has_failed(now, late)
    }

    /// Restarts the time for which the source has failed, after a jump of time.
    pub fn restart_time(&mut self) {
        self.failing_since = OptionalTime::NONE;
    }

    /// Returns a change of the source, if any. `candidate` returns the unit of a number, 0 for the primary, and
    /// `None` behind the last one; only units that matter are requested, with most samples the source alone.
    /// `now` is the time of the set, microseconds. Units from number 255 on are ignored.
    pub fn update<T: Real>(
        &mut self,
        now: u64,
        candidate: &dyn Fn(usize) -> Option<SourceCandidate<T>>,
        settings: &SelectionSettings,
    ) -> Option<Change> {
        let commanded = core::mem::take(&mut self.commanded);
        let Some(source) = self.source() else {
            return self.begin(now, candidate, settings);
        };
        if source != 0
            && let Some(primary) = candidate(0).filter(|primary| primary.healthy)
        {
            if commanded {
                return Some(self.change(Some(0), SelectionReason::Command));
            }
            if settings
                .return_after
                .is_some_and(|after| primary.healthy_for >= after)
            {
                return Some(self.change(Some(0), SelectionReason::PrimaryProven));
            }
        }
        let current = candidate(source);
        if current.as_ref().is_some_and(|source| source.healthy) {
            self.failing_since = OptionalTime::NONE;
            return None;
        }
        let condition = current.map_or(Condition::Silent, |source| source.condition);
        let (hold, calm) = match condition {
            Condition::Saturated => (settings.hold.max(SATURATED_HOLD), CALM),
            _ => (settings.hold, 0),
        };
        if !self.has_failed(now, hold) {
            return None;
        }
        let fit = |unit: usize| {
            let candidate = candidate(unit)?;
            Some(SourceCandidate {
                healthy: candidate.healthy && candidate.healthy_for >= calm,
                ..candidate
            })
        };
        self.replace(source, condition, &fit, settings)
    }

    /// Selects any usable unit while there is no source; at the very start it waits for the primary.
    fn begin<T: Real>(
        &mut self,
        now: u64,
        candidate: &dyn Fn(usize) -> Option<SourceCandidate<T>>,
        settings: &SelectionSettings,
    ) -> Option<Change> {
        if candidate(0).is_some_and(|primary| primary.healthy) {
            return Some(self.change(Some(0), SelectionReason::Start));
        }
        let starting = self.source == SelectedSource::Unset;
        if starting && !self.has_failed(now, settings.hold) {
            return None;
        }
        match best_secondary(candidate, settings).or_else(|| best_of_unfit(candidate, settings)) {
            Some(best) => Some(self.change(Some(best), SelectionReason::PrimaryFailed)),
            None => starting.then(|| self.change(None, SelectionReason::NoneFit)),
        }
    }

    fn has_failed(&mut self, now: u64, hold: u64) -> bool {
        let since = now.min(self.failing_since.get_or_insert(now));
        self.failing_since.replace(since);
        now - since >= hold
    }

    /// Replaces a failed source. Other secondaries come first, a primary that failed before comes last. If no
    /// unit is usable, a source with readings stays; one without readings is replaced by any with readings, and
    /// a refuted one by a better one.
    fn replace<T: Real>(
        &mut self,
        failed: usize,
        condition: Condition,
        candidate: &dyn Fn(usize) -> Option<SourceCandidate<T>>,
        settings: &SelectionSettings,
    ) -> Option<Change> {
        let primary = candidate(0).filter(|primary| primary.healthy).map(|_| 0);
        let unfit = || {
            best_of_unfit(candidate, settings).filter(|unit| {
                let better = candidate(*unit).is_some_and(|unit| unit.condition > condition);
                *unit != failed && better && condition <= Condition::Refuted
            })
        };
        match best_secondary(candidate, settings).or(primary).or_else(unfit) {
            Some(next) if failed == 0 => Some(self.change(Some(next), SelectionReason::PrimaryFailed)),
            Some(next) => Some(self.change(Some(next), SelectionReason::SourceFailed)),
            None if condition == Condition::Silent => Some(self.change(None, SelectionReason::NoneFit)),
            None => None,
        }
    }

    fn change(&mut self, source: Option<usize>, reason: SelectionReason) -> Change {
        self.failing_since = OptionalTime::NONE;
        self.source = source
            .and_then(|unit| u8::try_from(unit).ok())
            .map_or(SelectedSource::Nobody, SelectedSource::MountedUnit);
        Change { source, reason }
    }
}

/// Best healthy secondary: a calibrated one before others, then the smallest residual, then the lowest number.
fn best_secondary<T: Real>(
    candidate: &dyn Fn(usize) -> Option<SourceCandidate<T>>,
    settings: &SelectionSettings,
) -> Option<usize> {
    let mut best: Option<(usize, SourceCandidate<T>)> = None;
    let secondaries = 1..usize::from(u8::MAX);
    for (unit, secondary) in secondaries.map_while(|unit| Some((unit, candidate(unit)?))) {
        let fit = secondary.healthy && (secondary.calibrated || !settings.calibrated_only);
        if fit && best.is_none_or(|(_, other)| is_better(&secondary, &other)) {
            best = Some((unit, secondary));
        }
    }
    best.map(|(unit, _)| unit)
}

/// Best unhealthy unit with readings: the best condition, the primary before the others.
fn best_of_unfit<T: Real>(
    candidate: &dyn Fn(usize) -> Option<SourceCandidate<T>>,
    settings: &SelectionSettings,
) -> Option<usize> {
    let mut best: Option<(usize, SourceCandidate<T>)> = None;
    let units = 0..usize::from(u8::MAX);
    for (number, unit) in units.map_while(|number| Some((number, candidate(number)?))) {
        let passed_over = settings.calibrated_only && !unit.calibrated;
        if passed_over || unit.condition <= Condition::Useless {
            continue;
        }
        let beats = |other: SourceCandidate<T>| match unit.condition.cmp(&other.condition) {
            Ordering::Greater => true,
            Ordering::Equal => is_better(&unit, &other),
            Ordering::Less => false,
        };
        if best.is_none_or(|(_, other)| beats(other)) {
            best = Some((number, unit));
        }
    }
    best.map(|(number, _)| number)
}

/// Compares two candidates. A residual of NaN was never measured, and ranks last.
fn is_better<T: Real>(a: &SourceCandidate<T>, b: &SourceCandidate<T>) -> bool {
    if a.calibrated != b.calibrated {
        return a.calibrated;
    }
    a.residual < b.residual || (a.residual.is_finite() && !b.residual.is_finite())
}

#[cfg(test)]
#[path = "selection_tests.rs"]
mod tests;
