//! Checks of every scenario before it is played, and reasons for a refusal.

use core::fmt;

use crate::simulate::fault::InjectedFault;
use crate::simulate::unit::{ClockSetup, UnitSetup};

/// Why a scenario cannot be played.
#[derive(Clone, Debug, PartialEq)]
pub enum ScenarioError {
    /// There is no pose.
    NoPose,
    /// `up` of this pose is not a direction.
    NoDirection {
        /// Index of the pose.
        pose: usize,
    },
    /// A figure is not positive.
    NotPositive {
        /// Quantity, with its unit.
        what: &'static str,
        /// Value found.
        found: f64,
    },
    /// A figure is negative or not finite.
    Negative {
        /// Quantity, with its unit.
        what: &'static str,
        /// Value found.
        found: f64,
    },
    /// The samples do not fit into memory.
    TooLong {
        /// Samples of one unit.
        samples: f64,
    },
    /// A fault names an axis beyond the third.
    NoSuchAxis {
        /// Number found.
        found: usize,
    },
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPose => write!(f, "there is no pose to turn to"),
            Self::NoDirection { pose } => write!(f, "up of pose {} is not a unit vector", pose + 1),
            Self::NotPositive { what, found } => write!(f, "{what} has to be positive, found {found}"),
            Self::Negative { what, found } => write!(f, "{what} must not be negative, found {found}"),
            Self::TooLong { samples } => write!(f, "{samples:.3e} samples a unit do not fit into memory"),
            Self::NoSuchAxis { found } => write!(f, "a fault names axis {found}, there are 0, 1 and 2"),
        }
    }
}

impl core::error::Error for ScenarioError {}

/// Most samples of one unit; one takes 72 bytes.
const MOST_SAMPLES: f64 = 1e8;

/// Checks figures and faults of units.
///
/// # Errors
/// [`ScenarioError`] for the first that makes no sense.
pub fn check_units<'a>(units: impl IntoIterator<Item = &'a UnitSetup> + Clone) -> Result<(), ScenarioError> {
    units.clone().into_iter().try_for_each(check_unit)?;
    let faults = || units.clone().into_iter().flat_map(|unit| &unit.faults);
    faults()
        .filter_map(scale_factor)
        .try_for_each(|factor| positive("factor of a scale fault", factor))?;
    faults().flat_map(axes).try_for_each(|axis| match axis {
        0..=2 => Ok(()),
        found => Err(ScenarioError::NoSuchAxis { found }),
    })
}

fn check_unit(unit: &UnitSetup) -> Result<(), ScenarioError> {
    positive("sample rate, Hz,", unit.rate)?;
    for triad in [&unit.grade.accelerometer, &unit.grade.gyroscope] {
        positive("range of a triad", triad.range)?;
        not_negative("noise density of a triad", triad.noise_density)?;
        not_negative("bias instability of a triad", triad.bias_instability)?;
        not_negative("quantisation of a triad", triad.quantisation)?;
    }
    if let ClockSetup::Given(clock) = unit.clock {
        positive("rate of a clock", 1.0 + clock.skew)?;
    }
    Ok(())
}

/// Checks that what all units record fits into memory.
///
/// # Errors
/// [`ScenarioError::TooLong`].
pub fn check_samples<'a>(
    duration: f64,
    units: impl IntoIterator<Item = &'a UnitSetup>,
) -> Result<(), ScenarioError> {
    let fastest = units.into_iter().map(|unit| unit.rate).fold(0.0, f64::max);
    let samples = duration * fastest;
    if samples > MOST_SAMPLES {
        return Err(ScenarioError::TooLong { samples });
    }
    Ok(())
}

/// Refuses what is not positive or not finite.
///
/// # Errors
/// [`ScenarioError::NotPositive`].
pub fn positive(what: &'static str, found: f64) -> Result<(), ScenarioError> {
    let holds = found > 0.0 && found.is_finite();
    if holds {
        Ok(())
    } else {
        Err(ScenarioError::NotPositive { what, found })
    }
}

/// Refuses what is negative or not finite.
///
/// # Errors
/// [`ScenarioError::Negative`].
pub fn not_negative(what: &'static str, found: f64) -> Result<(), ScenarioError> {
    let holds = found >= 0.0 && found.is_finite();
    if holds {
        Ok(())
    } else {
        Err(ScenarioError::Negative { what, found })
    }
}

fn scale_factor(fault: &InjectedFault) -> Option<f64> {
    match *fault {
        InjectedFault::Scale { size, .. } => Some(size),
        _ => None,
    }
}

fn axes(fault: &InjectedFault) -> Vec<usize> {
    match *fault {
        InjectedFault::Scale { axis, .. }
        | InjectedFault::Stuck { axis, .. }
        | InjectedFault::Moved { axis, .. }
        | InjectedFault::Nan { axis, .. }
        | InjectedFault::Spikes { axis, .. }
        | InjectedFault::Bias { axis, .. }
        | InjectedFault::LeftHanded { axis } => vec![axis],
        InjectedFault::SwappedAxes { axis, other_axis } => vec![axis, other_axis],
        _ => vec![],
    }
}
