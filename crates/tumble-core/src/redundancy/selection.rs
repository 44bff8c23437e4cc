//! Which unit is the source of the output.
//!
//! The primary, as long as it is healthy. A source that has been unhealthy for a while is replaced; the primary comes
//! back on command or after a proven spell of health, and not because it looks well for a moment.

use core::cmp::Ordering;

use crate::real::Real;
use crate::redundancy::settings::SelectionSettings;

/// What is left of a unit that is not healthy, the worse first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Condition {
    /// Nothing, and for longer than samples may be late.
    Silent,
    /// Its latest reading is of no use: no number, or the same as many before it.
    Useless,
    /// Sound readings on fewer axes than the primary has.
    Lacking,
    /// An axis of it says the same all the time.
    Stuck,
    /// Readings that cannot be those of the unit that it is said to be.
    Refuted,
    /// Its readings are at the end of their range now and then.
    Saturated,
    /// Readings that are wrong, but better than none.
    Doubtful,
}

/// A source that saturates is kept for so long, microseconds: what shakes one shakes all.
const SATURATED_HOLD: u64 = 200_000;

/// How long another has to have been healthy to take over from one that saturates, microseconds.
const CALM: u64 = 2_000_000;

/// A unit that may become the source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourceCandidate<T: Real> {
    /// Whether it is.
    pub healthy: bool,
    /// What it is like where it is not.
    pub condition: Condition,
    /// For how long it has been healthy, microseconds.
    pub healthy_for: u64,
    /// Whether it is the primary, was calibrated against it, or agreed with it at the last rest.
    pub calibrated: bool,
    /// What it is off by, as far as is known, m/s^2: smaller is better, and not a number worst.
    pub residual: T,
}

crate::vocabulary! {
    /// Why the source changed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum SelectionReason {
        /// There was no source, and the primary is fit.
        Start = "start",
        /// The primary was unhealthy for too long, or was so when a source was wanted.
        PrimaryFailed = "primary failed",
        /// A secondary that was the source was unhealthy for too long.
        SourceFailed = "source failed",
        /// The primary has been healthy for long enough.
        PrimaryProven = "primary proven",
        /// The primary was asked for.
        Command = "command",
        /// The source failed, and nobody else is fit.
        NoneFit = "none fit",
    }
}

/// A change of the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// Unit that is the source now, 0 the primary; `None` where nobody is fit.
    pub source: Option<usize>,
    /// Why.
    pub reason: SelectionReason,
}

/// Who the source is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SelectedSource {
    /// Never chosen.
    Unset,
    /// Nobody was fit.
    Nobody,
    /// This unit.
    MountedUnit(u8),
}

/// Chooses the source, and keeps to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Selection {
    failing_since: Option<u64>,
    source: SelectedSource,
    commanded: bool,
}

impl Default for Selection {
    fn default() -> Self {
        Self::new()
    }
}

impl Selection {
    /// Nobody yet.
    pub fn new() -> Self {
        Self {
            failing_since: None,
            source: SelectedSource::Unset,
            commanded: false,
        }
    }

    /// The unit that is the source, 0 the primary; `None` where nobody is.
    pub fn source(&self) -> Option<usize> {
        match self.source {
            SelectedSource::MountedUnit(unit) => Some(unit.into()),
            SelectedSource::Unset | SelectedSource::Nobody => None,
        }
    }

    /// Asks for the primary at the next update; it takes over there if it is healthy, or else the asking is forgotten.
    pub fn command_primary(&mut self) {
        self.commanded = true;
    }

    /// The primary is the source and fit to be: it stays, whatever is asked for.
    pub fn keep_primary(&mut self) {
        self.commanded = false;
        self.failing_since = None;
    }

    /// Forgets for how long the source has been failing, which a jump of time makes meaningless.
    pub fn restart_time(&mut self) {
        self.failing_since = None;
    }

    /// Says whether the source changes. `candidate` gives the unit of a number, 0 the primary, and none behind the last;
    /// only those are asked for that matter, with every sample mostly the source alone. `now` is the time of the set,
    /// microseconds. Units from number 255 on are not looked at.
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
            self.failing_since = None;
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

    /// Until there is a source, whoever is fit becomes it; the primary is waited for at the very start.
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
        let since = self.failing_since.get_or_insert(now);
        *since = now.min(*since);
        now - *since >= hold
    }

    /// Other secondaries first: a primary that failed before and was not called back comes last. Where nobody is fit, what still
    /// says something stays; one that says nothing gives way to any that does, and one that cannot be right to a better one.
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
        self.failing_since = None;
        self.source = source
            .and_then(|unit| u8::try_from(unit).ok())
            .map_or(SelectedSource::Nobody, SelectedSource::MountedUnit);
        Change { source, reason }
    }
}

/// The healthy secondary that is calibrated, or else any; of these the one with the smallest residual, or else the first.
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

/// Where nobody is fit, the one that is in the best condition of those that say anything, the primary before the others.
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

/// A residual that is not a number was never measured, and is worse than any.
fn is_better<T: Real>(a: &SourceCandidate<T>, b: &SourceCandidate<T>) -> bool {
    if a.calibrated != b.calibrated {
        return a.calibrated;
    }
    a.residual < b.residual || (a.residual.is_finite() && !b.residual.is_finite())
}

#[cfg(test)]
#[path = "selection_tests.rs"]
mod tests;
