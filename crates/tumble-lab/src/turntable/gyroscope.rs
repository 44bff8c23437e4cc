//! Step 4 for the gyroscope: every rest, every turn between rests, and every constant rate both units saw.

use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3};
use tumble_core::noise::{Interval, Noise};
use tumble_core::rotation::cross_matrix;
use tumble_core::segmenter::Segment;
use tumble_core::turntable::fit::fit;
use tumble_core::turntable::observation::{FitInputs, Observation};
use tumble_core::turntable::truth::{
    RateObservation, ReferenceTurn, TruthSource, at_rest, turning, with_specific_force,
};

use super::accelerometer::nominal;
use super::asymmetry::asymmetric;
use super::clock_shift::{Shifted, find_shift};
use super::error::TurntableError;
use super::flicker::refine;
use super::g_sensitivity::is_shown;
use super::pairing::PairedRest;
use super::rate_response::{AxisResponse, rate_response};
use super::session::{LARGEST_RATE_BIAS, TargetSession};
use super::session_change::Slip;
use super::settings::GSensitivity;
use super::triad::{ResidualLabel, TriadCalibration, finish};
use crate::acquisition::motion::Passage;
use crate::acquisition::{Acquired, Plateau, interval};

/// The angular rate over one interval, and the mean specific force over it, m/s^2.
struct Rate {
    label: ResidualLabel,
    observation: RateObservation<f64>,
    /// That of the reference; once the accelerometer of the target is calibrated, its own.
    force: Vector3<f64>,
    /// Mean reading of the accelerometer of the target.
    felt: Vector3<f64>,
    /// Derivative of the truth by a shift of the target's clock, rad/s^2.
    by_shift: Vector3<f64>,
}

/// By how much the rests of two units are cut apart where both see the same, s: a block, and the latency of a logger.
const LATENCY: f64 = 0.3;

/// Calibration of the gyroscope, and the response of its axes at constant rates.
pub(super) type GyroscopeFit = (TriadCalibration, Vec<AxisResponse>);

fn with_responses(triad: TriadCalibration, rates: &[Rate]) -> GyroscopeFit {
    let observations: Vec<_> = rates.iter().map(|rate| rate.observation).collect();
    let forces: Vec<_> = rates.iter().map(|rate| rate.force).collect();
    let responses = rate_response(&triad, &observations, &forces);
    (triad, responses)
}

