//! There is an output as long as any unit sends numbers that change: whatever befalls the others, at any rate, of up to six
//! units. Where secondaries that were never calibrated are passed over, it is the primary that sends, or one that agreed with it.

use proptest::prelude::*;
use tumble_core::redundancy::monitor::event::EventKind;
use tumble_core::redundancy::platform::Range;
use tumble_core::redundancy::unit_count::{UnitCount, Units};
use tumble_core::sample::Sample;

use crate::common::cases;
use crate::redundancy_mission::{Mission, Part, Phase, fly, platform, seconds, settings, units};

/// Fault of a unit, from a time on, s, for as long or for good.
#[derive(Clone, Copy, Debug)]
struct Ailment {
    kind: Kind,
    begins: f64,
    lasts: f64,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Nothing.
    None,
    /// Its readings repeat.
    Frozen,
    /// No sample comes.
    Silent,
    /// A reading is no number, every so many samples.
    NotANumber(u64),
    /// Its readings scatter.
    Noisy(f64),
    /// It has an error of so much, m/s^2 and a tenth of it in rad/s.
    Off(f64),
    /// An axis repeats.
    Stuck,
    /// It is at the end of its range.
    Saturated,
    /// Its readings have the opposite sign.
    TurnedOver,
    /// Its stamps stand.
    ClockStands,
}

const RANGE: f64 = 160.0;

fn ailment() -> impl Strategy<Value = Ailment> {
    let kind = prop_oneof![
        1 => Just(Kind::None),
        3 => Just(Kind::Frozen),
        2 => Just(Kind::Silent),
        2 => (1..4_u64).prop_map(Kind::NotANumber),
        2 => (0.5..20.0_f64).prop_map(Kind::Noisy),
        2 => (0.1..20.0_f64).prop_map(Kind::Off),
        1 => Just(Kind::Stuck),
        1 => Just(Kind::Saturated),
        1 => Just(Kind::TurnedOver),
        1 => Just(Kind::ClockStands),
    ];
    let lasts = prop_oneof![2 => Just(f64::INFINITY), 1 => 0.05..3.0_f64];
    let begins = prop_oneof![1 => Just(0.0), 4 => 0.0..9.0_f64];
    (kind, begins, lasts).prop_map(|(kind, begins, lasts)| Ailment { kind, begins, lasts })
}

impl Ailment {
    /// Changes a sample of a unit of a period, microseconds, s after the start; returns whether it arrives.
    fn spoil(&self, time: f64, period: u64, sample: &mut Sample<f64>) -> bool {
        let since = time - self.begins;
        if !(0.0..self.lasts).contains(&since) {
            return true;
        }
        let number = (since * 1e6) as u64 / period;
        match self.kind {
            Kind::None => {}
            Kind::Silent => return false,
            Kind::Frozen => {
                sample.specific_force = [0.1, 0.2, 9.7].into();
                sample.angular_rate = [0.01, 0.02, 0.03].into();
            }
            Kind::NotANumber(every) => {
                if number.is_multiple_of(every) {
                    sample.specific_force.y = f64::NAN;
                }
            }
            Kind::Noisy(size) => {
                let wild = (number as f64 * 0.7).sin() + (number as f64 * 2.3).sin();
                sample.specific_force.x += size * wild;
                sample.angular_rate.x += 0.1 * size * wild;
            }
            Kind::Off(by) => {
                sample.specific_force.x += by;
                sample.angular_rate.x += 0.1 * by;
            }
            Kind::Stuck => sample.specific_force.x = 0.5,
            Kind::Saturated => sample.specific_force.x = RANGE,
            Kind::TurnedOver => {
                sample.specific_force = -sample.specific_force;
                sample.angular_rate = -sample.angular_rate;
            }
            Kind::ClockStands => sample.time -= (since * 1e6) as u64,
        }
        true
    }
}

/// Periods of units, microseconds, from 10 to 1000 Hz.
fn period() -> impl Strategy<Value = u64> {
    (1.0..3.0_f64).prop_map(|power| (1e6 / 10.0_f64.powf(power)) as u64)
}

/// Longest time without an output, s, and its limit: no check that excludes a source takes longer than eight samples
/// during which it gives no output.
fn longest_gap<const N: usize>(
    ailments: [Ailment; N],
    periods: [u64; N],
    sound: usize,
    calibrated_only: bool,
    seed: u64,
) -> (f64, f64, String)
where
    Units<N>: UnitCount,
{
    let mut parts = [Part::exact(); N];
    for (number, part) in parts.iter_mut().enumerate() {
        part.period = periods[number];
        part.phase = number as u64 * 130;
    }
    let mission = Mission::new(seed, &parts)
        .phases(&[(3.0, Phase::Rest), (6.0, Phase::Free(1.0)), (3.0, Phase::Shaken)])
        .spoilt(move |number, time, sample| {
            number == sound || ailments[number].spoil(time, periods[number], sample)
        });
    let ranged = units::<f32, N>(&parts).map(|mut unit| {
        unit.range = Range {
            specific_force: Some(RANGE as f32),
            angular_rate: None,
        };
        unit
    });
    let mut settings = settings();
    settings.selection.calibrated_only = calibrated_only;
    let flight = fly(&platform(settings, ranged), &mission);
    let slowest = periods.iter().max().map_or(0.0, |period| seconds(*period));
    let mut before = mission.start;
    let mut longest = 0.0_f64;
    let ends = mission.start + 12_000_000;
    for time in flight.outputs.iter().map(|output| output.time).chain([ends]) {
        longest = longest.max(seconds(time.saturating_sub(before)));
        before = time;
    }
    (longest, 0.2 + 8.0 * slowest, flight.story())
}

