extern crate std;

use std::vec::Vec;

use super::*;
use proptest::prelude::*;

const LENGTH: u64 = 50_000;

/// Windows of one channel whose reading at time t, s, is `signal(t)`, sampled at these microseconds.
fn windows(times: impl Iterator<Item = u64>, signal: impl Fn(f64) -> f64) -> Vec<Means<f64, 1>> {
    let mut windows = Windows::new();
    times
        .filter_map(|time| windows.push(time, &[signal(time as f64 * 1e-6)], [true; 2], LENGTH, None))
        .collect()
}

/// Mean rates about x under triangles, each with its middle, s.
fn triangles(times: impl Iterator<Item = u64>, rate: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let mut windows = Windows::<f64, 6>::new();
    let found: Vec<_> = times
        .filter_map(|time| {
            let channels = [0.0, 0.0, 0.0, rate(time as f64 * 1e-6), 0.0, 0.0];
            windows.push(time, &channels, [true; 2], LENGTH, None)
        })
        .collect();
    let middle = |means: &Means<f64, 6>| f64::from(means.index) * LENGTH as f64 * 1e-6;
    let pairs = found.windows(2);
    pairs
        .map(|pair| (middle(&pair[1]), pair[0].triangle(&pair[1])[3]))
        .collect()
}

/// Sample times with random intervals, none longer than a window.
fn irregular() -> impl Strategy<Value = Vec<u64>> {
    prop::collection::vec(500_u64..LENGTH, 20..200).prop_map(|steps| {
        let mut time = 7_000;
        steps
            .iter()
            .map(|step| {
                time += step;
                time
            })
            .collect()
    })
}

proptest! {
    #[test]
    fn a_straight_line_is_integrated_exactly_at_any_sample_times(
        times in irregular(), offset in -10.0..10.0_f64, slope in -5.0..5.0_f64
    ) {
        let length = LENGTH as f64 * 1e-6;
        for means in windows(times.into_iter(), |t| offset + slope * t) {
            let start = means.index as f64 * length;
            let at = |t: f64| offset + slope * t;
            prop_assert!((means.mean[0] - at(start + length / 2.0)).abs() < 1e-9);
            let rising = at(start) / 2.0 + slope * length / 3.0;
            prop_assert!((means.rising[0] - rising).abs() < 1e-9);
        }
    }

    #[test]
    fn a_triangle_is_exact_for_a_straight_line_at_even_intervals(
        first in 0..50_000_u64, interval in 500..LENGTH, offset in -10.0..10.0_f64, slope in -5.0..5.0_f64
    ) {
        let times = (0..100).map(|i| first + i * interval);
        for (middle, mean) in triangles(times, |t| offset + slope * t) {
            prop_assert!((mean - offset - slope * middle).abs() < 1e-9);
        }
    }

    #[test]
    fn uneven_intervals_shift_a_triangle_by_little(times in irregular(), slope in -5.0..5.0_f64) {
        // At most what straight lines miss with the longest interval, over a window.
        let most = LENGTH as f64 * 1e-6 / 12.0 * slope.abs();
        for (middle, mean) in triangles(times.into_iter(), |t| slope * t) {
            prop_assert!((mean - slope * middle).abs() <= most + 1e-9);
        }
    }

    #[test]
    fn windows_follow_one_another_without_a_gap(times in irregular()) {
        let found = windows(times.into_iter(), |t| t);
        for pair in found.windows(2) {
            prop_assert_eq!(pair[1].index, pair[0].index + 1);
        }
    }

    #[test]
    fn units_of_different_rates_see_the_same_smooth_motion(first in irregular(), rate in 300_u64..1500) {
        let motion = |t: f64| (3.0 * t).sin();
        let end = *first.last().unwrap();
        let slow = windows(first.iter().flat_map(|t| [*t, *t + 200]), motion);
        let fast = windows((1..).map(|i| i * 1_000_000 / rate).take_while(|t| *t < end), motion);
        for means in &slow {
            let Some(other) = fast.iter().find(|other| other.index == means.index) else { continue };
            // A straight line misses at most h^2 / 8 times the second derivative, 9, over 50 ms.
            prop_assert!((means.mean[0] - other.mean[0]).abs() < 3e-3);
        }
    }
}

