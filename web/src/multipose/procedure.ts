/** The multi-pose procedure on a log: an IMU held still in many orientations, turned by hand in between. */

import tables from 'tables';
import type { Core } from '../core';
import { Failure } from '../failure';
import type { ReadOptions } from '../log/conversion';
import type { Recording } from '../log/reading';
import { isImuStep, usualStep, type Rows } from '../log/units';
import { filled, fixed, general, withSign } from '../printed';
import { rootMeanSquare } from '../statistics';
import { acquire } from './acquire';
import { contradictions, isAWarning, statedRate, statedRateWords } from './contradictions';
import type { AcquireAnswer, AcquiredFigures, MultiposeFigures } from './figures';
import { explain, tremorWords } from './messages';
import { deadChannel, logTime, notices, recordedFaults, stoodStill, takeTurns } from './notices';
import { lengthOfGravity } from './sphere';
import { hidden, triadResult, type TriadResult } from './triad';

const table = tables.multipose;
const checks = tables.checks;

export type Verdict = 'calibrated' | 'partly calibrated' | 'model not met';

/** Facts that a person states of a session. */
export interface SessionOptions {
  /** m/s^2; standard gravity where nobody states it. */
  gravity?: number;
  /** The unit lay on the six faces of a box. */
  faces?: boolean;
  read: ReadOptions;
}

/** One unit, calibrated from rests in many orientations and the turns between them. */
export interface MultiposeResult {
  recording: Recording;
  options: SessionOptions;
  gravity: number;
  figures: MultiposeFigures;
  accelerometer: TriadResult;
  gyroscope: TriadResult | undefined;
  gyroscopeReason: string;
  verdict: Verdict;
  duration: number;
  /** Lowest, mean and highest, degC. */
  temperature: [number, number, number] | null;
  directions: number;
  /** Root mean square of |y| - g, m/s^2: of readings, calibrated, and held out of the fit. */
  lengths: { before: number; after: number; heldOut: number };
  /** Root mean square of the angle of gravity after a turn, rad: with the bias alone, calibrated. */
  angles: { before: number; after: number };
  warnings: string[];
}

/** Calibrates a unit; refuses, in one line, where the poses do not show all that is asked of the accelerometer. */
export function multipose(core: Core, recording: Recording, options: SessionOptions): MultiposeResult {
  const gravity = options.gravity ?? tables.units.gravity;
  if (!(gravity > 9.5 && gravity < 10)) {
    throw new Failure(`gravity of ${general(gravity)} m/s^2 is found nowhere on Earth; give it in m/s^2`);
  }
  refuseOddStep(recording);
  const unit = acquired(core, recording, gravity, options.read.raw ?? false);
  const { samples } = recording;
  const figures = core.ask<MultiposeFigures>(
    {
      ask: 'multipose',
      gravity,
      gravity_sigma: 0,
      gyroscope: recording.hasGyroscope,
      raw: options.read.raw ?? false,
      faces: options.faces ?? false,
      pace_sigma: recording.paceSigma,
      stamp_sigma: recording.stampSigma,
    },
    [samples.time, samples.force, samples.rate],
  );
  if (figures.refusal) {
    const hint = options.read.rate ? `; is ${general(options.read.rate)} Hz of --rate right?` : '';
    throw new Failure(`${recording.name}: ${explain(figures.refusal)}${hint}`);
  }
  return resultOf(core, recording, options, gravity, figures, unit);
}

