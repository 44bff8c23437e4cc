//! State of rest of the platform, and due times of evaluations.

use crate::real::Real;
use crate::redundancy::optional_time::OptionalTime;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::EvaluationSettings;

/// Duration of the rest, and time of its evaluation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestState {
    windows: u64,
    announced: bool,
    evaluated: OptionalTime,
    commanded: bool,
    adopted: bool,
    /// Units whose trigger has not led to a fit yet, one bit each.
    owed: u32,
    /// True if this rest was evaluated for those units.
    tried: bool,
    /// Successive windows without a rest, and all windows, before the evaluation of the first rest.
    moved: u16,
    passed: u16,
    /// True if a rest was evaluated.
    met: bool,
    /// True if the platform moved after a rest.
    has_moved: bool,
    /// True if this rest was not evaluated yet, and the time of the latest evaluation, microseconds.
    fresh: bool,
    latest: OptionalTime,
    /// True for a sensor of the primary that deviated at the latest rest.
    deviates: [bool; 2],
}

/// Successive windows without a rest, and windows in all, after which no first rest is expected.
const MOVES: u16 = 20;
const WAITED: u16 = 200;

/// Purpose of the means of a rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Purpose {
    /// Health only.
    Health,
    /// Health and reports of deviations.
    Evaluation,
    /// Health, reports and calibrations.
    Calibration,
}

/// Transition that a window causes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestTransition {
    /// The platform moves, or stopped only just.
    Moving,
    /// A rest began: means start with the next window.
    Began,
    /// The rest continues.
    Resting,
    /// The rest ended.
    Ended,
}

impl Default for RestState {
    fn default() -> Self {
        Self::new()
    }
}

impl RestState {
    /// Creates the state of a platform that moves and was never evaluated.
    pub fn new() -> Self {
        Self {
            windows: 0,
            announced: false,
            evaluated: OptionalTime::NONE,
            commanded: false,
            adopted: false,
            owed: 0,
            tried: false,
            moved: 0,
            passed: 0,
            met: false,
            has_moved: false,
            fresh: true,
            latest: OptionalTime::NONE,
            deviates: [false; 2],
        }
    }

    /// Notes whether a sensor of the primary deviates at this rest; returns whether it did otherwise at the one before.
    pub fn shows(&mut self, sensor: Sensor, deviates: bool) -> bool {
        core::mem::replace(sensor.of_mut(&mut self.deviates), deviates) != deviates
    }

    /// Returns whether a first rest may still come, at which physics decides before units are compared.
    pub fn is_awaited(&self) -> bool {
        !self.met && self.moved < MOVES && self.passed < WAITED
    }

    /// Returns whether the platform has moved for ten times that long without an evaluated rest.
    pub fn never_rested(&self) -> bool {
        !self.met && self.moved >= WAITED
    }

    /// Marks that a rest was evaluated; returns whether it was the first.
    pub fn meet(&mut self) -> bool {
        !core::mem::replace(&mut self.met, true)
    }

    /// Returns whether this rest was not evaluated before.
    pub fn is_fresh(&self) -> bool {
        self.fresh
    }

    /// Marks that the evaluation of the rest is complete.
    pub fn end_evaluation(&mut self) {
        self.fresh = false;
    }

    /// Time since the evaluation of the previous rest, microseconds; `None` if this rest was evaluated before
    /// or is the first.
    pub fn since_latest(&mut self, now: u64) -> Option<u64> {
        if !self.fresh {
            return None;
        }
        let before = self.latest.replace(now)?;
        Some(now.saturating_sub(before))
    }

    /// Updates the state with a window, which is still or not.
    pub fn push(&mut self, still: bool, settle_windows: u64) -> RestTransition {
        self.passed = self.passed.saturating_add(1);
        // Single windows of motion may look still. After enough motion the count stays.
        if !self.announced {
            self.moved = self.moved.saturating_add(1);
        } else if self.moved < MOVES {
            self.moved = 0;
        }
        if !still {
            self.windows = 0;
            return if core::mem::take(&mut self.announced) {
                self.has_moved = true;
                RestTransition::Ended
            } else {
                RestTransition::Moving
            };
        }
        self.windows = self.windows.saturating_add(1);
        if self.announced {
            return RestTransition::Resting;
        }
        if self.windows <= settle_windows {
            return RestTransition::Moving;
        }
        self.announced = true;
        self.tried = false;
        self.fresh = true;
        RestTransition::Began
    }

    /// Returns whether the platform was still over so many successive windows; single windows of motion may
    /// look still.
    pub fn is_still_for(&self, windows: u64) -> bool {
        self.windows >= windows
    }

    /// Returns whether the platform rests.
    pub fn is_resting(&self) -> bool {
        self.announced
    }

    /// Requests an evaluation as soon as possible.
    pub fn command(&mut self) {
        self.commanded = true;
    }

    /// Requests an evaluation of an adopted calibration at the next rest.
    pub fn adopted(&mut self) {
        self.adopted = true;
    }

    /// Marks a unit for calibration until it is settled.
    pub fn triggered(&mut self, unit: usize) {
        self.owed |= bit(unit);
    }

    /// Marks a unit as fitted, or as needing no fit.
    pub fn settled(&mut self, unit: usize) {
        self.owed &= !bit(unit);
    }

    /// Allows another attempt at this rest after a wait for motion in vain.
    pub fn retry(&mut self) {
        self.tried = false;
    }

    /// Purpose of the means of this rest. If there is no evaluation after start-up, the first one comes after
    /// the usual interval; if evaluations come only on command, only commanded ones calibrate. `calibrated` are
    /// the units under calibration.
    pub fn purpose<T: Real>(
        &mut self,
        time: u64,
        calibrated: impl Iterator<Item = usize>,
        settings: &EvaluationSettings<T>,
    ) -> Purpose {
        let owed = calibrated.fold(self.owed, |owed, unit| owed & !bit(unit));
        if self.evaluated.get().is_none() && !settings.evaluate_after_start {
            self.evaluated.replace(time);
        }
        let by_itself = match self.evaluated.get() {
            None => true,
            Some(last) => settings
                .evaluate_every
                .is_some_and(|every| time.saturating_sub(last) >= every),
        };
        match (by_itself || self.adopted, settings.evaluate_every) {
            _ if self.commanded || (owed != 0 && !self.tried) => Purpose::Calibration,
            (false, _) => Purpose::Health,
            (true, None) => Purpose::Evaluation,
            (true, Some(_)) => Purpose::Calibration,
        }
    }

    /// Marks this rest as evaluated.
    pub fn evaluated(&mut self, time: u64) {
        self.evaluated.replace(time);
        self.commanded = false;
        self.adopted = false;
        self.tried = true;
    }

    /// Restarts the wait for the first rest because windows are longer now and more units complete them.
    pub fn lengthen(&mut self) {
        self.evaluated = OptionalTime::NONE;
        self.met &= self.has_moved;
        (self.moved, self.passed) = (0, 0);
    }

    /// Restarts the times after a jump of the common clock.
    pub fn restart_time(&mut self, time: u64) {
        self.windows = 0;
        self.announced = false;
        for latest in [&mut self.evaluated, &mut self.latest] {
            if latest.get().is_some() {
                latest.replace(time);
            }
        }
    }
}

/// Bit of a unit; zero for numbers beyond 31.
fn bit(unit: usize) -> u32 {
    u32::try_from(unit)
        .ok()
        .and_then(|unit| 1_u32.checked_shl(unit))
        .unwrap_or(0)
}
