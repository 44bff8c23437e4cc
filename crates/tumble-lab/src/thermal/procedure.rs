//! Temperature drift of both triads of a unit (docs/theory/thermal.md).

use tumble_core::sample::CHANNELS;
use tumble_core::temperature::HIGHEST_ORDER;

use super::block::{RestBlock, ThermalBlocks, blocks};
use super::fit::{DriftDesign, DriftFit, DriftRounding, KNOTS, Terms};
use super::hysteresis::{Hysteresis, is_curve};
use super::lag::{Lagging, Needs, thermometer_lag};
use super::order::{Choice, choose, chosen_fit};
use super::recorder::Span;
use super::whitening::Whitening;

/// Highest power of temperature in the scale factor: what poses show of it is less than of the bias.
const HIGHEST_SCALE_ORDER: usize = 1;
/// Blocks below which there is nothing to leave out.
const FEWEST_BLOCKS: usize = 30;
/// Blocks of one pose on each leg, from which they show by how much warming differs from cooling.
const FEWEST_OF_A_LEG: usize = 4;
/// Change of temperature, K, in one pose that a drift is to be seen in.
pub const LEAST_RANGE: f64 = 5.0;
/// Difference of specific force on an accelerometer axis between two poses, m/s^2, that separates its scale from its
/// bias.
const TURNED_OVER: f64 = 5.0;

tumble_core::vocabulary! {
    /// Reasons why no drift can be estimated.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum ThermalError {
        /// It did not change enough while the unit stayed where it was.
        RangeTooSmall {
            /// Lowest and highest, degC, at rest.
            low: f64,
            /// degC.
            high: f64,
            /// Largest change in one pose, K.
            within: f64,
            /// K that are needed.
            needed: f64,
        } = "range too small",
        /// The unit stood still for too short a time.
        TooLittleAtRest {
            /// s at rest.
            still: f64,
            /// s in motion.
            moved: f64,
        } = "too little at rest",
    }
}

/// Prior knowledge of the session.
#[derive(Clone, Debug, PartialEq)]
pub struct ThermalSettings {
    /// True if the unit was turned by a fixture that returns to an orientation exactly.
    pub fixture: bool,
    /// Temperature at which nothing is to change, degC; the middle of the range where there is none.
    pub reference: Option<f64>,
    /// Which of the six channels were recorded.
    pub channels: Vec<usize>,
    /// Steps that the readings of accelerometer, m/s^2, and gyroscope, rad/s, are multiples of, where they show any.
    pub resolution: [Option<f64>; 2],
}

/// Temperature drift of one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisDrift {
    /// Which of the six channels.
    pub channel: usize,
    /// Fit of the terms that the data bear, hysteresis last where both legs are known.
    pub fit: DriftFit,
    /// Sets of terms among which was chosen.
    pub candidates: Vec<Terms>,
    /// Which of them, and the weight of each in the uncertainty.
    pub choice: Choice,
    /// By how much more is read while warming than while cooling; None where one of both is missing.
    pub hysteresis: Option<Hysteresis>,
    /// First power of the bias, per K, and its 1-sigma, chosen or not.
    pub slope: [f64; 2],
    /// Change of the scale factor, 1/K, and its 1-sigma, chosen or not; None where no poses separate scale from bias.
    pub scale: Option<[f64; 2]>,
}

impl AxisDrift {
    /// By how much each block reads other than at the reference in its pose, less what scale does: unit of the axis.
    pub fn changes(&self, data: &ThermalBlocks, reference: f64) -> Vec<f64> {
        let change = |(block, means): (&RestBlock, &[f64; CHANNELS])| {
            means[self.channel] - self.fit.without_bias(block.pose, block.temperature - reference)
        };
        data.blocks.iter().zip(&data.means).map(change).collect()
    }
}

/// Temperature drift of a unit.
#[derive(Clone, Debug, PartialEq)]
pub struct ThermalDrift {
    /// Temperature at which nothing changes, degC.
    pub reference: f64,
    /// degC.
    pub range: [f64; 2],
    /// Time constant of the thermometer, where the data show it.
    pub lag: Lagging,
    /// Blocks that were fitted, temperatures those of the sensor.
    pub data: ThermalBlocks,
    /// One for each channel that was recorded.
    pub axes: Vec<AxisDrift>,
}

/// Finds what temperature does to a unit; `step` is that of its thermometer, K.
///
/// # Errors
/// [`ThermalError`], where temperature did not change or the unit did not rest.
pub fn thermal(spans: &[Span], step: f64, settings: &ThermalSettings) -> Result<ThermalDrift, ThermalError> {
    let mut data = blocks(spans, step, settings.fixture);
    refuse_unfit(&data)?;
    let whitening = Whitening::new(&data.blocks);
    let hysteresis = both_legs(&data);
    let most = |channel: &usize| (*channel, most_terms(&data, *channel, hysteresis));
    let needs: Vec<Needs> = settings.channels.iter().map(most).collect();
    let lag = thermometer_lag(&data, &whitening, &needs);
    if let Some(lag) = lag.shown() {
        data.lag(lag.value);
    }
    let range = range_of(&data.blocks);
    // Beyond the range nothing changes, so that its edge stands for what lies there (eq. 2).
    let reference = settings
        .reference
        .unwrap_or(0.5 * (range[0] + range[1]))
        .clamp(range[0], range[1]);
    let design = DriftDesign::new(&whitening, &data.blocks, reference);
    let rounding = rounding_of(spans, &settings.resolution);
    let axes = settings
        .channels
        .iter()
        .map(|&channel| axis(&data, &design, channel, hysteresis, &rounding[channel]))
        .collect::<Option<_>>()
        .ok_or(ThermalError::TooLittleAtRest {
            still: data.still,
            moved: data.moved,
        })?;
    Ok(ThermalDrift {
        reference,
        range,
        lag,
        data,
        axes,
    })
}

