//! Is it at rest? Judged block by block, against the quietest the sensor has been.
//!
//! A block is quiet if the scatter of its samples is that of the sensor's own noise, whatever the level: a bias
//! may be as large as it likes. A rest goes on while the level of the blocks stays where it was, which a slow
//! turn does not, even one whose rate is constant: gravity turns with it. Vibration shows in the scatter.

use crate::moments::Moments;
use crate::real::{Real, count, real};
use crate::sample::CHANNELS;

/// Mean and scatter of the six channels.
pub type UnitMoments<T> = Moments<T, CHANNELS>;

/// When a unit counts as being at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillnessSettings<T: Real> {
    /// Ratio above the noise floor that the variance of a quiet block may have.
    pub variance_ratio: T,
    /// Scatter of specific force below which a block is quiet whatever the floor, m/s^2.
    pub smallest_specific_force_scatter: T,
    /// Scatter of angular rate below which a block is quiet whatever the floor, rad/s.
    pub smallest_angular_rate_scatter: T,
    /// Deviation of the mean specific force of a block from its rest besides noise, at most, m/s^2.
    pub specific_force_drift: T,
    /// Deviation of the mean angular rate of a block from its rest besides noise, at most, rad/s.
    pub angular_rate_drift: T,
    /// Deviation of the mean of a block besides the drift, at most, in sigmas.
    pub sigmas: T,
}

impl<T: Real> Default for StillnessSettings<T> {
    fn default() -> Self {
        Self {
            variance_ratio: real(4.0),
            smallest_specific_force_scatter: real(0.005),
            smallest_angular_rate_scatter: real(0.0003),
            specific_force_drift: real(0.005),
            angular_rate_drift: real(0.0005),
            sigmas: real(6.0),
        }
    }
}

/// Share of gravity above which nothing at rest scatters: a table that shakes by 1 m/s^2 stays below, a unit that flies does not.
const LARGEST_SHARE_OF_GRAVITY: f64 = 0.3;

/// Tests whether specific force scatters as that of no sensor at rest does, in whatever unit: of a unit that flies.
pub fn shakes<T: Real>(block: &UnitMoments<T>) -> bool {
    let mean = block.mean();
    let square = mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2];
    Scatter::of(block).specific_force > square * real(LARGEST_SHARE_OF_GRAVITY * LARGEST_SHARE_OF_GRAVITY)
}

/// Blocks over which the noise floor is averaged.
const FLOOR_BLOCKS: u32 = 16;

/// Variance of one sample, mean over the three axes, of the two triads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter<T: Real> {
    /// (m/s^2)^2.
    pub specific_force: T,
    /// (rad/s)^2.
    pub angular_rate: T,
}

impl<T: Real> Scatter<T> {
    /// No scatter.
    pub fn zero() -> Self {
        Self {
            specific_force: T::zero(),
            angular_rate: T::zero(),
        }
    }

    /// Scatter of a run of samples.
    pub fn of(moments: &UnitMoments<T>) -> Self {
        let [fx, fy, fz, wx, wy, wz] = moments.variance();
        let third = real::<T>(1.0 / 3.0);
        Self {
            specific_force: (fx + fy + fz) * third,
            angular_rate: (wx + wy + wz) * third,
        }
    }
}

/// Distinguishes quiet blocks from others; learns the noise floor of the sensor from the quietest stretch so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stillness<T: Real> {
    settings: StillnessSettings<T>,
    floor: Option<Scatter<T>>,
    settled: bool,
    gathered: Scatter<T>,
    blocks: u32,
}

impl<T: Real> Stillness<T> {
    /// Knows nothing of the sensor yet: the first blocks set the floor until quieter ones come.
    pub fn new(settings: StillnessSettings<T>) -> Self {
        Self {
            settings,
            floor: None,
            settled: false,
            gathered: Scatter {
                specific_force: T::zero(),
                angular_rate: T::zero(),
            },
            blocks: 0,
        }
    }

    /// Knows the noise floor of the sensor.
    pub fn with_floor(settings: StillnessSettings<T>, floor: Scatter<T>) -> Self {
        Self {
            floor: Some(floor),
            settled: true,
            ..Self::new(settings)
        }
    }

