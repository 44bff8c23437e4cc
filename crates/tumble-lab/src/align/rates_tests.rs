use proptest::prelude::*;

use super::*;
use crate::align::samples::Triangle;

const STEP: f64 = 1e-6;

fn pair(seed: &[f64]) -> TrianglePair {
    TrianglePair {
        time: 12.0 + seed[0],
        block: 0,
        primary: Triangle {
            mean: SVector::from_fn(|i, _| seed[i]),
            slope: SVector::from_fn(|i, _| seed[11 - i]),
            curvature: SVector::from_fn(|i, _| seed[(i + 2) % 12]),
            jerk: SVector::from_fn(|i, _| seed[(i + 7) % 12]),
        },
        secondary: Triangle {
            mean: SVector::from_fn(|i, _| seed[i + 3]),
            slope: SVector::from_fn(|i, _| seed[i + 5]),
            curvature: SVector::from_fn(|i, _| seed[i + 1]),
            jerk: SVector::from_fn(|i, _| seed[i + 4]),
        },
    }
}

fn guess(seed: &[f64]) -> RateUnknowns {
    RateUnknowns {
        rotation: Rotation3::new(Vector3::new(seed[0], seed[1], seed[2])),
        stretch: SVector::from_fn(|i, _| 0.02 * seed[i]),
        stretchable: Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 1.0)),
        bias: Vector3::new(seed[3], seed[4], seed[5]),
        clock: RelativeClock {
            offset: 0.1,
            skew: 1e-5,
            reference: 10.0,
        },
        second: 0.1 * seed[5],
        bends: true,
    }
}

proptest! {
    /// The derivative by the clock is the slope of the secondary's means: a later clock shows them earlier.
    #[test]
    fn the_derivatives_of_the_residual_agree_with_differences(seed in prop::collection::vec(-2.0..2.0_f64, 12)) {
        let pair = pair(&seed);
        let (design, before) = guess(&seed).row(&pair);
        for k in 0..UNKNOWNS {
            let mut by = SVector::<f64, UNKNOWNS>::zeros();
            by[k] = STEP;
            let mut moved = guess(&seed);
            moved.change(&by, 1.0);
            let later = by[OFFSET] + by[SKEW] * (pair.time - 10.0);
            let mut shifted = pair;
            shifted.secondary.mean -= pair.secondary.slope * later;
            let (_, after) = moved.row(&shifted);
            let expected = (before - after) / STEP;
            prop_assert!((design.column(k) - expected).norm() < 2e-5, "unknown {k}: {} {expected}", design.column(k));
        }
    }
}

#[test]
fn eigenvectors_below_a_limit_are_the_axes_that_are_not_seen() {
    let information = Matrix3::from_diagonal(&Vector3::new(5.0, 1e-9, 4.0));
    let [axis] = directions_below(&information, 1e-6)[..] else {
        panic!("one axis is below")
    };
    assert!((axis.y.abs() - 1.0).abs() < 1e-12);
    assert!(directions_below(&information, 1e-12).is_empty());
}
