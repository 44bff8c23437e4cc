//! All constants of the model: the quantity, its unit, and its origin.
//!
//! Pairs of numbers are those of accelerometers and of gyroscopes. "Flights" are the training half of the recorded flights
//! of four units (docs/benchmarks/redundancy.md).

use crate::real::SECOND;

/// us from one window to the next, half the width of a triangle: the means of 0.1 s that flights need against vibration.
pub const HOP: u64 = SECOND / 20;
/// Windows over which a boxcar has as much white noise as the leaky mean of a scale: from the fastest alert to the
/// smallest fault.
pub const SCALES: [u16; 7] = [1, 2, 4, 10, 20, 40, 100];
/// Sigmas beyond which a pair disagrees, by scale: the tail of sound pairs of flights. With 9, 8.5, 8.5 and 8 from 0.5 s on, 21 of 484
/// faults of flights were not found without stored errors, and 0.2 rad/s took up to 2.2 s.
pub const LIMITS: [f32; 7] = [10.0, 9.0, 8.0, 7.0, 7.0, 7.0, 7.0];
/// Windows of a block, which is learnt from once the next one has ended in agreement: 1 s, longer than a fault hides.
pub const BLOCK: u8 = 20;
/// The scale over which the share of lost samples counts: 2 s.
pub const LOSSY_SCALE: usize = 5;
/// Windows of a mean of specific force: vibration dilutes the scale of shorter ones by 8 to 21 % in flights, by 2 % of these.
pub const FORCE_WINDOWS: u8 = 10;
/// us for which a window waits for units that are behind: the clocks of flights are up to 98 ms apart.
pub const WAIT: u64 = 3 * HOP;
/// s: longest usual sample interval of a unit that a majority judges, of 50 Hz by a clock of its own: four samples lie under a triangle.
pub const SLOWEST: f64 = 0.0225;
/// us over which samples are counted, and how often, before the interval is known: half a second.
pub const COUNTED: (u64, u8) = (SECOND / 4, 2);
/// Sample interval over the usual one beyond which a window is dropped: a sample is missing.
pub const LONGEST: f64 = 1.6;
/// s after which units are compared: means of the first scales are whole.
pub const BEGINS: u64 = 2 * SECOND;

/// Windows whose motion gives the first delay, of the span after it, and of all later ones: a crystal of 200 ppm moves by 2 ms.
pub const SPANS: [u32; 3] = [50, 35, 200];
/// s: sigma of a delay beyond which the motion was too little to find it.
pub const SIGNIFICANT: f64 = 0.003;
/// Largest part of the motion that a delay may leave.
pub const SHARED: f64 = 0.5;
/// 1 sigma of a delay that no motion has shown, of one found among whole windows, of any other at least, s, and of the rate of
/// a crystal against another.
pub const CLOCK_SIGMAS: [f64; 4] = [0.03, 0.01, 2e-3, 2e-4];
/// Square of the derivative over that of its noise, with which a delay is found too small by a tenth.
pub const SHOWN: f64 = 10.0;
/// Sigmas beyond which a span is left out.
pub const CONTRADICTED: f64 = 4.0;

/// 1 sigma of errors of which nothing is known: matrix, then biases in m/s^2 and rad/s, and lever arm in m: two parts of
/// consumer grade, mounted by hand.
pub const UNCALIBRATED: ErrorSigmas = ErrorSigmas {
    matrix: 0.03,
    bias: [0.6, 0.042],
    arm: 0.12,
};
/// 1 sigma of the change of stored errors from one flight to the next: flights.
pub const STORED: ErrorSigmas = ErrorSigmas {
    matrix: 0.002,
    bias: [0.04, 0.002],
    arm: 0.01,
};
/// m/s^2 and rad/s by which biases walk in a root second: flights.
pub const WALK: [f64; 2] = [1e-3, 7e-5];
/// m/s^2 of a mean of specific force and rad/s of a window: noise of a difference of two units that counts as independent.
pub const SIGMAS: [f64; 2] = [0.1, 0.012];

