use super::*;
use crate::redundancy::draws::Draw;

const GRAVITY: f64 = 9.8;
const H: f64 = 0.05;
const SIGMA: f64 = 0.1;

type Readings = [Vector3<f64>; 2];

fn started() -> Navigation<f64> {
    Navigation::start(&(Vector3::z() * GRAVITY))
}

fn advance(unit: &mut Navigation<f64>, reading: &Readings, rests: bool) {
    unit.advance(&NavigationStep {
        reading,
        noise: &[3.6e-3 / 0.09, 4e-6 / 0.09],
        length: H,
        gravity: GRAVITY,
        rests,
    });
}

/// A unit that flies, tilted and turning, with a known course.
fn flying(draw: &mut Draw) -> Navigation<f64> {
    let mut unit = started();
    let (sine, cosine) = 0.7_f64.sin_cos();
    unit.course = LevelCourse::Known([sine, cosine]);
    for _ in 0..20 {
        let readings = [
            Vector3::z() * GRAVITY + draw.vector(2.0),
            Vector3::new(0.3, -0.2, 0.4) + draw.vector(0.1),
        ];
        advance(&mut unit, &readings, false);
    }
    unit
}

/// Errors of one kind each, small enough that all is linear.
fn small_errors() -> impl Iterator<Item = Errors<f64>> {
    const SMALL: f64 = 1e-6;
    let none = Errors::none();
    let delay = Errors { delay: SMALL, ..none };
    let each = (0..3).flat_map(move |axis| {
        let along = Vector3::ith(axis, SMALL);
        [
            Errors {
                attitude: along,
                ..none
            },
            Errors {
                velocity: along,
                ..none
            },
            Errors { rate: along, ..none },
            Errors { force: along, ..none },
        ]
    });
    each.chain([delay])
}

/// The errors that lead from one state to another.
fn errors_between(from: &Navigation<f64>, to: &Navigation<f64>) -> Errors<f64> {
    Errors {
        attitude: (to.level_from_primary * from.level_from_primary.inverse()).scaled_axis(),
        velocity: to.velocity - from.velocity,
        rate: to.rate_error - from.rate_error,
        force: to.force_error - from.force_error,
        delay: to.delay - from.delay,
    }
}

fn apart(one: &Errors<f64>, other: &Errors<f64>) -> f64 {
    let difference = one.plus(other, -1.0);
    difference.dot(&difference).sqrt()
}

fn aided(value: Vector3<f64>) -> Aided<f64> {
    Aided {
        value,
        sigma: Vector3::repeat(SIGMA),
        windows: 0.0,
        length: H,
    }
}

#[test]
fn an_error_moves_as_the_state_that_has_it() {
    let mut draw = Draw(1);
    for error in small_errors() {
        let mut unit = flying(&mut draw);
        unit.course = LevelCourse::Sought(CourseSearch::with(error));
        let mut wrong = unit;
        wrong.correct(&error);
        let readings = [draw.vector(10.0), draw.vector(0.5)];
        for each in [&mut unit, &mut wrong] {
            advance(each, &readings, false);
        }
        let moved = errors_between(&unit, &wrong);
        let carried = unit.course_search().map(|search| search.of_all());
        // Half a turn of a window is what the derivatives leave out.
        let carried = carried.expect("the search goes on");
        assert!(apart(&moved, &carried) < 2e-8, "{moved:?} {carried:?}");
    }
}

#[test]
fn an_innovation_changes_with_the_state_by_its_derivatives() {
    let mut draw = Draw(3);
    for error in small_errors() {
        let mut unit = flying(&mut draw);
        let aided = aided(draw.vector(3.0));
        let heading = AidedHeading {
            value: 0.3,
            sigma: 0.02,
            windows: 0.0,
        };
        for _ in 0..HEADINGS {
            assert!(unit.along_heading(&heading, false).is_none());
        }
        let mut wrong = unit;
        wrong.correct(&error);
        let innovations = |unit: &mut Navigation<f64>| {
            core::array::from_fn::<_, 7, _>(|number| {
                let innovation = match number {
                    0..3 => unit.along_level(number, &aided),
                    3..6 => unit.along_primary(number - 3, &aided),
                    _ => unit.along_heading(&heading, false),
                };
                innovation.expect("the course is known")
            })
        };
        for (right, wrong) in innovations(&mut unit).iter().zip(innovations(&mut wrong)) {
            let change = right.value - wrong.value;
            let predicted = right.row.dot(&error);
            assert!(
                (change - predicted).abs() < 1e-9,
                "{change} {predicted} {error:?}"
            );
        }
    }
}

/// Flies level at an acceleration that wanders, with velocities measured in a frame at a course, rad; calls with each.
fn flown(course: f64, seconds: f64, mut take: impl FnMut(&Readings, Option<Aided<f64>>)) {
    let mut draw = Draw(7);
    let (sine, cosine) = course.sin_cos();
    let mut velocity = Vector3::new(1.0, 0.5, 0.0);
    for window in 1..(seconds / H) as u32 {
        let t = f64::from(window) * H;
        let acceleration = Vector3::new((0.8 * t).sin(), (0.5 * t).cos(), 0.2 * (1.1 * t).sin());
        velocity += acceleration * H;
        let turned = Vector3::new(
            cosine * velocity.x - sine * velocity.y,
            sine * velocity.x + cosine * velocity.y,
            velocity.z,
        );
        let measured = (window % 4 == 0).then(|| aided(turned + draw.vector(SIGMA)));
        take(
            &[acceleration + Vector3::z() * GRAVITY, Vector3::zeros()],
            measured,
        );
    }
}

