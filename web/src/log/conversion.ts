/** From the numbers of a log to SI units: what a person states, else what the log states, else what its head shows. */

import tables from 'tables';
import { Failure } from '../failure';
import { countOf, fixed, general } from '../printed';
import type { Channel, ImuColumns, UnknownUnit } from './columns';
import * as units from './units';
import type { Quantity, ResolvedUnit, Rows } from './units';

const table = tables.units;

/** One number for all three axes, or one for each. */
export type AxisValues = number | [number, number, number];

/** Facts that a person states of a log that does not state them itself. */
export interface ReadOptions {
  columns?: Partial<Record<Channel, string>>;
  imu?: string;
  accelerometerUnit?: string;
  gyroscopeUnit?: string;
  timeUnit?: string;
  accelerometerScale?: AxisValues;
  gyroscopeScale?: AxisValues;
  accelerometerZero?: AxisValues;
  gyroscopeZero?: AxisValues;
  rate?: number;
  /** Readings are counts of a scale that nobody knows. */
  raw?: boolean;
  skipBadLines?: boolean;
  serial?: string;
}

/** Numbers of one IMU in the units of its log. */
export interface RawSamples {
  time: Float64Array | undefined;
  force: Rows | undefined;
  rate: Rows | undefined;
  temperature: Float64Array | undefined;
}

/** Facts that a log states of itself. */
export interface Stating {
  file: string;
  units: ImuColumns['units'];
  others: ImuColumns['others'];
  unknown: ImuColumns['unknown'];
  rate: number | undefined;
  /** Rows that are expected, by the size of the file. */
  expected: number;
  /** Rows of the first block, which decides the units. */
  head: number;
}

/** Units of one log. */
export interface Conversion {
  accelerometer: ResolvedUnit & { perAxis: number[] };
  gyroscope: ResolvedUnit & { perAxis: number[] };
  time: ResolvedUnit;
  temperature: { name: string; isUsed: boolean; remark: string };
}

export function perAxis(value: AxisValues | undefined): [number, number, number] {
  return Array.isArray(value) ? value : [value ?? 0, value ?? 0, value ?? 0];
}

/** Decides the units of a log; refuses where no unit fits the values, two fit alike, or a stated one contradicts them. */
export function conversionFor(log: Stating, options: ReadOptions, samples: RawSamples): Conversion {
  const head = headOf(samples, log.head);
  const forceZero = perAxis(options.accelerometerZero);
  const rateZero = perAxis(options.gyroscopeZero);
  const accelerometer = accelerometerUnit(log, options, head, forceZero);
  const time = timeUnit(log, options, head);
  let rest: units.StillReadings | undefined;
  if (head.force && head.rate && !options.raw) {
    const rate = options.rate ?? log.rate;
    const interval = head.time ? units.usualStep(head.time) * time.scale : rate ? 1 / rate : NaN;
    const force = converted(head.force, forceZero, accelerometer.perAxis);
    if (units.isImuStep(interval)) rest = units.restIn(force, converted(head.rate, rateZero, [1, 1, 1]), interval);
  }
  const gyroscope = head.rate ? gyroscopeUnit(log, options, head.rate, rateZero, rest) : notRecorded();
  return { accelerometer, gyroscope, time, temperature: temperatureUnit(log, head.temperature) };
}

/** Takes a zero off readings, and multiplies them; a copy. */
export function converted(rows: Rows, zero: readonly number[], factor: readonly number[]): Rows {
  const found = rows.slice();
  const shifts = zero.some((each) => each !== 0);
  const stretches = factor.some((each) => each !== 1);
  for (let k = 0; k < found.length; k++) {
    if (shifts) found[k] -= zero[k % 3];
    if (stretches) found[k] *= factor[k % 3];
  }
  return found;
}

function headOf(samples: RawSamples, count: number): RawSamples {
  const credible = (rows: Rows | undefined) =>
    rows?.subarray(0, 3 * count).map((value) => (Math.abs(value) < table.largestReading ? value : NaN));
  return {
    time: samples.time?.subarray(0, count),
    force: credible(samples.force),
    rate: credible(samples.rate),
    temperature: samples.temperature?.subarray(0, count),
  };
}

function notRecorded(): ResolvedUnit & { perAxis: number[] } {
  return { name: 'none', scale: 1, reason: 'not recorded', doubt: '', perAxis: [1, 1, 1] };
}

const AS_NUMBERS = { name: 'counts', scale: 1, reason: 'option: readings as they stand', doubt: '', perAxis: [1, 1, 1] };

function resolved(quantity: Quantity, name: string, reason: string): ResolvedUnit & { perAxis: number[] } {
  const scale = units.valueOf(quantity, name);
  return { name, scale, reason, doubt: '', perAxis: [scale, scale, scale] };
}

