//! The spin of a robot: from all states of one, samples, clocks, wheels, ticks and settings as bad as they come.
//! Nothing panics, a result is finite if the settings are, and the same input gives the same bits.

use std::hash::{DefaultHasher, Hasher as _};

use nalgebra::Vector3;
use tumble_core::gravity;
use tumble_core::sample::Sample;
use tumble_core::spin::estimate::{ScalarEstimate, SpinEstimate, TrueAngle, VectorEstimate};
use tumble_core::spin::machine::{SpinMachine, SpinState, Wheels};
use tumble_core::spin::settings::SpinSettings;

use crate::campaign::RunOutcome;
use crate::draw::FuzzDraw;
use crate::monitor::spoil_values;

/// From one sample to the next, microseconds.
const PERIOD: u64 = 10_000;

/// Where a spin begins, microseconds.
const START: u64 = 7_000_000;

/// Samples of a spin, until shortly after it is done.
const LENGTH: u64 = 500;

const WHEELS: [Wheels; 3] = [Wheels::Unknown, Wheels::Stopped, Wheels::Turning];

/// So short that a spin is done in seconds.
fn short() -> SpinSettings<f32> {
    SpinSettings {
        still: 800_000,
        turn: 12.0,
        block: 50_000,
        shortest_stop: 300_000,
        still_timeout: 10_000_000,
        spin_timeout: 10_000_000,
        ..SpinSettings::default()
    }
}

/// A robot on a floor that tilts: it stands for a second, turns, and stands.
fn sample(step: u64) -> Sample<f32> {
    let mut draw = FuzzDraw::new(step);
    let seconds = step as f32 * 0.01;
    let turning = (seconds - 1.0).clamp(0.0, 4.0);
    let (rate, heading) = if turning > 0.0 && turning < 4.0 {
        (3.2, 3.2 * turning)
    } else {
        (0.0, 3.2 * turning)
    };
    let g = gravity::STANDARD as f32;
    let tilt = 0.02;
    let force = Vector3::new(
        g * tilt * heading.cos() - 0.1 * rate * rate,
        -g * tilt * heading.sin(),
        g,
    );
    let mut noise = |size| Vector3::from_fn(|_, _| draw.usual(size));
    Sample {
        time: START + step * PERIOD,
        specific_force: force + Vector3::new(0.2, -0.1, 0.15) + noise(0.02),
        angular_rate: Vector3::new(0.01, -0.02, rate + 0.015) + noise(0.002),
    }
}

/// Where a run may begin.
struct Scene {
    step: u64,
    machine: SpinMachine<f32>,
}

/// Machines in all states.
pub struct SpinScenes(Vec<Scene>);

impl SpinScenes {
    /// Spins once with the wheels unknown, and once with them known.
    pub fn new() -> Self {
        let mut scenes = Vec::new();
        for known in [false, true] {
            let mut machine = SpinMachine::new(&short());
            machine.start();
            for step in 0..LENGTH {
                scenes.push(Scene { step, machine });
                machine.push(&sample(step), wheels(known, step));
            }
        }
        Self(scenes)
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
        let Scene {
            mut step,
            mut machine,
        } = self.0[draw.below(self.0.len())];
        let mut finite = true;
        if draw.once_in(4) {
            let mut settings = worst(&mut draw);
            finite = numbers(&mut settings).iter().all(|number| number.is_finite());
            machine = SpinMachine::new(&settings);
            machine.start();
            step = draw.pick(&[0, 60, 95]);
        }
        let often = draw.pick(&[1, 2, 5, 20, 1000]);
        let shift = if draw.once_in(8) { draw.time() } else { 0 };
        let mut digest = DefaultHasher::new();
        for step in step..step + 10 + draw.below(50) as u64 {
            let mut sample = sample(step);
            sample.time = sample.time.wrapping_add(shift);
            if draw.once_in(often) {
                spoil(&mut draw, &mut sample);
            }
            let wheels = if draw.once_in(4) {
                draw.pick(&WHEELS)
            } else {
                wheels(true, step)
            };
            let mut event = machine.push(&sample, wheels);
            if draw.once_in(64) {
                let now = draw.time();
                event = event.or(machine.tick(now));
            }
            if draw.once_in(8) {
                event = event.or(machine.work());
            }
            if draw.once_in(256) {
                machine.know_bias_instability(draw.number(), draw.number());
                finite = false;
            }
            if draw.once_in(128) {
                machine.start();
            }
            digest.write_u8(event.map_or(0, |event| event as u8 + 1));
            digest.write_u32(machine.progress().turned.to_bits());
        }
        // A dozen slices do it.
        for _ in 0..64 {
            machine.work();
        }
        if matches!(machine.state(), SpinState::Solving) {
            return Err("it is being solved for ever".to_owned());
        }
        let angle = true_angle(&mut draw);
        let known = draw.once_in(2).then_some(&angle);
        // Solving outside the slices takes longer than all samples of a run, so not all runs do it.
        let asked = draw.once_in(16);
        if asked && let Ok(estimate) = machine.solve(known) {
            if finite {
                check(&estimate)?;
            }
            estimate.up.iter().for_each(|x| digest.write_u32(x.to_bits()));
            digest.write_u32(estimate.chi_square.to_bits());
        }
        Ok(digest.finish())
    }
}

