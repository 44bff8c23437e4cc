use super::*;
use crate::redundancy::draws::Draw;

const GRAVITY: f64 = 9.8;
const H: f64 = 0.05;
const TOLERATED: ForceAndRate<f64> = ForceAndRate {
    specific_force: 0.05,
    angular_rate: 0.0075,
};

type Set = Navigation<f64, 2>;
type Readings = [Vector3<f64>; 2];

fn started() -> Set {
    Navigation::start(&(Vector3::z() * GRAVITY), &Vector3::zeros(), true, &TOLERATED)
}

fn advance(set: &mut Set, measured: &Readings, deviations: &[Readings; 2], rests: bool) {
    let [force, rate] = measured;
    set.advance(&NavigationStep {
        measured: [force, rate],
        deviations,
        length: H,
        gravity: GRAVITY,
        rests,
    });
}

/// A set that flies, tilted and turning, with a known heading.
fn flying(draw: &mut Draw) -> Set {
    let mut set = started();
    set.heading = Heading::Known;
    for _ in 0..20 {
        let readings = [
            Vector3::z() * GRAVITY + draw.vector(2.0),
            Vector3::new(0.3, -0.2, 0.4) + draw.vector(0.1),
        ];
        advance(&mut set, &readings, &[[Vector3::zeros(); 2]; 2], false);
    }
    set
}

/// Errors of one kind each, small enough that all is linear.
fn small_errors() -> impl Iterator<Item = Errors<f64>> {
    const SMALL: f64 = 1e-6;
    (0..3).flat_map(|axis| {
        let along = Vector3::ith(axis, SMALL);
        let none = Errors::none();
        let attitude = Errors {
            attitude: along,
            ..none
        };
        let velocity = Errors {
            velocity: along,
            ..none
        };
        let rate = Errors { rate: along, ..none };
        [
            attitude,
            velocity,
            rate,
            Errors {
                vertical: SMALL,
                ..none
            },
        ]
    })
}

/// The errors that lead from one state to another.
fn errors_between(from: &Set, to: &Set) -> Errors<f64> {
    Errors {
        attitude: (to.level_from_primary * from.level_from_primary.inverse()).scaled_axis(),
        velocity: to.velocity - from.velocity,
        rate: to.rate_error - from.rate_error,
        vertical: to.vertical_error - from.vertical_error,
    }
}

fn apart(one: &Errors<f64>, other: &Errors<f64>) -> f64 {
    let difference = one.plus(other, -1.0);
    difference.dot(&difference).sqrt()
}

#[test]
fn an_error_moves_as_the_state_that_has_it() {
    let mut draw = Draw(1);
    for error in small_errors() {
        let mut set = flying(&mut draw);
        set.deviations = [[error, Errors::none()], [Errors::none(), error]];
        let mut wrong = set;
        wrong.correct(&error);
        let readings = [draw.vector(10.0), draw.vector(0.5)];
        for each in [&mut set, &mut wrong] {
            advance(each, &readings, &[[Vector3::zeros(); 2]; 2], false);
        }
        let moved = errors_between(&set, &wrong);
        let [[of_force, _], [_, of_rate]] = &set.deviations;
        // Half a turn of a window is what the derivatives leave out.
        assert!(apart(&moved, of_force) < 2e-8, "{moved:?} {of_force:?}");
        assert!(apart(&moved, of_rate) < 2e-8, "{moved:?} {of_rate:?}");
    }
}

#[test]
fn a_deviation_moves_the_state_as_a_reading_with_it_would() {
    let mut draw = Draw(2);
    for _ in 0..10 {
        let set = flying(&mut draw);
        let readings = [draw.vector(10.0), draw.vector(0.5)];
        let deviation = [draw.vector(1e-5), draw.vector(1e-6)];
        let [force, rate] = deviation;
        let deviations = [[force, Vector3::zeros()], [Vector3::zeros(), rate]];
        let mut of_set = set;
        advance(&mut of_set, &readings, &deviations, false);
        let [[of_force, _], [_, of_rate]] = &of_set.deviations;
        for (own, measured) in [
            (of_force, [readings[0] + force, readings[1]]),
            (of_rate, [readings[0], readings[1] + rate]),
        ] {
            let mut other = set;
            advance(&mut other, &measured, &[[Vector3::zeros(); 2]; 2], false);
            let moved = errors_between(&of_set, &other);
            assert!((moved.attitude - own.attitude).norm() < 2e-9, "{moved:?} {own:?}");
            // A rate moves the velocity by half the attitude of the window, which is left to the next one.
            let by_attitude = 0.5 * H * readings[0].norm() * own.attitude.norm();
            assert!(
                (moved.velocity - own.velocity).norm() < 2e-9 + by_attitude,
                "{moved:?} {own:?}"
            );
        }
    }
}

