//! Stretches of a log that a user has labelled: what is labelled a rest is taken for one.

use nalgebra::{UnitQuaternion, Vector3};
use tumble_core::moments::Moments;
use tumble_core::noise::AllanLadder;
use tumble_core::pauses::Interpolation;
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::{Segment, SegmenterSettings};
use tumble_core::soft_mean::SoftSum;

use super::samples::MultiposeSamples;
use crate::acquisition::{Acquired, leave_out_saturated, microseconds};
use crate::distributions::median;

tumble_core::vocabulary! {
    /// Content of a stretch of a log, by the names that section lists of six-face sessions bear.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum SectionLabel {
        /// At rest, axis x up.
        XUp = "x_p",
        /// At rest, axis x down.
        XDown = "x_a",
        /// At rest, axis y up.
        YUp = "y_p",
        /// At rest, axis y down.
        YDown = "y_a",
        /// At rest, axis z up.
        ZUp = "z_p",
        /// At rest, axis z down.
        ZDown = "z_a",
        /// A full turn about axis x, which is vertical.
        XTurn = "x_rot",
        /// A full turn about axis y, which is vertical.
        YTurn = "y_rot",
        /// A full turn about axis z, which is vertical.
        ZTurn = "z_rot",
        /// At rest in an orientation that nobody states.
        Rest = "rest",
    }
}

impl SectionLabel {
    /// The six faces.
    pub const FACES: [Self; 6] = [
        Self::XUp,
        Self::XDown,
        Self::YUp,
        Self::YDown,
        Self::ZUp,
        Self::ZDown,
    ];

    /// The three full turns, by their axis.
    pub const TURNS: [Self; 3] = [Self::XTurn, Self::YTurn, Self::ZTurn];

    /// Which direction of the case was up, where it is a face.
    pub fn up(&self) -> Option<Vector3<f64>> {
        let place = Self::FACES.iter().position(|face| face == self)?;
        let mut up = Vector3::zeros();
        up[place / 2] = if place % 2 == 0 { 1.0 } else { -1.0 };
        Some(up)
    }

    /// Axis of a full turn.
    pub fn turned_about(&self) -> Option<usize> {
        Self::TURNS.iter().position(|turn| turn == self)
    }
}

/// A labelled stretch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Section {
    /// Content of the section.
    pub label: SectionLabel,
    /// Index of its first sample.
    pub first: usize,
    /// Index of the first sample after it.
    pub end: usize,
}

/// A pause longer than this many intervals between samples is no part of a turn.
const LONGEST_PAUSE: f64 = 10.0;

/// Puts the labelled rests, in order of time, in place of those found, with the noise they show.
pub(super) fn take_labelled(found: &mut Acquired, samples: &MultiposeSamples<'_>, sections: &[Section]) {
    let rests = sections
        .iter()
        .filter(|section| section.label.turned_about().is_none());
    let mut rests: Vec<_> = rests.map(|section| (section.first, section.end)).collect();
    rests.sort_by_key(|(first, _)| *first);
    take_rests(found, samples, &rests, |_| true);
}

/// Puts rests, first sample and the one after the last, in order of time, in place of those found, with the noise that those
/// show which are `quiet`.
pub(super) fn take_rests(
    found: &mut Acquired,
    samples: &MultiposeSamples<'_>,
    rests: &[(usize, usize)],
    quiet: impl Fn(usize) -> bool,
) {
    let mut ladder = AllanLadder::new();
    found.rests = Vec::new();
    for (k, span) in rests.iter().enumerate() {
        let (rest, blocks) = rest(samples, *span, found.origin);
        if quiet(k) {
            ladder.merge(&blocks);
        }
        found.rests.push(rest);
    }
    found.turns = rests
        .windows(2)
        .zip(found.rests.windows(2))
        .map(|(spans, rests)| Segment {
            complete: without_pause(&samples.time[spans[0].1 - 1..=spans[1].0]),
            ..nothing(rests[0].end, rests[1].start)
        })
        .collect();
    leave_out_saturated(found);
    found.rejected.clear();
    let ([fx, fy, fz], [wx, wy, wz]) = (ladder.fit_jointly([0, 1, 2]), ladder.fit_jointly([3, 4, 5]));
    found.noise = [fx, fy, fz, wx, wy, wz];
}

/// A rest, and how the means of its blocks scatter.
fn rest(
    samples: &MultiposeSamples<'_>,
    (first, end): (usize, usize),
    origin: f64,
) -> (Segment<f64>, AllanLadder<f64>) {
    let time = &samples.time[first..end];
    #[allow(clippy::cast_precision_loss)]
    let step = (time[time.len() - 1] - time[0]) / (time.len().max(2) - 1) as f64;
    let mut rest = nothing(
        microseconds(time[0] - origin),
        microseconds(time[time.len() - 1] + step - origin),
    );
    let usual = SegmenterSettings::<f64>::default();
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss
    )]
    let block = ((usual.block as f64 * 1e-6 / step).ceil() as usize).max(usual.block_samples as usize);
    let mut blocks = AllanLadder::new();
    for from in (first..end).step_by(block) {
        let to = (from + block).min(end);
        let mut moments = Moments::<f64, CHANNELS>::new();
        for k in from..to {
            let ([fx, fy, fz], [wx, wy, wz]) = (samples.force[k], samples.rate[k]);
            moments.push(&[fx, fy, fz, wx, wy, wz]);
        }
        if to - from == block {
            #[allow(clippy::cast_precision_loss)]
            blocks.push(moments.mean(), step * block as f64);
        }
        rest.moments.merge(&moments);
    }
    let duration = rest.duration();
    rest.integral = rest.moments.mean().map(|mean| mean * duration);
    (rest, blocks)
}

/// A segment that nothing is known of but when it was, microseconds since the origin.
fn nothing(start: u64, end: u64) -> Segment<f64> {
    Segment {
        start,
        end,
        moments: Moments::new(),
        integral: [0.0; CHANNELS],
        lever: [0.0; CHANNELS],
        start_from_end: UnitQuaternion::identity(),
        soft: SoftSum::none(),
        interpolation: Interpolation::none(),
        complete: true,
    }
}

fn without_pause(time: &[f64]) -> bool {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = median(&mut steps).unwrap_or(0.0);
    !steps.is_empty() && steps.iter().all(|step| *step <= LONGEST_PAUSE * usual)
}
