/** Units as people write them, and the evidence of the values themselves for their unit. */

import tables from 'tables';
import { mean, median, norm, quantile, type Triple } from '../statistics';
import { pattern } from './pattern';

const table = tables.units;

export type Quantity = keyof typeof table.values;
type Values = Record<string, number>;
interface Usual {
  median: number;
  factor: number;
  unusual: number;
}

/** A unit that is stated or guessed, and where or why. */
export interface ResolvedUnit {
  name: string;
  scale: number;
  reason: string;
  doubt: string;
  /** Unit of which a scale states the counts. */
  per?: string;
}

/** Rows of three readings, one after the other. */
export type Rows = Float64Array;

export const ASSUMED = 'assumed';
export const AT_REST = 'bias and noise at rest';

/** Returns the unit that a piece of text names, in our spelling; nothing where it names none. */
export function findUnit(text: string, quantity: Quantity): string | undefined {
  let plain = text.trim().toLowerCase().split(/\s+/).join(' ');
  for (const [sign, other] of Object.entries(table.signs)) plain = plain.replaceAll(sign, other);
  if (quantity === 'time') [plain] = plain.split(table.since);
  const spellings: Record<string, string> = table.spellings[quantity];
  const name = plain.replaceAll(' ', '');
  return Object.hasOwn(spellings, name) ? spellings[name] : undefined;
}

const NO_UNIT = new Set<string>(table.noUnit);
const NO_UNIT_OF_TIME = pattern(table.noUnitOfTime);
const DESCRIPTOR = pattern(table.descriptor);
const COUNTS = pattern(table.countsStated);
const LIKE_A_UNIT = pattern(table.likeAUnit);

/**
 * Returns a text where a unit stands that names none that is known; nothing where it states no unit.
 *
 * It is certain that a unit stands in square brackets. Anything may stand in parentheses.
 */
export function unknownUnit(text: string, quantity: Quantity, isCertain: boolean): string | undefined {
  const plain = text.trim().split(/\s+/).join(' ');
  const lower = plain.toLowerCase();
  if (plain.length > table.longestUnit) return undefined;
  if (findUnit(plain, quantity) !== undefined || NO_UNIT.has(lower) || DESCRIPTOR.test(lower)) return undefined;
  if (quantity === 'time') {
    if (NO_UNIT_OF_TIME.test(lower)) return undefined;
    if (table.longUnitsOfTime.includes(lower)) return plain;
  }
  return isCertain || statesCounts(plain) || LIKE_A_UNIT.test(lower) ? plain : undefined;
}

/** Returns whether a text states counts of a scale that is not known. */
export function statesCounts(text: string): boolean {
  return COUNTS.test(text.toLowerCase());
}

export function valueOf(quantity: Quantity, unit: string): number {
  return (table.values[quantity] as Values)[unit];
}

export function row(rows: Rows, k: number): Triple {
  return [rows[3 * k], rows[3 * k + 1], rows[3 * k + 2]];
}

/** Returns the rows whose axes are all finite. */
export function wholeOnes(rows: Rows): Rows {
  const kept: number[] = [];
  for (let k = 0; k < rows.length / 3; k++) {
    const each = row(rows, k);
    if (each.every(Number.isFinite)) kept.push(...each);
  }
  return Float64Array.from(kept);
}

function largestEach(rows: Rows): Float64Array {
  return Float64Array.from({ length: rows.length / 3 }, (_, k) => Math.max(...row(rows, k).map(Math.abs)));
}

/** Returns the largest finite reading, but for the few that garbled lines may have made. */
export function peak(rows: Rows): number {
  const largest = largestEach(wholeOnes(rows)).sort();
  if (largest.length === 0) return 0;
  const leftOut = largest.length >= table.fewSamples ? Math.ceil(largest.length / table.samplesPerSpike) : 0;
  return largest[largest.length - 1 - leftOut];
}

interface Piece {
  mean: Triple;
  scatter: number;
}