/// DriftRounding of each channel, given the steps of both triads: their noise is the scatter within spans.
fn rounding_of(spans: &[Span], steps: &[Option<f64>; 2]) -> [DriftRounding; CHANNELS] {
    let mut scatter = [0.0; CHANNELS];
    for span in spans {
        for (sum, variance) in scatter.iter_mut().zip(span.moments.variance()) {
            *sum += variance / spans.len() as f64;
        }
    }
    std::array::from_fn(|channel| DriftRounding::of(steps[channel / (CHANNELS / 2)], scatter[channel]))
}

fn refuse_unfit(data: &ThermalBlocks) -> Result<(), ThermalError> {
    if data.blocks.len() < FEWEST_BLOCKS {
        return Err(ThermalError::TooLittleAtRest {
            still: data.still,
            moved: data.moved,
        });
    }
    let [low, high] = range_of(&data.blocks);
    let within = (0..data.poses)
        .map(|pose| pose_range(data, pose))
        .fold(0.0, f64::max);
    if within < LEAST_RANGE {
        return Err(ThermalError::RangeTooSmall {
            low,
            high,
            within,
            needed: LEAST_RANGE,
        });
    }
    Ok(())
}

fn range_of<'a>(blocks: impl IntoIterator<Item = &'a RestBlock>) -> [f64; 2] {
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    blocks.into_iter().fold(nothing, |[low, high], block| {
        [low.min(block.temperature), high.max(block.temperature)]
    })
}

fn pose_range(data: &ThermalBlocks, pose: usize) -> f64 {
    let [low, high] = range_of(data.blocks.iter().filter(|block| block.pose == pose));
    high - low
}

/// Tests whether some pose was held both while it warmed and while it cooled.
fn both_legs(data: &ThermalBlocks) -> bool {
    let blocks_of = |pose: usize, leg: f64| {
        data.blocks
            .iter()
            .filter(|b| b.pose == pose && b.leg == leg)
            .count()
    };
    (0..data.poses).any(|pose| blocks_of(pose, 1.0).min(blocks_of(pose, -1.0)) >= FEWEST_OF_A_LEG)
}

fn axis(
    data: &ThermalBlocks,
    design: &DriftDesign,
    channel: usize,
    hysteresis: bool,
    rounding: &DriftRounding,
) -> Option<AxisDrift> {
    let means = data.channel(channel);
    let most = with_shape(design, &means, most_terms(data, channel, hysteresis));
    let fits: Vec<DriftFit> = candidates(&most)
        .iter()
        .filter_map(|terms| design.fit(&means, terms))
        .collect();
    let candidates: Vec<Terms> = fits.iter().map(|fit| fit.terms).collect();
    let choice = choose(&fits)?;
    let fit = design.with_rounding(chosen_fit(&fits, &choice), &means, rounding)?;
    let terms = fit.terms;
    // A coefficient that was not chosen has an estimate and a sigma beside those that were.
    let with = |terms: Terms| {
        if terms == fit.terms {
            Some(fit.clone())
        } else {
            design
                .fit(&means, &terms)
                .and_then(|fit| design.with_rounding(fit, &means, rounding))
        }
    };
    let slope = with(Terms {
        bias: terms.bias.max(1),
        ..terms
    })?;
    let scale = (most.scale > 0)
        .then(|| {
            with(Terms {
                scale: terms.scale.max(HIGHEST_SCALE_ORDER),
                ..terms
            })
        })
        .flatten();
    Some(AxisDrift {
        channel,
        hysteresis: Hysteresis::of(&fit),
        slope: slope.coefficient(0)?,
        scale: scale.and_then(|fit| fit.coefficient(terms.bias)),
        fit,
        candidates,
        choice,
    })
}

/// The most terms that a channel may need: of its scale none where its poses look alike.
fn most_terms(data: &ThermalBlocks, channel: usize, hysteresis: bool) -> Terms {
    let turned_over = channel < CHANNELS / 2 && felt(data, &data.channel(channel)) > TURNED_OVER;
    Terms {
        bias: HIGHEST_ORDER,
        scale: if turned_over { HIGHEST_SCALE_ORDER } else { 0 },
        hysteresis: usize::from(hysteresis),
    }
}

/// The same with a difference between warming and cooling that is a curve, where the axis shows one.
fn with_shape(design: &DriftDesign, means: &[f64], most: Terms) -> Terms {
    let curve = Terms {
        hysteresis: KNOTS,
        ..most
    };
    let shown = most.hysteresis > 0 && design.fit(means, &curve).is_some_and(|fit| is_curve(&fit));
    if shown { curve } else { most }
}

/// Sets of terms up to the most, the simplest first.
fn candidates(most: &Terms) -> Vec<Terms> {
    let of_bias = |bias: usize| (0..=most.scale).map(move |scale| Terms { bias, scale, ..*most });
    let mut all: Vec<Terms> = (0..=most.bias).flat_map(of_bias).collect();
    all.sort_by_key(|terms| terms.bias + terms.scale);
    all
}

/// By how much an axis felt different specific forces in poses whose temperature changed, m/s^2.
fn felt(data: &ThermalBlocks, means: &[f64]) -> f64 {
    let tells = |pose: usize| pose_range(data, pose) >= LEAST_RANGE;
    let told: Vec<bool> = (0..data.poses).map(tells).collect();
    let of_told = || {
        data.blocks
            .iter()
            .zip(means)
            .filter(|(block, _)| told[block.pose])
            .map(|(_, mean)| *mean)
    };
    of_told().fold(f64::NEG_INFINITY, f64::max) - of_told().fold(f64::INFINITY, f64::min)
}
