/** From the figures of the core to what people read: parameters with units and intervals, and the section of a file. */

import tables from 'tables';
import type { Core } from '../core';
import { fixed, type Float, float, general } from '../printed';
import type { TriadFigures } from './figures';

const table = tables.multipose;
const AXES = ['x', 'y', 'z'];
const PAIRS = ['xy', 'yz', 'zx'];
const DEGREES = 180 / Math.PI;

export type Triad = 'accelerometer' | 'gyroscope';

/** A number that people read, with its 95 % interval; NaN where the data do not show it. */
export interface Parameter {
  name: string;
  unit: string;
  value: number;
  sigma: number;
  low: number;
  high: number;
  isObservable: boolean;
  reason: string;
}

/** Calibration of three accelerometers or gyroscopes: y = M u + b, M = K L Q. */
export interface TriadResult {
  triad: Triad;
  unit: string;
  figures: TriadFigures;
  parameters: Parameter[];
  estimated: string[];
  unobservable: string[];
  labels: string[];
  widening: number;
  objections: string[];
  noiseDensity: (number | null)[];
  biasInstability: (number | null)[];
}

export function triadResult(
  core: Core,
  triad: Triad,
  figures: TriadFigures,
  noiseDensity: (number | null)[],
  biasInstability: (number | null)[],
): TriadResult {
  const unobservable = [...unseen(figures.observed, triad)];
  const parameters = parametersOf(core, triad, figures, unobservable[0] ?? 'not shown by the data');
  const { observed } = figures;
  return {
    triad,
    unit: table.units[triad],
    figures,
    parameters,
    estimated: [...(observed.slice(9).every(Boolean) ? ['bias'] : []), ...(observed.slice(0, 9).every(Boolean) ? ['matrix'] : [])],
    unobservable,
    labels: figures.labels.map(([kind, first, second]) =>
      kind === 'turn' ? `turn ${first + 1}-${second + 1}` : `rest ${first + 1}`,
    ),
    widening: Math.sqrt(figures.widened),
    objections: objections(triad, parameters),
    noiseDensity,
    biasInstability,
  };
}

/** Words for what M was not asked. */
function* unseen(observed: readonly boolean[], triad: Triad): Generator<string> {
  const seen = (row: number, column: number) => observed[3 * row + column];
  const lacking = [0, 1, 2].filter((column) => ![0, 1, 2].some((row) => seen(row, column)));
  for (const axis of lacking) {
    const remedy = triad === 'gyroscope' ? 'no turn about it was recorded' : 'no rest shows it';
    yield `response to ${table.stimuli[triad]} case axis ${AXES[axis]}: ${remedy}`;
  }
  for (const row of [0, 1, 2]) {
    for (const column of [0, 1, 2]) {
      if (!seen(row, column) && !lacking.includes(column)) {
        yield `response of axis ${AXES[row]} to ${table.stimuli[triad]} case axis ${AXES[column]}`;
      }
    }
  }
}

function parametersOf(core: Core, triad: Triad, figures: TriadFigures, reason: string): Parameter[] {
  const freedom = Math.min(figures.variance_freedom ?? Infinity, table.veryMany);
  const reach = core.ask<number>({ ask: 'student-quantile', probability: table.upper, freedom });
  const shown = shownOf(figures.observed);
  return namesOf(triad).map(([name, unit], k) => {
    if (!shown[k]) return hidden(name, unit, reason);
    const factor = unit === 'deg' ? DEGREES : 1;
    const [value, sigma] = [figures.values[k] * factor, (figures.sigmas[k] ?? NaN) * factor];
    return {
      name, unit, value, sigma, low: value - sigma * reach, high: value + sigma * reach, isObservable: true, reason: '',
    };
  });
}

/** Returns a parameter that the data do not show, for a reason. */
export function hidden(name: string, unit: string, reason: string): Parameter {
  return { name, unit, value: NaN, sigma: Infinity, low: NaN, high: NaN, isObservable: false, reason };
}

