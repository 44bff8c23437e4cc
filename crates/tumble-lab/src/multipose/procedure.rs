//! From the samples of one unit to the calibration of both its triads.

use nalgebra::{Matrix3, SMatrix, Vector3};
use rayon::prelude::*;
use tumble_core::gravity::{EARTH_RATE, vertical_earth_rate};
use tumble_core::model::{Covariance, ErrorModel};
use tumble_core::real::seconds;
use tumble_core::segmenter::Segment;
use tumble_core::turntable::reference::earth_variance;

use super::accelerometer::{ForcesFit, PLACES, RestForce, UNKNOWNS, fit_forces, sizes};
use super::error::MultiposeError;
use super::gyroscope::{Excess, RatesFit, RestDirection, Rotations, Turn, fit_rates};
use super::influence::{Influence, held_out, influence};
use super::next_orientation::{NextOrientation, next_orientation};
use super::nominal_scale::{NominalScale, counts, rounded, start};
use super::rest_selection::{TOLERANCES, acquire};
use super::rotation_response::TurnSamples;
use super::settings::MultiposeSettings;
use crate::acquisition::{Acquired, interval};
use crate::turntable::{Label, TriadCalibration, force_sigma, rate_sigma, widening};

/// The samples of one unit, all finite, in order of time.
#[derive(Clone, Copy, Debug)]
pub struct UnitSamples<'a> {
    /// s.
    pub time: &'a [f64],
    /// Specific force, m/s^2, or counts.
    pub force: &'a [[f64; 3]],
    /// Angular rate, rad/s, or counts; zero where there is no gyroscope.
    pub rate: &'a [[f64; 3]],
}

/// A rest and what the calibration makes of it.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// Corrected specific force, m/s^2.
    pub force: Vector3<f64>,
    /// `|y| - g` as read, m/s^2.
    pub before: f64,
    /// `|u| - g` corrected, m/s^2.
    pub after: f64,
    /// 1-sigma of the latter from noise, m/s^2.
    pub sigma: f64,
    /// Weight in the robust loss.
    pub weight: f64,
    /// Rests of one number show one direction.
    pub direction: usize,
    /// What the fit would be without it.
    pub influence: Influence,
    /// `|u| - g` by a fit without this direction, m/s^2.
    pub held_out: Option<f64>,
}

/// What the turns showed of the gyroscope.
#[derive(Clone, Debug)]
pub struct Gyroscope {
    /// Its calibration, in the case frame of the accelerometer.
    pub calibration: TriadCalibration,
    /// Rests before and after each turn that was used.
    pub turns: Vec<(usize, usize)>,
    /// Angle between gravity as turned and as found, rad, without calibration and with it.
    pub angles: Vec<(f64, f64)>,
    /// What turns and rests scatter besides noise.
    pub excess: Excess,
    /// Root mean square of the angles, rad, with g-sensitivity, where it was not fitted and the bias depends on attitude.
    pub with_g_sensitivity: Option<f64>,
}

/// Both triads of a unit, calibrated.
#[derive(Clone, Debug)]
pub struct Multipose {
    /// Rests and turns, of readings in SI units about their nominal zero.
    pub acquired: Acquired,
    /// Factor on the usual limits of stillness that was chosen.
    pub tolerance: f64,
    /// Scale of counts, where readings are that.
    pub nominal: Option<NominalScale>,
    /// Its case frame is that of its own axes.
    pub accelerometer: TriadCalibration,
    /// One for each rest.
    pub poses: Vec<Pose>,
    /// The orientation that is worth most.
    pub next: Option<NextOrientation>,
    /// Or why there is none.
    pub gyroscope: Result<Gyroscope, MultiposeError>,
}

/// A unit as it is worked on: SI units, zeros near zero.
struct Centred<'a> {
    time: &'a [f64],
    force: Vec<[f64; 3]>,
    rate: Vec<[f64; 3]>,
    force_zero: Vector3<f64>,
    rate_zero: Vector3<f64>,
    nominal: Option<NominalScale>,
}

