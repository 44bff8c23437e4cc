//! White noise, bias instability, and the mean over an interval.

use core::f64::consts::{LN_2, PI, TAU};

use proptest::prelude::*;
use tumble_core::noise::{Flicker, Interval, Noise, Pool};
use tumble_core::real::Real;

use crate::common::{Draws, double, flicker, rounding};

type Span = Interval<f64>;

fn white(density: f64) -> Noise<f64> {
    Noise {
        white: density,
        ..Noise::none()
    }
}

fn unit_flicker<T: Real>() -> Noise<T> {
    Noise {
        flicker: T::one(),
        ..Noise::none()
    }
}

/// A session cut into neighbouring intervals, rests and turns alike.
fn partition() -> impl Strategy<Value = (Vec<Span>, Span)> {
    (-100.0..1000.0_f64, prop::collection::vec(0.5..20.0_f64, 1..40)).prop_map(|(begin, lengths)| {
        let mut start = begin;
        let parts: Vec<Span> = lengths
            .iter()
            .map(|length| {
                let end = start + length;
                let span = Interval { start, end };
                start = end;
                span
            })
            .collect();
        (
            parts,
            Interval {
                start: begin,
                end: start,
            },
        )
    })
}

fn single(span: &Span) -> Interval<f32> {
    Interval {
        start: span.start as f32,
        end: span.end as f32,
    }
}

/// Covariance by bias instability of B = 1, straight from its spectrum: `(1 / pi)` times the integral over `ln f` of
/// `Re(H_a H_b*)`, where H is the response of a mean over an interval minus that of the mean over the session.
fn from_the_spectrum(a: &Span, b: &Span, session: &Span) -> f64 {
    let shortest = a.duration().min(b.duration());
    let (lowest, highest) = (1e-5 / session.duration(), 40.0 / shortest);
    // Fine enough for the fastest phase, `2 pi f (session)`, at the highest frequency.
    let step = 0.1 / (highest * session.duration() * TAU);
    let count = ((highest / lowest).ln() / step).ceil();
    let response = |span: &Span, f: f64| {
        let phase = |t: f64| TAU * f * (t - session.start);
        let scale = TAU * f * span.duration();
        let (s0, c0) = phase(span.start).sin_cos();
        let (s1, c1) = phase(span.end).sin_cos();
        ((s1 - s0) / scale, (c0 - c1) / scale)
    };
    let mut sum = 0.0;
    let mut k = 0.5;
    while k < count {
        let f = lowest * (step * k).exp();
        let (a, b, s) = (response(a, f), response(b, f), response(session, f));
        sum += (a.0 - s.0) * (b.0 - s.0) + (a.1 - s.1) * (b.1 - s.1);
        k += 1.0;
    }
    sum * step / PI
}

#[test]
fn the_covariance_of_flicker_is_the_integral_of_its_spectrum() {
    let span = |start: f64, end: f64| Interval { start, end };
    let session = span(0.0, 60.0);
    let cases = [
        (span(0.0, 5.0), span(0.0, 5.0)),
        (span(0.0, 5.0), span(5.0, 10.0)),
        (span(0.0, 5.0), span(55.0, 60.0)),
        (span(20.0, 23.0), span(31.0, 41.0)),
        (span(27.5, 32.5), span(27.5, 32.5)),
        (session, session),
        (span(0.0, 5.0), session),
    ];
    for (a, b) in cases {
        let (expected, found) = (
            from_the_spectrum(&a, &b, &session),
            unit_flicker().covariance(&a, &b, &session),
        );
        // Cut off at 40 / T, the spectrum lacks 1 / (2 (40 pi)^2) of B^2; below 1e-5 / S next to nothing.
        assert!(
            (found - expected).abs() < 1e-4,
            "{a:?} {b:?}: {found}, from the spectrum {expected}"
        );
    }
}

#[test]
fn means_of_noise_drawn_at_random_have_the_covariance_claimed() {
    // One sample a second; flicker from before the session on, since it is remembered.
    let (before, session_length, runs) = (2048_usize, 512_usize, 1000_u32);
    let (noise, session) = (
        Noise {
            white: 4.0,
            ..unit_flicker()
        },
        Interval {
            start: 0.0,
            end: 512.0,
        },
    );
    let spans = [(0_u32, 40_u32), (40, 100), (200, 240), (500, 512)];
    let seed = 51;
    let mut draws = Draws::new(seed);
    let mut sums = [[0.0; 4]; 4];
    for _ in 0..runs {
        let bias = &flicker(&mut draws, before + session_length)[before..];
        let session_mean = bias.iter().sum::<f64>() / session_length as f64;
        let means = spans.map(|(start, end)| {
            let part = &bias[start as usize..end as usize];
            let length = part.len() as f64;
            part.iter().sum::<f64>() / length - session_mean + draws.normal() * (noise.white / length).sqrt()
        });
        for (i, row) in sums.iter_mut().enumerate() {
            for (j, sum) in row.iter_mut().enumerate() {
                *sum += means[i] * means[j] / f64::from(runs);
            }
        }
    }
    let span = |(start, end): (u32, u32)| Interval {
        start: f64::from(start),
        end: f64::from(end),
    };
    let claimed = |i: usize, j: usize| noise.covariance(&span(spans[i]), &span(spans[j]), &session);
    for i in 0..4 {
        for j in 0..4 {
            // A sample covariance of normal numbers scatters by sqrt((c_ii c_jj + c_ij^2) / runs). The memory cut off
            // before 2048 s and the step of one second leave some 0.01 out of it.
            let scatter = ((claimed(i, i) * claimed(j, j) + claimed(i, j).powi(2)) / f64::from(runs)).sqrt();
            let apart = (sums[i][j] - claimed(i, j)).abs();
            assert!(
                apart < 4.5 * scatter + 0.01,
                "seed {seed}: covariance of {i} and {j} {} claimed {}",
                sums[i][j],
                claimed(i, j)
            );
        }
    }
}

