extern crate std;

use std::vec::Vec;

use proptest::prelude::*;

use super::*;

#[test]
fn slow_units_between_others_are_in_time_from_sample_three() {
    for phase in [1_000, 30_000, 55_000, 70_000, 95_000_u64] {
        let mut clock = CommonClock::<2>::new();
        let mut used = [0_u32; 2];
        for i in 0..100_u64 {
            for (unit, begins) in [(0, 0), (1, phase)] {
                let time = 1_000_000 + i * 100_000 + begins;
                let accepted = clock.push(unit, time, &ClockSettings::DEFAULT) == TimestampDecision::Accept;
                used[unit] += u32::from(accepted);
            }
        }
        assert!(used.iter().all(|used| *used >= 98), "{phase}: {used:?}");
    }
}

const PERIOD: u64 = 5_000;

/// Set of units that send in turn, each with an offset of its clock.
struct Set<const UNITS: usize> {
    clock: CommonClock<UNITS>,
    settings: ClockSettings,
    true_time: u64,
}

impl<const UNITS: usize> Set<UNITS> {
    /// Set that has run for a second.
    fn running() -> Self {
        let mut set = Self {
            clock: CommonClock::new(),
            settings: ClockSettings::default(),
            true_time: 3_000_000_000,
        };
        for verdicts in set.run(1_000_000, [0; UNITS]) {
            assert_eq!(verdicts, [TimestampDecision::Accept; UNITS]);
        }
        set
    }

    fn push(&mut self, unit: usize, time: u64) -> TimestampDecision {
        self.clock.push(unit, time, &self.settings)
    }

    fn run(&mut self, length: u64, offsets: [i64; UNITS]) -> Vec<[TimestampDecision; UNITS]> {
        let rounds = length / PERIOD;
        (0..rounds)
            .map(|_| {
                self.true_time += PERIOD;
                core::array::from_fn(|unit| {
                    let skew = i64::try_from(unit).unwrap() * 300;
                    self.push(unit, self.true_time.saturating_add_signed(offsets[unit] + skew))
                })
            })
            .collect()
    }
}

fn jumps<const UNITS: usize>(verdicts: &[[TimestampDecision; UNITS]]) -> Vec<i64> {
    let jump = |verdict: &TimestampDecision| match verdict {
        TimestampDecision::Jumped { by } => Some(*by),
        _ => None,
    };
    verdicts.iter().flatten().filter_map(jump).collect()
}

fn of_unit<const UNITS: usize>(
    verdicts: &[[TimestampDecision; UNITS]],
    unit: usize,
) -> Vec<TimestampDecision> {
    verdicts.iter().map(|verdicts| verdicts[unit]).collect()
}

#[test]
fn one_time_far_ahead_is_dropped_and_nobody_else_looks_late() {
    for corrupted in [u64::MAX, 4_000_000_000, 3_002_500_000, 3_001_100_000] {
        let mut set = Set::<3>::running();
        let now = set.clock.now();
        assert_eq!(set.push(1, corrupted), TimestampDecision::Drop);
        assert_eq!(set.clock.now(), now);
        for verdicts in set.run(1_000_000, [0; 3]) {
            assert_eq!(verdicts, [TimestampDecision::Accept; 3], "after {corrupted}");
        }
    }
}

#[test]
fn a_corrupted_time_is_dropped_from_a_unit_alone_too() {
    let mut set = Set::<1>::running();
    assert_eq!(set.push(0, u64::MAX), TimestampDecision::Drop);
    assert_eq!(set.push(0, 0), TimestampDecision::Drop);
    assert_eq!(jumps(&set.run(1_000_000, [0])), [0_i64; 0]);
}

#[test]
fn samples_that_are_not_later_are_dropped() {
    let mut set = Set::<2>::running();
    let latest = set.clock.now().unwrap();
    assert_eq!(set.push(1, latest), TimestampDecision::Drop);
    assert_eq!(set.push(1, latest - 1), TimestampDecision::Drop);
    assert_eq!(set.push(1, latest + 1), TimestampDecision::Accept);
}

