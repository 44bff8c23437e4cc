//! From the samples of one unit to the calibration of both its triads.

use std::borrow::Cow;

use nalgebra::{DMatrix, Matrix3, SMatrix, UnitQuaternion, Vector3};
use rayon::prelude::*;
use tumble_core::gravity::{EARTH_RATE, STANDARD, vertical_earth_rate};
use tumble_core::model::{ErrorModel, ModelCovariance, PARAMETERS};
use tumble_core::noise::Interval;
use tumble_core::real::seconds;
use tumble_core::segmenter::Segment;
use tumble_core::turntable::reference::earth_variance;

use super::accelerometer::{
    AccelerometerFit, NonLinearity, PLACES, RestForce, RestForces, UNKNOWNS, fit_forces, residual, sizes,
};
use super::dead_band::{TurnDeadBand, dead_band};
use super::error::MultiposeError;
use super::faces::{FaceRest, FacesFit, fit_faces, fit_tilted, label_faces};
use super::ferraris::{Ferraris, ferraris};
use super::gyroscope::{
    ExcessScatter, FullTurn, RATE_BIAS, RestDirection, Rotations, RotationsFit, Turn, fit_rates,
};
use super::held::{HeldSpan, held_spans, is_among, restlessness, soft_mean, take_slow_noise, times, tremor};
use super::next_orientation::{NextOrientation, next_orientation};
use super::next_turn::{NextTurn, next_turn};
use super::nominal_scale::{NominalScale, counts, rounded};
use super::rest_selection::{BY_HAND, TOLERANCES, acquire};
use super::rotation_response::TurnSamples;
use super::samples::MultiposeSamples;
use super::sections::{Section, take_labelled, take_rests};
use super::settings::{FULL_TURN_SIGMA, KnownNoise, MultiposeSettings};
use super::time_base::implausible_scale;
use super::turn_bias::{TurnBias, TurnLoss, turn_bias, turn_loss, turn_widening};
use crate::acquisition::{Acquired, Tremor, interval};
use crate::constant_length::influence::Influence;
use crate::constant_length::residual::LengthResidual;
use crate::constant_length::sphere::start;
use crate::turntable::flicker::remembered;
use crate::turntable::reference_uncertainty::Inheritance;
use crate::turntable::{ResidualLabel, TriadCalibration, force_sigma, rate_sigma, widening};

/// A rest and what the calibration makes of it.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// Corrected specific force, m/s^2.
    pub force: Vector3<f64>,
    /// Raw `|y| - g`, m/s^2.
    pub before: f64,
    /// `|u| - g` corrected, m/s^2.
    pub after: f64,
    /// 1-sigma of the latter from noise, m/s^2.
    pub sigma: f64,
    /// Weight in the robust loss.
    pub weight: f64,
    /// Rests of one number show one direction.
    pub direction: usize,
    /// Change of the fit without it.
    pub influence: Influence,
    /// `|u| - g` by a fit without this direction, m/s^2.
    pub held_out: Option<f64>,
}

/// Estimates of the gyroscope from the turns.
#[derive(Clone, Debug)]
pub struct Gyroscope {
    /// Its calibration, in the case frame of the accelerometer.
    pub calibration: TriadCalibration,
    /// Rests before and after each turn that was used.
    pub turns: Vec<(usize, usize)>,
    /// Angle between gravity as turned and as found, rad, without calibration and with it.
    pub angles: Vec<(f64, f64)>,
    /// Scatter of turns and rests besides noise.
    pub excess: ExcessScatter,
    /// The turn that is worth most.
    pub next: Option<NextTurn>,
    /// Its scale on all axes alike, where no sensor has that one: the sample rate is wrong.
    pub implausible_scale: Option<f64>,
    /// Root mean square of the angles, rad, with g-sensitivity, where it was not fitted and the bias depends on attitude.
    pub with_g_sensitivity: Option<f64>,
    /// Its bias in turns less that at rest, where the turns show it.
    pub turn_bias: Option<TurnBias>,
    /// Angle that every turn loses; `None` where turns do not show it.
    pub turn_loss: Option<TurnLoss>,
    /// Its widest dead band, where it has one.
    pub dead_band: Option<TurnDeadBand>,
    /// Factor by which turns are off beyond noise and a bias that varies; 1 where they are not.
    pub turn_widening: f64,
}

impl Gyroscope {
    /// Root mean square, rad, of the angles that are left between gravity as turned and as found.
    fn angle_after(&self) -> f64 {
        #[allow(clippy::cast_precision_loss)]
        let count = self.angles.len().max(1) as f64;
        (self.angles.iter().map(|(_, after)| after * after).sum::<f64>() / count).sqrt()
    }
}

/// A stretch in which a unit kept its orientation and that is not used.
#[derive(Clone, Copy, Debug)]
pub struct LeftOut {
    /// When, s of the recording's own clock.
    pub span: (f64, f64),
    /// Trembling of the rest; `None` where it lay still.
    pub tremor: Option<Tremor>,
}