proptest! {
    #[test]
    fn white_noise_leaves_n_squared_over_t_and_no_covariance((parts, session) in partition(), density in 0.0..10.0_f64) {
        for (i, a) in parts.iter().enumerate() {
            for (j, b) in parts.iter().enumerate() {
                let expected = if i == j { density / a.duration() } else { 0.0 };
                prop_assert_eq!(white(density).covariance(a, b, &session), expected);
            }
        }
    }

    #[test]
    fn flicker_over_all_parts_of_a_session_sums_to_nothing((parts, session) in partition(), pick in any::<prop::sample::Index>()) {
        let b = pick.get(&parts);
        let sum: f64 = parts.iter().map(|a| a.duration() * unit_flicker().covariance(a, b, &session)).sum();
        prop_assert!(sum.abs() < 1e-9 * session.duration(), "{}", sum);
        let own = unit_flicker().covariance(&session, &session, &session);
        prop_assert!(own.abs() < 1e-12, "{}", own);
    }

    #[test]
    fn a_pool_of_intervals_covaries_as_the_sum_over_them((parts, session) in partition(), pick in any::<prop::sample::Index>()) {
        let flicker = Flicker::over(&session);
        let b = pick.get(&parts);
        let mut pool = Pool::empty();
        for (count, a) in parts.iter().enumerate() {
            let older = &parts[..count];
            let sum: f64 = older.iter().map(|a| a.duration() * unit_flicker().covariance(a, b, &session)).sum();
            let pooled = flicker.covariance_with_pool(&pool, older.iter(), &flicker.placed(b));
            prop_assert!((pooled - sum).abs() < 1e-11 * session.duration(), "{} {}", pooled, sum);
            pool.add(&flicker.placed(a));
        }
    }

    #[test]
    fn flicker_knows_no_scale_and_no_origin_of_time((parts, session) in partition(), scale in 1e-3..1e3_f64, shift in -100.0..100.0_f64) {
        let moved = |span: &Span| Interval { start: scale * span.start + shift, end: scale * span.end + shift };
        let (a, b) = (&parts[0], &parts[parts.len() - 1]);
        let here = unit_flicker().covariance(a, b, &session);
        let there = unit_flicker().covariance(&moved(a), &moved(b), &moved(&session));
        prop_assert!((here - there).abs() < 1e-7, "{} {}", here, there);
    }

    #[test]
    fn covariance_is_symmetric_and_no_variance_is_negative((parts, session) in partition(), density in 0.0..1.0_f64) {
        let noise = Noise { white: density, ..unit_flicker() };
        for a in &parts {
            for b in &parts {
                let (there, back) = (noise.covariance(a, b, &session), noise.covariance(b, a, &session));
                prop_assert!((there - back).abs() < 1e-9);
                // Any sum of two means has a variance too.
                let both = noise.covariance(a, a, &session) + noise.covariance(b, b, &session) + 2.0 * there;
                prop_assert!(both > -1e-9, "{}", both);
            }
        }
    }

    #[test]
    fn the_covariance_is_the_same_in_single_precision((parts, session) in partition()) {
        let origin = session.start;
        let from_origin = |span: &Span| Interval { start: span.start - origin, end: span.end - origin };
        for a in &parts {
            for b in &parts {
                // Spans that a clock in f32 can resolve, so that the law is about the covariance and not about the
                // clock.
                let [a, b, s] = [a, b, &session].map(|span| single(&from_origin(span)));
                let wide = |span: &Interval<f32>| Interval { start: f64::from(span.start), end: f64::from(span.end) };
                let expected = unit_flicker::<f64>().covariance(&wide(&a), &wide(&b), &wide(&s));
                let found = double(unit_flicker::<f32>().covariance(&a, &b, &s));
                // Four values of F, up to (D / L)^2 in size at the distance D = 16 L where the series takes over, L the
                // longer interval and l the shorter, each good to a rounding or two, over l / L; and the same for
                // interval and session, where F is below one.
                let (longer, shorter) = (a.duration().max(b.duration()), a.duration().min(b.duration()));
                let magnified = f64::from((256.0 * longer + s.duration()) / shorter);
                prop_assert!((found - expected).abs() <= rounding::<f32>(2.0) * magnified, "{} {}", found, expected);
            }
        }
    }
}

#[test]
fn the_allan_variance_of_flicker_is_its_floor_at_any_time() {
    let floor = 2.0 * LN_2 / PI;
    for tau in [1e-3, 0.1, 1.0, 50.0, 1e4] {
        let (first, second) = (
            Interval { start: 0.0, end: tau },
            Interval {
                start: tau,
                end: 2.0 * tau,
            },
        );
        let session = Interval {
            start: -3.0 * tau,
            end: 9.0 * tau,
        };
        let noise = unit_flicker::<f64>();
        let k = |a: &Span, b: &Span| noise.covariance(a, b, &session);
        let allan = 0.5 * (k(&first, &first) + k(&second, &second) - 2.0 * k(&first, &second));
        assert!((allan - floor).abs() < 1e-12, "{tau}: {allan}");
    }
}

#[test]
fn no_noise_has_no_covariance() {
    let span = Interval { start: 1.0, end: 4.0 };
    assert_eq!(Noise::<f64>::none().covariance(&span, &span, &span), 0.0);
}
