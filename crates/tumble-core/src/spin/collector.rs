//! From samples to the estimator: blocks, heading, and what no sample may be.

use crate::products::Length;
use crate::real::{Real, real, seconds};
use crate::sample::{CHANNELS, Sample};
use crate::spin::block::{Block, BlockBuilder};
use crate::spin::estimate::{SpinEstimate, TrueAngle};
use crate::spin::estimator::SpinEstimator;
use crate::spin::failure::SpinFailure;
use crate::spin::level_free::LevelFree;
use crate::spin::settings::SpinSettings;
use crate::spin::solve::{self, SolvedFor, Solving, SpinSolver};

/// Gathers samples into blocks and blocks into the estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collector<T: Real> {
    blocks: BlockBuilder<T>,
    estimator: SpinEstimator<T>,
    solver: SpinSolver<T>,
    correct_at: T,
    saturated: u32,
}

/// Samples at the end of the range that are not yet a failure: a single one may be a spike.
const SPIKES: u32 = 3;

/// Heading is corrected after every sixth of a turn, while a first derivative still describes its errors.
const CORRECTED_EVERY: f64 = core::f64::consts::FRAC_PI_3;

impl<T: Real> Collector<T> {
    /// Nothing seen yet.
    pub fn new(settings: &SpinSettings<T>) -> Self {
        Self {
            blocks: BlockBuilder::new(settings.block),
            estimator: SpinEstimator::new(settings),
            solver: SpinSolver::new(),
            correct_at: real(CORRECTED_EVERY),
            saturated: 0,
        }
    }

    /// Forgets everything: in its place, since it is larger than the stack of many a task.
    #[inline(never)]
    pub fn restart(&mut self) {
        let settings = *self.estimator.settings();
        self.blocks = BlockBuilder::new(settings.block);
        self.estimator.restart();
        self.solver.stop();
        self.correct_at = real(CORRECTED_EVERY);
        self.saturated = 0;
    }

    /// Sums kept so far.
    pub fn estimator(&self) -> &SpinEstimator<T> {
        &self.estimator
    }

    /// The same as [`SpinEstimator::know_bias_instability`].
    pub fn know_bias_instability(&mut self, specific_force: T, angular_rate: T) {
        self.estimator.know_bias_instability(specific_force, angular_rate);
        self.solver.stop();
    }

    /// The same as [`SpinEstimator::know_row_factor`].
    pub fn know_row_factor(&mut self, factor: T) {
        self.estimator.know_row_factor(factor);
        self.solver.stop();
    }

    /// Takes in a sample; gives back the block it completes, to be given to [`Self::take`] when it is known whether the
    /// robot stood still over it. A sample that is not finite, or not later than the one before, is skipped.
    ///
    /// # Errors
    /// [`SpinFailure::Saturated`]; while turning also [`SpinFailure::SamplesMissing`] and [`SpinFailure::SampleRateTooLow`].
    pub fn push(&mut self, sample: &Sample<T>) -> Result<Option<Block<T>>, SpinFailure<T>> {
        let before = self.blocks.last_time();
        if !sample.is_finite() || before.is_some_and(|before| sample.time <= before) {
            return Ok(None);
        }
        self.go_on_with_heading();
        self.check_range(sample)?;
        if let Some(before) = before {
            self.check_step(sample, before)?;
        }
        self.estimator.watch_reading(sample);
        Ok(self.blocks.push(sample))
    }

    /// The block at hand, ended early: where a rest begins or ends at a known time.
    pub fn cut(&mut self) -> Option<Block<T>> {
        self.blocks.close()
    }

    /// Takes in a block, and whether the robot stood still over it.
    ///
    /// # Errors
    /// Those of [`SpinEstimator::push`].
    pub fn take(&mut self, block: &Block<T>, resting: bool) -> Result<(), SpinFailure<T>> {
        self.estimator.push(block, resting)?;
        self.follow();
        Ok(())
    }

    /// Ends a rest: heading is counted from here on.
    pub fn end_stop(&mut self) {
        self.estimator.end_stop();
        self.follow();
    }

    /// Solves for everything seen so far, at once; also gives the fit, for those who draw it.
    ///
    /// # Errors
    /// Those of [`SpinSolver::step`].
    pub fn solve(
        &self,
        true_angle: Option<&TrueAngle<T>>,
    ) -> Result<(SpinEstimate<T>, LevelFree<T>), SpinFailure<T>> {
        solve::solve(&self.estimator, true_angle)
    }

