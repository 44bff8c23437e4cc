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
                if let Some((cosine, sine)) = annihilating(&a, p, q) {
                    turn_columns(&mut a, p, q, cosine, sine);
                    turn_rows(&mut a, p, q, cosine, sine);
                    turn_columns(&mut vectors, p, q, cosine, sine);
                }
            }
        }
    }
    (a.diagonal(), vectors)
}

/// Cosine and sine of the rotation that makes `a[p, q]` vanish; `None` where it has vanished.
fn annihilating<T: Real, const N: usize>(a: &SMatrix<T, N, N>, p: usize, q: usize) -> Option<(T, T)> {
    let off = a[(p, q)];
    if off.abs() <= T::default_epsilon() * real::<T>(0.01) * (a[(p, p)].abs() * a[(q, q)].abs()).sqrt() {
        return None;
    }
    let theta = (a[(q, q)] - a[(p, p)]) / (off * real(2.0));
    let sign = if theta < T::zero() { -T::one() } else { T::one() };
    let tangent = sign / (theta.abs() + (theta * theta + T::one()).sqrt());
    let cosine = T::one() / (tangent * tangent + T::one()).sqrt();
    Some((cosine, tangent * cosine))
}

fn turn_columns<T: Real, const N: usize>(a: &mut SMatrix<T, N, N>, p: usize, q: usize, cosine: T, sine: T) {
    for k in 0..N {
        let (akp, akq) = (a[(k, p)], a[(k, q)]);
        a[(k, p)] = cosine * akp - sine * akq;
        a[(k, q)] = sine * akp + cosine * akq;
    }
}

fn turn_rows<T: Real, const N: usize>(a: &mut SMatrix<T, N, N>, p: usize, q: usize, cosine: T, sine: T) {
    for k in 0..N {
        let (apk, aqk) = (a[(p, k)], a[(q, k)]);
        a[(p, k)] = cosine * apk - sine * aqk;
        a[(q, k)] = sine * apk + cosine * aqk;
    }
}
