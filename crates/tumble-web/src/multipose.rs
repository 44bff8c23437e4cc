//! Calibration without equipment: samples of one unit in, both triads out.

use serde::Deserialize;
use serde_json::{Value, json};
use tumble_core::sample::CHANNELS;
use tumble_lab::acquisition::standstills;
use tumble_lab::multipose::accelerometer::PLACES;
use tumble_lab::multipose::stated_rate::StampedRate;
use tumble_lab::multipose::turn_bias::TurnLoss;
use tumble_lab::multipose::{
    FULL_TURN_SIGMA, Gyroscope, KnownNoise, Multipose, MultiposeError, MultiposeSamples, MultiposeSettings,
    SectionLabel, multipose,
};
use tumble_lab::turntable::{ResidualLabel, TriadCalibration};

use crate::acquired::{self, SHORTEST_REST};
use crate::figures::{Samples, matrix, square, vector, vectors};

/// A unit to be calibrated.
#[derive(Deserialize)]
pub struct MultiposeRequest {
    gravity: f64,
    gravity_sigma: f64,
    gyroscope: bool,
    raw: bool,
    faces: bool,
    pace_sigma: f64,
    stamp_sigma: f64,
}

/// Calibrates a unit: figures, or `refusal` with a word and its figures.
pub fn calibrate(request: &MultiposeRequest, numbers: &[f64]) -> Value {
    let samples = Samples::of(numbers, false);
    let still = standstills(samples.time, samples.triads(request.gyroscope));
    let samples = MultiposeSamples {
        time: &still.moving(samples.time),
        force: &still.moving(samples.force),
        rate: &still.moving(samples.rate),
    };
    let settings = MultiposeSettings {
        gravity: request.gravity,
        gravity_sigma: request.gravity_sigma,
        latitude: None,
        g_sensitivity: false,
        gyroscope: request.gyroscope,
        raw: request.raw,
        shortest_rest: SHORTEST_REST,
        noise: [KnownNoise::default(); CHANNELS],
        faces: request.faces,
        pace_sigma: request.pace_sigma,
        stamp_sigma: request.stamp_sigma,
        sections: Vec::new(),
    };
    match multipose(&samples, &settings) {
        Ok(found) => figures(&found),
        Err(error) => json!({ "refusal": refusal(&error) }),
    }
}

fn figures(found: &Multipose) -> Value {
    let pose =
        |value: fn(&tumble_lab::multipose::Pose) -> f64| found.poses.iter().map(value).collect::<Vec<f64>>();
    let directions: Vec<usize> = found.poses.iter().map(|pose| pose.direction).collect();
    json!({
        "tolerance": found.tolerance,
        "nominal_scale": found.nominal.map(|scale| (scale.force, scale.rate)),
        "accelerometer": triad(&found.accelerometer),
        "non_linearity": found.non_linearity.as_ref().map(|each| (
            each.square.map(|of| vector(&of)),
            each.magnitude.map(|of| vector(&of)),
        )),
        "poses": {
            "force": vectors(found.poses.iter().map(|pose| pose.force)),
            "before": pose(|pose| pose.before),
            "after": pose(|pose| pose.after),
            "sigma": pose(|pose| pose.sigma),
            "weight": pose(|pose| pose.weight),
            "leverage": pose(|pose| pose.influence.leverage),
            "held_out": pose(|pose| pose.held_out.unwrap_or(f64::NAN)),
            "direction": directions,
        },
        "next": found.next.as_ref().map(|next| json!({
            "up": vector(&next.up),
            "unknown": PLACES[next.unknown],
            "before": next.before,
            "after": next.after,
        })),
        "gyroscope": found.gyroscope.as_ref().ok().map(gyroscope),
        "gyroscope_refusal": found.gyroscope.as_ref().err().map(refusal),
        "full_turn_sigma": FULL_TURN_SIGMA,
        "left_out": found.left_out.iter()
            .map(|each| (each.span.0, each.span.1, each.tremor.map(|tremor| (tremor.amplitude, tremor.frequency))))
            .collect::<Vec<_>>(),
        "acquired": acquired::figures(&found.acquired),
    })
}

fn gyroscope(found: &Gyroscope) -> Value {
    let (before, after): (Vec<f64>, Vec<f64>) = found.angles.iter().copied().unzip();
    json!({
        "calibration": triad(&found.calibration),
        "turns": found.turns,
        "angles_before": before,
        "angles_after": after,
        "with_g_sensitivity": found.with_g_sensitivity,
        "implausible_scale": found.implausible_scale,
        "turn_excess": found.excess.turn.sqrt(),
        "bias_excess": found.excess.rest.sqrt(),
        "turn_bias": found.turn_bias.as_ref().map(|bias| json!({
            "difference": vector(&bias.difference),
            "sigma": vector(&bias.sigma),
            "contradicts": bias.contradicts(),
        })),
        "turn_loss": found
            .turn_loss
            .filter(TurnLoss::contradicts)
            .map(|loss| (loss.angle, loss.sigma)),
        "dead_band": found.dead_band.map(|band| (band.axis, band.half_width)),
        "turn_widening": found.turn_widening,
    })
}

/// Rate that stamps show beside one that was stated, Hz; null where they show none.
pub fn stamped_rate(stamps: &[f64], stated: f64) -> Value {
    json!(StampedRate::of(stamps, stated).map(|found| json!({
        "shown": found.shown,
        "missing": found.missing,
        "agrees": found.agrees(),
    })))
}

fn triad(found: &TriadCalibration) -> Value {
    json!({
        "M": square(&found.model.matrix),
        "b": vector(&found.model.bias),
        "covariance": matrix(&found.covariance),
        "observed": found.observed,
        "scale": vector(&found.parts.scale),
        "L": square(&found.parts.non_orthogonality),
        "Q": square(found.parts.mounting.matrix()),
        "values": found.values(),
        "sigmas": found.sigmas(),
        "rank": found.rank,
        "widened": found.widened,
        "variance_freedom": found.variance_freedom,
        "chi_square": found.chi_square,
        "degrees_of_freedom": found.degrees_of_freedom,
        "residuals": vectors(found.residuals.iter().map(|(residual, _)| *residual)),
        "residual_sigmas": vectors(found.residuals.iter().map(|(_, sigma)| *sigma)),
        "labels": found.labels.iter().map(ResidualLabel::named).collect::<Vec<_>>(),
    })
}

/// A word for the reason why there is no calibration, and its figures.
fn refusal(error: &MultiposeError) -> (&'static str, Value) {
    let figures = match *error {
        MultiposeError::TooFewDirections { found, needed, rests } => {
            json!({ "found": found, "needed": needed, "rests": rests })
        }
        MultiposeError::FacesMissing { missing } => {
            let faces = SectionLabel::FACES.iter().zip(missing);
            let named = faces.filter(|(_, missing)| *missing).map(|(face, _)| face.name());
            json!({ "missing": named.collect::<Vec<_>>() })
        }
        MultiposeError::PosesLeaveOpen { shares } | MultiposeError::TurnsLeaveOpen { shares } => {
            json!({ "shares": shares })
        }
        MultiposeError::GyroscopeContradicts { angle } => json!({ "angle": angle }),
        MultiposeError::NoRests
        | MultiposeError::NoTurns
        | MultiposeError::LeftHandedGyroscope
        | MultiposeError::AxesCoincide
        | MultiposeError::Unsolvable => json!({}),
    };
    (error.name(), figures)
}
