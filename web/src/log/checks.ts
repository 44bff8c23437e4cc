/** Requirements on every log: finite numbers that sensors can read, and time that advances. */

import tables from 'tables';
import type { Core } from '../core';
import { Failure } from '../failure';
import { countOf, fixed, general } from '../printed';
import { row, type Rows } from './units';

const limits = tables.units;
const shares = tables.checks;

/** Samples of one unit, SI. */
export interface Samples {
  time: Float64Array;
  force: Rows;
  /** Angular rate; zero where there is no gyroscope. */
  rate: Rows;
  temperature: Float64Array | undefined;
}

/** Returns the samples at places. */
export function select(samples: Samples, places: ArrayLike<number>): Samples {
  const three = (rows: Rows) => {
    const found = new Float64Array(3 * places.length);
    for (let k = 0; k < places.length; k++) {
      for (let axis = 0; axis < 3; axis++) found[3 * k + axis] = rows[3 * places[k] + axis];
    }
    return found;
  };
  const one = (values: Float64Array) => Float64Array.from({ length: places.length }, (_, k) => values[places[k]]);
  return {
    time: one(samples.time),
    force: three(samples.force),
    rate: three(samples.rate),
    temperature: samples.temperature && one(samples.temperature),
  };
}

interface About {
  file: string;
  lines: Uint32Array;
  isDated: boolean;
  hasGuessedRadians: boolean;
  badLines: string[];
}

/** Returns the samples that are readings, each time once, with notices on those that were left out. */
export function checked(core: Core, samples: Samples, about: About): { samples: Samples; notices: string[] } {
  const count = samples.time.length;
  const notices: string[] = [];
  refuseBadLines(about, count);
  if (count === 0) throw new Failure(`${about.file}: holds no samples`);
  let places = Array.from({ length: count }, (_, k) => k);
  if (isSound(samples, about)) {
    places = withPossible(core, samples, places, about, notices);
    return finished(places.length === count ? samples : select(samples, places), places, about, notices);
  }
  if (about.isDated) {
    const stamped = places.filter((k) => samples.time[k] !== 0);
    if (stamped.length < places.length) {
      notices.push(`left out ${countOf('sample', places.length - stamped.length)} with the stamp 0, which no driver had set`);
    }
    places = stamped;
  }
  places = withNumbers(samples, places, about, notices);
  refuseDegrees(samples, places, about);
  places = withPossible(core, samples, places, about, notices);
  refuseDisorder(samples, places, about);
  places = once(samples, places, about, notices);
  return finished(places.length === count ? samples : select(samples, places), places, about, notices);
}

function finished(kept: Samples, places: number[], about: About, notices: string[]): { samples: Samples; notices: string[] } {
  noteSpikes(kept, places, about, notices);
  if (about.badLines.length) notices.push(badLinesNotice(about.badLines));
  return { samples: { ...kept, temperature: kept.temperature && held(kept.temperature) }, notices };
}

function refuseBadLines(about: About, rows: number): void {
  const lines = rows + about.badLines.length;
  if (about.badLines.length > shares.shareOfBadLines * lines) {
    throw new Failure(
      `${about.file}: ${about.badLines.length} of ${lines} lines are bad, ${about.badLines[0]}; up to 1 % can be left ` +
        'out: repair the log',
    );
  }
}

function badLinesNotice(badLines: string[]): string {
  const more = badLines.length > 1 ? `, and ${badLines.length - 1} more` : '';
  return `left out ${countOf('line', badLines.length)} that cannot be read: ${badLines[0]}${more}`;
}

function withNumbers(samples: Samples, places: number[], about: About, notices: string[]): number[] {
  const counts = new Map<string, number>();
  const columns = ['time', ...['a', 'g'].flatMap((triad) => [...'xyz'].map((axis) => triad + axis))];
  const note = (name: string) => counts.set(name, (counts.get(name) ?? 0) + 1);
  const kept = places.filter((k) => {
    const bad = [
      ...(Number.isFinite(samples.time[k]) ? [] : ['time']),
      ...[...'xyz'].flatMap((axis, at) => (Number.isFinite(samples.force[3 * k + at]) ? [] : [`a${axis}`])),
      ...[...'xyz'].flatMap((axis, at) => (Number.isFinite(samples.rate[3 * k + at]) ? [] : [`g${axis}`])),
    ];
    bad.forEach(note);
    return bad.length === 0;
  });
  const left = places.length - kept.length;
  if (left > shares.shareWithoutNumber * samples.time.length) {
    const [name, found] = [...counts].reduce((most, each) => (each[1] > most[1] ? each : most));
    throw new Failure(
      `${about.file}: ${name} is no number in ${found} of ${samples.time.length} samples; up to 1 % would be left out, ` +
        'but this is a fault: repair or cut the log',
    );
  }
  if (left) {
    const channels = columns.filter((name) => counts.has(name)).map((name) => `${name} ${counts.get(name)}`).join(', ');
    notices.push(`left out ${countOf('sample', left)} without a number (${channels})`);
  }
  return kept;
}