#[test]
fn slow_and_fast_units_have_the_same_gain_of_a_motion() {
    // The part of a motion of 8 rad/s that means under triangles keep, whatever the rate and the first sample.
    let gain = |interval: u64, first: u64| {
        let motion = |t: f64| (8.0 * t).sin();
        let times = (0..40_000)
            .map(|i| first + i * interval)
            .take_while(|t| *t < 40_000_000);
        let found = triangles(times, motion);
        let moved: f64 = found.iter().map(|(middle, mean)| mean * motion(*middle)).sum();
        let power: f64 = found.iter().map(|(middle, _)| motion(*middle).powi(2)).sum();
        moved / power
    };
    let fast = gain(1000, 300);
    for (interval, first) in [
        (20_000, 0),
        (20_000, 7000),
        (12_500, 3000),
        (16_129, 0),
        (33_333, 1000),
    ] {
        let reduced = (8.0 * interval as f64 * 1e-6).powi(2) / 12.0;
        let beyond = gain(interval, first) / fast - 1.0;
        assert!(
            beyond.abs() < 0.1 * reduced,
            "{interval} {first}: {beyond} of {reduced}"
        );
    }
}

#[test]
fn after_another_length_of_windows_those_of_the_new_one_follow() {
    // At the start of the second part, the windows of the other length would be 2^32 microseconds ahead.
    for (begin, follow) in [(0, 28), (107_372 * LENGTH + 8000, 29)] {
        let mut windows = Windows::new();
        let mut found = Vec::new();
        for step in 0..400_u64 {
            let length = if step < 101 { LENGTH } else { LENGTH / 5 };
            let time = begin + step * 1000;
            found.extend(windows.push(time, &[time as f64 * 1e-6], [true; 2], length, None));
        }
        let later: Vec<_> = found
            .iter()
            .filter(|means| u64::from(means.index) > begin / LENGTH + 2)
            .collect();
        assert_eq!((found.len() - later.len(), later.len()), (1, follow));
        for means in later {
            let middle = (means.index as f64 + 0.5) * (LENGTH / 5) as f64 * 1e-6;
            assert!((means.mean[0] - middle).abs() < 1e-9, "{means:?}");
        }
    }
}

#[test]
fn the_change_of_mean_rate_is_the_mean_angular_acceleration() {
    let rate = |t: f64| 2.0 * (4.0 * t).sin();
    let acceleration = |t: f64| 8.0 * (4.0 * t).cos();
    let times = || (0..4000).map(|i| i * 1000);
    let (rates, accelerations) = (windows(times(), rate), windows(times(), acceleration));
    for (pair, truth) in rates.windows(2).zip(accelerations.windows(2)) {
        let change = (pair[1].mean[0] - pair[0].mean[0]) / (LENGTH as f64 * 1e-6);
        assert!((change - truth[0].triangle(&truth[1])[0]).abs() < 1e-4);
    }
}

#[test]
fn a_long_pause_removes_only_the_windows_it_touches() {
    let times = (0..100).map(|i| i * 5000).chain((150..250).map(|i| i * 5000));
    let indices: Vec<u64> = windows(times, |t| t)
        .iter()
        .map(|means| means.index.into())
        .collect();
    // Samples stop at 495 ms, within window 9, and go on at 750 ms, on the edge of window 15.
    assert_eq!(indices, [1, 2, 3, 4, 5, 6, 7, 8, 16, 17, 18, 19, 20, 21, 22, 23]);
}

#[test]
fn an_unusable_reading_marks_the_window_of_its_own_sensor() {
    let mut windows = Windows::<f64, 6>::new();
    let mut found = Vec::new();
    for i in 0..60_u64 {
        let usable = [i != 25, true];
        found.extend(windows.push(i * 5000, &[1.0; 6], usable, LENGTH, None));
    }
    for means in found {
        assert_eq!(means.usable, [means.index != 2, true], "{}", means.index);
    }
}

#[test]
fn scatter_is_the_variance_of_noise_and_small_for_smooth_motion() {
    let mut windows = Windows::<f64, 6>::new();
    let mut noisy = Vec::new();
    for i in 0..4000_u64 {
        let t = i as f64 * 0.005;
        // Alternating readings have the variance 1 and twice that from step to step.
        let sign = if (i / 2) % 2 == 0 { 1.0 } else { -1.0 };
        let smooth = (2.0 * t).sin();
        noisy.extend(windows.push(
            i * 5000,
            &[sign, sign, sign, smooth, smooth, smooth],
            [true; 2],
            LENGTH,
            None,
        ));
    }
    for means in noisy {
        assert!((means.scatter[0] - 1.0).abs() < 0.3, "{:?}", means.scatter);
        assert!(means.scatter[1] < 1e-4);
    }
}