/// Both triads of a unit, calibrated.
#[derive(Clone, Debug)]
pub struct Multipose {
    /// Rests and turns, of readings in SI units about their nominal zero.
    pub acquired: Acquired,
    /// Factor on the usual limits of stillness that was chosen.
    pub tolerance: f64,
    /// Stretches in which the unit was held and which are among no rest.
    pub left_out: Vec<LeftOut>,
    /// Scale of counts, where readings are that.
    pub nominal: Option<NominalScale>,
    /// Its case frame is that of its own axes.
    pub accelerometer: TriadCalibration,
    /// One for each rest.
    pub poses: Vec<Pose>,
    /// The orientation that is worth most.
    pub next: Option<NextOrientation>,
    /// Second-order non-linearity of the accelerometer, where the residuals show it.
    pub non_linearity: Option<NonLinearity>,
    /// Further results of six faces.
    pub faces: Option<Faces>,
    /// Or why there is none.
    pub gyroscope: Result<Gyroscope, MultiposeError>,
}

/// Further results of a session on six faces.
#[derive(Clone, Debug)]
pub struct Faces {
    /// By how much a face was off level about either axis, rad, 1-sigma.
    pub tilt: f64,
    /// Which stretches were taken for what.
    pub sections: Vec<Section>,
    /// The formulas of Ferraris, of readings as they were given.
    pub ferraris: Ferraris,
}

/// Largest sigmas of both sensors, one times the other, over those of usual rests, below which rests that tremble are used, and
/// the same where they show more directions.
const CLEARLY_BETTER: (f64, f64) = (0.5, 1.05);

/// Angles that the gyroscope leaves, over those it leaves of usual rests, above which rests that tremble are not used: they moved.
const NOT_WORSE: f64 = 1.2;

impl Multipose {
    fn is_better_than(&self, usual: &Self) -> bool {
        let directions = |found: &Self| found.poses.iter().map(|pose| pose.direction).max();
        let more = directions(self) > directions(usual);
        let limit = if more { CLEARLY_BETTER.1 } else { CLEARLY_BETTER.0 };
        self.cost() < limit * usual.cost() && !self.leaves_more_than(usual)
    }

    fn leaves_more_than(&self, usual: &Self) -> bool {
        let angle = |found: &Self| found.gyroscope.as_ref().ok().map(Gyroscope::angle_after);
        matches!((angle(self), angle(usual)), (Some(own), Some(usual)) if own > NOT_WORSE * usual)
    }

    /// Largest sigma of the accelerometer times that of the gyroscope, in units of what each unknown may be.
    fn cost(&self) -> f64 {
        let largest = |calibration: &TriadCalibration, bias: f64| {
            let sizes = (0..PARAMETERS).map(|i| if i < 9 { 1.0 } else { bias });
            let sigmas = calibration.covariance.diagonal().map(f64::sqrt);
            sigmas
                .iter()
                .zip(sizes)
                .map(|(sigma, size)| sigma / size)
                .fold(0.0, f64::max)
        };
        let gyroscope = self
            .gyroscope
            .as_ref()
            .map_or(1.0, |gyroscope| largest(&gyroscope.calibration, RATE_BIAS));
        largest(&self.accelerometer, STANDARD) * gyroscope
    }
}

/// A unit as it is worked on: SI units, zeros near zero.
struct Centred<'a> {
    given: MultiposeSamples<'a>,
    force: Cow<'a, [[f64; 3]]>,
    rate: Cow<'a, [[f64; 3]]>,
    force_zero: Vector3<f64>,
    rate_zero: Vector3<f64>,
    nominal: Option<NominalScale>,
}

/// Calibrates a unit.
///
/// # Errors
/// [`MultiposeError`] where there is no calibration of the accelerometer, without which there is none of the gyroscope.
pub fn multipose(
    samples: &MultiposeSamples<'_>,
    settings: &MultiposeSettings,
) -> Result<Multipose, MultiposeError> {
    let mut unit = Centred::of(samples, settings)?;
    let mut found = unit.calibrate(settings)?;
    if unit.nominal.is_some() && unit.take_rate_scale(&found) {
        found = unit.calibrate(settings)?;
    }
    found.nominal = unit.nominal;
    found.accelerometer = found
        .accelerometer
        .with_gravity(settings.gravity_sigma / settings.gravity);
    found.accelerometer.model.bias += unit.force_zero;
    if let Ok(gyroscope) = &mut found.gyroscope {
        gyroscope.calibration.model.bias += unit.rate_zero;
    }
    Ok(found)
}

/// Rests found with one tolerance, or labelled, and the accelerometer fitted to them.
struct Candidate {
    tolerance: f64,
    acquired: Acquired,
    sections: Vec<Section>,
    fit: Fitted,
}

/// Fit of the accelerometer.
enum Fitted {
    /// To the length of gravity.
    Norm(RestForces, Box<AccelerometerFit>),
    /// To the directions of six faces.
    Faces(Vec<FaceRest>, Box<FacesFit>),
}

/// A calibrated accelerometer, as the gyroscope needs it.
struct CalibratedForces {
    model: ErrorModel<f64>,
    covariance: ModelCovariance<f64>,
    /// Corrected specific force at each rest, m/s^2.
    forces: Vec<Vector3<f64>>,
    full_turns: Vec<FullTurn>,
}