function namesOf(triad: Triad): [string, string][] {
  return [
    ...AXES.map((axis): [string, string] => [`bias ${axis}`, table.units[triad]]),
    ...AXES.map((axis): [string, string] => [`scale ${axis}`, '1']),
    ...PAIRS.map((pair): [string, string] => [`non-orthogonality ${pair}`, 'deg']),
    ...AXES.map((axis): [string, string] => [`mounting ${axis}`, 'deg']),
  ];
}

/** Describes the observable part: a scale needs its row of M, an angle two rows, mounting all three. */
function shownOf(observed: readonly boolean[]): boolean[] {
  const [x, y, z] = [0, 3, 6].map((first) => observed.slice(first, first + 3).every(Boolean));
  const all = x && y && z;
  return [...observed.slice(9), x, y, z, x && y, y && z, z && x, all, all, all];
}

function objections(triad: Triad, parameters: Parameter[]): string[] {
  const [low, high] = table.scales;
  return parameters.flatMap(({ name, value, isObservable }) => {
    if (!isObservable) return [];
    if (name.startsWith('non-orthogonality') && Math.abs(value) > table.largestAngle) {
      return [`${triad} ${name} is ${fixed(value, 0)} deg, which no sensor has; check the log`];
    }
    if (name.startsWith('scale') && !(value > low && value < high)) {
      return [`${triad} ${name} is ${general(value, 2)}, which no sensor has; check the log and its units`];
    }
    return [];
  });
}

type Content = Record<string, unknown>;
type Values = Map<string, number>;

/** Returns the section of a calibration file; what was not observable is null. */
export function triadContent(triad: TriadResult): Content {
  const { figures } = triad;
  const values: Values = new Map(triad.parameters.map((each) => [each.name, each.value]));
  const sigmas: Values = new Map(
    triad.parameters.map((each) => [each.name, each.isObservable && Number.isFinite(each.sigma) ? each.sigma : NaN]),
  );
  const diagonal = figures.scale.map((scale, row) => figures.scale.map((_, column) => (row === column ? scale : 0)));
  const covariance = figures.covariance.map((row, i) =>
    row.map((value, j) => (figures.observed[i] && figures.observed[j] ? value : NaN)),
  );
  return {
    unit: triad.unit,
    M: rows(figures.M),
    b: vector(figures.b),
    ...(triad.estimated.includes('matrix') ? { K: rows(diagonal), L: rows(figures.L), Q: rows(figures.Q) } : {}),
    angles: { 'non-orthogonality': byPair(values), mounting: byAxis(values, 'mounting') },
    sigma: {
      bias: byAxis(sigmas, 'bias'),
      scale: byAxis(sigmas, 'scale'),
      'non-orthogonality': byPair(sigmas),
      mounting: byAxis(sigmas, 'mounting'),
    },
    estimated: triad.estimated,
    unobservable: triad.unobservable,
    rank: figures.rank,
    chi_square: figures.chi_square === null ? undefined : float(figures.chi_square),
    degrees_of_freedom: figures.degrees_of_freedom,
    ...(triad.widening > 1 ? { widening: float(triad.widening) } : {}),
    noise_density: vector(triad.noiseDensity),
    bias_instability: vector(triad.biasInstability),
    residuals: triad.labels.map((label, k) => ({
      label,
      value: vector(figures.residuals[k]),
      sigma: vector(figures.residual_sigmas[k]),
    })),
    covariance: rows(covariance),
  };
}

const vector = (values: readonly (number | null)[]): Float64Array => Float64Array.from(values, (value) => value ?? NaN);
const rows = (matrix: readonly (readonly number[])[]): Float64Array[] => matrix.map(vector);
const byAxis = (values: Values, group: string): Float64Array => vector(AXES.map((axis) => values.get(`${group} ${axis}`)!));

function byPair(values: Values): Record<string, Float> {
  return Object.fromEntries(PAIRS.map((pair) => [pair, float(values.get(`non-orthogonality ${pair}`)!)]));
}
