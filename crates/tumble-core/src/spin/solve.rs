//! A spin solved from what was kept of it, slice by slice: the fit with the bias that its rest showed, or the one without it
//! (docs/theory/spin.md, eq. 13 to 19).
//!
//! A slice is a round of a fit: a device does one with each sample, and never has much to do at once.

use nalgebra::{SVector, Vector3};

use crate::products::zeros;
use crate::real::{Real, count, real};
use crate::regression::{Unsolvable, reduced};
use crate::spin::axis::{self, AxisFit, TurningRates, floored};
use crate::spin::estimate::{ScalarEstimate, SpinEstimate, TrueAngle};
use crate::spin::estimator::{LEAST_TURN, SpinEstimator};
use crate::spin::failure::SpinFailure;
use crate::spin::level_free::{
    GYROSCOPE_UP, LevelFree, LevelFreeFit, SpinPriors, UNKNOWNS, heading_correction,
};
use crate::spin::outputs::{floor_tilt, from_fit};
use crate::spin::rests::SpinRests;
use crate::spin::scale::{Scales, common_scale, scales, widened_scale};

/// Sigma of the gyroscope bias along the axis where the rest does not count, rad/s.
const BIAS_UNKNOWN: f64 = 0.1;
/// Variance of a row over that of a block: the square of the trapezoid of eq. 10.
const ROW_OF_BLOCK: f64 = 5.0 / 12.0;
/// The random walk of the heading as a constant rate over the spin: its variance over that of the end point.
const WALK_SHARE: f64 = 1.2;

/// Purposes for which a spin is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolvedFor {
    /// Correction of heading from here on. Before a full turn was made the bias is that of the rest: harmonics of a
    /// part of a turn can be bent to many shapes.
    Heading,
    /// Everything.
    Estimate,
}

/// Outcome of a slice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solving<T: Real> {
    /// There is more to do, or nothing was begun.
    GoesOn,
    /// Correction of a heading counted from here on, rad a rad and rad a second.
    Heading(T, T),
    /// [`SpinSolver::estimate`] and [`SpinSolver::fit`] have the result.
    Solved,
}

/// Work of the next slice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slice {
    /// Nothing.
    Nothing,
    /// The turning axis, and what is known besides the harmonics.
    Prepare,
    /// A round of the fit with the bias that the rest showed.
    Believe,
    /// A round of the fit without it, from where the other ended.
    Doubt,
    /// Which of the two it is.
    Choose,
    /// The last round of the believing fit once more.
    BelieveAgain,
    /// Computes the estimates of that fit.
    Conclude,
    /// A round of the fit once more, under the variances that its misfit asks for.
    Widen,
    /// Computes the estimates of that fit.
    ConcludeWidened,
    /// Checks that the floor is within the limit of tilt.
    Check,
}

/// Parts that the fits of one spin share.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Prepared<T: Real> {
    priors: SpinPriors<T>,
    scales: Scales<T>,
}

/// A spin being solved, or solved. All its memory is in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinSolver<T: Real> {
    solved_for: SolvedFor,
    next: Slice,
    true_angle: Option<TrueAngle<T>>,
    prepared: Option<Prepared<T>>,
    fitting: Option<LevelFreeFit<T>>,
    /// Where the believing fit ended.
    believed: SVector<T, UNKNOWNS>,
    slow_turn: ScalarEstimate<T>,
    turned_while_still: bool,
    found: Option<LevelFree<T>>,
    solved: bool,
}

impl<T: Real> SpinSolver<T> {
    /// With nothing to do.
    pub fn new() -> Self {
        Self {
            solved_for: SolvedFor::Heading,
            next: Slice::Nothing,
            true_angle: None,
            prepared: None,
            fitting: None,
            believed: zeros(),
            slow_turn: ScalarEstimate::unknown(),
            turned_while_still: false,
            found: None,
            solved: false,
        }
    }

    /// Begins; what was begun before is given up.
    pub fn begin(&mut self, solved_for: SolvedFor, true_angle: Option<&TrueAngle<T>>) {
        self.solved_for = solved_for;
        self.next = Slice::Prepare;
        self.true_angle = true_angle.copied();
        self.solved = false;
    }

    /// Gives up what was begun, and forgets what was found.
    pub fn stop(&mut self) {
        self.next = Slice::Nothing;
        self.solved = false;
    }