impl<'a> Centred<'a> {
    fn of(samples: &MultiposeSamples<'a>, settings: &MultiposeSettings) -> Result<Self, MultiposeError> {
        let mut unit = Self {
            given: *samples,
            force: Cow::Borrowed(samples.force),
            rate: Cow::Borrowed(samples.rate),
            force_zero: Vector3::zeros(),
            rate_zero: Vector3::zeros(),
            nominal: None,
        };
        if settings.raw {
            let counted = counts(samples.time, samples.force, samples.rate, settings.gravity);
            let counted = counted.ok_or(MultiposeError::Unsolvable)?;
            centre(unit.force.to_mut(), &counted.force_zero, counted.scale.force);
            centre(unit.rate.to_mut(), &counted.rate_zero, counted.scale.rate);
            unit.force_zero = counted.force_zero * counted.scale.force;
            unit.rate_zero = counted.rate_zero * counted.scale.rate;
            unit.nominal = Some(counted.scale);
        }
        Ok(unit)
    }

    /// Takes the scale that the turns showed for the nominal one.
    fn take_rate_scale(&mut self, found: &Multipose) -> bool {
        let (Ok(gyroscope), Some(nominal)) = (&found.gyroscope, &mut self.nominal) else {
            return false;
        };
        let scale = rounded(gyroscope.calibration.parts.scale.mean() / nominal.rate).recip();
        let factor = scale / nominal.rate;
        centre(self.rate.to_mut(), &Vector3::zeros(), factor);
        self.rate_zero *= factor;
        nominal.rate = scale;
        true
    }

    /// The calibration that is known best, of all that are with one tolerance or another: each by its largest sigma,
    /// widened by its normalised cost (docs/theory/multipose.md, eq. 21).
    fn calibrate(&self, settings: &MultiposeSettings) -> Result<Multipose, MultiposeError> {
        let tolerances = if settings.sections.is_empty() {
            &TOLERANCES[..]
        } else {
            &TOLERANCES[..1]
        };
        let tried: Vec<_> = tolerances
            .par_iter()
            .map(|tolerance| self.candidate(*tolerance, settings))
            .collect();
        let spans = if settings.sections.is_empty() && !settings.faces {
            #[allow(clippy::cast_precision_loss)]
            held_spans(&self.samples(), settings.shortest_rest as f64 * 1e-6)
        } else {
            Vec::new()
        };
        let mut refusal = MultiposeError::NoRests;
        let mut solved = Vec::new();
        for each in tried {
            match each {
                Ok(each) => solved.push((each.fit.cost(settings.gravity), each)),
                // The refusal with the tolerance that found most is the most informative.
                Err(error) if says_more(&error, &refusal) => refusal = error,
                Err(_) => {}
            }
        }
        let best = solved.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let found = best.ok_or(refusal);
        let found = found.and_then(|(_, candidate)| self.describe(candidate, settings));
        let held = self.held_candidate(&spans, settings);
        let held = held.map(|held| held.and_then(|held| self.describe(held, settings)));
        let mut found = match (found, held) {
            (Err(_), Some(Ok(held))) => held,
            (Ok(found), Some(Ok(held))) if held.is_better_than(&found) => held,
            (Err(still), Some(Err(held))) => return Err(if says_more(&held, &still) { held } else { still }),
            (found, _) => found?,
        };
        found.left_out = self.left_out(&spans, &found.acquired);
        Ok(found)
    }

    /// Stretches in which the unit was held that are among no rest.
    fn left_out(&self, spans: &[HeldSpan], chosen: &Acquired) -> Vec<LeftOut> {
        let samples = self.samples();
        let unused = spans
            .iter()
            .filter(|span| !is_among(times(&samples, **span), chosen.origin, &chosen.rests));
        unused
            .map(|span| LeftOut {
                span: times(&samples, *span),
                tremor: tremor(&samples, *span),
            })
            .collect()
    }

