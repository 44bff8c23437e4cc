//! A sensor whose bias and scale change with temperature, from below its range to above it.

use core::fmt::Write;
use core::hint::black_box;

use nalgebra::Vector3;
use tumble_core::temperature::TemperatureDrift;

use crate::MissionError;
use crate::text::{Bits, vector};

/// Temperature drift of the sensor: numbers of which no product is round.
const DRIFT: TemperatureDrift<f32> = TemperatureDrift {
    reference: 25.0,
    range: [-20.0, 70.0],
    bias: [
        Vector3::new(1.1e-3, -0.7e-3, 2.3e-3),
        Vector3::new(-1.3e-5, 0.9e-5, 0.3e-5),
        Vector3::new(1.7e-7, 0.1e-7, -2.9e-7),
    ],
    scale: [
        Vector3::new(1.9e-5, -3.1e-5, 0.7e-5),
        Vector3::new(2.1e-7, 0.3e-7, -1.1e-7),
        Vector3::new(-1.3e-9, 2.7e-9, 0.9e-9),
    ],
};

/// Its bias at the reference.
const BIAS: Vector3<f32> = Vector3::new(0.013, -0.021, 0.034);

/// Readings at all temperatures, degC.
const READING: Vector3<f32> = Vector3::new(0.31, -4.7, 8.3);

/// Corrects the readings from one temperature after the other to the reference, and reports the results.
///
/// # Errors
/// [`MissionError`].
pub fn temperature(out: &mut dyn Write) -> Result<(), MissionError> {
    writeln!(out, "temperature")?;
    let (drift, bias, reading) = black_box((DRIFT, BIAS, READING));
    for degrees in (-60_i8..=95).step_by(5) {
        let degrees = f32::from(degrees);
        writeln!(out, "  at {} degC", Bits(degrees))?;
        let found = drift.at_reference(&reading, &bias, degrees);
        vector(out, "would read at the reference", &found)?;
    }
    Ok(())
}
