//! The ladder of Allan variances, and the noise fitted to it.

use core::f64::consts::{LN_2, PI};

use proptest::prelude::*;
use tumble_core::noise::{AllanLadder, Interval, Noise};
use tumble_core::real::Real;
use tumble_core::sample::CHANNELS;

use crate::common::{Correlated, Draws, double, rounding};

const BLOCK: f64 = 0.1;

type Blocks = Vec<[f64; CHANNELS]>;

fn blocks(count: core::ops::Range<usize>) -> impl Strategy<Value = Blocks> {
    prop::collection::vec(prop::array::uniform6(-1.0..1.0_f64), count)
}

fn ladder<T: Real>(blocks: &Blocks) -> AllanLadder<T> {
    let mut ladder = AllanLadder::default();
    for block in blocks {
        ladder.push(&block.map(nalgebra::convert), nalgebra::convert(BLOCK));
    }
    ladder
}

fn variances<T: Real>(ladder: &AllanLadder<T>, channel: usize) -> Vec<(f64, f64, u32)> {
    ladder
        .variances(channel)
        .map(|(time, variance, pairs)| (double(time), double(variance), pairs))
        .collect()
}

/// Half the mean squared difference of means over `2^octave` blocks, pair by pair without overlap.
fn direct(blocks: &Blocks, channel: usize) -> Vec<(f64, f64, u32)> {
    let mean = |part: &[[f64; CHANNELS]]| part.iter().map(|y| y[channel]).sum::<f64>() / part.len() as f64;
    (0..16)
        .map(|octave| 1_usize << octave)
        .map_while(|length| {
            let halved = blocks
                .chunks_exact(2 * length)
                .map(|pair| (mean(&pair[..length]) - mean(&pair[length..])).powi(2) / 2.0);
            let squares: Vec<f64> = halved.collect();
            let pairs = u32::try_from(squares.len()).expect("few");
            (pairs > 0).then(|| {
                (
                    BLOCK * length as f64,
                    squares.iter().sum::<f64>() / f64::from(pairs),
                    pairs,
                )
            })
        })
        .collect()
}

fn same(
    found: &[(f64, f64, u32)],
    expected: &[(f64, f64, u32)],
    tolerance: f64,
) -> Result<(), TestCaseError> {
    prop_assert_eq!(found.len(), expected.len());
    for ((t, v, n), (time, variance, pairs)) in found.iter().zip(expected) {
        prop_assert_eq!(n, pairs);
        prop_assert!((t / time - 1.0).abs() < tolerance);
        prop_assert!((v - variance).abs() < tolerance, "{} {}", v, variance);
    }
    Ok(())
}

proptest! {
    #[test]
    fn the_ladder_is_the_allan_variance_of_pairs_without_overlap(blocks in blocks(0..300), channel in 0..CHANNELS) {
        same(&variances(&ladder::<f64>(&blocks), channel), &direct(&blocks, channel), 1e-13)?;
        // Means of means lose a rounding a level; the length of a block is a sum of up to 300 lengths.
        same(&variances(&ladder::<f32>(&blocks), channel), &direct(&blocks, channel), rounding::<f32>(300.0))?;
    }

    #[test]
    fn ladders_merged_weigh_each_by_its_pairs(a in blocks(0..100), b in blocks(0..100), channel in 0..CHANNELS) {
        let (first, second) = (ladder::<f64>(&a), ladder::<f64>(&b));
        let (mut there, mut back) = (first, second);
        there.merge(&second);
        back.merge(&first);
        let (of_a, of_b) = (direct(&a, channel), direct(&b, channel));
        let expected: Vec<_> = (0..of_a.len().max(of_b.len()))
            .map(|octave| {
                let part = |of: &[(f64, f64, u32)]| of.get(octave).map_or((0.0, 0), |(_, v, n)| (v * f64::from(*n), *n));
                let ((x, n), (y, m)) = (part(&of_a), part(&of_b));
                (BLOCK * f64::from(1_u32 << octave), (x + y) / f64::from(n + m), n + m)
            })
            .collect();
        same(&variances(&there, channel), &expected, 1e-12)?;
        same(&variances(&back, channel), &expected, 1e-12)?;
    }

    #[test]
    fn a_level_adds_nothing(blocks in blocks(2..100), level in -1e3..1e3_f64) {
        let raised: Blocks = blocks.iter().map(|block| block.map(|y| y + level)).collect();
        same(&variances(&ladder::<f64>(&raised), 0), &direct(&blocks, 0), 1e-9)?;
    }

    #[test]
    fn the_noise_fitted_scales_with_the_square_of_the_readings(blocks in blocks(8..200), scale in 1e-6..1e3_f64) {
        let scaled: Blocks = blocks.iter().map(|block| block.map(|y| y * scale)).collect();
        let (one, other) = (ladder::<f64>(&blocks).fit(0), ladder::<f64>(&scaled).fit(0));
        let near = |a: f64, b: f64| (a * scale * scale - b).abs() <= 1e-9 * scale * scale;
        prop_assert!(near(one.white, other.white) && near(one.flicker, other.flicker), "{:?} {:?}", one, other);
    }

    #[test]
    fn the_noise_fitted_is_never_negative_and_always_a_number(blocks in blocks(0..40), channel in 0..CHANNELS) {
        let noise = ladder::<f64>(&blocks).fit(channel);
        prop_assert!(noise.white >= 0.0 && noise.flicker >= 0.0 && noise.flicker_sigma >= 0.0, "{:?}", noise);
        prop_assert!(noise.white.is_finite() && noise.flicker.is_finite(), "{:?}", noise);
        let noise = ladder::<f32>(&blocks).fit(channel);
        prop_assert!(noise.white >= 0.0 && noise.flicker >= 0.0 && noise.flicker_sigma >= 0.0, "{:?}", noise);
    }
}

