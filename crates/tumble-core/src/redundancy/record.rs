//! Stored record of a secondary: the error of one sensor relative to the primary.

use core::slice;

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::model::ErrorModel;
use crate::products::zeros;
use crate::real::{Real, real};
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::FitModel;

/// The numbers of a record, in the order in which it is stored: name, type, name in [`RecordPart`], unit, whether it may
/// be infinite, version of the record's bytes that has it first. Record, parts, bytes, interfaces and documents are made
/// from these rows; what is new goes to the end.
#[macro_export]
macro_rules! record_table {
    ($made:ident) => {
        $made! {
            in model:
            /// M, row by row: leads from the case frame of the primary to the axes of the secondary, mounting included.
            matrix: Matrix3<T> = Matrix, "1", Finite, 1;
            /// b.
            bias: Vector3<T> = Bias, "m/s^2 or rad/s", Finite, 1;
            in itself:
            /// 1-sigma of M, row by row; infinite where motion did not show it.
            matrix_sigma: Matrix3<T> = MatrixSigma, "1", OrInfinite, 1;
            /// 1-sigma of b, given the elements of M that kept their stored values; infinite for axes that the sensor
            /// lacks, or that need a missing axis of the primary.
            bias_sigma: Vector3<T> = BiasSigma, "m/s^2 or rad/s", OrInfinite, 1;
            /// Vector from primary to secondary, case frame of the primary; zero for gyroscopes, and if unknown.
            lever_arm: Vector3<T> = LeverArm, "m", Finite, 1;
            /// 1-sigma of the lever arm; zero if it was given, infinite where motion did not show it.
            lever_arm_sigma: Vector3<T> = LeverArmSigma, "m", OrInfinite, 1;
            /// Root mean square residual of a channel on held-out pairs.
            residual: T = Residual, "m/s^2 or rad/s", OrInfinite, 1;
            /// Root mean square residual with the error stored before.
            residual_before: T = ResidualBefore, "m/s^2 or rad/s", OrInfinite, 1;
            /// Change of a mean reading by all calibrations together that follows the primary without proof, in the axes
            /// of the secondary.
            followed: Vector3<T> = Followed, "m/s^2 or rad/s", Finite, 2;
        }
    };
}