fn speaks<const N: usize>(
    ailments: [Ailment; N],
    periods: [u64; N],
    sound: usize,
    seed: u64,
) -> Result<(), TestCaseError>
where
    Units<N>: UnitCount,
{
    let (longest, most, story) = longest_gap(ailments, periods, sound % N, false, seed);
    prop_assert!(
        longest <= most,
        "no output for {longest} s, sound {}\n{story}",
        sound % N
    );
    Ok(())
}

/// The first rest is evaluated by then, s: secondaries that agree with the primary are known.
const EVALUATED: f64 = 2.5;

/// The same of sets that pass over secondaries of which nothing is known, and that are sound until they are known.
fn speaks_as_calibrated<const N: usize>(
    mut ailments: [Ailment; N],
    periods: [u64; N],
    sound: usize,
    seed: u64,
) -> Result<(), TestCaseError>
where
    Units<N>: UnitCount,
{
    for ailment in &mut ailments {
        ailment.begins = ailment.begins.max(EVALUATED);
    }
    ailments[sound % N].kind = Kind::None;
    // Slower ones fill no window, and agree with nobody.
    let periods = periods.map(|period| period.min(20_000));
    let (longest, most, story) = longest_gap(ailments, periods, sound % N, true, seed);
    prop_assert!(
        longest <= most,
        "no output for {longest} s, sound {}\n{story}",
        sound % N
    );
    Ok(())
}

/// A unit that is wrong before the first rest was evaluated and sound again before that rest ends.
fn returns<const N: usize>(ailment: Ailment, ill: usize, period: u64, seed: u64) -> Result<(), TestCaseError>
where
    Units<N>: UnitCount,
{
    let mut parts = [Part::exact(); N];
    for (number, part) in parts.iter_mut().enumerate() {
        part.period = period;
        part.phase = number as u64 * 130;
    }
    let mission = Mission::new(seed, &parts)
        .phases(&[(6.0, Phase::Rest), (3.0, Phase::Free(1.0))])
        .spoilt(move |number, time, sample| number != ill % N || ailment.spoil(time, period, sample));
    let ranged = units::<f32, N>(&parts).map(|mut unit| {
        unit.range = Range {
            specific_force: Some(RANGE as f32),
            angular_rate: None,
        };
        unit
    });
    let flight = fly(&platform(settings(), ranged), &mission);
    let moves = mission.start + 5_900_000;
    let ended = flight
        .events
        .iter()
        .find(|event| event.kind == EventKind::RestEnded && event.time < moves);
    prop_assert!(ended.is_none(), "unit {}\n{}", ill % N, flight.story());
    Ok(())
}

proptest! {
    #![proptest_config(cases(24))]

    #[test]
    fn a_unit_that_comes_back_ends_no_first_rest(
        kind in ailment(), begins in 0.0..2.0_f64, lasts in 0.05..2.0_f64, ill in 0..4_usize,
        period in period(), seed in any::<u64>()
    ) {
        let ailment = Ailment { begins, lasts, ..kind };
        // Slower ones make windows longer, which begin anew.
        let period = period.min(20_000);
        returns::<2>(ailment, ill, period, seed)?;
        returns::<3>(ailment, ill, period, seed)?;
        returns::<4>(ailment, ill, period, seed)?;
    }

    #[test]
    fn of_two_units_one_is_heard_whatever_befalls_the_other(
        ailments in prop::array::uniform2(ailment()), periods in prop::array::uniform2(period()),
        sound in 0..2_usize, seed in any::<u64>()
    ) {
        speaks(ailments, periods, sound, seed)?;
    }

    #[test]
    fn of_three_units_one_is_heard_whatever_befalls_the_others(
        ailments in prop::array::uniform3(ailment()), periods in prop::array::uniform3(period()),
        sound in 0..3_usize, seed in any::<u64>()
    ) {
        speaks(ailments, periods, sound, seed)?;
    }

    #[test]
    fn of_four_units_one_is_heard_whatever_befalls_the_others(
        ailments in prop::array::uniform4(ailment()), periods in prop::array::uniform4(period()),
        sound in 0..4_usize, seed in any::<u64>()
    ) {
        speaks(ailments, periods, sound, seed)?;
    }

    #[test]
    fn of_five_units_one_is_heard_whatever_befalls_the_others(
        ailments in prop::array::uniform5(ailment()), periods in prop::array::uniform5(period()),
        sound in 0..5_usize, seed in any::<u64>()
    ) {
        speaks(ailments, periods, sound, seed)?;
    }

    #[test]
    fn of_six_units_one_is_heard_whatever_befalls_the_others(
        ailments in prop::array::uniform6(ailment()), periods in prop::array::uniform6(period()),
        sound in 0..6_usize, seed in any::<u64>()
    ) {
        speaks(ailments, periods, sound, seed)?;
    }

    #[test]
    fn of_two_units_that_are_known_one_is_heard(
        ailments in prop::array::uniform2(ailment()), periods in prop::array::uniform2(period()),
        sound in 0..2_usize, seed in any::<u64>()
    ) {
        speaks_as_calibrated(ailments, periods, sound, seed)?;
    }

    #[test]
    fn of_four_units_that_are_known_one_is_heard(
        ailments in prop::array::uniform4(ailment()), periods in prop::array::uniform4(period()),
        sound in 0..4_usize, seed in any::<u64>()
    ) {
        speaks_as_calibrated(ailments, periods, sound, seed)?;
    }
}
