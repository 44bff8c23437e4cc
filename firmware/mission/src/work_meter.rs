//! Meters of the cost of the parts of the mission.

/// A part of the work on a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkPart {
    /// Taking up stored records after a start.
    Restore,
    /// A sample, that led to nothing but an output or an event.
    Push,
    /// A sample with which a calibration whose pairs are complete is fitted on.
    Fit,
    /// A record into flash.
    Save,
    /// A sample of a spin.
    SpinPush,
    /// A sample with which a spin that is complete is solved on.
    SpinSlice,
    /// A spin solved at once, with a true angle.
    SpinSolve,
}

/// All of them, in their order.
pub const WORK_PARTS: [WorkPart; 7] = [
    WorkPart::Restore,
    WorkPart::Push,
    WorkPart::Fit,
    WorkPart::Save,
    WorkPart::SpinPush,
    WorkPart::SpinSlice,
    WorkPart::SpinSolve,
];

/// Looks on while work is done.
pub trait WorkMeter {
    /// Does it.
    fn during<R>(&mut self, work: impl FnOnce() -> R) -> R;

    /// Names the part that was done last: often only its outcome determines it.
    fn was(&mut self, part: WorkPart);
}

/// Nobody does.
pub struct Nobody;

impl WorkMeter for Nobody {
    fn during<R>(&mut self, work: impl FnOnce() -> R) -> R {
        work()
    }

    fn was(&mut self, _: WorkPart) {}
}
