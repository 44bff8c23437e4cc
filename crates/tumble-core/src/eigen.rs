//! Eigenvalues and eigenvectors of small symmetric matrices.

use nalgebra::{SMatrix, SVector};

use crate::real::{Real, real};

/// Eigenvalues and, column by column, unit eigenvectors of a symmetric matrix, in no order.
///
/// Cyclic Jacobi rotations (Golub and Van Loan, section 8.5): sums, products and roots alone, a bounded number of
/// sweeps, hence the same bits everywhere.
pub fn symmetric<T: Real, const N: usize>(mut a: SMatrix<T, N, N>) -> (SVector<T, N>, SMatrix<T, N, N>) {
    const SWEEPS: u32 = 16;
    let mut vectors = SMatrix::identity();
    for _ in 0..SWEEPS {
        for p in 0..N {
            for q in p + 1..N {
                let Some(by) = annihilating(&a, p, q) else {
                    continue;
                };
                for k in 0..N {
                    turn(&mut a, [(k, p), (k, q)], by);
                    turn(&mut vectors, [(k, p), (k, q)], by);
                }
                for k in 0..N {
                    turn(&mut a, [(p, k), (q, k)], by);
                }
            }
        }
    }
    (a.diagonal(), vectors)
}

/// Cosine and sine of the rotation that makes `a[p, q]` vanish; `None` where it has vanished.
fn annihilating<T: Real, const N: usize>(a: &SMatrix<T, N, N>, p: usize, q: usize) -> Option<(T, T)> {
    let off = a[(p, q)];
    if off.abs() <= T::default_epsilon() * real::<T>(0.01) * (a[(p, p)].abs() * a[(q, q)].abs()).square_root()
    {
        return None;
    }
    let theta = (a[(q, q)] - a[(p, p)]) / (off * real(2.0));
    let sign = if theta < T::zero() { -T::one() } else { T::one() };
    let tangent = sign / (theta.abs() + (theta * theta + T::one()).square_root());
    let cosine = T::one() / (tangent * tangent + T::one()).square_root();
    Some((cosine, tangent * cosine))
}

/// Takes two elements for the coordinates of a point in a plane, and turns it.
fn turn<T: Real, const N: usize>(a: &mut SMatrix<T, N, N>, at: [(usize, usize); 2], (cosine, sine): (T, T)) {
    let [first, second] = at;
    let before = (a.get(first).copied(), a.get(second).copied());
    let (Some(x), Some(y)) = before else { return };
    if let Some(turned) = a.get_mut(first) {
        *turned = cosine * x - sine * y;
    }
    if let Some(turned) = a.get_mut(second) {
        *turned = sine * x + cosine * y;
    }
}
