//! Aiding measurements of the motion of the set.

use core::mem::MaybeUninit;

use tumble_core::redundancy::witness::{Witness as Core, WitnessKind as CoreKind};

use crate::code::{Code, code};
use crate::redundancy::number;
use crate::status::StatusResult;

/// Quantities that an aiding measurement gives.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WitnessKind {
    /// Velocity of the primary's place in a level frame whose heading does not change and need not be known: x and y
    /// horizontal, z up. Its origin is a receiver, an estimator without these units, or, with `sigma` of x and y
    /// infinite, a climb rate.
    Velocity,
    /// Velocity of the primary's place in the primary's axes, as of wheels.
    BodyVelocity,
    /// Heading of the primary, as of a magnetometer: `heading`, of which the first of `sigma` is the standard deviation.
    Heading,
    /// Misfit of an estimator that runs on `unit` with its other sensors: `score`.
    Score,
}

/// Aiding measurement.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Witness {
    /// Quantity that is measured; only its own fields count.
    pub kind: MaybeUninit<WitnessKind>,
    /// The unit of a score.
    pub unit: u32,
    /// Velocity, m/s.
    pub velocity: [f32; 3],
    /// Standard deviation of each axis, m/s, above 0; infinite where an axis is not measured. The first is that of a heading, rad.
    pub sigma: [f32; 3],
    /// Innovation squared over its variance, a degree of freedom: 1 in health.
    pub score: f32,
    /// Angle about the vertical of the primary's x axis, rad, counter-clockwise seen from above, from any direction that stays.
    pub heading: f32,
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for WitnessKind {
    const COUNT: u32 = 4;
}

// A kind that the core gets needs its number here.
const _: () = assert!(CoreKind::ALL.len() == WitnessKind::COUNT as usize);

impl Witness {
    /// Converts it to the core's type.
    pub fn in_core(self) -> StatusResult<Core<f32>> {
        let (value, sigma) = (self.velocity.into(), self.sigma.into());
        Ok(match code(self.kind)? {
            WitnessKind::Velocity => Core::Velocity { value, sigma },
            WitnessKind::BodyVelocity => Core::BodyVelocity { value, sigma },
            WitnessKind::Heading => Core::Heading {
                value: self.heading,
                sigma: sigma.x,
            },
            WitnessKind::Score => Core::Score {
                unit: number(self.unit)?,
                value: self.score,
            },
        })
    }
}
