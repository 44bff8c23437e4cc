//! Decision on beginning a calibration from the findings at rest.

use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::Gate;

/// Findings on a secondary and on the primary; accelerometer first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Findings {
    /// Sensors of the secondary whose deviation exceeds its threshold.
    pub exceeded: [bool; 2],
    /// Sensors of the primary whose deviation is within its threshold.
    pub primary_valid: [bool; 2],
    /// True if the primary is healthy.
    pub primary_healthy: bool,
    /// True if the secondary is healthy, or if a calibration may correct its fault.
    pub secondary_healthy: bool,
    /// Sensors with an unresolved dispute about the primary.
    pub disputed: [bool; 2],
}

crate::vocabulary! {
    /// Reason for not calibrating a sensor that deviates.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Withheld {
        /// The primary deviates itself.
        PrimaryInvalid = "primary invalid",
        /// The primary is not healthy.
        PrimaryUnhealthy = "primary unhealthy",
        /// The secondary has a fault that calibration does not correct.
        SecondaryUnhealthy = "secondary unhealthy",
        /// Units contradict each other, and the faulty one is not isolated.
        Disputed = "disputed",
        /// A calibration is under way.
        AlreadyCalibrating = "already calibrating",
        /// The settings allow calibrations on command only.
        OnCommandOnly = "on command only",
    }
}

/// Decision on a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// The sensor does not deviate.
    Quiet,
    /// The sensor triggers a calibration.
    Trigger,
    /// The sensor deviates but may not be calibrated.
    Withheld(Withheld),
}

impl Gate {
    /// Decides on each sensor.
    pub fn decide(self, findings: &Findings) -> [Decision; 2] {
        SENSORS.map(|sensor| {
            if !sensor.of(&findings.exceeded) {
                Decision::Quiet
            } else if !findings.secondary_healthy {
                Decision::Withheld(Withheld::SecondaryUnhealthy)
            } else if !findings.primary_healthy {
                Decision::Withheld(Withheld::PrimaryUnhealthy)
            } else if *sensor.of(&findings.disputed) {
                Decision::Withheld(Withheld::Disputed)
            } else if !self.trusts(findings.primary_valid, sensor) {
                Decision::Withheld(Withheld::PrimaryInvalid)
            } else {
                Decision::Trigger
            }
        })
    }

    /// Returns whether the primary is trusted as reference of a sensor.
    pub fn trusts(self, primary_valid: [bool; 2], sensor: Sensor) -> bool {
        match self {
            Gate::SecondaryAlone => true,
            Gate::WholePrimary => primary_valid == [true; 2],
            Gate::SensorBySensor => *sensor.of(&primary_valid),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FOUND: Findings = Findings {
        exceeded: [true, false],
        primary_valid: [true, true],
        primary_healthy: true,
        secondary_healthy: true,
        disputed: [false; 2],
    };

    fn first(gate: Gate, findings: Findings) -> Decision {
        gate.decide(&findings)[0]
    }

    const GATES: [Gate; 3] = [Gate::SecondaryAlone, Gate::WholePrimary, Gate::SensorBySensor];

    #[test]
    fn a_deviation_of_a_healthy_set_triggers_through_every_gate() {
        for gate in GATES {
            assert_eq!(gate.decide(&FOUND), [Decision::Trigger, Decision::Quiet]);
        }
    }

    #[test]
    fn an_invalid_primary_triggers_with_the_secondary_alone_only() {
        let findings = Findings {
            primary_valid: [false, true],
            ..FOUND
        };
        let invalid = Decision::Withheld(Withheld::PrimaryInvalid);
        assert_eq!(first(Gate::SecondaryAlone, findings), Decision::Trigger);
        assert_eq!(first(Gate::WholePrimary, findings), invalid);
        assert_eq!(first(Gate::SensorBySensor, findings), invalid);
    }

    #[test]
    fn sensor_by_sensor_needs_only_the_primary_sensor_of_its_kind() {
        let findings = Findings {
            primary_valid: [true, false],
            ..FOUND
        };
        let invalid = Decision::Withheld(Withheld::PrimaryInvalid);
        assert_eq!(first(Gate::WholePrimary, findings), invalid);
        assert_eq!(first(Gate::SensorBySensor, findings), Decision::Trigger);
    }

    #[test]
    fn an_unhealthy_unit_neither_is_calibrated_nor_a_reference() {
        for gate in GATES {
            for healthy in [true, false] {
                let findings = Findings {
                    primary_healthy: healthy,
                    secondary_healthy: !healthy,
                    ..FOUND
                };
                assert!(matches!(first(gate, findings), Decision::Withheld(_)));
            }
        }
    }
}
