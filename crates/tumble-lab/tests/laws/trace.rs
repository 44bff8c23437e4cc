//! A recording at a glance.

use nalgebra::Vector3;
use proptest::prelude::*;
use tumble_core::gravity::STANDARD;
use tumble_core::segmenter::{Segment, Segmenter, SegmenterSettings};
use tumble_lab::acquisition::trace::Trace;

use super::common::{Draws, cases};
use super::stream::{Phase, Unit, samples};

/// A block of a stream, moved in time.
fn block(k: u64) -> Segment<f64> {
    let stream = samples(
        &[Phase::Rest(0.2)],
        &Vector3::z(),
        &Unit::perfect(),
        &mut Draws::new(0),
    );
    let mut segmenter = Segmenter::new(SegmenterSettings::default());
    stream.iter().for_each(|sample| {
        segmenter.push(sample);
    });
    let mut block = *segmenter.take_block().expect("a block");
    let length = block.end - block.start;
    block.start = k * length;
    block.end = (k + 1) * length;
    block
}

proptest! {
    #![proptest_config(cases(32))]

    #[test]
    fn a_trace_of_any_length_covers_the_recording_evenly(count in 0..40_000_usize) {
        let mut trace = Trace::new();
        let first = block(0);
        let length = first.end - first.start;
        for k in 0..count as u64 {
            trace.push(&Segment { start: k * length, end: (k + 1) * length, ..first });
        }
        let points = trace.points();
        prop_assert!(points.len() < 4096);
        // Never more than half of what could be drawn is missing, and at most one stride at the end.
        prop_assert!(count < 4096 || points.len() >= 2048);
        if let [(first, _), .., (last, _)] = points {
            let step = (last - first) / (points.len() - 1) as f64;
            prop_assert!(points.windows(2).all(|pair| (pair[1].0 - pair[0].0 - step).abs() < 1e-9 * last));
            let end = count as f64 * length as f64 * 1e-6;
            prop_assert!(*first - step / 2.0 < 1e-9 && end - (last + step / 2.0) < step);
        }
        prop_assert!(points.iter().all(|(_, y)| (y[2] - STANDARD).abs() < 1e-9));
    }
}

#[test]
fn points_are_means_of_what_they_stand_for() {
    let mut trace = Trace::new();
    let mut draws = Draws::new(31);
    let stream = samples(
        &[Phase::Rest(600.0)],
        &Vector3::z(),
        &Unit::noisy(1.0, 0.1),
        &mut draws,
    );
    let mut segmenter = Segmenter::<f64>::new(SegmenterSettings::default());
    let mut sum = 0.0;
    let mut count = 0;
    for sample in &stream {
        segmenter.push(sample);
        if let Some(block) = segmenter.take_block() {
            trace.push(block);
            sum += block.moments.mean()[0];
            count += 1;
        }
    }
    let points = trace.points();
    let stride = count / points.len();
    assert!(stride >= 2, "{count} blocks, {} points", points.len());
    let mean = points.iter().map(|(_, y)| y[0]).sum::<f64>() / points.len() as f64;
    // Blocks of the last stride may be missing.
    let bound = 1.0 / (count as f64).sqrt() * stride as f64 / (count as f64).sqrt() + 1e-3;
    assert!(
        (mean - sum / count as f64).abs() < bound,
        "{mean} {}",
        sum / count as f64
    );
}