fn wheels(known: bool, step: u64) -> Wheels {
    match step {
        _ if !known => Wheels::Unknown,
        100..500 => Wheels::Turning,
        _ => Wheels::Stopped,
    }
}

fn spoil(draw: &mut FuzzDraw, sample: &mut Sample<f32>) {
    match draw.below(4) {
        0 => sample.time = draw.time(),
        1 => sample.time = sample.time.wrapping_add(draw.time()),
        2 => sample.time = sample.time.wrapping_sub(draw.time()),
        _ => spoil_values(draw, sample),
    }
}

fn true_angle(draw: &mut FuzzDraw) -> TrueAngle<f32> {
    TrueAngle {
        clockwise: draw.once_in(2).then(|| draw.number()),
        counter_clockwise: draw.once_in(2).then(|| draw.number()),
        sigma: draw.number(),
    }
}

/// Checks that observed values are finite.
fn check(estimate: &SpinEstimate<f32>) -> RunOutcome {
    let bias = |bias: &VectorEstimate<f32>| !bias.observed || bias.value.iter().all(|x| x.is_finite());
    let value = |value: &ScalarEstimate<f32>| !value.is_known() || value.value.is_finite();
    let sound = [
        ("gyroscope bias", bias(&estimate.gyroscope_bias)),
        ("accelerometer bias", bias(estimate.accelerometer_bias())),
        ("lever arm", bias(&estimate.lever_arm)),
        ("up", estimate.up.iter().all(|x| x.is_finite())),
        ("roll", value(&estimate.roll)),
        ("pitch", value(&estimate.pitch)),
        ("floor tilt", value(&estimate.floor_tilt)),
        ("scale", value(&estimate.scale)),
        ("clockwise scale", value(&estimate.scale_clockwise)),
        (
            "counter-clockwise scale",
            value(&estimate.scale_counter_clockwise),
        ),
    ];
    match sound.iter().find(|(_, sound)| !sound) {
        None => Ok(()),
        Some((what, _)) => Err(format!("{what} is known and not finite")),
    }
}

/// Settings that nobody checks: whatever they are, the machine has to fail in words.
fn worst(draw: &mut FuzzDraw) -> SpinSettings<f32> {
    let mut settings = short();
    if draw.once_in(2) {
        settings.still = 60_000;
        settings.turn = 0.3;
        settings.block = 20_000;
        settings.shortest_stop = 20_000;
    }
    for _ in 0..=draw.below(4) {
        if draw.once_in(3) {
            *draw.among(times(&mut settings)) = draw.time();
        } else {
            *draw.among(numbers(&mut settings)) = draw.number();
        }
    }
    settings
}

fn times(settings: &mut SpinSettings<f32>) -> [&mut u64; 6] {
    [
        &mut settings.still,
        &mut settings.still_timeout,
        &mut settings.spin_timeout,
        &mut settings.longest_gap,
        &mut settings.block,
        &mut settings.shortest_stop,
    ]
}

fn numbers(settings: &mut SpinSettings<f32>) -> [&mut f32; 23] {
    let stillness = &mut settings.stillness;
    [
        &mut settings.gravity,
        &mut settings.turn,
        &mut settings.rate,
        &mut settings.largest_floor_tilt,
        &mut settings.scale_sigma,
        &mut settings.specific_force_instability,
        &mut settings.angular_rate_instability,
        settings.specific_force_range.get_or_insert(80.0),
        settings.angular_rate_range.get_or_insert(35.0),
        &mut settings.earth_rate_up,
        &mut settings.largest_lift,
        &mut settings.largest_rate_across,
        &mut settings.largest_share_across,
        &mut settings.largest_rate_bias,
        &mut settings.largest_step,
        &mut settings.largest_specific_force_scatter,
        &mut settings.largest_angular_rate_scatter,
        &mut stillness.variance_ratio,
        &mut stillness.smallest_specific_force_scatter,
        &mut stillness.smallest_angular_rate_scatter,
        &mut stillness.specific_force_drift,
        &mut stillness.angular_rate_drift,
        &mut stillness.sigmas,
    ]
}

#[cfg(test)]
mod tests {
    use tumble_core::spin::machine::SpinState;

    use super::*;

    #[test]
    fn runs_begin_at_rest_in_a_turn_and_when_the_spin_is_done() {
        let SpinScenes(scenes) = SpinScenes::new();
        let some = |is: fn(&SpinState<f32>) -> bool| scenes.iter().any(|scene| is(scene.machine.state()));
        assert!(some(|state| *state == SpinState::Still));
        assert!(some(|state| *state == SpinState::Spin));
        assert!(some(|state| *state == SpinState::Done));
        assert!(!some(|state| matches!(state, SpinState::Failed(_))));
    }

    #[test]
    fn nothing_is_found_in_five_thousand_runs() {
        let scenes = SpinScenes::new();
        for seed in 0..5000 {
            assert_eq!(scenes.run(FuzzDraw::new(seed)), Ok(()), "seed {seed}");
        }
    }
}
