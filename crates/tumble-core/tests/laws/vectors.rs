//! The conformance vectors of `vectors/`, in both precisions.

use std::path::PathBuf;

use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use tumble_core::gravity::normal;
use tumble_core::magnetometer::MagnetometerModel;
use tumble_core::model::ErrorModel;
use tumble_core::moments::Moments;
use tumble_core::noise::{AllanLadder, Interval, Noise};
use tumble_core::real::{Real, real};
use tumble_core::redundancy::model::error::{Parameters, RateBlock, SecondaryErrors};
use tumble_core::redundancy::model::means::{LeakyMean, LeakyMeans};
use tumble_core::redundancy::model::monitor::SetMonitor;
use tumble_core::redundancy::model::motion::{MOTION, MotionOfSet};
use tumble_core::redundancy::model::window::UnitWindows;
use tumble_core::redundancy::monitor::Monitor;
use tumble_core::redundancy::monitor::event::EventKind;
use tumble_core::redundancy::platform::{MountedUnit, Platform, PrimaryCalibration};
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::RedundancySettings;
use tumble_core::sample::{CHANNELS, Sample};
use tumble_core::segmenter::{FinishedSegment, Segment, Segmenter, SegmenterSettings};
use tumble_core::spin::collector::Collector;
use tumble_core::spin::settings::SpinSettings;
use tumble_core::temperature::TemperatureDrift;
use tumble_core::turntable::fit::fit;
use tumble_core::turntable::mounting::{PoseMean, fit_mounting};
use tumble_core::turntable::observation::FitInputs;
use tumble_core::turntable::reference::fit_sphere;
use tumble_core::turntable::truth::{CommonRest, from_reference};

/// One file of vectors.
struct Vectors {
    cases: Value,
    tolerances: Value,
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

impl Vectors {
    /// Tolerance of a quantity, in the number type at hand.
    fn tolerance<T: Named>(&self, quantity: &str) -> f64 {
        let tolerance = self.tolerances[quantity][T::NAME].as_f64();
        tolerance.unwrap_or_else(|| panic!("no tolerance for {quantity} in {}", T::NAME))
    }

    /// Panics where a quantity is farther from what a case expects than its tolerance.
    fn check<T: Named>(&self, case: &Value, quantity: &str, found: impl IntoIterator<Item = T>) {
        let tolerance = self.tolerance::<T>(quantity);
        let found: Vec<T> = found.into_iter().collect();
        let expected = numbers(&case[quantity]);
        assert_eq!(found.len(), expected.len(), "{quantity}");
        for (found, expected) in found.iter().zip(expected) {
            let apart = (found.wide() - expected).abs();
            assert!(
                apart <= tolerance,
                "{quantity} ({}): {found} is {apart:e} from {expected}",
                T::NAME
            );
        }
    }
}

/// All numbers of a value, row by row.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(parts) => parts.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().expect("a number")],
    }
}

