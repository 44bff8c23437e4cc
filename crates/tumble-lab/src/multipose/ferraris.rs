//! Six faces and three full turns by the formulas of Ferraris, Grimaldi and Parvis (1995), as imucal has them
//! (docs/theory/multipose.md, eq. 27 to 31): without weights, tilt or uncertainty, to hold results against.

use nalgebra::{Matrix3, Vector3};
use tumble_core::model::ErrorModel;

use super::samples::MultiposeSamples;
use super::sections::{Section, SectionLabel};
use crate::turntable::TriadCalibration;

/// Angle of a full turn as it is agreed on, rad: clockwise, seen from above.
const FULL_TURN: f64 = -std::f64::consts::TAU;

/// Scale, rotation and offset of one triad: `y = K R u + b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FerrarisTriad {
    /// K, the diagonal of the scale.
    pub scale: Vector3<f64>,
    /// R, whose rows are the sensing axes.
    pub rotation: Matrix3<f64>,
    /// b.
    pub bias: Vector3<f64>,
}

/// Results of the classical formulas for a session, in the units of its readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ferraris {
    /// Result of the six faces.
    pub accelerometer: FerrarisTriad,
    /// Result of the full turns; `None` where one of the three is missing.
    pub gyroscope: Option<FerrarisTriad>,
    /// Response of the gyroscope to specific force.
    pub g_sensitivity: Matrix3<f64>,
}

type Mean = (Vector3<f64>, Vector3<f64>);

/// Applies the formulas; `None` where a face is missing.
pub(super) fn ferraris(
    samples: &MultiposeSamples<'_>,
    sections: &[Section],
    gravity: f64,
) -> Option<Ferraris> {
    let labelled = |label: SectionLabel| sections.iter().filter(move |section| section.label == label);
    let faces: Option<Vec<Mean>> = SectionLabel::FACES
        .iter()
        .map(|label| mean(samples, labelled(*label)))
        .collect();
    let faces = faces?;
    let halved = |of: fn(&Mean) -> Vector3<f64>| {
        let apart = |axis: usize| (of(&faces[2 * axis]) - of(&faces[2 * axis + 1])) / (2.0 * gravity);
        Matrix3::from_columns(&[apart(0), apart(1), apart(2)])
    };
    let bias = Vector3::from_fn(|axis, _| 0.5 * (faces[2 * axis].0[axis] + faces[2 * axis + 1].0[axis])); // eq. 27
    let accelerometer = FerrarisTriad::of(&halved(|mean| mean.0), bias); // eq. 28
    let g_sensitivity = halved(|mean| mean.1); // eq. 29
    let at_rest = sections.iter().filter(|section| section.label.up().is_some());
    let rate_bias = mean(samples, at_rest)?.1; // eq. 30
    let correction = accelerometer.model().correction().ok()?;
    let turned = |label: &SectionLabel| {
        let turns: Vec<_> = labelled(*label)
            .map(|section| {
                let true_rate = |k: usize| {
                    let force = correction.apply(&Vector3::from(samples.force[k]));
                    Vector3::from(samples.rate[k]) - g_sensitivity * force - rate_bias
                };
                let sum: Vector3<f64> = (section.first..section.end).map(true_rate).sum();
                sum * interval(samples, section) / FULL_TURN // eq. 31
            })
            .collect();
        #[allow(clippy::cast_precision_loss)]
        let count = turns.len() as f64;
        (!turns.is_empty()).then(|| turns.iter().sum::<Vector3<f64>>() / count)
    };
    let columns: Option<Vec<_>> = SectionLabel::TURNS.iter().map(turned).collect();
    Some(Ferraris {
        accelerometer,
        gyroscope: columns.map(|columns| FerrarisTriad::of(&Matrix3::from_columns(&columns), rate_bias)),
        g_sensitivity,
    })
}

impl FerrarisTriad {
    /// Takes the response apart: K holds the lengths of its rows.
    fn of(response: &Matrix3<f64>, bias: Vector3<f64>) -> Self {
        let scale = Vector3::from_fn(|i, _| response.row(i).norm());
        Self {
            scale,
            rotation: Matrix3::from_fn(|i, j| response[(i, j)] / scale[i]),
            bias,
        }
    }

    fn model(&self) -> ErrorModel<f64> {
        ErrorModel {
            matrix: Matrix3::from_diagonal(&self.scale) * self.rotation,
            bias: self.bias,
        }
    }

    /// Bias, scale, non-orthogonality and mounting, of readings in units of `nominal`, and how many of its sigmas they are
    /// from another calibration of the same. A turn the other way changes the sign of its column.
    pub fn parameters(&self, nominal: f64, own: &TriadCalibration) -> Option<Vec<(f64, f64)>> {
        let mut model = self.model();
        model.bias *= nominal;
        let matrix = model.matrix * nominal;
        model.matrix = Matrix3::from_fn(|i, j| matrix[(i, j)] * matrix[(j, j)].signum());
        let of = |model: &ErrorModel<f64>| {
            let found = model.decompose().ok()?.parameters(&model.bias);
            let groups = [found.bias, found.scale, found.non_orthogonality, found.mounting];
            Some(
                groups
                    .into_iter()
                    .flat_map(|v| [v.x, v.y, v.z])
                    .collect::<Vec<_>>(),
            )
        };
        let sigmas = own.parts_covariance.diagonal().map(f64::sqrt);
        let both = of(&model)?.into_iter().zip(of(&own.model)?).zip(&sigmas);
        Some(
            both.map(|((value, own), sigma)| (value, (value - own) / sigma))
                .collect(),
        )
    }
}

/// Mean specific force and angular rate over all samples of some sections; `None` where there is none.
fn mean<'a>(samples: &MultiposeSamples<'_>, sections: impl Iterator<Item = &'a Section>) -> Option<Mean> {
    let (mut force, mut rate, mut count) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for section in sections {
        for k in section.first..section.end {
            force += Vector3::from(samples.force[k]);
            rate += Vector3::from(samples.rate[k]);
            count += 1.0;
        }
    }
    (count > 0.0).then(|| (force / count, rate / count))
}

/// Time between the samples of a section, s.
fn interval(samples: &MultiposeSamples<'_>, section: &Section) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let steps = (section.end - section.first).max(2) as f64 - 1.0;
    (samples.time[section.end - 1] - samples.time[section.first]) / steps
}
