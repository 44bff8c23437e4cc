//! The laws of the numeric core. One file an idea; each law at zero, near zero and at random, in both precisions.

mod common;
mod eigen;
mod model;
mod regression;
mod rotation;