/// Calibrates a unit.
///
/// # Errors
/// [`MultiposeError`] where there is no calibration of the accelerometer, without which there is none of the gyroscope.
pub fn multipose(
    samples: &UnitSamples<'_>,
    settings: &MultiposeSettings,
) -> Result<Multipose, MultiposeError> {
    let mut unit = Centred::of(samples, settings)?;
    let mut found = unit.calibrate(settings)?;
    if unit.nominal.is_some() && unit.take_rate_scale(&found) {
        found = unit.calibrate(settings)?;
    }
    found.nominal = unit.nominal;
    found.accelerometer.model.bias += unit.force_zero;
    if let Ok(gyroscope) = &mut found.gyroscope {
        gyroscope.calibration.model.bias += unit.rate_zero;
    }
    Ok(found)
}

impl<'a> Centred<'a> {
    fn of(samples: &UnitSamples<'a>, settings: &MultiposeSettings) -> Result<Self, MultiposeError> {
        let mut unit = Self {
            time: samples.time,
            force: samples.force.to_vec(),
            rate: samples.rate.to_vec(),
            force_zero: Vector3::zeros(),
            rate_zero: Vector3::zeros(),
            nominal: None,
        };
        if settings.raw {
            let judged = counts(samples.force, samples.rate, settings.gravity);
            let judged = judged.ok_or(MultiposeError::Unsolvable)?;
            centre(&mut unit.force, &judged.force_zero, judged.scale.force);
            centre(&mut unit.rate, &judged.rate_zero, judged.scale.rate);
            unit.force_zero = judged.force_zero * judged.scale.force;
            unit.rate_zero = judged.rate_zero * judged.scale.rate;
            unit.nominal = Some(judged.scale);
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
        centre(&mut self.rate, &Vector3::zeros(), factor);
        self.rate_zero *= factor;
        nominal.rate = scale;
        true
    }

    /// The calibration that is known best, of all that are with one tolerance or another: each by its largest sigma,
    /// widened by its normalised cost (docs/theory/multipose.md, eq. 21).
    fn calibrate(&self, settings: &MultiposeSettings) -> Result<Multipose, MultiposeError> {
        let tried: Vec<_> = TOLERANCES
            .par_iter()
            .map(|tolerance| {
                let unit = acquire(
                    self.time,
                    &self.force,
                    &self.rate,
                    settings.shortest_rest,
                    *tolerance,
                );
                let forces = Forces::of(&unit, settings.gravity);
                forces
                    .fit(settings.gravity)
                    .map(|fit| (*tolerance, unit, forces, fit))
            })
            .collect();
        let cost = |fit: &ForcesFit| {
            let sigmas = fit
                .covariance
                .diagonal()
                .map(f64::sqrt)
                .component_div(&sizes(settings.gravity));
            sigmas.max() * cost_factor(fit).sqrt() // eq. 21
        };
        let mut refusal = MultiposeError::NoRests;
        let mut solved = Vec::new();
        for each in tried {
            match each {
                Ok(each) => solved.push((cost(&each.3), each)),
                // The refusal of the tolerance with which most was found says most.
                Err(error) if says_more(&error, &refusal) => refusal = error,
                Err(_) => {}
            }
        }
        let best = solved.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let (_, (tolerance, unit, forces, fit)) = best.ok_or(refusal)?;
        self.describe(tolerance, unit, &forces, &fit, settings)
    }

    fn describe(
        &self,
        tolerance: f64,
        acquired: Acquired,
        forces: &Forces,
        fit: &ForcesFit,
        settings: &MultiposeSettings,
    ) -> Result<Multipose, MultiposeError> {
        let gyroscope = if settings.gyroscope {
            self.gyroscope(&acquired, fit, settings)
        } else {
            Err(MultiposeError::NoTurns)
        };
        Ok(Multipose {
            tolerance,
            nominal: None,
            accelerometer: force_calibration(&acquired, fit)?,
            poses: forces.poses(fit, settings.gravity),
            next: next_orientation(fit, &forces.rests, settings.gravity),
            gyroscope,
            acquired,
        })
    }

    fn gyroscope(
        &self,
        unit: &Acquired,
        fit: &ForcesFit,
        settings: &MultiposeSettings,
    ) -> Result<Gyroscope, MultiposeError> {
        let data = Rotations {
            rests: rest_directions(unit, fit, settings),
            turns: self.turns(unit, fit, settings),
            accelerometer_covariance: fit.covariance * cost_factor(fit),
            g_sensitivity: settings.g_sensitivity,
            latitude: settings.latitude,
        };
        let rates = fit_rates(&data)?;
        let turns = data.turns.iter().map(|turn| (turn.before, turn.after)).collect();
        Ok(Gyroscope {
            angles: rates.angle_before.iter().copied().zip(rates.angles()).collect(),
            with_g_sensitivity: with_g_sensitivity(&data, &rates),
            calibration: rate_calibration(&data, &rates)?,
            excess: rates.excess,
            turns,
        })
    }

    /// The turns that were recorded whole.
    fn turns(&self, unit: &Acquired, fit: &ForcesFit, settings: &MultiposeSettings) -> Vec<Turn> {
        let whole = unit.turns.iter().enumerate().filter(|(_, turn)| turn.complete);
        let Ok(correction) = fit.model.correction() else {
            return Vec::new();
        };
        let turns = whole.filter_map(|(before, turn)| {
            let from = self.index(unit.origin + seconds::<f64>(unit.rests[before].end));
            let to = self.index(unit.origin + seconds::<f64>(unit.rests[before + 1].start));
            let force = self.force.get(from..=to)?;
            let samples = TurnSamples {
                time: self.time[from..=to].to_vec(),
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
        // Segments know their times to the microsecond.
        self.time
            .partition_point(|t| *t < time - 1e-6)
            .min(self.time.len() - 1)
    }
}

/// What fitting g-sensitivity would gain, where the bias differs from rest to rest and nobody asked for it.
fn with_g_sensitivity(data: &Rotations, found: &RatesFit) -> Option<f64> {
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
    let angles: Vec<f64> = with.angles().collect();
    #[allow(clippy::cast_precision_loss)]
    let count = angles.len() as f64;
    Some((angles.iter().map(|angle| angle * angle).sum::<f64>() / count).sqrt())
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
        _ => usize::MAX,
    };
    rank(error) > rank(before)
}

/// What the variances of a fit are to be multiplied by, where noise does not explain its residuals.
fn cost_factor(fit: &ForcesFit) -> f64 {
    widening(fit.chi_square(), fit.degrees_of_freedom())
}

/// The rests of a unit.
struct Forces {
    rests: Vec<RestForce>,
    start: ErrorModel<f64>,
}

impl Forces {
    fn of(unit: &Acquired, gravity: f64) -> Self {
        let rests: Vec<_> = (0..unit.rests.len())
            .map(|k| RestForce {
                mean: unit.rests[k].specific_force(),
                variance: force_sigma(unit, k).map(|sigma| sigma * sigma),
            })
            .collect();
        let means: Vec<_> = rests.iter().map(|rest| rest.mean).collect();
        Self {
            start: start(&means, gravity),
            rests,
        }
    }

    fn fit(&self, gravity: f64) -> Result<ForcesFit, MultiposeError> {
        fit_forces(&self.rests, gravity, &self.start)
    }

    fn poses(&self, fit: &ForcesFit, gravity: f64) -> Vec<Pose> {
        let unseen = held_out(&self.rests, &fit.groups, gravity, &fit.model);
        let influences = influence(fit);
        (0..self.rests.len())
            .map(|k| Pose {
                force: fit.residuals[k].force,
                before: self.rests[k].mean.norm() - gravity,
                after: fit.residuals[k].value,
                sigma: fit.residuals[k].sigma,
                weight: fit.weights[k],
                direction: fit.groups[k],
                influence: influences[k],
                held_out: unseen[k],
            })
            .collect()
    }
}

fn rest_directions(unit: &Acquired, fit: &ForcesFit, settings: &MultiposeSettings) -> Vec<RestDirection> {
    let Ok(correction) = fit.model.correction() else {
        return Vec::new();
    };
    let each = fit.residuals.iter().enumerate().map(|(k, found)| {
        let up = found.force.normalize();
        let across = (Matrix3::identity() - up * up.transpose()) / found.force.norm();
        let by_reading = across * correction.matrix;
        let noise = Matrix3::from_diagonal(&force_sigma(unit, k).map(|sigma| sigma * sigma));
        RestDirection {
            force: found.force,
            covariance: by_reading * noise * by_reading.transpose(),
            by_accelerometer: SMatrix::from_fn(|i, unknown| match PLACES[unknown] {
                place @ 0..9 => -by_reading[(i, place / 3)] * found.force[place % 3],
                place => -by_reading[(i, place - 9)],
            }),
            rate: unit.rests[k].angular_rate(),
            rate_variance: rate_sigma(unit, k).map(|sigma| sigma * sigma),
            earth_rate: up * settings.latitude.map_or(0.0, vertical_earth_rate),
        }
    });
    each.collect()
}

/// Variance of the angle of a turn about any axis, rad^2.
fn turn_variance(unit: &Acquired, turn: &Segment<f64>, settings: &MultiposeSettings) -> f64 {
    let (span, duration) = (interval(turn), turn.duration());
    let noise = unit.rate_noise();
    let of_axis = |i: usize| {
        noise[i].covariance(&span, &span, &unit.session()) * duration * duration
            + turn.interpolation.variance[i]
    };
    // Only its level part takes gravity from where the turn led it.
    let earth = settings.latitude.map_or(earth_variance(), |latitude| {
        0.5 * (EARTH_RATE * latitude.cos()).powi(2)
    });
    (of_axis(0) + of_axis(1) + of_axis(2)) / 3.0 + earth * duration * duration
}

fn force_calibration(unit: &Acquired, fit: &ForcesFit) -> Result<TriadCalibration, MultiposeError> {
    let widened = cost_factor(fit);
    let mut covariance = Covariance::zeros();
    for i in 0..UNKNOWNS {
        for j in 0..UNKNOWNS {
            covariance[(PLACES[i], PLACES[j])] = fit.covariance[(i, j)] * widened;
        }
    }
    let parts = fit.model.decompose()?;
    let residuals = fit.residuals.iter().enumerate();
    Ok(TriadCalibration {
        model: fit.model,
        covariance,
        observed: [true; 12],
        parts,
        parts_covariance: parts.carry(&covariance),
        g_sensitivity: None,
        rank: UNKNOWNS,
        widened,
        variance_freedom: f64::INFINITY,
        chi_square: fit.chi_square(),
        degrees_of_freedom: fit.degrees_of_freedom(),
        residuals: residuals
            .map(|(k, r)| {
                (
                    fit.model.matrix * r.force.normalize() * r.value,
                    force_sigma(unit, k),
                )
            })
            .collect(),
        labels: (0..fit.residuals.len()).map(Label::Rest).collect(),
    })
}

fn rate_calibration(data: &Rotations, fit: &RatesFit) -> Result<TriadCalibration, MultiposeError> {
    let widened = widening(fit.chi_square, fit.degrees_of_freedom);
    let covariance = fit.covariance.fixed_view::<12, 12>(0, 0) * widened;
    let model = fit.errors.model;
    let parts = model.decompose()?;
    let g_sensitivity = data.g_sensitivity.then(|| {
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
    let labels = (0..data.rests.len()).map(Label::Rest);
    let of_turns_labels = data.turns.iter().map(|turn| Label::Turn(turn.before, turn.after));
    Ok(TriadCalibration {
        model,
        covariance,
        observed: [true; 12],
        parts,
        parts_covariance: parts.carry(&covariance),
        g_sensitivity,
        rank: 12,
        widened,
        variance_freedom: f64::INFINITY,
        chi_square: fit.chi_square,
        degrees_of_freedom: fit.degrees_of_freedom,
        residuals: of_rests.chain(of_turns).collect(),
        labels: labels.chain(of_turns_labels).collect(),
    })
}
