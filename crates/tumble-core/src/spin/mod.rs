//! Biases of a wheeled robot's IMU from standing still and turning on the spot, whatever the tilt of IMU and floor.
//!
//! Read in this order:
//!
//! 1. [`block`]: samples become blocks, and rate becomes heading;
//! 2. [`rests`]: what standing still shows; [`axis`]: the turning axis and the bias of the gyroscope;
//! 3. [`harmonics`]: the accelerometer over heading;
//! 4. [`level_floor`]: the published estimator, for level floors; [`level_free`]: that for any floor;
//! 5. [`estimator`] keeps what is needed, in constant memory, and [`solve`] makes an [`estimate`] of it (`scale` and
//!    `outputs` are parts of that);
//! 6. [`collector`] takes samples to the estimator, and [`machine`] is the procedure on a device, which reports to the
//!    robot the state that it waits for;
//! 7. [`compensation`]: what the result is for.
//!
//! [`settings`] are those of the spin, [`failure`] lists the reasons why a spin cannot be used. Derivations:
//! docs/theory/spin.md.

pub mod axis;
pub mod block;
pub mod collector;
pub mod compensation;
pub mod estimate;
pub mod estimator;
pub mod even_readings;
pub mod failure;
pub mod harmonics;
pub mod level_floor;
pub mod level_free;
pub mod machine;
mod outputs;
pub mod rests;
mod scale;
pub mod settings;
pub mod solve;
