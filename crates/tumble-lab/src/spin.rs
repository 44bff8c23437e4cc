//! A spin out of a recording whose rests are known: the device's estimator over arrays, with what pictures need.

use nalgebra::{Matrix3, Vector2, Vector3};
use tumble_core::noise::{AllanLadder, Noise};
use tumble_core::real::{Real, count, real, seconds};
use tumble_core::sample::Sample;
use tumble_core::spin::axis::floor_frame;
use tumble_core::spin::block::{Block, BlockBuilder};
use tumble_core::spin::collector::Collector;
use tumble_core::spin::estimate::{SpinEstimate, TrueAngle};
use tumble_core::spin::failure::SpinFailure;
use tumble_core::spin::level_free::LevelFree;
use tumble_core::spin::machine::SpinMachine;
use tumble_core::spin::settings::SpinSettings;

/// First and last instant of a rest, microseconds.
pub type RestTimes = (u64, u64);

/// One block of the recording beside what the fit has for it, floor frame: forward, left, up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedBlock<T: Real> {
    /// Middle, microseconds.
    pub time: u64,
    /// True if the robot stood still.
    pub resting: bool,
    /// Heading since the first rest, rad.
    pub heading: T,
    /// Rate about the turning axis, rad/s.
    pub rate: T,
    /// Rate across it, rad/s.
    pub across: Vector2<T>,
    /// Specific force less accelerometer bias, m/s^2.
    pub force: Vector3<T>,
    /// The same as the model has it.
    pub fit: Vector3<T>,
}

/// Estimates of a spin, and its blocks.
#[derive(Clone, Debug, PartialEq)]
pub struct SpinFit<T: Real> {
    /// Everything found.
    pub estimate: SpinEstimate<T>,
    /// Successive blocks.
    pub blocks: Vec<FittedBlock<T>>,
    /// Factor on the variances of the rows of the turning robot because residuals go on from one to the next; else one.
    pub row_factor: T,
}

/// Estimates from the samples of one spin, in order of time, given when the robot stood still. Bias instability is read
/// off the residuals where it is not given.
///
/// # Errors
/// [`SpinFailure`] where the samples are no spin that can be used.
pub fn fit<T: Real>(
    samples: impl Iterator<Item = Sample<T>> + Clone,
    rests: &[RestTimes],
    settings: &SpinSettings<T>,
    bias_instability: Option<(T, T)>,
    true_angle: Option<&TrueAngle<T>>,
) -> Result<SpinFit<T>, SpinFailure<T>> {
    let independent = (T::zero(), T::one());
    let with =
        |instability, lasting| fit_once(samples.clone(), rests, settings, instability, lasting, true_angle);
    let instability = match bias_instability {
        Some(known) => known,
        // The first fit is there to show the instability, and takes none for granted.
        None => instability_of_residuals(&with((T::zero(), T::zero()), independent)?.blocks),
    };
    let plain = with(instability, independent)?;
    let lasting = lasting(&plain.blocks);
    // A misfit widens by all that chi-square has too much, in whatever direction of the unknowns.
    if plain.estimate.widening > T::one() || lasting == independent {
        return Ok(plain);
    }
    with(instability, lasting)
}

/// Times chance, once in a thousand, beyond which residuals go on from one row to the next.
const UNLIKELY: f64 = 3.1;

/// Largest correlation that is distinguished from a constant.
const MOST_ALIKE: f64 = 0.95;