fn jump_together<const UNITS: usize>(by: i64) {
    let mut set = Set::<UNITS>::running();
    let verdicts = set.run(1_000_000, [by; UNITS]);
    let found = jumps(&verdicts);
    assert!(
        matches!(found[..], [found] if found.abs_diff(by) < 250_000),
        "{by}: {found:?}"
    );
    assert_eq!(verdicts[10..], [[TimestampDecision::Accept; UNITS]; 190], "{by}");
    let astray = verdicts
        .iter()
        .flatten()
        .any(|verdict| *verdict == TimestampDecision::Astray);
    assert!(!astray, "{by}");
}

#[test]
fn when_all_jump_the_set_jumps_once_either_way() {
    for by in [-2_000_000_000, -700_000, 2_000_000, 2_000_000_000_000] {
        jump_together::<2>(by);
        jump_together::<3>(by);
        jump_together::<8>(by);
    }
}

#[test]
fn a_unit_alone_that_jumps_is_followed_within_its_proof() {
    for by in [-2_000_000_000, -400_000, 2_000_000] {
        let mut set = Set::<1>::running();
        let verdicts = set.run(300_000, [by]);
        let found = jumps(&verdicts);
        assert!(
            matches!(found[..], [found] if found.abs_diff(by) <= 255_000),
            "{by}: {found:?}"
        );
    }
}

fn leave_and_come_back<const UNITS: usize>(by: i64) {
    let mut set = Set::<UNITS>::running();
    let last = UNITS - 1;
    let mut offsets = [0; UNITS];
    offsets[last] = by;
    let astray = set.run(500_000, offsets);
    assert!(jumps(&astray).is_empty(), "{by}");
    for unit in 0..last {
        assert_eq!(of_unit(&astray, unit), [TimestampDecision::Accept; 100], "{by}");
    }
    assert_eq!(
        of_unit(&astray, last)[20..],
        [TimestampDecision::Astray; 80],
        "{by}"
    );
    let back = set.run(500_000, [0; UNITS]);
    assert_eq!(of_unit(&back, last), [TimestampDecision::Accept; 100], "{by}");
}

#[test]
fn one_clock_that_leaves_the_others_is_reported_until_back() {
    for by in [-2_000_000_000, -600_000, 2_000_000] {
        leave_and_come_back::<2>(by);
        leave_and_come_back::<3>(by);
        leave_and_come_back::<8>(by);
    }
}

#[test]
fn the_few_that_jump_alike_follow_the_many_that_stay() {
    for by in [-2_000_000_000, 2_000_000] {
        let mut set = Set::<5>::running();
        let verdicts = set.run(500_000, [by, by, 0, 0, 0]);
        assert!(jumps(&verdicts).is_empty(), "{by}");
        let settled = &verdicts[20..];
        for unit in 0..5 {
            let expected = if unit < 2 {
                TimestampDecision::Astray
            } else {
                TimestampDecision::Accept
            };
            assert_eq!(of_unit(settled, unit), [expected; 80], "{by}, unit {unit}");
        }
    }
}

#[test]
fn the_many_that_jump_alike_take_the_set_with_them() {
    for by in [-2_000_000_000, 2_000_000] {
        let mut set = Set::<5>::running();
        let verdicts = set.run(500_000, [0, 0, by, by, by]);
        assert_eq!(jumps(&verdicts).len(), 1, "{by}");
        for unit in 0..5 {
            let expected = if unit < 2 {
                TimestampDecision::Astray
            } else {
                TimestampDecision::Accept
            };
            assert_eq!(
                of_unit(&verdicts[20..], unit),
                [expected; 80],
                "{by}, unit {unit}"
            );
        }
    }
}

#[test]
fn a_clock_that_stands_is_reported() {
    let mut set = Set::<1>::running();
    let time = set.clock.now().unwrap();
    let verdicts: Vec<_> = (0..10).map(|_| set.push(0, time)).collect();
    assert_eq!(verdicts[..4], [TimestampDecision::Drop; 4]);
    assert_eq!(verdicts[4..], [TimestampDecision::Astray; 6]);
}

#[test]
fn a_first_time_that_was_corrupted_is_left_again() {
    for corrupted in [0, u64::MAX] {
        let mut set = Set::<2> {
            clock: CommonClock::new(),
            settings: ClockSettings::default(),
            true_time: 3_000_000_000,
        };
        assert_eq!(set.push(0, corrupted), TimestampDecision::Accept);
        let verdicts = set.run(1_000_000, [0; 2]);
        assert_eq!(jumps(&verdicts).len(), 1, "{corrupted}");
        assert_eq!(
            verdicts.last(),
            Some(&[TimestampDecision::Accept; 2]),
            "{corrupted}"
        );
    }
}

