//! Events in words and figures.

use tumble_core::real::Real;
use tumble_core::redundancy::evaluation::Deviation;
use tumble_core::redundancy::fit::adoption::{AdoptionRefusal, Excess};
use tumble_core::redundancy::gate::Withheld;
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::monitor::event::{Abandoned, Check, Event, EventKind, RecordRejection};
use tumble_core::redundancy::selection::SelectionReason;
use tumble_core::redundancy::sensor::Sensor;

use crate::redundancy::names::rung;
use crate::setting::wide;

/// A figure of an event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Figure {
    /// SI.
    Number(f64),
    /// How many, or which.
    Count(u32),
    /// In words.
    Text(&'static str),
    /// Yes or no.
    Flag(bool),
}

/// An event with its figures by name.
#[derive(Clone, Debug, PartialEq)]
pub struct EventText {
    /// Microseconds of the common clock.
    pub time: u64,
    /// The unit, 0 the primary.
    pub unit: usize,
    /// What happened.
    pub event: &'static str,
    /// Its figures.
    pub figures: Vec<(&'static str, Figure)>,
}

/// A sensor in words.
pub fn sensor_name(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Accelerometer => "accelerometer",
        Sensor::Gyroscope => "gyroscope",
    }
}

const CHANNEL_NAMES: [&str; 6] = [
    "specific force x",
    "specific force y",
    "specific force z",
    "angular rate x",
    "angular rate y",
    "angular rate z",
];

/// Puts an event in words.
pub fn event_text<T: Real>(event: &Event<T>) -> EventText {
    let (name, figures) = kind_text(&event.kind);
    EventText {
        time: event.time,
        unit: event.unit,
        event: name,
        figures,
    }
}

type Figures = Vec<(&'static str, Figure)>;

fn kind_text<T: Real>(kind: &EventKind<T>) -> (&'static str, Figures) {
    let of = |sensor: &Sensor| ("sensor", Figure::Text(sensor_name(*sensor)));
    let reason = |why| ("reason", Figure::Text(why));
    match kind {
        EventKind::RestBegan => ("rest began", vec![]),
        EventKind::RestEnded => ("rest ended", vec![]),
        EventKind::Evaluated {
            sensor,
            check,
            deviation,
            threshold,
        } => {
            let check = match check {
                Check::Norm => "norm",
                Check::Vector => "vector",
            };
            let held = Deviation {
                value: *deviation,
                threshold: *threshold,
            };
            let figures = vec![
                of(sensor),
                ("check", Figure::Text(check)),
                ("deviation", number(*deviation)),
                ("threshold", number(*threshold)),
                ("exceeded", Figure::Flag(held.exceeds())),
            ];
            ("evaluated", figures)
        }
        EventKind::Withheld { sensor, why } => ("withheld", vec![of(sensor), reason(withheld(*why))]),
        EventKind::Triggered { sensors } => (
            "triggered",
            vec![("sensors", Figure::Text(sensors_name(*sensors)))],
        ),
        EventKind::MotionBegan => ("motion began", vec![]),
        EventKind::Fitted {
            sensor,
            rung: found,
            directions,
            pairs,
            residual,
            residual_before,
        } => {
            let figures = vec![
                of(sensor),
                ("rung", Figure::Text(rung(*found))),
                ("directions", Figure::Count((*directions).into())),
                ("pairs", Figure::Count(*pairs)),
                ("residual", number(*residual)),
                ("residual_before", number(*residual_before)),
            ];
            ("fitted", figures)
        }
        EventKind::Adopted { record } => {
            let figures = vec![
                of(&record.sensor),
                ("rung", Figure::Text(rung(record.rung))),
                ("directions", Figure::Count(record.directions.into())),
                ("residual", number(record.residual)),
                ("residual_before", number(record.residual_before)),
                ("sequence", Figure::Count(record.sequence)),
            ];
            ("adopted", figures)
        }
        EventKind::Refused { sensor, why } => {
            let mut figures = vec![of(sensor)];
            figures.extend(refusal(why));
            ("refused", figures)
        }
        EventKind::Abandoned { why } => ("abandoned", vec![reason(abandoned(*why))]),
        EventKind::Unhealthy { fault: found } => ("unhealthy", fault(found)),
        EventKind::Healthy => ("healthy", vec![]),
        EventKind::Selected { reason: why } => ("selected", vec![reason(selection(*why))]),
        EventKind::NoneSelected => ("selected", vec![reason("none fit")]),
        EventKind::Restored { sensor, sequence } => (
            "restored",
            vec![of(sensor), ("sequence", Figure::Count(*sequence))],
        ),
        EventKind::RecordRejected { sensor, why } => {
            let why = match why {
                RecordRejection::OfAnotherUnit => "of another unit",
                RecordRejection::NotFinite => "not finite",
                RecordRejection::Implausible => "implausible",
            };
            ("record rejected", vec![of(sensor), reason(why)])
        }
        #[allow(clippy::cast_precision_loss)]
        EventKind::TimeJumped { by } => ("time jumped", vec![("by", Figure::Number(*by as f64 * 1e-6))]),
    }
}

fn number<T: Real>(value: T) -> Figure {
    Figure::Number(wide(value))
}

fn sensors_name(sensors: [bool; 2]) -> &'static str {
    match sensors {
        [true, true] => "both",
        [true, false] => "accelerometer",
        [false, true] => "gyroscope",
        [false, false] => "none",
    }
}

