//! Takes a recording in, chunk by chunk, file by file, in memory that does not grow with its samples.

use tumble_core::noise::{AllanLadder, Noise};
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::{FinishedSegment, Segmenter, SegmenterSettings};
use tumble_core::soft_mean::SoftMeans;

use super::acquired::{Acquired, Part};
use super::channels::{ChannelMonitor, is_calm};
use super::constant_rates::RateFinder;
use super::motion::Motion;
use super::plateaus::RateGate;
use super::rejection::{leave_out_saturated, reject_rests};
use super::rest_ladders::{RestLadders, noise_of};
use super::rounding::{Rounding, RoundingMonitor};
use super::soft_edge::{RecentBlocks, SoftRest};
use super::trace::Trace;
use super::vibration::soften;

/// Takes in a recording chunk by chunk.
pub struct Acquisition {
    settings: SegmenterSettings<f64>,
    segmenter: Segmenter<f64>,
    origin: Option<f64>,
    part_start: f64,
    part_offset: f64,
    part_name: String,
    latest: f64,
    leading: bool,
    found: Acquired,
    channels: ChannelMonitor,
    rounding: RoundingMonitor,
    recent: RecentBlocks,
    soft_rest: Option<SoftRest>,
    /// Scatter of means with soft edges in the part at hand.
    soft_of_part: AllanLadder<f64>,
    allan: AllanLadder<f64>,
    soft_allan: Option<AllanLadder<f64>>,
    rates: Option<RateFinder>,
    temperature: (u64, f64, f64, f64),
}

impl Acquisition {
    /// Nothing seen yet.
    pub fn new(settings: SegmenterSettings<f64>) -> Self {
        let none = Noise::none();
        Self {
            settings,
            segmenter: Segmenter::new(settings),
            origin: None,
            part_start: 0.0,
            part_offset: 0.0,
            part_name: String::new(),
            latest: f64::NEG_INFINITY,
            leading: true,
            found: Acquired {
                origin: 0.0,
                parts: Vec::new(),
                rests: Vec::new(),
                restlessness: Vec::new(),
                turns: Vec::new(),
                rejected: Vec::new(),
                plateaus: Vec::new(),
                motion: Motion::default(),
                rest_noise: Vec::new(),
                noise: [none; CHANNELS],
                abrupt_rate_noise: [none; 3],
                rounding: Rounding::default(),
                edges: Vec::new(),
                soft_turns: false,
                trace: Trace::new(),
                faults: Vec::new(),
                samples: 0,
                not_finite: 0,
                missing: 0,
                first_backwards: None,
                pace_sigma: 0.0,
                stamp_sigma: 0.0,
                temperature: None,
            },
            channels: ChannelMonitor::new(),
            rounding: RoundingMonitor::new(),
            recent: RecentBlocks::default(),
            soft_rest: None,
            soft_of_part: SoftMeans::new().into_ladder(),
            allan: AllanLadder::new(),
            soft_allan: None,
            rates: None,
            temperature: (0, f64::INFINITY, 0.0, f64::NEG_INFINITY),
        }
    }

    /// The same, with constant rates looked for: what turns at one is then no rest.
    #[must_use]
    pub fn with_rates(mut self, gate: RateGate) -> Self {
        self.rates = Some(RateFinder::new(gate));
        self
    }

    /// Takes in successive samples: `time` (n) s, `force` (n x 3) m/s^2, `rate` (n x 3) rad/s.
    pub fn push(&mut self, time: &[f64], force: &[[f64; 3]], rate: &[[f64; 3]], temperature: Option<&[f64]>) {
        let Some(&first) = time.iter().find(|t| t.is_finite()) else {
            self.found.not_finite += time.len() as u64;
            return;
        };
        let origin = self.origin_of_part(first);
        for ((&t, f), w) in time.iter().zip(force).zip(rate) {
            let y = [f[0], f[1], f[2], w[0], w[1], w[2]];
            let calm = is_calm(&y);
            if !(t.is_finite() && (calm || y.iter().all(|y| y.is_finite()))) {
                self.found.not_finite += 1;
            } else if t <= self.latest {
                self.found.first_backwards.get_or_insert(t);
            } else {
                self.push_sample(t, origin, &y, calm);
            }
        }
        for &t in temperature.unwrap_or_default() {
            if t.is_finite() {
                let (n, low, sum, high) = self.temperature;
                self.temperature = (n + 1, low.min(t), sum + t, high.max(t));
            }
        }
    }

    /// Origin of all times of the part at hand, s of its own clock; its first sample, at `first`, begins it.
    fn origin_of_part(&mut self, first: f64) -> f64 {
        if self.origin.is_none() {
            self.origin = Some(first);
            self.part_start = first;
            self.found.parts.push(Part {
                start: self.part_offset,
                name: self.part_name.clone(),
            });
        }
        let origin = self.part_start - self.part_offset;
        if self.found.parts.len() == 1 {
            self.found.origin = origin;
        }
        origin
    }