/** Means and scatter of short stretches of finite readings. */
function pieces(rows: Rows): Piece[] {
  const finite = wholeOnes(rows);
  const samples = finite.length / 3;
  const window = Math.max(1, Math.min(table.window, Math.floor(samples / 4)));
  return Array.from({ length: Math.floor(samples / window) }, (_, place) => {
    const stretch = finite.subarray(3 * place * window, 3 * (place + 1) * window);
    return moments(stretch);
  });
}

function axis(rows: Rows, k: number): Float64Array {
  return Float64Array.from({ length: rows.length / 3 }, (_, place) => rows[3 * place + k]);
}

function moments(stretch: Rows): Piece {
  const axes = [0, 1, 2].map((k) => axis(stretch, k));
  const means = axes.map(mean) as Triple;
  const variances = axes.map((values, k) => mean(values.map((value) => (value - means[k]) ** 2)));
  return { mean: means, scatter: variances[0] + variances[1] + variances[2] };
}

/** Returns the typical length of vectors while they change least; NaN where there are none. */
export function restNorm(rows: Rows): number {
  const found = pieces(rows);
  if (found.length === 0) return NaN;
  const quiet = quantile(found.map((piece) => piece.scatter), 0.3);
  return median(found.filter((piece) => piece.scatter <= quiet).map((piece) => norm(piece.mean)));
}

/** Returns the smallest length of short means; NaN where there are none. */
export function smallestNorm(rows: Rows): number {
  const lengths = pieces(rows).map((piece) => norm(piece.mean));
  return lengths.length ? Math.min(...lengths) : NaN;
}

/** Returns the unit in which a resting accelerometer reads that length; nothing where none fits. */
export function guessAccelerometerUnit(normAtRest: number): string | undefined {
  return table.shownAtRest.find((name) => isGravity(normAtRest, name));
}

/** Returns whether a resting accelerometer may read that length in a unit. */
export function isGravity(normAtRest: number, unit: string): boolean {
  const ratio = (normAtRest * valueOf('accelerometer', unit)) / table.gravity;
  return ratio >= 0.75 && ratio <= 1.3;
}

/** Returns the range, g, of a sensor of 16 bits that reads so many counts at rest. */
export function guessRange(normAtRest: number): number | undefined {
  return table.ranges.find((span) => Math.abs((normAtRest * span) / table.counts - 1) <= 0.1);
}

/** A stretch in which gravity stood still, as a gyroscope reads it. */
export interface StillReadings {
  rate: number;
  noise: number;
}

/** Returns the stretch in which specific force varies least; nothing where it is no rest. */
export function restIn(force: Rows, rate: Rows, interval: number): StillReadings | undefined {
  if (Number.isNaN(interval)) return undefined;
  const kept = keptTogether(force, rate);
  const samples = kept.force.length / 3;
  const length = Math.min(Math.max(table.fewest, roundHalfEven(table.stretch / interval)), samples);
  if (length < table.fewest) return undefined;
  const stretches = Array.from({ length: Math.floor(samples / length) }, (_, k) =>
    kept.force.subarray(3 * k * length, 3 * (k + 1) * length),
  );
  const scatter = stretches.map((stretch) => moments(stretch).scatter);
  const best = scatter.indexOf(Math.min(...scatter));
  const chosen = stretches[best];
  const half = Math.floor(length / 2);
  const first = direction(chosen.subarray(0, 3 * half));
  const last = direction(chosen.subarray(3 * (length - half)));
  const up = direction(chosen);
  const turned = norm(cross(first, last)) / ((length - half) * interval);
  const noise = whiteNoise(chosen, interval);
  if (turned > table.stillTurn || !(noise > 0 && noise < table.stillNoise)) return undefined;
  const readings = kept.rate.subarray(3 * best * length, 3 * (best + 1) * length);
  const middle = moments(readings).mean;
  const along = middle[0] * up[0] + middle[1] * up[1] + middle[2] * up[2];
  return {
    rate: norm(middle.map((value, k) => value - up[k] * along)),
    noise: whiteNoise(readings, interval),
  };
}