/// Where a ramp begins or ends.
#[derive(Clone, Copy)]
enum End<'a> {
    Rest(&'a PairedRest),
    Rate(usize, &'a Plateau),
}

impl TargetSession<'_> {
    /// Calibrates the gyroscope by what the accelerometer showed of its mounting; where there is none, the turns show it.
    pub fn gyroscope(
        &self,
        accelerometer: Option<&TriadCalibration>,
    ) -> Result<GyroscopeFit, TurntableError> {
        let mounting = accelerometer.map(|triad| triad.parts.mounting);
        let compensated = self.table_from_case();
        let back = compensated.unwrap_or_else(Rotation3::identity);
        let mut rates = self.rates(&back);
        if let Some(accelerometer) = accelerometer {
            feel_own_force(&mut rates, accelerometer);
            give_way(&mut rates, accelerometer.by_direction / self.settings.gravity);
            if let Some(slip) = &accelerometer.slip {
                rates = as_slipped(rates, slip);
            }
        }
        if self.reference.table.is_some() {
            // Ramps and turns between rests are known from the reference only.
            rates.retain(|rate| matches!(rate.label, ResidualLabel::Rest(_) | ResidualLabel::Rate(_)));
        }
        let labels = rates.iter().map(|rate| rate.label).collect();
        let nominal = match (compensated, mounting) {
            (Some(_), _) => Matrix3::identity(),
            (None, Some(mounting)) => mounting.into_inner(),
            (None, None) => {
                let observations: Vec<_> = rates.iter().map(|rate| rate.observation).collect();
                match nominal(&observations) {
                    Some(rotation) => rotation,
                    // A table that turned about one axis shows one column, and nothing of how the unit is mounted.
                    None if self.constant_rates().next().is_some() => Matrix3::identity(),
                    None => return Err(TurntableError::DirectionsTooAlike),
                }
            }
        };
        // A mean rate does not mind the pace of a clock, a turn does.
        let pace = if self.reference.table.is_some() {
            0.0
        } else {
            self.pace_variance()
        };
        let mut inputs = FitInputs {
            noise: self.unit.rate_noise(),
            session: self.span(),
            nominal,
            largest_bias: LARGEST_RATE_BIAS,
            shared: turned(&self.reference.earth.covariance, &back),
        };
        let shifted: Vec<_> = rates
            .iter()
            .map(|rate| Shifted {
                observation: rate.observation,
                by_shift: rate.by_shift,
            })
            .collect();
        let shift = find_shift(&shifted, &inputs)?;
        for rate in &mut rates {
            shift.correct(&mut rate.observation, &rate.by_shift);
        }
        let observations: Vec<_> = rates.iter().map(|rate| rate.observation).collect();
        if self.settings.g_sensitivity != GSensitivity::Never {
            let coupled = |rate: &Rate| with_specific_force(&rate.observation, &rate.force);
            let coupled: Vec<_> = rates.iter().map(coupled).collect();
            let noise = self.noise_of_residuals::<7, 27>(&coupled, &inputs)?;
            let inputs = FitInputs { noise, ..inputs };
            let solved = fit::<f64, 7, 6, 27>(&coupled, &inputs)?;
            if self.settings.g_sensitivity == GSensitivity::Always
                || is_shown(&solved, &fit::<f64, 4, 6, 18>(&observations, &inputs)?)
            {
                let triad = finish(&solved, &coupled, labels, &inputs, 0.0, &[])?;
                return Ok(with_responses(triad.with_pace(pace), &rates));
            }
        }
        inputs.noise = self.noise_of_residuals::<4, 18>(&observations, &inputs)?;
        let solved = fit::<f64, 4, 6, 18>(&observations, &inputs)?;
        let mut triad = finish(&solved, &observations, labels.clone(), &inputs, 0.0, &[])?;
        if let Some(bent) = asymmetric(&observations, &inputs, &solved)? {
            triad = finish(&bent.solved, &bent.observations, labels, &inputs, 0.0, &[])?;
            triad.asymmetry = Some(bent.asymmetry);
        }
        Ok(with_responses(triad.with_pace(pace), &rates))
    }

    /// Noise with what residuals show of bias instability. Without rests the rotation of the Earth is unknown, and would be
    /// taken for it: a first fit takes it out.
    fn noise_of_residuals<const P: usize, const N: usize>(
        &self,
        observations: &[Observation<f64, P, 6>],
        inputs: &FitInputs<f64, 6>,
    ) -> Result<[Noise<f64>; 3], TurntableError> {
        if self.reference.table.is_none() || !self.reference_unit.rests.is_empty() {
            return Ok(refine(observations, inputs));
        }
        let shared = fit::<f64, P, 6, N>(observations, inputs)?.shared;
        let mut settled = observations.to_vec();
        for observation in &mut settled {
            let mut truth = observation.regressor.fixed_rows_mut::<3>(0);
            truth += observation.sensitivity * shared;
        }
        Ok(refine(&settled, inputs))
    }

    /// The rotation of the published compensation, where it is asked for.
    fn table_from_case(&self) -> Option<Rotation3<f64>> {
        let mounting = self.reference.mounting.as_ref()?;
        (self.settings.truth == TruthSource::RotateMeasurement).then(|| mounting.rotation.inverse())
    }

    /// Rests, turns and constant rates in order of time. `back` turns truth and readings alike.
    fn rates(&self, back: &Rotation3<f64>) -> Vec<Rate> {
        let pairs = &self.pairing.pairs;
        let mut constant: Vec<_> = self.constant_rates().enumerate().collect();
        let mut rates = Vec::new();
        let mut before: Option<End<'_>> = None;
        for pair in pairs {
            let rest = interval(&self.reference_unit.rests[pair.reference]);
            let passed = constant
                .iter()
                .take_while(|(_, plateau)| plateau.interval.start < rest.start)
                .count();
            for (k, plateau) in constant.drain(..passed) {
                rates.extend(self.constant(&mut before, k, plateau));
            }
            rates.extend(before.and_then(|before| match before {
                End::Rest(previous) => self.turn(previous, pair),
                End::Rate(..) => self.ramp(&before, &End::Rest(pair)),
            }));
            rates.push(self.at_rest(pair));
            before = Some(End::Rest(pair));
        }
        for (k, plateau) in constant {
            rates.extend(self.constant(&mut before, k, plateau));
        }
        for rate in &mut rates {
            rate.observation = turn_back(rate.observation, back);
            rate.force = back * rate.force;
            rate.felt = back * rate.felt;
            rate.by_shift = back * rate.by_shift;
        }
        rates
    }

    /// Constant rates of the reference; none where no clock leads from one file to the next.
    fn constant_rates(&self) -> impl Iterator<Item = &Plateau> {
        let continuous = self.reference_unit.parts.len() <= 1;
        self.reference_unit.constant_rates().filter(move |_| continuous)
    }

    /// A constant rate and the ramp that leads to it; nothing where one of the units did not record all of it.
    fn constant<'b>(&self, before: &mut Option<End<'b>>, k: usize, plateau: &'b Plateau) -> Vec<Rate> {
        let end = End::Rate(k, plateau);
        let ramp = before.and_then(|before| self.ramp(&before, &end));
        *before = Some(end);
        let own = self.of_target(&plateau.interval);
        let (seen, felt) = (
            self.reference_unit.motion.over(&plateau.interval),
            self.unit.motion.over(&own),
        );
        let rate = seen.zip(felt).map(|(seen, felt)| {
            let rate = self.passage(
                ResidualLabel::Rate(k),
                &seen,
                &felt,
                Vector3::zeros(),
                Vector3::zeros(),
            );
            self.as_table_truth(rate, k, plateau)
        });
        ramp.into_iter().chain(rate).collect()
    }

    /// A constant rate with the commanded rate for truth, where that is asked for.
    fn as_table_truth(&self, mut rate: Rate, k: usize, plateau: &Plateau) -> Rate {
        if let Some(table) = &self.reference.table {
            let (commanded, seen) = (table.by_rate[k], rate.observation);
            rate.observation =
                self.reference
                    .as_commanded(table, commanded, &seen, plateau, self.settings.gravity);
        }
        rate
    }

    /// From one rest or constant rate to the next.
    fn ramp(&self, from: &End<'_>, to: &End<'_>) -> Option<Rate> {
        let rest = |pair: &PairedRest| interval(&self.reference_unit.rests[pair.reference]);
        let bias = self.reference.earth.bias;
        let own = |time: f64| {
            self.of_target(&Interval {
                start: time,
                end: time,
            })
            .start
        };
        let (start, own_start, rate_before) = match from {
            End::Rest(pair) => (rest(pair).end, self.own_rest(pair).end, Vector3::zeros()),
            End::Rate(_, plateau) => {
                let time = plateau.interval.end;
                (time, own(time), plateau.rate - bias)
            }
        };
        let (end, own_end, rate_after) = match to {
            End::Rest(pair) => (rest(pair).start, self.own_rest(pair).start, Vector3::zeros()),
            End::Rate(_, plateau) => {
                let time = plateau.interval.start;
                (time, own(time), plateau.rate - bias)
            }
        };
        let label = match (from, to) {
            (End::Rest(pair), End::Rate(k, _)) => ResidualLabel::RampUp(pair.reference, *k),
            (End::Rate(k, _), End::Rest(pair)) => ResidualLabel::RampDown(*k, pair.reference),
            (End::Rate(i, _), End::Rate(j, _)) => ResidualLabel::Ramp(*i, *j),
            (End::Rest(one), End::Rest(other)) => ResidualLabel::Turn(one.reference, other.reference),
        };
        let seen = self.reference_unit.motion.over(&Interval { start, end })?;
        let felt = self.unit.motion.over(&Interval {
            start: own_start,
            end: own_end,
        })?;
        let to_reference = |time: f64| self.pairing.clock.to_reference(time);
        let mut between_cuts = Vector3::zeros();
        if let End::Rest(pair) = from {
            between_cuts += self.earth_over(pair.reference, start - to_reference(own_start));
        }
        if let End::Rest(pair) = to {
            between_cuts += self.earth_over(pair.reference, to_reference(own_end) - end);
        }
        let by_shift = (rate_after - rate_before) / felt.interval.duration();
        Some(self.passage(label, &seen, &felt, between_cuts, by_shift))
    }

    /// One span as both units integrated it.
    fn passage(
        &self,
        label: ResidualLabel,
        seen: &Passage,
        felt: &Passage,
        between_cuts: Vector3<f64>,
        by_shift: Vector3<f64>,
    ) -> Rate {
        let turn = ReferenceTurn {
            angle_variance: angle_variance(self.reference_unit, seen)
                + self.reference_unit.rounding.of_constant_rate(&seen.interval),
            angle: seen.angle + between_cuts,
            interval: seen.interval,
            noise: self.reference_unit.rate_noise(),
            session: self.reference_unit.session(),
        };
        let duration = felt.interval.duration();
        let clock = &self.pairing.clock;
        let when = Interval {
            start: clock.to_reference(felt.interval.start),
            end: clock.to_reference(felt.interval.end),
        };
        let mut observation = turning(when, felt.angle / duration, &turn, &self.reference.earth);
        let rounding = self.unit.rounding.of_constant_rate(&felt.interval);
        observation.reading_variance = (angle_variance(self.unit, felt) + rounding) / duration.powi(2);
        Rate {
            label,
            observation,
            force: seen.velocity / seen.interval.duration() - self.reference.sphere.bias,
            felt: felt.velocity / duration,
            by_shift,
        }
    }

    /// A rest of the target without what the reference saw of it as turning: a slow turn beside it is hidden in the noise
    /// of the target. `None` where it is the rest of the target itself.
    fn cut(&self, pair: &PairedRest) -> Option<Passage> {
        let own = interval(&pair.segment);
        let seen = self.of_target(&interval(&self.reference_unit.rests[pair.reference]));
        let cut = Interval {
            start: if own.start < seen.start - LATENCY {
                seen.start
            } else {
                own.start
            },
            end: if own.end > seen.end + LATENCY {
                seen.end
            } else {
                own.end
            },
        };
        let turned = self.constant_rates().next().is_some();
        (turned && cut != own)
            .then(|| self.unit.motion.over(&cut))
            .flatten()
    }

    /// When a rest took place, s on the clock of the target.
    fn own_rest(&self, pair: &PairedRest) -> Interval<f64> {
        self.cut(pair)
            .map_or_else(|| interval(&pair.segment), |cut| cut.interval)
    }

    fn at_rest(&self, pair: &PairedRest) -> Rate {
        let cut = self.cut(pair);
        let (reading, felt) = cut.map_or_else(
            || (pair.segment.angular_rate(), pair.segment.specific_force()),
            |cut| {
                let duration = cut.interval.duration();
                (cut.angle / duration, cut.velocity / duration)
            },
        );
        let own = self.own_rest(pair);
        let when = Interval {
            start: self.pairing.clock.to_reference(own.start),
            end: self.pairing.clock.to_reference(own.end),
        };
        let attitude = &self.reference.attitudes[pair.reference];
        let seen = &self.reference_unit.rests[pair.reference];
        let mut observation = at_rest(when, reading, attitude, &self.reference.earth);
        observation.reading_variance = self.unit.excess_variance(pair.target.0, 3);
        Rate {
            label: ResidualLabel::Rest(pair.reference),
            observation,
            force: seen.specific_force() - self.reference.sphere.bias,
            felt,
            by_shift: Vector3::zeros(),
        }
    }

    /// The turn between two rests; `None` where one of the units did not record all of it.
    fn turn(&self, pair: &PairedRest, next: &PairedRest) -> Option<Rate> {
        let whole = |turn: &Segment<f64>| turn.complete;
        let seen = self
            .reference_unit
            .between(pair.reference, next.reference)
            .filter(whole)?;
        // Between two rests of the reference the target may have rested on.
        let turned = pair.target.1 < next.target.0;
        let felt = (turned
            .then(|| self.unit.between(pair.target.1, next.target.0))
            .flatten())
        .filter(whole)?;
        let (by_reference, by_target) = (self.reference_unit.turned(&seen), self.unit.turned(&felt));
        let when = self.on_clock_of_reference(&by_target.interval);
        let turn = ReferenceTurn {
            angle_variance: angle_variance(self.reference_unit, &passage_of(&seen))
                + besides_noise(self.reference_unit, &seen),
            angle: by_reference.angle + self.earth_between_cuts(pair, next, &by_reference.interval, &when),
            interval: by_reference.interval,
            noise: self.reference_unit.rate_noise(),
            session: self.reference_unit.session(),
        };
        let reading = by_target.angle / by_target.duration();
        let mut observation = turning(when, reading, &turn, &self.reference.earth);
        let variance = angle_variance(self.unit, &passage_of(&felt)) + besides_noise(self.unit, &felt);
        observation.reading_variance = variance / by_target.duration().powi(2);
        Some(Rate {
            label: ResidualLabel::Turn(pair.reference, next.reference),
            observation,
            force: seen.velocity() / seen.duration() - self.reference.sphere.bias,
            felt: felt.velocity() / felt.duration(),
            by_shift: Vector3::zeros(),
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
        self.earth_over(pair.reference, seen.start - felt.start)
            + self.earth_over(next.reference, felt.end - seen.end)
    }

    /// Angle through which the Earth turns a rest within so many seconds, rad.
    fn earth_over(&self, rest: usize, seconds: f64) -> Vector3<f64> {
        match self.reference.attitudes[rest] {
            Some(start_from_here) => start_from_here.inverse() * self.reference.earth.earth_rate * seconds,
            None => Vector3::zeros(),
        }
    }
}

/// Variance that rounding and uncertain stamps leave on the angle of a turn, rad^2.
fn besides_noise(unit: &Acquired, turn: &Segment<f64>) -> Vector3<f64> {
    let rounding = unit.rounding.of_turn(turn, unit.rests.len());
    rounding.add_scalar(unit.variance_by_stamps(turn))
}

/// Gives each rate the specific force at the place of the target, which a table at a constant rate pulls outwards by another
/// one than the reference (docs/theory/turntable.md, section 5).
fn feel_own_force(rates: &mut [Rate], accelerometer: &TriadCalibration) {
    let correction = accelerometer.model.correction().ok();
    let Some(correction) = correction.filter(|_| accelerometer.observed.iter().all(|is| *is)) else {
        return;
    };
    for rate in rates {
        rate.force = correction.apply(&rate.felt);
    }
}

/// Makes the axis of each turn as uncertain as the tilt of the accelerometer from direction to direction: turns about one axis
/// share it (docs/theory/turntable.md, eq. 55).
fn give_way(rates: &mut [Rate], tilt: f64) {
    let turning = |rate: &&Rate| !matches!(rate.label, ResidualLabel::Rest(_));
    #[allow(clippy::cast_precision_loss)]
    let alike = (rates.iter().filter(turning).count() as f64 / 3.0).max(1.0);
    for rate in rates {
        if !matches!(rate.label, ResidualLabel::Rest(_)) {
            let u = rate.observation.regressor.fixed_rows::<3>(0).into_owned();
            let across = Matrix3::identity() * u.norm_squared() - u * u.transpose();
            rate.observation.truth_covariance += across * (tilt * tilt * alike); // eq. 55
        }
    }
}

/// Truths as a target that slipped sees them, which all are as uncertain as its turn; the one within which it slipped is left
/// out (docs/theory/turntable.md, eq. 61).
fn as_slipped(rates: Vec<Rate>, slip: &Slip) -> Vec<Rate> {
    let mut slipped = Vec::with_capacity(rates.len());
    let other = |rate: &Rate| slip.divides(&rate.observation.interval);
    #[allow(clippy::cast_precision_loss)]
    let alike = (rates.iter().filter(|rate| other(rate) == Some(true)).count() as f64 / 3.0).max(1.0);
    for mut rate in rates {
        match other(&rate) {
            Some(false) => {}
            Some(true) => {
                let u = rate.observation.regressor.fixed_rows::<3>(0).into_owned();
                let by_turn = cross_matrix(&u);
                rate.observation.truth_covariance += by_turn * slip.covariance * by_turn.transpose() * alike; // eq. 61
                let turned = Rotation3::new(slip.turn) * u;
                rate.observation
                    .regressor
                    .fixed_rows_mut::<3>(0)
                    .copy_from(&turned);
            }
            None => continue,
        }
        slipped.push(rate);
    }
    slipped
}

/// A segment as a span of a recording.
fn passage_of(segment: &Segment<f64>) -> Passage {
    Passage {
        interval: interval(segment),
        angle: segment.angle(),
        velocity: segment.velocity(),
        longer: segment.interpolation.longer,
        variance: Vector3::from(segment.interpolation.variance),
    }
}

/// Variance of the angle of a turn because samples are missing in it, rad^2, besides the variance that the noise of the
/// rests, which lack some too, gives one as long (docs/theory/turntable.md, eq. 29 to 31).
fn angle_variance(unit: &Acquired, passage: &Passage) -> Vector3<f64> {
    let noise = unit.rate_noise();
    let duration = passage.interval.duration();
    let longer = (duration + passage.longer) / (1.0 + unit.share_missing_at_rest()) - duration; // eq. 31
    Vector3::from_fn(|i, _| noise[i].white * longer + passage.variance[i])
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
