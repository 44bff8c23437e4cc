//! Trial of a sensor whose pairs are complete: fits to parts of the pairs and to all, one step with each
//! sample, then the decision on adoption (docs/theory/redundancy.md, eq. 16 to 20).

use nalgebra::Vector3;

use crate::real::Real;
use crate::redundancy::fit::adoption::{AdoptionRefusal, FitCandidate, Following, Residuals, RestReadings};
use crate::redundancy::fit::residual::{Layout, PairMoments};
use crate::redundancy::fit::rests::{RestWeighing, RestWeights, Rests, WeighedRests};
use crate::redundancy::fit::{ErrorVariances, Fit, FitProblem, FitProgress, PrimaryNoise, disagreement};
use crate::redundancy::platform::MountedUnit;
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::sensor::{Axes, Sensor};
use crate::redundancy::settings::RedundancySettings;

/// Data and limits of the trial of a sensor.
pub struct TrialData<'a, T: Real> {
    /// Kind of sensor.
    pub sensor: Sensor,
    /// Unit of the sensor.
    pub unit: &'a MountedUnit<T>,
    /// Axes of the primary.
    pub primary: Axes,
    /// Stored error.
    pub stored: &'a RelativeError<T>,
    /// Correction that follows the primary so far; `None` if it is unlimited.
    pub followed: Option<Vector3<T>>,
    /// Difference from the primary that siblings share with this secondary, m/s^2 or rad/s.
    pub shared: T,
    /// Settings.
    pub settings: &'a RedundancySettings<T>,
    /// Readings at the rest before.
    pub rest: RestReadings<T>,
    /// Least number of pairs.
    pub fewest: u32,
    /// Noise of the primary.
    pub noise: PrimaryNoise<T>,
    /// Rests that are fitted beside the pairs.
    pub rests: &'a Rests<T>,
    /// Pairs of every other second.
    pub fitted: &'a dyn PairMoments<T>,
    /// Pairs of the other seconds.
    pub held_out: &'a dyn PairMoments<T>,
    /// All pairs.
    pub all: &'a dyn PairMoments<T>,
    /// Layout of their channels.
    pub layout: Layout,
}

/// Outcome for one sensor: the fit, its residuals, and the decision on adoption.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOutcome<'f, T: Real> {
    /// Fit to all pairs, and to the rests.
    pub fit: &'f Fit<T>,
    /// Residuals on held-out pairs.
    pub residuals: Residuals<T>,
    /// Correction that follows the primary with this fit.
    pub following: Following<T>,
    /// Decision on adoption.
    pub verdict: Result<(), AdoptionRefusal<T>>,
}

/// End of a trial.
///
/// # Errors
/// [`AdoptionRefusal`] if there is no fit.
pub type TrialEnd<'f, T> = Result<FitOutcome<'f, T>, AdoptionRefusal<T>>;

/// Current fit of a trial, with the results of earlier fits that it needs.
#[derive(Clone, Copy, Debug, PartialEq)]
enum TrialFit<T: Real> {
    /// Fit to the pairs of every other second.
    Half,
    /// Fit to the pairs of the other seconds. The difference of both halves shows errors that residuals within
    /// a second share.
    OtherHalf {
        half: RelativeError<T>,
        variances: ErrorVariances<T>,
    },
    /// Fit to all pairs; `times` is the factor on their variance from the difference of the halves.
    Motion { half: RelativeError<T>, times: T },
    /// Fit to all pairs and to rests, with their usual scatter.
    Rests {
        motion: RelativeError<T>,
        weighing: RestWeighing<T>,
    },
    /// Fit to the pairs of every other second and to rests, with their scatter here.
    HalfAndRests {
        motion: RelativeError<T>,
        times: T,
        weights: RestWeights<T>,
    },
    /// Fit to all pairs and rests.
    Whole {
        motion: RelativeError<T>,
        times: T,
        weights: RestWeights<T>,
        residuals: Residuals<T>,
    },
}

/// Trial of a sensor, between steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial<T: Real> {
    fit: TrialFit<T>,
    /// Start of the next step. A fit starts at the result of the fit before.
    near: RelativeError<T>,
    /// Steps of the current fit.
    steps: u8,
}

impl<T: Real> Trial<T> {
    /// Starts at the stored error.
    pub fn new(stored: &RelativeError<T>) -> Self {
        Self {
            fit: TrialFit::Half,
            near: *stored,
            steps: 0,
        }
    }

    /// Takes the next step, of which the last of a fit writes `found`; returns the outcome after the last fit.
    /// The data must not change during a trial.
    ///
    /// # Errors
    /// [`AdoptionRefusal`] if there is no fit.
    pub fn go_on<'f>(
        &mut self,
        data: &TrialData<'_, T>,
        found: &'f mut Fit<T>,
    ) -> Result<Option<FitOutcome<'f, T>>, AdoptionRefusal<T>> {
        data.are_enough()?;
        match self.step(data, found) {
            FitProgress::GoesOn => {
                self.steps = self.steps.saturating_add(1);
                Ok(None)
            }
            FitProgress::Found => {
                self.steps = 0;
                Ok(self.next(data, found))
            }
            FitProgress::Unsolvable => Err(AdoptionRefusal::Unsolvable),
        }
    }

    #[inline(never)]
    fn step(&mut self, data: &TrialData<'_, T>, found: &mut Fit<T>) -> FitProgress {
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

    /// Starts the next fit; returns the outcome after the last one.
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
                return Some(data.decide(fit, &motion, &data.residuals(half)));
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
                return Some(data.decide(fit, motion, residuals));
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
            highest: settings.largest_fit_model,
            excitation: settings.excitation.of(self.sensor),
            lever_arm_excitation: unknown_arm.then_some(settings.excitation_lever_arm),
        }
    }

    /// Residuals on the pairs of the other seconds of a fit to every other second.
    fn residuals(&self, half: &RelativeError<T>) -> Residuals<T> {
        Residuals::of(half, self.stored, self.held_out, &self.layout, self.axes())
    }

    /// Axes of the sensor that correspond to axes of the primary.
    fn axes(&self) -> [bool; 3] {
        let comparable = self
            .unit
            .axes
            .comparable(&self.primary, &self.unit.sensor_from_primary);
        *comparable.of(self.sensor)
    }

    #[inline(never)]
    fn decide<'f>(
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
            verdict: candidate.decide(self.settings),
            fit: whole,
            residuals: *residuals,
            following,
        }
    }

    /// Correction that would follow the primary (docs/theory/redundancy.md, eq. 20, 21).
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
