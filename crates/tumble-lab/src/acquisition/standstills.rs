//! Readings that repeat for a while, of channels whose noise else moves them from sample to sample (docs/theory/rounding.md).

use std::borrow::Cow;

use crate::distributions::balanced_median;

/// Time for which readings may stand still, as long as samples may be missing, s.
pub const FROZEN: f64 = 0.25;
/// Share of changes that end a short repetition, above which a channel is too coarse to show a standstill.
const COARSE: f64 = 0.01;
/// Ratio of the second differences of a channel to its smallest change above which noise makes them.
const FINE: f64 = 8.0;
/// Readings that show the noise of a channel.
const LOOK: usize = 1 << 16;
/// Readings of a repetition that counts, less one: a log of a few samples a second repeats one by chance.
const FEWEST: usize = 10;
/// Changes of a channel without which nothing is known of its noise.
const FEWEST_CHANGES: usize = 20;

/// First and last place of equal readings.
pub type Repetition = (usize, usize);

/// A channel that repeated one reading while others went on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standstill {
    /// Index of the channel.
    pub channel: usize,
    /// Reading that it repeated, SI.
    pub value: f64,
    /// Samples in which it did.
    pub run: Repetition,
}

/// Standstills of channels in successive samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Standstills {
    /// Stretches in which every channel repeated its reading.
    pub frozen: Vec<Repetition>,
    /// Channels that repeated a reading alone.
    pub stuck: Vec<Standstill>,
}

impl Standstills {
    /// Returns what goes with the samples, but for the repetitions of stretches in which all stood still.
    #[must_use]
    pub fn moving<'a, T: Copy>(&self, each: &'a [T]) -> Cow<'a, [T]> {
        if self.frozen.is_empty() {
            return Cow::Borrowed(each);
        }
        let mut kept = Vec::with_capacity(each.len());
        let mut next = 0;
        for &(first, last) in &self.frozen {
            kept.extend_from_slice(&each[next..=first]);
            next = last + 1;
        }
        kept.extend_from_slice(&each[next..]);
        Cow::Owned(kept)
    }
}

/// Finds stretches longer than [`FROZEN`] in which channels that are fine enough repeat a reading exactly.
///
/// `time` is in s; `triads` are the readings of accelerometer and gyroscope, SI, `None` for one that was not recorded. A sensor that
/// is coarse beside its noise repeats readings often, for short; what it repeats for long shows nothing. Neither does the end of a
/// range, nor the zero of a gyroscope that shows rest as zero.
#[must_use]
pub fn standstills(time: &[f64], triads: [Option<&[[f64; 3]]>; 2]) -> Standstills {
    if time.len() < FEWEST_CHANGES {
        return Standstills::default();
    }
    let channels: Vec<_> = channels_of(triads).filter(Channel::changes).collect();
    let lasting: Vec<_> = channels
        .iter()
        .filter(|channel| channel.is_fine())
        .filter_map(|channel| Some((channel, channel.lasting(time)?)))
        .collect();
    if lasting.is_empty() {
        return Standstills::default();
    }
    let all = repetitions(time.len(), |place| {
        channels.iter().all(|channel| channel.repeats(place))
    });
    let frozen: Vec<_> = all.into_iter().filter(|run| is_long(time, *run)).collect();
    let stuck = lasting
        .iter()
        .flat_map(|(channel, runs)| stuck(channel, runs, &frozen));
    let stuck = stuck.collect();
    Standstills { frozen, stuck }
}

/// One channel of samples.
struct Channel<'a> {
    index: usize,
    rows: &'a [[f64; 3]],
}

fn channels_of<'a>(triads: [Option<&'a [[f64; 3]]>; 2]) -> impl Iterator<Item = Channel<'a>> {
    let recorded = triads
        .into_iter()
        .enumerate()
        .filter_map(|(triad, rows)| Some((triad, rows?)));
    recorded.flat_map(|(triad, rows)| {
        (0..3).map(move |axis| Channel {
            index: 3 * triad + axis,
            rows,
        })
    })
}

