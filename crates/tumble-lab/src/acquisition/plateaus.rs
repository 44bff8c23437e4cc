//! Segments of constant angular rate, and which of them are rests.
//!
//! A rate table turns for a minute at one rate. With its axis vertical gravity stands still, so that only the rate
//! distinguishes a turn from a rest; and no rate by itself does, since a gyroscope has a bias. The distinction is that
//! a bias is the same whichever way the unit lies, while the axis of a table that turns has one line of gravity: up at
//! one rate is down at the opposite one (docs/theory/turntable.md, section 10).

use nalgebra::Vector3;
use tumble_core::gravity::EARTH_RATE;
use tumble_core::noise::Interval;

use super::motion::{Motion, MotionPiece};

tumble_core::vocabulary! {
    /// Meaning of a constant rate.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum PlateauKind {
        /// The unit stood still.
        Rest = "rest",
        /// The unit turned.
        Constant = "constant",
        /// Nothing shows whether the unit turned.
        Unclear = "unclear",
    }
}

/// A segment of constant angular rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plateau {
    /// When, s since the origin.
    pub interval: Interval<f64>,
    /// Mean angular rate, rad/s.
    pub rate: Vector3<f64>,
    /// Mean specific force, m/s^2.
    pub force: Vector3<f64>,
    /// Samples taken in.
    pub samples: u32,
    /// True where gravity turned in the unit, as it does at no rest.
    pub gravity_turns: bool,
    /// True where it is a rest.
    pub kind: PlateauKind,
}

/// Limit within which the rates of rests agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RateGate {
    /// Those of a high-precision reference.
    Reference,
    /// Those of a unit whose bias may be large, drift, and respond to specific force.
    Target,
}

/// Shortest time over which a rate is judged, s.
const SHORTEST_GROUP: f64 = 0.2;

/// Shortest constant rate, s.
const SHORTEST: f64 = 1.9;

/// Deviation of the rate of a table from a constant, relative to the rate.
const TABLE_RIPPLE: f64 = 0.01;

/// Deviation of the rate of a table from a constant, rad/s.
const DRIFT: f64 = 2e-4;

/// Variance of a calm group over that of the noise.
const CALM: f64 = 4.0;

/// Sigmas by which means may differ by chance.
const SIGMAS: f64 = 6.0;

/// Direction of gravity in a group against that of its plateau, rad.
const GRAVITY_TURNS: f64 = 0.05;

/// Cosine above which two directions, or their opposites, are one line.
const SAME_LINE: f64 = 0.8;

/// Lines of gravity that show a level of the rate to be that of rests.
const FEWEST_LINES: usize = 2;

/// Largest bias of a reference, rad/s an axis: 0.1 deg/s.
pub const LARGEST_REFERENCE_BIAS: f64 = 0.1 * core::f64::consts::PI / 180.0;

/// Response to specific force by which the rates of rests differ, rad/s per m/s^2: 0.3 deg/s per g.
const WORST_G_SENSITIVITY: f64 = 5e-4;

impl RateGate {
    /// Difference of the rates of two rests besides noise, rad/s: drift of a bias, and response to specific force.
    const fn apart(self) -> (f64, f64) {
        match self {
            Self::Reference => (0.005, WORST_G_SENSITIVITY),
            Self::Target => (0.03, WORST_G_SENSITIVITY),
        }
    }
}

/// The same of a reference whose rests agree as well as its grade promises, rad/s.
const FINE: (f64, f64) = (5e-4 + 2.0 * EARTH_RATE, 0.0);

/// Pieces long enough to judge the rate.
#[derive(Clone, Copy)]
struct Group {
    interval: Interval<f64>,
    angle: Vector3<f64>,
    velocity: Vector3<f64>,
    /// Sum of the squared deviations of samples, mean over the axes.
    squares: f64,
    samples: u32,
    resting: bool,
}

impl Group {
    fn of(piece: &MotionPiece) -> Self {
        Self {
            interval: piece.interval,
            angle: piece.angle,
            velocity: piece.velocity,
            squares: piece.scatter * f64::from(piece.samples),
            samples: piece.samples,
            resting: piece.resting,
        }
    }

    fn rate(&self) -> Vector3<f64> {
        self.angle / self.interval.duration()
    }

    fn append(&mut self, next: &Self) {
        let (n, m) = (f64::from(self.samples), f64::from(next.samples));
        let apart = (next.rate() - self.rate()).norm_squared() / 3.0;
        self.squares += next.squares + apart * n * m / (n + m).max(1.0);
        self.angle += next.angle;
        self.velocity += next.velocity;
        self.samples += next.samples;
        self.interval.end = next.interval.end;
    }
}

/// Groups of pieces that follow each other without a gap.
fn groups(motion: &Motion) -> Vec<Option<Group>> {
    let mut groups: Vec<Option<Group>> = Vec::new();
    for piece in motion.pieces() {
        let next = Group::of(piece);
        let gap = |before: &Group| before.interval.end != piece.interval.start;
        if !piece.complete || groups.last().copied().flatten().as_ref().is_some_and(gap) {
            groups.push(None);
        }
        match groups.last_mut() {
            _ if !piece.complete => {}
            Some(Some(group))
                if group.resting == next.resting && group.interval.duration() < SHORTEST_GROUP =>
            {
                group.append(&next);
            }
            _ => groups.push(Some(next)),
        }
    }
    groups
}

