//! Text of events: one line for each, with all its figures.
//!
//! Indented lines belong to the line before; six spaces or more mark the finest details.
//!
//! A number of single precision is its bits, `#` and eight hexadecimal digits: so device and host are compared bit for
//! bit, and the report for people converts them into decimals.

use core::fmt::{Display, Formatter, Result, Write};

use nalgebra::Vector3;
use tumble_core::redundancy::fit::adoption::AdoptionRefusal;
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::monitor::event::{Event, EventKind};
use tumble_core::redundancy::output::Output;
use tumble_core::redundancy::record::{Record, RecordPart};
use tumble_core::redundancy::sensor::Sensor;
use tumble_store::checksum::checksum;

/// A number as its bits.
#[derive(Clone, Copy)]
pub struct Bits(pub f32);

impl Display for Bits {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        // Which of the many that are not numbers comes out is left to the processor.
        if self.0.is_nan() {
            return f.write_str("NaN");
        }
        write!(f, "#{:08x}", self.0.to_bits())
    }
}

/// Numbers as their bits.
pub struct All<'n>(pub &'n [f32]);

impl Display for All<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        for (i, number) in self.0.iter().enumerate() {
            f.write_str(if i > 0 { " " } else { "" })?;
            Bits(*number).fmt(f)?;
        }
        Ok(())
    }
}

/// Microseconds as seconds.
#[derive(Clone, Copy)]
pub struct Time(pub u64);

impl Display for Time {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        // Written as 32 bits: compilers leave a panic in how 64 are written, and 136 years are enough.
        let short = |number: u64| u32::try_from(number).unwrap_or(u32::MAX);
        let (seconds, rest) = (short(self.0 / 1_000_000), short(self.0 % 1_000_000));
        write!(f, "{seconds}.{rest:06} s")
    }
}

/// In what a sensor is read.
fn unit(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Accelerometer => "m/s^2",
        Sensor::Gyroscope => "rad/s",
    }
}

/// A unit by its number.
struct UnitLabel(usize);

impl Display for UnitLabel {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self.0 {
            0 => f.write_str("primary"),
            number => write!(f, "secondary {number}"),
        }
    }
}

/// An event.
///
/// # Errors
/// Those of the writer; the same holds for all of these.
pub fn event(out: &mut dyn Write, event: &Event<f32>) -> Result {
    write!(out, "{} {}: ", Time(event.time), UnitLabel(event.unit))?;
    let name = event.kind.name();
    match &event.kind {
        EventKind::RestBegan | EventKind::RestEnded | EventKind::MotionBegan | EventKind::Healthy => {
            writeln!(out, "{name}")
        }
        EventKind::Evaluated {
            sensor,
            check,
            deviation,
            threshold,
        } => {
            let (deviation, threshold) = (Bits(*deviation), Bits(*threshold));
            writeln!(
                out,
                "{} deviates by {deviation} {} ({}), threshold {threshold}",
                sensor.name(),
                unit(*sensor),
                check.name()
            )
        }
        EventKind::Withheld { sensor, why } => {
            writeln!(
                out,
                "{} deviates but is not calibrated: {}",
                sensor.name(),
                why.name()
            )
        }
        EventKind::Triggered {
            sensors: [accelerometer, gyroscope],
        } => writeln!(
            out,
            "{name}, accelerometer {accelerometer}, gyroscope {gyroscope}"
        ),
        EventKind::Fitted {
            sensor,
            fit_model,
            directions,
            pairs,
            residual,
            residual_before,
        } => {
            let (after, before) = (Bits(*residual), Bits(*residual_before));
            write!(
                out,
                "{} {name}, {}, {directions} directions, {pairs} pairs, ",
                sensor.name(),
                fit_model.name()
            )?;
            writeln!(out, "residual {after} {}, before {before}", unit(*sensor))
        }
        EventKind::Adopted { record: adopted } => {
            writeln!(out, "{name}")?;
            record(out, adopted)
        }
        EventKind::Refused { sensor, why } => {
            write!(out, "{} {name}, ", sensor.name())?;
            refusal(out, why)
        }
        EventKind::Abandoned { why } => writeln!(out, "calibration {name}: {}", why.name()),
        EventKind::Unhealthy { fault: found } => {
            write!(out, "{name}, {}", found.name())?;
            fault(out, found)
        }
        EventKind::Disagree {
            sensor,
            other,
            apart,
            limit,
            scale,
        } => writeln!(
            out,
            "{} {name}s with unit {other}: {} over {}, in {} s",
            sensor.name(),
            Bits(*apart),
            Bits(*limit),
            Bits(*scale)
        ),
        EventKind::Agree { sensor, other } => writeln!(out, "{} {name}s with unit {other}", sensor.name()),
        EventKind::AidingLeftOut { why } => writeln!(out, "{name}: {}", why.name()),
        EventKind::AidingDistrusted { misfit, limit } => {
            writeln!(out, "{name}: {} over {}", Bits(*misfit), Bits(*limit))
        }
        EventKind::AidingTrusted => writeln!(out, "{name}"),
        EventKind::Selected { reason } => writeln!(out, "is the source: {}", reason.name()),
        EventKind::NoneSelected => writeln!(out, "there is no source"),
        EventKind::Restored { sensor, sequence } => {
            writeln!(out, "{} {name}, sequence {sequence}", sensor.name())
        }
        EventKind::RecordRejected { sensor, why } => {
            writeln!(out, "{} {name}: {}", sensor.name(), why.name())
        }
        EventKind::TimeJumped { by } => {
            let to = if *by < 0 { "back" } else { "on" };
            writeln!(out, "{name} {to} by {}", Time(by.unsigned_abs()))
        }
        EventKind::AllSaturated { sensor } => writeln!(out, "{} {name}", sensor.name()),
    }
}