#[test]
fn the_likelihood_of_a_course_is_that_of_a_filter_that_knows_it() {
    let squares = |course: f64| {
        let (sine, cosine) = course.sin_cos();
        let (mut searching, mut knowing, mut sum) = (started(), started(), 0.0);
        flown(0.4, 6.0, |readings, measured| {
            advance(&mut searching, readings, false);
            advance(&mut knowing, readings, false);
            let Some(measured) = measured else { return };
            searching.begin_along_level(&measured);
            if knowing.course == LevelCourse::Unaided {
                let [x, y] = [0, 1].map(|axis| {
                    let [by_cosine, by_sine] = turned_back(axis, &measured.value.xy());
                    by_cosine * cosine + by_sine * sine
                });
                knowing.begin(Vector3::new(x, y, measured.value.z), &measured.sigma, &measured);
                knowing.course = LevelCourse::Known([sine, cosine]);
                return;
            }
            for axis in 0..3 {
                let innovation = knowing.along_level(axis, &measured).expect("the course is known");
                sum += innovation.sigmas().powi(2);
                knowing.update(&innovation);
            }
        });
        let search = searching.course_search().expect("it goes on");
        (search.likelihood().squares([sine, cosine]), sum)
    };
    for course in [0.5, 0.4, 0.2] {
        let (by_search, by_filter) = squares(course);
        assert!(
            (by_search - by_filter).abs() < 0.05 * by_filter,
            "{course}: {by_search} {by_filter}"
        );
    }
}

#[test]
fn the_course_is_found_within_its_sigma() {
    for number in 0..8_u32 {
        let course = f64::from(number) * 0.8 - 3.0;
        let mut unit = started();
        let mut found = None;
        flown(course, 9.5, |readings, measured| {
            advance(&mut unit, readings, false);
            let Some(measured) = measured else { return };
            unit.begin_along_level(&measured);
            if let Some(([sine, cosine], variance)) = unit
                .course_search()
                .and_then(|search| search.likelihood().found(0.0))
            {
                unit.choose_course([sine, cosine], variance);
                found = Some((sine.atan2(cosine), variance));
            }
        });
        let (angle, variance) = found.expect("the motion shows it");
        let beyond = within_half_a_turn(angle - course);
        assert!(beyond.powi(2) < 16.0 * variance, "{course}: {angle}, {variance}");
        assert!(matches!(unit.course, LevelCourse::Known(_)));
    }
}

#[test]
fn an_error_of_the_accelerometer_is_learned_in_seconds() {
    let mut unit = started();
    let error = 0.1;
    let readings = [Vector3::z() * (GRAVITY + error), Vector3::zeros()];
    for _ in 0..420 {
        advance(&mut unit, &readings, true);
        let aided = aided(Vector3::zeros());
        unit.begin_along_level(&aided);
        if let Some(innovation) = unit.along_level(2, &aided) {
            unit.update(&innovation);
        }
    }
    let found = unit.force_error.z + unit.course_search().map_or(0.0, |search| search.of_all().force.z);
    assert!((found - error).abs() < 0.1 * error, "{found}");
}

#[test]
fn an_axis_of_a_body_velocity_is_compared_without_the_others() {
    let unit = flying(&mut Draw(7));
    let all = aided(Vector3::new(3.0, -2.0, 0.5));
    for axis in 0..3 {
        let only = |value: &Vector3<f64>, other| {
            Vector3::from_fn(|row, _| if row == axis { value[row] } else { other })
        };
        let alone = Aided {
            value: only(&all.value, f64::NAN),
            sigma: only(&all.sigma, f64::INFINITY),
            ..all
        };
        for other in 0..3 {
            let innovation = unit.along_primary(other, &alone);
            let expected = unit.along_primary(other, &all).filter(|_| other == axis);
            assert_eq!(
                innovation.map(|each| [each.value, each.variance]),
                expected.map(|each| [each.value, each.variance]),
            );
        }
    }
}

#[test]
fn the_first_velocity_of_an_aiding_measurement_is_taken() {
    let first = aided(Vector3::new(3.0, -2.0, 0.5));
    let mut unit = started();
    unit.begin_along_level(&first);
    assert_eq!(unit.velocity.z, first.value.z);
    unit.choose_course([0.0, 1.0], 0.0);
    assert_eq!(unit.velocity, first.value);
    unit.begin_along_level(&aided(first.value * 1.01));
    assert_eq!(unit.velocity, first.value);
}

#[test]
fn headings_refer_to_the_mean_of_the_first_ones() {
    let mut draw = Draw(4);
    let heading = |value: f64| AidedHeading {
        value,
        sigma: 0.02,
        windows: 0.0,
    };
    let (mut unit, mut sum) = (started(), 0.0);
    for _ in 0..HEADINGS {
        let value = 1.2 + 0.1 * draw.normal();
        sum += value;
        assert!(unit.along_heading(&heading(value), false).is_none());
    }
    let mean = sum / f64::from(HEADINGS);
    let at_mean = unit.along_heading(&heading(mean), false);
    assert!(at_mean.is_some_and(|innovation| innovation.value.abs() < 1e-12));
    let beyond = unit.along_heading(&heading(mean + 0.1), false);
    assert!(beyond.is_some_and(|innovation| (innovation.value - 0.1).abs() < 1e-12));
}
