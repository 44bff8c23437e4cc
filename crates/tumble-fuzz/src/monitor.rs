//! The monitor of a redundant set: from all states of a mission, samples, clocks, commands, records and settings as
//! bad as they come. Nothing panics; all outputs are finite and of a unit of the set; adopted records can be stored; the
//! same input gives the same bits; and there is an output while any unit sends usable numbers that change, whatever the
//! others send and whatever was sent before.

use std::cell::Cell;
use std::fmt::{self, Write as _};
use std::hash::{DefaultHasher, Hasher as _};
use std::ops::Range;

use tumble_core::redundancy::monitor::event::{Event, EventKind};
use tumble_core::redundancy::monitor::{Command, Monitor};
use tumble_core::redundancy::output::Output;
use tumble_core::redundancy::platform::Platform;
use tumble_core::redundancy::sensor::Axes;
use tumble_core::sample::Sample;
use tumble_store::record::{MAX_ENCODED, StoredRecord, encode};

use crate::campaign::RunOutcome;
use crate::draw::FuzzDraw;
use crate::mission::{LENGTH, UNITS, sample};
use crate::record::{plain_record, spoil_record};
use crate::settings::{FIRST_IDENTITY, usual, worst};

/// One secondary is calibrated at a time, like on a device.
type FuzzedMonitor = Monitor<f32, UNITS, 1>;

/// Sets that fly the mission.
const SETS: u64 = 12;

/// Samples from one scene to the next.
const BETWEEN: u64 = 20;

/// Samples after which a set is in health again: in motion, for three seconds.
const SOUND: Range<u64> = 1500..3750;

/// Samples until the clock of the set is that of its units again, whatever it was before: 1.2 s.
const FOUND_AGAIN: u64 = 900;

/// Most samples without an output from then on: 0.24 s.
const LONGEST_GAP: u64 = 180;

/// One run in so many is continued until it has recovered, which takes longer than all the rest of it.
const RECOVERED: usize = 64;

/// Where a run may begin.
struct MonitorScene {
    set: usize,
    /// Samples of the mission that were taken in.
    step: u64,
    monitor: FuzzedMonitor,
}

/// Monitors in all states.
pub struct MonitorScenes {
    sets: Vec<Platform<f32, UNITS>>,
    scenes: Vec<MonitorScene>,
    /// Scenes after which something happens soon.
    eventful: Vec<usize>,
}

/// Sets that differ in what can be chosen.
fn sets() -> Vec<Platform<f32, UNITS>> {
    (0..SETS).map(|seed| usual(&mut FuzzDraw::new(seed))).collect()
}

/// Flies the mission; shows the monitor before each sample.
fn fly(
    platform: &Platform<f32, UNITS>,
    mut show: impl FnMut(u64, &FuzzedMonitor),
    mut hear: impl FnMut(Event<f32>),
) {
    let mut monitor = FuzzedMonitor::new();
    for step in 0..LENGTH {
        show(step, &monitor);
        if let Some((number, sample)) = sample(step) {
            monitor.push(platform, number, &sample, &mut hear);
        }
    }
}

impl MonitorScenes {
    /// Flies the mission with some sets.
    pub fn new() -> Self {
        let sets = sets();
        let (mut scenes, mut eventful) = (Vec::new(), Vec::new());
        for (set, platform) in sets.iter().enumerate() {
            let scene = Cell::new(scenes.len());
            let show = |step: u64, monitor: &FuzzedMonitor| {
                if step.is_multiple_of(BETWEEN) {
                    let monitor = *monitor;
                    scene.set(scenes.len());
                    scenes.push(MonitorScene { set, step, monitor });
                }
            };
            fly(platform, show, |_| eventful.push(scene.get()));
        }
        eventful.dedup();
        Self {
            sets,
            scenes,
            eventful,
        }
    }

    /// Makes one run, twice.
    pub fn run(&self, draw: FuzzDraw) -> RunOutcome {
        let [first, second] = [self.play(draw.clone())?, self.play(draw)?];
        if first == second {
            Ok(())
        } else {
            Err("a second run gives other bits".to_owned())
        }
    }

