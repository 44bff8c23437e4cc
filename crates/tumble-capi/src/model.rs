//! Samples, the error model, and what a turntable calibration is for: readings corrected.

use nalgebra::{Matrix3, Vector3};
use tumble_core::model::{
    Correction as OneCorrection, Decomposition as Parts, ErrorModel as Model, ModelError,
};
use tumble_core::sample::Sample as CoreSample;

use crate::pointer::{Place, look, read};
use crate::status::{Status, StatusResult, status};

/// Readings of a unit at one instant, in its case frame, or the truth behind them.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Sample {
    /// Microseconds of the unit's own clock, which does not have to begin at zero but must not fold over.
    pub time: u64,
    /// m/s^2; at rest and upright it reads +g up.
    pub specific_force: [f32; 3],
    /// rad/s; positive counter-clockwise, seen from the tip of the axis.
    pub angular_rate: [f32; 3],
}

/// Error model of one triad, `y = M u + b`: `y` is the reading of the sensor where the truth is `u`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct ErrorModel {
    /// M, row by row: scale, non-orthogonality and mounting together, from the case frame to the sensing axes; no unit.
    pub matrix: [[f32; 3]; 3],
    /// b, m/s^2 or rad/s.
    pub bias: [f32; 3],
}

/// Calibration of one unit.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Calibration {
    /// Errors of the accelerometer; bias in m/s^2.
    pub accelerometer: ErrorModel,
    /// Errors of the gyroscope; bias in rad/s.
    pub gyroscope: ErrorModel,
}

/// Correction that inverts an error model, `u = C (y - b)` with `C = M^-1`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct TriadCorrection {
    /// C, row by row: from the sensing axes to the case frame.
    pub matrix: [[f32; 3]; 3],
    /// b, m/s^2 or rad/s.
    pub bias: [f32; 3],
}

/// Correction of the errors of one unit. It is plain data: it may be copied, and lie in read-only memory.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Correction {
    /// Correction of the accelerometer; bias in m/s^2.
    pub accelerometer: TriadCorrection,
    /// Correction of the gyroscope; bias in rad/s.
    pub gyroscope: TriadCorrection,
}

/// An error model taken apart, `M = K L Q`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Decomposition {
    /// Diagonal of K: scale factor of each axis.
    pub scale: [f32; 3],
    /// L, row by row: lower triangular, rows of length one.
    pub triangle: [[f32; 3]; 3],
    /// Q, row by row: rotation from the case frame to the sensing axes.
    pub rotation: [[f32; 3]; 3],
    /// By how much the angles between axes xy, yz, zx fall short of 90 degrees, rad.
    pub non_orthogonality: [f32; 3],
    /// Rotation vector of Q, rad.
    pub mounting: [f32; 3],
}

/// Computes what undoes a calibration.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SINGULAR.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_correction_init(
    correction: *mut Correction,
    calibration: *const Calibration,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (place, calibration) = unsafe { (Place::at(correction), look(calibration)) };
    status((|| {
        let (place, calibration) = (place?, calibration?);
        place.write(Correction::of(calibration)?);
        Ok(())
    })())
}

/// Corrects both triads of a sample. `reading` and `truth` may be the same sample.
///
/// Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NOT_FINITE if the reading or the correction is not.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_correction_apply(
    correction: *const Correction,
    reading: *const Sample,
    truth: *mut Sample,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (correction, reading, place) = unsafe { (look(correction), read(reading), Place::at(truth)) };
    status((|| {
        let (correction, reading, place) = (correction?, reading?, place?);
        let truth = CoreSample {
            time: reading.time,
            specific_force: correction
                .accelerometer
                .of_core()
                .apply(&vector(&reading.specific_force)),
            angular_rate: correction
                .gyroscope
                .of_core()
                .apply(&vector(&reading.angular_rate)),
        };
        // A reading that is not finite leaves no component of its triad finite.
        if !truth.is_finite() {
            return Err(Status::TumbleErrorNotFinite);
        }
        place.write(Sample::of(&truth));
        Ok(())
    })())
}

/// Computes the reading of the sensor where the truth is `truth`: `reading = M truth + b`.
///
/// Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NOT_FINITE.
///
/// cbindgen:ptrs-as-arrays=[[truth; 3], [reading; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_error_model_measure(
    model: *const ErrorModel,
    truth: *const f32,
    reading: *mut f32,
) -> Status {
    let (truth, reading) = (truth.cast::<[f32; 3]>(), reading.cast::<[f32; 3]>());
    // SAFETY: the header requires it of all pointers.
    let (model, truth, place) = unsafe { (look(model), read(truth), Place::at(reading)) };
    status((|| {
        let (model, truth, place) = (model?.in_core()?, truth?, place?);
        let reading = model.measure(&vector(&truth));
        if !reading.iter().all(|y| y.is_finite()) {
            return Err(Status::TumbleErrorNotFinite);
        }
        place.write(reading.into());
        Ok(())
    })())
}