/// Variance of an axis, (m/s^2)^2, that goes on from row to row of the turning robot, and the factor on the variances of its
/// rows that stands for it: none, and one, where chance makes as much (docs/theory/spin.md, eq. 25a and 25b).
fn lasting<T: Real>(blocks: &[FittedBlock<T>]) -> (T, T) {
    let half = real::<T>(0.5);
    let residual = |block: &FittedBlock<T>| block.force - block.fit;
    let (mut of_axes, mut alike, mut rows, mut pairs) = (Vector3::zeros(), T::zero(), 0_u32, 0_u32);
    for run in blocks.chunk_by(|block, next| block.resting == next.resting) {
        let turning = run.iter().filter(|block| !block.resting).collect::<Vec<_>>();
        let means: Vec<Vector3<T>> = turning
            .chunks_exact(2)
            .map(|pair| pair.iter().map(|block| residual(block)).sum::<Vector3<T>>() * half)
            .collect();
        for mean in &means {
            of_axes += mean.component_mul(mean);
        }
        alike += means
            .windows(2)
            .fold(T::zero(), |sum, pair| sum + pair[0].dot(&pair[1]));
        rows += u32::try_from(means.len()).unwrap_or(u32::MAX);
        pairs += u32::try_from(means.len().saturating_sub(1)).unwrap_or(u32::MAX);
    }
    let sum = of_axes.sum();
    if pairs == 0 || sum <= T::zero() {
        return (T::zero(), T::one());
    }
    let correlation = alike / sum * count::<T>(rows) / count(pairs); // eq. 25a
    let chance = of_axes.norm() / sum / count::<T>(pairs).sqrt();
    if correlation < chance * real(UNLIKELY) {
        return (T::zero(), T::one());
    }
    let correlation = correlation.min(real(MOST_ALIKE));
    let variance = sum / (count::<T>(rows) * real(3.0));
    let factor = (T::one() + correlation) / (T::one() - correlation); // eq. 25b
    (variance * correlation, factor)
}

/// Estimates bias instability from the samples of a spin that a state machine has seen, and passes it on: a machine
/// keeps sums only, and no sum that shows it. A machine without a result stays as it is.
pub fn read_bias_instability<T: Real>(
    machine: &mut SpinMachine<T>,
    samples: impl Iterator<Item = Sample<T>>,
) {
    let Ok(found) = machine.solve(None) else { return };
    let floor = floor_frame(&found.up);
    let mut builder = BlockBuilder::new(machine.settings().block);
    let blocks = samples.filter_map(|sample| builder.push(&sample)).map(|block| {
        let rate = floor.tr_mul(&block.angular_rate());
        UnmovedMeans {
            duration: block.duration(),
            force_up: block.specific_force().dot(&found.up),
            rate_across: rate.xy(),
        }
    });
    let (of_force, of_rate) = flicker(blocks);
    machine.know_bias_instability(of_force.flicker.sqrt(), likely(&of_rate).sqrt());
}

/// B^2 that a short record makes likely: about the mean of what is normal about the one it shows, and not below zero.
///
/// Some seconds of rest alone show the bias of the gyroscope along the axis, and nothing would contradict a B that was
/// found too small; that of the accelerometer all the record shows, and chi-square with it.
fn likely<T: Real>(noise: &Noise<T>) -> T {
    const CHANCE: f64 = 8.0 / core::f64::consts::PI; // docs/theory/spin.md, eq. 17
    let (shown, sigma) = (noise.flicker_shown, noise.flicker_sigma * real(CHANCE.sqrt()));
    let likely = (shown + shown.hypot(sigma)) * real(0.5);
    // A record too short to show any of it has no sigma.
    if likely.is_finite() { likely } else { T::zero() }
}

/// Means over a block of what no motion changes, besides a constant: the force along the turning axis, the rate across.
struct UnmovedMeans<T: Real> {
    duration: T,
    force_up: T,
    rate_across: Vector2<T>,
}

/// Bias instability from the residuals of a fit.
fn instability_of_residuals<T: Real>(blocks: &[FittedBlock<T>]) -> (T, T) {
    let (of_force, of_rate) = flicker(blocks.windows(2).filter_map(|pair| {
        let [block, next] = pair else { return None };
        Some(UnmovedMeans {
            duration: seconds(next.time - block.time),
            force_up: block.force.z - block.fit.z,
            rate_across: block.across,
        })
    }));
    (of_force.flicker.sqrt(), of_rate.flicker.sqrt())
}

/// Noise of the force and of the rate (docs/theory/noise.md, eq. 7).
fn flicker<T: Real>(blocks: impl Iterator<Item = UnmovedMeans<T>>) -> (Noise<T>, Noise<T>) {
    let mut ladder = AllanLadder::new();
    let zero = T::zero();
    for block in blocks {
        let across = block.rate_across;
        ladder.push(
            &[block.force_up, zero, zero, across.x, across.y, zero],
            block.duration,
        );
    }
    let [of_force] = ladder.fit_jointly([0]);
    let [of_rate, _] = ladder.fit_jointly([3, 4]);
    (of_force, of_rate)
}