impl Channel<'_> {
    fn at(&self, place: usize) -> f64 {
        self.rows[place][self.index % 3]
    }

    /// True where the reading is exactly the one before.
    #[allow(clippy::float_cmp)]
    fn repeats(&self, place: usize) -> bool {
        self.at(place) == self.at(place - 1)
    }

    fn values(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.rows.len()).map(|place| self.at(place))
    }

    /// True where there are readings, and not all are one.
    fn changes(&self) -> bool {
        self.values().any(f64::is_finite) && !(1..self.rows.len()).all(|place| self.repeats(place))
    }

    /// True where the noise of its first readings is far above their smallest change, in motion or not.
    ///
    /// A gyroscope whose noise is below a step repeats nothing while its rate changes, and all at rest.
    fn is_fine(&self) -> bool {
        let looked = self.rows.len().min(LOOK);
        let changes: Vec<f64> = (1..looked)
            .map(|place| self.at(place) - self.at(place - 1))
            .collect();
        let moves = |change: &f64| change.is_finite() && *change != 0.0;
        let sizes = changes
            .iter()
            .filter(|change| moves(change))
            .map(|change| change.abs());
        let smallest = sizes.fold(f64::INFINITY, f64::min);
        let pairs = changes.windows(2).filter(|pair| pair.iter().all(moves));
        let mut bends: Vec<f64> = pairs.map(|pair| (pair[1] - pair[0]).abs()).collect();
        balanced_median(&mut bends).is_some_and(|bend| bend > FINE * smallest)
    }

    /// Lists its long repetitions; `None` where it is too coarse to show any.
    fn lasting(&self, time: &[f64]) -> Option<Vec<Repetition>> {
        let mut runs = repetitions(self.rows.len(), |place| self.repeats(place));
        let repeated: usize = runs.iter().map(|(first, last)| last - first).sum();
        let readings = self.rows.len() - repeated;
        let all = runs.len();
        runs.retain(|run| is_long(time, *run));
        #[allow(clippy::cast_precision_loss)]
        let is_coarse = (all - runs.len()) as f64 > COARSE * readings as f64;
        (readings >= FEWEST_CHANGES && !is_coarse).then_some(runs)
    }
}

/// Runs of equal readings among so many, by whether the reading at a place is the one before.
fn repetitions(count: usize, repeats: impl Fn(usize) -> bool) -> Vec<Repetition> {
    let mut runs: Vec<Repetition> = Vec::new();
    for place in (1..count).filter(|place| repeats(*place)) {
        match runs.last_mut() {
            Some((_, last)) if *last == place - 1 => *last = place,
            _ => runs.push((place - 1, place)),
        }
    }
    runs
}

fn is_long(time: &[f64], (first, last): Repetition) -> bool {
    time[last] - time[first] > FROZEN && last - first >= FEWEST
}

/// Repetitions of a channel while others went on, but for those of its least and largest reading, and of zero.
#[allow(clippy::float_cmp)]
fn stuck(channel: &Channel<'_>, runs: &[Repetition], frozen: &[Repetition]) -> Vec<Standstill> {
    let least = channel.values().fold(f64::INFINITY, f64::min);
    let largest = channel.values().fold(f64::NEG_INFINITY, f64::max);
    let alone =
        |(first, last): Repetition| !frozen.iter().any(|(begin, end)| *begin <= last && first <= *end);
    let found = runs.iter().filter(|run| alone(**run)).map(|run| Standstill {
        channel: channel.index,
        value: channel.at(run.0),
        run: *run,
    });
    found
        .filter(|each| ![0.0, least, largest].contains(&each.value))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 0.02;

    /// Readings as a generator of whole numbers draws them, in steps of `step`.
    fn drawn(count: usize, step: f64) -> Vec<[f64; 3]> {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            step * f64::from(u16::try_from(state >> 52).unwrap_or(0))
        };
        (0..count).map(|_| [next(), next(), next()]).collect()
    }

    fn times(count: u32) -> Vec<f64> {
        (0..count).map(|place| STEP * f64::from(place)).collect()
    }

    #[test]
    fn what_goes_with_samples_is_cut_as_they_are() {
        let time = times(400);
        let (mut force, mut rate) = (drawn(400, 1e-3), drawn(400, 1e-4));
        for place in 101..150 {
            (force[place], rate[place]) = (force[100], rate[100]);
        }
        let found = standstills(&time, [Some(&force), Some(&rate)]);
        assert_eq!(
            (found.frozen.as_slice(), found.stuck.len()),
            (&[(100, 149)][..], 0)
        );
        assert_eq!(found.moving(&time).len(), 351);
        assert_eq!(found.moving(&force)[100..102], [force[100], force[150]]);
        let sound = standstills(&time, [Some(&drawn(400, 1e-3)), None]);
        assert!(matches!(sound.moving(&time), Cow::Borrowed(_)));
    }

    #[test]
    fn a_channel_that_was_not_recorded_hides_no_standstill() {
        let time = times(400);
        let mut force = drawn(400, 1e-3);
        for place in 101..150 {
            force[place] = force[100];
        }
        force.iter_mut().for_each(|row| row[1] = f64::NAN);
        let found = standstills(&time, [Some(&force), None]);
        assert_eq!(
            (found.frozen.as_slice(), found.stuck.len()),
            (&[(100, 149)][..], 0)
        );
    }
}