    /// Plays a run; returns the digest of all outputs.
    fn play(&self, mut draw: FuzzDraw) -> Result<u64, String> {
        let chosen = if draw.once_in(2) {
            draw.pick(&self.eventful)
        } else {
            draw.below(self.scenes.len())
        };
        let scene = &self.scenes[chosen];
        let usual = &self.sets[scene.set];
        let mut run = Run {
            platform: if draw.once_in(3) {
                worst(&mut draw, usual)
            } else {
                *usual
            },
            monitor: if draw.once_in(8) {
                FuzzedMonitor::new()
            } else {
                scene.monitor
            },
            spoiler: Spoiler::new(&mut draw),
            log: RunLog::default(),
        };
        for step in scene.step..scene.step + 10 + draw.below(50) as u64 {
            run.step(&mut draw, step)?;
        }
        // Records that are wrong but plausible may make good units disagree.
        let recovers = run.platform == *usual && !run.log.restored;
        if recovers && draw.once_in(RECOVERED) {
            run.recover(&mut draw)?;
        }
        Ok(run.log.digest.finish())
    }
}

struct Run {
    platform: Platform<f32, UNITS>,
    monitor: FuzzedMonitor,
    spoiler: Spoiler,
    log: RunLog,
}

impl Run {
    /// After any input, a set of which any unit sends usable numbers that change has an output again, and keeps it.
    /// Secondaries that were never calibrated may be passed over: then the primary sends them.
    fn recover(&mut self, draw: &mut FuzzDraw) -> RunOutcome {
        let only = self.platform.settings().selection.calibrated_only;
        let sound = draw.below(if only { 1 } else { UNITS });
        let spoilt = draw.pick(&[0, 1, 2, 20]);
        let mut last = SOUND.start + FOUND_AGAIN;
        for step in SOUND {
            if let Some((number, mut sample)) = sample(step) {
                if number != sound && spoilt > 0 && draw.once_in(spoilt) {
                    spoil_values(draw, &mut sample);
                }
                let log = &mut self.log;
                let said = self
                    .monitor
                    .push(&self.platform, number, &sample, &mut |event| log.hear(&event));
                if let Some(output) = said {
                    log.take(&self.platform, &output)?;
                    last = last.max(step);
                }
            }
            if step > last + LONGEST_GAP {
                return Err(format!(
                    "no output since {last} of {SOUND:?}, though unit {sound} sends"
                ));
            }
        }
        Ok(())
    }

    fn step(&mut self, draw: &mut FuzzDraw, step: u64) -> RunOutcome {
        let (platform, log) = (&self.platform, &mut self.log);
        if draw.once_in(32) {
            let command = draw.pick(&[Command::Evaluate, Command::ReturnToPrimary]);
            self.monitor.command(command);
        }
        if draw.once_in(32) {
            let record = any_record(draw).record;
            self.monitor
                .restore(platform, &record, &mut |event| log.hear(&event));
        }
        if draw.once_in(32) {
            let unit = draw.pick(&[0, 1, 2, UNITS, usize::MAX]);
            self.monitor.set_temperature(unit, draw.number());
        }
        let Some((number, mut sample)) = sample(step) else {
            return Ok(());
        };
        let number = self.spoiler.spoil(draw, number, &mut sample);
        let output = self
            .monitor
            .push(platform, number, &sample, &mut |event| log.hear(&event));
        if let Some(output) = output {
            let time = platform
                .units()
                .get(number)
                .map(|unit| unit.common_time(sample.time));
            if (output.source, Some(output.time)) != (number, time) {
                return Err(format!("not of the sample that was pushed: {output:?}"));
            }
            log.take(platform, &output)?;
        }
        let source = self.monitor.source();
        if source.is_some_and(|source| source >= UNITS) {
            return Err(format!("the source is {source:?}"));
        }
        log.objection.take().map_or(Ok(()), Err)
    }
}

/// A record of a unit, or of none, sound or not.
fn any_record(draw: &mut FuzzDraw) -> StoredRecord {
    let mut stored = plain_record(draw);
    if !draw.once_in(4) {
        stored.record.identity = FIRST_IDENTITY + draw.below(UNITS + 1) as u64;
    }
    if draw.once_in(2) {
        spoil_record(draw, stored)
    } else {
        stored
    }
}

/// Corruption of samples in one run.
struct Spoiler {
    /// One sample in so many.
    values: usize,
    clocks: usize,
    numbers: usize,
    /// Added to all times, since clocks may be set.
    shift: u64,
    /// Time of the sample before.
    before: u64,
}

impl Spoiler {
    fn new(draw: &mut FuzzDraw) -> Self {
        let often = [1, 2, 5, 10, 1000];
        Self {
            values: draw.pick(&often),
            clocks: draw.pick(&often),
            numbers: draw.pick(&[10, 1000]),
            shift: 0,
            before: 0,
        }
    }

