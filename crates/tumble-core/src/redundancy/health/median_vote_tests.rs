use super::*;
use proptest::prelude::*;

fn unit(mean: [f64; CHANNELS], scatter: [f64; 2]) -> UnitMean<f64> {
    UnitMean {
        mean,
        scatter,
        axes: Axes::ALL,
    }
}

fn at(level: f64) -> Option<UnitMean<f64>> {
    Some(unit([level; CHANNELS], [0.1, 0.01]))
}

#[test]
fn two_units_hold_no_vote() {
    assert_eq!(vote(&[at(0.0), at(1.0), None, None]), [[None; 2]; 4]);
}

#[test]
fn the_odd_one_of_three_is_far_from_the_median_and_the_others_are_at_it() {
    let comparisons = vote(&[at(1.0), at(9.0), at(1.0)]);
    let apart = comparisons.map(|sensors| sensors.map(|comparison| comparison.unwrap().apart));
    assert_eq!(apart[0], [0.0; 2]);
    assert_eq!(apart[2], [0.0; 2]);
    assert!(
        apart[1]
            .iter()
            .all(|apart| (apart - 8.0 * 3.0_f64.sqrt()).abs() < 1e-12)
    );
}

#[test]
fn of_four_the_median_lies_between_the_middle_two() {
    let comparisons = vote(&[at(1.0), at(2.0), at(100.0), at(-100.0)]);
    for unit in 0..2 {
        let apart = comparisons[unit][0].unwrap().apart;
        assert!((apart - 0.5 * 3.0_f64.sqrt()).abs() < 1e-12, "{apart}");
    }
}

#[test]
fn scatter_is_compared_with_the_median_scatter() {
    let mut units = [at(0.0); 3];
    units[1] = Some(unit([0.0; CHANNELS], [0.9, 0.01]));
    let comparison = vote(&units)[1][0].unwrap();
    assert_eq!((comparison.scatter, comparison.usual_scatter), (0.9, 0.1));
}

#[test]
fn a_channel_that_fewer_than_three_have_is_not_voted_on() {
    let mut single = unit([50.0; CHANNELS], [0.1, 0.01]);
    single.axes = Axes([false, false, true, false, false, false]);
    let comparisons = vote(&[at(0.0), at(0.0), Some(single)]);
    for unit in 0..3 {
        let expected = if unit == 2 { 50.0 } else { 0.0 };
        assert_eq!(comparisons[unit][0].unwrap().apart, expected, "unit {unit}");
        assert_eq!(comparisons[unit][1], None);
    }
}

#[test]
fn means_that_are_not_numbers_have_no_vote() {
    let bad = Some(unit([f64::NAN; CHANNELS], [f64::INFINITY; 2]));
    let comparisons = vote(&[at(1.0), at(1.0), at(1.0), bad]);
    assert_eq!(comparisons[0][0].unwrap().apart, 0.0);
    assert_eq!(vote(&[at(1.0), at(1.0), bad]), [[None; 2]; 3]);
}

proptest! {
    #[test]
    fn the_median_has_as_many_below_it_as_above(values in prop::collection::vec(-1e3..1e3_f64, 8)) {
        let units: [_; 8] = core::array::from_fn(|i| at(values[i]));
        let found = median(&units, |unit| Some(unit.mean[0])).unwrap();
        let below = values.iter().filter(|x| **x < found).count();
        let above = values.iter().filter(|x| **x > found).count();
        prop_assert!(below <= 4 && above <= 4, "{found} {values:?}");
    }

    #[test]
    fn nobody_is_moved_by_less_than_half_that_lie(
        truth in prop::array::uniform6(-50.0..50.0_f64), lies in prop::collection::vec(prop::num::f64::ANY, 3)
    ) {
        let units: [_; 7] = core::array::from_fn(|i| {
            Some(unit(lies.get(i).map_or(truth, |lie| [*lie; CHANNELS]), [0.1, 0.01]))
        });
        for unit in 3..7 {
            prop_assert!(vote(&units)[unit].iter().all(|comparison| comparison.unwrap().apart == 0.0));
        }
    }
}

#[test]
fn where_all_are_at_odds_each_is_about_as_far_from_the_median_as_is_usual() {
    let comparisons = vote(&[at(1.0), at(4.0), at(-3.0), at(8.0), at(-7.0)]);
    let usual = comparisons[0][0].unwrap().usual_apart;
    for comparison in comparisons {
        assert!(comparison[0].unwrap().apart <= 2.01 * usual);
    }
}

#[test]
fn the_odd_one_among_units_that_agree_is_many_times_as_far_as_is_usual() {
    let comparisons = vote(&[at(1.0), at(1.01), at(9.0)]);
    let odd = comparisons[2][0].unwrap();
    assert!(odd.apart > 100.0 * odd.usual_apart, "{odd:?}");
}

#[test]
fn a_unit_whose_means_are_not_known_is_still_compared_by_its_scatter() {
    let unknown = Some(unit([f64::NAN; CHANNELS], [0.9, 0.01]));
    let comparisons = vote(&[at(1.0), at(1.0), unknown]);
    assert_eq!(comparisons[2][0].unwrap().scatter, 0.9);
    assert!(comparisons[2][0].unwrap().apart.is_nan());
}