#[test]
fn old_samples_delivered_late_move_nothing() {
    let mut set = Set::<3>::running();
    let now = set.clock.now().unwrap();
    for back in [40_000, 30_000, 20_000] {
        for unit in 0..2 {
            assert_eq!(set.push(unit, now - back), TimestampDecision::Drop);
        }
    }
    assert!(jumps(&set.run(500_000, [0; 3])).is_empty());
}

#[test]
fn a_set_whose_other_units_died_follows_the_one_that_is_left() {
    let mut set = Set::<2>::running();
    let start = set.true_time + 3_000_000;
    let verdicts: Vec<_> = (0..100).map(|i| [set.push(0, start + i * PERIOD)]).collect();
    assert_eq!(jumps(&verdicts).len(), 1);
}

#[test]
fn after_a_pause_of_all_the_set_goes_on_without_a_jump() {
    let mut set = Set::<3>::running();
    set.true_time += 400_000;
    let verdicts = set.run(100_000, [0; 3]);
    assert!(jumps(&verdicts).is_empty());
    assert_eq!(verdicts[1..], [[TimestampDecision::Accept; 3]; 19]);
    let mut alone = Set::<1>::running();
    alone.true_time += 400_000;
    let verdicts = alone.run(100_000, [0]);
    assert_eq!(verdicts[1..], [[TimestampDecision::Accept]; 19]);
}

#[test]
fn one_unit_that_leaps_while_others_go_on_is_astray() {
    let mut set = Set::<2>::running();
    let verdicts = set.run(300_000, [0, 400_000]);
    assert_eq!(of_unit(&verdicts, 0), [TimestampDecision::Accept; 60]);
    assert_eq!(of_unit(&verdicts, 1)[5..], [TimestampDecision::Astray; 55]);
}

#[test]
fn a_slow_unit_alone_loses_one_sample_for_its_interval() {
    let mut clock = CommonClock::<1>::new();
    let verdicts: Vec<_> = (0..50)
        .map(|i| clock.push(0, i * 200_000, &ClockSettings::default()))
        .collect();
    assert_eq!(verdicts[1], TimestampDecision::Drop);
    assert_eq!(verdicts[2..], [TimestampDecision::Accept; 48]);
}

#[test]
fn an_aiding_of_an_unknown_unit_is_rejected() {
    let mut clock = CommonClock::<2>::new();
    assert_eq!(
        clock.push(2, 5, &ClockSettings::default()),
        TimestampDecision::Drop
    );
    assert_eq!(clock.now(), None);
}

#[test]
fn a_counter_wraps_in_and_out_of_order() {
    let mut unwrapper = Unwrapper::new();
    let wrap = 1_u64 << 32;
    let times =
        [u32::MAX - 10, 5, u32::MAX - 2, 7, 6, 2_000_000_000].map(|counter| unwrapper.extend(counter));
    assert_eq!(
        times,
        [
            wrap - 11,
            wrap + 5,
            wrap - 3,
            wrap + 7,
            wrap + 6,
            wrap + 2_000_000_000
        ]
    );
}

