//! A monitor of any number of units in either precision, behind one face.

use nalgebra::{Matrix3, Vector3};
use tumble_core::model::ErrorModel;
use tumble_core::real::{Real, real};
use tumble_core::redundancy::monitor::event::What;
use tumble_core::redundancy::monitor::{Command, Monitor};
use tumble_core::redundancy::platform::{Platform, PlatformError, PrimaryCalibration, Range, Unit};
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::settings::Settings;
use tumble_core::sample::Sample;

use crate::redundancy::names::wide;
use crate::redundancy::told::{Told, told};

/// Most units a set can have.
pub const MOST_UNITS: usize = 8;

/// What the primary's own calibration says of one sensor, `y = M u + b`.
pub type Model = (Matrix3<f64>, Vector3<f64>);

/// What happens to whom it is told.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heard {
    /// In order of time.
    pub events: Vec<Told>,
    /// Records adopted, in order.
    pub adopted: Vec<(usize, u64, Record<f64>)>,
}

/// Output of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Said {
    /// Microseconds of the common clock.
    pub time: u64,
    /// The unit it comes from.
    pub source: usize,
    /// m/s^2.
    pub specific_force: [f64; 3],
    /// rad/s.
    pub angular_rate: [f64; 3],
}

/// Means of a unit over a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// As read, in the primary's case frame: specific force, m/s^2, then angular rate, rad/s.
    pub read: [f64; 6],
    /// Compensated, at the primary's place.
    pub compensated: [f64; 6],
}

/// A monitor with its platform.
pub trait Set: Send + Sync {
    /// Takes in a sample.
    fn push(&mut self, unit: usize, sample: &Sample<f64>, heard: &mut Heard) -> Option<Said>;
    /// Takes a stored record.
    fn restore(&mut self, record: &Record<f64>, heard: &mut Heard);
    /// Asks for something.
    fn command(&mut self, command: Command);
    /// Number of the window looked at last.
    fn window(&self) -> Option<u64>;
    /// What a unit said over that window.
    fn seen(&self, unit: usize) -> Option<Seen>;
    /// Memory of the monitor, bytes.
    fn state_bytes(&self) -> usize;
}

struct Watched<T: Real, const UNITS: usize> {
    platform: Platform<T, UNITS>,
    monitor: Box<Monitor<T, UNITS, UNITS>>,
}

/// Builds a set of as many units as are given, primary first; `None` for a number of units there is no set of.
///
/// # Errors
/// [`PlatformError`] where units or settings cannot be.
pub fn build<T: Real>(
    units: &[Unit<f64>],
    calibration: &[Model; 2],
    settings: Settings<T>,
) -> Option<Result<Box<dyn Set>, PlatformError>> {
    Some(match units.len() {
        2 => watched::<T, 2>(units, calibration, settings),
        3 => watched::<T, 3>(units, calibration, settings),
        4 => watched::<T, 4>(units, calibration, settings),
        5 => watched::<T, 5>(units, calibration, settings),
        6 => watched::<T, 6>(units, calibration, settings),
        7 => watched::<T, 7>(units, calibration, settings),
        8 => watched::<T, 8>(units, calibration, settings),
        _ => return None,
    })
}

fn watched<T: Real, const UNITS: usize>(
    units: &[Unit<f64>],
    [accelerometer, gyroscope]: &[Model; 2],
    settings: Settings<T>,
) -> Result<Box<dyn Set>, PlatformError> {
    let model = |(matrix, bias): &Model| ErrorModel {
        matrix: narrow_matrix(matrix),
        bias: narrow(bias),
    };
    let calibration = PrimaryCalibration::new(model(accelerometer), model(gyroscope));
    let units = core::array::from_fn(|i| narrow_unit(&units[i]));
    Ok(Box::new(Watched::<T, UNITS> {
        platform: Platform::new(settings, calibration.ok_or(PlatformError::Primary)?, units)?,
        monitor: Box::new(Monitor::new()),
    }))
}

impl<T: Real, const UNITS: usize> Set for Watched<T, UNITS> {
    fn push(&mut self, unit: usize, sample: &Sample<f64>, heard: &mut Heard) -> Option<Said> {
        let sample = Sample {
            time: sample.time,
            specific_force: narrow(&sample.specific_force),
            angular_rate: narrow(&sample.angular_rate),
        };
        let output = self.monitor.push(&self.platform, unit, &sample, &mut |event| {
            heard.events.push(told(&event));
            if let What::Adopted { record } = &event.what {
                heard
                    .adopted
                    .push((event.unit, event.time, record.in_numbers(wide)));
            }
        })?;
        Some(Said {
            time: output.time,
            source: output.source,
            specific_force: output.specific_force.map(wide).into(),
            angular_rate: output.angular_rate.map(wide).into(),
        })
    }

    fn restore(&mut self, record: &Record<f64>, heard: &mut Heard) {
        let record = record.in_numbers(real);
        self.monitor.restore(&self.platform, &record, &mut |event| {
            heard.events.push(told(&event))
        });
    }

    fn command(&mut self, command: Command) {
        self.monitor.command(command);
    }

    fn window(&self) -> Option<u64> {
        self.monitor.window()
    }

    fn seen(&self, number: usize) -> Option<Seen> {
        let turn = self.platform.units().get(number)?.sensor_from_primary.transpose();
        let [fx, fy, fz, wx, wy, wz] = *self.monitor.means(number)?;
        let window = self.monitor.window()?;
        let said = self.monitor.at_primary(&self.platform, number, window);
        Some(Seen {
            read: six(
                &(turn * Vector3::new(fx, fy, fz)),
                &(turn * Vector3::new(wx, wy, wz)),
            ),
            compensated: said.map_or([f64::NAN; 6], |said| {
                six(&said.specific_force, &said.angular_rate)
            }),
        })
    }

    fn state_bytes(&self) -> usize {
        size_of::<Monitor<T, UNITS, UNITS>>()
    }
}

fn six<T: Real>(f: &Vector3<T>, w: &Vector3<T>) -> [f64; 6] {
    [f.x, f.y, f.z, w.x, w.y, w.z].map(wide)
}

fn narrow<T: Real>(v: &Vector3<f64>) -> Vector3<T> {
    v.map(real)
}

fn narrow_matrix<T: Real>(m: &Matrix3<f64>) -> Matrix3<T> {
    m.map(real)
}

fn narrow_unit<T: Real>(unit: &Unit<f64>) -> Unit<T> {
    Unit {
        identity: unit.identity,
        axes: unit.axes,
        range: Range {
            specific_force: unit.range.specific_force.map(real),
            angular_rate: unit.range.angular_rate.map(real),
        },
        time_offset: unit.time_offset,
        sensor_from_primary: narrow_matrix(&unit.sensor_from_primary),
        lever_arm: unit.lever_arm.as_ref().map(narrow),
    }
}