fn withheld(why: Withheld) -> &'static str {
    match why {
        Withheld::PrimaryInvalid => "primary invalid",
        Withheld::PrimaryUnhealthy => "primary unhealthy",
        Withheld::SecondaryUnhealthy => "secondary unhealthy",
        Withheld::AlreadyCalibrating => "already calibrating",
    }
}

fn abandoned(why: Abandoned) -> &'static str {
    match why {
        Abandoned::NoMotion => "no motion",
        Abandoned::TimedOut => "timed out",
        Abandoned::PrimaryInvalid => "primary invalid",
        Abandoned::PrimaryUnhealthy => "primary unhealthy",
        Abandoned::SecondaryUnhealthy => "secondary unhealthy",
        Abandoned::TimeJumped => "time jumped",
        Abandoned::RecordReplaced => "record replaced",
    }
}

fn selection(why: SelectionReason) -> &'static str {
    match why {
        SelectionReason::Start => "start",
        SelectionReason::PrimaryFailed => "primary failed",
        SelectionReason::SourceFailed => "source failed",
        SelectionReason::PrimaryProven => "primary proven",
        SelectionReason::Command => "command",
        SelectionReason::NoneFit => "none fit",
    }
}

fn refusal<T: Real>(why: &AdoptionRefusal<T>) -> Figures {
    let excess = |reason, excess: &Excess<T>| {
        vec![
            ("reason", Figure::Text(reason)),
            ("value", number(excess.value)),
            ("limit", number(excess.limit)),
        ]
    };
    match why {
        AdoptionRefusal::Unsolvable => vec![("reason", Figure::Text("unsolvable"))],
        AdoptionRefusal::TooFewPairs { pairs, needed } => vec![
            ("reason", Figure::Text("too few pairs")),
            ("value", Figure::Count(*pairs)),
            ("limit", Figure::Count(*needed)),
        ],
        AdoptionRefusal::ResidualTooLarge(by) => excess("residual too large", by),
        AdoptionRefusal::ImplausibleBias(by) => excess("implausible bias", by),
        AdoptionRefusal::ImplausibleScale(by) => excess("implausible scale", by),
        AdoptionRefusal::ImplausibleMisalignment(by) => excess("implausible misalignment", by),
        AdoptionRefusal::ImplausibleLeverArm(by) => excess("implausible lever arm", by),
        AdoptionRefusal::Drifting(by) => excess("drifting", by),
        AdoptionRefusal::DisagreesWithRest(by) => excess("disagrees with rest", by),
        AdoptionRefusal::NotBetter(by) => excess("not better", by),
    }
}

fn fault<T: Real>(fault: &HealthFault<T>) -> Figures {
    let reason = |text| ("reason", Figure::Text(text));
    let of = |sensor: &Sensor| ("sensor", Figure::Text(sensor_name(*sensor)));
    let channel = |channel: &u8| {
        let name = CHANNEL_NAMES.get(usize::from(*channel)).copied().unwrap_or("");
        ("channel", Figure::Text(name))
    };
    match fault {
        HealthFault::Late { pause } => vec![reason("late"), ("value", number(*pause))],
        HealthFault::Frozen { sensor, duration } => {
            vec![reason("frozen"), of(sensor), ("value", number(*duration))]
        }
        HealthFault::Stuck { channel: at, value } => {
            vec![reason("stuck"), channel(at), ("value", number(*value))]
        }
        HealthFault::Saturated { channel: at, value } => {
            vec![reason("saturated"), channel(at), ("value", number(*value))]
        }
        HealthFault::NotFinite { channel: at } => vec![reason("not finite"), channel(at)],
        HealthFault::Spikes { channel: at, value } => {
            vec![reason("spikes"), channel(at), ("value", number(*value))]
        }
        HealthFault::OutOfFamily { sensor, apart, limit } => {
            vec![
                reason("out of family"),
                of(sensor),
                ("value", number(*apart)),
                ("limit", number(*limit)),
            ]
        }
        HealthFault::Noisy { sensor, ratio, limit } => {
            vec![
                reason("noisy"),
                of(sensor),
                ("value", number(*ratio)),
                ("limit", number(*limit)),
            ]
        }
        HealthFault::ImplausibleAtRest {
            sensor,
            deviation,
            limit,
        } => vec![
            reason("implausible at rest"),
            of(sensor),
            ("value", number(*deviation)),
            ("limit", number(*limit)),
        ],
        HealthFault::ClockJumped => vec![reason("clock jumped")],
    }
}