/// Takes an error model apart into scale, non-orthogonality and mounting.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SINGULAR, ::TUMBLE_ERROR_LEFT_HANDED.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_error_model_decompose(
    model: *const ErrorModel,
    decomposition: *mut Decomposition,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (model, place) = unsafe { (look(model), Place::at(decomposition)) };
    status((|| {
        let (model, place) = (model?.in_core()?, place?);
        let parts = model.decompose().map_err(|error| match error {
            ModelError::Singular => Status::TumbleErrorSingular,
            ModelError::LeftHanded => Status::TumbleErrorLeftHanded,
        })?;
        place.write(Decomposition::of(&parts, &model));
        Ok(())
    })())
}

impl Decomposition {
    fn of(parts: &Parts<f32>, model: &Model<f32>) -> Self {
        let parameters = parts.parameters(&model.bias);
        Self {
            scale: parts.scale.into(),
            triangle: rows(&parts.non_orthogonality),
            rotation: rows(parts.mounting.matrix()),
            non_orthogonality: parameters.non_orthogonality.into(),
            mounting: parameters.mounting.into(),
        }
    }
}

impl Sample {
    /// Converts it to the core's type.
    pub fn in_core(&self) -> CoreSample<f32> {
        CoreSample {
            time: self.time,
            specific_force: vector(&self.specific_force),
            angular_rate: vector(&self.angular_rate),
        }
    }

    fn of(sample: &CoreSample<f32>) -> Self {
        Self {
            time: sample.time,
            specific_force: sample.specific_force.into(),
            angular_rate: sample.angular_rate.into(),
        }
    }
}

impl ErrorModel {
    /// Converts it to the core's type, if all of it are numbers.
    pub fn in_core(&self) -> StatusResult<Model<f32>> {
        let mut numbers = self.matrix.as_flattened().iter().chain(&self.bias);
        if !numbers.all(|x| x.is_finite()) {
            return Err(Status::TumbleErrorNotFinite);
        }
        Ok(Model {
            matrix: matrix(&self.matrix),
            bias: vector(&self.bias),
        })
    }
}

impl Correction {
    /// Computes the correction of a calibration, if its error model can be inverted.
    pub fn of(calibration: &Calibration) -> StatusResult<Self> {
        Ok(Self {
            accelerometer: inverse(&calibration.accelerometer)?,
            gyroscope: inverse(&calibration.gyroscope)?,
        })
    }
}

impl TriadCorrection {
    fn of_core(&self) -> OneCorrection<f32> {
        OneCorrection {
            matrix: matrix(&self.matrix),
            bias: vector(&self.bias),
        }
    }
}

fn inverse(model: &ErrorModel) -> StatusResult<TriadCorrection> {
    let correction = model
        .in_core()?
        .correction()
        .map_err(|_| Status::TumbleErrorSingular)?;
    if !correction.matrix.iter().all(|x| x.is_finite()) {
        return Err(Status::TumbleErrorSingular);
    }
    Ok(TriadCorrection {
        matrix: rows(&correction.matrix),
        bias: model.bias,
    })
}

/// A vector of C.
pub fn vector(v: &[f32; 3]) -> Vector3<f32> {
    Vector3::from(*v)
}

/// A matrix of C, which has its rows in order.
pub fn matrix(rows: &[[f32; 3]; 3]) -> Matrix3<f32> {
    let [[a, b, c], [d, e, f], [g, h, i]] = *rows;
    Matrix3::new(a, b, c, d, e, f, g, h, i)
}

/// The rows of a matrix, for C.
pub fn rows(m: &Matrix3<f32>) -> [[f32; 3]; 3] {
    // Columns are how nalgebra keeps a matrix.
    m.transpose().into()
}

/// Numbers of the core that C has as an array, or as they are.
pub trait Mirrored {
    /// Type that C has.
    type InC;

    /// Converts the core's type.
    fn in_c(&self) -> Self::InC;

    /// Converts it to the core's type.
    fn of_c(of: &Self::InC) -> Self;
}

impl Mirrored for Matrix3<f32> {
    type InC = [[f32; 3]; 3];

    fn in_c(&self) -> [[f32; 3]; 3] {
        rows(self)
    }

    fn of_c(of: &[[f32; 3]; 3]) -> Self {
        matrix(of)
    }
}

impl Mirrored for Vector3<f32> {
    type InC = [f32; 3];

    fn in_c(&self) -> [f32; 3] {
        (*self).into()
    }

    fn of_c(of: &[f32; 3]) -> Self {
        vector(of)
    }
}

impl Mirrored for f32 {
    type InC = Self;

    fn in_c(&self) -> Self {
        *self
    }

    fn of_c(of: &Self) -> Self {
        *of
    }
}
