//! A monitor of any number of units in either precision, behind one face.

use nalgebra::{Matrix3, Vector3};
use tumble_core::model::ErrorModel;
use tumble_core::real::{Real, real};
use tumble_core::redundancy::aiding::Aiding;
use tumble_core::redundancy::monitor::event::{Event, EventKind};
use tumble_core::redundancy::monitor::{Command, Monitor};
use tumble_core::redundancy::platform::{MountedUnit, Platform, PlatformError, PrimaryCalibration, Range};
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::{Axes, Sensor};
use tumble_core::redundancy::settings::RedundancySettings;
use tumble_core::redundancy::unit_count::{UnitCount, Units};
use tumble_core::sample::Sample;

use crate::redundancy::event_text::{EventText, event_text};
use crate::setting::wide;

/// Most units a set can have.
pub const MOST_UNITS: usize = 8;

/// Calibration of one sensor of the primary, `y = M u + b`, and its residual, root mean square of a channel, m/s^2 or
/// rad/s.
pub type Model = (Matrix3<f64>, Vector3<f64>, f64);

/// Log that receives the events.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EventLog {
    /// In order of time.
    pub events: Vec<EventText>,
    /// Records adopted, in order.
    pub adopted: Vec<(usize, u64, Record<f64>)>,
}

impl EventLog {
    fn keep<T: Real>(&mut self, event: &Event<T>) {
        self.events.push(event_text(event));
        if let EventKind::Adopted { record } = &event.kind {
            self.adopted
                .push((event.unit, event.time, record.in_numbers(wide)));
        }
    }
}

/// Output of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputSample {
    /// Microseconds of the common clock.
    pub time: u64,
    /// The unit it comes from.
    pub source: usize,
    /// m/s^2.
    pub specific_force: [f64; 3],
    /// rad/s.
    pub angular_rate: [f64; 3],
    /// True if the source is known to be wrong.
    pub degraded: bool,
}

/// Means of a unit over a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowMeans {
    /// Raw readings, in the primary's case frame: specific force, m/s^2, then angular rate, rad/s.
    pub read: [f64; 6],
    /// Compensated, at the primary's place.
    pub compensated: [f64; 6],
}

/// A monitor with its platform.
pub trait DynMonitor: Send + Sync {
    /// Takes in a sample.
    fn push(&mut self, unit: usize, sample: &Sample<f64>, log: &mut EventLog) -> Option<OutputSample>;
    /// Takes in an aiding measurement at a time, microseconds of the common clock.
    fn aiding(&mut self, time: u64, aiding: &Aiding<f64>, log: &mut EventLog);
    /// Takes a stored record.
    fn restore(&mut self, record: &Record<f64>, log: &mut EventLog);
    /// Takes a record from the factory, from which thresholds may be counted.
    fn restore_factory(&mut self, record: &Record<f64>);
    /// Takes in how warm a unit is, degC, from its next sample on.
    fn set_temperature(&mut self, unit: usize, value: f64);
    /// Asks for something.
    fn command(&mut self, command: Command);
    /// Number of the window looked at last.
    fn window(&self) -> Option<u64>;
    /// Length of a window, microseconds.
    fn window_length(&self) -> u64;
    /// Means of a unit over that window.
    fn means(&self, unit: usize) -> Option<WindowMeans>;
    /// Memory of the monitor, bytes.
    fn state_bytes(&self) -> usize;
}

struct SizedMonitor<T: Real, const UNITS: usize>
where
    Units<UNITS>: UnitCount,
{
    platform: Platform<T, UNITS>,
    monitor: Box<Monitor<T, UNITS, UNITS, 1>>,
}

/// Builds a set of as many units as are given, primary first; `None` for a number of units there is no set of.
///
/// # Errors
/// [`PlatformError`] where units or settings cannot be.
pub fn build<T: Real>(
    units: &[MountedUnit<f64>],
    calibration: &[Model; 2],
    settings: RedundancySettings<T>,
) -> Option<Result<Box<dyn DynMonitor>, PlatformError>> {
    Some(match units.len() {
        2 => sized::<T, 2>(units, calibration, settings),
        3 => sized::<T, 3>(units, calibration, settings),
        4 => sized::<T, 4>(units, calibration, settings),
        5 => sized::<T, 5>(units, calibration, settings),
        6 => sized::<T, 6>(units, calibration, settings),
        7 => sized::<T, 7>(units, calibration, settings),
        8 => sized::<T, 8>(units, calibration, settings),
        _ => return None,
    })
}

fn sized<T: Real, const UNITS: usize>(
    units: &[MountedUnit<f64>],
    [accelerometer, gyroscope]: &[Model; 2],
    settings: RedundancySettings<T>,
) -> Result<Box<dyn DynMonitor>, PlatformError>
where
    Units<UNITS>: UnitCount,
{
    let model = |(matrix, bias, _): &Model| ErrorModel {
        matrix: narrow_matrix(matrix),
        bias: narrow(bias),
    };
    let residuals = [accelerometer, gyroscope].map(|(_, _, residual)| real(*residual));
    let calibration = PrimaryCalibration::new(model(accelerometer), model(gyroscope))
        .map(|calibration| calibration.with_residuals(residuals));
    let units = core::array::from_fn(|i| narrow_unit(&units[i]));
    Ok(Box::new(SizedMonitor::<T, UNITS> {
        platform: Platform::new(settings, calibration.ok_or(PlatformError::Primary)?, units)?,
        monitor: Box::new(Monitor::new()),
    }))
}