    fn samples(&self) -> MultiposeSamples<'_> {
        MultiposeSamples {
            time: self.given.time,
            force: &self.force,
            rate: &self.rate,
        }
    }

    /// Candidate with rests of which some tremble; `None` where none does, where they are labelled, or are too few.
    fn held_candidate(
        &self,
        spans: &[HeldSpan],
        settings: &MultiposeSettings,
    ) -> Option<Result<Candidate, MultiposeError>> {
        let samples = self.samples();
        let still: Vec<_> = spans
            .iter()
            .map(|span| tremor(&samples, *span).is_none())
            .collect();
        if still.iter().all(|still| *still) {
            return None;
        }
        let mut acquired = acquire(
            self.given.time,
            &self.force,
            &self.rate,
            settings.shortest_rest,
            BY_HAND,
        );
        take_rests(&mut acquired, &samples, spans, |k| still[k]);
        if still.iter().all(|still| !*still) {
            take_slow_noise(&mut acquired.noise, &samples, spans);
        }
        KnownNoise::put_into(&settings.noise, &mut acquired);
        acquired.stamp_sigma = settings.stamp_sigma;
        acquired.restlessness = restlessness(&samples, spans, &acquired.noise);
        for (k, span) in spans.iter().enumerate().filter(|(k, _)| !still[*k]) {
            acquired.rests[k].moments = acquired.rests[k].moments.about(&soft_mean(&samples, *span));
        }
        let fit = Fitted::to_norm(&acquired, settings.gravity);
        Some(fit.map(|fit| Candidate {
            tolerance: BY_HAND,
            acquired,
            sections: Vec::new(),
            fit,
        }))
    }

    fn candidate(&self, tolerance: f64, settings: &MultiposeSettings) -> Result<Candidate, MultiposeError> {
        let mut acquired = acquire(
            self.given.time,
            &self.force,
            &self.rate,
            settings.shortest_rest,
            tolerance,
        );
        let sections = if settings.faces && settings.sections.is_empty() {
            label_faces(&acquired, |time| self.index(time))
        } else {
            settings.sections.clone()
        };
        if settings.faces || !sections.is_empty() {
            take_labelled(&mut acquired, &self.samples(), &sections);
        }
        KnownNoise::put_into(&settings.noise, &mut acquired);
        acquired.stamp_sigma = settings.stamp_sigma;
        let fit = if settings.faces {
            Fitted::to_faces(&acquired, &sections, settings.gravity)?
        } else {
            Fitted::to_norm(&acquired, settings.gravity)?
        };
        Ok(Candidate {
            tolerance,
            acquired,
            sections,
            fit,
        })
    }

    fn describe(
        &self,
        candidate: Candidate,
        settings: &MultiposeSettings,
    ) -> Result<Multipose, MultiposeError> {
        let Candidate {
            tolerance,
            acquired,
            sections,
            fit,
        } = candidate;
        let accelerometer = fit.calibration(&acquired)?;
        let gyroscope = if settings.gyroscope {
            let full_turns = self.full_turns(&acquired, &sections, &fit, settings);
            let forces = fit.calibrated(&accelerometer, full_turns);
            self.gyroscope(&acquired, &forces, settings)
        } else {
            Err(MultiposeError::NoTurns)
        };
        Ok(Multipose {
            tolerance,
            left_out: Vec::new(),
            nominal: None,
            poses: fit.poses(&acquired, settings.gravity),
            next: fit.next(settings.gravity),
            non_linearity: fit.non_linearity(),
            faces: fit
                .tilt()
                .zip(ferraris(&self.given, &sections, settings.gravity))
                .map(|(tilt, ferraris)| Faces {
                    tilt,
                    sections,
                    ferraris,
                }),
            accelerometer,
            gyroscope,
            acquired,
        })
    }

    fn gyroscope(
        &self,
        unit: &Acquired,
        forces: &CalibratedForces,
        settings: &MultiposeSettings,
    ) -> Result<Gyroscope, MultiposeError> {
        let data = Rotations {
            rests: rest_directions(unit, forces, settings),
            turns: self.turns(unit, forces, settings),
            full_turns: forces.full_turns.clone(),
            accelerometer_covariance: forces.covariance,
            noise: unit.rate_noise(),
            remembered: remembered_at_rests(unit),
            g_sensitivity: settings.g_sensitivity,
            latitude: settings.latitude,
        };
        let plain = fit_rates(&data)?;
        let turns = data.turns.iter().map(|turn| (turn.before, turn.after)).collect();
        let angles = plain.angle_before.iter().copied().zip(plain.angles()).collect();
        let felt = felt_force(&data, &plain);
        let with_g_sensitivity = felt
            .as_ref()
            .map(|(_, with)| rms(with))
            .filter(|with| *with < rms(&plain));
        let of_rests = plain.excess.rest;
        // Nobody asked for the response to specific force, but turns have it: it stays among the unknowns.
        let (data, rates) = felt.unwrap_or((data, plain));
        let calibration = rate_calibration(&data, &rates, settings)?;
        Ok(Gyroscope {
            implausible_scale: implausible_scale(&calibration),
            angles,
            with_g_sensitivity,
            turn_bias: turn_bias(&data, &rates),
            turn_loss: turn_loss(&data, &rates),
            dead_band: dead_band(&self.rates_at_rest(unit), &data.turns),
            turn_widening: turn_widening(&rates),
            calibration,
            excess: ExcessScatter {
                rest: of_rests,
                ..rates.excess
            },
            next: next_turn(&data, &rates),
            turns,
        })
    }

    /// Readings of labelled full turns, where they lie on a table as the faces do.
    fn full_turns(
        &self,
        unit: &Acquired,
        sections: &[Section],
        fit: &Fitted,
        settings: &MultiposeSettings,
    ) -> Vec<FullTurn> {
        let Fitted::Faces(_, faces) = fit else {
            return Vec::new();
        };
        let Ok(correction) = faces.model.correction() else {
            return Vec::new();
        };
        let noise = unit.rate_noise();
        #[allow(clippy::cast_precision_loss)]
        let at_rest = unit
            .rests
            .iter()
            .map(|rest| rest.angular_rate())
            .sum::<Vector3<f64>>()
            / (unit.rests.len().max(1) as f64);
        let of = |section: &Section| {
            let axis = Vector3::ith(section.label.turned_about()?, 1.0);
            let within = section.first..section.end;
            #[allow(clippy::cast_precision_loss)]
            let samples = within.len() as f64;
            let (from, to) = (self.given.time[section.first], self.given.time[section.end - 1]);
            let duration = (to - from) * samples / (samples - 1.0);
            let mean = |readings: &[[f64; 3]]| {
                readings[within.clone()]
                    .iter()
                    .map(|y| Vector3::from(*y))
                    .sum::<Vector3<f64>>()
                    / samples
            };
            let span = Interval {
                start: from - unit.origin,
                end: from - unit.origin + duration,
            };
            let of_noise = Vector3::from_fn(|i, _| {
                noise[i].covariance(&span, &span, &unit.session()) * duration * duration
            });
            let along = axis * axis.transpose();
            let step = duration / samples;
            let swept = swept(
                self.rate[within.clone()]
                    .iter()
                    .map(|y| (Vector3::from(*y) - at_rest).dot(&axis) * step),
            );
            let by_earth = level_earth_variance(settings) * (swept * step).powi(2); // eq. 26
            let across =
                (Matrix3::identity() - along) * ((std::f64::consts::TAU * faces.tilt).powi(2) + by_earth);
            Some(FullTurn {
                axis,
                angle: mean(&self.rate) * duration,
                velocity: correction.apply(&mean(&self.force)) * duration,
                duration,
                covariance: along * FULL_TURN_SIGMA.powi(2) + across + Matrix3::from_diagonal(&of_noise), // eq. 26
            })
        };
        sections.iter().filter_map(of).collect()
    }

    /// Readings of the gyroscope at each rest, rad/s.
    fn rates_at_rest(&self, unit: &Acquired) -> Vec<&[[f64; 3]]> {
        let place = |time| self.place(unit.origin + seconds::<f64>(time));
        let rests = unit.rests.iter();
        rests
            .map(|rest| &self.rate[place(rest.start)..place(rest.end)])
            .collect()
    }

    /// The turns that were recorded whole.
    fn turns(&self, unit: &Acquired, forces: &CalibratedForces, settings: &MultiposeSettings) -> Vec<Turn> {
        let whole = unit.turns.iter().enumerate().filter(|(_, turn)| turn.complete);
        let Ok(correction) = forces.model.correction() else {
            return Vec::new();
        };
        let turns = whole.filter_map(|(before, turn)| {
            let from = self.index(unit.origin + seconds::<f64>(unit.rests[before].end));
            let to = self.index(unit.origin + seconds::<f64>(unit.rests[before + 1].start));
            let force = self.force.get(from..=to)?;
            let samples = TurnSamples {
                time: self.given.time[from..=to].to_vec(),
                rate: self.rate[from..=to].iter().map(|w| Vector3::from(*w)).collect(),
                force: force
                    .iter()
                    .map(|f| correction.apply(&Vector3::from(*f)))
                    .collect(),
            };
            Some(Turn {
                before,
                after: before + 1,
                variance: turn_variance(unit, turn, settings),
                samples,
            })
        });
        turns.filter(|turn| turn.samples.time.len() > 2).collect()
    }

    /// The sample nearest to a time, s.
    fn index(&self, time: f64) -> usize {
        self.place(time).min(self.given.time.len() - 1)
    }

    /// Number of samples before a time, s.
    fn place(&self, time: f64) -> usize {
        // Segments know their times to the microsecond.
        self.given.time.partition_point(|t| *t < time - 1e-6)
    }
}

