//! Whether what was found at rest lets a calibration begin.

use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::settings::Gate;

/// What was found of a secondary and of the primary; accelerometer first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Findings {
    /// Sensors of the secondary whose deviation exceeds its threshold.
    pub exceeded: [bool; 2],
    /// Sensors of the primary whose deviation is within its threshold.
    pub primary_valid: [bool; 2],
    /// Whether the primary is in health.
    pub primary_healthy: bool,
    /// Whether the secondary is, or may be mended.
    pub secondary_healthy: bool,
    /// Sensors of which it is not known whether the primary is right.
    pub disputed: [bool; 2],
}

crate::vocabulary! {
    /// Why a sensor that wants calibrating is not.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Withheld {
        /// The primary deviates itself.
        PrimaryInvalid = "primary invalid",
        /// The primary is not in health.
        PrimaryUnhealthy = "primary unhealthy",
        /// The secondary is not in health: there is more wrong with it than calibration mends.
        SecondaryUnhealthy = "secondary unhealthy",
        /// Units contradict each other, and nobody knows which is wrong.
        Disputed = "disputed",
        /// A calibration is under way already.
        AlreadyCalibrating = "already calibrating",
        /// Nobody asked, and the settings have it calibrated on command only.
        OnCommandOnly = "on command only",
    }
}

/// What becomes of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// It does not deviate.
    Quiet,
    /// It triggers.
    Trigger,
    /// It deviates but may not be calibrated.
    Withheld(Withheld),
}

impl Gate {
    /// What becomes of each sensor.
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

    /// Whether the primary is trusted with this sensor.
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
    fn a_deviation_triggers_through_every_gate_when_all_else_is_well() {
        for gate in GATES {
            assert_eq!(gate.decide(&FOUND), [Decision::Trigger, Decision::Quiet]);
        }
    }

    #[test]
    fn with_the_primary_invalid_only_the_secondary_alone_gate_lets_through() {
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
    fn sensor_by_sensor_asks_only_for_the_primary_sensor_of_the_same_kind() {
        let findings = Findings {
            primary_valid: [true, false],
            ..FOUND
        };
        let invalid = Decision::Withheld(Withheld::PrimaryInvalid);
        assert_eq!(first(Gate::WholePrimary, findings), invalid);
        assert_eq!(first(Gate::SensorBySensor, findings), Decision::Trigger);
    }

    #[test]
    fn a_unit_out_of_health_is_neither_calibrated_nor_calibrated_against() {
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