    /// Tests whether there is work left.
    pub fn is_busy(&self) -> bool {
        self.next != Slice::Nothing
    }

    /// Purpose and true angle of what was begun and is not finished.
    pub fn under_way(&self) -> Option<(SolvedFor, Option<TrueAngle<T>>)> {
        self.is_busy().then_some((self.solved_for, self.true_angle))
    }

    /// Tests whether all is solved, with this true angle.
    pub fn has_solved(&self, true_angle: Option<&TrueAngle<T>>) -> bool {
        self.solved && !self.is_busy() && self.true_angle.as_ref() == true_angle
    }

    /// The fit of a spin that is solved.
    pub fn fit(&self) -> Option<&LevelFree<T>> {
        self.found.as_ref().filter(|_| self.solved)
    }

    /// Everything that a spin shows which is solved; `None` before.
    pub fn estimate(&self, spin: &SpinEstimator<T>) -> Option<SpinEstimate<T>> {
        let (Prepared { priors, scales }, fit) = self.prepared.as_ref().zip(self.fit())?;
        let slow_turn = (self.slow_turn, self.turned_while_still);
        Some(from_fit(spin, priors, fit, scales, slow_turn))
    }

    /// Does the next slice, with what was kept of the spin up to now.
    ///
    /// # Errors
    /// [`SpinFailure::NoRest`], [`SpinFailure::NoTurn`], [`SpinFailure::FloorTooSteep`], [`SpinFailure::Unsolvable`].
    pub fn step(&mut self, spin: &SpinEstimator<T>) -> Result<Solving<T>, SpinFailure<T>> {
        let stepped = match self.next {
            Slice::Nothing => return Ok(Solving::GoesOn),
            Slice::Prepare => self.prepare(spin),
            Slice::Check => self.check(spin),
            Slice::Believe
            | Slice::Doubt
            | Slice::Choose
            | Slice::BelieveAgain
            | Slice::Conclude
            | Slice::Widen
            | Slice::ConcludeWidened => self
                .go_on(spin)
                .ok_or(SpinFailure::NoRest)
                .and_then(|gone_on| gone_on.map_err(|_| SpinFailure::Unsolvable)),
        };
        match stepped {
            Ok(Solving::GoesOn) => {}
            Ok(Solving::Heading(..) | Solving::Solved) => self.next = Slice::Nothing,
            Err(_) => self.stop(),
        }
        stepped
    }

    #[inline(never)]
    fn prepare(&mut self, spin: &SpinEstimator<T>) -> Result<Solving<T>, SpinFailure<T>> {
        self.know(spin)?;
        self.make_room();
        let begun = self.fitting.as_mut().zip(self.prepared.as_ref());
        let (fit, prepared) = begun.ok_or(SpinFailure::Unsolvable)?;
        fit.begin(&prepared.priors, None);
        self.next = Slice::Believe;
        Ok(Solving::GoesOn)
    }

    /// Finds what the fits share, in a call of its own: a fit that begins needs the stack that this took.
    #[inline(never)]
    fn know(&mut self, spin: &SpinEstimator<T>) -> Result<(), SpinFailure<T>> {
        self.prepared = Some(prepare(spin, self.true_angle.as_ref())?);
        Ok(())
    }

    /// Begins what slices work on. Only now, so that a machine that waits is made with little stack.
    #[inline(never)]
    fn make_room(&mut self) {
        self.fitting.get_or_insert_with(LevelFreeFit::none);
        self.found.get_or_insert_with(LevelFree::none);
    }