/// s: the most that a delay may explain of a deviation along the derivative, as filters of units differ; sample intervals, and
/// sigmas of an uncertain delay, that it may explain where these are longer.
pub const DELAYED: (f64, [f64; 2]) = (0.0085, [0.75, 3.0]);
/// Share of the square of the interval times the second derivative that straight lines miss at most: two of an eighth.
pub const BETWEEN: f64 = 0.25;
/// m/s^2 and rad/s that never count as a deviation: what no use notices.
pub const FLOOR: [f64; 2] = [0.03, 0.0035];
/// Share of the motion that a model linear in it leaves: data sheets.
pub const NONLINEAR: [f64; 2] = [0.004, 0.003];
/// Weight of a leaky mean, and share of whole windows of a unit, within which too much is missing.
pub const WHOLE: f64 = 0.6;
/// s with which the usual noise of a pair rises and falls, as throttle changes within seconds, and what is usual of a unit.
pub const LEARNT_SECONDS: [f64; 3] = [4.0, 12.0, 10.0];
/// Share of the variance of white noise that the mean over any scale has at least: a line that aliases to 0.8 Hz leaves a seventh
/// of it over half a second. With all of it flights show 0.3 m/s^2 after 3.4 s, not 1.6, and 27 sound units are named, not 34,
/// beside lines that alias.
pub const WANDERS: f64 = 0.25;
/// Variances beyond which a deviation adds no more to the usual noise: three sigmas.
pub const CLIPPED: f64 = 9.0;
/// Number of the shortest scales whose mean over a block is no noise.
pub const DIFFERENCED: usize = 3;
/// m/s^2 and rad/s of noise, of vibration and of scatter that are usual at least: good parts.
pub const LEAST_NOISE: [f64; 2] = [0.02, 0.001];
/// The same before anything is learnt, and the blocks for which it counts: with one, small faults of flights take twice as long.
pub const FIRST_NOISE: ([f64; 2], f64) = ([0.3, 0.02], 0.25);

/// Ratio to the threshold within which all pairs must be in both blocks: a fault is never learnt.
pub const AGREEING: f64 = 0.6;
/// Ratio within which the others agree once the wrong unit is left out, its share of that of the next best unit, and the cosine
/// of a deviation with that of the window before: a fault that lasts.
pub const CLEAR: [f64; 3] = [0.7, 0.5, 0.3];
/// s of silence, and sample intervals where these are longer.
pub const LATE: (f64, f64) = (0.1, 3.0);
/// Equal readings in succession beside a unit that changes, and the same over the most in health: resolutions are coarse.
pub const REPEATS: (u8, u8) = (12, 3);
/// Steps of its resolution by which the set moves until an axis has to change.
pub const MOVED: f64 = 2.0;
/// Own scatter over its usual, and over what the others show of theirs, root mean square, for so many windows in motion and at
/// rest: motion that begins shakes the unit with the widest filter first.
pub const NOISY: (f64, f64, [u8; 2]) = (6.0, 4.0, [4, 20]);
/// m/s^2 and rad/s: usual scatter of a sample is no less.
pub const LEAST_SCATTER: [f64; 2] = [0.02, 0.002];
/// us without its own fault, and in agreement, after which a unit counts again.
pub const RETURNS: [u64; 2] = [2 * SECOND, 10 * SECOND];

/// m/s^2 and rad/s by which others that agree may differ from the primary at rest (PX4, ArduPilot), and from any unit.
pub const BOUNDS: [[f64; 2]; 2] = [[0.7, 0.087], [2.0, 0.25]];
/// Sigmas of an error that count in its favour, and blocks in succession.
pub const BOUND_SIGMAS: (f64, u8) = (4.0, 3);
/// m/s^2 and rad/s: largest scatter of windows of a unit at rest; scatters beyond which a window is no part of it; and the rate of
/// a unit that is no evidence of a rest, rad/s.
pub const STILL: ([f64; 2], f64, f64) = ([0.06, 0.006], 4.0, 0.1);
/// m/s^2 and rad/s, 1 sigma of the change of a sound unit from rest to rest, and of one that no rest has shown.
pub const CHANGED: [[f64; 2]; 2] = [[0.05, 0.0025], [0.3, 0.03]];
/// Largest evidence of a sensor, evidence of a sound unit at most, and difference that decides between two.
pub const EVIDENCE: [f64; 3] = [27.0, 4.0, 6.0];
/// Windows in succession in which units disagree before it is reported, of two, and of more, of which one may yet be named.
pub const DWELL: [u8; 2] = [2, BLOCK];

/// Sigmas of the errors of a unit before any motion is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorSigmas {
    /// Elements of the matrices.
    pub matrix: f64,
    /// m/s^2 and rad/s.
    pub bias: [f64; 2],
    /// m.
    pub arm: f64,
}

// Constants that follow from these.

/// s of a hop.
pub const HOP_SECONDS: f64 = HOP as f64 / SECOND as f64;
/// Number of the scales.
pub const COUNT: usize = SCALES.len();
/// s of a block.
pub const BLOCK_SECONDS: f64 = BLOCK as f64 * HOP_SECONDS;
/// The scale of a block.
pub const BLOCK_SCALE: usize = 4;
/// Windows after a span from which on its delay holds: until then no window of its own is missing any more.
pub const APPLIED: u32 = (2 * WAIT / HOP + 1) as u32;
/// us after the first window until a delay has been found and corrected.
pub const SYNCHRONISED: u64 = (SPANS[0] + APPLIED + SPANS[1] + APPLIED + 1) as u64 * HOP;
