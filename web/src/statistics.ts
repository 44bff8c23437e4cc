/** Means, medians and quantiles of lists. */

export type Triple = [number, number, number];

/** Returns the median; NaN of nothing. */
export function median(values: ArrayLike<number>): number {
  if (values.length === 0) return NaN;
  const sorted = Float64Array.from(values).sort();
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}

/** Returns a quantile by straight lines between values. */
export function quantile(values: ArrayLike<number>, share: number): number {
  const sorted = Float64Array.from(values).sort();
  const place = share * (sorted.length - 1);
  const below = Math.floor(place);
  const above = Math.min(below + 1, sorted.length - 1);
  return sorted[below] + (place - below) * (sorted[above] - sorted[below]);
}

export function mean(values: ArrayLike<number>): number {
  let sum = 0;
  for (let k = 0; k < values.length; k++) sum += values[k];
  return sum / values.length;
}

/** Returns the root of the mean square of the finite values; NaN where there are none. */
export function rootMeanSquare(values: readonly (number | null)[]): number {
  const known = values.filter((value): value is number => value !== null && Number.isFinite(value));
  return known.length ? Math.sqrt(mean(known.map((value) => value * value))) : NaN;
}

export function norm([x, y, z]: readonly number[]): number {
  return Math.sqrt(x * x + y * y + z * z);
}
