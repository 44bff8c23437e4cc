//! Recordings of inertial measurement units with known truth.
//!
//! Read in this order:
//!
//! 1. [`grade`]: how good a sensor is, from public data sheets;
//! 2. [`table`]: what the table does, as a [`trajectory`] ([`table_turn`]: one turn of it);
//! 3. [`noise`]: white noise and bias instability;
//! 4. [`sensor`]: readings of a triad of sensors for that truth, `y = M u + b`;
//! 5. [`fault`]: what can be wrong with a recording;
//! 6. [`mod@unit`]: one unit, its clock and its recording;
//! 7. [`turntable`]: a whole session, one reference and its targets ([`scenario`]: what every scenario is held to);
//! 8. [`spin`]: a spin of a [`wheeled_robot`], recorded by one such unit ([`heading`]: where the robot points,
//!    [`floor`]: what it stands on);
//! 9. [`flight`]: several units on a [`quadrotor`] or a [`vehicle`] ([`carrier`]: what these have in common, [`attitude`] and
//!    [`vibration`] of their body), whose ways are [`sway`]s and [`time_span`]s made of [`series`], so that all derivatives
//!    belong together.
//!
//! Everything is drawn from one seed. Each unit and each purpose has a random stream of its own ([`stream`]), so that
//! adding a target, or switching bias instability on, leaves every other draw as it was.
//!
//! Angles come from `libm`, not from the machine's mathematics library, and random numbers from PCG64. Only the normal
//! distribution's tail (one draw in some thousands) takes a logarithm from the machine, which may differ there in the
//! last bit.

pub mod attitude;
pub mod carrier;
pub mod fault;
pub mod flight;
pub mod floor;
pub mod grade;
pub mod heading;
pub mod noise;
pub mod quadrotor;
pub mod scenario;
pub mod sensor;
pub mod series;
pub mod spin;
pub mod still;
pub mod stream;
pub mod sway;
pub mod table;
pub mod table_turn;
pub mod time_span;
pub mod trajectory;
pub mod turntable;
pub mod unit;
pub mod vehicle;
pub mod vibration;
pub mod wheeled_robot;
