//! Numbers of samples: the count of those that came, and of those that were lost between them.
//!
//! Equations: docs/theory/clocks.md.

use std::collections::VecDeque;

use super::period::Period;

/// Fewest samples, and least time, s, on either side of a loss by which it shows.
const SIDE: usize = 64;
const SIDE_SECONDS: f64 = 5.0;
/// Samples at either end, and bursts, that are too few to show a loss.
const EDGE: usize = 16;
/// Periods by which stamps step up for good where a sample was lost.
const LOSS: f64 = 0.5;
/// Periods by which a step may miss a whole number of them.
const WHOLE: f64 = 0.3;
/// s of a pause beyond which the sensor may have begun again.
const RESTART: f64 = 5.0;

/// Rows from `first_row` on have the number `row + lost`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Loss {
    pub first_row: usize,
    pub lost: u64,
    /// The sensor may have begun again: times before and after are of clocks of their own.
    pub begins: bool,
}

/// Least of each value and the `side - 1` after it.
fn least_ahead(values: &[f64], side: usize) -> Vec<f64> {
    let mut least = vec![0.0; values.len()];
    let mut waiting: VecDeque<usize> = VecDeque::new();
    for (row, &value) in values.iter().enumerate().rev() {
        while waiting.back().is_some_and(|&other| values[other] >= value) {
            waiting.pop_back();
        }
        waiting.push_back(row);
        while waiting.front().is_some_and(|&other| other >= row + side) {
            waiting.pop_front();
        }
        least[row] = values[waiting[0]];
    }
    least
}

/// Finds where stamps step up for good (eq. 10). The first entry is that of row 0.
///
/// `None` where they step down, or by a part of a period that is neither a loss nor a restart.
#[allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss
)]
pub(super) fn losses(stamps: &[f64], period: &Period) -> Option<Vec<Loss>> {
    let step = period.seconds;
    let side = SIDE.max((SIDE_SECONDS / step) as usize);
    let edge = EDGE + (2.0 * period.burst) as usize;
    let delay: Vec<f64> = (stamps.iter().enumerate())
        .map(|(row, stamp)| stamp - stamps[0] - step * row as f64)
        .collect();
    let ahead = least_ahead(&delay, side);
    let mut found = vec![Loss {
        first_row: 0,
        lost: 0,
        begins: true,
    }];
    let mut least: VecDeque<(usize, f64)> = VecDeque::new();
    let (mut lost, mut shift, mut begun) = (0_u64, 0.0, 0_usize);
    for row in 0..delay.len() {
        while least.front().is_some_and(|&(other, _)| other + side < row) {
            least.pop_front();
        }
        if let Some(&(_, behind)) = least
            .front()
            .filter(|_| row >= begun + edge && row + edge < delay.len())
        {
            let up = (ahead[row] - shift - behind) / step; // eq. 10
            if up > LOSS {
                let whole = up.round();
                let begins = stamps[row] - stamps[row - 1] > RESTART;
                if !begins && (up - whole).abs() > WHOLE {
                    return None;
                }
                lost += whole as u64;
                shift += if begins { up * step } else { whole * step };
                found.push(Loss {
                    first_row: row,
                    lost,
                    begins,
                });
                if begins {
                    begun = row;
                    least.clear();
                }
            } else if up < -LOSS {
                return None;
            }
        }
        let value = delay[row] - shift;
        while least.back().is_some_and(|&(_, other)| other >= value) {
            least.pop_back();
        }
        least.push_back((row, value));
    }
    Some(found)
}