function statedUnit(
  quantity: Quantity,
  log: Stating,
  option: string | undefined,
  scale?: AxisValues,
): { name: string; reason: string } | undefined {
  const unknown = log.unknown[quantity];
  const found = unknown?.text ?? log.units[quantity];
  if (option === undefined || option === '') {
    if (unknown) {
      if (scale === undefined) throw new Failure(`${log.file}: ${unknownSaid(quantity, unknown)}`);
      return undefined;
    }
    const others = log.others[quantity];
    if (found !== undefined && others) {
      throw new Failure(
        `${log.file}: columns of one sensor, the ${quantity}, are in several units: ${[found, ...others].join(', ')}; ` +
          `convert them to one, or state that of all with --${quantity}-unit`,
      );
    }
    return found === undefined ? undefined : { name: found, reason: 'column name' };
  }
  return { name: option, reason: found !== undefined && found !== option ? `option, log says ${found}` : 'option' };
}

/** Names the column and the text that state an unknown unit, and the options that state a known one. */
function unknownSaid(quantity: Quantity, found: UnknownUnit): string {
  const unit = `--${quantity}-unit (${Object.keys(table.values[quantity]).join(', ')})`;
  const scale = `--${quantity}-scale (counts per unit)`;
  let remedy = `state ${unit}, or ${scale}`;
  if (quantity === 'temperature') remedy = `it is not used; state ${unit}, or convert the column`;
  else if (quantity === 'time') remedy = `state ${unit} or --rate, or convert the column`;
  else if (units.statesCounts(found.text)) remedy = `give ${scale} and ${unit}`;
  return `column ${found.column} states ${found.text}, which is no known unit of ${quantity}: ${remedy}`;
}

function withCounts(quantity: Quantity, name: string | undefined, counts: AxisValues): ResolvedUnit & { perAxis: number[] } {
  const unit = name ?? Object.keys(table.values[quantity])[0];
  const scale = perAxis(counts).map((each) => units.valueOf(quantity, unit) / each);
  return { name: 'counts', scale: scale[0], reason: `option: counts per ${unit}`, doubt: '', per: unit, perAxis: scale };
}

function accelerometerUnit(log: Stating, options: ReadOptions, head: RawSamples, zero: number[]): ResolvedUnit & { perAxis: number[] } {
  if (!head.force) throw new Failure(`${log.file}: holds no accelerometer, without which nothing shows which way is up`);
  if (options.raw) return AS_NUMBERS;
  const stated = statedUnit('accelerometer', log, options.accelerometerUnit, options.accelerometerScale);
  if (options.accelerometerScale !== undefined) {
    const unit = withCounts('accelerometer', stated?.name, options.accelerometerScale);
    checkCounts(log, units.restNorm(converted(head.force, zero, unit.perAxis)));
    return unit;
  }
  const norm = units.restNorm(converted(head.force, zero, [1, 1, 1]));
  const likely = units.guessAccelerometerUnit(norm);
  if (stated === undefined) {
    if (likely === undefined) throw new Failure(noAccelerometerUnit(log, head.force, norm));
    return resolved('accelerometer', likely, `norm at rest is ${general(norm, 4)}`);
  }
  if (likely !== undefined && !units.isGravity(norm, stated.name)) {
    throw new Failure(
      `${log.file}: accelerometer is stated in ${stated.name} (${stated.reason}) but reads ${general(norm, 4)} at rest, ` +
        `as it would in ${likely}; read it with --accelerometer-unit ${likely}`,
    );
  }
  return resolved('accelerometer', stated.name, stated.reason);
}

function checkCounts(log: Stating, norm: number): void {
  if (norm / table.gravity > 0.5 && norm / table.gravity < 2) return;
  throw new Failure(
    `${log.file}: accelerometer reads ${general(norm, 4)} m/s^2 at rest with the scale given, not about 9.8; check ` +
      '--accelerometer-scale (counts per unit), --accelerometer-unit and --accelerometer-zero',
  );
}

function noAccelerometerUnit(log: Stating, head: Rows, norm: number): string {
  if (!head.some((value) => value !== 0 && !Number.isNaN(value))) {
    return `${log.file}: accelerometer reads 0 in its first ${head.length / 3} samples: it is dead`;
  }
  const read = `${log.file}: accelerometer reads ${general(norm, 6)} at rest, which is neither m/s^2, g nor mg`;
  const span = units.guessRange(norm);
  if (span === undefined) {
    return (
      `${read}; for raw counts give --accelerometer-scale (counts per unit) and --accelerometer-unit, else the unit`
    );
  }
  return (
    `${read}: it looks like raw counts of 16 bits, ${fixed(table.counts / span, 0)} a g, of a range of ` +
    `± ${fixed(span, 0)} g; give --counts ${fixed(span, 0)},250 where that of the gyroscope is ± 250 deg/s (or 500, ` +
    '1000, 2000), else --accelerometer-scale (counts per unit) and --accelerometer-unit'
  );
}