/// Finds the segments of constant rate, all of them unclear, given the variance of a sample, (rad/s)^2.
pub fn find_plateaus(motion: &Motion, noise: f64) -> Vec<Plateau> {
    let mut plateaus = Vec::new();
    let mut run: Vec<Group> = Vec::new();
    let mut whole: Option<Group> = None;
    for group in groups(motion).into_iter().chain([None]) {
        let calm = group.filter(|group| is_calm(group, noise));
        if let (Some(sum), Some(group)) = (&mut whole, &calm)
            && goes_on(sum, group, noise)
        {
            sum.append(group);
            run.push(*group);
            continue;
        }
        plateaus.extend(plateau(&run));
        run = calm.into_iter().collect();
        whole = calm;
    }
    plateaus
}

fn is_calm(group: &Group, noise: f64) -> bool {
    let ripple = TABLE_RIPPLE * group.rate().norm();
    group.squares / f64::from(group.samples.max(2) - 1) < CALM * noise + ripple * ripple
}

fn goes_on(run: &Group, next: &Group, noise: f64) -> bool {
    let chance = SIGMAS * libm::hypot(mean_sigma(noise, run.samples), mean_sigma(noise, next.samples));
    let allowed = chance + TABLE_RIPPLE * run.rate().norm() + DRIFT;
    (next.rate() - run.rate()).norm() <= allowed
}

fn mean_sigma(noise: f64, samples: u32) -> f64 {
    (noise / f64::from(samples.max(1))).sqrt()
}

/// The plateau of a run without the groups at its ends, in which the table settles; those of a rest have settled.
fn plateau(run: &[Group]) -> Option<Plateau> {
    let length = run.last()?.interval.end - run.first()?.interval.start;
    let inner = match run {
        [first, .., last] => {
            let begin = usize::from(!first.resting);
            run.get(begin..run.len() - usize::from(!last.resting))?
        }
        one => one,
    };
    let (first, rest) = inner.split_first()?;
    let mut whole = *first;
    rest.iter().for_each(|group| whole.append(group));
    let turned = inner
        .iter()
        .any(|group| group.velocity.angle(&whole.velocity) > GRAVITY_TURNS);
    let duration = whole.interval.duration();
    // Less than a whole turn in which gravity turns leads from one pose to the next.
    let constant = length >= SHORTEST && (!turned || whole.angle.norm() > core::f64::consts::TAU);
    constant.then(|| Plateau {
        interval: whole.interval,
        rate: whole.rate(),
        force: whole.velocity / duration,
        samples: whole.samples,
        gravity_turns: turned,
        kind: PlateauKind::Unclear,
    })
}

/// Labels each plateau as a rest or a turn, given the variance of a sample, (rad/s)^2.
pub fn label_plateaus(plateaus: &mut [Plateau], noise: f64, gate: RateGate) {
    let everything = vec![true; plateaus.len()];
    let coarse = level(plateaus, &everything, noise, gate.apart());
    let alone = coarse.iter().all(|member| *member);
    let seen = lines(plateaus, &coarse);
    let mut zero = coarse;
    if seen >= FEWEST_LINES && gate == RateGate::Reference {
        let fine = level(plateaus, &zero, noise, FINE);
        // Where rests of one line would be lost, they do not agree so well, and nothing finer is known.
        if lines(plateaus, &fine) == seen {
            zero = fine;
        }
    }
    let known = seen >= FEWEST_LINES || alone;
    // Rests of a unit that lay in several ways would have shown its bias in several.
    let none_rests = !known && lines(plateaus, &everything) >= FEWEST_LINES;
    for (plateau, rests) in plateaus.iter_mut().zip(zero) {
        let largest = 3.0_f64.sqrt() * LARGEST_REFERENCE_BIAS + EARTH_RATE;
        plateau.kind = match (known, rests) {
            (true, true) => PlateauKind::Rest,
            (true, false) => PlateauKind::Constant,
            (false, _) => match gate {
                RateGate::Reference if plateau.rate.norm() > largest => PlateauKind::Constant,
                RateGate::Target if none_rests => PlateauKind::Constant,
                _ => PlateauKind::Unclear,
            },
        };
    }
}

/// Which of some plateaus share the level of the rate that is seen on the most lines of gravity, then the longest.
fn level(plateaus: &[Plateau], among: &[bool], noise: f64, (apart, by_force): (f64, f64)) -> Vec<bool> {
    let still = |i: usize| among[i] && !plateaus[i].gravity_turns;
    let agree = |a: &Plateau, b: &Plateau| {
        let chance = SIGMAS * libm::hypot(mean_sigma(noise, a.samples), mean_sigma(noise, b.samples));
        (a.rate - b.rate).norm() <= apart + by_force * (a.force - b.force).norm() + chance
    };
    let members = |i: usize| -> Vec<bool> {
        (0..plateaus.len())
            .map(|j| still(j) && agree(&plateaus[i], &plateaus[j]))
            .collect()
    };
    let length = |members: &[bool]| -> f64 {
        let lengths = plateaus.iter().zip(members).filter(|(_, member)| **member);
        lengths.map(|(plateau, _)| plateau.interval.duration()).sum()
    };
    let levels = (0..plateaus.len()).filter(|&i| still(i)).map(members);
    let best = levels.max_by(|a, b| {
        let more_lines = lines(plateaus, a).cmp(&lines(plateaus, b));
        more_lines.then(length(a).total_cmp(&length(b)))
    });
    best.unwrap_or_else(|| vec![false; plateaus.len()])
}

/// Number of lines of gravity among some plateaus: up and down are one.
fn lines(plateaus: &[Plateau], members: &[bool]) -> usize {
    let mut found: Vec<Vector3<f64>> = Vec::new();
    for (plateau, _) in plateaus.iter().zip(members).filter(|(_, member)| **member) {
        let direction = plateau.force.normalize();
        if found.iter().all(|line| line.dot(&direction).abs() < SAME_LINE) {
            found.push(direction);
        }
    }
    found.len()
}
