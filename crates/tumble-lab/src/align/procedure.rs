//! From the samples of two units to how they sit beside each other: coarse, then rates, then forces.

use std::f64::consts::PI;

use nalgebra::{Matrix2, Vector2, Vector3};

use crate::align::coarse::{self, Shift};
use crate::align::error::AlignError;
use crate::align::forces::{self, Averaged, ForcesFit, OF_PRIORS};
use crate::align::gravity;
use crate::align::grid::{Grid, RelativeClock, TrianglePair, edges, whole};
use crate::align::rates::{self, RatesFit};
use crate::align::samples::{UnitSamples, WindowMoments, force_of, rate_of};
use crate::align::settings::AlignSettings;
use crate::distributions::chi_square_tail;

/// Alignment of two units.
#[derive(Clone, Debug)]
pub struct Aligned {
    /// Best correlation of their rates: 1 where both feel one motion.
    pub correlation: f64,
    /// Root mean square rate less its mean, rad/s.
    pub motion: f64,
    /// Length of a window, s.
    pub window: f64,
    /// True if the rates left the rotation open about an axis, and the specific forces showed it there.
    pub completed: bool,
    /// Factor on all variances, because the specific forces ask for angles, scales or delays that no sound units have.
    pub widened: f64,
    /// From the rates.
    pub rates: RatesFit,
    /// Largest jump of the offset from part to part of the motion, where no line leads through their clocks, s.
    pub jumped: Option<f64>,
    /// From the specific forces, where the rotation is known.
    pub forces: Option<ForcesFit>,
}

impl Aligned {
    /// Sum of the variances of the lever arm, m^2, and of the rotation, rad^2, at a tenth of a metre.
    fn uncertainty(&self) -> f64 {
        let of_arm = self
            .forces
            .as_ref()
            .map(|forces| forces.lever_arm_covariance.trace());
        of_arm.unwrap_or(f64::MAX) + 0.01 * self.rates.rotation_covariance.trace()
    }

    /// The gain of an axis is that of its readings on what the rotation makes of the primary's rates, about both means.
    fn refuse_if_an_axis_changed(&self) -> Result<(), AlignError> {
        let pairs = &self.rates.pairs;
        let noise = self.rates.scale * self.rates.scale;
        for part in pairs.chunks(pairs.len().div_ceil(PARTS).max(1)) {
            for axis in 0..3 {
                let expected =
                    |pair: &TrianglePair| (self.rates.rotation * rate_of(&pair.primary.mean))[axis];
                let read = |pair: &TrianglePair| rate_of(&pair.secondary.mean)[axis];
                #[allow(clippy::cast_precision_loss)]
                let mean =
                    |of: &dyn Fn(&TrianglePair) -> f64| part.iter().map(of).sum::<f64>() / part.len() as f64;
                let (theirs, ours) = (mean(&expected), mean(&read));
                let energy: f64 = part.iter().map(|pair| (expected(pair) - theirs).powi(2)).sum();
                let shared: f64 = part
                    .iter()
                    .map(|pair| (expected(pair) - theirs) * (read(pair) - ours))
                    .sum();
                let gain = shared / energy; // eq. 18
                #[allow(clippy::cast_precision_loss)]
                let clear = energy > MOVED * noise * part.len() as f64
                    && energy > (LEAST_MOTION * LEAST_MOTION) * part.len() as f64;
                if clear && (gain - 1.0).abs() > LARGEST_CHANGE {
                    #[allow(clippy::cast_precision_loss)]
                    let axis = axis as f64;
                    let since = |pair: &TrianglePair| pair.time - pairs[0].time;
                    let (start, end) = (since(&part[0]), since(&part[part.len() - 1]));
                    return Err(AlignError::AxisChanged {
                        axis,
                        gain,
                        start,
                        end,
                    });
                }
            }
        }
        Ok(())
    }

    fn refuse_if_forces_disagree(&self) -> Result<(), AlignError> {
        let Some(forces) = &self.forces else { return Ok(()) };
        let felt = || self.rates.pairs.iter().map(|pair| force_of(&pair.secondary.mean));
        #[allow(clippy::cast_precision_loss)]
        let share = 1.0 / self.rates.pairs.len().max(1) as f64;
        let mean = felt().sum::<Vector3<f64>>() * share;
        let spread = (felt().map(|f| (f - mean).norm_squared()).sum::<f64>() * share / 3.0).sqrt();
        if forces.scale > LARGEST_RESIDUAL && forces.scale > LARGEST_RESIDUAL_SHARE * spread {
            return Err(AlignError::ForcesDisagree { apart: forces.scale });
        }
        Ok(())
    }
}

