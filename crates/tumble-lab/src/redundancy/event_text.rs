//! Events in words and figures.

use tumble_core::real::Real;
use tumble_core::redundancy::evaluation::Deviation;
use tumble_core::redundancy::fit::adoption::AdoptionRefusal;
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::monitor::event::{Event, EventKind};
use tumble_core::redundancy::selection::SelectionReason;
use tumble_core::redundancy::sensor::Sensor;

use crate::setting::wide;

/// A figure of an event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Figure {
    /// SI.
    Number(f64),
    /// Count, or number of one among several.
    Count(u32),
    /// Units, a bit each, the primary's the lowest.
    Units(u32),
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
    /// Name of the event.
    pub event: &'static str,
    /// Its figures.
    pub figures: Vec<(&'static str, Figure)>,
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
    EventText {
        time: event.time,
        unit: event.unit,
        event: event.kind.name(),
        figures: figures(&event.kind),
    }
}

type Figures = Vec<(&'static str, Figure)>;

fn figures<T: Real>(kind: &EventKind<T>) -> Figures {
    match kind {
        EventKind::RestBegan
        | EventKind::RestEnded
        | EventKind::MotionBegan
        | EventKind::Healthy
        | EventKind::AidingTrusted => vec![],
        EventKind::Evaluated {
            sensor,
            check,
            deviation,
            threshold,
        } => {
            let held = Deviation {
                value: *deviation,
                threshold: *threshold,
            };
            vec![
                of(*sensor),
                ("check", Figure::Text(check.name())),
                ("deviation", number(*deviation)),
                ("threshold", number(*threshold)),
                ("exceeded", Figure::Flag(held.exceeds())),
            ]
        }
        EventKind::Withheld { sensor, why } => vec![of(*sensor), reason(why.name())],
        EventKind::Triggered { sensors } => vec![("sensors", Figure::Text(sensors_name(*sensors)))],
        EventKind::Fitted {
            sensor,
            fit_model,
            directions,
            pairs,
            residual,
            residual_before,
        } => vec![
            of(*sensor),
            ("fit_model", Figure::Text(fit_model.name())),
            ("directions", Figure::Count((*directions).into())),
            ("pairs", Figure::Count(*pairs)),
            ("residual", number(*residual)),
            ("residual_before", number(*residual_before)),
        ],
        EventKind::Adopted { record } => vec![
            of(record.sensor),
            ("fit_model", Figure::Text(record.fit_model.name())),
            ("directions", Figure::Count(record.directions.into())),
            ("residual", number(record.residual)),
            ("residual_before", number(record.residual_before)),
            ("sequence", Figure::Count(record.sequence)),
        ],
        EventKind::Refused { sensor, why } => [vec![of(*sensor)], refusal(why)].concat(),
        EventKind::Abandoned { why } => vec![reason(why.name())],
        EventKind::Unhealthy { fault } => fault_figures(fault),
        EventKind::Disagree {
            sensor,
            other,
            apart,
            limit,
            scale,
        } => [
            vec![of(*sensor), ("other", unit(*other))],
            value_and_limit(*apart, *limit),
            vec![("scale", number(*scale))],
        ]
        .concat(),
        EventKind::Agree { sensor, other } => vec![of(*sensor), ("other", unit(*other))],
        EventKind::AidingLeftOut { why } => vec![reason(why.name())],
        EventKind::AidingDistrusted { misfit, limit } => value_and_limit(*misfit, *limit),
        EventKind::Selected { reason: why } => vec![reason(why.name())],
        EventKind::NoneSelected => vec![reason(SelectionReason::NoneFit.name())],
        EventKind::Restored { sensor, sequence } => {
            vec![of(*sensor), ("sequence", Figure::Count(*sequence))]
        }
        EventKind::RecordRejected { sensor, why } => vec![of(*sensor), reason(why.name())],
        #[allow(clippy::cast_precision_loss)]
        EventKind::TimeJumped { by } => vec![("by", Figure::Number(*by as f64 * 1e-6))],
        EventKind::AllSaturated { sensor } => vec![of(*sensor)],
    }
}

/// One unit, in the form of several.
fn unit(number: usize) -> Figure {
    Figure::Units(
        u32::try_from(number)
            .ok()
            .and_then(|number| 1_u32.checked_shl(number))
            .unwrap_or(0),
    )
}

fn number<T: Real>(value: T) -> Figure {
    Figure::Number(wide(value))
}

fn of(sensor: Sensor) -> (&'static str, Figure) {
    ("sensor", Figure::Text(sensor.name()))
}

fn reason(word: &'static str) -> (&'static str, Figure) {
    ("reason", Figure::Text(word))
}

fn value_and_limit<T: Real>(value: T, limit: T) -> Figures {
    vec![("value", number(value)), ("limit", number(limit))]
}

fn sensors_name(sensors: [bool; 2]) -> &'static str {
    match sensors {
        [true, true] => "both",
        [true, false] => Sensor::Accelerometer.name(),
        [false, true] => Sensor::Gyroscope.name(),
        [false, false] => "none",
    }
}

fn refusal<T: Real>(why: &AdoptionRefusal<T>) -> Figures {
    let figures = match why {
        AdoptionRefusal::Unsolvable => vec![],
        AdoptionRefusal::TooFewPairs { pairs, needed } => {
            vec![
                ("value", Figure::Count(*pairs)),
                ("limit", Figure::Count(*needed)),
            ]
        }
        AdoptionRefusal::Exceeds(_, excess) => value_and_limit(excess.value, excess.limit),
    };
    [vec![reason(why.reason().name())], figures].concat()
}

fn fault_figures<T: Real>(fault: &HealthFault<T>) -> Figures {
    let found = fault.figures();
    let channel = |at: u8| Figure::Text(CHANNEL_NAMES.get(usize::from(at)).copied().unwrap_or(""));
    let figures = [
        ("sensor", found.sensor.map(|sensor| Figure::Text(sensor.name()))),
        ("channel", found.channel.map(channel)),
        ("ground", found.ground.map(|ground| Figure::Text(ground.name()))),
        ("value", found.value.map(number)),
        ("limit", found.limit.map(number)),
        ("scale", found.scale.map(number)),
        (
            "agreeing",
            found.agreeing.map(|units| Figure::Units(units.into())),
        ),
    ];
    let known = figures
        .into_iter()
        .filter_map(|(name, figure)| Some((name, figure?)));
    [reason(fault.name())].into_iter().chain(known).collect()
}
