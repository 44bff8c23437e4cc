//! The laws of the numeric core. One file an idea; each law at zero, near zero and at random, in both precisions.

mod allan;
mod common;
mod eigen;
mod model;
mod noise;
mod regression;
mod rotation;
mod segmenter;
mod stream;
mod stretch;