/// The fit with the response to specific force among its unknowns, where the bias differs from rest to rest, nobody asked for
/// the response, and it explains most of the difference.
fn felt_force(data: &Rotations, found: &RotationsFit) -> Option<(Rotations, RotationsFit)> {
    if data.g_sensitivity || found.excess.rest == 0.0 {
        return None;
    }
    let data = Rotations {
        g_sensitivity: true,
        ..data.clone()
    };
    let with = fit_rates(&data)
        .ok()
        .filter(|with| with.excess.rest < 0.5 * found.excess.rest)?;
    Some((data, with))
}

/// Root mean square of the angle between gravity as turned and as found, rad.
fn rms(fit: &RotationsFit) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let count = fit.turned_less_found.len().max(1) as f64;
    (fit.angles().map(|angle| angle * angle).sum::<f64>() / count).sqrt()
}

fn centre(readings: &mut [[f64; 3]], zero: &Vector3<f64>, scale: f64) {
    for reading in readings {
        for axis in 0..3 {
            reading[axis] = (reading[axis] - zero[axis]) * scale;
        }
    }
}

fn says_more(error: &MultiposeError, before: &MultiposeError) -> bool {
    let rank = |error: &MultiposeError| match error {
        MultiposeError::NoRests => 0,
        MultiposeError::TooFewDirections { found, .. } => *found,
        MultiposeError::FacesMissing { missing } => missing.iter().filter(|missing| !**missing).count(),
        _ => usize::MAX,
    };
    rank(error) > rank(before)
}

