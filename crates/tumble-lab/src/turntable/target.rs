//! A target, calibrated against a fitted reference.

use super::error::TurntableError;
use super::pairing::{Pairing, pair, pair_rates};
use super::rate_response::AxisResponse;
use super::reference::{Reference, Ups};
use super::reference_uncertainty::{derivative, inherited, of_gravity, scaled, scaled_alike};
use super::session::TargetSession;
use super::settings::{Clocks, FEWEST_RESTS, GSensitivity, TurntableSettings};
use super::triad::TriadCalibration;
use crate::acquisition::{Acquired, without_turning};
use tumble_core::noise::Interval;

/// A target, calibrated.
#[derive(Clone, Debug)]
pub struct Target {
    /// Pairing with the reference.
    pub pairing: Pairing,
    /// Accelerometer, where the log has one.
    pub accelerometer: Option<TriadCalibration>,
    /// Gyroscope, where the logs of reference and target have one.
    pub gyroscope: Option<TriadCalibration>,
    /// Response of each axis of the gyroscope that turned at constant rates.
    pub responses: Vec<AxisResponse>,
}

/// Which triads there are to calibrate; what a log has not is zero in what was acquired from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triads {
    /// The target's log has specific force.
    pub accelerometer: bool,
    /// The logs of both have angular rate.
    pub gyroscope: bool,
}

/// Calibrates one target.
///
/// # Errors
/// Those of [`TurntableError`].
pub fn calibrate(
    reference_unit: &Acquired,
    reference: &Reference,
    unit: &Acquired,
    ups: &Ups,
    settings: &TurntableSettings,
    triads: Triads,
) -> Result<Target, TurntableError> {
    let rates = reference_unit.constant_rates().next().is_some() && triads.gyroscope;
    let rested = reference_unit.rests.len() >= FEWEST_RESTS;
    let pairing = if rates && !rested {
        pair_rates(reference_unit, unit, settings.clocks)?
    } else {
        pair(reference_unit, unit, settings.clocks)?
    };
    if (rested || !rates) && pairing.pairs.len() < FEWEST_RESTS {
        return Err(TurntableError::TooFewRests {
            found: pairing.pairs.len(),
            needed: FEWEST_RESTS,
        });
    }
    let session = TargetSession {
        reference_unit,
        reference,
        unit,
        pairing: &pairing,
        ups,
        settings,
    };
    let accelerometer = match (triads.accelerometer && rested).then(|| session.accelerometer()) {
        // Few faces on a rate table show the gyroscope all the same.
        Some(Err(TurntableError::DirectionsTooAlike)) if rates => None,
        found => found.transpose()?,
    };
    let fitted = triads
        .gyroscope
        .then(|| session.gyroscope(accelerometer.as_ref()))
        .transpose()
        .map_err(TurntableError::of_gyroscope)?;
    let (gyroscope, responses) = fitted.unzip();
    let mut target = Target {
        accelerometer,
        gyroscope,
        pairing: pairing.clone(),
        responses: responses.unwrap_or_default(),
    };
    inherit(&mut target, &session)?;
    Ok(target)
}

/// Adds what the uncertainty of the reference, of gravity and of the table leaves on M and b.
fn inherit(target: &mut Target, session: &TargetSession<'_>) -> Result<(), TurntableError> {
    let uncertainty = &session.reference.uncertainty;
    let (mut forces, mut rates) = (Vec::new(), Vec::new());
    let coupled = target
        .gyroscope
        .as_ref()
        .is_some_and(TriadCalibration::is_coupled);
    let settings = TurntableSettings {
        g_sensitivity: if coupled {
            GSensitivity::Always
        } else {
            GSensitivity::Never
        },
        ..*session.settings
    };
    for deviated in &session.reference.deviated {
        let session = TargetSession {
            reference_unit: &deviated.unit,
            reference: &deviated.reference,
            settings: &settings,
            ..*session
        };
        if uncertainty.accelerometer.is_some() && target.accelerometer.is_some() {
            forces.push(session.accelerometer()?.model);
        }
        if uncertainty.gyroscope.is_some() && target.gyroscope.is_some() {
            rates.push(session.gyroscope(target.accelerometer.as_ref())?.0.model);
        }
    }
    for (triad, responses, stated) in [
        (&mut target.accelerometer, forces, &uncertainty.accelerometer),
        (&mut target.gyroscope, rates, &uncertainty.gyroscope),
    ] {
        if let (Some(triad), Some(stated)) = (triad, stated)
            && !responses.is_empty()
        {
            triad.inherited = Some(inherited(&triad.model, &responses));
            triad.inheritance.by_reference = derivative(&triad.model, &responses, stated);
        }
    }
    if let Some(triad) = &mut target.accelerometer
        && let Some(by_gravity) = of_gravity(session, &triad.model)?
    {
        triad.add_inherited(by_gravity * by_gravity.transpose());
        triad.inheritance.by_gravity = by_gravity;
    }
    if let (Some(table), Some(triad)) = (&session.reference.table, &mut target.gyroscope) {
        triad.add_inherited(scaled_alike(&triad.model, table.accuracy.powi(2)));
        triad.inheritance.by_table = scaled(&triad.model, table.accuracy);
    }
    Ok(())
}

/// Data of a target, with rests and constant rates by the reference; `None` where its own are the same.
pub fn as_reference(reference_unit: &Acquired, unit: &Acquired, clocks: Clocks) -> Option<Acquired> {
    let pairing = pair_rates(reference_unit, unit, clocks).ok()?;
    let own = |time: f64| time + pairing.clock.offset_at(time).0;
    let turning: Vec<_> = reference_unit
        .constant_rates()
        .map(|plateau| Interval {
            start: own(plateau.interval.start),
            end: own(plateau.interval.end),
        })
        .collect();
    without_turning(unit, &turning)
}