#[test]
fn an_innovation_changes_with_the_state_by_its_derivatives() {
    let mut draw = Draw(3);
    for error in small_errors() {
        let mut set = flying(&mut draw);
        let aided = Aided {
            value: draw.vector(3.0),
            sigma: Vector3::repeat(0.1),
            windows: 0.0,
            length: H,
        };
        let heading = AidedHeading {
            value: 0.3,
            sigma: 0.02,
            windows: 0.0,
        };
        for _ in 0..HEADINGS {
            assert!(set.along_heading(&heading, false).is_none());
        }
        let mut wrong = set;
        wrong.correct(&error);
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let innovations = |set: &mut Set| {
            core::array::from_fn::<_, 7, _>(|number| {
                let innovation = match number {
                    0..3 => set.along_level(&axes[number], &aided),
                    3..6 => set.along_primary(&axes[number - 3], &aided),
                    _ => set.along_heading(&heading, false),
                };
                innovation.expect("the heading is known")
            })
        };
        for (right, wrong) in innovations(&mut set).iter().zip(innovations(&mut wrong)) {
            let change = right.of_set - wrong.of_set;
            let predicted = right.row.dot(&error);
            assert!(
                (change - predicted).abs() < 1e-9,
                "{change} {predicted} {error:?}"
            );
        }
    }
}

#[test]
fn noise_grows_with_time_and_with_the_square_of_motion() {
    let still = Vector3::zeros();
    let (rate, force) = (Vector3::new(0.2, -0.7, 0.4), Vector3::new(3.0, 1.0, -2.0));
    let variances = |times: f64, windows: f64| noise(&(rate * times), &(force * times), windows * H);
    let at_rest = noise(&still, &still, H);
    assert!(at_rest.attitude.min() > 0.0 && at_rest.velocity.min() > 0.0 && at_rest.vertical > 0.0);
    let once = variances(1.0, 1.0).plus(&at_rest, -1.0);
    let twice = variances(2.0, 1.0).plus(&at_rest, -1.0);
    assert!(once.attitude.min() > 0.0 && once.velocity.min() > 0.0);
    assert!(apart(&twice, &once.plus(&once, 3.0)) < 1e-15);
    let longer = variances(1.0, 2.0);
    assert!(apart(&longer, &variances(1.0, 1.0).plus(&variances(1.0, 1.0), 1.0)) < 1e-15);
}

#[test]
fn a_tolerated_error_of_vertical_force_is_learned_in_seconds() {
    let mut set = started();
    let error = 0.6 * TOLERATED.specific_force;
    let aided = Aided {
        value: Vector3::zeros(),
        sigma: Vector3::repeat(0.02),
        windows: 0.0,
        length: H,
    };
    let readings = [Vector3::z() * (GRAVITY + error), Vector3::zeros()];
    for _ in 0..200 {
        advance(&mut set, &readings, &[[Vector3::zeros(); 2]; 2], true);
        if let Some(innovation) = set.along_level(&Vector3::z(), &aided) {
            set.update(&innovation);
        }
    }
    assert!(
        (set.vertical_error - error).abs() < 0.1 * error,
        "{}",
        set.vertical_error
    );
}

#[test]
fn the_first_velocity_of_an_aiding_measurement_is_taken() {
    let aided = Aided {
        value: Vector3::new(3.0, -2.0, 0.5),
        sigma: Vector3::repeat(0.2),
        windows: 0.0,
        length: H,
    };
    let mut set = started();
    set.begin_along_level(&aided);
    assert_eq!(set.velocity, aided.value);
    let later = Aided {
        value: aided.value * 1.01,
        ..aided
    };
    set.begin_along_level(&later);
    assert_eq!(set.velocity, aided.value);
}

#[test]
fn headings_refer_to_the_mean_of_the_first_ones() {
    let mut draw = Draw(4);
    let heading = |value: f64| AidedHeading {
        value,
        sigma: 0.02,
        windows: 0.0,
    };
    let (mut set, mut sum) = (started(), 0.0);
    for _ in 0..HEADINGS {
        let value = 1.2 + 0.1 * draw.normal();
        sum += value;
        assert!(set.along_heading(&heading(value), false).is_none());
    }
    let mean = sum / f64::from(HEADINGS);
    let at_mean = set.along_heading(&heading(mean), false);
    assert!(at_mean.is_some_and(|innovation| innovation.of_set.abs() < 1e-12));
    let beyond = set.along_heading(&heading(mean + 0.1), false);
    assert!(beyond.is_some_and(|innovation| (innovation.of_set - 0.1).abs() < 1e-12));
}
