//! Both units side by side: pairs of means under the same triangle, by the primary's clock.

use crate::align::samples::{MEASURED, Triangle, UnitSamples, WITH_PRODUCTS, WindowMoments, rate_of};

/// Blocks of a part of a log that show its own clock.
const FEWEST_BLOCKS: usize = 12;

/// Offset and rate of the secondary's clock relative to the primary's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeClock {
    /// To be added to the secondary's time at the instant `reference`, s.
    pub offset: f64,
    /// Growth of the offset with the primary's time.
    pub skew: f64,
    /// An instant of the primary's clock, s.
    pub reference: f64,
}

impl RelativeClock {
    /// Time of the secondary's clock at an instant of the primary's (docs/theory/align.md, eq. 4).
    pub fn shown(&self, time: f64) -> f64 {
        time - self.offset - self.skew * (time - self.reference) // eq. 4
    }
}

/// Times by which sensors are later than others of their unit, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorDelays {
    /// The secondary's accelerometer against the clock that the gyroscopes give.
    pub secondary_force: f64,
    /// The primary's gyroscope against its accelerometer.
    pub primary_rate: f64,
}

/// The primary over successive windows.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Where the windows begin and end, s of the primary's clock.
    pub edges: Vec<f64>,
    /// Length of a window, s.
    pub length: f64,
    /// Windows that one block holds: what happens in different blocks is taken to be independent.
    pub windows_per_block: usize,
    /// The primary's means.
    pub primary: Vec<Option<WindowMoments<WITH_PRODUCTS>>>,
}

/// The two units under one triangle.
#[derive(Clone, Copy, Debug)]
pub struct TrianglePair {
    /// Middle of the triangle, s of the primary's clock.
    pub time: f64,
    /// Block it lies in.
    pub block: usize,
    /// Sums of the primary.
    pub primary: Triangle<WITH_PRODUCTS>,
    /// Sums of the secondary.
    pub secondary: Triangle<MEASURED>,
}

impl Grid {
    /// Windows of a length over all of the primary, in so many blocks of at least half a second and four windows.
    pub fn over(primary: &UnitSamples<'_>, length: f64, blocks: usize) -> Self {
        let (start, end) = primary.span();
        let count = whole((end - start) / length);
        let edges = edges(start, count, length);
        Self {
            primary: primary.windows_with_products(&edges),
            edges,
            length,
            windows_per_block: (count / blocks).max(whole(0.5 / length)).max(4),
        }
    }

    /// At most so many parts of it, with as much energy of the motion each; fewer where it is short.
    pub fn parts(&self, most: usize) -> Vec<Self> {
        let energy: Vec<f64> = (self.primary.iter())
            .map(|window| {
                window
                    .as_ref()
                    .map_or(0.0, |window| rate_of(&window.mean).norm_squared())
            })
            .collect();
        let count = (self.primary.len() / (FEWEST_BLOCKS * self.windows_per_block)).min(most);
        #[allow(clippy::cast_precision_loss)]
        let share = energy.iter().sum::<f64>() / count.max(1) as f64;
        let mut passed = 0.0;
        let number = energy.iter().map(|energy| {
            passed += energy;
            whole((passed - 0.5 * energy) / share).min(count.saturating_sub(1))
        });
        let number: Vec<usize> = number.collect();
        (0..count)
            .map(|part| {
                let (from, to) = (
                    number.partition_point(|each| *each < part),
                    number.partition_point(|each| *each <= part),
                );
                Self {
                    edges: self.edges[from..=to].to_vec(),
                    primary: self.primary[from..to].to_vec(),
                    ..*self
                }
            })
            .collect()
    }

    /// Pairs in which both units can be used.
    pub fn pairs(&self, secondary: &UnitSamples<'_>, clock: &RelativeClock) -> Vec<TrianglePair> {
        self.paired(&self.primary, secondary, clock, 0.0)
    }

    /// The same where the sensors of a unit are late against one another: the secondary is averaged at its
    /// accelerometer's time, and the primary's rates at its gyroscope's.
    pub fn pairs_with_delays(
        &self,
        primary: &UnitSamples<'_>,
        secondary: &UnitSamples<'_>,
        clock: &RelativeClock,
        delays: SensorDelays,
    ) -> Vec<TrianglePair> {
        let later: Vec<f64> = self.edges.iter().map(|edge| edge + delays.primary_rate).collect();
        let late = primary.windows_with_products(&later);
        let windows = self.primary.iter().zip(late);
        let ours: Vec<_> = windows
            .map(|(window, late)| Some(late?.with_force_of(window.as_ref()?)))
            .collect();
        self.paired(&ours, secondary, clock, delays.secondary_force)
    }

    fn paired(
        &self,
        ours: &[Option<WindowMoments<WITH_PRODUCTS>>],
        secondary: &UnitSamples<'_>,
        clock: &RelativeClock,
        delay: f64,
    ) -> Vec<TrianglePair> {
        let shown: Vec<f64> = self.edges.iter().map(|edge| clock.shown(*edge) + delay).collect();
        let theirs = secondary.windows(&shown);
        let length = self.length * (1.0 - clock.skew);
        let windows = ours.windows(2).zip(theirs.windows(2)).enumerate();
        windows
            .filter_map(|(k, (ours, theirs))| {
                Some(TrianglePair {
                    time: self.edges[k + 1],
                    block: k / self.windows_per_block,
                    primary: Triangle::over(ours[0].as_ref()?, ours[1].as_ref()?, self.length),
                    secondary: Triangle::over(theirs[0].as_ref()?, theirs[1].as_ref()?, length),
                })
            })
            .collect()
    }
}

/// Ends of successive windows.
#[allow(clippy::cast_precision_loss)]
pub fn edges(start: f64, count: usize, length: f64) -> Vec<f64> {
    (0..=count).map(|k| start + k as f64 * length).collect()
}

/// Whole windows in a span of so many.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub fn whole(count: f64) -> usize {
    count.max(0.0) as usize
}
