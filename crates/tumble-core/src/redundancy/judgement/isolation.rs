//! Three units and more: the one without which the others agree.

use crate::real::{Real, real};

/// The rest agrees without the guilty one if no pair of it is beyond this share of its threshold.
const REST_AGREES: f64 = 0.8;

/// And by so much better than without any other.
const BETTER: f64 = 0.6;

/// Successive windows, over each scale, that name the same unit before it is believed.
pub const DWELL: [u8; 4] = [3, 3, 8, 20];

/// What all pairs together say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// No pair disagrees.
    Agreement,
    /// Without this unit, all agree.
    Odd(u8),
    /// Pairs disagree, and more than one unit may be the reason; these two the most.
    Ambiguous(u8, u8),
}

/// Finds the odd one among voters. `squared` gives the square of how far each pair of two different voters is apart, over what it may be
/// (docs/theory/judgement.md, eq. 9 and 10).
pub fn isolate<T: Real, const UNITS: usize>(
    voters: &[bool; UNITS],
    squared: impl Fn(usize, usize) -> Option<T>,
) -> Finding {
    let (mut worst, mut worst_pair) = (T::zero(), (0, 0));
    let mut without = [T::zero(); UNITS];
    for j in 1..UNITS {
        for i in 0..j {
            if !is_in(voters, i) || !is_in(voters, j) {
                continue;
            }
            let Some(ratio) = squared(i, j) else { continue };
            if ratio > worst {
                (worst, worst_pair) = (ratio, (i, j));
            }
            for (unit, most) in without.iter_mut().enumerate() {
                if unit != i && unit != j {
                    *most = most.max(ratio); // eq. 9
                }
            }
        }
    }
    if worst <= T::one() {
        return Finding::Agreement;
    }
    let ambiguous = Finding::Ambiguous(number(worst_pair.0), number(worst_pair.1));
    if voters.iter().filter(|voter| **voter).count() < 3 {
        return ambiguous;
    }
    let mut ranked = voters
        .iter()
        .zip(&without)
        .enumerate()
        .filter(|(_, (voter, _))| **voter);
    let Some((mut best, (_, first))) = ranked.next() else {
        return ambiguous;
    };
    let (mut least, mut second) = (*first, real::<T>(f64::INFINITY));
    for (unit, (_, most)) in ranked {
        if *most < least {
            (best, second, least) = (unit, least, *most);
        } else {
            second = second.min(*most);
        }
    }
    if least < real(REST_AGREES * REST_AGREES) && least < second * real(BETTER * BETTER) {
        Finding::Odd(number(best)) // eq. 10
    } else {
        ambiguous
    }
}

/// Units are fewer than fit a byte.
fn number(unit: usize) -> u8 {
    u8::try_from(unit).unwrap_or(u8::MAX)
}

fn is_in<const UNITS: usize>(voters: &[bool; UNITS], unit: usize) -> bool {
    voters.get(unit).copied().unwrap_or(false)
}
