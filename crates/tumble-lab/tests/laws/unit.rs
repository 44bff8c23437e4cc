//! Recordings of units whose errors are known, and what is acquired from them.

use core::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Vector3};
use tumble_core::model::ErrorModel;
use tumble_core::sample::Sample;
use tumble_core::segmenter::SegmenterSettings;
use tumble_lab::acquisition::{Acquired, Acquisition};

use super::common::Draws;
use super::stream::{Phase, Unit, samples};

/// A recording as it comes from a file: time in s, specific force, angular rate.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    pub time: Vec<f64>,
    pub force: Vec<[f64; 3]>,
    pub rate: Vec<[f64; 3]>,
}

impl Recording {
    /// Simulates a schedule, begun with z up.
    pub fn of(schedule: &[Phase], unit: &Unit, draws: &mut Draws) -> Self {
        Self::from(&samples(schedule, &Vector3::z(), unit, draws))
    }

    pub fn from(samples: &[Sample<f64>]) -> Self {
        Self {
            time: samples.iter().map(|sample| sample.time as f64 * 1e-6).collect(),
            force: samples
                .iter()
                .map(|sample| sample.specific_force.into())
                .collect(),
            rate: samples.iter().map(|sample| sample.angular_rate.into()).collect(),
        }
    }

    /// Every reading of a triad changed, in place.
    pub fn change(
        mut self,
        force: impl Fn(Vector3<f64>) -> Vector3<f64>,
        rate: impl Fn(Vector3<f64>) -> Vector3<f64>,
    ) -> Self {
        for y in &mut self.force {
            *y = force(Vector3::from(*y)).into();
        }
        for y in &mut self.rate {
            *y = rate(Vector3::from(*y)).into();
        }
        self
    }

    /// Tilted by its weight: a rotation vector that is this matrix times the specific force.
    pub fn flexed(mut self, give: &Matrix3<f64>) -> Self {
        for (f, w) in self.force.iter_mut().zip(&mut self.rate) {
            let (force, rate) = (Vector3::from(*f), Vector3::from(*w));
            let tilt = give * force;
            (*f, *w) = (
                (force - tilt.cross(&force)).into(),
                (rate - tilt.cross(&rate)).into(),
            );
        }
        self
    }

    /// With the noise of another recording, which is that less the same without noise.
    pub fn plus(mut self, noisy: &Self, plain: &Self) -> Self {
        let add = |to: &mut [[f64; 3]], noisy: &[[f64; 3]], plain: &[[f64; 3]]| {
            for ((y, noisy), plain) in to.iter_mut().zip(noisy).zip(plain) {
                for axis in 0..3 {
                    y[axis] += noisy[axis] - plain[axis];
                }
            }
        };
        add(&mut self.force, &noisy.force, &plain.force);
        add(&mut self.rate, &noisy.rate, &plain.rate);
        self
    }

    /// Stamped by another clock, and begun later by so many samples.
    pub fn on_clock(mut self, offset: f64, skew: f64, late: usize) -> Self {
        for time in &mut self.time {
            *time = *time * (1.0 + skew) + offset;
        }
        self.time.drain(..late);
        self.force.drain(..late);
        self.rate.drain(..late);
        self
    }

    pub fn push_to(&self, acquisition: &mut Acquisition) {
        acquisition.push(&self.time, &self.force, &self.rate, None);
    }

    pub fn acquire(&self) -> Acquired {
        let mut acquisition = Acquisition::new(SegmenterSettings::default());
        self.push_to(&mut acquisition);
        acquisition.finish()
    }
}

/// Rests of some seconds at all six faces, with quarter turns between, begun with z up.
pub fn six_faces(rest: f64) -> Vec<Phase> {
    let (x, y) = (Vector3::x() * FRAC_PI_2, Vector3::y() * FRAC_PI_2);
    // z, then y, -z, -y up by turns about x; x and -x from -y by turns about z, and back.
    let turns = [
        x,
        x,
        x,
        Vector3::z() * FRAC_PI_2,
        Vector3::z() * (2.0 * FRAC_PI_2),
        y,
    ];
    let mut schedule = vec![Phase::Rest(rest)];
    for turn in turns {
        schedule.extend([Phase::Turn(turn, 1.0 + turn.norm() / 4.0), Phase::Rest(rest)]);
    }
    on_the_grid(schedule)
}

/// Durations as whole numbers of samples.
pub fn on_the_grid(mut schedule: Vec<Phase>) -> Vec<Phase> {
    for phase in &mut schedule {
        match phase {
            Phase::Rest(t) | Phase::Turn(_, t) | Phase::Spin(_, t) | Phase::Shake(_, t) | Phase::Gap(t) => {
                *t = (*t * 200.0).round() / 200.0;
            }
        }
    }
    schedule
}

/// Error model of a low-grade unit.
pub fn poor_model(bias: f64) -> ErrorModel<f64> {
    ErrorModel {
        matrix: Matrix3::new(1.02, 0.01, -0.02, -0.015, 0.97, 0.03, 0.005, -0.025, 1.01),
        bias: Vector3::new(1.0, -0.6, 0.4) * bias,
    }
}
