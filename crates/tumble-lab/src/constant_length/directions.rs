//! Directions of a vector of constant length: groups that show one, and points that cover the sphere.

use nalgebra::Vector3;

/// Readings closer to each other than this, rad, show one direction.
const ALIKE: f64 = 0.15;

/// The direction each reading shows, numbered in order of appearance. `directions` are unit vectors.
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

/// Points that cover the sphere evenly, each turned from the last by the golden angle.
pub fn covering(count: u32) -> impl Iterator<Item = Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (sine, cosine) = libm::sincos(golden * f64::from(i));
        let across = (1.0 - z * z).sqrt();
        Vector3::new(across * cosine, across * sine, z)
    })
}

/// Number of groups.
pub fn count(groups: &[usize]) -> usize {
    groups.iter().max().map_or(0, |last| last + 1)
}
