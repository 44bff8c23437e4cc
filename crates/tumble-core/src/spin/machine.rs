//! The procedure on a device: `Idle -> Still -> Spin -> Done | Failed(why)`.
//!
//! It does not command the robot but reports the state that it waits for. Standing still is judged by scatter and by
//! the specific force staying where it was, never by the level of the rate: a bias may be as large as it likes. A slow
//! constant turn looks like rest to these; the wheels' state, where given with a sample, decides instead, and where it
//! is not given the harmonics show it afterwards.

use crate::products::Length;
use crate::real::{Real, real, seconds};
use crate::sample::Sample;
use crate::spin::block::Block;
use crate::spin::collector::Collector;
use crate::spin::estimate::{SpinEstimate, TrueAngle};
use crate::spin::failure::SpinFailure;
use crate::spin::settings::SpinSettings;
use crate::spin::solve::Solving;
use crate::stillness::{Scatter, Stillness};

/// State of the wheels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wheels {
    /// The state is not known.
    Unknown,
    /// They stand still, and so does the robot.
    Stopped,
    /// At least one turns.
    Turning,
}

crate::vocabulary! {
    /// Where the procedure is.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum SpinState<T: Real> {
        /// Not started.
        Idle = "idle",
        /// Waits for the robot to stand still, and gathers while it does.
        Still = "still",
        /// Waits for the robot to turn on the spot, and gathers.
        Spin = "spin",
        /// It turned far enough, and is solved slice by slice, with each sample or call of [`SpinMachine::work`].
        Solving = "solving",
        /// The result can be had from [`SpinMachine::solve`].
        Done = "done",
        /// There is no result; a calibration from before stays.
        Failed(SpinFailure<T>) = "failed",
    }
}

crate::vocabulary! {
    /// Events of a spin.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum SpinEvent {
        /// The robot has come to stand.
        StillBegan = "still began",
        /// It moved before it had stood long enough; waiting begins anew.
        StillBroken = "still broken",
        /// It stood long enough: turn it now.
        StillDone = "still done",
        /// It has begun to turn.
        SpinBegan = "spin began",
        /// It turned far enough and the result is there.
        Done = "done",
        /// [`SpinState::Failed`] gives the reason.
        Failed = "failed",
    }
}

/// Progress of the procedure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinProgress<T: Real> {
    /// Time stood still, s.
    pub still: T,
    /// Angle turned, both directions, rad.
    pub turned: T,
    /// Rate about the vertical over the block before, rad/s.
    pub rate: T,
    /// True if the robot stood still over the block before.
    pub at_rest: bool,
}

/// The state machine. All its memory is in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinMachine<T: Real> {
    state: SpinState<T>,
    collector: Collector<T>,
    stillness: Stillness<T>,
    wheels: Option<Wheels>,
    since: Option<u64>,
    last: u64,
    began: bool,
    rate: T,
    at_rest: bool,
}

/// Rate, rad/s, below which a robot whose wheels nobody knows may have stopped.
const STOPPED: f64 = 0.01;

/// Share of the angle asked for with which a robot that has stopped has done what was asked: nobody turns exactly two
/// turns, and the gyroscope's scale is not exact either.
const NEARLY: f64 = 0.9;

/// Turned angle from which on the spin has begun, rad.
const BEGUN: f64 = 0.2;

impl<T: Real> SpinMachine<T> {
    /// Idle.
    pub fn new(settings: &SpinSettings<T>) -> Self {
        Self {
            state: SpinState::Idle,
            collector: Collector::new(settings),
            stillness: Stillness::new(settings.stillness),
            wheels: None,
            since: None,
            last: 0,
            began: false,
            rate: T::zero(),
            at_rest: false,
        }
    }

    /// Begins, or begins anew, with the next sample.
    pub fn start(&mut self) {
        self.state = SpinState::Still;
        self.collector.restart();
        self.stillness = Stillness::new(self.settings().stillness);
        self.wheels = None;
        self.since = None;
        self.last = 0;
        self.began = false;
        self.rate = T::zero();
        self.at_rest = false;
    }

    /// Where the procedure is.
    pub fn state(&self) -> &SpinState<T> {
        &self.state
    }