impl<T: Real, const UNITS: usize> DynMonitor for SizedMonitor<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    fn push(&mut self, unit: usize, sample: &Sample<f64>, log: &mut EventLog) -> Option<OutputSample> {
        let sample = Sample {
            time: sample.time,
            specific_force: narrow(&sample.specific_force),
            angular_rate: narrow(&sample.angular_rate),
        };
        let output = self
            .monitor
            .push(&self.platform, unit, &sample, &mut |event| log.keep(&event))?;
        Some(OutputSample {
            time: output.time,
            source: output.source,
            specific_force: output.specific_force.map(wide).into(),
            angular_rate: output.angular_rate.map(wide).into(),
            degraded: output.degraded,
        })
    }

    fn restore(&mut self, record: &Record<f64>, log: &mut EventLog) {
        let record = record.in_numbers(real);
        self.monitor
            .restore(&self.platform, &record, &mut |event| log.keep(&event));
    }

    fn restore_factory(&mut self, record: &Record<f64>) {
        self.monitor
            .restore_factory(&self.platform, &record.in_numbers(real));
    }

    fn set_temperature(&mut self, unit: usize, value: f64) {
        self.monitor.set_temperature(unit, real(value));
    }

    fn command(&mut self, command: Command) {
        self.monitor.command(command);
    }

    fn aiding(&mut self, time: u64, aiding: &Aiding<f64>, log: &mut EventLog) {
        let aiding = narrow_aiding(aiding);
        self.monitor.aiding(time, &aiding, &mut |event| log.keep(&event));
    }

    fn window(&self) -> Option<u64> {
        self.monitor.window()
    }

    fn window_length(&self) -> u64 {
        self.monitor.window_length(&self.platform)
    }

    fn means(&self, number: usize) -> Option<WindowMeans> {
        let unit = self.platform.units().get(number)?;
        let turn = unit.sensor_from_primary.transpose();
        let axes = self.platform.output_axes(unit);
        let [fx, fy, fz, wx, wy, wz] = *self.monitor.means(number)?;
        let window = self.monitor.window()?;
        let compensated = self.monitor.at_primary(&self.platform, number, window);
        Some(WindowMeans {
            read: six(
                &axes,
                &(turn * Vector3::new(fx, fy, fz)),
                &(turn * Vector3::new(wx, wy, wz)),
            ),
            compensated: compensated.map_or([f64::NAN; 6], |compensated| {
                six(&axes, &compensated.specific_force, &compensated.angular_rate)
            }),
        })
    }

    fn state_bytes(&self) -> usize {
        size_of::<Monitor<T, UNITS, UNITS, 1>>()
    }
}

/// Both triads, with not-a-number along axes that a unit does not measure.
fn six<T: Real>(axes: &Axes, f: &Vector3<T>, w: &Vector3<T>) -> [f64; 6] {
    let (f, w) = (
        axes.shown(Sensor::Accelerometer, f),
        axes.shown(Sensor::Gyroscope, w),
    );
    [f.x, f.y, f.z, w.x, w.y, w.z].map(wide)
}

fn narrow<T: Real>(v: &Vector3<f64>) -> Vector3<T> {
    v.map(real)
}

fn narrow_matrix<T: Real>(m: &Matrix3<f64>) -> Matrix3<T> {
    m.map(real)
}

fn narrow_aiding<T: Real>(aiding: &Aiding<f64>) -> Aiding<T> {
    match aiding {
        Aiding::Velocity { value, sigma } => Aiding::Velocity {
            value: narrow(value),
            sigma: narrow(sigma),
        },
        Aiding::BodyVelocity { value, sigma } => Aiding::BodyVelocity {
            value: narrow(value),
            sigma: narrow(sigma),
        },
        Aiding::Heading { value, sigma } => Aiding::Heading {
            value: real(*value),
            sigma: real(*sigma),
        },
        Aiding::Score { unit, value } => Aiding::Score {
            unit: *unit,
            value: real(*value),
        },
    }
}

fn narrow_unit<T: Real>(unit: &MountedUnit<f64>) -> MountedUnit<T> {
    MountedUnit {
        identity: unit.identity,
        axes: unit.axes,
        range: Range {
            specific_force: unit.range.specific_force.map(real),
            angular_rate: unit.range.angular_rate.map(real),
        },
        time_offset: unit.time_offset,
        sensor_from_primary: narrow_matrix(&unit.sensor_from_primary),
        lever_arm: unit.lever_arm.as_ref().map(narrow),
        thresholds: unit.thresholds.map(|own| own.map(|own| own.in_numbers(real))),
    }
}
