//! Spins on a device that knows no more of its unit than the grade.

use tumble_core::grade::Grade;
use tumble_core::gravity::EARTH_RATE;
use tumble_core::sample::Sample;
use tumble_core::spin::estimate::SpinEstimate;
use tumble_core::spin::machine::{SpinMachine, Wheels};
use tumble_core::spin::settings::SpinSettings;
use tumble_lab::simulate::grade::SensorGrade as Figures;
use tumble_lab::simulate::noise::{flicker, white_sigma};
use tumble_lab::simulate::stream::{StreamPurpose, stream};

use super::spin_stream::{INTERVAL, Truth, narrowed};

const SPINS: u64 = 150;

/// The usual spin with the white noise of a grade, and biases that wander as much as that grade states.
fn wandering(truth: &Truth, figures: &Figures, seed: u64) -> Vec<Sample<f64>> {
    let rate = 1e6 / INTERVAL as f64;
    let noise =
        [figures.accelerometer, figures.gyroscope].map(|triad| white_sigma(triad.noise_density, rate));
    let mut samples = truth.stream(noise.into(), 0.0, seed);
    for channel in 0..6_usize {
        let (purpose, triad) = if channel < 3 {
            (StreamPurpose::AccelerometerFlicker, figures.accelerometer)
        } else {
            (StreamPurpose::GyroscopeFlicker, figures.gyroscope)
        };
        let mut random = stream(seed, channel as u64, purpose);
        let wander = flicker(triad.bias_instability, samples.len(), &mut random);
        // The bias of a spin is its mean over the spin.
        let mean = wander.iter().sum::<f64>() / wander.len() as f64;
        for (sample, wander) in samples.iter_mut().zip(wander) {
            let triad = if channel < 3 {
                &mut sample.specific_force
            } else {
                &mut sample.angular_rate
            };
            triad[channel % 3] += wander - mean;
        }
    }
    samples
}

/// The machine is done after two turns: the bias of what it sees is that of nearly all.
fn spun_twice() -> Truth {
    Truth {
        still: 6.0,
        turns: vec![1.1, -1.1],
        ..Truth::usual()
    }
}

/// At a pole the Earth's rotation is known, and takes no part in the sigmas.
#[allow(clippy::cast_possible_truncation)]
fn spun(samples: &[Sample<f64>], settings: &SpinSettings<f32>) -> SpinEstimate<f32> {
    let mut machine = SpinMachine::new(&SpinSettings {
        earth_rate_up: EARTH_RATE as f32,
        ..*settings
    });
    machine.start();
    for sample in narrowed::<f32>(samples) {
        machine.push(&sample, Wheels::Unknown);
    }
    machine.solve(None).unwrap()
}

/// Mean of the squared errors of the gyroscope bias, in sigmas.
fn mean_square(grade: Grade, settings: &SpinSettings<f32>) -> f64 {
    let figures = Figures::named(grade.name()).unwrap();
    let truth = spun_twice();
    let squares = (0..SPINS).map(|seed| {
        let estimate = spun(&wandering(&truth, &figures, seed), settings);
        let (found, up) = (estimate.gyroscope_bias, estimate.up.map(f64::from));
        // The spin is drawn on an Earth that does not turn.
        let error = found.value.map(f64::from) + up * EARTH_RATE - truth.gyroscope_bias;
        error.component_div(&found.sigma.map(f64::from)).norm_squared() / 3.0
    });
    squares.sum::<f64>() / SPINS as f64
}

#[test]
fn sigmas_of_a_device_hold_where_biases_wander_by_its_grade() {
    for grade in [Grade::Consumer, Grade::Industrial] {
        let square = mean_square(grade, &SpinSettings::for_grade(grade));
        // A mean of 450 squares, of which two of three are nearly independent, scatters by a tenth.
        println!("{grade:?}: {square}");
        assert!((0.7..1.35).contains(&square), "{grade:?}: {square}");
    }
}

#[test]
fn a_spin_without_stated_wander_has_too_small_sigmas() {
    let figures = Figures::named(Grade::Consumer.name()).unwrap();
    let samples = wandering(&spun_twice(), &figures, 1);
    let untold = SpinSettings {
        specific_force_instability: 0.0,
        angular_rate_instability: 0.0,
        ..SpinSettings::default()
    };
    let sigma = |settings| spun(&samples, settings).gyroscope_bias.sigma.norm();
    assert!(sigma(&SpinSettings::default()) > 1.3 * sigma(&untold));
}