    /// A slice of the fits; `None` where they were not prepared.
    fn go_on(&mut self, spin: &SpinEstimator<T>) -> Option<Result<Solving<T>, Unsolvable>> {
        let priors = &self.prepared.as_ref()?.priors;
        let harmonics = [spin.rests()?.harmonics(), spin.turning()];
        let freedom = spin.turning().freedom();
        let scale_sigma = spin.settings().scale_sigma;
        let (fit, found) = (self.fitting.as_mut()?, self.found.as_mut()?);
        let settled = match self.next {
            Slice::Believe | Slice::BelieveAgain => fit.round(harmonics, priors),
            Slice::Doubt => fit.round(harmonics, &doubting(priors, scale_sigma)),
            Slice::Widen => {
                let priors = chosen(priors, scale_sigma, self.turned_while_still);
                fit.round(harmonics, &priors.widened(found.widened))
            }
            Slice::ConcludeWidened => fit.conclude_widened(priors, found).map(|()| true),
            Slice::Choose | Slice::Conclude => fit.conclude(priors, freedom, found).map(|()| true),
            Slice::Nothing | Slice::Prepare | Slice::Check => return Some(Ok(Solving::GoesOn)),
        };
        match (settled, self.next) {
            (Err(unsolvable), _) => return Some(Err(unsolvable)),
            (Ok(false), Slice::Believe | Slice::Doubt | Slice::Widen) => {}
            (_, Slice::Believe) => {
                self.believed = *fit.unknowns();
                let part = spin.turned().span() < real(core::f64::consts::TAU);
                if part && self.solved_for == SolvedFor::Heading {
                    return Some(Ok(heading(priors, &self.believed)));
                }
                fit.begin(&doubting(priors, scale_sigma), Some(&self.believed));
                self.next = Slice::Doubt;
            }
            (_, Slice::Doubt) => self.next = Slice::Choose,
            (_, Slice::Choose) => {
                (self.slow_turn, self.turned_while_still) = slow_turn(found, priors);
                let x = if self.turned_while_still {
                    &found.solution.x
                } else {
                    &self.believed
                };
                if self.solved_for == SolvedFor::Heading {
                    return Some(Ok(heading(priors, x)));
                }
                self.next = if self.turned_while_still {
                    Slice::Conclude
                } else {
                    fit.begin(priors, Some(&self.believed));
                    Slice::BelieveAgain
                };
            }
            (_, Slice::BelieveAgain) => self.next = Slice::Conclude,
            (_, Slice::Conclude) if found.widened > T::one() => {
                let priors = chosen(priors, scale_sigma, self.turned_while_still);
                fit.begin(&priors.widened(found.widened), Some(&found.solution.x));
                self.next = Slice::Widen;
            }
            (_, Slice::Widen) => self.next = Slice::ConcludeWidened,
            (_, _) => {
                self.solved = true;
                self.next = Slice::Check;
            }
        }
        Some(Ok(Solving::GoesOn))
    }

    fn check(&mut self, spin: &SpinEstimator<T>) -> Result<Solving<T>, SpinFailure<T>> {
        let solved = self.prepared.as_ref().zip(self.fit());
        let (Prepared { priors, .. }, fit) = solved.ok_or(SpinFailure::Unsolvable)?;
        let (tilt, limit) = (floor_tilt(priors, fit), spin.settings().largest_floor_tilt);
        if tilt.value - tilt.sigma * real(3.0) > limit {
            return Err(SpinFailure::FloorTooSteep {
                tilt: tilt.value,
                limit,
            });
        }
        Ok(Solving::Solved)
    }
}

impl<T: Real> Default for SpinSolver<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// Solves for everything at once.
///
/// # Errors
/// Those of [`SpinSolver::step`].
// The memory of a solver is on its stack.
#[inline(never)]
pub fn solve<T: Real>(
    spin: &SpinEstimator<T>,
    true_angle: Option<&TrueAngle<T>>,
) -> Result<(SpinEstimate<T>, LevelFree<T>), SpinFailure<T>> {
    let mut solver = SpinSolver::new();
    solver.begin(SolvedFor::Estimate, true_angle);
    while solver.step(spin)? == Solving::GoesOn {}
    let found = solver.estimate(spin).zip(solver.fit().copied());
    found.ok_or(SpinFailure::Unsolvable)
}

fn heading<T: Real>(priors: &SpinPriors<T>, x: &SVector<T, UNKNOWNS>) -> Solving<T> {
    let (by_heading, by_time) = heading_correction(priors, x);
    Solving::Heading(by_heading, by_time)
}