/// Root mean square rate, rad/s, below which there was no motion to speak of: drift of biases turns as fast.
pub const LEAST_MOTION: f64 = 0.02;
/// Correlation below which two units do not feel one motion.
pub const LEAST_CORRELATION: f64 = 0.7;
/// Ratio of the rates of two units that no scale error explains.
const LARGEST_RATIO: f64 = 1.25;
/// Parts of a log of which each axis of the gyroscope has to share the motion.
const PARTS: usize = 8;
/// Energy of the motion of an axis over that of noise from which on it shows a gain.
const MOVED: f64 = 9.0;
/// Difference of a gain from one that no scale error explains, nor the noise of what moved so much.
const LARGEST_CHANGE: f64 = 0.5;
/// Largest residual between two sound accelerometers, m/s^2, and as a share of the secondary's specific force.
const LARGEST_RESIDUAL: f64 = 0.5;
const LARGEST_RESIDUAL_SHARE: f64 = 0.4;
/// A mirror image is one where a rotation leaves so many times what a reflection leaves.
const MIRRORED: f64 = 4.0;
/// Chance of angles, scales and delays between sound units below which they are those of a motion that was not averaged out.
const UNSOUND: f64 = 1e-3;
/// Parts of the motion, each of which shows its own clock.
const CLOCKS: usize = 4;
/// Chance of clocks as different as those of the parts, of one clock.
const JUMP_BY_CHANCE: f64 = 1e-6;
/// Samples that a window holds at least.
const SAMPLES: f64 = 3.0;
/// Vibration above half the sample rate is averaged out by longer windows, at the cost of quick motion: so many times
/// the shortest are tried as well.
const LONGER: [f64; 3] = [2.0, 4.0, 8.0];
/// Share of the variance at which a longer window is preferred: by chance alone some window always looks a bit better.
const WORTH_IT: f64 = 0.6;
/// Blocks of time that the residuals are cut into.
const BLOCKS: usize = 60;
/// Offsets that are tried.
const CANDIDATES: usize = 6;
/// Logarithm of the likelihood ratio, of independent blocks, above which the better of two offsets is certain.
const CERTAIN: f64 = 10.0;

/// Aligns a secondary with a primary.
///
/// # Errors
/// [`AlignError`] where the motion does not show how the two sit beside each other.
pub fn align(
    primary: &UnitSamples<'_>,
    secondary: &UnitSamples<'_>,
    settings: &AlignSettings,
) -> Result<Aligned, AlignError> {
    let slowest = primary.interval.max(secondary.interval);
    let window = settings.window.max(SAMPLES * slowest);
    if let Some((after, by)) = primary.leap(window) {
        return Err(AlignError::Leaps { after, by });
    }
    let grid = Grid::over(primary, window, BLOCKS);
    let shifts = search(&grid, secondary, settings);
    let found = coarse::peaks(&shifts);
    let best = *found.first().ok_or(AlignError::NothingInCommon)?;
    refuse_if_unlike(&best, &shifts)?;
    let start = refined(&grid, secondary, &found, settings)?;
    let (rotation, clock) = (start.rotation, start.clock);
    let shortest = solved(start, best, &Averaged::new(&grid, primary, secondary), settings)
        .ok_or(AlignError::Unsolvable)?;
    let longer = LONGER.iter().filter_map(|factor| {
        let grid = Grid::over(primary, factor * grid.length, BLOCKS);
        let rates = rates::fit(&grid, secondary, rotation, clock, settings)?;
        solved(rates, best, &Averaged::new(&grid, primary, secondary), settings)
    });
    let mut best = longer.fold(shortest, |best, other| {
        if other.uncertainty() < WORTH_IT * best.uncertainty() {
            other
        } else {
            best
        }
    });
    best.jumped = (!settings.one_clock)
        .then(|| clock_jump(&grid, secondary, &best.rates, settings))
        .flatten();
    best.refuse_if_an_axis_changed()?;
    best.refuse_if_forces_disagree()?;
    Ok(best)
}

/// Offset and skew that one part of the motion shows by itself.
struct PartClock {
    clock: RelativeClock,
    sigma: (f64, f64),
}