proptest! {
    #[test]
    fn an_unwrapped_counter_is_the_true_time_however_long_it_runs(
        start in 0..u64::from(u32::MAX), steps in prop::collection::vec(-1_000_i64..40_000_000, 0..500)
    ) {
        let mut unwrapper = Unwrapper::new();
        let mut time = start + 2_000;
        unwrapper.extend(u32::try_from(time & 0xffff_ffff).unwrap());
        let whole = time & !0xffff_ffff;
        for step in steps {
            time = time.saturating_add_signed(step);
            prop_assert_eq!(unwrapper.extend(u32::try_from(time & 0xffff_ffff).unwrap()), time - whole);
        }
    }

    #[test]
    fn clocks_of_a_minority_do_not_move_the_time_of_the_set(
        wild in prop::collection::vec(prop::array::uniform2((0..5_u8, any::<u64>())), 1..200)
    ) {
        let mut set = Set::<5>::running();
        let start = set.true_time;
        for strays in wild {
            set.true_time += PERIOD;
            for unit in 0..3 {
                prop_assert_eq!(set.push(unit, set.true_time), TimestampDecision::Accept);
            }
            for (unit, (kind, any)) in (3..).zip(strays) {
                let stray = match kind {
                    0 => 0,
                    1 => u64::MAX,
                    2 => any,
                    3 => set.true_time + 60_000 + any % 1_500_000,
                    _ => start - any % 1_500_000,
                };
                let verdict = set.push(unit, stray);
                let jumped = matches!(verdict, TimestampDecision::Jumped { .. });
                prop_assert!(!jumped, "to {stray} at {}", set.true_time);
            }
            prop_assert_eq!(set.clock.now(), Some(set.true_time));
        }
    }

    #[test]
    fn no_times_whatever_make_it_panic_or_accept_what_is_not_later(
        times in prop::collection::vec((0_usize..4, prop_oneof![
            Just(0_u64), Just(u64::MAX), any::<u64>(), 0..3_000_000_u64, u64::MAX - 3_000_000..u64::MAX
        ]), 0..300)
    ) {
        let mut clock = CommonClock::<3>::new();
        let mut latest = [None; 4];
        for (unit, time) in times {
            match clock.push(unit, time, &ClockSettings::default()) {
                TimestampDecision::Accept => {
                    prop_assert!(latest[unit] < Some(time), "{latest:?} {time}");
                    latest[unit] = Some(time);
                }
                TimestampDecision::Jumped { .. } => {
                    latest = [None; 4];
                    latest[unit] = Some(time);
                    prop_assert_eq!(clock.now(), Some(time));
                }
                TimestampDecision::Drop | TimestampDecision::Astray => {}
            }
            prop_assert!(latest.iter().max() <= Some(&clock.now()));
        }
    }
}

#[test]
fn one_clock_that_leaps_leads_no_other_within_bursts() {
    let mut set = Set::<3>::running();
    let settings = set.settings;
    let start = set.true_time;
    // Frames of 20 ms hold four samples of each unit, one unit after the other; unit 1 is 0.3 s ahead from now
    // on.
    for frame in 0..100 {
        for unit in 0..3 {
            for sample in 1..=4 {
                let ahead = if unit == 1 { 300_000 } else { 0 };
                let time = start + (4 * frame + sample) * PERIOD + ahead;
                let verdict = set.clock.push(unit, time, &settings);
                assert_eq!(
                    verdict == TimestampDecision::Accept,
                    unit != 1,
                    "frame {frame}, unit {unit}"
                );
            }
        }
    }
}

#[test]
fn one_fast_clock_that_leaps_beside_a_slow_one_takes_it_nowhere() {
    let mut clock = CommonClock::<2>::new();
    let settings = ClockSettings::default();
    for i in 0..20_000_u64 {
        let time = 1_000_000 + i * 1000;
        let ahead = if i > 2000 { 500_000 } else { 0 };
        let fast = clock.push(1, time + ahead, &settings);
        assert_eq!(fast == TimestampDecision::Accept, i <= 2000, "sample {i}");
        if i % 10 == 0 {
            assert_eq!(
                clock.push(0, time, &settings),
                TimestampDecision::Accept,
                "sample {i}"
            );
        }
    }
}

#[test]
fn of_units_that_sample_ten_times_a_second_no_sample_is_lost() {
    for phase in [300, 20_000, 45_000] {
        let mut clock = CommonClock::<3>::new();
        let settings = ClockSettings::default();
        for sample in 0..50_u64 {
            for unit in 0..3 {
                let time = 3_000_000_000 + sample * 100_000 + unit * phase;
                let verdict = clock.push(usize::try_from(unit).unwrap(), time, &settings);
                // The first samples show the interval; until then one may seem to leap.
                assert!(
                    verdict == TimestampDecision::Accept || sample < 3,
                    "sample {sample} of unit {unit}, phase {phase}: {verdict:?}"
                );
            }
        }
        for unit in 0..3 {
            assert_eq!(clock.interval(unit), 100_000);
        }
    }
}

#[test]
fn a_pause_leaves_what_is_known_of_how_far_samples_are_apart() {
    let mut set = Set::<2>::running();
    set.true_time += 400_000;
    set.run(100_000, [0; 2]);
    for unit in 0..2 {
        assert_eq!(u64::from(set.clock.interval(unit)), PERIOD);
    }
}