fn read(name: &str) -> Vectors {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("../../vectors/{name}.json"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let content: Value = serde_json::from_str(&text).expect("vectors are JSON");
    Vectors {
        tolerances: content["tolerance"].clone(),
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

/// The elements of a matrix as vectors files have them, row by row.
fn rows<T: Real>(matrix: &Matrix3<T>) -> Vec<T> {
    matrix.transpose().iter().copied().collect()
}

fn model<T: Named>() {
    let vectors = read("model");
    for case in vectors.cases.as_array().expect("cases") {
        let model = ErrorModel {
            matrix: matrix::<T>(&case["M"]),
            bias: vector(&case["b"]),
        };
        let parts = model.decompose().expect("a right-handed triad");
        let angles = parts.parameters(&model.bias);
        vectors.check(case, "scale", angles.scale.iter().copied());
        vectors.check(case, "L", rows(&parts.non_orthogonality));
        vectors.check(case, "Q", rows(parts.mounting.matrix()));
        vectors.check(
            case,
            "non_orthogonality",
            angles.non_orthogonality.iter().copied(),
        );
        vectors.check(case, "mounting", angles.mounting.iter().copied());
        let y = model.measure(&vector(&case["u"]));
        vectors.check(case, "y", y.iter().copied());
        let u = model.correction().expect("an inverse").apply(&y);
        vectors.check(case, "corrected", u.iter().copied());
    }
}

fn temperature<T: Named>() {
    let vectors = read("temperature");
    for case in vectors.cases.as_array().expect("cases") {
        let powers = |name: &str| [0, 1, 2].map(|power| vector::<T>(&case[name][power]));
        let drift = TemperatureDrift {
            reference: number(&case["reference"]),
            range: [number(&case["range"][0]), number(&case["range"][1])],
            bias: powers("bias"),
            scale: powers("scale"),
        };
        let (y, b) = (vector(&case["y"]), vector(&case["b"]));
        let found = drift.at_reference(&y, &b, number(&case["temperature"]));
        vectors.check(case, "at_reference", found.iter().copied());
        if T::NAME == f32::NAME {
            let bits = found.map(|value| f64::from((value.wide() as f32).to_bits()));
            assert_eq!(bits.as_slice(), numbers(&case["bits"]));
        }
    }
}

fn magnetometer<T: Named>() {
    let vectors = read("magnetometer");
    for case in vectors.cases.as_array().expect("cases") {
        let unit = MagnetometerModel {
            model: ErrorModel {
                matrix: matrix(&case["M"]),
                bias: vector(&case["b"]),
            },
            current: vector(&case["current"]),
        };
        let correction = unit.correction().expect("an inverse");
        let field = correction.apply(&vector::<T>(&case["y"]), number(&case["load"]));
        vectors.check(case, "field", field.iter().copied());
    }
}

fn moments<T: Named>() {
    let vectors = read("moments");
    let mut moments = Moments::<T, 2>::new();
    for sample in vectors.cases["samples"].as_array().expect("samples") {
        moments.push(&[number(&sample[0]), number(&sample[1])]);
    }
    vectors.check(&vectors.cases, "mean", *moments.mean());
    vectors.check(&vectors.cases, "variance", moments.variance());
}

fn gravity<T: Named>() {
    let vectors = read("gravity");
    for case in vectors.cases.as_array().expect("cases") {
        let latitude: T = real(case["latitude_deg"].as_f64().expect("a latitude").to_radians());
        vectors.check(case, "gravity", [normal(latitude, number(&case["height_m"]))]);
    }
}

fn allan<T: Named>() {
    let vectors = read("allan");
    let cases = &vectors.cases;
    let mut ladder = AllanLadder::<T>::new();
    for mean in cases["means"].as_array().expect("means") {
        ladder.push(&[number(mean); CHANNELS], number(&cases["block_s"]));
    }
    let octaves = cases["octaves"].as_array().expect("octaves");
    assert_eq!(ladder.variances(4).count(), octaves.len());
    for ((averaging, variance, pairs), octave) in ladder.variances(4).zip(octaves) {
        vectors.check(octave, "averaging", [averaging]);
        vectors.check(octave, "variance", [variance]);
        assert_eq!(u64::from(pairs), octave["pairs"].as_u64().expect("a count"));
    }
}

fn sphere<T: Named>() {
    let vectors = read("sphere");
    let cases = &vectors.cases;
    let sigma: T = number(&cases["sigma"]);
    let rests: Vec<_> = vectors_of(&cases["rests"])
        .into_iter()
        .map(|rest| (rest, Matrix3::identity() * (sigma * sigma)))
        .collect();
    let found = fit_sphere(&rests, number(&cases["gravity"])).expect("a sphere");
    vectors.check(cases, "bias", found.bias.iter().copied());
    let sigmas = found.covariance.diagonal().map(|variance| variance.sqrt());
    vectors.check(cases, "bias_sigma", sigmas.iter().copied());
}

fn mounting<T: Named>() {
    let vectors = read("mounting");
    let cases = &vectors.cases;
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
    vectors.check(
        cases,
        "rotation_vector",
        found.rotation.scaled_axis().iter().copied(),
    );
    vectors.check(cases, "bias", found.bias.iter().copied());
}

fn triad<T: Named>() {
    let vectors = read("triad");
    let cases = &vectors.cases;
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
        let pair = CommonRest {
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
    let knowledge = FitInputs {
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
    let m_and_b = |m: &Matrix3<T>, b: &Vector3<T>| [rows(m), b.iter().copied().collect()].concat();
    let expected = m_and_b(&matrix(&cases["M"]), &vector(&cases["b"]));
    let found_values = m_and_b(&found.model.matrix, &found.model.bias);
    for (i, sigma) in numbers(&cases["sigma"]).into_iter().enumerate() {
        let quantity = if i < 9 { "M" } else { "b" };
        let apart = (found_values[i].wide() - expected[i].wide()).abs() / sigma;
        assert!(
            apart <= vectors.tolerance::<T>(quantity),
            "{quantity} ({}), element {i}: {apart} sigma apart",
            T::NAME
        );
        let stated = found.covariance[(i, i)].sqrt().wide() / sigma;
        assert!(
            (stated - 1.0).abs() <= vectors.tolerance::<T>("sigma"),
            "sigma ({}), element {i}: {stated} of what is expected",
            T::NAME
        );
    }
}

fn stream<T: Named>() {
    let vectors = read("stream");
    let cases = &vectors.cases;
    let (force, rate) = (
        number::<T>(&cases["force_step"]),
        number::<T>(&cases["rate_step"]),
    );
    let interval = cases["interval_us"].as_u64().expect("an interval");
    let mut segmenter = Segmenter::new(SegmenterSettings::default());
    let (mut rests, mut turns): (Vec<Segment<T>>, Vec<Segment<T>>) = (Vec::new(), Vec::new());
    let mut keep = |segment| match segment {
        FinishedSegment::Rest(rest) => rests.push(rest),
        FinishedSegment::Turn(turn) => turns.push(turn),
    };
    for (k, counts) in (0..).zip(cases["counts"].as_array().expect("counts")) {
        let y: [T; CHANNELS] =
            core::array::from_fn(|i| number::<T>(&counts[i]) * if i < 3 { force } else { rate });
        segmenter.push_channels(k * interval, &y).map(&mut keep);
    }
    while let Some(segment) = segmenter.finish() {
        keep(segment);
    }
    let expected = cases["rests_s"].as_array().expect("rests");
    assert_eq!(rests.len(), expected.len(), "{}", T::NAME);
    let times = |rest: &Segment<T>| [rest.start, rest.end].map(tumble_core::real::seconds::<T>);
    vectors.check(cases, "rests_s", rests.iter().flat_map(times));
    for rest in &rests {
        vectors.check(cases, "bias", rest.angular_rate().iter().copied());
    }
    let between = turns
        .iter()
        .find(|turn| turn.start == rests[0].end)
        .expect("a turn");
    let angle = between.angle() - vector::<T>(&cases["bias"]) * between.duration();
    vectors.check(cases, "turn_angle", angle.iter().copied());
}

/// Tests whether sample `k` was taken while the robot stood.
fn resting(cases: &Value, time: u64) -> bool {
    let within = |rest: &Value| {
        let [start, end] = [&rest[0], &rest[1]].map(|time| time.as_f64().expect("a time"));
        (start..=end).contains(&(time as f64 * 1e-6))
    };
    cases["rests_s"].as_array().expect("rests").iter().any(within)
}

fn spin<T: Named>() {
    let vectors = read("spin");
    let cases = &vectors.cases;
    let (force, rate): (T, T) = (number(&cases["force_step"]), number(&cases["rate_step"]));
    let mut collector = Collector::new(&SpinSettings {
        gravity: number(&cases["gravity"]),
        ..SpinSettings::default()
    });
    let interval = cases["interval_us"].as_u64().expect("an interval");
    let mut stood = true;
    for (k, counts) in (0..).zip(cases["counts"].as_array().expect("counts")) {
        let triad = |first: usize, step: T| Vector3::from_fn(|i, _| number::<T>(&counts[first + i]) * step);
        let sample = Sample {
            time: k * interval,
            specific_force: triad(0, force),
            angular_rate: triad(3, rate),
        };
        let stands = resting(cases, sample.time);
        if stood != stands {
            let block = collector.cut().expect("a block");
            collector.take(&block, stood).expect("a robot on its wheels");
            collector.end_stop();
            stood = stands;
        }
        if let Some(block) = collector.push(&sample).expect("samples in range") {
            collector.take(&block, stands).expect("a robot on its wheels");
        }
    }
    let block = collector.cut().expect("a block");
    collector.take(&block, stood).expect("a robot on its wheels");
    collector.end_stop();
    let (found, _) = collector.solve(None).expect("a spin");
    let biases = [
        ("accelerometer_bias", found.level_free.value),
        ("gyroscope_bias", found.gyroscope_bias.value),
    ];
    for (quantity, bias) in biases {
        let (expected, sigma) = (&cases[quantity], &cases[format!("{quantity}_sigma")]);
        let apart = (bias - vector::<T>(expected)).component_div(&vector::<T>(sigma));
        assert!(
            apart.amax().wide() <= vectors.tolerance::<T>(quantity),
            "{quantity}: {apart:?}"
        );
    }
    let apart: T =
        (found.floor_tilt.value - number(&cases["floor_tilt"])) / number(&cases["floor_tilt_sigma"]);
    assert!(
        apart.abs().wide() <= vectors.tolerance::<T>("floor_tilt"),
        "floor tilt: {apart:?}"
    );
}

fn redundancy<T: Named>() {
    let vectors = read("redundancy");
    let cases = &vectors.cases;
    let time = |name: &str| (cases[name].as_f64().expect("a time") * 1e6) as u64;
    let mut settings = RedundancySettings::<T>::default();
    settings.evaluation.rest_duration = time("rest_duration_s");
    settings.collection.collect = time("collect_s");
    let units = [MountedUnit::new(1), MountedUnit::new(2)];
    let platform = Platform::new(settings, PrimaryCalibration::none(), units).expect("a platform");
    let mut monitor = Monitor::<T, 2, 1>::new();
    let (mut events, mut records) = (Vec::new(), Vec::new());
    let steps: [T; 2] = [number(&cases["force_step"]), number(&cases["rate_step"])];
    let interval = cases["interval_us"].as_u64().expect("an interval");
    let rows = |name: &str| cases[name].as_array().expect("counts").clone();
    let both = rows("primary_counts").into_iter().zip(rows("secondary_counts"));
    for (k, (primary, secondary)) in (0..).zip(both) {
        for (unit, counts) in [primary, secondary].iter().enumerate() {
            let triad =
                |first: usize, step: T| Vector3::from_fn(|i, _| number::<T>(&counts[first + i]) * step);
            let sample = Sample {
                time: 1_000_000 + k * interval,
                specific_force: triad(0, steps[0]),
                angular_rate: triad(3, steps[1]),
            };
            monitor.push(&platform, unit, &sample, &mut |event| {
                if matches!(event.kind, EventKind::Evaluated { .. }) {
                    return;
                }
                let name = event.kind.name();
                if let EventKind::Adopted { record } = &event.kind {
                    records.push(*record);
                }
                if !events.contains(&name) {
                    events.push(name);
                }
            });
        }
    }
    let expected = cases["events"].as_array().expect("events");
    assert_eq!(
        events,
        expected
            .iter()
            .map(|name| name.as_str().expect("a name"))
            .collect::<Vec<_>>()
    );
    assert_eq!(records.len(), 2);
    for record in &records {
        let sensor = record.sensor.name();
        let close = |quantity: &str, apart: T| {
            let within = apart.wide() <= vectors.tolerance::<T>(quantity);
            assert!(within, "{quantity}: {apart:?} sigma");
        };
        let (m, b) = (format!("{sensor}_M"), format!("{sensor}_b"));
        let apart = record.model.matrix - matrix::<T>(&cases[m.as_str()]);
        close(&m, apart.component_div(&record.matrix_sigma).amax());
        let apart = record.model.bias - vector::<T>(&cases[b.as_str()]);
        close(&b, apart.component_div(&record.bias_sigma).amax());
        if record.sensor == Sensor::Accelerometer {
            let apart = record.lever_arm - vector::<T>(&cases["lever_arm"]);
            close("lever_arm", apart.component_div(&record.lever_arm_sigma).amax());
        }
    }
}

fn integer(value: &Value) -> u64 {
    value.as_u64().expect("a count")
}

fn array<T: Real, const N: usize>(value: &Value) -> [T; N] {
    core::array::from_fn(|i| number(&value[i]))
}

/// A sample of counts of six channels.
fn counted<T: Real>(time: u64, counts: &[Value], steps: [T; 2]) -> Sample<T> {
    let triad = |first: usize, step: T| Vector3::from_fn(|i, _| number::<T>(&counts[first + i]) * step);
    Sample {
        time,
        specific_force: triad(0, steps[0]),
        angular_rate: triad(3, steps[1]),
    }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

fn one_model<T: Named>() {
    let vectors = read("one_model");
    let steps: [T; 2] = [
        number(&vectors.cases["force_step"]),
        number(&vectors.cases["rate_step"]),
    ];
    windows_of_a_unit(&vectors, steps);
    leaky_means::<T>(&vectors);
    errors_of_a_secondary::<T>(&vectors);
    a_whole_set(&vectors, steps);
}

fn windows_of_a_unit<T: Named>(vectors: &Vectors, steps: [T; 2]) {
    let case = &vectors.cases["window"];
    let mut windows = UnitWindows::<T>::new();
    let mut wanted = list(&case["index"]).iter().map(integer).enumerate().peekable();
    for (stamp, counts) in list(&case["stamps_us"]).iter().zip(list(&case["counts"])) {
        let sample = counted(integer(stamp), list(counts), steps);
        windows.push(sample.time, &sample.channels());
        while let Some((row, index)) = wanted.next_if(|(_, index)| windows.has_ended(*index)) {
            let window = windows.of(index);
            assert_eq!(
                u64::from(window.is_whole),
                integer(&case["whole"][row]),
                "window {index}"
            );
            let repeated: Vec<u64> = window.repeated.iter().map(|count| (*count).into()).collect();
            let expected: Vec<u64> = list(&case["repeated"][row]).iter().map(integer).collect();
            assert_eq!(repeated, expected, "window {index}");
            let row = |name: &str| serde_json::json!({ name: case[name][row] });
            vectors.check(&row("silence"), "silence", [window.silence]);
            if window.is_whole {
                vectors.check(&row("reading"), "reading", window.reading);
                vectors.check(&row("change"), "change", window.change);
                vectors.check(&row("product"), "product", window.product);
                vectors.check(&row("scatter"), "scatter", window.scatter);
            }
        }
    }
    assert_eq!(wanted.next(), None);
}

fn leaky_means<T: Named>(vectors: &Vectors) {
    let case = &vectors.cases["means"];
    let mut means = LeakyMeans::<T, 1>::new();
    for (value, whole) in list(&case["values"]).iter().zip(list(&case["whole"])) {
        means.take((integer(whole) > 0).then_some(&[number(value)]));
    }
    vectors.check(case, "mean", means.scales().iter().flat_map(LeakyMean::mean));
    vectors.check(case, "weight", means.scales().iter().map(LeakyMean::weight));
}

/// Parameters of an accelerometer in the order of the model in numpy: the matrix, the bias, the lever arm.
fn by_kind<T: Real>(parameters: &Parameters<T>) -> Vec<T> {
    let [force, _] = &parameters.rows;
    let matrix = force.iter().flat_map(|[a, b, c, _]| [*a, *b, *c]);
    let bias = force.iter().map(|[.., bias]| *bias);
    matrix.chain(bias).chain(parameters.arm).collect()
}

fn errors_of_a_secondary<T: Named>(vectors: &Vectors) {
    let case = &vectors.cases["errors"];
    let mut errors = SecondaryErrors::<T>::uncalibrated();
    errors.walk(T::one());
    let mut block = RateBlock::none();
    for row in list(&case["rates"]) {
        let [x, y, z, a, b, c] = array(row);
        block.add(&[x, y, z], &[a, b, c]);
    }
    errors.add_rates(&block);
    for row in list(&case["forces"]) {
        let [x, y, z, w1, w2, w3, xx, yy, zz, xy, xz, yz, a, b, c] = array::<T, 15>(row);
        let mut channels = [T::zero(); MOTION];
        channels[..3].copy_from_slice(&[x, y, z]);
        channels[9..].copy_from_slice(&[w1, w2, w3, xx, yy, zz, xy, xz, yz]);
        let motion = MotionOfSet::of_channels(&channels);
        errors.add_force(motion.force(), &motion.lever(), &[a, b, c]);
    }
    errors.update_mean();
    let [_, rate] = errors.mean().rows;
    vectors.check(case, "rate_mean", rate.as_flattened().iter().copied());
    vectors.check(case, "force_mean", by_kind(errors.mean()));
    let motion = MotionOfSet::of_channels(&array(&case["motion"]));
    let error = errors.error(&motion, &motion.lever());
    vectors.check(case, "error", error.as_flattened().iter().copied());
    let [force, [rate, ..]] = errors.variance(&motion, &motion.lever());
    vectors.check(case, "variance", force.into_iter().chain([rate]));
}

fn a_whole_set<T: Named>(vectors: &Vectors, steps: [T; 2]) {
    let case = &vectors.cases["set"];
    let mut monitor = SetMonitor::<T, 3>::new(false);
    let mut events = Vec::new();
    let interval = integer(&case["interval_us"]);
    for (k, counts) in (0..).zip(list(&case["counts"])) {
        for (unit, counts) in list(counts).chunks(6).enumerate() {
            let sample = counted(1_000_000 + k * interval, counts, steps);
            monitor.push(unit, &sample, &mut |event| {
                events.push(serde_json::json!([event.time, event.unit, event.kind.name()]));
            });
        }
    }
    assert_eq!(&events, list(&case["events"]));
    let errors = monitor.errors(1).expect("a secondary").mean();
    let [_, rate] = errors.rows;
    vectors.check(case, "set_rate_mean", rate.as_flattened().iter().copied());
    vectors.check(case, "set_force_mean", by_kind(errors));
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
    readings_are_taken_to_the_reference_as_their_vectors_say: temperature,
    magnetometers_agree_with_their_vectors: magnetometer,
    moments_agree_with_their_vectors: moments,
    normal_gravity_agrees_with_its_vectors: gravity,
    the_allan_ladder_agrees_with_its_vectors: allan,
    the_sphere_agrees_with_its_vectors: sphere,
    the_mounting_angle_agrees_with_its_vectors: mounting,
    a_triad_agrees_with_its_vectors: triad,
    rests_and_turns_agree_with_their_vectors: stream,
    a_spin_agrees_with_its_vectors: spin,
    a_redundant_set_agrees_with_its_vectors: redundancy,
    a_set_by_one_model_agrees_with_its_vectors: one_model,
}