function largest(rows: Rows, k: number): number {
  return Math.max(Math.abs(rows[3 * k]), Math.abs(rows[3 * k + 1]), Math.abs(rows[3 * k + 2]));
}

/** Returns the largest reading; NaN where one is no number. */
function largestOf(rows: Rows): number {
  let found = 0;
  for (let k = 0; k < rows.length; k++) found = Math.max(found, Math.abs(rows[k]));
  return found;
}

/** Tests whether nothing has to be left out: one pass where all that follows takes many. */
function isSound({ time, force, rate }: Samples, about: About): boolean {
  if (!(Math.max(largestOf(force), largestOf(rate)) <= limits.largestSi)) return false;
  if (about.hasGuessedRadians && largestOf(rate) > limits.impossibleRadians) return false;
  if (!(largestOf(time) <= limits.largestTime) || (about.isDated && time.includes(0))) return false;
  return time.every((each, k) => k === 0 || each > time[k - 1]);
}

/** Tests whether a reading is more than `least` and twice those beside it. */
function standsAlone(rows: Rows, places: number[], at: number, least: number): boolean {
  const size = (k: number) => largest(rows, places[k]);
  const before = at > 0 ? at - 1 : 1;
  const after = at + 1 < places.length ? at + 1 : places.length - 2;
  const own = size(at);
  if (!(own > least)) return false;
  return places.length < 2 || (0.5 * own > size(before) && 0.5 * own > size(after));
}

function refuseDegrees(samples: Samples, places: number[], about: About): void {
  if (!about.hasGuessedRadians) return;
  let fastest = 0;
  let when = -1;
  places.forEach((k, at) => {
    const size = largest(samples.rate, k);
    const isFast = size > limits.impossibleRadians && size < limits.largestSi && size > fastest;
    if (isFast && !standsAlone(samples.rate, places, at, limits.impossibleRadians)) [fastest, when] = [size, k];
  });
  if (when >= 0) {
    throw new Failure(
      `${about.file}: gyroscope was assumed to be in rad/s, as no unit is stated, but reads ${general(fastest, 6)} at ` +
        `${fixed(samples.time[when], 6)} s; give --gyroscope-unit (deg/s?)`,
    );
  }
}

function withPossible(core: Core, samples: Samples, places: number[], about: About, notices: string[]): number[] {
  let first = '';
  const sensed = places.filter((k, at) => {
    const impossible =
      Math.abs(samples.time[k]) > limits.largestTime
        ? `time reads ${general(samples.time[k], 6)} s`
        : largest(samples.force, k) > limits.largestSi
          ? reading('accelerometer', samples.force, k, 'm/s^2', samples.time[k])
          : largest(samples.rate, k) > limits.largestSi ||
              (about.hasGuessedRadians && standsAlone(samples.rate, places, at, limits.impossibleRadians))
            ? reading('gyroscope', samples.rate, k, 'rad/s', samples.time[k])
            : '';
    if (impossible) first = first || `${impossible} (line ${about.lines[k]})`;
    return !impossible;
  });
  const failed = failedReads(core, samples, sensed);
  const kept = sensed.filter((k) => !failed.has(k));
  if (failed.size) {
    const [k] = failed.keys();
    const [name, rows, unit] = failed.get(k) === 0 ? (['accelerometer', samples.force, 'm/s^2'] as const) : (['gyroscope', samples.rate, 'rad/s'] as const);
    first = first || `${reading(name, rows, k, unit, samples.time[k])} (line ${about.lines[k]})`;
  }
  const left = places.length - kept.length;
  if (left > shares.shareWithoutNumber * samples.time.length) {
    throw new Failure(
      `${about.file}: ${left} of ${samples.time.length} samples are what no sensor reads: ${first}; up to 1 % would be ` +
        'left out, but this is a fault: check columns and units, or repair the log',
    );
  }
  const more = left > 1 ? `, and ${left - 1} more` : '';
  if (left) notices.push(`left out ${countOf('sample', left)} that no sensor reads: ${first}${more}`);
  return kept;
}

