//! Times of samples whose stamps come late: the sensor samples evenly, its reader does not.
//!
//! [`period`] measures the sampling period, `count` numbers the samples across losses, `envelope` takes what is least
//! delayed, or the mean, of successive seconds, and [`walk`] joins these to a clock whose rate wanders slowly.
//! [`evidence`] shows by the signal whether the sensor samples evenly at all, [`judge`] decides. Equations: docs/theory/clocks.md.

mod count;
mod envelope;
pub mod evidence;
mod fit;
mod kept;
pub mod period;
pub mod walk;

pub use evidence::{LatenessEvidence, Sampling};
pub use fit::{SampleTimes, fit_times};
pub use kept::{StampJudgement, judge, scatter_of_steps};
pub use period::{Period, are_late};