/// Factor on the variances of a fit, where noise does not explain its residuals.
fn cost_factor(fit: &AccelerometerFit) -> f64 {
    widening(fit.chi_square(), fit.degrees_of_freedom())
}

/// The rests of a unit.
fn forces_of(unit: &Acquired) -> RestForces {
    let of = |k: usize| RestForce {
        mean: unit.rests[k].specific_force(),
        variance: force_sigma(unit, k).map(|sigma| sigma * sigma),
    };
    RestForces {
        rests: (0..unit.rests.len()).map(of).collect(),
        flicker: Vector3::from(unit.force_noise().map(|noise| noise.flicker)),
        remembered: remembered_at_rests(unit),
    }
}

fn remembered_at_rests(unit: &Acquired) -> DMatrix<f64> {
    let intervals: Vec<_> = unit.rests.iter().map(interval).collect();
    remembered(&intervals, &unit.session())
}

impl Fitted {
    fn to_norm(unit: &Acquired, gravity: f64) -> Result<Self, MultiposeError> {
        let data = forces_of(unit);
        let means: Vec<_> = data.rests.iter().map(|rest| rest.mean).collect();
        let fit = fit_forces(&data, gravity, &start(&means, gravity))?;
        Ok(Self::Norm(data, Box::new(fit)))
    }

    fn to_faces(unit: &Acquired, sections: &[Section], gravity: f64) -> Result<Self, MultiposeError> {
        let mut faces: Vec<_> = sections
            .iter()
            .filter(|section| section.label.up().is_some())
            .collect();
        faces.sort_by_key(|section| section.first);
        let each = faces.iter().zip(&unit.rests).enumerate();
        let rests: Vec<_> = each
            .filter_map(|(k, (section, rest))| {
                Some(FaceRest {
                    up: section.label.up()?,
                    mean: rest.specific_force(),
                    excess: unit.excess_variance(k, 0),
                    interval: interval(rest),
                })
            })
            .collect();
        let fit = fit_faces(&rests, &unit.force_noise(), &unit.session(), gravity)?;
        Ok(Self::Faces(rests, Box::new(fit)))
    }

    /// The largest sigma, in units of scale or of g (docs/theory/multipose.md, eq. 21).
    fn cost(&self, gravity: f64) -> f64 {
        match self {
            Self::Norm(_, fit) => {
                let sigmas = fit.covariance.diagonal().map(f64::sqrt);
                sigmas.component_div(&sizes(gravity)).max() * cost_factor(fit).sqrt() // eq. 21
            }
            Self::Faces(_, fit) => {
                let sigmas = fit.covariance.diagonal().map(f64::sqrt);
                sigmas.rows(0, 9).max().max(sigmas.rows(9, 3).max() / gravity)
            }
        }
    }

    fn non_linearity(&self) -> Option<NonLinearity> {
        match self {
            Self::Norm(_, fit) => fit.non_linearity,
            Self::Faces(..) => None,
        }
    }

    fn tilt(&self) -> Option<f64> {
        match self {
            Self::Norm(..) => None,
            Self::Faces(_, fit) => Some(fit.tilt),
        }
    }

    fn calibration(&self, unit: &Acquired) -> Result<TriadCalibration, MultiposeError> {
        match self {
            Self::Norm(_, fit) => force_calibration(unit, fit),
            Self::Faces(_, fit) => faces_calibration(fit),
        }
    }

    fn calibrated(&self, found: &TriadCalibration, full_turns: Vec<FullTurn>) -> CalibratedForces {
        let forces = match self {
            Self::Norm(_, fit) => fit.residuals.iter().map(|r| r.vector).collect(),
            Self::Faces(rests, fit) => {
                let correction = fit.model.correction().ok();
                rests
                    .iter()
                    .filter_map(|rest| Some(correction.as_ref()?.apply(&rest.mean)))
                    .collect()
            }
        };
        CalibratedForces {
            model: found.model,
            covariance: found.covariance,
            forces,
            full_turns,
        }
    }

    fn next(&self, gravity: f64) -> Option<NextOrientation> {
        match self {
            Self::Norm(data, fit) => next_orientation(fit, &data.rests, gravity),
            // A seventh orientation is no face.
            Self::Faces(..) => None,
        }
    }

    fn poses(&self, unit: &Acquired, gravity: f64) -> Vec<Pose> {
        match self {
            Self::Norm(data, fit) => norm_poses(data, fit, gravity),
            Self::Faces(rests, fit) => face_poses(unit, rests, fit, gravity),
        }
    }
}

fn norm_poses(data: &RestForces, fit: &AccelerometerFit, gravity: f64) -> Vec<Pose> {
    let unseen = fit.held_out();
    let influences = fit.influence();
    (0..data.rests.len())
        .map(|k| Pose {
            before: data.rests[k].mean.norm() - gravity,
            weight: fit.weights[k],
            direction: fit.groups[k],
            influence: influences[k],
            held_out: unseen[k],
            ..pose(&fit.residuals[k])
        })
        .collect()
}

