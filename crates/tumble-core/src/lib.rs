//! The numeric core of Tumble: calibration of inertial measurement units, without heap or operating system.
//!
//! One model for accelerometers and gyroscopes alike: `y = M u + b`, where `y` is the reading of the sensor and `u` the
//! truth in the case frame, in SI units. Read in this order:
//!
//! 1. [`model`]: the error model, its inverse, and `M = K L Q`, scale, non-orthogonality and mounting.
//! 2. [`real`], the two kinds of number, and [`single`], functions of the smaller one; [`sample`] and [`moments`]: one sample, and what is kept of many.
//! 3. [`stillness`] and [`segmenter`]: a recording becomes rests, and turns between them; [`pauses`] where samples are missing.
//! 4. [`noise`]: white noise and bias instability, and what they do to a mean; [`grade`]: how large they are where nobody knows.
//! 5. [`regression`] and [`rotation`]: the two solvers; [`eigen`] serves both.
//! 6. [`gravity`]: what the Earth adds; [`temperature`]: what it does to bias and scale; [`magnetometer`]: what currents add.
//! 7. [`turntable`]: targets against a co-mounted reference; [`spin`]: a robot that turns on the spot;
//!    [`redundancy`]: a primary that keeps its secondaries calibrated.
//!
//! Everything is generic over `f32` and `f64`, owns no memory it was not given, and never panics on data:
//! state is a plain struct with `new`, `push` and `solve`, and time comes with the samples.
#![no_std]

pub mod eigen;
pub mod grade;
pub mod gravity;
pub mod magnetometer;
pub mod mean_scatter;
pub mod model;
pub mod moments;
pub mod noise;
pub mod pauses;
pub mod products;
pub mod real;
pub mod redundancy;
pub mod regression;
pub mod resolution;
pub mod rotation;
pub mod sample;
pub mod segmenter;
pub mod single;
pub mod soft_mean;
pub mod spin;
pub mod stillness;
pub mod temperature;
pub mod turntable;
pub mod vocabulary;
