//! Two starts of the platform. At the first nothing is in flash: the secondaries are found to deviate, are calibrated
//! in motion one after the other, and their records saved. At the second, records are taken from flash; the primary
//! dies in flight, and later the secondary that took over from it.

use core::fmt::Write;

use heapless::Vec;
use nalgebra::Vector3;
use tumble_core::products::{squared, transposed_product};
use tumble_core::redundancy::monitor::event::{Event, EventKind};
use tumble_core::redundancy::monitor::{Command, Monitor};
use tumble_core::redundancy::output::Output;
use tumble_core::redundancy::platform::Platform;
use tumble_core::redundancy::record::{Record, Storage};
use tumble_core::redundancy::sensor::SENSORS;
use tumble_core::sample::Sample;
use tumble_store::checksum::checksum;
use tumble_store::flash::{RecordStore, WriteLimit};

use crate::MissionError;
use crate::nor::{BYTES, Nor};
use crate::text::{self, Bits, Outputs, Time};
use crate::units::{Instant, UNITS, UnitReadings, platform};
use crate::vectors::Cases;
use crate::work_meter::{WorkMeter, WorkPart};

/// When units fall silent at the second start, microseconds of the common clock: the primary, then the first secondary.
const DEATHS: [u64; UNITS] = [7_000_000, 14_000_000, u64::MAX];

/// Nobody dies.
const NO_DEATHS: [u64; UNITS] = [u64::MAX; UNITS];

/// Interruptions of the third flight: from a time on, microseconds, all clocks are ahead or behind by so much. First all units
/// fall silent, then all clocks go back.
const INTERRUPTIONS: [(u64, i64); 2] = [(5_000_000, 2_500_000), (9_000_000, -1_500_000)];

/// End of the third flight, microseconds.
const INTERRUPTED_UNTIL: u64 = 13_000_000;

/// Temperature of the units, degC, which goes with their records.
const TEMPERATURE: f32 = 31.5;

/// More events than one sample can cause.
const EVENTS: usize = 16;

/// The platform in flight.
struct MissionFlight<'m, 'w, W> {
    platform: Platform<f32, UNITS>,
    monitor: Monitor<f32, UNITS, 1>,
    store: RecordStore<Nor<'m>>,
    deaths: [u64; UNITS],
    outputs: Outputs,
    departures: [Departure; UNITS],
    watch: &'w mut W,
    out: &'w mut dyn Write,
}

/// The first start: evaluation at rest, calibration in motion, records into flash.
///
/// # Errors
/// [`MissionError`].
pub fn first<W: WorkMeter>(
    file: &[u8],
    nor: Nor<'_>,
    watch: &mut W,
    out: &mut dyn Write,
) -> Result<(), MissionError> {
    writeln!(out, "first start")?;
    let cases = Cases::of(file)?;
    let mut flight = MissionFlight::begin(&cases, nor, NO_DEATHS, watch, out)?;
    let mut readings = UnitReadings::new(&cases)?;
    for instant in readings.by_ref() {
        flight.live_through(&instant?)?;
    }
    // One is calibrated at a time: the other secondary has its turn at a rest that somebody asks to be used.
    writeln!(flight.out, "evaluation commanded")?;
    flight.monitor.command(Command::Evaluate);
    for instant in readings.again(&cases)? {
        flight.live_through(&instant?)?;
    }
    flight.end()
}

/// The second start: records from flash, then the primary dies, and later the first secondary.
///
/// # Errors
/// [`MissionError`].
pub fn second<W: WorkMeter>(
    file: &[u8],
    nor: Nor<'_>,
    watch: &mut W,
    out: &mut dyn Write,
) -> Result<(), MissionError> {
    writeln!(out, "second start")?;
    let cases = Cases::of(file)?;
    let mut flight = MissionFlight::begin(&cases, nor, DEATHS, watch, out)?;
    for instant in UnitReadings::new(&cases)? {
        flight.live_through(&instant?)?;
    }
    flight.end()
}