/// Mean and root mean square of `(found - truth) / sigma`.
fn normalised(errors: &[f64]) -> (f64, f64) {
    let n = errors.len() as f64;
    (
        errors.iter().sum::<f64>() / n,
        (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt(),
    )
}

#[test]
fn white_noise_is_recovered_and_flicker_is_not_made_up() {
    let (seed, density, count, runs) = (61, 0.02, 600_usize, 200);
    let mut draws = Draws::new(seed);
    let mut whites = Vec::new();
    let mut exceeding = 0;
    for _ in 0..runs {
        let sigma = (density * density / BLOCK).sqrt();
        let blocks: Blocks = (0..count).map(|_| [sigma * draws.normal(); CHANNELS]).collect();
        let noise = ladder::<f64>(&blocks).fit(2);
        whites.push(noise.white / (density * density) - 1.0);
        exceeding += usize::from(noise.flicker > 3.0 * noise.flicker_sigma);
    }
    let (mean, scatter) = normalised(&whites);
    println!(
        "white, seed {seed}: mean error {mean:.4}, scatter {scatter:.4}, {exceeding} of {runs} show flicker"
    );
    // 600 blocks give 599 independent differences: N^2 is good to sqrt(2 / 599) = 0.058 at best; flicker fitted
    // beside it costs a little, and since it cannot be negative, takes a little of N^2 in the mean.
    assert!(mean.abs() < 0.03, "seed {seed}: {mean}");
    assert!((0.05..0.09).contains(&scatter), "seed {seed}: {scatter}");
    // Beyond three sigma lies one in a thousand of a normal error; this one has a long upper tail.
    assert!(exceeding <= runs / 50, "seed {seed}: {exceeding}");
}

/// Means of flicker of B = 1 over successive blocks.
fn flicker_blocks(count: u32) -> Correlated {
    let block = |i: usize| Interval {
        start: i as f64 * BLOCK,
        end: (i + 1) as f64 * BLOCK,
    };
    let session = Interval {
        start: 0.0,
        end: f64::from(count) * BLOCK,
    };
    let noise = Noise {
        flicker: 1.0,
        ..Noise::none()
    };
    Correlated::new(count as usize, |i, j| {
        noise.covariance(&block(i), &block(j), &session)
    })
}

#[test]
fn flicker_beside_white_noise_is_recovered_within_its_sigma() {
    let (seed, runs) = (62, 400);
    let (density, strength) = (0.3, 0.8);
    let mut draws = Draws::new(seed);
    let bias = flicker_blocks(512);
    let (mut whites, mut flickers) = (Vec::new(), Vec::new());
    for _ in 0..runs {
        let sigma = (density * density / BLOCK).sqrt();
        let blocks: Blocks = bias
            .draw(&mut draws)
            .iter()
            .map(|bias| [strength * bias + sigma * draws.normal(); CHANNELS])
            .collect();
        let noise = ladder::<f64>(&blocks).fit(0);
        whites.push(noise.white / (density * density) - 1.0);
        flickers.push((noise.flicker - strength * strength) / noise.flicker_sigma);
    }
    let ((white, _), (mean, scatter)) = (normalised(&whites), normalised(&flickers));
    println!(
        "flicker, seed {seed}: white {white:.3}, flicker off by {mean:.2} sigma, scatter {scatter:.2} sigma"
    );
    assert!(white.abs() < 0.03, "seed {seed}: {white}");
    // Differences of flicker are only nearly independent, and few on the upper levels, so that the sigma is a fair
    // guess and no more.
    assert!(mean.abs() < 0.4, "seed {seed}: {mean}");
    assert!((0.7..1.4).contains(&scatter), "seed {seed}: {scatter}");
}

#[test]
fn flicker_alone_levels_off_at_its_floor_on_every_octave() {
    let (seed, runs) = (63, 300);
    let mut draws = Draws::new(seed);
    let bias = flicker_blocks(256);
    let mut pooled = AllanLadder::<f64>::new();
    for _ in 0..runs {
        pooled.merge(&ladder(
            &bias
                .draw(&mut draws)
                .iter()
                .map(|bias| [*bias; CHANNELS])
                .collect(),
        ));
    }
    let floor = 2.0 * LN_2 / PI;
    assert_eq!(pooled.variances(0).count(), 8);
    for (time, variance, pairs) in pooled.variances(0) {
        let bound = 5.0 * (2.0 / f64::from(pairs)).sqrt();
        assert!(
            (variance / floor - 1.0).abs() < bound,
            "seed {seed}, {time} s: {variance}, floor {floor}"
        );
    }
}

#[test]
fn a_record_too_short_to_tell_says_so() {
    let one_pair = ladder::<f64>(&vec![[1.0; CHANNELS], [2.0; CHANNELS]]).fit(0);
    assert_eq!(one_pair.flicker, 0.0);
    assert!(one_pair.flicker_sigma > 1e300);
    // Half the squared difference of one, times the averaging time.
    assert!((one_pair.white - 0.5 * BLOCK).abs() < 1e-15);
    let nothing = AllanLadder::<f64>::new().fit(0);
    assert_eq!((nothing.white, nothing.flicker), (0.0, 0.0));
}

#[test]
fn a_channel_without_any_scatter_has_no_noise() {
    let noise = ladder::<f64>(&vec![[5.0; CHANNELS]; 50]).fit(3);
    assert_eq!((noise.white, noise.flicker), (0.0, 0.0));
}

#[test]
fn a_channel_that_does_not_exist_has_no_octaves() {
    assert_eq!(
        ladder::<f64>(&vec![[5.0; CHANNELS]; 8])
            .variances(CHANNELS)
            .count(),
        0
    );
}