    /// Takes in a finite sample later than the one before.
    #[inline]
    fn push_sample(&mut self, time: f64, origin: f64, y: &[f64; CHANNELS], calm: bool) {
        self.latest = time;
        self.found.samples += 1;
        // Processors convert to signed integers in one step, to unsigned ones in several.
        #[allow(clippy::cast_possible_truncation)]
        let microseconds = (((time - origin) * 1e6 + 0.5) as i64).max(0).cast_unsigned();
        if !calm {
            self.channels.push_sample(microseconds, y);
        }
        self.rounding.push(microseconds, y);
        let segment = self.segmenter.push_channels(microseconds, y);
        if let Some(rates) = &mut self.rates {
            rates.push(y);
        }
        if self.segmenter.has_block() {
            self.look();
        }
        if let Some(segment) = segment {
            self.keep(segment);
        }
    }

    /// Starts a file of a recording that comes as one file a pose. Its clock may start anew.
    pub fn begin_part(&mut self, name: &str) {
        self.drain();
        name.clone_into(&mut self.part_name);
        if self.origin.is_some() {
            // One empty second between parts keeps rests apart; no turn is known between them.
            self.part_offset += (self.latest - self.part_start).max(0.0) + 1.0;
            self.origin = None;
            self.latest = f64::NEG_INFINITY;
            self.leading = true;
            self.segmenter = Segmenter::new(self.settings);
            if let Some(rates) = &mut self.rates {
                rates.begin_part();
            }
            self.recent.clear();
            self.soft_rest = None;
            self.soft_of_part = SoftMeans::new().into_ladder();
        }
    }

    /// Ends the recording.
    pub fn finish(mut self) -> Acquired {
        self.drain();
        if let Some(rates) = self.rates.take() {
            let ladders = rates.settle(&mut self.found);
            (self.allan, self.soft_allan) = (ladders.flat, Some(ladders.soft));
        }
        self.found.noise = noise_of(&self.allan);
        self.found.abrupt_rate_noise = [self.found.noise[3], self.found.noise[4], self.found.noise[5]];
        let (n, low, sum, high) = self.temperature;
        #[allow(clippy::cast_precision_loss)]
        if n > 0 {
            self.found.temperature = Some([low, sum / n as f64, high]);
        }
        reject_rests(&mut self.found, &self.settings, self.segmenter.floor());
        if let Some(ladder) = &self.soft_allan {
            soften(&mut self.found, &self.allan, ladder);
        }
        self.found.rounding = self.rounding.finish(&self.found.rests);
        self.found.faults = self.channels.faults(&self.found.rests, &self.found.turns);
        leave_out_saturated(&mut self.found);
        self.found
    }

    fn drain(&mut self) {
        while let Some(segment) = self.segmenter.finish() {
            self.keep(segment);
            self.look();
        }
        // Motion after the last rest is no turn.
        self.found
            .turns
            .truncate(self.found.rests.len().saturating_sub(1));
        self.look();
        self.allan.merge(self.segmenter.allan());
    }

    fn look(&mut self) {
        if let Some(block) = self.segmenter.take_block() {
            self.found.missing += u64::from(block.interpolation.missing);
            if let Some(rates) = &mut self.rates {
                rates.push_block(block);
            }
            self.found.trace.push(block);
            self.channels.push_block(block);
            self.recent.push(block);
            if let Some(rest) = &mut self.soft_rest {
                rest.push(block);
            }
        }
    }

    /// A rest began a while ago, microseconds since the origin.
    fn begin_rest(&mut self, at: u64) {
        self.found.edges.extend(self.recent.fall(at));
        self.soft_rest = SoftRest::begin(self.recent.since(at));
    }

    fn keep(&mut self, segment: FinishedSegment<f64>) {
        match segment {
            FinishedSegment::Rest(mut rest) => {
                let soft = self.soft_rest.take().map(SoftRest::finish).unwrap_or_default();
                rest.soft = soft.total();
                self.soft_of_part.merge(soft.ladder());
                match &mut self.soft_allan {
                    Some(ladder) => ladder.merge(soft.ladder()),
                    None => self.soft_allan = Some(*soft.ladder()),
                }
                if let Some(rates) = &mut self.rates {
                    let ladders = RestLadders {
                        flat: *self.segmenter.allan(),
                        soft: self.soft_of_part,
                    };
                    rates.push_rest(&rest, &ladders);
                }
                self.found.edges.extend(self.recent.rise(&rest));
                self.found.rests.push(rest);
            }
            // Motion before the first rest is no turn.
            FinishedSegment::Turn(turn) if self.found.rests.is_empty() => self.begin_rest(turn.end),
            FinishedSegment::Turn(mut turn) => {
                turn.complete &= !self.leading;
                self.begin_rest(turn.end);
                self.found.turns.push(turn);
            }
        }
        self.leading = false;
    }
}