fn refusal(out: &mut dyn Write, why: &AdoptionRefusal<f32>) -> Result {
    let reason = why.reason().name();
    match why {
        AdoptionRefusal::Unsolvable => writeln!(out, "{reason}"),
        AdoptionRefusal::TooFewPairs { pairs, needed } => writeln!(out, "{reason}: {pairs} of {needed}"),
        AdoptionRefusal::Exceeds(_, excess) => {
            writeln!(
                out,
                "{reason}: {} over {}",
                Bits(excess.value),
                Bits(excess.limit)
            )
        }
    }
}

/// The figures of a fault, behind its name: whose, what was found, and what it may be.
fn fault(out: &mut dyn Write, fault: &HealthFault<f32>) -> Result {
    let found = fault.figures();
    if let Some(sensor) = found.sensor {
        write!(out, ", {}", sensor.name())?;
    }
    if let Some(channel) = found.channel {
        write!(out, ", channel {channel}")?;
    }
    if let Some(ground) = found.ground {
        write!(out, ", by {}", ground.name())?;
    }
    if let Some(value) = found.value {
        write!(out, ": {}", Bits(value))?;
    }
    if let Some(limit) = found.limit {
        write!(out, " over {}", Bits(limit))?;
    }
    if let Some(scale) = found.scale {
        write!(out, ", in {} s", Bits(scale))?;
    }
    if let Some(agreeing) = found.agreeing {
        write!(out, ", units {agreeing:#b} agree")?;
    }
    writeln!(out)
}

/// A record, on several lines, matrices column by column.
fn record(out: &mut dyn Write, record: &Record<f32>) -> Result {
    writeln!(
        out,
        "  record of {} of {:#x}: sequence {}, {}, {} directions, {} pairs",
        record.sensor.name(),
        record.identity,
        record.sequence,
        record.fit_model.name(),
        record.directions,
        record.pairs,
    )?;
    for (part, numbers) in RecordPart::ALL.into_iter().zip(record.parts()) {
        let indent = if part.may_be_infinite() || numbers.len() > 3 {
            6
        } else {
            4
        };
        writeln!(out, "{:indent$}{} {}", "", part.name(), All(numbers))?;
    }
    Ok(())
}

/// A vector.
///
/// # Errors
/// Those of the writer.
pub fn vector(out: &mut dyn Write, name: &str, vector: &Vector3<f32>) -> Result {
    writeln!(out, "    {name} {}", All(vector.as_slice()))
}

/// All outputs of the set: each goes into a checksum, and every fortieth is written down.
#[derive(Default)]
pub struct Outputs {
    checksum: u32,
    count: u32,
}

/// One second at 40 Hz.
const WRITTEN_EVERY: u32 = 40;

impl Outputs {
    /// Takes in the next.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn take(&mut self, out: &mut dyn Write, output: &Output<f32>) -> Result {
        let numbers = output.specific_force.iter().chain(output.angular_rate.iter());
        self.add(&output.time.to_le_bytes());
        // A number of a unit has not the same size everywhere.
        self.add(&(output.source as u64).to_le_bytes());
        for number in numbers {
            self.add(&number.to_le_bytes());
        }
        self.count = self.count.wrapping_add(1);
        if self.count % WRITTEN_EVERY != 1 {
            return Ok(());
        }
        writeln!(
            out,
            "  output {} of {}: {} {}, checksum so far {:08x}",
            Time(output.time),
            UnitLabel(output.source),
            All(output.specific_force.as_slice()),
            All(output.angular_rate.as_slice()),
            self.checksum
        )
    }

    /// Writes the number of outputs, and the checksum of all.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn end(self, out: &mut dyn Write) -> Result {
        let Self { checksum, count } = self;
        writeln!(out, "outputs: {count}, checksum of all {checksum:08x}")
    }

    fn add(&mut self, bytes: &[u8]) {
        self.checksum = checksum(self.checksum, bytes);
    }
}
