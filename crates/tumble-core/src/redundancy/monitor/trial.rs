//! What becomes of a sensor whose pairs are complete: fits to parts of them and to all, a step with each sample, and a
//! judgement of the last (docs/theory/redundancy.md, eq. 16 to 20).

use nalgebra::Vector3;

use crate::real::Real;
use crate::redundancy::fit::adoption::{AdoptionRefusal, FitCandidate, Following, Residuals, RestReadings};
use crate::redundancy::fit::residual::{Layout, PairMoments};
use crate::redundancy::fit::rests::{RestWeighing, RestWeights, Rests, WeighedRests};
use crate::redundancy::fit::{ErrorVariances, Fit, FitProblem, LadderState, PrimaryNoise, disagreement};
use crate::redundancy::platform::MountedUnit;
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::sensor::{Axes, Sensor};
use crate::redundancy::settings::RedundancySettings;

/// All that a sensor is fitted to and judged by.
pub struct TrialData<'a, T: Real> {
    /// Which sensor.
    pub sensor: Sensor,
    /// Of which unit.
    pub unit: &'a MountedUnit<T>,
    /// Axes of the primary.
    pub primary: Axes,
    /// What is stored.
    pub stored: &'a RelativeError<T>,
    /// How far it has followed the primary; `None` where that does not count.
    pub followed: Option<Vector3<T>>,
    /// How far siblings were from the primary just as this secondary was, m/s^2 or rad/s.
    pub shared: T,
    /// Settings.
    pub settings: &'a RedundancySettings<T>,
    /// The rest before.
    pub rest: RestReadings<T>,
    /// Fewest pairs.
    pub fewest: u32,
    /// Noise of the primary.
    pub noise: PrimaryNoise<T>,
    /// Rests that count beside the pairs.
    pub rests: &'a Rests<T>,
    /// Pairs of every other second.
    pub fitted: &'a dyn PairMoments<T>,
    /// Pairs of the other seconds.
    pub held_out: &'a dyn PairMoments<T>,
    /// All pairs.
    pub all: &'a dyn PairMoments<T>,
    /// Their channels.
    pub layout: Layout,
}

/// Outcome for one sensor: what was found, how well it does, and whether it is adopted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOutcome<'f, T: Real> {
    /// Fitted to all pairs, and to the rests.
    pub fit: &'f Fit<T>,
    /// On held-out pairs.
    pub residuals: Residuals<T>,
    /// How far it has followed the primary with it.
    pub following: Following<T>,
    /// Whether it is adopted.
    pub verdict: Result<(), AdoptionRefusal<T>>,
}

/// The end of a trial.
///
/// # Errors
/// [`AdoptionRefusal`] where there is no fit to be judged.
pub type TrialEnd<'f, T> = Result<FitOutcome<'f, T>, AdoptionRefusal<T>>;

/// What is fitted, with what the fits before found for it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum TrialFit<T: Real> {
    /// To the pairs of every other second.
    Half,
    /// To those of the other seconds. What residuals have in common over a second shows between the two.
    OtherHalf {
        half: RelativeError<T>,
        variances: ErrorVariances<T>,
    },
    /// To all pairs, which are so many times less certain than their number says.
    Motion { half: RelativeError<T>, times: T },
    /// To all pairs and to rests, as they usually scatter.
    Rests {
        motion: RelativeError<T>,
        weighing: RestWeighing<T>,
    },
    /// To the pairs of every other second and to rests as they scatter here.
    HalfAndRests {
        motion: RelativeError<T>,
        times: T,
        weights: RestWeights<T>,
    },
    /// To all of them.
    Whole {
        motion: RelativeError<T>,
        times: T,
        weights: RestWeights<T>,
        residuals: Residuals<T>,
    },
}

/// A sensor that is being fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial<T: Real> {
    fit: TrialFit<T>,
    /// Where its next step begins. A fit begins where the one before ended.
    near: RelativeError<T>,
    /// Steps taken of this fit.
    steps: u8,
}

impl<T: Real> Trial<T> {
    /// Begins at what is stored.
    pub fn new(stored: &RelativeError<T>) -> Self {
        Self {
            fit: TrialFit::Half,
            near: *stored,
            steps: 0,
        }
    }