fn face_poses(unit: &Acquired, rests: &[FaceRest], fit: &FacesFit, gravity: f64) -> Vec<Pose> {
    let data = forces_of(unit).rests;
    let sigmas = fit.covariance.diagonal().map(f64::sqrt);
    let of = |k: usize| {
        let here = residual(&fit.model, &data[k], gravity)?;
        let others: Vec<_> = (0..rests.len())
            .filter(|other| *other != k)
            .map(|other| rests[other])
            .collect();
        let noise = unit.force_noise();
        let without = fit_tilted(&others, &noise, &unit.session(), gravity, fit.tilt).ok()?;
        let matrix = (fit.model.matrix - without.model.matrix).transpose();
        let bias = fit.model.bias - without.model.bias;
        let changes = matrix.iter().chain(&bias).zip(&sigmas);
        let held_out = residual(&without.model, &data[k], gravity)?.value;
        Some(Pose {
            before: data[k].mean.norm() - gravity,
            direction: rests.iter().position(|rest| rest.up == rests[k].up)?,
            influence: Influence {
                leverage: 1.0 - (here.value / held_out).abs().min(1.0),
                change: changes
                    .map(|(change, sigma)| (change / sigma).abs())
                    .fold(0.0, f64::max),
            },
            held_out: Some(held_out),
            ..pose(&here)
        })
    };
    (0..rests.len()).filter_map(of).collect()
}

/// Pose with its residual alone.
fn pose(found: &LengthResidual) -> Pose {
    Pose {
        force: found.vector,
        before: f64::NAN,
        after: found.value,
        sigma: found.sigma,
        weight: 1.0,
        direction: 0,
        influence: Influence {
            leverage: 0.0,
            change: 0.0,
        },
        held_out: None,
    }
}

fn rest_directions(
    unit: &Acquired,
    forces: &CalibratedForces,
    settings: &MultiposeSettings,
) -> Vec<RestDirection> {
    let Ok(correction) = forces.model.correction() else {
        return Vec::new();
    };
    let each = forces.forces.iter().enumerate().map(|(k, force)| {
        let up = force.normalize();
        let across = (Matrix3::identity() - up * up.transpose()) / force.norm();
        let by_reading = across * correction.matrix;
        let noise = Matrix3::from_diagonal(&force_sigma(unit, k).map(|sigma| sigma * sigma));
        RestDirection {
            force: *force,
            covariance: by_reading * noise * by_reading.transpose(),
            by_accelerometer: SMatrix::from_fn(|i, place| match place {
                0..9 => -by_reading[(i, place / 3)] * force[place % 3],
                place => -by_reading[(i, place - 9)],
            }),
            rate: unit.rests[k].angular_rate(),
            rate_variance: rate_sigma(unit, k).map(|sigma| sigma * sigma),
            earth_rate: up * settings.latitude.map_or(0.0, vertical_earth_rate),
            ends: unit
                .restlessness(k)
                .map_or([UnitQuaternion::identity(); 2], |found| {
                    [found.start_from_mean, found.end_from_mean]
                }),
        }
    });
    each.collect()
}

/// Variance of the Earth's rotation along a level direction, (rad/s)^2.
fn level_earth_variance(settings: &MultiposeSettings) -> f64 {
    settings.latitude.map_or(earth_variance(), |latitude| {
        0.5 * (EARTH_RATE * libm::cos(latitude)).powi(2)
    })
}

/// Length of the sum of unit vectors whose direction gains these angles, rad: a level rate that turns with the unit adds up
/// to that many steps of it.
fn swept(gained: impl Iterator<Item = f64>) -> f64 {
    let (mut heading, mut cosine, mut sine) = (0.0_f64, 0.0, 0.0);
    for gained in gained {
        heading += gained;
        cosine += heading.cos();
        sine += heading.sin();
    }
    cosine.hypot(sine)
}

/// Variance of the angle of a turn about any axis, rad^2.
fn turn_variance(unit: &Acquired, turn: &Segment<f64>, settings: &MultiposeSettings) -> f64 {
    let (span, duration) = (interval(turn), turn.duration());
    let noise = unit.rate_noise();
    let by_stamps = unit.variance_by_stamps(turn);
    let of_axis = |i: usize| {
        noise[i].covariance(&span, &span, &unit.session()) * duration * duration
            + turn.interpolation.variance[i]
            + by_stamps
    };
    // Only its level part takes gravity from where the turn led it.
    let earth = level_earth_variance(settings);
    let rounding = unit.rounding.of_turn(turn, unit.rests.len()).max();
    (of_axis(0) + of_axis(1) + of_axis(2)) / 3.0 + rounding + earth * duration * duration
}

