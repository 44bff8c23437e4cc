//! A table or a motor that shakes while a unit rests: what periodic motion leaves of a mean, and how uncertain that is.

use tumble_core::noise::{AllanLadder, Noise};

use super::acquired::Acquired;

/// White noise of single blocks over that of means with soft edges, variances of all axes together, from which they
/// differ by more than chance: below, either gives a sigma that is right to a fifth.
const SHAKEN: f64 = 1.5;

/// The same for one axis, of which fewer means speak.
const SHAKEN_AXIS: f64 = 3.0;

/// Windows below which their scatter says too little.
const FEWEST_PAIRS: u32 = 12;

/// Takes the specific force at rest from means with soft edges, and its noise from how they scatter, where what scatters
/// within a rest averages out faster than white noise does (docs/theory/noise.md, eq. 14 to 16).
pub(super) fn soften(found: &mut Acquired, ladder: &AllanLadder<f64>) {
    let windows = ladder.fit_jointly([0, 1, 2]);
    let everywhere = found.rests.iter().all(|rest| rest.soft.mean().is_some());
    let enough = everywhere && !found.rests.is_empty() && pairs_of(ladder) >= FEWEST_PAIRS;
    if !enough || !is_shaken(&found.force_noise(), &level(ladder, windows)) {
        return;
    }
    let soft = slowest(ladder, windows);
    #[allow(clippy::cast_precision_loss)]
    let rests = found.rests.len() as f64;
    let shorter =
        |rest: &tumble_core::segmenter::Segment<f64>| rest.duration() / rest.soft.effective_duration();
    let share = found.rests.iter().map(shorter).sum::<f64>() / rests; // eq. 15
    for (noise, soft) in found.noise.iter_mut().zip(soft) {
        *noise = Noise {
            white: soft.white * share,
            ..soft
        };
    }
    for rest in &mut found.rests {
        if let Some(mean) = rest.soft.mean() {
            rest.moments = rest.moments.about(&mean[..3]);
        }
    }
}

/// Pairs of the lowest rung there is.
fn pairs_of(ladder: &AllanLadder<f64>) -> u32 {
    ladder.variances(0).next().map_or(0, |(_, _, pairs)| pairs)
}

/// Noise as the windows show it; as longer averages of them do, where these say clearly less: broad shaking fades
/// towards low frequencies.
fn slowest(ladder: &AllanLadder<f64>, windows: [Noise<f64>; 3]) -> [Noise<f64>; 3] {
    let mut noise = level(ladder, windows);
    for first in 1.. {
        let upper = ladder.from_rung(first);
        if pairs_of(&upper) < FEWEST_PAIRS {
            break;
        }
        let slower = level(&upper, windows);
        if sum(&noise) > SHAKEN * sum(&slower) {
            noise = slower;
        }
    }
    noise
}

/// White noise as all rungs show it, with the flicker that was found: few rungs do not tell one from the other, and what
/// is flicker then counts as white.
fn level(ladder: &AllanLadder<f64>, found: [Noise<f64>; 3]) -> [Noise<f64>; 3] {
    core::array::from_fn(|axis| {
        let density =
            |(time, variance, pairs): (f64, f64, u32)| (variance * time * f64::from(pairs), f64::from(pairs));
        let (sum, pairs) = ladder
            .variances(axis)
            .map(density)
            .fold((0.0, 0.0), |(sum, all), (density, pairs)| {
                (sum + density, all + pairs)
            });
        Noise {
            white: sum / pairs,
            ..found[axis]
        }
    })
}

fn sum(noise: &[Noise<f64>; 3]) -> f64 {
    noise.iter().map(|noise| noise.white).sum()
}

fn is_shaken(flat: &[Noise<f64>; 3], soft: &[Noise<f64>; 3]) -> bool {
    let mut axes = flat.iter().zip(soft);
    sum(flat) > SHAKEN * sum(soft) || axes.any(|(flat, soft)| flat.white > SHAKEN_AXIS * soft.white)
}