function keptTogether(force: Rows, rate: Rows): { force: Rows; rate: Rows } {
  const places = Array.from({ length: force.length / 3 }, (_, k) => k).filter(
    (k) => row(force, k).every(Number.isFinite) && row(rate, k).every(Number.isFinite),
  );
  const of = (rows: Rows) => Float64Array.from(places.flatMap((k) => row(rows, k)));
  return { force: of(force), rate: of(rate) };
}

function roundHalfEven(value: number): number {
  const below = Math.floor(value);
  if (value - below !== 0.5) return Math.round(value);
  return below % 2 === 0 ? below : below + 1;
}

function direction(rows: Rows): Triple {
  const middle = moments(rows).mean;
  const length = Math.max(norm(middle), 1e-300);
  return middle.map((value) => value / length) as Triple;
}

function cross([a, b, c]: Triple, [x, y, z]: Triple): Triple {
  return [b * z - c * y, c * x - a * z, a * y - b * x];
}

function whiteNoise(rows: Rows, interval: number): number {
  const squares = Array.from({ length: rows.length - 3 }, (_, k) => (rows[k + 3] - rows[k]) ** 2);
  return Math.sqrt((mean(squares) / 2) * interval);
}

function logLikelihood(usual: Usual, value: number): number {
  const sigmas = Math.log(value / usual.median) / Math.log(usual.factor);
  return Math.max(-0.5 * sigmas * sigmas, Math.log(usual.unusual));
}

/** Returns names, the likeliest first, each with how much less likely it is, in logarithms. */
function ordered(likelihoods: readonly (readonly [string, number])[]): [string, number][] {
  const sorted = [...likelihoods].sort((a, b) => b[1] - a[1]);
  return sorted.map(([name, value]) => [name, sorted[0][1] - value]);
}

/** Returns the unit that bias and noise at rest show; nothing where several may be. */
export function rateUnitAtRest(rest: StillReadings): string | undefined {
  const [[likely], [, odds]] = rateUnits(rest, Object.keys(table.rateUnits));
  return odds > table.certain ? likely : undefined;
}

/** Returns units, the likeliest first, each with how much less likely it is than that, in logarithms. */
function rateUnits(rest: StillReadings, names: readonly string[]): [string, number][] {
  const shares: Record<string, number> = table.rateUnits;
  const likelihoods = names.map((name) => {
    return [name, Math.log(shares[name]) + logLikelihoodOfRateUnit(rest, valueOf('gyroscope', name))] as const;
  });
  return ordered(likelihoods);
}

function logLikelihoodOfRateUnit(rest: StillReadings, unit: number): number {
  const { RATE_NOISE, RATE_BIAS, OPTICAL_NOISE, OPTICAL_BIAS } = table.usual;
  const ofKind = (share: number, noise: Usual, bias: Usual) =>
    share +
    (rest.noise > 0 ? logLikelihood(noise, rest.noise * unit) : 0) +
    (rest.rate > 0 ? logLikelihood(bias, rest.rate * unit) : 0);
  const usual = ofKind(Math.log1p(-table.optical), RATE_NOISE, RATE_BIAS);
  const optical = ofKind(Math.log(table.optical), OPTICAL_NOISE, OPTICAL_BIAS);
  return Math.max(usual, optical) + Math.log1p(Math.exp(-Math.abs(usual - optical)));
}

/** Returns the unit of a gyroscope, and why; nothing where none fits. */
export function guessGyroscopeUnit(
  smallest: number,
  fastest: number,
  rest: StillReadings | undefined,
): { name: string; reason: string } | undefined {
  if (fastest > table.impossibleDegrees || smallest > table.largestBiasDegrees) return undefined;
  const isFast = fastest > table.impossibleRadians;
  const tooFast = `peak of ${fastest.toPrecision(4)} is too fast for rad/s`;
  if (rest === undefined) {
    return isFast ? { name: 'deg/s', reason: tooFast } : { name: 'rad/s', reason: ASSUMED };
  }
  const possible = Object.keys(table.rateUnits).filter((name) => name !== 'rad/s' || !isFast);
  const [[likely], ...others] = rateUnits(rest, possible);
  if (others[0][1] > table.certain) return { name: likely, reason: isFast && likely === 'deg/s' ? tooFast : AT_REST };
  const fitting = others.filter(([, odds]) => odds <= table.certain).map(([name]) => name);
  return { name: fitting.includes('rad/s') ? 'rad/s' : likely, reason: ASSUMED };
}