function resultOf(
  core: Core,
  recording: Recording,
  options: SessionOptions,
  gravity: number,
  figures: MultiposeFigures,
  unit: AcquireAnswer,
): MultiposeResult {
  const noise = figures.acquired.noise_density;
  const instability = figures.acquired.bias_instability;
  const found = triadResult(core, 'accelerometer', figures.accelerometer, noise.slice(0, 3), instability.slice(0, 3));
  const accelerometer = options.faces ? found : inOwnAxes(found);
  if (figures.non_linearity && isBeyondSensors(figures.non_linearity[0])) accelerometer.objections.push(table.notLinear);
  const gyroscope =
    figures.gyroscope === null
      ? undefined
      : triadResult(core, 'gyroscope', figures.gyroscope.calibration, noise.slice(3), instability.slice(3));
  const stated = recording.hasGyroscope ? statedRate(core, recording, options.read.rate) : undefined;
  if (gyroscope && figures.gyroscope) {
    gyroscope.objections.push(...contradictions(figures.gyroscope, stated, options.faces ?? false));
  }
  const triads = [accelerometer, ...(gyroscope ? [gyroscope] : [])];
  const isMet = triads.every((each) => each.widening <= table.largestWidening && each.objections.length === 0);
  const { time } = recording.samples;
  const result: MultiposeResult = {
    recording,
    options,
    gravity,
    figures,
    accelerometer,
    gyroscope,
    gyroscopeReason: !recording.hasGyroscope
      ? 'no gyroscope was read'
      : figures.gyroscope_refusal ? explain(figures.gyroscope_refusal) : '',
    verdict:
      figures.gyroscope?.implausible_scale || !isMet ? 'model not met' : gyroscope ? 'calibrated' : 'partly calibrated',
    duration: time[time.length - 1] - time[0],
    temperature: unit.acquired.temperature,
    directions: new Set(figures.poses.direction).size,
    lengths: {
      before: rootMeanSquare(figures.poses.before),
      after: rootMeanSquare(figures.poses.after),
      heldOut: rootMeanSquare(figures.poses.held_out),
    },
    angles: {
      before: rootMeanSquare(figures.gyroscope?.angles_before ?? []),
      after: rootMeanSquare(figures.gyroscope?.angles_after ?? []),
    },
    warnings: [],
  };
  const aboutRate = stated && isAWarning(stated, gyroscope !== undefined) ? [statedRateWords(stated)] : [];
  result.warnings = [...warnings(result, unit), ...aboutRate];
  return result;
}

/** The case frame is that of the accelerometer's own axes: no equipment shows how it is mounted. */
function inOwnAxes(found: TriadResult): TriadResult {
  return {
    ...found,
    parameters: found.parameters.map((each) =>
      each.name.startsWith('mounting') ? hidden(each.name, each.unit, table.ownAxes) : each,
    ),
    unobservable: [`mounting: ${table.ownAxes}`],
  };
}

function refuseOddStep(recording: Recording): void {
  const step = usualStep(recording.samples.time);
  if (isImuStep(step)) return;
  throw new Failure(
    `${recording.name}: a sample every ${general(step, 6)} s, ${general(1 / step, 4)} Hz, is none of an IMU; give the unit ` +
      'of its time with --time-unit',
  );
}

/** Cuts the recording into rests and turns, and refuses what cannot serve. */
function acquired(core: Core, recording: Recording, gravity: number, isRaw: boolean): AcquireAnswer {
  const { name, hasGyroscope } = recording;
  const answer = acquire(core, recording);
  const refuse = (problem: string | undefined) => {
    if (problem) throw new Failure(`${name}: ${problem}`);
  };
  refuse(takeTurns(answer));
  refuse(damaged(answer, recording, isRaw));
  const unit = answer.acquired;
  if (isRaw || unit.rest_times.length === 0) return answer;
  refuse(misreadForce(unit, gravity));
  if (hasGyroscope) refuse(misreadRate(unit));
  return answer;
}

function damaged({ acquired: unit, stuck }: AcquireAnswer, recording: Recording, isRaw: boolean): string | undefined {
  const { samples, hasGyroscope } = recording;
  if (unit.samples + unit.not_finite === 0) return 'holds no samples; record again';
  const faults = isRaw ? [] : [...stuck, ...recordedFaults(unit.faults, recording)];
  const dead = deadChannel(faults, logTime(recording));
  if (dead) return dead;
  if (hasAxisTwice(samples.force)) return 'two axes of the accelerometer read the same; check the columns';
  if (hasGyroscope && hasAxisTwice(samples.rate)) return 'two axes of the gyroscope read the same; check the columns';
  return undefined;
}

