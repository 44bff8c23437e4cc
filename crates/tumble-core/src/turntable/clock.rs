//! Which rest of the target is which of the reference, when their clocks differ.
//!
//! Both units feel the same turns. The centre of a turn in time, weighted by the angular rate along it, is the same
//! for both however they are mounted, and free of bias; the differences of the centres are offset and skew.

use crate::noise::Noise;
use crate::real::{Real, real};
use crate::regression::{LeastSquares, Prior, Unsolvable, reduced};
use nalgebra::{Matrix2, Vector2};

/// A turn as one unit felt it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnMark<T: Real> {
    /// Centre, s on the clock of the unit.
    pub centre: T,
    /// 1-sigma of the centre, s.
    pub sigma: T,
    /// Whole angle, rad.
    pub angle: T,
}

/// 1-sigma of the centre of a turn of `duration` s through `angle` rad: white noise of density N on the rate moves
/// it by `N T^(3/2) / (sqrt(12) angle)` (docs/theory/turntable.md, eq. 17).
pub fn centre_sigma<T: Real>(noise: &Noise<T>, duration: T, angle: T) -> T {
    let drift = noise.flicker * duration;
    ((noise.white + drift) * duration * duration * duration / real(12.0)).square_root() / angle // eq. 17
}

/// `t_target = t_reference + offset + skew (t_reference - epoch)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockFit<T: Real> {
    /// s, at the epoch.
    pub offset: T,
    /// Without unit.
    pub skew: T,
    /// Mean of the centres used, s on the reference's clock, where offset and skew are independent.
    pub epoch: T,
    /// Covariance of `[offset, skew]`.
    pub covariance: Matrix2<T>,
    /// Turns used.
    pub turns: u32,
}

impl<T: Real> ClockFit<T> {
    /// One clock for both, ahead by a known offset, s.
    pub fn known(offset: T) -> Self {
        Self {
            offset,
            skew: T::zero(),
            epoch: T::zero(),
            covariance: Matrix2::zeros(),
            turns: 0,
        }
    }

    /// Offset at time `t` of the reference's clock, s, and its 1-sigma.
    pub fn offset_at(&self, t: T) -> (T, T) {
        let later = t - self.epoch;
        let by = Vector2::new(T::one(), later);
        let variance = by.dot(&(self.covariance * by));
        (self.offset + self.skew * later, variance.square_root())
    }

    /// Time of the reference at time `t` of the target's clock.
    pub fn to_reference(&self, t: T) -> T {
        self.epoch + (t - self.offset - self.epoch) / (T::one() + self.skew)
    }
}

/// Farthest the centres of one turn may be apart once the offset is right, s.
const TOLERANCE: f64 = 0.5;

/// Largest plausible skew between two clocks: a thousand ppm, the worst of oscillators.
pub const LARGEST_SKEW: f64 = 1e-3;

/// Tests whether two marks can be one turn: the angles agree within what scale errors of low-grade units explain.
fn alike<T: Real>(a: &TurnMark<T>, b: &TurnMark<T>) -> bool {
    (a.angle - b.angle).abs() <= real::<T>(0.1) * a.angle.max(b.angle) + real(0.05)
}

/// The mark of the target that belongs to `mark` under an offset and skew.
fn partner<'a, T: Real>(
    mark: &TurnMark<T>,
    targets: &'a [TurnMark<T>],
    expected: T,
    tolerance: T,
) -> Option<&'a TurnMark<T>> {
    targets
        .iter()
        .filter(|target| (target.centre - expected).abs() <= tolerance && alike(mark, target))
        .min_by(|a, b| {
            let (a, b) = ((a.centre - expected).abs(), (b.centre - expected).abs());
            a.partial_cmp(&b).unwrap_or(core::cmp::Ordering::Equal)
        })
}

