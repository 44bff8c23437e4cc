//! The platform at rest, and when it is due to be evaluated.

use crate::real::Real;
use crate::redundancy::settings::EvaluationSettings;

/// How long the platform has rested, and when it was evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestState {
    windows: u64,
    announced: bool,
    evaluated: Option<u64>,
    commanded: bool,
    adopted: bool,
    /// A bit for each unit whose trigger has led to no fit yet.
    owed: u32,
    /// Whether this rest was evaluated for what is owed.
    tried: bool,
    /// Windows in succession without a rest, and all there were, before the first rest was evaluated.
    moved: u16,
    passed: u16,
    /// Whether a rest was evaluated.
    met: bool,
    /// Whether it has moved after a rest.
    has_moved: bool,
    /// Whether this rest was, and when one was the last time, microseconds.
    fresh: bool,
    latest: Option<u64>,
}

/// Windows in succession without a rest after which none is waited for, and windows of any kind.
const MOVES: u16 = 20;
const WAITED: u16 = 200;

/// What the means of a rest are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Purpose {
    /// To know who is well.
    Health,
    /// To tell of deviations too.
    Evaluation,
    /// To calibrate what deviates, too.
    Calibration,
}

/// What a window at rest, or in motion, led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestTransition {
    /// Nothing new: it still moves, or only just stopped.
    Moving,
    /// It came to rest: means are taken from the next window on.
    Began,
    /// It still rests.
    Resting,
    /// It moves again.
    Ended,
}

impl Default for RestState {
    fn default() -> Self {
        Self::new()
    }
}

impl RestState {
    /// Not at rest, and never evaluated.
    pub fn new() -> Self {
        Self {
            windows: 0,
            announced: false,
            evaluated: None,
            commanded: false,
            adopted: false,
            owed: 0,
            tried: false,
            moved: 0,
            passed: 0,
            met: false,
            has_moved: false,
            fresh: true,
            latest: None,
        }
    }

    /// Whether the first rest may still come at which physics speaks before anybody else does.
    pub fn is_awaited(&self) -> bool {
        !self.met && self.moved < MOVES && self.passed < WAITED
    }

    /// Whether the platform has moved for ten times as long and was never evaluated at rest.
    pub fn never_rested(&self) -> bool {
        !self.met && self.moved >= WAITED
    }

    /// A rest was evaluated; says whether it was the first.
    pub fn meet(&mut self) -> bool {
        !core::mem::replace(&mut self.met, true)
    }

    /// Whether this rest was not evaluated before.
    pub fn is_fresh(&self) -> bool {
        self.fresh
    }

    /// A rest was evaluated to the end.
    pub fn end_evaluation(&mut self) {
        self.fresh = false;
    }

    /// Time since the rest before was evaluated, microseconds; `None` of another evaluation of this one, and of the first.
    pub fn since_latest(&mut self, now: u64) -> Option<u64> {
        if !self.fresh {
            return None;
        }
        let before = self.latest.replace(now)?;
        Some(now.saturating_sub(before))
    }

    /// The platform was still over one more window, or was not.
    pub fn push(&mut self, still: bool, settle_windows: u64) -> RestTransition {
        self.passed = self.passed.saturating_add(1);
        // Single windows of motion may look still. Once it has moved for long enough, that stays so.
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

    /// Whether it was still over so many windows in succession: single windows of motion may look so.
    pub fn is_still_for(&self, windows: u64) -> bool {
        self.windows >= windows
    }

    /// Whether the platform rests.
    pub fn is_resting(&self) -> bool {
        self.announced
    }

    /// Evaluate as soon as can be.
    pub fn command(&mut self) {
        self.commanded = true;
    }

    /// Something was adopted: the next rest shows whether it was right.
    pub fn adopted(&mut self) {
        self.adopted = true;
    }

    /// A unit is to be calibrated; that stays so, whatever comes in between, until it is settled.
    pub fn triggered(&mut self, unit: usize) {
        self.owed |= bit(unit);
    }

    /// A fit was made of a unit, or none is wanted any more.
    pub fn settled(&mut self, unit: usize) {
        self.owed &= !bit(unit);
    }

    /// The wait for motion was in vain: what is owed is tried again at this very rest.
    pub fn retry(&mut self) {
        self.tried = false;
    }

    /// What the means of this rest are for. Without an evaluation after start-up, the first comes as long after it as
    /// others after one another; where none comes by itself, nothing is calibrated that was not asked for.
    /// `calibrated` are the units that are being calibrated.
    pub fn purpose<T: Real>(
        &mut self,
        time: u64,
        calibrated: impl Iterator<Item = usize>,
        settings: &EvaluationSettings<T>,
    ) -> Purpose {
        let owed = calibrated.fold(self.owed, |owed, unit| owed & !bit(unit));
        if self.evaluated.is_none() && !settings.evaluate_after_start {
            self.evaluated = Some(time);
        }
        let by_itself = match self.evaluated {
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

    /// It was evaluated.
    pub fn evaluated(&mut self, time: u64) {
        self.evaluated = Some(time);
        self.commanded = false;
        self.adopted = false;
        self.tried = true;
    }

    /// Windows are longer from now on: units that said nothing until now do. Before it has moved, rests begin anew.
    pub fn lengthen(&mut self) {
        self.evaluated = None;
        self.met &= self.has_moved;
        (self.moved, self.passed) = (0, 0);
    }

    /// The common clock jumped to this time.
    pub fn restart_time(&mut self, time: u64) {
        self.windows = 0;
        self.announced = false;
        for latest in [&mut self.evaluated, &mut self.latest].into_iter().flatten() {
            *latest = time;
        }
    }
}

/// The bit of a unit; none for those beyond count, which are not owed anything.
fn bit(unit: usize) -> u32 {
    u32::try_from(unit)
        .ok()
        .and_then(|unit| 1_u32.checked_shl(unit))
        .unwrap_or(0)
}
