//! Bias, and scale where several poses show it, over temperature, from units at rest (docs/theory/thermal.md).
//!
//! [`recorder`] takes logs in, as means over short spans. [`thermometer`] estimates the temperature of the sensor from
//! readings of a thermometer, [`rest`] finds the spans at rest, and [`block`] joins these into the blocks that are
//! fitted. [`fit`](mod@fit) fits one axis, in noise that [`whitening`] makes independent: a constant for each pose that
//! was held, and polynomials of temperature. [`order`] finds how high these may be, [`lag`] how far the thermometer is
//! behind, [`hysteresis`] how far warming and cooling are apart. [`procedure`] does it for a unit.

pub mod block;
pub mod fit;
pub mod hysteresis;
pub mod lag;
pub mod order;
pub mod procedure;
pub mod recorder;
pub mod rest;
#[cfg(test)]
mod tests;
pub mod thermometer;
pub mod whitening;