const [COMPARED, FEWEST_COMPARED, FEWEST_DIFFERENT] = [1000, 100, 10];

/** Tests whether two axes read the same to the bit. */
function hasAxisTwice(rows: Rows): boolean {
  const count = Math.min(COMPARED, rows.length / 3);
  if (count < FEWEST_COMPARED) return false;
  const axes = [0, 1, 2].map((axis) => Array.from({ length: count }, (_, k) => rows[3 * k + axis]));
  return [[0, 1], [0, 2], [1, 2]].some(
    ([i, j]) => new Set(axes[i]).size >= FEWEST_DIFFERENT && axes[i].every((value, k) => value === axes[j][k]),
  );
}

function misreadForce(unit: AcquiredFigures, gravity: number): string | undefined {
  const length = lengthOfGravity(unit.rest_specific_force);
  const ratio = length / gravity;
  const limit = checks.largestGravityRatio;
  if (ratio > 1 / limit && ratio < limit) return undefined;
  const seen = `accelerometer reads ${general(length, 4)} m/s^2 at rest, gravity is ${general(gravity, 4)}`;
  const raw = '; or take readings for counts, with --raw';
  if (ratio < checks.noGravityRatio) return `${seen}: ${checks.withoutGravity}${raw}`;
  const isNear = (value: number) => Math.abs(Math.log(value)) < Math.log(limit);
  if (isNear(ratio * tables.units.gravity)) return `${seen}: g were taken for m/s^2; give --accelerometer-unit g${raw}`;
  if (isNear(ratio / tables.units.gravity)) return `${seen}: m/s^2 were taken for g; give --accelerometer-unit m/s^2${raw}`;
  return `${seen}: the unit is not known; give its size with --accelerometer-scale${raw}`;
}

function misreadRate(unit: AcquiredFigures): string | undefined {
  const [word, figure, fit] = unit.consistency;
  if (word === 'scaled') {
    const [one, other, far] = figure > 1 ? ['deg/s', 'rad/s', 'far'] : ['rad/s', 'deg/s', 'little'];
    return `gyroscope turns gravity 57.3 times too ${far}: ${one} were taken for ${other}; give --gyroscope-unit ${one}`;
  }
  if (word !== 'permuted') return undefined;
  const isInOrder = fit.every(([index], row) => index === row);
  const order = fit.map(([index, sign]) => `${sign < 0 ? '-' : ''}${'xyz'[index]}`).join(',');
  if (isInOrder && fit.every(([, sign]) => sign < 0)) {
    return (
      'gyroscope turns the wrong way about every axis: the axes are left-handed (two are exchanged, or one has its sign ' +
      'turned); give --axes x,y,-z'
    );
  }
  if (isInOrder) {
    const signs = fit.map(([, sign]) => fixed(sign, 0)).join(',');
    return `gyroscope and accelerometer have opposite signs: the gyroscope fits as ${order}; give --gyroscope-scale ${signs}`;
  }
  // No option of the command line mends it, so it is no unit that was misread.
  return undefined;
}

function isBeyondSensors([values, sigmas]: number[][]): boolean {
  return values.some((value, k) => tables.units.gravity * (Math.abs(value) - 2 * sigmas[k]) > table.largestNonLinearity);
}

