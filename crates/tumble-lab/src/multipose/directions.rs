//! Grouping of rests by the direction of gravity.

use nalgebra::Vector3;

/// Rests closer to each other than this, rad, show one direction.
const ALIKE: f64 = 0.15;

/// The direction each rest shows, numbered in order of appearance. `directions` are unit vectors.
pub fn grouped(directions: &[Vector3<f64>]) -> Vec<usize> {
    let mut firsts: Vec<Vector3<f64>> = Vec::new();
    directions
        .iter()
        .map(|direction| {
            let known = firsts.iter().position(|first| first.angle(direction) < ALIKE);
            known.unwrap_or_else(|| {
                firsts.push(*direction);
                firsts.len() - 1
            })
        })
        .collect()
}

/// Number of groups.
pub(super) fn count(groups: &[usize]) -> usize {
    groups.iter().max().map_or(0, |last| last + 1)
}
