use proptest::prelude::*;

use super::*;
use crate::align::samples::Triangle;

const STEP: f64 = 1e-6;

/// A pair whose products of rates are those of its rates.
fn pair(seed: &[f64]) -> TrianglePair {
    let (x, y, z) = (seed[0], seed[1], seed[2]);
    let products = [x * x, x * y, x * z, y * y, y * z, z * z];
    TrianglePair {
        time: 0.0,
        block: 0,
        primary: Triangle {
            mean: SVector::from_fn(|i, _| if i < 6 { seed[i] } else { products[i - 6] }),
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

fn guess(seed: &[f64]) -> ForceUnknowns {
    ForceUnknowns {
        arm: Vector3::new(seed[6], seed[7], seed[8]),
        bias: Vector3::new(seed[3], seed[4], seed[5]),
        rotation: Rotation3::new(Vector3::new(seed[0], seed[1], seed[2])),
        axes: Vec::new(),
        angle: Vector3::new(seed[9], seed[10], seed[11]) * 0.02,
        stretch: SVector::from_fn(|i, _| 0.02 * seed[i]),
        stretchable: Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 1.0)),
        rate_bias: Vector3::new(seed[1], seed[2], seed[3]) * 0.1,
        delays: SensorDelays {
            secondary_force: 1e-3 * seed[0],
            primary_rate: 1e-2 * seed[1],
        },
        averaged_at: SensorDelays {
            secondary_force: 1e-3 * seed[2],
            primary_rate: 1e-2 * seed[4],
        },
        response: ResponseTerms {
            second: 0.1 * seed[5],
            third: 0.1 * seed[7],
        },
        rate_second: 0.1 * seed[9],
        bends: true,
    }
}

proptest! {
    #[test]
    fn the_derivatives_of_the_residual_agree_with_differences(seed in prop::collection::vec(-2.0..2.0_f64, 12)) {
        let pair = pair(&seed);
        let (design, before) = guess(&seed).row(&pair);
        for k in 0..UNKNOWNS {
            let mut by = SVector::<f64, UNKNOWNS>::zeros();
            by[k] = STEP;
            let mut moved = guess(&seed);
            moved.change(&by);
            let expected = (before - moved.row(&pair).1) / STEP;
            let scale = 1.0 + expected.norm();
            prop_assert!((design.column(k) - expected).norm() < 1e-4 * scale, "unknown {k}: {} {expected}", design.column(k));
        }
    }

    #[test]
    fn the_matrix_of_the_lever_arm_gives_what_a_rigid_body_does(seed in prop::collection::vec(-2.0..2.0_f64, 12)) {
        let (pair, guess) = (pair(&seed), guess(&seed));
        let w = rate_of(&pair.primary.mean) - guess.rate_bias;
        let change = rate_of(&pair.primary.slope);
        let expected = change.cross(&guess.arm) + w.cross(&w.cross(&guess.arm));
        prop_assert!((guess.lever(&pair)[0] * guess.arm - expected).norm() < 1e-12);
    }
}