function gyroscopeUnit(
  log: Stating,
  options: ReadOptions,
  head: Rows,
  zero: number[],
  rest: units.StillReadings | undefined,
): ResolvedUnit & { perAxis: number[] } {
  if (options.raw) return AS_NUMBERS;
  const stated = statedUnit('gyroscope', log, options.gyroscopeUnit, options.gyroscopeScale);
  if (options.gyroscopeScale !== undefined) return withCounts('gyroscope', stated?.name, options.gyroscopeScale);
  const readings = converted(head, zero, [1, 1, 1]);
  if (stated === undefined) {
    const smallest = units.smallestNorm(readings);
    const fastest = units.peak(readings);
    const likely = units.guessGyroscopeUnit(smallest, fastest, rest);
    if (likely === undefined) {
      throw new Failure(
        `${log.file}: gyroscope reads ${general(smallest)} to ${general(fastest)}, which is neither rad/s nor deg/s; ` +
          'for raw counts give --gyroscope-scale (counts per unit) and --gyroscope-unit, else the unit',
      );
    }
    const doubt =
      likely.reason === units.ASSUMED
        ? `the gyroscope is assumed to be in ${likely.name}: neither the log nor its readings show a unit; state it with --gyroscope-unit`
        : '';
    return { ...resolved('gyroscope', likely.name, likely.reason), doubt };
  }
  const likely = rest && stated.name in table.rateUnits ? units.rateUnitAtRest(rest) : undefined;
  if (rest && likely !== undefined && likely !== stated.name && !stated.reason.startsWith('option')) {
    throw new Failure(
      `${log.file}: gyroscope is stated in ${stated.name} (${stated.reason}) but reads ${general(rest.rate, 4)} across ` +
        `gravity while it stands still, with a noise of ${general(rest.noise, 2)} per sqrt(Hz), as it would in ${likely}; ` +
        `read it with --gyroscope-unit ${likely}`,
    );
  }
  return resolved('gyroscope', stated.name, stated.reason);
}

function timeUnit(log: Stating, options: ReadOptions, head: RawSamples): ResolvedUnit {
  const rate = options.rate ?? log.rate;
  if (options.rate !== undefined || head.time === undefined) {
    return { name: 's', scale: 1, reason: `sample number over ${general(rate ?? NaN)} Hz`, doubt: '' };
  }
  const stated = statedUnit('time', log, options.timeUnit);
  return stated === undefined ? guessedTime(log, head.time) : resolved('time', stated.name, stated.reason);
}

function guessedTime(log: Stating, time: Float64Array): ResolvedUnit {
  const step = units.usualStep(time);
  const guess = units.guessTimeUnit(time, step, general(step, 6), log.expected);
  const rateIn = (name: string) => `${general(1 / (step * units.valueOf('time', name)), 4)} Hz in ${name}`;
  const others = guess.others.map(rateIn).join(' and ');
  if (guess.isOpen) {
    throw new Failure(
      `${log.file}: time has no unit and advances by ${general(step, 6)} a sample, which is ${rateIn(guess.name)} or ` +
        `${others}; state its unit with --time-unit`,
    );
  }
  const doubt = guess.others.length
    ? `time is assumed to be in ${guess.name}: ${rateIn(guess.name)}, where it would be ${others}; state it with --time-unit`
    : '';
  return { name: guess.name, scale: units.valueOf('time', guess.name), reason: guess.reason, doubt };
}

function temperatureUnit(log: Stating, values: Float64Array | undefined): Conversion['temperature'] {
  const stated = log.units.temperature;
  const name = stated ?? 'degC';
  const unknown = values && log.unknown.temperature;
  if (unknown) return { name, isUsed: false, remark: unknownSaid('temperature', unknown) };
  if (values === undefined || units.possibleTemperature(values, name)) return { name, isUsed: true, remark: '' };
  const finite = values.filter(Number.isFinite);
  const seen = `temperature reads ${general(Math.min(...finite))} to ${general(Math.max(...finite))}`;
  if (stated === undefined && units.possibleTemperature(values, 'K')) {
    return { name: 'K', isUsed: true, remark: `${seen}, which is none of an IMU in degC: it is read in K` };
  }
  const said = stated ? `${stated}, which the log states` : 'degC or K';
  const remark =
    `${seen} in its first ${countOf('sample', values.length)}, which is none of an IMU in ${said}: it is not used; ` +
    'state its unit with --temperature-unit, or convert counts of a register to degC';
  return { name, isUsed: false, remark };
}