/** Returns the median step between times that advances; NaN where none does. */
export function usualStep(time: Float64Array): number {
  const stamps = time.filter((each) => Math.abs(each) < table.largestTime / valueOf('time', 'ns'));
  const steps = stamps.subarray(1).map((each, k) => each - stamps[k]).filter((step) => step > 0);
  if (steps.length === 0) return NaN;
  const middle = median(steps);
  const within = table.burstsWithin;
  const long = stamps.subarray(within).map((each, k) => each - stamps[k]);
  const average = long.length ? median(long) / within : middle;
  return middle < table.inBurst * average ? average : middle;
}

/** Returns whether an IMU samples with that time between samples, s; taken for granted where it is NaN. */
export function isImuStep(step: number): boolean {
  const [slowest, fastest] = table.rates;
  return !(step * fastest < 1 || step * slowest > 1);
}

/** Returns whether most times, s, are dates of recordings. */
export function countsFrom1970(time: Float64Array): boolean {
  const middle = median(time);
  return time.length > 0 && middle >= table.dates[0] && middle <= table.dates[1];
}

export interface TimeGuess {
  name: string;
  reason: string;
  others: string[];
  isOpen: boolean;
}

/** Returns the unit of time stamps: from their size if they count from 1970, else from their step. */
export function guessTimeUnit(time: Float64Array, step: number, stepText: string, samples: number): TimeGuess {
  const decided = (name: string, reason: string): TimeGuess => ({ name, reason, others: [], isOpen: false });
  if (Number.isNaN(step)) return decided('s', ASSUMED);
  const units = Object.entries(table.values.time) as [string, number][];
  const possible = units.filter(([, scale]) => isImuStep(step * scale));
  const stamps = time.filter((each) => Math.abs(each) < table.largestTime / valueOf('time', 'ns'));
  for (const [name, scale] of possible) {
    if (countsFrom1970(stamps.map((each) => each * scale))) {
      return decided(name, 'size of the stamps, counted from 1970');
    }
  }
  const reason = `step of ${stepText} between samples`;
  if (possible.length === 0) {
    const off = (scale: number) => Math.abs(Math.log(step) + Math.log(table.usual.IMU_RATE.median) + Math.log(scale));
    return decided([...units].sort((a, b) => off(a[1]) - off(b[1]))[0][0], reason);
  }
  const hasFractions = stamps.some((each) => each % 1 !== 0);
  const [[name], ...others] = ordered(
    possible.map(([unit, scale]) => {
      const fractions = hasFractions && unit !== 's' ? Math.log(table.countedInFractions) : 0;
      const rate = logLikelihood(table.usual.IMU_RATE, 1 / (step * scale));
      const duration = logLikelihood(table.usual.DURATION, step * scale * Math.max(samples, 1));
      return [unit, rate + duration + fractions] as const;
    }),
  );
  const fitting = others.filter(([, odds]) => odds < table.certain).map(([other]) => other);
  return {
    name,
    reason: fitting.length ? ASSUMED : reason,
    others: fitting,
    isOpen: others.some(([, odds]) => odds < table.asked),
  };
}

export function inCelsius(values: Float64Array, unit: string): Float64Array {
  const zero = (table.temperatureZero as Values)[unit];
  const scale = valueOf('temperature', unit);
  return values.map((value) => (value - zero) * scale);
}

export function possibleTemperature(values: Float64Array, unit: string): boolean {
  const celsius = inCelsius(values.filter(Number.isFinite), unit);
  const [low, high] = table.possibleTemperature;
  return celsius.every((value) => value >= low && value <= high);
}
