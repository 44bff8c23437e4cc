//! The conformance vectors of `vectors/`, in both precisions.

use std::path::PathBuf;

use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use tumble_core::gravity::normal;
use tumble_core::model::ErrorModel;
use tumble_core::moments::Moments;
use tumble_core::noise::{AllanLadder, Interval, Noise};
use tumble_core::real::{Real, real};
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::{Segment, Segmenter, SegmenterSettings, Stretch};
use tumble_core::turntable::fit::{Knowledge, fit};
use tumble_core::turntable::mounting::{PoseMean, fit_mounting};
use tumble_core::turntable::reference::fit_sphere;
use tumble_core::turntable::truth::{RestPair, from_reference};

/// One file of vectors, with the tolerance for the number type at hand.
struct Vectors {
    cases: Value,
    tolerance: f64,
}

/// A number type the vectors hold for.
trait Named: Real {
    const NAME: &'static str;
    fn wide(self) -> f64;
}

impl Named for f32 {
    const NAME: &'static str = "f32";
    fn wide(self) -> f64 {
        f64::from(self)
    }
}

impl Named for f64 {
    const NAME: &'static str = "f64";
    fn wide(self) -> f64 {
        self
    }
}

fn read<T: Named>(name: &str) -> Vectors {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("../../vectors/{name}.json"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let content: Value = serde_json::from_str(&text).expect("vectors are JSON");
    Vectors {
        tolerance: content["tolerance"][T::NAME].as_f64().expect("a tolerance"),
        cases: content["cases"].clone(),
    }
}

fn number<T: Real>(value: &Value) -> T {
    real(value.as_f64().expect("a number"))
}

fn vector<T: Real>(value: &Value) -> Vector3<T> {
    Vector3::from_fn(|i, _| number(&value[i]))
}

fn matrix<T: Real>(value: &Value) -> Matrix3<T> {
    Matrix3::from_fn(|i, j| number(&value[i][j]))
}

fn vectors_of<T: Real>(value: &Value) -> Vec<Vector3<T>> {
    value.as_array().expect("a list").iter().map(vector).collect()
}

/// Panics where a figure is farther from what is expected than the tolerance.
fn near<T: Named>(
    what: &str,
    found: impl IntoIterator<Item = T>,
    expected: impl IntoIterator<Item = T>,
    tolerance: f64,
) {
    for (found, expected) in found.into_iter().zip(expected) {
        let apart = (found.wide() - expected.wide()).abs();
        assert!(
            apart <= tolerance,
            "{what} ({}): {found} is {apart:e} from {expected}",
            T::NAME
        );
    }
}

fn model<T: Named>() {
    let Vectors { cases, tolerance } = read::<T>("model");
    for case in cases.as_array().expect("cases") {
        let model = ErrorModel {
            matrix: matrix::<T>(&case["M"]),
            bias: vector(&case["b"]),
        };
        let parts = model.decompose().expect("a right-handed triad");
        let angles = parts.angles(&model.bias);
        near(
            "scale",
            angles.scale.iter().copied(),
            vector(&case["scale"]).iter().copied(),
            tolerance,
        );
        near(
            "L",
            parts.non_orthogonality.iter().copied(),
            matrix(&case["L"]).iter().copied(),
            tolerance,
        );
        near(
            "Q",
            parts.mounting.matrix().iter().copied(),
            matrix(&case["Q"]).iter().copied(),
            tolerance,
        );
        let expected = vector(&case["non_orthogonality"]);
        near(
            "non-orthogonality",
            angles.non_orthogonality.iter().copied(),
            expected.iter().copied(),
            tolerance,
        );
        near(
            "mounting",
            angles.mounting.iter().copied(),
            vector(&case["mounting"]).iter().copied(),
            10.0 * tolerance,
        );
        let y = model.measure(&vector(&case["u"]));
        near(
            "y",
            y.iter().copied(),
            vector(&case["y"]).iter().copied(),
            10.0 * tolerance,
        );
        let u = model.correction().expect("an inverse").apply(&y);
        near(
            "corrected",
            u.iter().copied(),
            vector(&case["corrected"]).iter().copied(),
            20.0 * tolerance,
        );
    }
}

fn moments<T: Named>() {
    let Vectors { cases, tolerance } = read::<T>("moments");
    let mut moments = Moments::<T, 2>::new();
    for sample in cases["samples"].as_array().expect("samples") {
        moments.push(&[number(&sample[0]), number(&sample[1])]);
    }
    for channel in 0..2 {
        near(
            "mean",
            [moments.mean()[channel]],
            [number(&cases["mean"][channel])],
            tolerance,
        );
        near(
            "variance",
            [moments.variance()[channel]],
            [number(&cases["variance"][channel])],
            tolerance,
        );
    }
}

fn gravity<T: Named>() {
    let Vectors { cases, tolerance } = read::<T>("gravity");
    for case in cases.as_array().expect("cases") {
        let latitude: T = real(case["latitude_deg"].as_f64().expect("a latitude").to_radians());
        near(
            "gravity",
            [normal(latitude, number(&case["height_m"]))],
            [number(&case["gravity"])],
            tolerance,
        );
    }
}

fn allan<T: Named>() {
    let Vectors { cases, tolerance } = read::<T>("allan");
    let mut ladder = AllanLadder::<T>::new();
    for mean in cases["means"].as_array().expect("means") {
        ladder.push(&[number(mean); CHANNELS], number(&cases["block_s"]));
    }
    let rungs = cases["rungs"].as_array().expect("rungs");
    assert_eq!(ladder.variances(4).count(), rungs.len());
    for ((averaging, variance, pairs), rung) in ladder.variances(4).zip(rungs) {
        near("averaging time", [averaging], [number(&rung["averaging"])], 1e-5);
        near("variance", [variance], [number(&rung["variance"])], tolerance);
        assert_eq!(u64::from(pairs), rung["pairs"].as_u64().expect("a count"));
    }
}

fn sphere<T: Named>() {
    let Vectors { cases, tolerance } = read::<T>("sphere");
    let sigma: T = number(&cases["sigma"]);
    let rests: Vec<_> = vectors_of(&cases["rests"])
        .into_iter()
        .map(|rest| (rest, Matrix3::identity() * (sigma * sigma)))
        .collect();
    let found = fit_sphere(&rests, number(&cases["gravity"])).expect("a sphere");
    near(
        "bias",
        found.bias.iter().copied(),
        vector(&cases["bias"]).iter().copied(),
        tolerance,
    );
    let sigmas = found.covariance.diagonal().map(|variance| variance.sqrt());
    near(
        "sigma",
        sigmas.iter().copied(),
        vector(&cases["bias_sigma"]).iter().copied(),
        tolerance,
    );
}

fn mounting<T: Named>() {
    let Vectors { cases, tolerance } = read::<T>("mounting");
    let poses: Vec<_> = vectors_of(&cases["measured"])
        .into_iter()
        .zip(vectors_of(&cases["up"]))
        .map(|(measured, up)| PoseMean {
            measured,
            up,
            sigma: real(1e-3),
        })
        .collect();
    let found = fit_mounting(&poses, number::<T>(&cases["gravity"])).expect("a rotation");
    let turned = found.rotation.scaled_axis();
    near(
        "rotation",
        turned.iter().copied(),
        vector(&cases["rotation_vector"]).iter().copied(),
        tolerance,
    );
    near(
        "bias",
        found.bias.iter().copied(),
        vector(&cases["bias"]).iter().copied(),
        10.0 * tolerance,
    );
}

fn triad<T: Named>() {
    let Vectors { cases, tolerance } = read::<T>("triad");
    let gravity: T = number(&cases["gravity"]);
    let (rest, gap): (T, T) = (number(&cases["rest_s"]), number(&cases["gap_s"]));
    let variance = |name: &str| {
        let sigma: T = number(&cases[name]);
        sigma * sigma
    };
    let covariance = Matrix3::identity() * variance("sigma_reference");
    let (reference, target) = (
        vectors_of::<T>(&cases["reference"]),
        vectors_of::<T>(&cases["target"]),
    );
    let rests: Vec<_> = reference.iter().map(|mean| (*mean, covariance)).collect();
    let sphere = fit_sphere(&rests, gravity).expect("a sphere");
    let mut start = T::zero();
    let mut observations = Vec::new();
    for (reference, target) in reference.iter().zip(&target) {
        let pair = RestPair {
            interval: Interval {
                start,
                end: start + rest,
            },
            reference: *reference,
            reference_covariance: covariance,
            target: *target,
            up: None,
        };
        observations.push(from_reference(&pair, &sphere, gravity));
        start += rest + gap;
    }
    let noise = Noise {
        white: variance("sigma_target") * rest,
        ..Noise::none()
    };
    let knowledge = Knowledge {
        noise: [noise; 3],
        session: Interval {
            start: T::zero(),
            end: start - gap,
        },
        nominal: Matrix3::identity(),
        largest_bias: real(20.0),
        shared: sphere.covariance,
    };
    let found = fit::<T, 4, 3, 15>(&observations, &knowledge).expect("a solution");
    let expected = matrix::<T>(&cases["M"]);
    for parameter in 0..12 {
        let sigma = cases["sigma"][parameter].as_f64().expect("a sigma");
        let (found_value, expected_value) = match parameter {
            0..9 => (
                found.model.matrix[(parameter / 3, parameter % 3)],
                expected[(parameter / 3, parameter % 3)],
            ),
            _ => (
                found.model.bias[parameter - 9],
                number(&cases["b"][parameter - 9]),
            ),
        };
        near("M, b", [found_value], [expected_value], tolerance * sigma);
        let stated = found.covariance[(parameter, parameter)].sqrt();
        near("sigma", [stated], [real(sigma)], tolerance * sigma);
    }
}

fn stream<T: Named>() {
    let Vectors { cases, .. } = read::<T>("stream");
    let (force, rate) = (
        number::<T>(&cases["force_step"]),
        number::<T>(&cases["rate_step"]),
    );
    let interval = cases["interval_us"].as_u64().expect("an interval");
    let mut segmenter = Segmenter::new(SegmenterSettings::default());
    let (mut rests, mut turns): (Vec<Stretch<T>>, Vec<Stretch<T>>) = (Vec::new(), Vec::new());
    let mut keep = |segment| match segment {
        Segment::Rest(rest) => rests.push(rest),
        Segment::Turn(turn) => turns.push(turn),
    };
    for (k, counts) in (0..).zip(cases["counts"].as_array().expect("counts")) {
        let y: [T; CHANNELS] =
            core::array::from_fn(|i| number::<T>(&counts[i]) * if i < 3 { force } else { rate });
        segmenter.push_channels(k * interval, &y).map(&mut keep);
    }
    while let Some(segment) = segmenter.finish() {
        keep(segment);
    }
    let boundary = cases["boundary_tolerance_s"].as_f64().expect("a tolerance");
    let expected = cases["rests_s"].as_array().expect("rests");
    assert_eq!(rests.len(), expected.len(), "{}", T::NAME);
    for (rest, expected) in rests.iter().zip(expected) {
        let microseconds = |time: u64| f64::from(u32::try_from(time).expect("a short stream")) * 1e-6;
        near(
            "start",
            [microseconds(rest.start)],
            [number(&expected[0])],
            boundary,
        );
        near("end", [microseconds(rest.end)], [number(&expected[1])], boundary);
        let tolerance = cases["bias_tolerance"].as_f64().expect("a tolerance");
        near(
            "bias",
            rest.angular_rate().iter().copied(),
            vector(&cases["bias"]).iter().copied(),
            tolerance,
        );
    }
    let turn = turns.last().expect("a turn");
    let angle = turn.angle() - vector::<T>(&cases["bias"]) * turn.duration();
    let tolerance = cases["turn_angle_tolerance"].as_f64().expect("a tolerance");
    near(
        "angle",
        angle.iter().copied(),
        vector(&cases["turn_angle"]).iter().copied(),
        tolerance,
    );
}

macro_rules! in_both_precisions {
    ($($name:ident: $law:ident),+ $(,)?) => {$(
        #[test]
        fn $name() {
            $law::<f64>();
            $law::<f32>();
        }
    )+};
}

in_both_precisions! {
    the_error_model_agrees_with_its_vectors: model,
    moments_agree_with_their_vectors: moments,
    normal_gravity_agrees_with_its_vectors: gravity,
    the_allan_ladder_agrees_with_its_vectors: allan,
    the_sphere_agrees_with_its_vectors: sphere,
    the_mounting_angle_agrees_with_its_vectors: mounting,
    a_triad_agrees_with_its_vectors: triad,
    rests_and_turns_agree_with_their_vectors: stream,
}
