//! Grades of sensors, for a device that knows its part but not how good the very unit is.

use tumble_core::grade::Grade as CoreGrade;

use crate::code::Code;

/// Grades of inertial measurement units, best last.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grade {
    /// A chip for phones and hobby drones, as InvenSense MPU-6050: bias instability of 0.53 mm/s^2 and 34 urad/s.
    Consumer,
    /// A factory-calibrated module, as Analog Devices ADIS16470: 0.19 mm/s^2 and 58 urad/s.
    Industrial,
    /// A unit for guidance, as Analog Devices ADIS16495-1: 0.047 mm/s^2 and 5.8 urad/s.
    Tactical,
    /// Navigation class, as Honeywell HG9900 and QA-2000: 0.015 mm/s^2 and 0.026 urad/s.
    Reference,
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for Grade {
    const COUNT: u32 = 4;
}

impl Grade {
    pub(crate) fn in_core(self) -> CoreGrade {
        match self {
            Self::Consumer => CoreGrade::Consumer,
            Self::Industrial => CoreGrade::Industrial,
            Self::Tactical => CoreGrade::Tactical,
            Self::Reference => CoreGrade::Reference,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_the_descriptions_are_those_of_the_core() {
        let described = [
            (Grade::Consumer, 0.53e-3, 34e-6),
            (Grade::Industrial, 0.19e-3, 58e-6),
            (Grade::Tactical, 0.047e-3, 5.8e-6),
            (Grade::Reference, 0.015e-3, 0.026e-6),
        ];
        assert_eq!(described.map(|(grade, ..)| grade.in_core()), CoreGrade::ALL);
        for (grade, of_force, of_rate) in described {
            let figures = grade.in_core().bias_instability::<f64>();
            assert!(
                (figures.specific_force / of_force - 1.0_f64).abs() < 0.02,
                "{figures:?}"
            );
            assert!(
                (figures.angular_rate / of_rate - 1.0_f64).abs() < 0.02,
                "{figures:?}"
            );
        }
    }
}