    /// Progress of the spin.
    pub fn progress(&self) -> SpinProgress<T> {
        let estimator = self.collector.estimator();
        let still = match self.state {
            SpinState::Idle => 0,
            SpinState::Still => estimator.stop().map_or(0, |stop| stop.duration()),
            SpinState::Spin | SpinState::Solving | SpinState::Done | SpinState::Failed(_) => {
                self.settings().still
            }
        };
        SpinProgress {
            still: seconds(still),
            turned: estimator.turned().angle(),
            rate: self.rate,
            at_rest: self.at_rest,
        }
    }

    /// Estimates of the spin so far; valid when [`SpinState::Done`], and of a spin that failed, for diagnosis. When
    /// done, and without a true angle, it is solved already; else it takes as long as all slices together.
    ///
    /// # Errors
    /// [`SpinFailure`] where there is nothing to be had.
    pub fn solve(&self, true_angle: Option<&TrueAngle<T>>) -> Result<SpinEstimate<T>, SpinFailure<T>> {
        match (true_angle, self.collector.solved()) {
            (None, Some(estimate)) => Ok(estimate),
            _ => Ok(self.collector.solve(true_angle)?.0),
        }
    }

    /// Hands estimates as [`Self::solve`] returns them to `take`, with the memory of the machine instead of the stack. Slices of
    /// solving that were under way begin anew.
    ///
    /// # Errors
    /// [`SpinFailure`] where there is nothing to be had.
    pub fn solve_in_place(
        &mut self,
        true_angle: Option<&TrueAngle<T>>,
        take: impl FnOnce(&SpinEstimate<T>),
    ) -> Result<(), SpinFailure<T>> {
        self.collector.solve_in_place(true_angle, take)
    }

    /// Does a slice of solving, for those who would rather not wait for samples to do it; where there is nothing to be
    /// solved, nothing.
    pub fn work(&mut self) -> Option<SpinEvent> {
        if !matches!(self.state, SpinState::Solving) {
            return None;
        }
        match self.collector.go_on() {
            Ok(Solving::Solved) => {
                self.state = SpinState::Done;
                Some(SpinEvent::Done)
            }
            Ok(_) => None,
            Err(failure) => Some(self.fail(failure)),
        }
    }

    /// Takes in the next sample, with what the wheels did.
    pub fn push(&mut self, sample: &Sample<T>, wheels: Wheels) -> Option<SpinEvent> {
        if matches!(self.state, SpinState::Solving) {
            return self.work();
        }
        if !matches!(self.state, SpinState::Still | SpinState::Spin) || !sample.is_finite() {
            return None;
        }
        if matches!(self.state, SpinState::Still) && self.is_gap(sample.time) {
            self.last = sample.time;
            return self.break_off();
        }
        let pushed = self.collector.push(sample);
        self.last = self.last.max(sample.time);
        let since = *self.since.get_or_insert(sample.time);
        self.wheels = Some(self.wheels.map_or(wheels, |before| worse(before, wheels)));
        let event = match pushed {
            Err(failure) => return Some(self.fail(failure)),
            Ok(None) => None,
            Ok(Some(block)) => {
                // The sample that completes a block is the first of the next.
                let over_block = self.wheels.replace(wheels).unwrap_or(Wheels::Unknown);
                self.step(&block, over_block)
            }
        };
        event.or_else(|| self.check_time(since))
    }

    /// Advances the time, microseconds, without samples.
    pub fn tick(&mut self, now: u64) -> Option<SpinEvent> {
        let begun = matches!(self.state, SpinState::Still | SpinState::Spin) && self.since.is_some();
        let pause = now.saturating_sub(self.last);
        (begun && pause > self.settings().longest_gap).then(|| {
            self.fail(SpinFailure::StreamStopped {
                time: self.last,
                gap: seconds(pause),
            })
        })
    }

    /// Sets the bias instability, m/s^2 and rad/s, where it is known only when the spin is done; [`Self::solve`] then
    /// uses it. A solution under way begins anew.
    pub fn know_bias_instability(&mut self, specific_force: T, angular_rate: T) {
        self.collector.know_bias_instability(specific_force, angular_rate);
        if matches!(self.state, SpinState::Solving) {
            self.collector.begin_to_solve();
        }
    }

    /// Settings of the spin.
    pub fn settings(&self) -> &SpinSettings<T> {
        self.collector.estimator().settings()
    }

    fn is_gap(&self, time: u64) -> bool {
        self.since.is_some() && time.saturating_sub(self.last) > self.settings().longest_gap
    }

