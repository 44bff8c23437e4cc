//! A robot that stands, turns on the spot and stands again.

use core::fmt::Write;

use tumble_core::real::real;
use tumble_core::spin::estimate::{ScalarEstimate, SpinEstimate, TrueAngle, VectorEstimate};
use tumble_core::spin::machine::{SpinEvent, SpinMachine, SpinState, Wheels};
use tumble_core::spin::settings::SpinSettings;

use crate::MissionError;
use crate::text::{All, Bits, Time, vector};
use crate::units::sample;
use crate::vectors::Cases;
use crate::work_meter::{WorkMeter, WorkPart};

/// Plays a spin, and reports its estimates.
///
/// # Errors
/// [`MissionError`].
pub fn spin<W: WorkMeter>(file: &[u8], watch: &mut W, out: &mut dyn Write) -> Result<(), MissionError> {
    let cases = Cases::of(file)?;
    writeln!(out, "spin")?;
    let mut machine = SpinMachine::new(&SpinSettings {
        gravity: real(cases.number("gravity")?),
        ..SpinSettings::default()
    });
    machine.start();
    let steps = [
        real(cases.number("force_step")?),
        real(cases.number("rate_step")?),
    ];
    let interval = cases.microseconds("interval_us")?;
    let mut time = 0_u64;
    for counts in cases.rows("counts")? {
        let sample = sample(time, &counts?, steps);
        let solves = matches!(machine.state(), SpinState::Solving);
        let event = watch.during(|| machine.push(&sample, Wheels::Unknown));
        watch.was(if solves {
            WorkPart::SpinSlice
        } else {
            WorkPart::SpinPush
        });
        if let Some(event) = event {
            let (turned, rate) = (machine.progress().turned, machine.progress().rate);
            writeln!(
                out,
                "{} {}, turned {} rad, rate {} rad/s",
                Time(time),
                event.name(),
                Bits(turned),
                Bits(rate)
            )?;
        }
        // Samples behind the end are ignored, and would count as samples that cost next to nothing.
        if matches!(event, Some(SpinEvent::Done | SpinEvent::Failed)) {
            break;
        }
        time = time.saturating_add(interval);
    }
    let found = machine.solve(None);
    let angle = machine.progress().turned;
    let known = TrueAngle {
        clockwise: None,
        counter_clockwise: Some(angle),
        sigma: real(0.01),
    };
    let mut scale = None;
    let solved = watch.during(|| machine.solve_in_place(Some(&known), |found| scale = Some(found.scale)));
    watch.was(WorkPart::SpinSolve);
    if let (Ok(()), Some(scale)) = (solved, &scale) {
        value(out, "scale, if that was the angle", scale)?;
    }
    match (machine.state(), found) {
        (SpinState::Done, Ok(estimate)) => tell(out, &estimate)?,
        (SpinState::Failed(_), _) => writeln!(out, "spin failed")?,
        _ => writeln!(out, "spin is not finished")?,
    }
    Ok(())
}

fn tell(out: &mut dyn Write, found: &SpinEstimate<f32>) -> core::fmt::Result {
    let turned = &found.turned;
    let angles = [
        turned.clockwise.angle,
        turned.counter_clockwise.angle,
        turned.least,
        turned.most,
    ];
    writeln!(
        out,
        "spin found, {} samples, rest of {} s",
        found.samples,
        Bits(found.resting_time)
    )?;
    writeln!(
        out,
        "      turned clockwise, counter-clockwise, headings {}",
        All(&angles)
    )?;
    let durations = [
        turned.clockwise.duration,
        turned.counter_clockwise.duration,
        turned.squared,
    ];
    writeln!(out, "      for, and integral of squared rate {}", All(&durations))?;
    vector(out, "  rotation vector", &turned.vector)?;
    for noise in &found.noise {
        vector(out, "  noise", noise)?;
    }
    for (name, found) in [
        ("gyroscope bias", &found.gyroscope_bias),
        ("accelerometer bias", &found.level_free),
        ("accelerometer bias if the floor is level", &found.level_floor),
        ("lever arm", &found.lever_arm),
    ] {
        bias(out, name, found)?;
    }
    writeln!(
        out,
        "    the accelerometer bias is the first of the two: {}",
        found.level_free_is_default
    )?;
    writeln!(out, "      covariance {}", All(found.covariance.as_slice()))?;
    vector(out, "  up", &found.up)?;
    for (name, found) in [
        ("roll", &found.roll),
        ("pitch", &found.pitch),
        ("floor tilt", &found.floor_tilt),
        ("  uphill bearing", &found.uphill_bearing),
        ("scale", &found.scale),
        ("  scale clockwise", &found.scale_clockwise),
        ("  scale counter-clockwise", &found.scale_counter_clockwise),
        ("  slow turn", &found.slow_turn),
    ] {
        value(out, name, found)?;
    }
    let turned_while_still = found.turned_while_still;
    writeln!(out, "      turned while still: {turned_while_still}")?;
    let (chi_square, freedom) = (Bits(found.chi_square), found.degrees_of_freedom);
    writeln!(out, "    chi-square {chi_square}, degrees of freedom {freedom}")
}

fn bias(out: &mut dyn Write, name: &str, bias: &VectorEstimate<f32>) -> core::fmt::Result {
    let (value, sigma) = (All(bias.value.as_slice()), All(bias.sigma.as_slice()));
    writeln!(
        out,
        "    {name} {value}, sigma {sigma}, observed {}",
        bias.observed
    )
}

fn value(out: &mut dyn Write, name: &str, value: &ScalarEstimate<f32>) -> core::fmt::Result {
    writeln!(
        out,
        "    {name} {}, sigma {}",
        Bits(value.value),
        Bits(value.sigma)
    )
}
