//! Who measures what the parts of the mission cost.

/// A part of the work on a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Taking up stored records after a start.
    Restore,
    /// A sample, that led to nothing but an output or an event.
    Push,
    /// A sample with which a calibration was fitted.
    Fit,
    /// A record into flash.
    Save,
    /// A sample of a spin.
    SpinPush,
    /// The sample of a spin that completes it, which solves it.
    SpinFinish,
    /// The result of a spin.
    SpinSolve,
}

/// All of them, in their order.
pub const PHASES: [Phase; 7] = [
    Phase::Restore,
    Phase::Push,
    Phase::Fit,
    Phase::Save,
    Phase::SpinPush,
    Phase::SpinFinish,
    Phase::SpinSolve,
];

/// Looks on while work is done.
pub trait Watch {
    /// Does it.
    fn during<R>(&mut self, work: impl FnOnce() -> R) -> R;

    /// Says which part it was that was done last: often only its outcome tells.
    fn was(&mut self, phase: Phase);
}

/// Nobody does.
pub struct Nobody;

impl Watch for Nobody {
    fn during<R>(&mut self, work: impl FnOnce() -> R) -> R {
        work()
    }

    fn was(&mut self, _: Phase) {}
}