/// Makes [`Record`] and [`RecordPart`] from the table.
macro_rules! define {
    (
        in model: $($(#[doc = $shared_meaning:literal])+ $shared:ident: $shared_type:ty = $shared_part:ident, $shared_unit:literal, $shared_bound:ident, $shared_version:literal;)+
        in itself: $($(#[doc = $own_meaning:literal])+ $own:ident: $own_type:ty = $own_part:ident, $own_unit:literal, $own_bound:ident, $own_version:literal;)+
    ) => {
        /// Error of one sensor of a secondary relative to the primary, for raw readings of both: `y_secondary = M
        /// y_primary + b`, where the specific force of the primary is first moved to the place of the secondary.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Record<T: Real> {
            /// Identity of the unit.
            pub identity: u64,
            /// Sensor of the unit.
            pub sensor: Sensor,
            /// Error model, in which M leads from the case frame of the primary to the axes of the secondary, mounting
            /// included.
            pub model: ErrorModel<T>,
            /// Model that was fitted.
            pub fit_model: FitModel,
            /// Number of directions of motion along which M was fitted.
            pub directions: u8,
            /// Number of fitted pairs.
            pub pairs: u32,
            /// Number of calibrations of this sensor.
            pub sequence: u32,
            $(
                $(#[doc = $own_meaning])+
                #[doc = concat!("Unit: ", $own_unit, ".")]
                pub $own: $own_type,
            )+
        }

        impl<T: Real> Record<T> {
            /// Creates a record in which nothing is known: its numbers are zero, or infinite where they may be.
            pub fn unknown(identity: u64, sensor: Sensor) -> Self {
                let mut record = Self {
                    identity,
                    sensor,
                    model: ErrorModel { $($shared: Numbers::zero(),)+ },
                    fit_model: FitModel::Offset,
                    directions: 0,
                    pairs: 0,
                    sequence: 0,
                    $($own: Numbers::zero(),)+
                };
                for (part, numbers) in RecordPart::ALL.into_iter().zip(record.parts_mut()) {
                    if part.may_be_infinite() {
                        numbers.fill(real(f64::INFINITY));
                    }
                }
                record
            }

            /// Numbers of the record, in the order of [`RecordPart::ALL`]; matrices column by column.
            pub fn parts(&self) -> [&[T]; RecordPart::COUNT] {
                [$(self.model.$shared.numbers(),)+ $(self.$own.numbers(),)+]
            }

            /// Numbers of the record, mutable.
            pub fn parts_mut(&mut self) -> [&mut [T]; RecordPart::COUNT] {
                [$(self.model.$shared.numbers_mut(),)+ $(self.$own.numbers_mut(),)+]
            }
        }

        define! {
            $($shared, $shared_type, concat!($($shared_meaning),+), $shared_part, $shared_unit, $shared_bound, $shared_version;)+
            $($own, $own_type, concat!($($own_meaning),+), $own_part, $own_unit, $own_bound, $own_version;)+
        }
    };
    ($($name:ident, $type:ty, $meaning:expr, $part:ident, $unit:literal, $bound:ident, $version:literal;)+) => {
        /// Numbers of a record that belong together.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum RecordPart {
            $(#[doc = $meaning] $part,)+
        }

        impl RecordPart {
            /// Number of parts.
            pub const COUNT: usize = Self::ALL.len();

            /// All parts, in the order of their numbers in the bytes of a record.
            pub const ALL: [Self; [$(stringify!($name)),+].len()] = [$(Self::$part),+];

            /// Name in files and Python.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$part => stringify!($name),)+ }
            }

            /// Meaning in documents.
            pub fn meaning(self) -> &'static str {
                match self { $(Self::$part => $meaning.trim_ascii(),)+ }
            }

            /// Unit; `m/s^2` is that of an accelerometer, `rad/s` that of a gyroscope.
            pub const fn unit(self) -> &'static str {
                match self { $(Self::$part => $unit,)+ }
            }

            /// Count of numbers.
            pub const fn count(self) -> usize {
                type T = f32;
                match self { $(Self::$part => <$type as Numbers<T>>::COUNT,)+ }
            }

            /// Returns whether its numbers may be infinite, where nothing is known.
            pub const fn may_be_infinite(self) -> bool {
                match self { $(Self::$part => matches!(NumberBound::$bound, NumberBound::OrInfinite),)+ }
            }

            /// First version of the bytes that has it.
            pub const fn version(self) -> u8 {
                match self { $(Self::$part => $version,)+ }
            }
        }
    };
}

/// Values that a number of a record may take.
enum NumberBound {
    Finite,
    OrInfinite,
}

/// Numbers that lie one after the other in memory.
trait Numbers<T> {
    const COUNT: usize;
    fn zero() -> Self;
    fn numbers(&self) -> &[T];
    fn numbers_mut(&mut self) -> &mut [T];
}

impl<T: Real, const COLUMNS: usize> Numbers<T> for SMatrix<T, 3, COLUMNS> {
    const COUNT: usize = 3 * COLUMNS;

    fn zero() -> Self {
        zeros()
    }

    fn numbers(&self) -> &[T] {
        self.as_slice()
    }

    fn numbers_mut(&mut self) -> &mut [T] {
        self.as_mut_slice()
    }
}

impl<T: Real> Numbers<T> for T {
    const COUNT: usize = 1;

    fn zero() -> Self {
        T::zero()
    }

    fn numbers(&self) -> &[T] {
        slice::from_ref(self)
    }

    fn numbers_mut(&mut self) -> &mut [T] {
        slice::from_mut(self)
    }
}

record_table!(define);

impl<T: Real> Record<T> {
    /// Creates the first record of a sensor whose bias alone is known, m/s^2 or rad/s, with its 1-sigma, for
    /// example from a spin: M is the identity, with infinite sigma.
    pub fn of_bias(identity: u64, sensor: Sensor, bias: &Vector3<T>, sigma: &Vector3<T>) -> Self {
        Self {
            model: ErrorModel {
                bias: *bias,
                ..ErrorModel::identity()
            },
            bias_sigma: *sigma,
            sequence: 1,
            ..Self::unknown(identity, sensor)
        }
    }

    /// Returns whether motion showed all directions of M.
    pub fn shows_matrix(&self) -> bool {
        self.fit_model >= FitModel::Affine && self.directions >= 3
    }

    /// Returns whether all numbers are finite that are not a sigma or a residual.
    pub fn is_finite(&self) -> bool {
        let mut parts = RecordPart::ALL.into_iter().zip(self.parts());
        parts.all(|(part, numbers)| part.may_be_infinite() || numbers.iter().all(|x| x.is_finite()))
    }

    /// Converts the record to another type of numbers.
    pub fn in_numbers<U: Real>(&self, number: impl Fn(T) -> U + Copy) -> Record<U> {
        let mut other = Record::unknown(self.identity, self.sensor);
        (other.fit_model, other.directions) = (self.fit_model, self.directions);
        (other.pairs, other.sequence) = (self.pairs, self.sequence);
        for (there, here) in other.parts_mut().into_iter().zip(self.parts()) {
            there
                .iter_mut()
                .zip(here)
                .for_each(|(to, from)| *to = number(*from));
        }
        other
    }
}

/// Storage that keeps records over a reset.
pub trait Storage<T: Real> {
    /// Error of the storage.
    type Error;

    /// Loads the record of a sensor of a unit, if there is one.
    ///
    /// # Errors
    /// A record exists but cannot be read.
    fn load(&mut self, identity: u64, sensor: Sensor) -> Result<Option<Record<T>>, Self::Error>;

    /// Loads the record from the factory, if it is stored.
    ///
    /// # Errors
    /// A record exists but cannot be read.
    fn load_factory(&mut self, identity: u64, sensor: Sensor) -> Result<Option<Record<T>>, Self::Error>;

    /// Replaces the record of a sensor of a unit: afterwards the old or the new one is stored completely,
    /// whatever happens.
    ///
    /// # Errors
    /// The record could not be stored; the old one remains.
    fn save(&mut self, record: &Record<T>) -> Result<(), Self::Error>;
}
