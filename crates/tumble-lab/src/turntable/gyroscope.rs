//! Step 4 for the gyroscope: every rest, and every turn between rests, both units saw.

use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3};
use tumble_core::noise::Interval;
use tumble_core::segmenter::Segment;
use tumble_core::turntable::fit::fit;
use tumble_core::turntable::observation::FitInputs;
use tumble_core::turntable::truth::{
    RateObservation, ReferenceTurn, TruthSource, at_rest, turning, with_specific_force,
};

use super::accelerometer::nominal;
use super::error::TurntableError;
use super::flicker::refine;
use super::pairing::PairedRest;
use super::session::{LARGEST_RATE_BIAS, TargetSession};
use super::triad::{Label, TriadCalibration, finish};
use crate::acquisition::{Acquired, interval};

/// The angular rate over one interval, and the mean specific force over it, m/s^2.
struct Rate {
    label: Label,
    observation: RateObservation<f64>,
    force: Vector3<f64>,
}

impl TargetSession<'_> {
    /// Calibrates the gyroscope; `mounting` is what the accelerometer showed of it, else the turns show it.
    pub fn gyroscope(&self, mounting: Option<&Rotation3<f64>>) -> Result<TriadCalibration, TurntableError> {
        let compensated = self.table_from_case();
        let back = compensated.unwrap_or_else(Rotation3::identity);
        let rates = self.rates(&back);
        let labels = rates.iter().map(|rate| rate.label).collect();
        let nominal = match (compensated, mounting) {
            (Some(_), _) => Matrix3::identity(),
            (None, Some(mounting)) => *mounting.matrix(),
            (None, None) => {
                let observations: Vec<_> = rates.iter().map(|rate| rate.observation).collect();
                nominal(&observations).ok_or(TurntableError::DirectionsTooAlike)?
            }
        };
        let mut inputs = FitInputs {
            noise: self.unit.rate_noise(),
            session: self.span(),
            nominal,
            largest_bias: LARGEST_RATE_BIAS,
            shared: turned(&self.reference.earth.covariance, &back),
        };
        if self.settings.g_sensitivity {
            let coupled = |rate: &Rate| with_specific_force(&rate.observation, &rate.force);
            let observations: Vec<_> = rates.iter().map(coupled).collect();
            inputs.noise = refine(&observations, &inputs);
            let solved = fit::<f64, 7, 6, 27>(&observations, &inputs)?;
            let found = finish(&solved, &observations, labels, &inputs, 0.0)?;
            return Ok(found.with_pace(self.pace_variance()));
        }
        let observations: Vec<_> = rates.iter().map(|rate| rate.observation).collect();
        inputs.noise = refine(&observations, &inputs);
        let solved = fit::<f64, 4, 6, 18>(&observations, &inputs)?;
        let found = finish(&solved, &observations, labels, &inputs, 0.0)?;
        Ok(found.with_pace(self.pace_variance()))
    }

    /// The rotation of the published compensation, where it is asked for.
    fn table_from_case(&self) -> Option<Rotation3<f64>> {
        let mounting = self.reference.mounting.as_ref()?;
        (self.settings.truth == TruthSource::RotateMeasurement).then(|| mounting.rotation.inverse())
    }

    /// Rests and turns in order of time. `back` turns truth and readings alike.
    fn rates(&self, back: &Rotation3<f64>) -> Vec<Rate> {
        let pairs = &self.pairing.pairs;
        let mut rates = Vec::new();
        for (k, pair) in pairs.iter().enumerate() {
            rates.push(self.at_rest(pair));
            rates.extend(pairs.get(k + 1).and_then(|next| self.turn(pair, next)));
        }
        for rate in &mut rates {
            rate.observation = turn_back(rate.observation, back);
            rate.force = back * rate.force;
        }
        rates
    }

    fn at_rest(&self, pair: &PairedRest) -> Rate {
        let reading = pair.segment.angular_rate();
        let attitude = &self.reference.attitudes[pair.reference];
        let seen = &self.reference_unit.rests[pair.reference];
        Rate {
            label: Label::Rest(pair.reference),
            observation: at_rest(self.when(&pair.segment), reading, attitude, &self.reference.earth),
            force: seen.specific_force() - self.reference.sphere.bias,
        }
    }

    /// The turn between two rests; `None` where one of the units did not record all of it.
    fn turn(&self, pair: &PairedRest, next: &PairedRest) -> Option<Rate> {
        let whole = |turn: &Segment<f64>| turn.complete;
        let seen = self
            .reference_unit
            .between(pair.reference, next.reference)
            .filter(whole)?;
        let felt = self.unit.between(pair.target.1, next.target.0).filter(whole)?;
        let turn = ReferenceTurn {
            angle_variance: angle_variance(self.reference_unit, &seen),
            angle: seen.angle() + self.earth_between_cuts(pair, next, &interval(&seen), &self.when(&felt)),
            interval: interval(&seen),
            noise: self.reference_unit.rate_noise(),
            session: self.reference_unit.session(),
        };
        let reading = felt.angle() / felt.duration();
        let mut observation = turning(self.when(&felt), reading, &turn, &self.reference.earth);
        observation.reading_variance = angle_variance(self.unit, &felt) / felt.duration().powi(2);
        Some(Rate {
            label: Label::Turn(pair.reference, next.reference),
            observation,
            force: seen.velocity() / seen.duration() - self.reference.sphere.bias,
        })
    }

    /// Where the target was cut later or earlier than the reference, the Earth went on turning: rad.
    fn earth_between_cuts(
        &self,
        pair: &PairedRest,
        next: &PairedRest,
        seen: &Interval<f64>,
        felt: &Interval<f64>,
    ) -> Vector3<f64> {
        let turned = |rest: usize, seconds: f64| match self.reference.attitudes[rest] {
            Some(start_from_here) => start_from_here.inverse() * self.reference.earth.earth_rate * seconds,
            None => Vector3::zeros(),
        };
        turned(pair.reference, seen.start - felt.start) + turned(next.reference, felt.end - seen.end)
    }
}