    fn fail(&mut self, failure: SpinFailure<T>) -> SpinEvent {
        self.state = SpinState::Failed(failure);
        SpinEvent::Failed
    }

    fn step(&mut self, block: &Block<T>, wheels: Wheels) -> Option<SpinEvent> {
        let quiet = self.stillness.push(&block.moments);
        self.rate = block.rate;
        self.at_rest = match wheels {
            Wheels::Stopped => true,
            Wheels::Turning => false,
            Wheels::Unknown => quiet && self.is_calm(block) && self.has_stopped(block),
        };
        match self.state {
            SpinState::Still => self.stand(block),
            SpinState::Spin => self.turn(block),
            SpinState::Idle | SpinState::Solving | SpinState::Done | SpinState::Failed(_) => None,
        }
    }

    fn is_calm(&self, block: &Block<T>) -> bool {
        let scatter = Scatter::of(&block.moments);
        let settings = self.settings();
        let force = settings.largest_specific_force_scatter;
        let rate = settings.largest_angular_rate_scatter;
        scatter.specific_force < force * force && scatter.angular_rate < rate * rate
    }

    fn has_stopped(&self, block: &Block<T>) -> bool {
        let estimator = self.collector.estimator();
        let level =
            |stop: &crate::spin::rests::Stop<T>| self.stillness.is_level(&stop.samples, &block.moments);
        match self.state {
            SpinState::Spin => block.rate.abs() < real(STOPPED) && estimator.stop().is_none_or(level),
            _ => {
                block.angular_rate().length() < self.settings().largest_rate_bias
                    && estimator.stop().is_none_or(level)
            }
        }
    }

    fn stand(&mut self, block: &Block<T>) -> Option<SpinEvent> {
        if !self.at_rest {
            return self.break_off();
        }
        let began = self.collector.estimator().stop().is_none();
        if let Err(failure) = self.collector.take(block, true) {
            return Some(self.fail(failure));
        }
        let stood = self
            .collector
            .estimator()
            .stop()
            .map_or(0, |stop| stop.duration());
        if stood < self.settings().still {
            return began.then_some(SpinEvent::StillBegan);
        }
        self.collector.end_stop();
        self.state = SpinState::Spin;
        self.since = Some(block.end);
        Some(SpinEvent::StillDone)
    }

    /// Gathers anew, with the noise floor learnt so far.
    fn break_off(&mut self) -> Option<SpinEvent> {
        let stood = self.collector.estimator().stop().is_some();
        self.collector.restart();
        self.wheels = None;
        stood.then_some(SpinEvent::StillBroken)
    }

    fn turn(&mut self, block: &Block<T>) -> Option<SpinEvent> {
        if let Err(failure) = self.collector.take(block, self.at_rest) {
            return Some(self.fail(failure));
        }
        let estimator = self.collector.estimator();
        let turned = estimator.turned().angle();
        let stopped = estimator
            .stop()
            .is_some_and(|stop| stop.duration() >= self.settings().shortest_stop);
        let nearly = turned >= self.settings().turn * real(NEARLY) && stopped;
        if turned >= self.settings().turn || nearly {
            self.collector.begin_to_solve();
            self.state = SpinState::Solving;
            return None;
        }
        let begins = !self.began && turned >= real(BEGUN);
        self.began |= begins;
        begins.then_some(SpinEvent::SpinBegan)
    }

    fn check_time(&mut self, since: u64) -> Option<SpinEvent> {
        let passed = self.last.saturating_sub(since);
        let failure = match self.state {
            SpinState::Still if passed > self.settings().still_timeout => SpinFailure::NeverStill {
                waited: seconds(passed),
            },
            SpinState::Spin if passed > self.settings().spin_timeout => SpinFailure::TurnedTooLittle {
                turned: self.collector.estimator().turned().angle(),
                wanted: self.settings().turn,
            },
            _ => return None,
        };
        Some(self.fail(failure))
    }
}

/// Chooses, from two states of the wheels within one block, the one that is weaker evidence of rest.
fn worse(a: Wheels, b: Wheels) -> Wheels {
    match (a, b) {
        (Wheels::Turning, _) | (_, Wheels::Turning) => Wheels::Turning,
        (Wheels::Unknown, _) | (_, Wheels::Unknown) => Wheels::Unknown,
        (Wheels::Stopped, Wheels::Stopped) => Wheels::Stopped,
    }
}
