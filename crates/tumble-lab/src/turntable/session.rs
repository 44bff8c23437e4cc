//! A target beside its reference, with all that both steps of its calibration need.

use tumble_core::noise::Interval;
use tumble_core::segmenter::Segment;

use super::pairing::Pairing;
use super::reference::{Reference, Ups};
use super::settings::TurntableSettings;
use crate::acquisition::{Acquired, interval};

/// Largest plausible bias of a target accelerometer, m/s^2.
pub(super) const LARGEST_FORCE_BIAS: f64 = 20.0;

/// Largest plausible bias of a target gyroscope, rad/s.
pub(super) const LARGEST_RATE_BIAS: f64 = 1.0;

/// One target of a session.
pub(super) struct TargetSession<'a> {
    /// Recording of the reference.
    pub reference_unit: &'a Acquired,
    /// The reference with its biases, attitudes and mounting.
    pub reference: &'a Reference,
    /// Recording of the target.
    pub unit: &'a Acquired,
    /// Which rests belong together.
    pub pairing: &'a Pairing,
    /// Up of each rest of the reference in the table frame.
    pub ups: &'a Ups,
    /// Settings of the calibration.
    pub settings: &'a TurntableSettings,
}

impl TargetSession<'_> {
    /// Variance of the pace of the target's clock against that of the reference, relative: what turns show of it, or what is
    /// known of times that were fitted.
    pub(super) fn pace_variance(&self) -> f64 {
        if self.pairing.shared {
            self.reference_unit.pace_sigma.powi(2) + self.unit.pace_sigma.powi(2)
        } else {
            self.pairing.clock.covariance[(1, 1)]
        }
    }

    /// When a segment of the target took place, on the clock of the reference.
    pub fn when(&self, own: &Segment<f64>) -> Interval<f64> {
        self.on_clock_of_reference(&interval(own))
    }

    /// An interval of the target's clock on that of the reference.
    pub fn on_clock_of_reference(&self, own: &Interval<f64>) -> Interval<f64> {
        Interval {
            start: self.pairing.clock.to_reference(own.start),
            end: self.pairing.clock.to_reference(own.end),
        }
    }

    /// When, on the clock of the target, something took place that the reference dates.
    pub fn of_target(&self, seen: &Interval<f64>) -> Interval<f64> {
        let clock = &self.pairing.clock;
        let own = |time: f64| time + clock.offset_at(time).0;
        Interval {
            start: own(seen.start),
            end: own(seen.end),
        }
    }

    /// From the first rest both saw, or constant rate, to the last: the bias is the mean over it.
    pub fn span(&self) -> Interval<f64> {
        let rests = self.pairing.pairs.iter().map(|pair| self.when(&pair.segment));
        let rates = self
            .reference_unit
            .constant_rates()
            .map(|plateau| plateau.interval);
        let whole = rests.chain(rates).reduce(|a, b| Interval {
            start: a.start.min(b.start),
            end: a.end.max(b.end),
        });
        whole.unwrap_or(Interval { start: 0.0, end: 1.0 })
    }
}