/** Returns the samples of which a driver could read none and gave zero, in order, with the place of the triad. */
function failedReads(core: Core, samples: Samples, places: number[]): Map<number, number> {
  const kept = places.length === samples.time.length ? samples : select(samples, places);
  const found = new Map<number, number>();
  [kept.force, kept.rate].forEach((rows, triad) => {
    for (const row of core.ask<number[]>({ ask: 'failed-reads' }, [rows])) {
      if (!found.has(places[row])) found.set(places[row], triad);
    }
  });
  return new Map([...found].sort(([one], [other]) => one - other));
}

/** Notes readings that are in the range of sensors, but not in that of the samples beside them. */
function noteSpikes(samples: Samples, places: number[], about: About, notices: string[]): void {
  const found: { at: number; seen: string }[] = [];
  const all = Array.from(samples.time, (_, k) => k);
  if (all.length < shares.fewestForSpikes) return;
  for (const [name, rows, unit, least] of [
    ['accelerometer', samples.force, 'm/s^2', shares.smallestSpike.accelerometer],
    ['gyroscope', samples.rate, 'rad/s', shares.smallestSpike.gyroscope],
  ] as const) {
    const usual = Math.sqrt(rows.reduce((sum, value) => sum + value * value, 0) / rows.length);
    const limit = Math.max(least, shares.spike * usual);
    if (!(largestOf(rows) > limit)) continue;
    for (const at of all) {
      if (!standsAlone(rows, all, at, limit)) continue;
      found.push({ at, seen: `${reading(name, rows, at, unit, samples.time[at])} (line ${about.lines[places[at]]})` });
    }
  }
  if (found.length === 0) return;
  const [first] = found.sort((one, other) => one.at - other.at);
  const more = found.length > 1 ? `, and ${found.length - 1} more` : '';
  notices.push(
    `${countOf('sample', found.length)} far from those before and after, garbled or knocked: ${first.seen}${more}`,
  );
}

function reading(name: string, rows: Rows, k: number, unit: string, time: number): string {
  const values = row(rows, k);
  const sizes = values.map(Math.abs);
  const axis = sizes.indexOf(Math.max(...sizes));
  return `${name} ${'xyz'[axis]} reads ${general(values[axis], 6)} ${unit} at ${fixed(time, 6)} s`;
}

function refuseDisorder(samples: Samples, places: number[], about: About): void {
  const at = places.findIndex((k, place) => place > 0 && samples.time[k] < samples.time[places[place - 1]]);
  if (at < 0) return;
  const step = samples.time[places[at]] - samples.time[places[at - 1]];
  throw new Failure(
    `${about.file}: line ${about.lines[places[at]]}: time runs backwards by ${general(-step, 6)} s to ` +
      `${general(samples.time[places[at]], 9)} s; sort the log by time, or state its rate if its samples are in order`,
  );
}

function once(samples: Samples, places: number[], about: About, notices: string[]): number[] {
  let clashes = 0;
  const kept = places.filter((k, at) => {
    const before = places[at - 1];
    if (at === 0 || samples.time[k] !== samples.time[before]) return true;
    const same = [samples.force, samples.rate].every((rows) => row(rows, k).every((value, axis) => value === rows[3 * before + axis]));
    if (!same) clashes += 1;
    return false;
  });
  if (clashes > shares.shareOfClashes * samples.time.length) {
    throw new Failure(
      `${about.file}: ${clashes} of ${samples.time.length} samples share the time stamp of the one before but not its ` +
        'values: the clock of the log is too coarse; read it with --rate',
    );
  }
  if (kept.length < places.length) {
    notices.push(`left out ${countOf('sample', places.length - kept.length)} with the time stamp of the one before`);
  }
  return kept;
}

/** Fills gaps in temperature, which is often logged less often, with the value before. */
function held(values: Float64Array): Float64Array {
  let before = NaN;
  return values.map((value) => {
    if (!Number.isNaN(value)) before = value;
    return before;
  });
}