    /// Variance of a sample at the quietest so far; `None` before the first block.
    pub fn floor(&self) -> Option<Scatter<T>> {
        self.floor
    }

    /// Takes in the scatter of a block and returns whether the block is quiet.
    pub fn push(&mut self, block: &UnitMoments<T>) -> bool {
        let scatter = Scatter::of(block);
        self.learn(&scatter);
        self.is_quiet(&scatter)
    }

    /// Tests whether a scatter is that of the sensor's own noise.
    pub fn is_quiet(&self, scatter: &Scatter<T>) -> bool {
        self.is_quiet_beside(scatter, &Scatter::zero())
    }

    /// The same where means of blocks scatter by a variance of their own: noise that is slower than a block.
    pub fn is_quiet_beside(&self, scatter: &Scatter<T>, coloured: &Scatter<T>) -> bool {
        let Some(floor) = self.floor else {
            return false;
        };
        let limits = &self.settings;
        let gate =
            |floor: T, slow: T, smallest: T| (floor + slow) * limits.variance_ratio + smallest * smallest;
        let force = gate(
            floor.specific_force,
            coloured.specific_force,
            limits.smallest_specific_force_scatter,
        );
        let rate = gate(
            floor.angular_rate,
            coloured.angular_rate,
            limits.smallest_angular_rate_scatter,
        );
        scatter.specific_force <= force && scatter.angular_rate <= rate
    }

    /// Tests whether a block is at the level of the rest it would join.
    pub fn is_level(&self, rest: &UnitMoments<T>, block: &UnitMoments<T>) -> bool {
        self.is_level_beside(rest, block, &Scatter::zero())
    }

    /// The same where means of blocks scatter by a variance of their own: noise that is slower than a block.
    pub fn is_level_beside(
        &self,
        rest: &UnitMoments<T>,
        block: &UnitMoments<T>,
        coloured: &Scatter<T>,
    ) -> bool {
        let Some(floor) = self.floor else {
            return false;
        };
        let limits = &self.settings;
        let shorter = T::one() / count(block.samples().max(1)) + T::one() / count(rest.samples().max(1));
        let blocks = T::one() + count::<T>(block.samples().max(1)) / count(rest.samples().max(1));
        let within = |first: usize, variance: T, slow: T, drift: T| {
            let apart = (first..first + 3).fold(T::zero(), |sum, i| {
                let d = block.mean()[i] - rest.mean()[i];
                sum + d * d
            });
            apart.square_root() <= drift + limits.sigmas * (variance * shorter + slow * blocks).square_root()
        };
        within(
            0,
            floor.specific_force,
            coloured.specific_force,
            limits.specific_force_drift,
        ) && within(
            3,
            floor.angular_rate,
            coloured.angular_rate,
            limits.angular_rate_drift,
        )
    }

    /// The floor is the mean over the quietest group of blocks: a minimum of single blocks would sit below the noise.
    fn learn(&mut self, scatter: &Scatter<T>) {
        self.gathered.specific_force += scatter.specific_force;
        self.gathered.angular_rate += scatter.angular_rate;
        self.blocks += 1;
        if self.settled && self.blocks < FLOOR_BLOCKS {
            return;
        }
        let blocks = count::<T>(self.blocks);
        let mean = Scatter {
            specific_force: self.gathered.specific_force / blocks,
            angular_rate: self.gathered.angular_rate / blocks,
        };
        if self.blocks == FLOOR_BLOCKS {
            let quieter = |floor: T, mean: T| if self.settled { floor.min(mean) } else { mean };
            self.floor = Some(match self.floor {
                Some(floor) => Scatter {
                    specific_force: quieter(floor.specific_force, mean.specific_force),
                    angular_rate: quieter(floor.angular_rate, mean.angular_rate),
                },
                None => mean,
            });
            *self = Self {
                floor: self.floor,
                settled: true,
                ..Self::new(self.settings)
            };
        } else if !self.settled {
            self.floor = Some(mean);
        }
    }
}
