//! A table or a motor that shakes while a unit rests: what periodic motion leaves of a mean, and how uncertain that is.

use tumble_core::noise::{AllanLadder, Noise};
use tumble_core::segmenter::Segment;

use super::acquired::{Acquired, RestRejection};
use super::rejection::reject;

/// White noise of single blocks over that of means with soft edges, variances of all axes together, from which they
/// differ by more than chance: below, either gives a sigma that is right to a fifth.
const SHAKEN: f64 = 1.5;

/// The same, from which on rests too short for a mean with soft edges are given up: chance does not reach it in a session of
/// short rests, which would lose them.
const CLEARLY_SHAKEN: f64 = 4.0;

/// The same for one axis, of which fewer means speak.
const SHAKEN_AXIS: f64 = 3.0;

/// Number of windows below which their scatter is too uncertain.
const FEWEST_PAIRS: u32 = 12;

/// Takes specific force and angular rate at rest from means with soft edges, and their noise from how they scatter, where
/// what scatters within a rest averages out faster than white noise does (docs/theory/noise.md, eq. 14 to 16). `blocks` shows
/// how single blocks scatter, `ladder` how means with soft edges do. Rests too short for such a mean are then none.
pub(super) fn soften(found: &mut Acquired, blocks: &AllanLadder<f64>, ladder: &AllanLadder<f64>) {
    let long_enough = |rest: &Segment<f64>| rest.soft.mean().is_some();
    let long = found.rests.iter().filter(|rest| long_enough(rest)).count();
    let shaken = [0, 3].map(|first| is_shaken(blocks, ladder, first));
    if pairs_of(ladder) < FEWEST_PAIRS || 2 * long < found.rests.len() || shaken == [false, false] {
        return;
    }
    let clearly = [0, 3]
        .iter()
        .any(|first| excess(blocks, ladder, *first) > CLEARLY_SHAKEN);
    if long < found.rests.len() && !clearly {
        return;
    }
    reject(found, |found, i| {
        (!long_enough(&found.rests[i])).then_some(RestRejection::Vibrating)
    });
    for (first, _) in [0, 3].into_iter().zip(shaken).filter(|(_, shaken)| *shaken) {
        soften_triad(found, ladder, first);
    }
    found.soft_turns = shaken[1];
}

/// Takes the means of a triad, given by its first channel, and their noise from those with soft edges.
fn soften_triad(found: &mut Acquired, ladder: &AllanLadder<f64>, first: usize) {
    let channels = [first, first + 1, first + 2];
    let windows = ladder.fit_jointly(channels);
    let soft = slowest(ladder, first, windows);
    #[allow(clippy::cast_precision_loss)]
    let rests = found.rests.len() as f64;
    let shorter = |rest: &Segment<f64>| rest.duration() / rest.soft.effective_duration();
    let share = found.rests.iter().map(shorter).sum::<f64>() / rests; // eq. 15
    for (noise, soft) in found.noise.iter_mut().skip(first).zip(soft) {
        *noise = Noise {
            white: soft.white * share,
            ..soft
        };
    }
    for rest in &mut found.rests {
        if let Some(soft) = rest.soft.mean() {
            let mut means = *rest.moments.mean();
            for channel in channels {
                means[channel] = soft[channel];
            }
            rest.moments = rest.moments.about(&means);
        }
    }
}

/// Number of pairs at the lowest level.
fn pairs_of(ladder: &AllanLadder<f64>) -> u32 {
    ladder.variances(0).next().map_or(0, |(_, _, pairs)| pairs)
}

/// Noise by the windows, or by longer averages of them where these are clearly quieter: broad vibration fades towards
/// low frequencies.
fn slowest(ladder: &AllanLadder<f64>, first: usize, windows: [Noise<f64>; 3]) -> [Noise<f64>; 3] {
    let mut noise = level(ladder, first, windows);
    for lowest in 1.. {
        let upper = ladder.from_octave(lowest);
        if pairs_of(&upper) < FEWEST_PAIRS {
            break;
        }
        let slower = level(&upper, first, windows);
        if sum(&noise) > SHAKEN * sum(&slower) {
            noise = slower;
        }
    }
    noise
}

/// White noise by all levels, with the flicker that was found: few levels do not separate one from the other, and
/// flicker then counts as white.
fn level(ladder: &AllanLadder<f64>, first: usize, found: [Noise<f64>; 3]) -> [Noise<f64>; 3] {
    core::array::from_fn(|axis| {
        let density =
            |(time, variance, pairs): (f64, f64, u32)| (variance * time * f64::from(pairs), f64::from(pairs));
        let (sum, pairs) = ladder
            .variances(first + axis)
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

/// White noise of the three axes of a triad, given by its first channel, as single blocks and as means with soft edges show it.
fn densities(blocks: &AllanLadder<f64>, ladder: &AllanLadder<f64>, first: usize) -> [[f64; 3]; 2] {
    let channels = [first, first + 1, first + 2];
    let soft = level(ladder, first, ladder.fit_jointly(channels)).map(|noise| noise.white);
    let flat = channels.map(|channel| {
        let lowest = blocks.variances(channel).next();
        lowest.map_or(0.0, |(time, variance, _)| time * variance)
    });
    [flat, soft]
}

/// Variance that single blocks of a triad show, over that of means with soft edges, all axes together.
fn excess(blocks: &AllanLadder<f64>, ladder: &AllanLadder<f64>, first: usize) -> f64 {
    let [flat, soft] = densities(blocks, ladder, first);
    flat.iter().sum::<f64>() / soft.iter().sum::<f64>()
}

/// True where single blocks of a triad, given by its first channel, scatter more than the means with soft edges explain.
fn is_shaken(blocks: &AllanLadder<f64>, ladder: &AllanLadder<f64>, first: usize) -> bool {
    let [flat, soft] = densities(blocks, ladder, first);
    let mut axes = flat.iter().zip(soft);
    excess(blocks, ladder, first) > SHAKEN || axes.any(|(flat, soft)| *flat > SHAKEN_AXIS * soft)
}
