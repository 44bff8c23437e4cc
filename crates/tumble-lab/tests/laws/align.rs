//! Laws of the alignment: means over windows, the search for an offset, the sigmas of a robust fit.

use nalgebra::{Matrix3, SMatrix, SVector, Vector2, Vector3};
use proptest::prelude::*;
use tumble_lab::align::coarse::{correlations, peaks};
use tumble_lab::align::robust::{GaussianPrior, covariance, step};
use tumble_lab::align::samples::{Triangle, UnitSamples, rate_of};
use tumble_lab::align::{AlignError, AlignSettings, align};
use tumble_lab::distributions::INTERVAL;

use super::common::{Draws, assert_close, rotation, vector};

/// Samples of a smooth motion: rate and specific force as sums of sines.
struct Samples {
    time: Vec<f64>,
    force: Vec<[f64; 3]>,
    rate: Vec<[f64; 3]>,
}

impl Samples {
    fn of(time: Vec<f64>, rate: impl Fn(f64) -> Vector3<f64>) -> Self {
        let force = time.iter().map(|t| [t.sin(), t.cos(), 9.8]).collect();
        let rate = time.iter().map(|t| rate(*t).into()).collect();
        Self { time, force, rate }
    }

    fn track(&self) -> UnitSamples<'_> {
        UnitSamples::new(&self.time, &self.force, &self.rate)
    }
}

fn wave(time: f64) -> Vector3<f64> {
    Vector3::new(
        (2.1 * time).sin() + (5.3 * time + 1.0).cos(),
        (3.7 * time + 0.4).sin(),
        (1.3 * time).cos() - (4.1 * time).sin(),
    )
}

#[allow(clippy::cast_precision_loss)]
fn regular(count: usize, step: f64) -> Vec<f64> {
    (0..count).map(|k| k as f64 * step).collect()
}

/// Times early or late by up to a third of a step, the first and last as they are.
fn irregular(count: usize, step: f64, draws: &mut Draws) -> Vec<f64> {
    let mut time = regular(count, step);
    for t in &mut time[1..count - 1] {
        *t += step / 3.0 * draws.normal().clamp(-1.0, 1.0);
    }
    time
}

proptest! {
    #[test]
    fn means_of_a_parabola_are_exact_whatever_the_time_stamps(a in vector(1.0), b in vector(1.0), c in vector(1.0), seed in 0..1000_u64, start in 0.3..0.5_f64, length in 0.05..0.2_f64) {
        let parabola = |t: f64| a + b * t + c * t * t;
        let samples = Samples::of(irregular(200, 0.01, &mut Draws::new(seed)), parabola);
        let edges = [start, start + length, start + 2.0 * length];
        let windows = samples.track().windows(&edges);
        let mean = |from: f64, to: f64| {
            (a * (to - from) + b * (to * to - from * from) / 2.0 + c * (to.powi(3) - from.powi(3)) / 3.0) / (to - from)
        };
        let [Some(first), Some(second)] = windows[..] else { return Err(TestCaseError::fail("a window is missing")) };
        assert_close!(rate_of(&first.mean), mean(edges[0], edges[1]), 1e-12);
        assert_close!(rate_of(&second.mean), mean(edges[1], edges[2]), 1e-12);
        let triangle = Triangle::over(&first, &second, length);
        // A triangle of half-width h has the second moment h^2 / 6 about its middle.
        let middle = parabola(edges[1]) + c * (length * length / 6.0);
        assert_close!(rate_of(&triangle.mean), middle, 1e-12);
        assert_close!(rate_of(&triangle.slope), b + c * (2.0 * edges[1]), 1e-11);
    }

    #[test]
    fn only_windows_that_touch_unusable_samples_are_left_out(bad in 30..170_usize, kind in 0..3_u8) {
        let mut samples = Samples::of(regular(200, 0.01), wave);
        match kind {
            0 => samples.rate[bad][1] = f64::NAN,
            1 => samples.force[bad][2] = f64::INFINITY,
            _ => {
                samples.time.drain(bad..bad + 4);
                samples.force.drain(bad..bad + 4);
                samples.rate.drain(bad..bad + 4);
            }
        }
        let edges: Vec<f64> = (0..39).map(|k| 0.003 + 0.05 * f64::from(k)).collect();
        let windows = samples.track().windows(&edges);
        let (first, last) = if kind == 2 { (bad - 1, bad + 4) } else { (bad - 1, bad + 1) };
        #[allow(clippy::cast_precision_loss)]
        let span = (first as f64 * 0.01, last as f64 * 0.01);
        for (pair, window) in edges.windows(2).zip(windows) {
            let touches = pair[1] > span.0 && pair[0] < span.1;
            prop_assert_eq!(window.is_none(), touches, "window from {}", pair[0]);
        }
    }

    #[test]
    fn the_search_finds_any_shift_under_any_rotation_and_bias(turn in rotation(), bias in vector(0.5), shift in 0..60_usize) {
        let primary: Vec<_> = regular(400, 0.05).iter().map(|t| Some(wave(*t))).collect();
        let earliest = |k: usize| 0.05 * (k as f64 - shift as f64);
        let secondary: Vec<_> = (0..460).map(|k| Some(turn * wave(earliest(k)) + bias)).collect();
        let shifts = correlations(&primary, &secondary, 60);
        let best = peaks(&shifts)[0];
        prop_assert_eq!(best.windows, shift);
        prop_assert!((best.correlation - 1.0).abs() < 1e-9);
        prop_assert!((best.ratio - 1.0).abs() < 1e-9);
        assert_close!(best.rotation.matrix(), turn.matrix(), 1e-7);
    }

    #[test]
    fn a_mirrored_unit_correlates_fully_only_as_one(turn in rotation()) {
        let primary: Vec<_> = regular(400, 0.05).iter().map(|t| Some(wave(*t))).collect();
        let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
        let secondary: Vec<_> = primary.iter().map(|w| w.map(|w| turn * (mirror * w))).collect();
        let shift = correlations(&primary, &secondary, 0)[0];
        prop_assert!((shift.mirrored - 1.0).abs() < 1e-9);
        prop_assert!(shift.correlation < 0.9);
    }
}