function* warnings(result: MultiposeResult, unit: AcquireAnswer): Generator<string> {
  const { recording, figures, options } = result;
  const time = logTime(recording);
  if (figures.nominal_scale === null) {
    yield* notices(recording, unit, figures.acquired, result.duration);
  } else {
    yield* stoodStill(unit, time);
    const [force, rate] = figures.nominal_scale;
    const gyroscope = figures.gyroscope ? ` --gyroscope-scale ${general(1 / rate)} --gyroscope-unit rad/s` : '';
    yield 'readings are counts, and the calibration holds for logs read with --accelerometer-scale ' +
      `${general(1 / force)} --accelerometer-unit m/s^2${gyroscope}`;
  }
  if (!options.faces && result.directions - 9 < table.fewToCheck) {
    yield `${result.directions} orientations for nine unknowns: hardly anything checks the fit; 15 to 20 are good`;
  }
  if (figures.non_linearity) yield aboutNonLinearity(figures.non_linearity);
  yield* aboutPoses(result);
  const scale = figures.gyroscope?.implausible_scale;
  if (scale) {
    const rate = figures.acquired.samples / Math.max(result.duration, 1e-9);
    yield filled(table.noSensorHas, { scale, probable: rate * scale, rate });
  }
  const rejected = figures.acquired.rejected_rests;
  for (const [first, last, tremor] of figures.left_out) {
    if (rejected.some(([from, to]) => from < last && first < to)) continue;
    yield `${time.span(first, last)} s is not used: ${tremorWords(tremor) || 'shorter than a rest, without the ends'}`;
  }
  if (result.gyroscopeReason) yield result.gyroscopeReason;
  yield* aboutTheGyroscope(result);
  for (const triad of [result.accelerometer, result.gyroscope]) {
    if (!triad) continue;
    yield* triad.objections;
    if (triad.widening > 1) {
      yield `${triad.triad}: residuals are ${fixed(triad.widening, 1)} times what noise explains; its sigmas include that`;
    }
  }
}

function aboutNonLinearity([square, magnitude]: [number[][], number[][]]): string {
  const bySquare = eachAxis(square, 1e6 * tables.units.gravity);
  // A term by the magnitude is half of what the scales of both signs differ by.
  const bySign = eachAxis(magnitude, 2e6);
  return (
    `the accelerometer is not linear: by the square of the force it reads ${bySquare} ug/g^2 more, and scales of both ` +
    `signs differ by ${bySign} ppm; bias and scale are found beside that, which no correction takes off`
  );
}

function eachAxis([values, sigmas]: number[][], factor: number): string {
  const each = values.map(
    (value, axis) => `${'xyz'[axis]} ${withSign(factor * value, 2)} ± ${general(factor * sigmas[axis], 1)}`,
  );
  return each.join(', ');
}

function* aboutPoses({ figures, options }: MultiposeResult): Generator<string> {
  const places = (test: (k: number) => boolean) =>
    figures.poses.weight.map((_, k) => k).filter(test).map((k) => k + 1).join(', ');
  const outliers = places((k) => figures.poses.weight[k] < table.standsOut);
  if (outliers) yield `rest ${outliers}: deviates from all others and weighs less in the fit; touched?`;
  const decisive = places((k) => figures.poses.leverage[k] > table.decisive);
  if (decisive && !options.faces) {
    yield `rest ${decisive}: no other rest shows the same, so nothing checks it; add poses near it`;
  }
}

function* aboutTheGyroscope(result: MultiposeResult): Generator<string> {
  const found = result.figures.gyroscope;
  if (found === null) return;
  const degrees = (angle: number) => general((angle * 180) / Math.PI, 2);
  if (found.with_g_sensitivity !== null) {
    yield "the gyroscope's bias depends on how the unit is held: with --g-sensitivity gravity would be turned to " +
      `${degrees(found.with_g_sensitivity)} deg, now ${degrees(result.angles.after)} deg`;
  }
  if (found.bias_excess > 0) {
    yield `the gyroscope's bias varies by ${general(found.bias_excess, 2)} rad/s from rest to rest, more than noise ` +
      'explains; its sigmas include that';
  }
  if (found.turn_excess > 0) {
    yield `turns are off by ${degrees(found.turn_excess)} deg beyond noise; the sigmas include that`;
  }
}
