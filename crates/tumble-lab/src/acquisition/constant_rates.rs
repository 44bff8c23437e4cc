//! State of the search for constant rates while a recording is read, and its effect at the end.

use nalgebra::Vector3;
use tumble_core::noise::{AllanLadder, Interval};
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::Segment;

use super::acquired::Acquired;
use super::interval::interval;
use super::motion::{Motion, SecondDifferences};
use super::plateaus::{Plateau, PlateauKind, RateGate, find_plateaus, label_plateaus};
use super::rejection::take_out;
use super::rest_ladders::{RestLadders, noise_of};
use super::vibration::soften;

/// Gathers what constant rates are found in.
pub(super) struct RateFinder {
    gate: RateGate,
    motion: Motion,
    differences: SecondDifferences,
    /// Noise that all rests of the part at hand showed.
    so_far: Option<RestLadders>,
    /// Noise that each rest showed.
    of_rests: Vec<RestLadders>,
}

impl RateFinder {
    /// Nothing seen yet.
    pub fn new(gate: RateGate) -> Self {
        Self {
            gate,
            motion: Motion::default(),
            differences: SecondDifferences::default(),
            so_far: None,
            of_rests: Vec::new(),
        }
    }

    /// Takes in a sample.
    #[inline]
    pub fn push(&mut self, y: &[f64; CHANNELS]) {
        self.differences.push([y[3], y[4], y[5]]);
    }

    /// Takes in a block, after the sample that ended it.
    pub fn push_block(&mut self, block: &Segment<f64>) {
        self.motion.push(block, self.differences.take());
    }

    /// Takes in a rest, with what this one and all before it in the part at hand showed of noise.
    pub fn push_rest(&mut self, rest: &Segment<f64>, ladders: &RestLadders) {
        self.motion.mark_rest(rest);
        let before = self.so_far.replace(*ladders);
        self.of_rests.push(before.map_or(*ladders, |before| RestLadders {
            flat: ladders.flat.since(&before.flat),
            soft: ladders.soft.since(&before.soft),
        }));
    }

    /// Starts a file of a recording that comes as one file a pose.
    pub fn begin_part(&mut self) {
        self.so_far = None;
        self.differences = SecondDifferences::default();
    }

    /// Finds the constant rates, takes them out of the rests, and gives what the rests that are left showed of noise.
    pub fn settle(self, found: &mut Acquired) -> RestLadders {
        let noise = self.motion.noise().max(LEAST_NOISE * LEAST_NOISE);
        found.plateaus = find_plateaus(&self.motion, noise);
        label_plateaus(&mut found.plateaus, noise, self.gate);
        // A target without evidence on its own rests keeps them all: the reference determines those that are used.
        let known = self.gate == RateGate::Reference || found.knows_rests();
        let turning: Vec<Interval<f64>> = found
            .constant_rates()
            .filter(|_| known)
            .map(|plateau| plateau.interval)
            .collect();
        found.motion = self.motion;
        found.rest_noise = self.of_rests;
        take_out_turning(found, &turning);
        let mut ladders = sum(&found.rest_noise);
        if found.rests.is_empty() && !turning.is_empty() {
            ladders.flat = of_plateaus(&found.motion, &found.plateaus);
        }
        ladders
    }
}

/// Noise of a gyroscope that shows none, rad/s a sample.
const LEAST_NOISE: f64 = 1e-5;

/// True where most of a rest lies within one of some spans.
fn is_within(rest: &Interval<f64>, spans: &[Interval<f64>]) -> bool {
    let common = |span: &Interval<f64>| rest.end.min(span.end) - rest.start.max(span.start);
    spans.iter().any(|span| common(span) > 0.5 * rest.duration())
}

/// Data of a target without the times at which the reference turned at constant rates, s since the origin of the
/// target: apparent rests in them are none. `None` where there was none.
pub fn without_turning(unit: &Acquired, turning: &[Interval<f64>]) -> Option<Acquired> {
    let mut found = unit.clone();
    let fewer = take_out_turning(&mut found, turning);
    found
        .rejected
        .retain(|(rest, _)| !is_within(&interval(rest), turning));
    if !fewer && found.rejected.len() == unit.rejected.len() {
        return None;
    }
    if fewer && !found.rests.is_empty() {
        let ladders = sum(&found.rest_noise);
        found.noise = noise_of(&ladders.flat);
        found.abrupt_rate_noise = [found.noise[3], found.noise[4], found.noise[5]];
        soften(&mut found, &ladders.flat, &ladders.soft);
    }
    Some(found)
}

/// Removes the rests that lie within spans of turning; returns whether there were any.
fn take_out_turning(found: &mut Acquired, turning: &[Interval<f64>]) -> bool {
    let before = found.rests.len();
    let mut i = 0;
    while i < found.rests.len() {
        if is_within(&interval(&found.rests[i]), turning) {
            take_out(found, i);
        } else {
            i += 1;
        }
    }
    if !turning.is_empty() {
        integrate_anew(found);
    }
    found.rests.len() < before
}

/// Attitudes over turns: the segmenter took the rate of what it took for a rest for the bias.
fn integrate_anew(found: &mut Acquired) {
    let length: f64 = found.rests.iter().map(Segment::duration).sum();
    let angle: Vector3<f64> = found.rests.iter().map(Segment::angle).sum();
    let bias = angle / length.max(f64::MIN_POSITIVE);
    for (turn, rests) in found.turns.iter_mut().zip(found.rests.windows(2)) {
        let span = Interval {
            start: interval(&rests[0]).end,
            end: interval(&rests[1]).start,
        };
        turn.start_from_end = found.motion.start_from_end(&span, &bias);
    }
}

fn sum(ladders: &[RestLadders]) -> RestLadders {
    let Some((first, others)) = ladders.split_first() else {
        return RestLadders::default();
    };
    let mut sum = *first;
    others.iter().for_each(|ladder| sum.merge(ladder));
    sum
}

/// Time in which the rate of a table may still change by more than the noise, s.
const SETTLING: f64 = 1.0;

/// White noise of a recording without any rest, as neighbouring pieces of its constant rates show it. Longer averages show
/// the rotation of the Earth, which turns in the unit, and not bias instability.
fn of_plateaus(motion: &Motion, plateaus: &[Plateau]) -> AllanLadder<f64> {
    let mut all = AllanLadder::new();
    let turned = |plateau: &&Plateau| plateau.kind != PlateauKind::Rest;
    for plateau in plateaus.iter().filter(turned) {
        let span = plateau.interval;
        let settling = SETTLING.min(0.25 * span.duration());
        let settled = Interval {
            start: span.start + settling,
            end: span.end - settling,
        };
        for pair in motion.within(&settled).chunks_exact(2) {
            let mut ladder = AllanLadder::new();
            for piece in pair {
                let duration = piece.interval.duration();
                let (force, rate) = (piece.velocity / duration, piece.rate());
                ladder.push(&[force.x, force.y, force.z, rate.x, rate.y, rate.z], duration);
            }
            all.merge(&ladder);
        }
    }
    all
}
