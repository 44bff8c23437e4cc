//! A quadrotor: it takes off, hovers, is flown about, lands where it was, and does so again.
//!
//! Its way `p` is a smooth random function of time; its attitude follows from it, as the rotors push along the body's up
//! and their drag goes against the velocity, `a + g = thrust up - d v` (Faessler, Franchi, Scaramuzza, "Differential
//! flatness of quadrotor dynamics subject to rotor drag", IEEE RA-L 3, 2018, with the same `d` on all axes). Up is
//! therefore along `a + g + d v`, and across it an accelerometer feels the drag alone.

use core::f64::consts::TAU;

use nalgebra::Vector3;
use rand::RngExt;

use crate::simulate::attitude::EulerAngles;
use crate::simulate::carrier::{BodyMotion, CarrierMotion, CarrierPlan, ground_normal};
use crate::simulate::series::Series;
use crate::simulate::stream::RandomStream;
use crate::simulate::sway::{Sway, SwayStatistics};
use crate::simulate::time_span::TimeSpan;

/// Motors get up to speed before, and stop after, s.
const SPOOLING: f64 = 1.5;
const TAKE_OFF: f64 = 4.0;
const HOVER: f64 = 2.0;
const LANDING: f64 = 5.0;
/// Manoeuvres begin and end gently over this time, s.
const EASING: f64 = 8.0;
/// m.
const HEIGHT: f64 = 4.0;
/// Drag over mass, 1/s.
const DRAG: f64 = 0.35;

/// Wide arcs: velocity, m/s.
const ARCS: SwayStatistics = SwayStatistics {
    size: 6.0,
    order: 1,
    band: (0.05, 0.1),
    waves: 2,
};
/// Quick swerves: acceleration, m/s^2.
const SWERVES: SwayStatistics = SwayStatistics {
    size: 3.5,
    order: 2,
    band: (0.25, 0.6),
    waves: 3,
};
/// Up and down: acceleration, m/s^2. Together these stay below gravity, so that no rotor ever pulls.
const BOUNCES: SwayStatistics = SwayStatistics {
    size: 2.0,
    order: 2,
    band: (0.15, 0.5),
    waves: 3,
};
/// Turns to and fro: angular rate, rad/s.
const TURNS: SwayStatistics = SwayStatistics {
    size: 1.2,
    order: 1,
    band: (0.1, 0.4),
    waves: 3,
};

/// One flight.
#[derive(Clone, Debug)]
struct QuadrotorFlight {
    take_off: TimeSpan,
    manoeuvre: TimeSpan,
    landing: TimeSpan,
    /// Forward, left and up at heading zero, m.
    sways: [Vec<Sway>; 3],
    /// rad.
    turns: Sway,
    /// Heading at take-off, and how much further it lands, rad.
    heading: f64,
    turned: f64,
}

/// All flights.
#[derive(Clone, Debug)]
pub struct Quadrotor {
    hops: Vec<QuadrotorFlight>,
    rests: Vec<TimeSpan>,
    manoeuvres: Vec<TimeSpan>,
    /// By which up on the ground differs from that in a hover, m/s^2.
    lean: Vector3<f64>,
    /// Gravity, m/s^2.
    upwards: Vector3<f64>,
}

impl Quadrotor {
    /// Draws the flights.
    pub fn new(plan: &CarrierPlan, stream: &mut RandomStream) -> Self {
        let mut quadrotor = Self {
            hops: Vec::new(),
            rests: vec![TimeSpan {
                start: 0.0,
                end: plan.rest,
            }],
            manoeuvres: Vec::new(),
            lean: (ground_normal(&plan.ground) - Vector3::z()) * plan.gravity,
            upwards: Vector3::z() * plan.gravity,
        };
        let (mut time, mut heading) = (plan.rest, 0.0);
        for _ in 0..plan.flights {
            let hop = QuadrotorFlight::draw(plan, time + SPOOLING, heading, stream);
            time = hop.landing.end + SPOOLING;
            heading += hop.turned;
            quadrotor.manoeuvres.push(hop.manoeuvre);
            quadrotor.rests.push(TimeSpan {
                start: time,
                end: time + plan.rest,
            });
            time += plan.rest;
            quadrotor.hops.push(hop);
        }
        quadrotor
    }

