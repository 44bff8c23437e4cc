//! Targets calibrated on a turntable against a co-mounted high-precision reference.
//!
//! A low-grade unit is seldom mounted square, and its own data cannot distinguish mounting from non-orthogonality. A
//! reference bolted to the same structure shares the mounting, and has next to no non-orthogonality of its own. The
//! published procedure has four steps, and they are here by name:
//!
//! *acquire* reference and target data at the poses: [`crate::segmenter`] gives rests and turns, [`clock`] matches
//!    them;
//! 2. *mounting angle* `R_e` of the reference, from `m = R_e m_ref + b_a`: [`mounting`];
//! 3. *compensate* the target, `m_comp = R_e^-1 m`: [`truth`], which also has the two truths that are exact where
//!    this one holds to first order;
//! 4. *calibrate* scale, non-orthogonality and bias from the compensated data: [`fit`],
//!    over [`observation`]s.
//!
//! [`mod@reference`] finds what the reference itself adds: its biases, and the rotation of the Earth it saw.
//! Derivations: docs/theory/turntable.md.

pub mod clock;
pub mod fit;
pub mod mounting;
pub mod observation;
pub mod reference;
pub mod truth;
mod whitening;