/// Variance of the angle of a turn because samples are missing in it, rad^2, besides what the noise of the rests, which
/// lack some too, says of one as long (docs/theory/turntable.md, eq. 29 to 31).
fn angle_variance(unit: &Acquired, turn: &Segment<f64>) -> Vector3<f64> {
    let noise = unit.rate_noise();
    let duration = turn.duration();
    let interpolation = &turn.interpolation;
    let longer = (duration + interpolation.longer) / (1.0 + unit.share_missing_at_rest()) - duration; // eq. 31
    Vector3::from_fn(|i, _| noise[i].white * longer + interpolation.variance[i])
}

/// A covariance of two vectors, both turned.
fn turned(covariance: &Matrix6<f64>, rotation: &Rotation3<f64>) -> Matrix6<f64> {
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation.matrix());
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(rotation.matrix());
    both * covariance * both.transpose()
}

/// The published compensation: reading and truth turned back into the table frame.
fn turn_back(mut observation: RateObservation<f64>, back: &Rotation3<f64>) -> RateObservation<f64> {
    let u = back * observation.regressor.fixed_rows::<3>(0).into_owned();
    observation.regressor.fixed_rows_mut::<3>(0).copy_from(&u);
    observation.reading = back * observation.reading;
    let variance = Matrix3::from_diagonal(&observation.reading_variance);
    observation.reading_variance = (back.matrix() * variance * back.matrix().transpose()).diagonal();
    observation.truth_covariance = back.matrix() * observation.truth_covariance * back.matrix().transpose();
    for half in [0, 3] {
        let by = back.matrix() * observation.sensitivity.fixed_columns::<3>(half) * back.matrix().transpose();
        observation
            .sensitivity
            .fixed_columns_mut::<3>(half)
            .copy_from(&by);
    }
    observation
}