#[test]
fn readings_at_the_end_of_a_range_are_left_out_but_no_peaks() {
    let clipped = |t: f64| wave(t).map(|w| w.clamp(-1.2, 1.2));
    let samples = Samples::of(regular(2000, 0.01), clipped);
    let held = samples
        .rate
        .iter()
        .filter(|w| w.iter().any(|w| w.abs() >= 1.2))
        .count();
    assert!(held > 100);
    assert_eq!(samples.track().saturated, held);
    assert_eq!(Samples::of(regular(2000, 0.01), wave).track().saturated, 0);
}

/// A straight line in noise, every fiftieth reading of which is far off.
#[test]
fn sigmas_of_a_robust_fit_are_those_of_its_errors() {
    const RUNS: u64 = 300;
    for outliers in [false, true] {
        let (mut squares, mut within) = (Vector2::<f64>::zeros(), 0);
        for seed in 0..RUNS {
            let mut draws = Draws::new(seed);
            let rows: Vec<(SMatrix<f64, 3, 2>, Vector3<f64>)> = (0..600)
                .map(|k| {
                    let t = f64::from(k) / 300.0 - 1.0;
                    let mut noise = 0.1 * draws.normals::<3>();
                    if outliers && k % 50 == 7 {
                        noise *= 100.0;
                    }
                    let design = SMatrix::<f64, 3, 2>::new(1.0, t, 1.0, -t, 1.0, t * t);
                    (design, design * Vector2::new(0.3, -2.0) + noise)
                })
                .collect();
            let (x, spread) = fitted(&rows);
            let error = (x - Vector2::new(0.3, -2.0)).component_div(&spread.diagonal().map(f64::sqrt));
            squares += error.component_mul(&error);
            within += error.iter().filter(|z| z.abs() < INTERVAL).count();
        }
        let ratio = (squares / 300.0).map(f64::sqrt);
        let share = f64::from(u32::try_from(within).unwrap_or(0)) / 600.0;
        println!("seeds 0 to {RUNS}, outliers {outliers}: errors over sigmas {ratio:?}, {share:.3} within");
        assert!(ratio.iter().all(|ratio| (0.87..1.13).contains(ratio)));
        assert!((0.92..0.98).contains(&share));
    }
}

fn fitted(rows: &[(SMatrix<f64, 3, 2>, Vector3<f64>)]) -> (Vector2<f64>, SMatrix<f64, 2, 2>) {
    let belief = GaussianPrior {
        precision: SMatrix::identity() * 1e-6,
        missing: SVector::zeros(),
    };
    let mut x = Vector2::zeros();
    let mut scale = 0.0;
    for _ in 0..20 {
        let row = |k: usize| (rows[k].0, rows[k].1 - rows[k].0 * x);
        let next = step(rows.len(), row, &belief).expect("rows are finite");
        x += next.change;
        scale = next.scale;
    }
    let row = |k: usize| (rows[k].0, rows[k].1 - rows[k].0 * x);
    let spread = covariance(rows.len(), row, |k| k / 10, scale, &belief, [0, 1]).expect("rows are finite");
    (x, spread.covariance)
}

#[test]
fn a_fit_to_rows_that_are_not_finite_is_none() {
    let belief = GaussianPrior {
        precision: SMatrix::<f64, 1, 1>::identity(),
        missing: SVector::zeros(),
    };
    let row = |_: usize| (SMatrix::<f64, 3, 1>::repeat(f64::NAN), Vector3::zeros());
    assert!(step(5, row, &belief).is_none());
}

#[test]
fn units_without_a_sample_or_a_moment_in_common_are_refused() {
    let none = Samples::of(Vec::new(), wave);
    let some = Samples::of(regular(3000, 0.01), wave);
    let later = Samples::of(regular(3000, 0.01).iter().map(|t| t + 100.0).collect(), wave);
    let settings = AlignSettings::default();
    for (primary, secondary) in [(&none, &some), (&some, &none), (&none, &none), (&some, &later)] {
        let refusal = align(&primary.track(), &secondary.track(), &settings).err();
        assert_eq!(refusal, Some(AlignError::NothingInCommon));
    }
}
