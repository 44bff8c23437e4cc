//! Calibration of a triad by a vector whose length is constant: gravity at rests, the Earth's magnetic field anywhere
//! (docs/theory/multipose.md, docs/theory/magnetometer.md).
//!
//! [`residual`] is the error of the length at one reading, [`reweighted`] solves for the unknowns with
//! [`levenberg_marquardt`] and [`robust`] weights from a [`sphere`], [`observability`] finds which unknowns the readings show,
//! and [`influence`] how much each of them decides.

pub mod directions;
pub mod influence;
pub mod levenberg_marquardt;
pub mod observability;
pub mod residual;
pub mod reweighted;
pub mod robust;
pub mod sphere;
pub mod whitening;
