//! Remaining shift between two clocks, as ramps between unequal rates show it.
//!
//! A turn from rest to rest does not mind a shift, and neither does a constant rate. A ramp from one rate to another does:
//! its mean rate changes by the difference of the two rates over its length, a second (docs/theory/turntable.md, eq. 34).

use nalgebra::Vector3;
use tumble_core::regression::Unsolvable;
use tumble_core::turntable::fit::fit;
use tumble_core::turntable::observation::FitInputs;
use tumble_core::turntable::truth::RateObservation;

/// Largest plausible shift, s: the latency of a logger.
const LARGEST: f64 = 0.1;

/// Rounds in which shift and model settle.
const ROUNDS: u32 = 2;

/// An interval, and what a shift does to its truth.
pub(super) struct Shifted {
    /// Truth and reading.
    pub observation: RateObservation<f64>,
    /// Derivative of the truth by the shift, rad/s^2.
    pub by_shift: Vector3<f64>,
}

/// A shift of the target's clock against the reference's.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TargetShift {
    value: f64,
    variance: f64,
}

impl TargetShift {
    /// Takes the shift out of the truth of an interval, and adds its uncertainty.
    pub fn correct(&self, observation: &mut RateObservation<f64>, by_shift: &Vector3<f64>) {
        let mut truth = observation.regressor.fixed_rows_mut::<3>(0);
        truth += by_shift * self.value; // eq. 34
        observation.truth_covariance += by_shift * by_shift.transpose() * self.variance;
    }
}

/// Estimates the shift by turns with the model: first from what it does not touch.
pub(super) fn find_shift(rates: &[Shifted], inputs: &FitInputs<f64, 6>) -> Result<TargetShift, Unsolvable> {
    let steady = |rate: &&Shifted| rate.by_shift == Vector3::zeros();
    if rates.iter().all(|rate| steady(&rate)) {
        return Ok(TargetShift::default());
    }
    let mut observations: Vec<_> = rates.iter().filter(steady).map(|rate| rate.observation).collect();
    let mut shift = TargetShift::default();
    for _ in 0..=ROUNDS {
        let model = fit::<f64, 4, 6, 18>(&observations, inputs)?;
        let (mut information, mut vector) = (LARGEST.powi(-2), 0.0);
        for rate in rates.iter().filter(|rate| !steady(rate)) {
            let along = model.model.matrix * rate.by_shift;
            let residual = model.residual(&rate.observation);
            let length = rate.observation.interval.duration();
            for axis in 0..3 {
                let m = model.model.matrix.row(axis);
                let of_truth = (m * rate.observation.truth_covariance * m.transpose())[0];
                let own = inputs.noise[axis].white / length + rate.observation.reading_variance[axis];
                information += along[axis].powi(2) / (own + of_truth);
                vector += along[axis] * residual[axis] / (own + of_truth);
            }
        }
        shift = TargetShift {
            value: vector / information,
            variance: 1.0 / information,
        };
        observations = rates
            .iter()
            .map(|rate| {
                let mut observation = rate.observation;
                shift.correct(&mut observation, &rate.by_shift);
                observation
            })
            .collect();
    }
    Ok(shift)
}
