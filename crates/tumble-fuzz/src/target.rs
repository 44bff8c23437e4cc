//! Targets that are fed with hostile input.

use crate::campaign::RunOutcome;
use crate::draw::FuzzDraw;
use crate::monitor::MonitorScenes;
use crate::record;
use crate::spin::SpinScenes;

/// One of them, with all that its runs begin from.
pub enum FuzzTarget {
    /// Bytes that may be a record.
    Record,
    /// The monitor of a redundant set.
    Monitor(Box<MonitorScenes>),
    /// The spin of a robot.
    Spin(SpinScenes),
}

impl FuzzTarget {
    /// Names of the targets.
    pub const NAMES: [&str; 3] = ["record", "monitor", "spin"];

    /// The one of a name.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "record" => Some(Self::Record),
            "monitor" => Some(Self::Monitor(Box::new(MonitorScenes::new()))),
            "spin" => Some(Self::Spin(SpinScenes::new())),
            _ => None,
        }
    }

    /// Makes one run.
    ///
    /// # Errors
    /// A failure is described in a line.
    pub fn run(&self, draw: FuzzDraw) -> RunOutcome {
        match self {
            Self::Record => record::run(draw),
            Self::Monitor(scenes) => scenes.run(draw),
            Self::Spin(scenes) => scenes.run(draw),
        }
    }
}