/// A flight with the records of flash, in which all units fall silent together and go on, and all clocks go back.
///
/// # Errors
/// [`MissionError`].
pub fn interrupted<W: WorkMeter>(
    file: &[u8],
    nor: Nor<'_>,
    watch: &mut W,
    out: &mut dyn Write,
) -> Result<(), MissionError> {
    writeln!(out, "interrupted flight")?;
    let cases = Cases::of(file)?;
    let mut flight = MissionFlight::begin(&cases, nor, NO_DEATHS, watch, out)?;
    for instant in UnitReadings::new(&cases)? {
        let mut instant = instant?;
        let [primary, ..] = &instant;
        let time = primary.time;
        if time > INTERRUPTED_UNTIL {
            break;
        }
        for (_, by) in INTERRUPTIONS.iter().filter(|(from, _)| time >= *from) {
            for sample in &mut instant {
                sample.time = sample.time.saturating_add_signed(*by);
            }
        }
        flight.live_through(&instant)?;
    }
    flight.end()
}

/// Checks that a record of every sensor of every secondary is in flash.
///
/// # Errors
/// [`MissionError`].
pub fn has_records(file: &[u8], nor: Nor<'_>) -> Result<bool, MissionError> {
    let platform = platform(&Cases::of(file)?)?;
    let mut store = store(nor)?;
    for unit in platform.units().iter().skip(1) {
        for sensor in SENSORS {
            if store.in_force(unit.identity, sensor)?.is_none() {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

/// All of the flash, for records.
fn store(nor: Nor<'_>) -> Result<RecordStore<Nor<'_>>, MissionError> {
    Ok(RecordStore::new(nor, 0..BYTES as u32, WriteLimit::default())?)
}

impl<'m, 'w, W: WorkMeter> MissionFlight<'m, 'w, W> {
    /// Starts up: what is stored is restored.
    fn begin(
        cases: &Cases<'_>,
        nor: Nor<'m>,
        deaths: [u64; UNITS],
        watch: &'w mut W,
        out: &'w mut dyn Write,
    ) -> Result<Self, MissionError> {
        let mut flight = Self {
            platform: platform(cases)?,
            monitor: Monitor::new(),
            store: store(nor)?,
            deaths,
            outputs: Outputs::default(),
            departures: [Departure::default(); UNITS],
            watch,
            out,
        };
        let mut events = Events::default();
        let Self {
            platform,
            monitor,
            store,
            watch,
            ..
        } = &mut flight;
        let mut storage = store.at(0, None);
        let restored =
            watch.during(|| monitor.restore_from(platform, &mut storage, &mut |event| events.take(&event)));
        watch.was(WorkPart::Restore);
        restored?;
        flight.tell(&events)?;
        Ok(flight)
    }

    /// Takes in the samples of all units that are alive.
    fn live_through(&mut self, instant: &Instant) -> Result<(), MissionError> {
        let alive = self.deaths;
        for (unit, (sample, death)) in instant.iter().zip(alive).enumerate() {
            if sample.time < death {
                self.take(unit, sample, instant)?;
            }
        }
        Ok(())
    }

    fn take(&mut self, unit: usize, sample: &Sample<f32>, instant: &Instant) -> Result<(), MissionError> {
        let mut events = Events::default();
        let (monitor, platform) = (&mut self.monitor, &self.platform);
        let part = if monitor.is_fitting() {
            WorkPart::Fit
        } else {
            WorkPart::Push
        };
        let output = self
            .watch
            .during(|| monitor.push(platform, unit, sample, &mut |event| events.take(&event)));
        self.watch.was(part);
        self.tell(&events)?;
        for event in &events.list {
            if let EventKind::Adopted { record } = &event.kind {
                self.save(event.time, record)?;
            }
        }
        if let Some(output) = output {
            self.outputs.take(self.out, &output)?;
            self.depart(instant, &output);
        }
        Ok(())
    }

    fn tell(&mut self, events: &Events) -> Result<(), MissionError> {
        for event in &events.list {
            text::event(self.out, event)?;
        }
        if events.lost > 0 {
            writeln!(self.out, "{} events lost", events.lost)?;
        }
        Ok(())
    }

    fn save(&mut self, now: u64, record: &Record<f32>) -> Result<(), MissionError> {
        let mut storage = self.store.at(now, Some(TEMPERATURE));
        let saved = self.watch.during(|| storage.save(record));
        self.watch.was(WorkPart::Save);
        saved?;
        writeln!(
            self.out,
            "{} record of {} of {:#x} saved",
            Time(now),
            record.sensor.name(),
            record.identity
        )?;
        Ok(())
    }

    /// Compares the output of a secondary with the compensated readings of the primary.
    fn depart(&mut self, instant: &Instant, output: &Output<f32>) {
        let [primary, ..] = instant;
        let (unit, raw) = (
            self.platform.units().get(output.source),
            instant.get(output.source),
        );
        let departure = self.departures.get_mut(output.source);
        if let (Some(unit), Some(raw), Some(departure)) = (unit, raw, departure) {
            let turned = |y: &Vector3<f32>| transposed_product(&unit.sensor_from_primary, y);
            let as_read = (turned(&raw.specific_force), turned(&raw.angular_rate));
            departure.take(primary, (&output.specific_force, &output.angular_rate), as_read);
        }
    }

    /// Writes the end of the report.
    fn end(self) -> Result<(), MissionError> {
        self.outputs.end(self.out)?;
        for (unit, departure) in self.departures.iter().enumerate().skip(1) {
            departure.tell(self.out, unit)?;
        }
        let nor = self.store.into_flash();
        let content = checksum(0, nor.content());
        writeln!(
            self.out,
            "flash: checksum {content:08x}, {} pages erased and {} bytes written since the start",
            nor.erasures, nor.written
        )?;
        Ok(())
    }
}

/// Events of one sample: written down afterwards, as formatting takes stack of its own.
#[derive(Default)]
struct Events {
    list: Vec<Event<f32>, EVENTS>,
    lost: u32,
}

impl Events {
    fn take(&mut self, event: &Event<f32>) {
        if self.list.push(*event).is_err() {
            self.lost = self.lost.saturating_add(1);
        }
    }
}

/// Difference of a secondary that is the source from the primary's compensated readings, for compensated and raw
/// readings: sums of squares of specific force and angular rate.
#[derive(Clone, Copy, Default)]
struct Departure {
    compensated: [f32; 2],
    as_read: [f32; 2],
    count: u32,
}

impl Departure {
    fn take(
        &mut self,
        primary: &Sample<f32>,
        output: (&Vector3<f32>, &Vector3<f32>),
        as_read: (Vector3<f32>, Vector3<f32>),
    ) {
        let (f, w) = (&primary.specific_force, &primary.angular_rate);
        let add = |[force, rate]: &mut [f32; 2], said: (&Vector3<f32>, &Vector3<f32>)| {
            *force += squared(&(said.0 - f));
            *rate += squared(&(said.1 - w));
        };
        add(&mut self.compensated, output);
        add(&mut self.as_read, (&as_read.0, &as_read.1));
        self.count = self.count.wrapping_add(1);
    }

    #[allow(clippy::cast_precision_loss)]
    fn tell(&self, out: &mut dyn Write, unit: usize) -> core::fmt::Result {
        if self.count == 0 {
            return Ok(());
        }
        let root_mean_square = |sum: f32| Bits(nalgebra::ComplexField::sqrt(sum / self.count as f32));
        let ([force, rate], [force_read, rate_read]) = (
            self.compensated.map(root_mean_square),
            self.as_read.map(root_mean_square),
        );
        writeln!(
            out,
            "secondary {unit} was the source for {} outputs; from what the primary would have said",
            self.count
        )?;
        writeln!(
            out,
            "    specific force was {force} m/s^2 away, {force_read} as read, root mean square"
        )?;
        writeln!(out, "    angular rate was {rate} rad/s away, {rate_read} as read")
    }
}
