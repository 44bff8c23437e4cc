//! A vehicle: it drives along a winding, uneven road, faster and slower, stops on the way, and rests at the end.
//!
//! All that the road does is a function of the way gone, so that a vehicle that stands does not move in any way.

use rand::RngExt;

use crate::simulate::attitude::EulerAngles;
use crate::simulate::carrier::{BodyMotion, CarrierMotion, CarrierPlan, ground_normal};
use crate::simulate::series::Series;
use crate::simulate::stream::RandomStream;
use crate::simulate::sway::{Sway, SwayStatistics};
use crate::simulate::time_span::TimeSpan;

/// Speed of the gentlest drive, and how much faster the liveliest one is, m/s.
const SPEED: (f64, f64) = (2.0, 18.0);
/// Mean time between changes of speed, s.
const LEG: f64 = 6.0;
/// The motor gets up to speed within this time, s.
const SPOOLING: f64 = 1.0;
/// Acceleration in curves at full speed, m/s^2; they are this long, m.
const CURVES: (f64, (f64, f64)) = (4.0, (60.0, 250.0));
/// Slope along the road, rad; m.
const SLOPES: (f64, (f64, f64)) = (0.06, (100.0, 400.0));
/// Slope across the road, rad; m.
const BANKS: (f64, (f64, f64)) = (0.03, (60.0, 250.0));
/// Up and down over bumps at full speed, m/s^2, and the pitch and roll that come with it, rad.
const BUMPS: (f64, f64) = (2.0, 0.015);
/// Rate of bumps at full speed, Hz.
const BUMPS_BAND: (f64, f64) = (1.0, 3.0);
/// Waves in each of these.
const WAVES: usize = 4;

/// A change of speed with continuous acceleration.
#[derive(Clone, Copy, Debug)]
struct SpeedChange {
    span: TimeSpan,
    /// At its begin, m/s, and what it gains.
    speed: f64,
    gained: f64,
    /// Way gone at its begin, m.
    way: f64,
}

impl SpeedChange {
    /// Way gone, and with it speed and acceleration: `speed' = gained (1 - cos) / duration`.
    fn way(&self, t: f64) -> Series<3> {
        let duration = self.span.duration();
        let elapsed = (t - self.span.start).clamp(0.0, duration);
        let pace = core::f64::consts::TAU / duration;
        let (sine, cosine) = libm::sincos(pace * elapsed);
        let mean = self.gained / duration;
        Series::of([
            self.way
                + self.speed * elapsed
                + mean * (elapsed * elapsed / 2.0 + (cosine - 1.0) / (pace * pace)),
            self.speed + mean * (elapsed - sine / pace),
            mean * (1.0 - cosine),
        ])
    }
}

/// The road, as functions of the way gone.
#[derive(Clone, Debug)]
struct Road {
    /// Against the first, rad, but for a constant.
    heading: Sway,
    /// Front down and left up, rad, but for a constant each.
    pitch: Sway,
    roll: Sway,
    /// Contribution of bumps to pitch, roll, rad, and height, m.
    bumps: [Sway; 3],
    /// Pitch and roll at the start, rad.
    start: (f64, f64),
}

/// All drives.
#[derive(Clone, Debug)]
pub struct Vehicle {
    legs: Vec<SpeedChange>,
    road: Road,
    rests: Vec<TimeSpan>,
    drives: Vec<TimeSpan>,
}

impl Road {
    fn draw(plan: &CarrierPlan, top_speed: f64, stream: &mut RandomStream) -> Self {
        let [forward, left, up] = plan.sway.map(|share| share * plan.intensity);
        let turning = plan.turning * plan.intensity;
        let per_metre = |(short, long): (f64, f64)| (1.0 / long, 1.0 / short);
        let bumps_band = (BUMPS_BAND.0 / top_speed, BUMPS_BAND.1 / top_speed);
        let mut sway = |size, order, band| {
            let swing = SwayStatistics {
                size,
                order,
                band,
                waves: WAVES,
            };
            Sway::draw(&swing, stream)
        };
        let square = top_speed * top_speed;
        let ground = ground_normal(&plan.ground);
        let lying = BodyMotion::still(&ground, 0.0).angles;
        Self {
            heading: sway(CURVES.0 * turning / square, 1, per_metre(CURVES.1)),
            pitch: sway(SLOPES.0 * forward, 0, per_metre(SLOPES.1)),
            roll: sway(BANKS.0 * left, 0, per_metre(BANKS.1)),
            bumps: [
                sway(BUMPS.1 * forward, 0, bumps_band),
                sway(BUMPS.1 * left, 0, bumps_band),
                sway(BUMPS.0 * up / square, 2, bumps_band),
            ],
            start: (lying.pitch.value(), lying.roll.value()),
        }
    }