fn force_calibration(unit: &Acquired, fit: &AccelerometerFit) -> Result<TriadCalibration, MultiposeError> {
    let widened = cost_factor(fit);
    let mut covariance = ModelCovariance::zeros();
    for i in 0..UNKNOWNS {
        for j in 0..UNKNOWNS {
            covariance[(PLACES[i], PLACES[j])] = fit.covariance[(i, j)] * widened + fit.of_response[(i, j)];
        }
    }
    let parts = fit.model.decompose()?;
    let residuals = fit.residuals.iter().enumerate();
    Ok(TriadCalibration {
        inherited: None,
        inheritance: Inheritance::default(),
        drift: None,
        slip: None,
        asymmetry: None,
        model: fit.model,
        covariance,
        observed: [true; 12],
        parts,
        parts_covariance: parts.carry(&covariance),
        g_sensitivity: None,
        rank: UNKNOWNS,
        widened,
        by_direction: 0.0,
        variance_freedom: f64::INFINITY,
        chi_square: fit.chi_square(),
        degrees_of_freedom: fit.degrees_of_freedom(),
        residuals: residuals
            .map(|(k, r)| {
                (
                    fit.model.matrix * r.vector.normalize() * r.value,
                    force_sigma(unit, k),
                )
            })
            .collect(),
        labels: (0..fit.residuals.len()).map(ResidualLabel::Rest).collect(),
    })
}

fn faces_calibration(fit: &FacesFit) -> Result<TriadCalibration, MultiposeError> {
    let parts = fit.model.decompose()?;
    Ok(TriadCalibration {
        inherited: None,
        inheritance: Inheritance::default(),
        drift: None,
        slip: None,
        asymmetry: None,
        model: fit.model,
        covariance: fit.covariance,
        observed: [true; 12],
        parts,
        parts_covariance: parts.carry(&fit.covariance),
        g_sensitivity: None,
        rank: 12,
        widened: 1.0,
        by_direction: 0.0,
        // The tilt of the faces is known from their residuals, and no better.
        variance_freedom: f64::from(fit.degrees_of_freedom),
        chi_square: fit.chi_square,
        degrees_of_freedom: fit.degrees_of_freedom,
        residuals: fit.residuals.clone(),
        labels: (0..fit.residuals.len()).map(ResidualLabel::Rest).collect(),
    })
}

/// Covariance of `[M row by row, b]` from a clock that is fast or slow: all angles, and so all of M, err by the same share.
fn covariance_by_pace(matrix: &Matrix3<f64>, pace_sigma: f64) -> ModelCovariance<f64> {
    let by_pace = ModelCovariance::<f64>::from_fn(|i, j| {
        if i < 9 && j < 9 {
            matrix[(i / 3, i % 3)] * matrix[(j / 3, j % 3)]
        } else {
            0.0
        }
    });
    by_pace * pace_sigma.powi(2) // eq. 37
}

fn rate_calibration(
    data: &Rotations,
    fit: &RotationsFit,
    settings: &MultiposeSettings,
) -> Result<TriadCalibration, MultiposeError> {
    let widened = widening(fit.chi_square, fit.degrees_of_freedom);
    let model = fit.errors.model;
    let mut covariance = fit.covariance.fixed_view::<12, 12>(0, 0) * widened
        + covariance_by_pace(&model.matrix, settings.pace_sigma);
    if data.g_sensitivity && !settings.g_sensitivity {
        // Whoever corrects with M and b alone keeps the response to a specific force of any direction.
        let response = fit.errors.g_sensitivity * fit.errors.g_sensitivity.transpose();
        let mut of_bias = covariance.fixed_view_mut::<3, 3>(9, 9);
        of_bias += response * (STANDARD * STANDARD / 3.0); // eq. 19a
    }
    let parts = model.decompose()?;
    let g_sensitivity = settings.g_sensitivity.then(|| {
        let sigma = |i: usize| (fit.covariance[(12 + i, 12 + i)] * widened).sqrt();
        (
            fit.errors.g_sensitivity,
            Matrix3::from_fn(|i, j| sigma(3 * i + j)),
        )
    });
    let of_rests = data.rests.iter().map(|rest| {
        let modelled = fit.errors.modelled(&rest.earth_rate, &rest.force);
        (rest.rate - modelled, rest.rate_variance.map(f64::sqrt))
    });
    let of_turns = data.turns.iter().enumerate().map(|(k, turn)| {
        let up = data.rests[turn.after].up();
        let turned = up.cross(&fit.turned_less_found[k]) / turn.samples.duration();
        let sigma = fit.turn_variance[k].sqrt() / turn.samples.duration();
        (model.matrix * turned, Vector3::repeat(sigma))
    });
    let labels = (0..data.rests.len()).map(ResidualLabel::Rest);
    let of_turns_labels = data
        .turns
        .iter()
        .map(|turn| ResidualLabel::Turn(turn.before, turn.after));
    Ok(TriadCalibration {
        inherited: None,
        inheritance: Inheritance::default(),
        drift: None,
        slip: None,
        asymmetry: None,
        model,
        covariance,
        observed: [true; 12],
        parts,
        parts_covariance: parts.carry(&covariance),
        g_sensitivity,
        rank: 12,
        widened,
        by_direction: 0.0,
        variance_freedom: f64::INFINITY,
        chi_square: fit.chi_square,
        degrees_of_freedom: fit.degrees_of_freedom,
        residuals: of_rests.chain(of_turns).collect(),
        labels: labels.chain(of_turns_labels).collect(),
    })
}
