//! Eigenvalues and eigenvectors of small symmetric matrices.

use nalgebra::{ArrayStorage, SMatrix, SVector};

use crate::real::{Real, real};

/// Eigenvalues and, column by column, unit eigenvectors of a symmetric matrix, in no order.
///
/// Cyclic Jacobi rotations (Golub and Van Loan, section 8.5): sums, products and roots alone, a bounded number of
/// sweeps, hence the same bits everywhere.
pub fn symmetric<T: Real, const N: usize>(a: SMatrix<T, N, N>) -> (SVector<T, N>, SMatrix<T, N, N>) {
    const SWEEPS: u32 = 16;
    // Column by column, as are the vectors: so the compiler knows their size wherever an element is taken.
    let mut a = a.data.0;
    let mut vectors = [[T::zero(); N]; N];
    let mut values = [T::zero(); N];
    for i in 0..N {
        vectors[i][i] = T::one();
    }
    for _ in 0..SWEEPS {
        let mut is_diagonal = true;
        for p in 0..N {
            for q in p + 1..N {
                let Some(by) = annihilating(&a, p, q) else {
                    continue;
                };
                is_diagonal = false;
                for k in 0..N {
                    (a[p][k], a[q][k]) = turned((a[p][k], a[q][k]), by);
                    (vectors[p][k], vectors[q][k]) = turned((vectors[p][k], vectors[q][k]), by);
                }
                for column in &mut a {
                    (column[p], column[q]) = turned((column[p], column[q]), by);
                }
            }
        }
        if is_diagonal {
            break;
        }
    }
    for i in 0..N {
        values[i] = a[i][i];
    }
    (values.into(), SMatrix::from_array_storage(ArrayStorage(vectors)))
}

/// Cosine and sine of the rotation that makes `a[p, q]` vanish; `None` where it has vanished.
fn annihilating<T: Real, const N: usize>(a: &[[T; N]; N], p: usize, q: usize) -> Option<(T, T)> {
    let (first, second, off) = (a[p][p], a[q][q], a[q][p]);
    if off.abs() <= T::default_epsilon() * real::<T>(0.01) * (first.abs() * second.abs()).square_root() {
        return None;
    }
    let theta = (second - first) / (off * real(2.0));
    let sign = if theta < T::zero() { -T::one() } else { T::one() };
    let tangent = sign / (theta.abs() + (theta * theta + T::one()).square_root());
    let cosine = T::one() / (tangent * tangent + T::one()).square_root();
    Some((cosine, tangent * cosine))
}

/// The coordinates of a point in a plane, turned.
fn turned<T: Real>((x, y): (T, T), (cosine, sine): (T, T)) -> (T, T) {
    (cosine * x - sine * y, sine * x + cosine * y)
}
