//! Lever arm between two units, from their specific forces, once the rates have given clock and rotation.

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector3};
use tumble_core::rotation::cross_matrix;

use crate::align::grid::{Grid, SensorDelays, TrianglePair};
use crate::align::rates::{
    ABOVE_NOISE, Changed, HELD, RatesFit, directions_above_noise, directions_below, set_stretch, symmetric,
};
use crate::align::response::{
    LARGEST_DELAY, ResponseTerms, SMALLEST_DELAY, fourth_derivatives, fourth_sigma, is_shown, shared_noise,
};
use crate::align::robust::{
    GaussianPrior, ResidualRow, covariance, covariance_of_neglected, covariance_of_shared_noise, scale_of,
    step,
};
use crate::align::samples::{Triangle, UnitSamples, WITH_PRODUCTS, force_of, rate_of};
use crate::align::settings::AlignSettings;

/// Lever arm, bias, rotation between the triads, stretch, delay, the primary's own gyroscope bias, second and third order of the
/// response of the accelerometers, and of the primary's gyroscope against its accelerometer the delay and second order.
const UNKNOWNS: usize = 23;
const BIAS: usize = 3;
const ROTATION: usize = 6;
const STRETCH: usize = 9;
const DELAY: usize = 15;
const RATE_BIAS: usize = 16;
const SECOND: usize = 19;
const THIRD: usize = 20;
const RATE_DELAY: usize = 21;
const RATE_SECOND: usize = 22;

/// Unknowns that are left out of the fit or may be: stretch, second and fourth order of the response.
const NEGLECTED: usize = 8;
const NEGLECTED_SECOND: usize = 6;
const NEGLECTED_FOURTH: usize = 7;

const ROUNDS: usize = 20;
/// Change of the lever arm, m, after which another round is not worth it.
const SETTLED: f64 = 1e-7;
/// The same for a delay, s, at which samples are averaged anew.
const SETTLED_DELAY: f64 = 1e-7;

/// 1-sigma of the lever arm before any data, m.
const LARGEST_ARM: f64 = 3.0;
/// 1-sigma of the bias before any data, m/s^2.
const LARGEST_BIAS: f64 = 5.0;
/// 1-sigma of the rotation about an axis that the rates leave open, once the forces have shown it roughly, rad.
const UNKNOWN_ANGLE: f64 = 1.0;
/// 1-sigma of the angle between what the two gyroscopes and what the two accelerometers show of the rotation, rad.
const LARGEST_ANGLE: f64 = 0.02;

/// Unknowns that a log does not change: the lever arm. Biases that drift look like an angle that changes.
const CONSTANT: [usize; 3] = [0, 1, 2];

/// Estimates from the specific forces of two units, given the rates.
#[derive(Clone, Debug)]
pub struct ForcesFit {
    /// From primary to secondary, m, the primary's frame; zero along what is not seen.
    pub lever_arm: Vector3<f64>,
    /// Covariance, m^2; nine along what is not seen, as before any data.
    pub lever_arm_covariance: Matrix3<f64>,
    /// Unit vectors, the primary's frame, along which the lever arm is not seen.
    pub unseen: Vec<Vector3<f64>>,
    /// Bias of the secondary less that of the primary as the secondary has it, m/s^2.
    pub bias: Vector3<f64>,
    /// 1-sigma.
    pub bias_sigma: Vector3<f64>,
    /// Small rotation of the accelerometers beyond that of the gyroscopes, rad, the secondary's frame.
    pub angle: Vector3<f64>,
    /// Covariance, rad^2, without that of the gyroscopes' rotation.
    pub angle_covariance: Matrix3<f64>,
    /// Time by which the accelerometers' offset is larger than that of the gyroscopes, s.
    pub delay: f64,
    /// 1-sigma.
    pub delay_sigma: f64,
    /// S of `M = (1 + S) R`, symmetric where all of it is seen.
    pub stretch: Matrix3<f64>,
    /// Step of the lever arm, m, in the course of the log.
    pub changed: Option<Changed<3>>,
    /// 1-sigma of a component of a residual, m/s^2.
    pub scale: f64,
    /// Sum of the squares of angle, stretch and delay over what they may be between two sound units.
    pub of_priors: f64,
}

