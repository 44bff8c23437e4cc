//! A clock whose rate wanders: offsets of successive seconds, joined by a random walk of rate.
//!
//! Equations: docs/theory/clocks.md.

use nalgebra::{Matrix2, Vector2};

/// Random walk of an oscillator's rate, 1/sqrt(s).
const WALK: f64 = 2e-8;
/// 1-sigma beforehand of the rate beside the period that was measured, and of the offset, s.
const RATE: f64 = 1e-2;
const OFFSET: f64 = 1e3;
/// Rounds in which the scatter of offsets about the clock is measured.
const ROUNDS: usize = 3;
/// Walks that are tried where that of a usual oscillator does not explain the offsets: a clock that warms bends more.
const FASTER: [f64; 4] = [3.0, 10.0, 100.0, 1000.0];
/// Logarithm of likelihood by which a faster one has to be more likely.
const MORE_LIKELY: f64 = 4.0;

/// An offset, s, at a time, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// s.
    pub time: f64,
    /// s.
    pub offset: f64,
}

/// Offset and rate at each node, with their covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct Walk {
    /// s of each node.
    pub times: Vec<f64>,
    /// Offset, s, and rate.
    pub states: Vec<Vector2<f64>>,
    /// Their covariances.
    pub covariances: Vec<Matrix2<f64>>,
}

fn transition(step: f64) -> Matrix2<f64> {
    Matrix2::new(1.0, step, 0.0, 1.0)
}

fn process(step: f64, walk: f64) -> Matrix2<f64> {
    let cross = step * step / 2.0;
    Matrix2::new(step.powi(3) / 3.0, cross, cross, step) * (walk * walk) // eq. 12
}

/// A clock, and how well it explains the offsets.
struct Explained {
    walk: Walk,
    chi_square: f64,
    likelihood: f64,
}

/// One pass forwards and one back (Rauch, Tung and Striebel 1965).
fn smooth(nodes: &[Node], variance: f64, walk: f64) -> Explained {
    let mut state = Vector2::new(nodes[0].offset, 0.0);
    let mut covariance = Matrix2::from_diagonal(&Vector2::new(OFFSET * OFFSET, RATE * RATE));
    let (mut filtered, mut predicted) = (Vec::new(), Vec::new());
    let (mut chi_square, mut likelihood, mut before) = (0.0, 0.0, nodes[0].time);
    for (number, node) in nodes.iter().enumerate() {
        let step = node.time - before;
        before = node.time;
        let forward = transition(step);
        state = forward * state;
        covariance = forward * covariance * forward.transpose() + process(step, walk);
        predicted.push((state, covariance));
        let innovation = node.offset - state[0];
        let expected = covariance[(0, 0)] + variance;
        if number > 1 {
            chi_square += innovation * innovation / expected;
            likelihood -= 0.5 * (innovation * innovation / expected + libm::log(expected));
        }
        let gain = covariance.column(0) / expected;
        state += gain * innovation;
        let kept = Matrix2::new(1.0 - gain[0], 0.0, -gain[1], 1.0);
        // Joseph's form stays positive.
        covariance = kept * covariance * kept.transpose() + gain * gain.transpose() * variance;
        filtered.push((state, covariance));
    }
    let mut smoothed = filtered.clone();
    for k in (0..nodes.len() - 1).rev() {
        let forward = transition(nodes[k + 1].time - nodes[k].time);
        let Some(inverse) = predicted[k + 1].1.try_inverse() else {
            continue;
        };
        let gain = filtered[k].1 * forward.transpose() * inverse;
        let (ahead, ahead_covariance) = smoothed[k + 1];
        smoothed[k].0 = filtered[k].0 + gain * (ahead - predicted[k + 1].0);
        smoothed[k].1 = filtered[k].1 + gain * (ahead_covariance - predicted[k + 1].1) * gain.transpose();
    }
    let (states, covariances) = smoothed.into_iter().unzip();
    let times = nodes.iter().map(|node| node.time).collect();
    let walk = Walk {
        times,
        states,
        covariances,
    };
    Explained {
        walk,
        chi_square,
        likelihood,
    }
}

/// The same, where offsets scatter by more if they show more.
fn explain(nodes: &[Node], sigma: f64, walk: f64) -> Explained {
    let mut variance = sigma * sigma;
    let mut found = smooth(nodes, variance, walk);
    for _ in 0..ROUNDS {
        #[allow(clippy::cast_precision_loss)]
        let excess = found.chi_square / nodes.len().saturating_sub(2).max(1) as f64;
        if excess <= 1.0 {
            break;
        }
        variance *= excess;
        found = smooth(nodes, variance, walk);
    }
    found
}

/// Joins nodes, at least one, in order of time; each offset scatters by `sigma`, s, or by more where they show more
/// (eq. 11, 12).
#[must_use]
pub fn join(nodes: &[Node], sigma: f64) -> Walk {
    let usual = explain(nodes, sigma, WALK);
    let tried = FASTER.iter().map(|by| explain(nodes, sigma, by * WALK));
    let faster = tried.max_by(|a, b| a.likelihood.total_cmp(&b.likelihood));
    match faster {
        Some(other) if other.likelihood > usual.likelihood + MORE_LIKELY => other.walk,
        _ => usual.walk,
    }
}

impl Walk {
    /// Offset at a time, s: linear between nodes and beyond the first and the last.
    #[must_use]
    pub fn at(&self, time: f64) -> f64 {
        let next = self.times.partition_point(|&node| node <= time);
        if next == 0 || next == self.times.len() {
            let end = next.saturating_sub(1);
            return self.states[end][0] + self.states[end][1] * (time - self.times[end]);
        }
        let (from, to) = (self.times[next - 1], self.times[next]);
        let share = (time - from) / (to - from);
        self.states[next - 1][0] * (1.0 - share) + self.states[next][0] * share
    }

    /// Largest 1-sigma of an offset, s.
    #[must_use]
    pub fn offset_sigma(&self) -> f64 {
        self.covariances
            .iter()
            .fold(0.0, |most, each| most.max(each[(0, 0)].sqrt()))
    }

    /// Largest 1-sigma of the rate.
    #[must_use]
    pub fn rate_sigma(&self) -> f64 {
        self.covariances
            .iter()
            .fold(0.0, |most, each| most.max(each[(1, 1)].sqrt()))
    }
}
