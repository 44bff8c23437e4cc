//! Aiding measurements of the motion of the set.

use core::mem::MaybeUninit;

use tumble_core::redundancy::aiding::{Aiding as Core, AidingKind as CoreKind};

use crate::code::{Code, code};
use crate::redundancy::number;
use crate::status::StatusResult;

/// Quantities that an aiding measurement gives.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AidingKind {
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
pub struct Aiding {
    /// Quantity that is measured; only its own fields count.
    pub kind: MaybeUninit<AidingKind>,
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
unsafe impl Code for AidingKind {
    const COUNT: u32 = 4;
}

// A kind that the core gets needs its number here.
const _: () = assert!(CoreKind::ALL.len() == AidingKind::COUNT as usize);

impl Aiding {
    /// Converts it to the core's type.
    pub fn in_core(self) -> StatusResult<Core<f32>> {
        let (value, sigma) = (self.velocity.into(), self.sigma.into());
        Ok(match code(self.kind)? {
            AidingKind::Velocity => Core::Velocity { value, sigma },
            AidingKind::BodyVelocity => Core::BodyVelocity { value, sigma },
            AidingKind::Heading => Core::Heading {
                value: self.heading,
                sigma: sigma.x,
            },
            AidingKind::Score => Core::Score {
                unit: number(self.unit)?,
                value: self.score,
            },
        })
    }
}
