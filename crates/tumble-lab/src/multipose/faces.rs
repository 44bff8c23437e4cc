//! Six faces of a box on a table: the truth is known but for how the box was set down (docs/theory/multipose.md, section 7).

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use tumble_core::model::{ErrorModel, ModelCovariance};
use tumble_core::noise::{Interval, Noise};
use tumble_core::real::seconds;
use tumble_core::rotation::Procrustes;
use tumble_core::turntable::fit::{TriadFit, fit};
use tumble_core::turntable::observation::{FitInputs, Observation};

use super::error::MultiposeError;
use super::sections::{Section, SectionLabel};
use crate::acquisition::Acquired;

/// Largest angle between a face and its axis, rad, at which a rest is assigned to it.
const FACE_REACH: f64 = 0.35;

/// Angle that a turn about the vertical has at least, rad, to be taken for a full one.
const NEARLY_FULL: f64 = 1.5 * std::f64::consts::PI;

/// Largest bias of an accelerometer, m/s^2.
const LARGEST_BIAS: f64 = 20.0;

/// Tilts between which the one that explains the residuals is sought, rad.
const TILTS: (f64, f64) = (1e-6, 0.2);

const BISECTIONS: u32 = 40;

/// Bias and three elements of M for each axis.
const UNKNOWNS: u32 = 12;

/// A rest on a face.
#[derive(Clone, Copy, Debug)]
pub struct FaceRest {
    /// Which direction of the case was up, but for tilt.
    pub up: Vector3<f64>,
    /// Mean reading, m/s^2.
    pub mean: Vector3<f64>,
    /// Variance of the mean beyond that of noise, (m/s^2)^2.
    pub excess: Vector3<f64>,
    /// When, s.
    pub interval: Interval<f64>,
}

/// An accelerometer as six faces show it, in the case frame of the box.
#[derive(Clone, Debug)]
pub struct FacesFit {
    /// M and b.
    pub model: ErrorModel<f64>,
    /// Covariance of `[M row by row, b]`.
    pub covariance: ModelCovariance<f64>,
    /// By how much faces are off level about either axis, rad, as the residuals show it.
    pub tilt: f64,
    /// Sum of squared residuals over their expected size.
    pub chi_square: f64,
    /// Readings less unknowns.
    pub degrees_of_freedom: u32,
    /// Reading less model of each rest, and what noise and tilt make of it.
    pub residuals: Vec<(Vector3<f64>, Vector3<f64>)>,
}

/// Effect of a random tilt of the box on the truth and its covariance: twice along, once across.
struct Tilted<'a> {
    rests: &'a [FaceRest],
    noise: [Noise<f64>; 3],
    session: Interval<f64>,
    gravity: f64,
}

/// Fits all rests; how far the faces are off level follows from what is left.
///
/// # Errors
/// [`MultiposeError`] where a face is missing or nothing is finite.
pub fn fit_faces(
    rests: &[FaceRest],
    noise: &[Noise<f64>; 3],
    session: &Interval<f64>,
    gravity: f64,
) -> Result<FacesFit, MultiposeError> {
    refuse_missing(rests)?;
    let data = Tilted {
        rests,
        noise: *noise,
        session: *session,
        gravity,
    };
    let (mut low, mut high) = (libm::log(TILTS.0), libm::log(TILTS.1));
    let freedom = f64::from(data.degrees_of_freedom());
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if data.solve(libm::exp(middle))?.chi_square > freedom {
            low = middle;
        } else {
            high = middle;
        } // eq. 24
    }
    data.finish(libm::exp(high))
}

/// The same with the tilt known.
///
/// # Errors
/// Does the same as [`fit_faces`], but faces may be missing.
pub(super) fn fit_tilted(
    rests: &[FaceRest],
    noise: &[Noise<f64>; 3],
    session: &Interval<f64>,
    gravity: f64,
    tilt: f64,
) -> Result<FacesFit, MultiposeError> {
    let data = Tilted {
        rests,
        noise: *noise,
        session: *session,
        gravity,
    };
    data.finish(tilt)
}

fn refuse_missing(rests: &[FaceRest]) -> Result<(), MultiposeError> {
    let missing = SectionLabel::FACES.map(|face| !rests.iter().any(|rest| face.up() == Some(rest.up)));
    if missing.contains(&true) {
        return Err(MultiposeError::FacesMissing { missing });
    }
    Ok(())
}