    /// The flight at time `t`, or the next one; the last after the last.
    fn hop(&self, t: f64) -> Option<&QuadrotorFlight> {
        let index = self.hops.partition_point(|hop| hop.landing.end + SPOOLING < t);
        self.hops.get(index).or(self.hops.last())
    }
}

impl QuadrotorFlight {
    fn draw(plan: &CarrierPlan, start: f64, heading: f64, stream: &mut RandomStream) -> Self {
        let span = |start: f64, duration: f64| TimeSpan {
            start,
            end: start + duration,
        };
        let take_off = span(start, TAKE_OFF);
        let manoeuvre = span(take_off.end + HOVER, plan.moving);
        let landing = span(manoeuvre.end + HOVER, LANDING);
        let mut sway = |swing: &SwayStatistics, share: f64| {
            let size = swing.size * share * plan.intensity;
            Sway::draw(&SwayStatistics { size, ..*swing }, stream)
        };
        let [forward, left, up] = plan.sway;
        let sways = [
            vec![sway(&ARCS, forward), sway(&SWERVES, forward)],
            vec![sway(&ARCS, left), sway(&SWERVES, left)],
            vec![sway(&BOUNCES, up)],
        ];
        let turns = sway(&TURNS, plan.turning);
        Self {
            take_off,
            manoeuvre,
            landing,
            sways,
            turns,
            heading,
            turned: TAU * (stream.random::<f64>() - 0.5) * plan.turning * plan.intensity,
        }
    }

    /// Place against the one it took off from, level frame, m.
    fn place(&self, t: f64) -> [Series<5>; 3] {
        let swell = self.manoeuvre.swell(t, EASING);
        let time = Series::time(t);
        let [x, y, z] = core::array::from_fn(|axis| {
            let sways = self.sways[axis].iter().map(|sway| sway.at(&time));
            sways.fold(Series::constant(0.0), |sum, sway| sum + sway) * swell
        });
        let height = (self.take_off.rise(t) - self.landing.rise(t)) * HEIGHT;
        [x, y, z + height]
    }

    fn heading(&self, t: f64) -> Series<3> {
        let to_and_fro = self.turns.at(&Series::time(t)) * self.manoeuvre.swell(t, EASING);
        to_and_fro + self.manoeuvre.rise(t) * self.turned + self.heading
    }

    /// Tests whether it is off the ground.
    fn flies(&self, t: f64) -> bool {
        t > self.take_off.start && t < self.landing.end
    }
}

impl CarrierMotion for Quadrotor {
    fn body_motion(&self, t: f64) -> BodyMotion {
        let Some(hop) = self.hop(t) else {
            return BodyMotion::still(&(self.lean + self.upwards), 0.0);
        };
        if !hop.flies(t) {
            let heading = hop.heading + if t < hop.take_off.end { 0.0 } else { hop.turned };
            return BodyMotion::still(&(self.lean + self.upwards), heading);
        }
        let place = hop.place(t);
        let velocity = place.map(|way| way.derived::<3>(1));
        let acceleration = place.map(|way| way.derived::<3>(2));
        // On the ground it stands as the ground lies.
        let on_ground = hop.landing.rise(t) - hop.take_off.rise(t) + 1.0;
        let up = core::array::from_fn(|axis| {
            acceleration[axis] + velocity[axis] * DRAG + on_ground * self.lean[axis] + self.upwards[axis]
        });
        BodyMotion {
            angles: EulerAngles::upright(&up, hop.heading(t)),
            velocity: velocity.map(|v| v.value()).into(),
            acceleration: acceleration.map(|a| a.value()).into(),
        }
    }

    fn running(&self, t: f64) -> Series<2> {
        self.hop(t).map_or(Series::constant(0.0), |hop| {
            let motors = TimeSpan {
                start: hop.take_off.start - SPOOLING,
                end: hop.landing.end + SPOOLING,
            };
            motors.swell(t, SPOOLING)
        })
    }

    fn rests(&self) -> &[TimeSpan] {
        &self.rests
    }

    fn manoeuvres(&self) -> &[TimeSpan] {
        &self.manoeuvres
    }
}