    /// Takes the next step, of which the last of a fit has it `found`; gives the outcome with the last of all. The data must be
    /// the same from the first to the last.
    ///
    /// # Errors
    /// [`AdoptionRefusal`] where there is no fit to be judged.
    pub fn go_on<'f>(
        &mut self,
        data: &TrialData<'_, T>,
        found: &'f mut Fit<T>,
    ) -> Result<Option<FitOutcome<'f, T>>, AdoptionRefusal<T>> {
        data.are_enough()?;
        match self.step(data, found) {
            LadderState::GoesOn => {
                self.steps = self.steps.saturating_add(1);
                Ok(None)
            }
            LadderState::Found => {
                self.steps = 0;
                Ok(self.next(data, found))
            }
            LadderState::Unsolvable => Err(AdoptionRefusal::Unsolvable),
        }
    }

    #[inline(never)]
    fn step(&mut self, data: &TrialData<'_, T>, found: &mut Fit<T>) -> LadderState {
        let usual = match &self.fit {
            TrialFit::Rests { weighing, .. } => Some(weighing.usual(data.rests)),
            _ => None,
        };
        let (pairs, weights) = match &self.fit {
            TrialFit::Half => (data.fitted, None),
            TrialFit::OtherHalf { .. } => (data.held_out, None),
            TrialFit::Motion { .. } => (data.all, None),
            TrialFit::Rests { .. } => (data.all, usual.as_ref()),
            TrialFit::HalfAndRests { weights, .. } => (data.fitted, Some(weights)),
            TrialFit::Whole { weights, .. } => (data.all, Some(weights)),
        };
        let problem = data.problem(pairs, weights);
        problem.go_on(&mut self.near, self.steps, found)
    }

    /// What is fitted next; the outcome where nothing is.
    #[inline(never)]
    fn next<'f>(&mut self, data: &TrialData<'_, T>, fit: &'f mut Fit<T>) -> Option<FitOutcome<'f, T>> {
        self.fit = match &self.fit {
            TrialFit::Half => TrialFit::OtherHalf {
                half: fit.error,
                variances: fit.variances(),
            },
            TrialFit::OtherHalf { half, variances } => TrialFit::Motion {
                half: *half,
                times: disagreement([half, &fit.error], [variances, &fit.variances()]).max(T::one()),
            },
            TrialFit::Motion { times, .. } if data.rests_count() => {
                let problem = data.problem(data.all, None);
                TrialFit::Rests {
                    motion: fit.error,
                    weighing: RestWeighing::new(data.sensor, &problem, fit, *times, data.rests),
                }
            }
            TrialFit::Motion { half, times } => {
                let motion = fit.error;
                fit.weaken(*times);
                return Some(data.judge(fit, &motion, &data.residuals(half)));
            }
            TrialFit::Rests { motion, weighing } => TrialFit::HalfAndRests {
                motion: *motion,
                times: weighing.times(),
                weights: weighing.as_shown(&data.problem(data.all, None), fit, data.rests),
            },
            TrialFit::HalfAndRests {
                motion,
                times,
                weights,
            } => TrialFit::Whole {
                motion: *motion,
                times: *times,
                weights: *weights,
                residuals: data.residuals(&fit.error),
            },
            TrialFit::Whole {
                motion,
                times,
                residuals,
                ..
            } => {
                fit.weaken(*times);
                return Some(data.judge(fit, motion, residuals));
            }
        };
        None
    }
}

impl<T: Real> TrialData<'_, T> {
    fn are_enough(&self) -> Result<(), AdoptionRefusal<T>> {
        let needed = self.fewest;
        let pairs = self.all.samples();
        if pairs < needed || self.fitted.samples() == 0 || self.held_out.samples() == 0 {
            return Err(AdoptionRefusal::TooFewPairs { pairs, needed });
        }
        Ok(())
    }

    fn rests_count(&self) -> bool {
        self.rests.number() > 0 && self.settings.fit.fit_rests
    }

    fn problem<'b>(
        &'b self,
        pairs: &'b dyn PairMoments<T>,
        weights: Option<&'b RestWeights<T>>,
    ) -> FitProblem<'b, T> {
        let settings = &self.settings.fit;
        let turns = self.primary.complete(Sensor::Gyroscope);
        let unknown_arm = self.sensor == Sensor::Accelerometer && self.unit.lever_arm.is_none() && turns;
        FitProblem {
            pairs,
            rests: weights.map(|weights| WeighedRests {
                rests: self.rests,
                weights,
            }),
            layout: self.layout,
            axes: self.axes(),
            complete: self.unit.axes.complete(self.sensor),
            noise: &self.noise,
            stored: self.stored,
            highest: settings.highest_rung,
            excitation: settings.excitation.of(self.sensor),
            lever_arm_excitation: unknown_arm.then_some(settings.excitation_lever_arm),
        }
    }

    /// What a fit to the pairs of every other second leaves of those of the other seconds.
    fn residuals(&self, half: &RelativeError<T>) -> Residuals<T> {
        Residuals::of(half, self.stored, self.held_out, &self.layout, self.axes())
    }

    /// Axes of the sensor that can be told from those of the primary.
    fn axes(&self) -> [bool; 3] {
        let comparable = self
            .unit
            .axes
            .comparable(&self.primary, &self.unit.sensor_from_primary);
        *comparable.of(self.sensor)
    }

    #[inline(never)]
    fn judge<'f>(
        &self,
        whole: &'f Fit<T>,
        motion: &RelativeError<T>,
        residuals: &Residuals<T>,
    ) -> FitOutcome<'f, T> {
        let following = self.following(whole);
        let candidate = FitCandidate {
            sensor: self.sensor,
            axes: self.axes(),
            layout: self.layout,
            motion,
            whole: &whole.error,
            stored: self.stored,
            residuals,
            all: self.all,
            rest: &self.rest,
            following: &following,
        };
        FitOutcome {
            verdict: candidate.judge(self.settings),
            fit: whole,
            residuals: *residuals,
            following,
        }
    }

    /// How far it would follow the primary (docs/theory/redundancy.md, eq. 20, 21).
    fn following(&self, fit: &Fit<T>) -> Following<T> {
        let Some(before) = self.followed else {
            return Following::free();
        };
        let u = Vector3::from_fn(|j, _| self.all.mean_of(j));
        let shift = fit.error.predict(&u) - self.stored.predict(&u); // eq. 20
        Following {
            followed: if self.primary.complete(self.sensor) {
                self.rests.unsupported(self.sensor, &(before + shift))
            } else {
                before + shift
            },
            shared: self.shared,
        }
    }
}