impl ForcesFit {
    /// Widens all that was found by a factor on the variances.
    pub(super) fn widen(&mut self, by: f64) {
        self.lever_arm_covariance *= by;
        self.angle_covariance *= by;
        self.bias_sigma *= by.sqrt();
        self.delay_sigma *= by.sqrt();
    }
}

struct ForceUnknowns {
    arm: Vector3<f64>,
    bias: Vector3<f64>,
    rotation: Rotation3<f64>,
    /// Axes of the secondary about which the rates do not show the rotation.
    axes: Vec<Vector3<f64>>,
    angle: Vector3<f64>,
    stretch: SVector<f64, 6>,
    /// Leaves of a vector what lies along directions whose stretch the forces show.
    stretchable: Matrix3<f64>,
    rate_bias: Vector3<f64>,
    delays: SensorDelays,
    /// Delays at which the pairs were averaged.
    averaged_at: SensorDelays,
    response: ResponseTerms,
    /// Second order of the primary's gyroscope against its accelerometer, s^2.
    rate_second: f64,
    /// True if the motion shows the second order of the response of the accelerometers.
    bends: bool,
}

/// The samples that the rates were fitted to.
#[derive(Clone, Copy, Debug)]
pub struct Averaged<'a> {
    /// Windows of the primary.
    pub grid: &'a Grid,
    primary: &'a UnitSamples<'a>,
    secondary: &'a UnitSamples<'a>,
}

impl<'a> Averaged<'a> {
    /// Two units over windows of the primary.
    pub fn new(grid: &'a Grid, primary: &'a UnitSamples<'a>, secondary: &'a UnitSamples<'a>) -> Self {
        Self {
            grid,
            primary,
            secondary,
        }
    }

    /// Pairs with the specific forces at the clock of the rates.
    fn pairs(&self, rates: &RatesFit, delays: SensorDelays) -> Vec<TrianglePair> {
        self.grid
            .pairs_with_delays(self.primary, self.secondary, &rates.clock, delays)
    }
}

/// Fits by Gauss and Newton (docs/theory/align.md, eq. 13, 14); the samples are averaged anew in each round.
pub fn fit(rates: &RatesFit, samples: &Averaged<'_>, settings: &AlignSettings) -> Option<ForcesFit> {
    let mut pairs = rates.pairs.clone();
    let mut guess = ForceUnknowns {
        arm: Vector3::zeros(),
        bias: Vector3::zeros(),
        rotation: rates.rotation,
        axes: rates.unseen.clone(),
        angle: Vector3::zeros(),
        stretch: SVector::zeros(),
        stretchable: Matrix3::identity(),
        rate_bias: settings.rate_bias.0,
        delays: SensorDelays::default(),
        averaged_at: SensorDelays::default(),
        response: ResponseTerms::default(),
        rate_second: 0.0,
        bends: true,
    };
    let unseen = guess.unseen(&pairs, rates.slope_scale);
    guess.settle(&mut pairs, rates, samples, &unseen, settings)?;
    // Residuals that a filter leaves would pass for noise that hides it, were its second order not tried first.
    if !guess.bends_at(&pairs, samples.grid.length) {
        guess.bends = false;
        guess.response.second = 0.0;
        guess.settle(&mut pairs, rates, samples, &unseen, settings)?;
    }
    guess.finish(&pairs, samples.grid.length, &unseen, settings)
}

