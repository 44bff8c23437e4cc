//! A sample rate that is stated although the log has stamps: the stamps check it (docs/theory/multipose.md, section 8).

use crate::distributions::balanced_median;

/// 1-sigma of the pace of a crystal, relative.
pub const CRYSTAL: f64 = 1e-4;

/// Sigmas of the pace of a crystal by which two rates of one sensor may differ.
const SIGMAS: f64 = 5.0;

/// Ratio of rates from which stamps count another unit: turns show a rate that is so far off (docs/theory/multipose.md,
/// eq. 32).
const OF_ANOTHER_UNIT: f64 = 1.15;

/// Samples whose stamps show a rate.
const FEWEST: usize = 100;

/// Usual steps from which a step holds a missing sample.
const HOLE: f64 = 1.5;

/// Usual steps between which a step is even.
const EVEN: [f64; 2] = [0.75, 1.25];

/// Share of even steps of a log in which a longer step is a hole, and no late stamp.
const MOSTLY: f64 = 0.8;

/// Sample rate of the stamps of a log, beside one that was stated for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampedRate {
    /// Rate that was stated, Hz.
    pub stated: f64,
    /// Mean rate of the log, Hz.
    pub shown: f64,
    /// Samples that are missing between the stamps.
    pub missing: u64,
    /// Largest relative difference of the two that clocks and the ends of the log explain.
    pub tolerance: f64,
}

impl StampedRate {
    /// Compares stamps, s, with the rate that was stated for them, Hz; `None` where they show none, or another unit.
    pub fn of(stamps: &[f64], stated: f64) -> Option<Self> {
        let steps: Vec<_> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let span = stamps.last()? - stamps.first()?;
        let advances = steps.iter().all(|step| step.is_finite() && *step >= 0.0);
        if stamps.len() < FEWEST || !advances || span <= 0.0 {
            return None;
        }
        let usual = balanced_median(&mut steps.clone())?;
        let [low, high] = EVEN.map(|factor| factor * usual);
        #[allow(clippy::cast_precision_loss)]
        let count = steps.len() as f64;
        #[allow(clippy::cast_precision_loss)]
        let even = steps
            .iter()
            .filter(|step| low <= **step && **step <= high)
            .count() as f64;
        let has_holes = even / count > MOSTLY;
        let is_hole = |step: f64| has_holes && step > HOLE * usual;
        let holes = steps.iter().filter(|step| is_hole(**step));
        let missing: f64 = holes.map(|step| (step / usual).round_ties_even() - 1.0).sum();
        if libm::log((count + missing) / span / stated).abs() > libm::log(OF_ANOTHER_UNIT) {
            return None;
        }
        let longest = steps
            .iter()
            .copied()
            .filter(|step| !is_hole(*step))
            .fold(0.0, f64::max);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        Some(Self {
            stated,
            shown: count / span,
            missing: missing as u64,
            // A stamp at either end is known to a step.
            tolerance: SIGMAS * CRYSTAL + longest / span,
        })
    }

    /// True if clocks explain the difference of the rates.
    pub fn agrees(&self) -> bool {
        libm::log(self.shown / self.stated).abs() <= self.tolerance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamps(count: u32) -> Vec<f64> {
        (0..count).map(|k| f64::from(k) * 0.01).collect()
    }

    fn without(share: u32) -> Vec<f64> {
        let kept = (0..4000).filter(|k| *k == 0 || k % share != 0);
        kept.map(|k| f64::from(k) * 0.01).collect()
    }

    #[test]
    fn a_rate_that_the_stamps_show_agrees() {
        let found = StampedRate::of(&stamps(2000), 100.0).expect("a rate");
        assert!(found.agrees(), "{found:?}");
        assert_eq!(found.missing, 0);
        assert!((found.shown - 100.0).abs() < 1e-9);
    }

    #[test]
    fn a_rate_beside_that_of_the_stamps_does_not_agree() {
        for stated in [101.0, 99.0, 100.2] {
            let found = StampedRate::of(&stamps(2000), stated).expect("a rate");
            assert!(!found.agrees(), "{found:?}");
        }
    }

    #[test]
    fn missing_samples_are_counted() {
        let found = StampedRate::of(&without(300), 100.0).expect("a rate");
        assert_eq!(found.missing, 13);
        assert!(!found.agrees(), "{found:?}");
        let found = StampedRate::of(&without(3900), 100.0).expect("a rate");
        assert_eq!((found.missing, found.agrees()), (1, true));
    }

    #[test]
    fn stamps_of_another_unit_or_none_show_no_rate() {
        let mut disordered = stamps(2000);
        disordered.swap(4, 5);
        let mut broken = stamps(2000);
        broken[7] = f64::NAN;
        let coarse: Vec<_> = stamps(2000).iter().map(|stamp| stamp * 3.7).collect();
        for each in [
            &stamps(99),
            &disordered,
            &broken,
            &coarse,
            &vec![1.0; 200],
            &Vec::new(),
        ] {
            assert_eq!(StampedRate::of(each, 100.0), None);
        }
    }

    #[test]
    fn late_stamps_are_no_holes() {
        let late = |k: u32| f64::from(k) * 0.01 + 0.009 * f64::from(k * 7 % 10) / 10.0;
        let found = StampedRate::of(&(0..3000).map(late).collect::<Vec<_>>(), 100.0).expect("a rate");
        assert_eq!((found.missing, found.agrees()), (0, true));
    }
}
