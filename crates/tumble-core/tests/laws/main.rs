//! The laws of the numeric core. One file an idea; each law at zero, near zero and at random, in both precisions.

mod allan;
mod clock;
mod common;
mod eigen;
mod fit;
mod gravity;
mod model;
mod mounting;
mod noise;
mod redundancy_faults;
mod redundancy_health;
mod redundancy_mission;
mod redundancy_modes;
mod redundancy_outcomes;
mod redundancy_settings;
mod redundancy_time;
mod reference;
mod regression;
mod rotation;
mod segment;
mod segmenter;
mod spin;
mod spin_machine;
mod spin_stream;
mod stream;
mod truth;