fn fit_once<T: Real>(
    samples: impl Iterator<Item = Sample<T>>,
    rests: &[RestTimes],
    settings: &SpinSettings<T>,
    (of_force, of_rate): (T, T),
    (lasting, row_factor): (T, T),
    true_angle: Option<&TrueAngle<T>>,
) -> Result<SpinFit<T>, SpinFailure<T>> {
    let settings = SpinSettings {
        // A rest shares what goes on while the robot turns, as it does flicker.
        specific_force_instability: (of_force * of_force + lasting).sqrt(),
        angular_rate_instability: of_rate,
        ..*settings
    };
    let mut recorder = BlockRecorder {
        collector: Collector::new(&settings),
        blocks: Vec::new(),
    };
    let mut was_resting = None;
    for sample in samples {
        let resting = rests
            .iter()
            .any(|(start, end)| (*start..=*end).contains(&sample.time));
        if let Some(before) = was_resting.filter(|before| *before != resting) {
            recorder.cut(before)?;
        }
        was_resting = Some(resting);
        if let Some(block) = recorder.collector.push(&sample)? {
            recorder.take(block, resting)?;
        }
    }
    recorder.cut(was_resting.unwrap_or(false))?;
    recorder.collector.know_row_factor(row_factor);
    let (estimate, fit) = recorder.collector.solve(true_angle)?;
    let blocks = draw(&recorder.blocks, &fit);
    Ok(SpinFit {
        estimate,
        blocks,
        row_factor,
    })
}

struct BlockRecorder<T: Real> {
    collector: Collector<T>,
    blocks: Vec<(Block<T>, bool)>,
}

impl<T: Real> BlockRecorder<T> {
    fn take(&mut self, block: Block<T>, resting: bool) -> Result<(), SpinFailure<T>> {
        self.collector.take(&block, resting)?;
        self.blocks.push((block, resting));
        Ok(())
    }

    /// Ends the block at hand where the robot stops or starts.
    fn cut(&mut self, resting: bool) -> Result<(), SpinFailure<T>> {
        if let Some(block) = self.collector.cut() {
            self.take(block, resting)?;
        }
        if resting {
            self.collector.end_stop();
        }
        Ok(())
    }
}

fn draw<T: Real>(blocks: &[(Block<T>, bool)], fit: &LevelFree<T>) -> Vec<FittedBlock<T>> {
    let floor: Matrix3<T> = fit.floor;
    let accelerometer = fit.accelerometer_bias();
    let gyroscope = fit.gyroscope_bias;
    (0..blocks.len())
        .map(|i| {
            let (block, resting) = &blocks[i];
            let rate = floor.tr_mul(&(block.angular_rate() - gyroscope));
            let heading = block.heading + fit.heading_correction(block.heading, block.time);
            let change = acceleration(blocks, i);
            let at =
                |share: f64| fit.specific_force(heading + block.gained * real(share), block.rate, change);
            // Over a block the heading moves on: Simpson's mean of the model.
            let modelled = (at(-0.5) + at(0.0) * real::<T>(4.0) + at(0.5)) / real::<T>(6.0);
            FittedBlock {
                time: block.start + (block.end - block.start) / 2,
                resting: *resting,
                heading,
                rate: rate.z,
                across: Vector2::new(rate.x, rate.y),
                force: floor.tr_mul(&(block.specific_force() - accelerometer)),
                fit: floor.tr_mul(&modelled),
            }
        })
        .collect()
}

/// Change of rate from the block before to the block after, rad/s^2.
fn acceleration<T: Real>(blocks: &[(Block<T>, bool)], i: usize) -> T {
    let before = &blocks[i.saturating_sub(1)].0;
    let after = &blocks[(i + 1).min(blocks.len() - 1)].0;
    let span = after.time - before.time;
    if span > real(0.0) {
        (after.rate - before.rate) / span
    } else {
        T::zero()
    }
}