impl Tilted<'_> {
    fn degrees_of_freedom(&self) -> u32 {
        u32::try_from(3 * self.rests.len()).map_or(0, |rows| rows.saturating_sub(UNKNOWNS))
    }

    fn observations(&self, tilt: f64) -> Vec<Observation<f64, 4, 3>> {
        let each = self.rests.iter().map(|rest| {
            let along = rest.up * rest.up.transpose();
            let across = Matrix3::identity() - along;
            let truth = rest.up * (self.gravity * (1.0 - tilt * tilt)); // eq. 22
            Observation {
                interval: rest.interval,
                regressor: SVector::<f64, 4>::new(truth.x, truth.y, truth.z, 1.0),
                reading: rest.mean,
                reading_variance: rest.excess,
                truth_covariance: (across + along * (tilt * tilt)) * (self.gravity * tilt).powi(2), // eq. 23
                sensitivity: SMatrix::zeros(),
            }
        });
        each.collect()
    }

    fn inputs(&self, observations: &[Observation<f64, 4, 3>]) -> Option<FitInputs<f64, 3>> {
        let mut pairs = Procrustes::new();
        for observation in observations {
            let truth = observation.regressor.fixed_rows::<3>(0).into_owned();
            pairs.push(&observation.reading, &truth, 1.0);
        }
        Some(FitInputs {
            noise: self.noise,
            session: self.session,
            nominal: pairs.solve()?.rotation.into_inner(),
            largest_bias: LARGEST_BIAS,
            // Rests share no error that anybody knows of; the prior must only not be singular.
            shared: Matrix3::identity() * 1e-18,
        })
    }

    fn solve(&self, tilt: f64) -> Result<TriadFit<f64, 3>, MultiposeError> {
        let observations = self.observations(tilt);
        let inputs = self.inputs(&observations).ok_or(MultiposeError::Unsolvable)?;
        let solved = fit::<f64, 4, 3, 15>(&observations, &inputs);
        solved.map_err(|_| MultiposeError::Unsolvable)
    }

    fn finish(&self, tilt: f64) -> Result<FacesFit, MultiposeError> {
        let solved = self.solve(tilt)?;
        let matrix = solved.model.matrix;
        let residuals = self.observations(tilt).into_iter().map(|observation| {
            let of_truth = (matrix * observation.truth_covariance * matrix.transpose()).diagonal();
            let own = Vector3::from_fn(|i, _| {
                self.noise[i].covariance(&observation.interval, &observation.interval, &self.session)
            });
            let variance = of_truth + own + observation.reading_variance;
            (solved.residual(&observation), variance.map(f64::sqrt))
        });
        Ok(FacesFit {
            residuals: residuals.collect(),
            model: solved.model,
            covariance: solved.covariance,
            tilt,
            chi_square: solved.chi_square,
            degrees_of_freedom: solved.degrees_of_freedom,
        })
    }
}

/// Which face each rest shows, and which turns between two rests on one face are full, where nobody labelled them.
pub(super) fn label_faces(found: &Acquired, index: impl Fn(f64) -> usize) -> Vec<Section> {
    let at = |microseconds: u64| index(found.origin + seconds::<f64>(microseconds));
    let faces: Vec<_> = found
        .rests
        .iter()
        .map(|rest| face(&rest.specific_force()))
        .collect();
    let rests = found.rests.iter().zip(&faces).filter_map(|(rest, label)| {
        Some(Section {
            label: (*label)?,
            first: at(rest.start),
            end: at(rest.end),
        })
    });
    let turns = found.turns.iter().enumerate().filter_map(|(k, turn)| {
        let up = faces[k]
            .filter(|_| turn.complete && faces[k] == faces[k + 1])?
            .up()?;
        let bias = (found.rests[k].angular_rate() + found.rests[k + 1].angular_rate()) * 0.5;
        let angle = (turn.angle() - bias * turn.duration()).dot(&up);
        (angle.abs() > NEARLY_FULL).then(|| Section {
            label: SectionLabel::TURNS[up.iamax()],
            first: at(found.rests[k].end),
            end: at(found.rests[k + 1].start),
        })
    });
    rests.chain(turns).collect()
}

fn face(force: &Vector3<f64>) -> Option<SectionLabel> {
    let near = |face: &SectionLabel| face.up().is_some_and(|up| up.angle(force) < FACE_REACH);
    SectionLabel::FACES.into_iter().find(near)
}