/// Number of turns explained by an offset, and the sum of what the centres are apart.
fn score<T: Real>(reference: &[TurnMark<T>], target: &[TurnMark<T>], offset: T, anchor: T) -> (u32, T) {
    reference.iter().fold((0, T::zero()), |(turns, apart), mark| {
        let expected = mark.centre + offset;
        let tolerance = real::<T>(TOLERANCE) + (mark.centre - anchor).abs() * real(LARGEST_SKEW);
        match partner(mark, target, expected, tolerance) {
            Some(found) => (turns + 1, apart + (found.centre - expected).abs()),
            None => (turns, apart),
        }
    })
}

/// The offset under which most turns of one unit meet a turn of the other; of equals, the one that fits best.
/// `None` where fewer than two turns (or all there are) can be matched.
pub fn search_offset<T: Real>(reference: &[TurnMark<T>], target: &[TurnMark<T>]) -> Option<T> {
    let mut best: Option<(u32, T, T)> = None;
    for a in reference {
        for b in target.iter().filter(|b| alike(a, b)) {
            let offset = b.centre - a.centre;
            let (turns, apart) = score(reference, target, offset, a.centre);
            let better = best.is_none_or(|(most, least, _)| turns > most || (turns == most && apart < least));
            if better {
                best = Some((turns, apart, offset));
            }
        }
    }
    let fewest = u32::try_from(reference.len().min(target.len()).min(2)).unwrap_or(2);
    best.filter(|(turns, _, _)| *turns >= fewest.max(1))
        .map(|(_, _, offset)| offset)
}

/// Number of turns of one unit that meet one of the other under an offset, s.
pub fn turns_met<T: Real>(reference: &[TurnMark<T>], target: &[TurnMark<T>], offset: T) -> u32 {
    score(reference, target, offset, T::zero()).0
}

/// Offset and skew by weighted least squares over the turns that meet under a first offset.
///
/// # Errors
/// [`Unsolvable`] if no turn meets, or a mark is not finite.
pub fn fit_clock<T: Real>(
    reference: &[TurnMark<T>],
    target: &[TurnMark<T>],
    first_offset: T,
) -> Result<ClockFit<T>, Unsolvable> {
    let met = || {
        reference
            .iter()
            .filter_map(|mark| meeting(mark, target, first_offset))
    };
    let (weight, moment) = met().fold((T::zero(), T::zero()), |(w, m), turn| {
        (w + T::one() / turn.variance, m + turn.time / turn.variance)
    });
    if weight <= T::zero() {
        return Err(Unsolvable);
    }
    let epoch = moment / weight; // eq. 18: t_0
    let skew = real::<T>(LARGEST_SKEW);
    let prior = Prior {
        mean: Vector2::zeros(),
        covariance: Matrix2::from_diagonal(&Vector2::new(real(1e4), skew * skew)),
    };
    let mut equations = LeastSquares::<T, 2>::new(&prior);
    for turn in met() {
        let row = Vector2::new(T::one(), turn.time - epoch); // eq. 18: [o, gamma]
        equations.push(&row, turn.apart, turn.variance);
    }
    let solution = equations.solve()?;
    let excess = reduced(solution.chi_square, solution.rows.saturating_sub(2)).max(T::one());
    Ok(ClockFit {
        offset: first_offset + solution.x[0],
        skew: solution.x[1],
        epoch,
        covariance: solution.covariance * excess,
        turns: solution.rows,
    })
}

/// A turn both units felt.
struct MetTurn<T> {
    /// Centre on the clock of the reference, s.
    time: T,
    /// Centre on the clock of the target, less that and the first offset, s.
    apart: T,
    /// Variance of `apart`, s^2.
    variance: T,
}

/// The turn of the target that meets one of the reference under a first offset.
fn meeting<T: Real>(mark: &TurnMark<T>, target: &[TurnMark<T>], first_offset: T) -> Option<MetTurn<T>> {
    let tolerance = real::<T>(TOLERANCE) + mark.centre.abs() * real(LARGEST_SKEW);
    partner(mark, target, mark.centre + first_offset, tolerance).map(|found| MetTurn {
        time: mark.centre,
        apart: found.centre - mark.centre - first_offset,
        variance: mark.sigma * mark.sigma + found.sigma * found.sigma,
    })
}