impl ForceUnknowns {
    /// Rounds until nothing changes; the samples are averaged anew in each.
    fn settle(
        &mut self,
        pairs: &mut Vec<TrianglePair>,
        rates: &RatesFit,
        samples: &Averaged<'_>,
        unseen: &[Vector3<f64>],
        settings: &AlignSettings,
    ) -> Option<()> {
        for _ in 0..ROUNDS {
            self.stretchable = self.stretchable_at(pairs);
            let row = |k: usize| self.row(&pairs[k]);
            let next = step(pairs.len(), row, &self.prior(unseen, settings))?;
            self.change(&next.change);
            *pairs = samples.pairs(rates, self.delays);
            self.averaged_at = self.delays;
            let delays = next.change[DELAY].abs().max(next.change[RATE_DELAY].abs());
            if next.change.fixed_rows::<3>(0).norm() < SETTLED && delays < SETTLED_DELAY {
                break;
            }
        }
        Some(())
    }

    fn turned(&self) -> Rotation3<f64> {
        Rotation3::new(self.angle) * self.rotation
    }

    fn stretched(&self) -> Matrix3<f64> {
        Matrix3::identity() + symmetric(&self.stretch) * self.stretchable
    }

    fn stretchable_at(&self, pairs: &[TrianglePair]) -> Matrix3<f64> {
        let scale = scale_of(pairs.iter().map(|pair| self.row(pair).1));
        let turned = self.turned();
        let forces = pairs.iter().map(|pair| turned * force_of(&pair.primary.mean));
        directions_above_noise(forces, scale)
    }

    fn bends_at(&self, pairs: &[TrianglePair], window: f64) -> bool {
        let scale = scale_of(pairs.iter().map(|pair| self.row(pair).1));
        let sigma = self.response.shown_from(self.delays.secondary_force);
        is_shown(
            pairs.iter().map(|pair| self.curvature(pair)),
            scale,
            window,
            sigma,
        )
    }

    /// The matrix L of `L r`, mean of what a lever arm r adds to specific force (docs/theory/align.md, eq. 13), and its first two
    /// derivatives.
    fn lever(&self, pair: &TrianglePair) -> [Matrix3<f64>; 3] {
        let Triangle {
            mean,
            slope,
            curvature,
            jerk,
        } = &pair.primary;
        let of_bias = self.rate_bias * self.rate_bias.transpose();
        [
            (mean, slope, of_bias),
            (slope, curvature, Matrix3::zeros()),
            (curvature, jerk, Matrix3::zeros()),
        ]
        .map(|(rate, acceleration, constant)| {
            let cross = rate_of(rate) * self.rate_bias.transpose();
            let freed = squares_of(rate) - cross - cross.transpose() + constant;
            cross_matrix(&rate_of(acceleration)) + freed - Matrix3::identity() * freed.trace() // eq. 13: L
        })
    }

    /// L as the primary's accelerometer would have it, were its response the gyroscope's, and its derivative by the second order of
    /// that response (docs/theory/align.md, eq. 21): a filter acts on rates, not on their products.
    fn lever_in_step(&self, pair: &TrianglePair) -> (Matrix3<f64>, Matrix3<f64>) {
        let [lever, slope, curvature] = self.lever(pair);
        let change = rate_of(&pair.primary.slope);
        let squares = change * change.transpose() * 2.0;
        let filtered = curvature - squares + Matrix3::identity() * squares.trace(); // eq. 21
        let late = self.delays.primary_rate - self.averaged_at.primary_rate;
        (lever + slope * late + filtered * self.rate_second, filtered) // eq. 21
    }

    /// Mean second derivative of what both units measure of the secondary's specific force (docs/theory/align.md, eq. 21).
    fn curvature(&self, pair: &TrianglePair) -> Vector3<f64> {
        let [_, _, bent] = self.lever(pair);
        let ours = self.stretched() * (self.turned() * (force_of(&pair.primary.curvature) + bent * self.arm));
        (force_of(&pair.secondary.curvature) + ours) * 0.5 // eq. 21
    }

