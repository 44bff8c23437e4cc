//! Rests that disagree with the others beyond chance, any number of them.

use crate::distributions::f_tail;
use crate::turntable::widening;

/// Chance of finding a rest where all agree.
const FALSE_ALARM: f64 = 1e-3;

/// Most rests that are left out: one in so many, and so many at all, as each step tries every rest.
const ONE_IN: usize = 3;
const MOST: usize = 8;

/// Sum of squared residuals of some rests, and its degrees of freedom.
pub(super) type Misfit = (f64, u32);

/// Places of the rests without which the others agree: at each step goes the one whose loss leaves least, and the number of them
/// is that which chance explains least (docs/theory/turntable.md, eq. 49). Each rest has so many `components`, and `misfit` gives
/// that of a fit to some rests; `None` where these do not suffice.
pub(super) fn disagreeing(
    count: usize,
    components: u32,
    misfit: impl Fn(&[usize]) -> Option<Misfit>,
) -> Vec<usize> {
    let mut kept: Vec<usize> = (0..count).collect();
    let Some((whole, freedom)) = misfit(&kept) else {
        return Vec::new();
    };
    if widening(whole, freedom) <= 1.0 {
        return Vec::new();
    }
    let (mut gone, mut best) = (Vec::new(), (FALSE_ALARM, Vec::new()));
    while gone.len() < (count / ONE_IN).min(MOST) {
        let without = |place: usize| {
            let mut others = kept.clone();
            let rest = others.remove(place);
            misfit(&others).map(|found| (rest, others, found))
        };
        let tried = (0..kept.len()).filter_map(without);
        let Some((rest, others, (left, freedom))) = tried.min_by(|a, b| a.2.0.total_cmp(&b.2.0)) else {
            break;
        };
        gone.push(rest);
        kept = others;
        let chance = chance_of(count, gone.len(), components, whole - left, (left, freedom));
        if chance < best.0 {
            best = (chance, gone.clone());
        }
    }
    best.1.sort_unstable();
    best.1
}

/// Chance that noise makes any set of so many rests explain as much, whichever the number.
fn chance_of(count: usize, gone: usize, components: u32, explained: f64, left: Misfit) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let (all, many) = (count as f64, gone as f64);
    #[allow(clippy::cast_precision_loss)]
    let sets: f64 = (0..gone).map(|k| (all - k as f64) / (k as f64 + 1.0)).product();
    let (first, second) = (many * f64::from(components), f64::from(left.1));
    if second <= 0.0 {
        return 1.0;
    }
    let ratio = explained.max(0.0) / first / (left.0 / second).max(f64::MIN_POSITIVE);
    all * sets * f_tail(ratio, first, second) // eq. 49
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_that_disagree_are_found_and_none_among_alike() {
        // Deviations from zero, which nothing is fitted to.
        let misfit = |deviations: [f64; 12]| {
            move |kept: &[usize]| {
                let squares = kept.iter().map(|k| deviations[*k].powi(2)).sum();
                Some((squares, u32::try_from(kept.len()).ok()?))
            }
        };
        let mut deviations = [1.1, -0.6, 0.8, -1.3, 0.4, 1.0, -0.9, 0.7, -0.3, 1.2, -1.0, 0.5];
        assert!(disagreeing(12, 1, misfit(deviations)).is_empty());
        deviations[3] = 30.0;
        deviations[7] = -25.0;
        assert_eq!(disagreeing(12, 1, misfit(deviations)), [3, 7]);
    }
}
