/** Length of gravity that means at rest show together: a bias has one side in all. */

import tables from 'tables';
import { median, norm } from '../statistics';

/** Returns the radius of the sphere through means; their usual length where they do not surround its centre. */
export function lengthOfGravity(means: readonly (readonly number[])[]): number {
  const usual = median(means.map(norm));
  if (!(usual > 0)) return usual;
  const rows = means.map((mean) => [...mean.map((value) => (2 * value) / usual), 1]);
  const squares = means.map((mean) => mean.reduce((sum, value) => sum + (value / usual) ** 2, 0));
  const normal = [0, 1, 2, 3].map((i) => [0, 1, 2, 3].map((j) => rows.reduce((sum, row) => sum + row[i] * row[j], 0)));
  const right = [0, 1, 2, 3].map((i) => rows.reduce((sum, row, k) => sum + row[i] * squares[k], 0));
  const { values, vectors } = symmetric(normal);
  // Singular values are the roots of these.
  if (Math.min(...values) <= tables.checks.surrounding ** 2 * Math.max(...values)) return usual;
  const solved = [0, 1, 2, 3].map((i) =>
    values.reduce((sum, value, k) => {
      const along = vectors.reduce((total, row, j) => total + row[k] * right[j], 0);
      return sum + (vectors[i][k] * along) / value;
    }, 0),
  );
  const [x, y, z, rest] = solved;
  return usual * Math.sqrt(Math.max(0, rest + x * x + y * y + z * z));
}

/** Eigenvalues and, column by column, eigenvectors of a symmetric matrix, by Jacobi's rotations. */
function symmetric(matrix: number[][]): { values: number[]; vectors: number[][] } {
  const a = matrix.map((row) => [...row]);
  const size = a.length;
  const vectors = a.map((_, i) => a.map((__, j) => (i === j ? 1 : 0)));
  for (let sweep = 0; sweep < 30; sweep++) {
    for (let p = 0; p < size; p++) {
      for (let q = p + 1; q < size; q++) {
        if (a[p][q] === 0) continue;
        const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const tangent = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1));
        const cosine = 1 / Math.sqrt(tangent * tangent + 1);
        const sine = tangent * cosine;
        const turn = (row: number[]) => {
          [row[p], row[q]] = [cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]];
        };
        a.forEach(turn);
        for (let k = 0; k < size; k++) {
          [a[p][k], a[q][k]] = [cosine * a[p][k] - sine * a[q][k], sine * a[p][k] + cosine * a[q][k]];
        }
        vectors.forEach(turn);
      }
    }
  }
  return { values: a.map((row, k) => row[k]), vectors };
}