    /// Solves for everything seen so far, at once, with the memory of the slices instead of the stack, and hands it to
    /// `take`. Slices that were under way begin anew.
    ///
    /// # Errors
    /// Those of [`SpinSolver::step`].
    pub fn solve_in_place(
        &mut self,
        true_angle: Option<&TrueAngle<T>>,
        take: impl FnOnce(&SpinEstimate<T>),
    ) -> Result<(), SpinFailure<T>> {
        let under_way = self.solver.under_way();
        let solved = if self.solver.has_solved(true_angle) {
            Ok(())
        } else {
            self.solve_all(true_angle)
        };
        let taken = solved.and_then(|()| self.give(take).ok_or(SpinFailure::Unsolvable));
        if let Some((solved_for, true_angle)) = under_way {
            self.solver.begin(solved_for, true_angle.as_ref());
        }
        taken
    }

    // Apart, so that the stack of an estimate is not under that of a fit.
    #[inline(never)]
    fn give(&self, take: impl FnOnce(&SpinEstimate<T>)) -> Option<()> {
        take(&self.solver.estimate(&self.estimator)?);
        Some(())
    }

    // Apart, so that its stack is not under that of the estimate.
    #[inline(never)]
    fn solve_all(&mut self, true_angle: Option<&TrueAngle<T>>) -> Result<(), SpinFailure<T>> {
        self.solver.begin(SolvedFor::Estimate, true_angle);
        while self.solver.step(&self.estimator)? == Solving::GoesOn {}
        Ok(())
    }

    /// Begins to solve for everything, slice by slice.
    pub fn begin_to_solve(&mut self) {
        self.solver.begin(SolvedFor::Estimate, None);
    }

    /// Does a slice of what [`Self::begin_to_solve`] began.
    ///
    /// # Errors
    /// Those of [`SpinSolver::step`].
    pub fn go_on(&mut self) -> Result<Solving<T>, SpinFailure<T>> {
        self.solver.step(&self.estimator)
    }

    /// Result of the slices without a true angle; `None` before the last.
    pub fn solved(&self) -> Option<SpinEstimate<T>> {
        if !self.solver.has_solved(None) {
            return None;
        }
        self.solver.estimate(&self.estimator)
    }

    /// A slice with each sample, of what a sixth of a turn began.
    fn go_on_with_heading(&mut self) {
        // Where nothing can be solved yet, heading is counted on as it was.
        if let Ok(Solving::Heading(by_heading, by_time)) = self.solver.step(&self.estimator) {
            self.estimator.correct_heading(by_heading, by_time);
        }
    }

    fn follow(&mut self) {
        let turned = self.estimator.turned().angle();
        if turned >= self.correct_at && !self.solver.is_busy() {
            self.correct_at = turned + real(CORRECTED_EVERY);
            self.solver.begin(SolvedFor::Heading, None);
        }
        let lost = self.estimator.take_lost_heading();
        if let Some(reference) = self.estimator.heading_reference() {
            self.blocks.refer_heading(*reference, lost);
        }
    }

    fn check_range(&mut self, sample: &Sample<T>) -> Result<(), SpinFailure<T>> {
        let settings = self.estimator.settings();
        let ranges = [settings.specific_force_range, settings.angular_rate_range];
        let mut worst = None;
        for (channel, value) in sample.channels().into_iter().enumerate() {
            let range = if channel < CHANNELS / 2 {
                ranges[0]
            } else {
                ranges[1]
            };
            if range.is_some_and(|range| value.abs() >= range) {
                worst = Some((channel, value));
            }
        }
        let Some((channel, value)) = worst else {
            return Ok(());
        };
        self.saturated += 1;
        if self.saturated < SPIKES {
            return Ok(());
        }
        Err(SpinFailure::Saturated {
            time: sample.time,
            channel,
            value,
        })
    }

    fn check_step(&self, sample: &Sample<T>, before: u64) -> Result<(), SpinFailure<T>> {
        let settings = self.estimator.settings();
        let Some(reference) = self.estimator.heading_reference() else {
            return Ok(());
        };
        let pause = sample.time.saturating_sub(before);
        let interval = seconds::<T>(pause);
        if pause > settings.longest_gap {
            return Err(SpinFailure::SamplesMissing {
                time: before,
                gap: interval,
            });
        }
        let rate = (sample.angular_rate - reference.bias).length();
        if rate * interval > settings.largest_step {
            return Err(SpinFailure::SampleRateTooLow {
                rate: T::one() / interval,
                needed: rate / settings.largest_step,
            });
        }
        Ok(())
    }
}