    /// Change of a sway since the start.
    fn since_start<const N: usize>(sway: &Sway, way: &Series<N>) -> Series<N> {
        sway.at(way) + -sway.at(&Series::<1>::constant(0.0)).value()
    }
}

impl Vehicle {
    /// Draws the road and the drives.
    pub fn new(plan: &CarrierPlan, stream: &mut RandomStream) -> Self {
        let top_speed = SPEED.0 + SPEED.1 * plan.intensity;
        let mut vehicle = Self {
            road: Road::draw(plan, top_speed, stream),
            legs: Vec::new(),
            rests: vec![TimeSpan {
                start: 0.0,
                end: plan.rest,
            }],
            drives: Vec::new(),
        };
        let part = plan.moving / (plan.stops + 1) as f64;
        for _ in 0..plan.flights {
            for stop in 0..=plan.stops {
                let rest = if stop == plan.stops { plan.rest } else { plan.stop };
                vehicle.drive(part, top_speed, plan.sway[0], rest, stream);
            }
        }
        vehicle
    }

    /// Appends a drive from standing to standing, and the rest after it.
    fn drive(&mut self, duration: f64, top_speed: f64, variety: f64, rest: f64, stream: &mut RandomStream) {
        let start = self.rests.last().map_or(0.0, |rest| rest.end);
        let count = ((duration / LEG).round() as usize).max(2);
        let leg_duration = duration / count as f64;
        let mut speed = 0.0;
        for index in 0..count {
            let next = if index + 1 == count {
                0.0
            } else {
                top_speed * (1.0 - 0.7 * variety * stream.random::<f64>())
            };
            let before = self.legs.last().map_or(0.0, |leg| leg.way(leg.span.end).value());
            let from = start + index as f64 * leg_duration;
            self.legs.push(SpeedChange {
                span: TimeSpan {
                    start: from,
                    end: from + leg_duration,
                },
                speed,
                gained: next - speed,
                way: before,
            });
            speed = next;
        }
        let end = start + duration;
        self.drives.push(TimeSpan { start, end });
        self.rests.push(TimeSpan {
            start: end,
            end: end + rest,
        });
    }

    /// Way gone at time `t`, m, with speed and acceleration.
    fn way(&self, t: f64) -> Series<3> {
        let index = self.legs.partition_point(|leg| leg.span.end <= t);
        match self.legs.get(index) {
            Some(leg) if t >= leg.span.start => leg.way(t),
            Some(leg) => Series::constant(leg.way),
            None => Series::constant(self.legs.last().map_or(0.0, |leg| leg.way(t).value())),
        }
    }
}

impl CarrierMotion for Vehicle {
    fn body_motion(&self, t: f64) -> BodyMotion {
        let (way, road) = (self.way(t), &self.road);
        let heading = Road::since_start(&road.heading, &way);
        let slope = Road::since_start(&road.pitch, &way) + road.start.0;
        let bank = Road::since_start(&road.roll, &way) + road.start.1;
        let [pitch, roll, height] = core::array::from_fn(|which| Road::since_start(&road.bumps[which], &way));
        // The wheels roll along the road; the body goes up and down on them.
        let (sine, cosine) = slope.derived::<2>(0).sincos();
        let (north, east) = heading.derived::<2>(0).sincos();
        let speed = way.derived::<2>(1);
        let velocity = [
            speed * cosine * east,
            speed * cosine * north,
            height.derived(1) - speed * sine,
        ];
        BodyMotion {
            angles: EulerAngles {
                heading,
                pitch: slope + pitch,
                roll: bank + roll,
            },
            velocity: velocity.map(|v| v.value()).into(),
            acceleration: velocity.map(|v| v.derivative(1)).into(),
        }
    }

    fn running(&self, t: f64) -> Series<2> {
        let index = self.drives.partition_point(|drive| drive.end < t);
        let drive = self.drives.get(index).or(self.drives.last());
        drive.map_or(Series::constant(0.0), |drive| drive.swell(t, SPOOLING))
    }

    fn rests(&self) -> &[TimeSpan] {
        &self.rests
    }

    fn manoeuvres(&self) -> &[TimeSpan] {
        &self.drives
    }
}