/// Largest jump from part to part, s, where no line leads through their clocks: one was set (docs/theory/align.md, eq. 23 to 25).
/// A robust fit of all of it takes the shorter side of a jump for outliers.
fn clock_jump(
    grid: &Grid,
    secondary: &UnitSamples<'_>,
    rates: &RatesFit,
    settings: &AlignSettings,
) -> Option<f64> {
    let grids = grid.parts(CLOCKS);
    let clocks = grids
        .iter()
        .map(|part| part_clock(part, secondary, rates, settings));
    let parts: Vec<_> = clocks.flatten().collect();
    let skew = |weighted: &dyn Fn(&PartClock) -> f64| {
        parts
            .iter()
            .map(|part| weighted(part) / part.sigma.1.powi(2))
            .sum::<f64>()
    };
    let usual = skew(&|part| part.clock.skew) / skew(&|_| 1.0);
    let jumps = parts.windows(2).map(|two| {
        let apart = two[1].clock.reference - two[0].clock.reference;
        two[1].clock.offset - two[0].clock.offset - usual * apart // eq. 25
    });
    let largest = jumps.max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    #[allow(clippy::cast_precision_loss)]
    let (free, blocks) = (2.0 * parts.len() as f64 - 2.0, (BLOCKS / parts.len()) as f64);
    let statistic = blocks * (off_a_line(&parts)? / blocks).ln_1p(); // eq. 24
    (chi_square_tail(statistic, free) < JUMP_BY_CHANCE).then_some(largest)
}

/// The clock of a part; `None` where its motion does not show the rotation.
fn part_clock(
    part: &Grid,
    secondary: &UnitSamples<'_>,
    rates: &RatesFit,
    settings: &AlignSettings,
) -> Option<PartClock> {
    let reference = 0.5 * (part.edges.first()? + part.edges.last()?);
    let clock = RelativeClock {
        offset: rates.clock.offset + rates.clock.skew * (reference - rates.clock.reference),
        reference,
        ..rates.clock
    };
    let fit = rates::fit(part, secondary, rates.rotation, clock, settings)?;
    fit.unseen.is_empty().then_some(PartClock {
        clock: fit.clock,
        sigma: fit.clock_sigma,
    })
}

/// Sum of squares that the likeliest line leaves of offsets and skews (docs/theory/align.md, eq. 23).
fn off_a_line(parts: &[PartClock]) -> Option<f64> {
    let start = parts.first()?.clock;
    let rows = || {
        parts.iter().flat_map(|part| {
            let (offset, skew) = (part.clock.offset - start.offset, part.clock.skew);
            let (of_offset, of_skew) = part.sigma;
            [
                (
                    Vector2::new(1.0, part.clock.reference - start.reference) / of_offset,
                    offset / of_offset,
                ),
                (Vector2::new(0.0, 1.0) / of_skew, skew / of_skew),
            ]
        })
    };
    let normal: Matrix2<f64> = rows().map(|(row, _)| row * row.transpose()).sum();
    let right: Vector2<f64> = rows().map(|(row, value)| row * value).sum();
    let line = normal.try_inverse()? * right;
    Some(rows().map(|(row, value)| (value - row.dot(&line)).powi(2)).sum()) // eq. 23
}

/// Goes on from what the rates show to what the forces do.
fn solved(
    mut rates: RatesFit,
    shift: Shift,
    samples: &Averaged<'_>,
    settings: &AlignSettings,
) -> Option<Aligned> {
    let one_axis = !rates.unseen.is_empty();
    let across = gravity::turn_about_unseen(&mut rates);
    let mut forces = forces::fit(&rates, samples, settings)?;
    let completed = across.is_some_and(|across| gravity::complete(&mut rates, &forces, across));
    // Without the rotation, the lever arm would be known in no frame.
    let is_shown = completed || !one_axis;
    let widened = if is_shown { widening(forces.of_priors) } else { 1.0 };
    rates.widen(widened);
    forces.widen(widened);
    for axis in rates.unseen.clone() {
        rates.open(&axis, PI * PI);
    }
    Some(Aligned {
        completed,
        widened,
        jumped: None,
        correlation: shift.correlation,
        motion: shift.motion,
        window: samples.grid.length,
        rates,
        forces: is_shown.then_some(forces),
    })
}

