//! Recordings of inertial measurement units with known truth.
//!
//! Read in this order:
//!
//! 1. [`grade`]: how good a sensor is, from public data sheets;
//! 2. [`motion`]: what the table does, as true specific force and angular rate at any time ([`turn`]: one turn of it);
//! 3. [`noise`]: white noise and bias instability;
//! 4. [`sensor`]: what a triad of sensors says about that truth, `y = M u + b`;
//! 5. [`fault`]: what can be wrong with a recording;
//! 6. [`mod@unit`]: one unit, its clock and its recording;
//! 7. [`turntable`]: a whole session, one reference and its targets;
//! 8. [`spot`]: a wheeled robot that turns on the spot, recorded by the same units ([`heading`]: where it points,
//!    [`floor`]: what it stands on);
//! 9. [`flight`]: several units on a [`quadrotor`] or a [`vehicle`] ([`ride`]: what these have in common, [`attitude`] and
//!    [`vibration`] of their body), whose ways are [`sway`]s and [`span`]s made of [`series`], so that all derivatives
//!    belong together.
//!
//! Everything is drawn from one seed. Each unit and each purpose has a random stream of its own ([`stream`]), so that
//! adding a target, or switching bias instability on, leaves every other draw as it was.
//!
//! Angles come from `libm`, not from the machine's mathematics library, and random numbers from PCG64. Only the normal
//! distribution's tail (one draw in some thousands) takes a logarithm from the machine, which may differ there in the
//! last bit.

pub mod attitude;
pub mod fault;
pub mod flight;
pub mod floor;
pub mod grade;
pub mod heading;
pub mod motion;
pub mod noise;
pub mod quadrotor;
pub mod ride;
pub mod sensor;
pub mod series;
pub mod span;
pub mod spot;
pub mod stream;
pub mod sway;
pub mod turn;
pub mod turntable;
pub mod unit;
pub mod vehicle;
pub mod vibration;