fn prepare<T: Real>(
    spin: &SpinEstimator<T>,
    true_angle: Option<&TrueAngle<T>>,
) -> Result<Prepared<T>, SpinFailure<T>> {
    let (rests, reference) = spin
        .rests()
        .zip(spin.heading_reference())
        .ok_or(SpinFailure::NoRest)?;
    let turned = spin.turned();
    if turned.angle() < real(LEAST_TURN) || spin.rate_moments().points() < 3 {
        return Err(SpinFailure::NoTurn {
            turned: turned.angle(),
        });
    }
    let rates = TurningRates {
        moments: *spin.rate_moments(),
        frame: *spin.frame(),
        counted_bias: reference.bias,
        rounding: spin.turning_rounding(rests) * count(spin.rate_moments().points()), // eq. 23
        earth_variance: spin.settings().earth_variance().across,
    };
    let instability = spin.settings().angular_rate_instability;
    let axis = axis::fit(
        &rates,
        &rests.rate(instability, &spin.rounding(rests)),
        &reference.up,
    );
    let walk = spin.heading_walk(&axis);
    let scales = scales(&axis, &reference.bias, turned, true_angle, walk);
    let priors = priors(spin, rests, &axis, &reference.bias, walk, &scales);
    Ok(Prepared { priors, scales })
}

/// Priors of the fit that is the result.
#[inline(never)]
fn chosen<T: Real>(priors: &SpinPriors<T>, scale_sigma: T, turned_while_still: bool) -> SpinPriors<T> {
    if turned_while_still {
        doubting(priors, scale_sigma)
    } else {
        *priors
    }
}

/// Priors without the bias that the rest showed.
#[inline(never)]
fn doubting<T: Real>(priors: &SpinPriors<T>, scale_sigma: T) -> SpinPriors<T> {
    SpinPriors {
        bias_variance: real(BIAS_UNKNOWN * BIAS_UNKNOWN),
        scale: widened_scale(priors, scale_sigma),
        ..*priors
    }
}

fn priors<T: Real>(
    spin: &SpinEstimator<T>,
    rests: &SpinRests<T>,
    axis: &AxisFit<T>,
    counted_bias: &Vector3<T>,
    walk: T,
    scales: &Scales<T>,
) -> SpinPriors<T> {
    let as_at_rest = rests.block_variance(0) * real::<T>(ROW_OF_BLOCK);
    let rounding = spin.force_rounding(rests);
    let turning = spin.turning().variance().unwrap_or(as_at_rest) * spin.row_factor(); // eq. 25b
    let turning = turning + spin.turning_force_rounding(rests) * count::<T>(spin.turning().rows()); // eq. 27
    SpinPriors {
        gravity: spin.settings().gravity,
        origin: rests.first_force(),
        axis: *axis,
        counted_bias: *counted_bias,
        scale: common_scale(scales, prior_scale_sigma(spin)),
        bias_variance: axis.covariance[(2, 2)],
        walk_variance: walk * real(WALK_SHARE) / spin.turned().duration(), // eq. 13
        rest_variance: rests
            .line_variance(spin.settings().specific_force_instability, &rounding)
            .map(|v| floored(v, LEAST)),
        turning_variance: turning.map(|v| floored(v, LEAST)),
    }
}

/// Sigma of the scale error that the heading shows: that of the gyroscope, and rounding over this turn.
fn prior_scale_sigma<T: Real>(spin: &SpinEstimator<T>) -> T {
    spin.settings()
        .scale_sigma
        .hypotenuse(spin.rounding_as_scale().square_root())
}

/// Smallest variance of a specific force that is divided by, (m/s^2)^2.
const LEAST: f64 = 1e-12;

/// The rate at rest that the harmonics ask for, and whether chance could not have made it. Harmonics that fit the model
/// neither way ask for nothing.
fn slow_turn<T: Real>(without_rest: &LevelFree<T>, priors: &SpinPriors<T>) -> (ScalarEstimate<T>, bool) {
    const SIGMAS: f64 = 5.0;
    const DRIFT: f64 = 3e-4;
    const FITS: f64 = 4.0;
    let i = GYROSCOPE_UP;
    if !without_rest.solution.observed(i) {
        return (ScalarEstimate::unknown(), false);
    }
    let variance = without_rest.solution.covariance[(i, i)];
    let value = -without_rest.solution.x[i];
    let chance = (variance + priors.bias_variance).square_root();
    let reduced = reduced(without_rest.solution.chi_square, without_rest.degrees_of_freedom);
    let found = value.abs() > chance * real(SIGMAS) + real(DRIFT) && reduced < real(FITS); // eq. 19
    (ScalarEstimate { value, sigma: chance }, found)
}