    /// Corrupts a sample; returns the unit to which it is attributed.
    fn spoil(&mut self, draw: &mut FuzzDraw, number: usize, sample: &mut Sample<f32>) -> usize {
        if draw.once_in(self.values) {
            spoil_values(draw, sample);
        }
        if draw.once_in(self.clocks * 16) {
            self.shift = draw.time();
        }
        sample.time = sample.time.wrapping_add(self.shift);
        if draw.once_in(self.clocks) {
            sample.time = match draw.below(4) {
                0 => self.before,
                1 => sample.time.wrapping_add(draw.time()),
                2 => sample.time.wrapping_sub(draw.time()),
                _ => draw.time(),
            };
        }
        self.before = sample.time;
        if draw.once_in(self.numbers) {
            return draw.pick(&[0, 1, 2, UNITS, usize::MAX]);
        }
        number
    }
}

/// Corrupts some channels, or all.
pub fn spoil_values(draw: &mut FuzzDraw, sample: &mut Sample<f32>) {
    let channels = sample.specific_force.iter_mut().chain(&mut sample.angular_rate);
    match draw.below(4) {
        0 => draw.spoil(channels),
        1 => {
            let number = draw.number();
            channels.for_each(|channel| *channel = number);
        }
        2 => {
            let factor = draw.number();
            channels.for_each(|channel| *channel *= factor);
        }
        _ => channels.for_each(|channel| *channel = draw.number()),
    }
}

/// Log of all outputs of a run.
#[derive(Default)]
pub struct RunLog {
    digest: DefaultHasher,
    objection: Option<String>,
    /// True if a record was accepted.
    restored: bool,
}

impl RunLog {
    fn hear(&mut self, event: &Event<f32>) {
        // Writing to a hasher cannot fail.
        let _ = write!(Text(&mut self.digest), "{event:?}");
        self.restored |= matches!(event.kind, EventKind::Restored { .. });
        if event.unit >= UNITS {
            self.objection = Some(format!("of a unit that is not there: {event:?}"));
        }
        if let EventKind::Adopted { record } = &event.kind
            && encode(&StoredRecord::of(record, None), &mut [0; MAX_ENCODED]).is_err()
        {
            self.objection = Some(format!("adopted, but cannot be stored: {record:?}"));
        }
    }

    /// Checks for a number on each axis that the source measures, and no number on the others.
    fn take(&mut self, platform: &Platform<f32, UNITS>, output: &Output<f32>) -> RunOutcome {
        let numbers = output.specific_force.iter().chain(&output.angular_rate);
        for number in numbers.clone() {
            self.digest.write_u32(number.to_bits());
        }
        let unit = platform.units().get(output.source).ok_or("of no unit")?;
        let Axes(shown) = platform.output_axes(unit);
        let as_shown = |(number, shown): (&f32, bool)| {
            if shown {
                number.is_finite()
            } else {
                number.is_nan()
            }
        };
        if numbers.zip(shown).all(as_shown) {
            Ok(())
        } else {
            Err(format!("not finite, or finite where nothing is said: {output:?}"))
        }
    }
}

/// A hasher as something to write text to.
struct Text<'h>(&'h mut DefaultHasher);

impl fmt::Write for Text<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn missions_have_in_them_all_that_a_monitor_does() {
        let (mut events, mut sources) = (BTreeSet::new(), BTreeSet::new());
        for platform in sets() {
            let show = |_, monitor: &FuzzedMonitor| {
                sources.insert(monitor.source());
            };
            fly(&platform, show, |event| {
                let what = format!("{:?}", event.kind);
                let name = what.split(' ').next().map(str::to_owned);
                events.extend(name);
            });
        }
        let all = [
            "RestBegan",
            "RestEnded",
            "Evaluated",
            "Triggered",
            "MotionBegan",
            "Fitted",
            "Adopted",
            "Unhealthy",
            "Selected",
        ];
        for event in all {
            assert!(events.contains(event), "no {event} in {events:?}");
        }
        assert!(sources.len() > 2, "{sources:?}");
    }

    #[test]
    fn nothing_is_found_in_five_thousand_runs() {
        let scenes = MonitorScenes::new();
        for seed in 0..5000 {
            assert_eq!(scenes.run(FuzzDraw::new(seed)), Ok(()), "seed {seed}");
        }
    }
}