/// Factor on the variances by what sound units may differ (docs/theory/align.md, eq. 17).
fn widening(of_priors: f64) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let freedom = OF_PRIORS as f64;
    if chi_square_tail(of_priors, freedom) < UNSOUND {
        of_priors / freedom // eq. 17
    } else {
        1.0
    }
}

/// All shifts within the search; the shift by no window is the latest offset.
fn search(grid: &Grid, secondary: &UnitSamples<'_>, settings: &AlignSettings) -> Vec<Shift> {
    let Some(start) = grid.edges.first() else {
        return Vec::new();
    };
    let most = whole(settings.search / grid.length);
    let count = grid.primary.len() + 2 * most;
    let earliest = start - latest_offset(grid, settings);
    let theirs = secondary.windows(&edges(earliest, count, grid.length));
    coarse::correlations(&rates_of(&grid.primary), &rates_of(&theirs), 2 * most)
}

/// Offset of the shift by no window, s.
fn latest_offset(grid: &Grid, settings: &AlignSettings) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let most = whole(settings.search / grid.length) as f64;
    settings.around + most * grid.length
}

fn rates_of<const N: usize>(windows: &[Option<WindowMoments<N>>]) -> Vec<Option<Vector3<f64>>> {
    windows
        .iter()
        .map(|window| window.as_ref().map(|window| rate_of(&window.mean)))
        .collect()
}

fn refuse_if_unlike(best: &Shift, shifts: &[Shift]) -> Result<(), AlignError> {
    let least = best.motion.min(best.motion * best.ratio);
    if least < LEAST_MOTION {
        return Err(AlignError::NoMotion {
            found: least,
            needed: LEAST_MOTION,
        });
    }
    let left = |correlation: f64| (1.0 - correlation * correlation).max(0.0);
    let mirrored = shifts.iter().fold(0.0, |most, shift| shift.mirrored.max(most));
    if mirrored > LEAST_CORRELATION && left(best.correlation) > MIRRORED * left(mirrored) + 1e-3 {
        return Err(AlignError::Mirrored);
    }
    if best.correlation < LEAST_CORRELATION {
        return Err(AlignError::NotAlike {
            correlation: best.correlation,
        });
    }
    if !(1.0 / LARGEST_RATIO..=LARGEST_RATIO).contains(&best.ratio) {
        return Err(AlignError::Scaled { ratio: best.ratio });
    }
    Ok(())
}

/// The best of the offsets that the search has left, to the last digit.
fn refined(
    grid: &Grid,
    secondary: &UnitSamples<'_>,
    found: &[Shift],
    settings: &AlignSettings,
) -> Result<RatesFit, AlignError> {
    let likely = |shift: &&Shift| shift.correlation >= LEAST_CORRELATION;
    let reference = grid
        .edges
        .first()
        .zip(grid.edges.last())
        .map_or(0.0, |(a, b)| 0.5 * (a + b));
    let fits = found.iter().filter(likely).take(CANDIDATES).filter_map(|shift| {
        #[allow(clippy::cast_precision_loss)]
        let offset = latest_offset(grid, settings) - shift.windows as f64 * grid.length;
        let clock = RelativeClock {
            offset,
            skew: 0.0,
            reference,
        };
        rates::fit(grid, secondary, shift.rotation, clock, settings)
    });
    let mut fits: Vec<RatesFit> = fits.collect();
    fits.sort_by(|a, b| per_pair(a).total_cmp(&per_pair(b)));
    let mut fits = fits.into_iter();
    let best = fits.next().ok_or(AlignError::Unsolvable)?;
    let rival = fits.find(|rival| (rival.clock.offset - best.clock.offset).abs() > grid.length);
    match rival {
        Some(rival) if !is_certain(&best, &rival) => Err(AlignError::Ambiguous {
            offset: best.clock.offset,
            other: rival.clock.offset,
        }),
        _ => Ok(best),
    }
}

/// Minus twice the logarithm of the likelihood, of one pair: other offsets have other pairs in common.
fn per_pair(fit: &RatesFit) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let pairs = fit.pairs.len().max(1) as f64;
    fit.deviance / pairs
}

/// Neighbouring residuals are alike, so that only as many count as there are blocks.
fn is_certain(best: &RatesFit, rival: &RatesFit) -> bool {
    #[allow(clippy::cast_precision_loss)]
    let blocks = BLOCKS as f64;
    0.5 * blocks * (per_pair(rival) - per_pair(best)) > CERTAIN
}