    fn row(&self, pair: &TrianglePair) -> ResidualRow<UNKNOWNS> {
        let (lever, filtered) = self.lever_in_step(pair);
        let [_, lever_slope, bent] = self.lever(pair);
        let half = 0.5 * self.response.second;
        let turned = self.turned();
        let stretched = self.stretched();
        let felt = force_of(&pair.primary.mean) + force_of(&pair.primary.curvature) * half;
        let force = turned * (felt + (lever + bent * half) * self.arm);
        let slope = force_of(&pair.secondary.slope);
        let jerk = force_of(&pair.secondary.jerk);
        let late = self.delays.secondary_force - self.averaged_at.secondary_force;
        let predicted = stretched * force + self.bias - slope * late
            + force_of(&pair.secondary.curvature) * half
            + jerk * self.response.third; // eq. 13, 21
        let early = self.delays.primary_rate - self.averaged_at.primary_rate;
        let rate = rate_of(&pair.primary.mean) - self.rate_bias
            + rate_of(&pair.primary.slope) * early
            + rate_of(&pair.primary.curvature) * (self.rate_second + half);
        let by_rate_bias =
            cross_matrix(&rate.cross(&self.arm)) + cross_matrix(&rate) * cross_matrix(&self.arm);
        let matrix = stretched * turned;
        let mut design = SMatrix::<f64, 3, UNKNOWNS>::zeros();
        design
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(matrix * (lever + bent * half))); // eq. 14: dr
        design
            .fixed_view_mut::<3, 3>(0, BIAS)
            .copy_from(&Matrix3::identity()); // eq. 14: db
        design
            .fixed_view_mut::<3, 3>(0, ROTATION)
            .copy_from(&(-stretched * cross_matrix(&force))); // eq. 14: d alpha
        set_stretch(&mut design, STRETCH, &(self.stretchable * force)); // eq. 14: dS
        design.set_column(DELAY, &-slope); // eq. 14: d delta
        design
            .fixed_view_mut::<3, 3>(0, RATE_BIAS)
            .copy_from(&(matrix * by_rate_bias)); // eq. 14: db of the primary's rate
        if self.bends {
            design.set_column(SECOND, &self.curvature(pair)); // eq. 21: d gamma
        }
        design.set_column(THIRD, &jerk); // eq. 21: d eta
        design.set_column(RATE_DELAY, &(matrix * lever_slope * self.arm)); // eq. 21
        design.set_column(RATE_SECOND, &(matrix * filtered * self.arm)); // eq. 21
        (design, force_of(&pair.secondary.mean) - predicted)
    }

    /// Derivative by the stretch and second order of the response where they are not fitted, for they act on little more than
    /// noise, and by its fourth order, of which `fourth` is the derivative.
    fn neglected(&self, pair: &TrianglePair, fourth: &Vector3<f64>) -> SMatrix<f64, 3, NEGLECTED> {
        let turned = self.turned() * force_of(&pair.primary.mean);
        let mut design = SMatrix::<f64, 3, NEGLECTED>::zeros();
        set_stretch(&mut design, 0, &(turned - self.stretchable * turned));
        if !self.bends {
            design.set_column(NEGLECTED_SECOND, &self.curvature(pair));
        }
        design.set_column(NEGLECTED_FOURTH, fourth);
        design
    }

    /// Directions of the primary along which only noise of the angular acceleration would show a lever arm.
    fn unseen(&self, pairs: &[TrianglePair], slope_scale: f64) -> Vec<Vector3<f64>> {
        #[allow(clippy::cast_precision_loss)]
        let share = 1.0 / pairs.len().max(1) as f64;
        let levers = pairs.iter().map(|pair| self.lever(pair)[0]);
        let information: Matrix3<f64> = levers.map(|lever| lever.tr_mul(&lever) * share).sum();
        directions_below(&information, ABOVE_NOISE * 2.0 * slope_scale * slope_scale)
    }

    fn prior(&self, unseen: &[Vector3<f64>], settings: &AlignSettings) -> GaussianPrior<UNKNOWNS> {
        let mut sigma = SVector::<f64, UNKNOWNS>::repeat(LARGEST_ARM);
        sigma.fixed_rows_mut::<3>(BIAS).fill(LARGEST_BIAS);
        sigma.fixed_rows_mut::<3>(ROTATION).fill(LARGEST_ANGLE);
        sigma
            .fixed_rows_mut::<6>(STRETCH)
            .copy_from(&settings.stretch_sigma());
        sigma[DELAY] = LARGEST_DELAY;
        (sigma[SECOND], sigma[THIRD]) = self.response.sigma(self.delays.secondary_force); // eq. 20
        sigma[RATE_DELAY] = LARGEST_DELAY;
        sigma[RATE_SECOND] = self.rate_time().powi(2); // eq. 20
        sigma.fixed_rows_mut::<3>(RATE_BIAS).fill(settings.rate_bias.1);
        let mut missing = SVector::<f64, UNKNOWNS>::zeros();
        missing.fixed_rows_mut::<3>(0).copy_from(&-self.arm);
        missing.fixed_rows_mut::<3>(BIAS).copy_from(&-self.bias);
        missing.fixed_rows_mut::<3>(ROTATION).copy_from(&-self.angle);
        missing.fixed_rows_mut::<6>(STRETCH).copy_from(&-self.stretch);
        missing[DELAY] = -self.delays.secondary_force;
        missing[SECOND] = -self.response.second;
        missing[THIRD] = -self.response.third;
        missing[RATE_DELAY] = -self.delays.primary_rate;
        missing[RATE_SECOND] = -self.rate_second;
        let rate_bias = settings.rate_bias.0 - self.rate_bias;
        missing.fixed_rows_mut::<3>(RATE_BIAS).copy_from(&rate_bias);
        let mut precision = SMatrix::from_diagonal(&sigma.map(|sigma| 1.0 / (sigma * sigma)));
        let free = 1.0 / (UNKNOWN_ANGLE * UNKNOWN_ANGLE) - 1.0 / (LARGEST_ANGLE * LARGEST_ANGLE);
        for axis in &self.axes {
            let mut angle = precision.fixed_view_mut::<3, 3>(ROTATION, ROTATION);
            angle += axis * axis.transpose() * free;
        }
        for direction in unseen {
            let mut arm = precision.fixed_view_mut::<3, 3>(0, 0);
            arm += direction * direction.transpose() * HELD;
        }
        GaussianPrior { precision, missing }
    }

    /// Time of the filter of the primary's gyroscope against its accelerometer, s: without delay it has none.
    fn rate_time(&self) -> f64 {
        let response = ResponseTerms {
            second: self.rate_second,
            third: 0.0,
        };
        response.time(self.delays.primary_rate, SMALLEST_DELAY) // eq. 20: T
    }

    /// Variance of each component of the lever arm, m^2, that the third order of that filter leaves (docs/theory/align.md, eq. 22).
    fn third_order_variance(&self, pairs: &[TrianglePair]) -> f64 {
        let (mut energy, mut slopes) = (0.0, 0.0);
        for pair in pairs {
            let [lever, slope, _] = self.lever(pair);
            energy += lever.norm_squared();
            slopes += slope.norm_squared();
        }
        let turned = self.rate_time().powi(2) * slopes / energy.max(f64::MIN_POSITIVE);
        turned.powi(3) * self.arm.norm_squared() / 3.0 // eq. 22
    }

    fn change(&mut self, by: &SVector<f64, UNKNOWNS>) {
        self.arm += by.fixed_rows::<3>(0);
        self.bias += by.fixed_rows::<3>(BIAS);
        self.angle = (Rotation3::new(by.fixed_rows::<3>(ROTATION).into_owned()) * Rotation3::new(self.angle))
            .scaled_axis();
        self.stretch += by.fixed_rows::<6>(STRETCH);
        self.delays.secondary_force += by[DELAY];
        self.delays.primary_rate += by[RATE_DELAY];
        self.response.second += by[SECOND];
        self.response.third += by[THIRD];
        self.rate_second += by[RATE_SECOND];
        self.rate_bias += by.fixed_rows::<3>(RATE_BIAS);
    }

    fn finish(
        self,
        pairs: &[TrianglePair],
        window: f64,
        unseen: &[Vector3<f64>],
        settings: &AlignSettings,
    ) -> Option<ForcesFit> {
        let row = |k: usize| self.row(&pairs[k]);
        let scale = scale_of((0..pairs.len()).map(|k| row(k).1));
        let prior = self.prior(unseen, settings);
        let times: Vec<f64> = pairs.iter().map(|pair| pair.time).collect();
        let curvatures: Vec<_> = pairs.iter().map(|pair| self.curvature(pair)).collect();
        let fourth = fourth_derivatives(&times, &curvatures, window);
        let neglected = |k: usize| self.neglected(&pairs[k], &fourth[k]);
        let delay = self.delays.secondary_force;
        let (second, _) = self.response.sigma(delay);
        let of_fourth = fourth_sigma(&self.response, delay);
        let sigma = settings.stretch_sigma().push(second).push(of_fourth);
        let spread = covariance(pairs.len(), row, |k| pairs[k].block, scale, &prior, CONSTANT)?;
        let mut covariance =
            spread.covariance + covariance_of_neglected(pairs.len(), row, neglected, scale, &prior, &sigma)?;
        if self.bends {
            let shared = 3.0 * shared_noise(scale, window);
            covariance += covariance_of_shared_noise(pairs.len(), row, SECOND, shared, scale, &prior)?;
        }
        let third = self.third_order_variance(pairs);
        for k in 0..3 {
            covariance[(k, k)] += third;
        }
        for direction in unseen {
            let mut arm = covariance.fixed_view_mut::<3, 3>(0, 0);
            arm += direction * direction.transpose() * (LARGEST_ARM * LARGEST_ARM);
        }
        let sigma = covariance.diagonal().map(f64::sqrt);
        Some(ForcesFit {
            lever_arm: self.arm,
            lever_arm_covariance: covariance.fixed_view::<3, 3>(0, 0).into_owned(),
            unseen: unseen.to_vec(),
            bias: self.bias,
            bias_sigma: sigma.fixed_rows::<3>(BIAS).into_owned(),
            angle: self.angle,
            angle_covariance: covariance.fixed_view::<3, 3>(ROTATION, ROTATION).into_owned(),
            delay: self.delays.secondary_force,
            delay_sigma: sigma[DELAY],
            stretch: self.stretched() - Matrix3::identity(),
            changed: spread.step.map(|step| Changed::at(pairs, step)),
            scale,
            of_priors: of_priors(&prior),
        })
    }
}

/// Products of rates as a matrix.
fn squares_of(channels: &SVector<f64, WITH_PRODUCTS>) -> Matrix3<f64> {
    let p = channels.fixed_rows::<6>(6);
    Matrix3::new(p[0], p[1], p[2], p[1], p[3], p[4], p[2], p[4], p[5])
}

/// Numbers of angle, stretch and delay.
pub const OF_PRIORS: usize = RATE_BIAS - ROTATION;

/// Their squares over what they may be (docs/theory/align.md, eq. 17).
fn of_priors(prior: &GaussianPrior<UNKNOWNS>) -> f64 {
    let missing = prior.missing.fixed_rows::<OF_PRIORS>(ROTATION);
    let precision = prior
        .precision
        .fixed_view::<OF_PRIORS, OF_PRIORS>(ROTATION, ROTATION);
    missing.dot(&(precision * missing)) // eq. 17
}

#[cfg(test)]
#[path = "forces_tests.rs"]
mod tests;
