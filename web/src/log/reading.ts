/** Files of one log become samples of one unit, with what was found out about them. */

import tables from 'tables';
import type { Core } from '../core';
import { Failure } from '../failure';
import { countOf, filled, fixed, general, listed } from '../printed';
import { checked, type Samples } from './checks';
import { UnknownColumns, findImus, type ImuColumns } from './columns';
import { conversionFor, converted, perAxis, type Conversion, type RawSamples, type ReadOptions } from './conversion';
import { labelColumns, rowLabels, type RowLabels } from './labels';
import { readColumns, type Columns } from './rows';
import { findLayout, increases, logText, numbersDelimiter, numberOf, splitLine, type LogText, type TextLayout } from './text';
import { countsFrom1970, inCelsius, type Rows } from './units';

const CHUNK_SAMPLES = 1 << 15;
const [SMALLEST_BLOCK, LARGEST_BLOCK] = [1 << 16, 1 << 26];

/** A file that a person gave. */
export interface LogFile {
  name: string;
  bytes: Uint8Array;
}

/** Samples of one unit, and what is known of its log. */
export interface Recording {
  name: string;
  source: string;
  serial: string;
  samples: Samples;
  hasGyroscope: boolean;
  conversion: Conversion;
  notices: string[];
  /** Options that changed readings, as calibration files state them. */
  reading: Record<string, unknown>;
  paceSigma: number;
  stampSigma: number;
  /** Stamps of the log, s, where a rate is stated beside them. */
  stamps: Float64Array | undefined;
}

/** Says that a table holds several IMUs, and which. */
export class SeveralImus extends Failure {
  constructor(
    message: string,
    readonly names: string[],
  ) {
    super(message);
  }
}

interface Track {
  file: string;
  layout: TextLayout;
  raw: RawSamples;
  lines: Uint32Array;
  badLines: string[];
  columns: Pick<ImuColumns, 'units' | 'others' | 'unknown'>;
  rate: number | undefined;
  head: number;
  expected: number;
  notices: string[];
  isCorrected: string | undefined;
  imu: string;
}

/** Reads a log: one table, or two files of one triad each, named as imu_tk names them. */
export function readLog(core: Core, files: readonly LogFile[], options: ReadOptions): Recording {
  const track = files.length === 2 ? openPair(files, options) : openTable(files[0], options);
  silenceGyroscope(track);
  if (track.raw.time === undefined && options.rate === undefined && track.rate === undefined) {
    throw new UnknownColumns(
      `${track.file}: no column is known to be time; columns found: ${listed(track.layout.names)}; name it with ` +
        '--columns time=NAME, or give the sample rate with --rate, in Hz',
    );
  }
  const { file, head } = track;
  const { conversion, samples, notices } = sampled(core, track, options);
  const remarks = [...track.notices, conversion.temperature.remark].filter(Boolean);
  const doubts = [conversion.time.doubt, conversion.gyroscope.doubt].filter(Boolean);
  const recording: Recording = {
    name: nameOf(track),
    source: track.imu ? `${file}:${track.imu}` : file,
    serial: (options.serial ?? '').trim() || (track.layout.preamble.get('serial') ?? ''),
    samples,
    hasGyroscope: track.raw.rate !== undefined,
    conversion,
    notices: remarks,
    reading: readingOf({ ...options, ...unitsOfCounts(conversion) }, track.isCorrected),
    paceSigma: 0,
    stampSigma: 0,
    stamps: stampsBesideRate(core, track, options),
  };
  const timed = options.rate === undefined && track.rate === undefined ? withSampleTimes(core, recording, head) : recording;
  return { ...timed, notices: [...timed.notices, ...doubts, ...notices] };
}

/** Returns the samples of a log in SI units, checked. */
function sampled(core: Core, track: Track, options: ReadOptions) {
  const { file, columns, rate, expected, head } = track;
  const conversion = conversionFor({ file, ...columns, rate, expected, head }, options, withRate(track, options));
  const converted = si(track, options, conversion);
  const isDated = track.raw.time !== undefined && options.rate === undefined && countsFrom1970(converted.time.subarray(0, head));
  const found = checked(core, converted, {
    file,
    lines: track.lines,
    isDated,
    hasGuessedRadians: conversion.gyroscope.doubt !== '',
    badLines: track.badLines,
  });
  return { conversion, ...found };
}

/** Reads the stamps of a log for which a rate is stated; nothing where it has none, or they cannot be read. */
function stampsBesideRate(core: Core, track: Track, options: ReadOptions): Float64Array | undefined {
  if (options.rate === undefined || track.raw.time === undefined) return undefined;
  try {
    return sampled(core, track, { ...options, rate: undefined, raw: undefined }).samples.time;
  } catch (error) {
    // Stamps that nobody can read are why a rate is stated.
    if (error instanceof Failure) return undefined;
    throw error;
  }
}

function nameOf(track: Track): string {
  const name = track.file.replace(/\.gz$/i, '');
  const stem = /^.+\.[^.]*$/.test(name) ? name.slice(0, name.lastIndexOf('.')) : name;
  const imu = track.imu.replaceAll(/^\/+|\/+$/g, '').replaceAll('/', '_');
  return imu ? `${stem}-${imu}` : stem;
}

/** Lists the names of columns, and the first rows, of a table. */
export function describeTable(file: LogFile): { layout: TextLayout; log: LogText } {
  const log = logText(file.bytes, file.name);
  try {
    return { layout: findLayout(log, file.name, false), log };
  } catch (error) {
    // A table whose names are none of ours is one all the same: its first line has them.
    if (!(error instanceof Failure)) throw error;
    const layout = layoutOfStrangers(log);
    if (layout === undefined) throw error;
    return { layout, log };
  }
}

/** Returns the layout of a table none of whose columns is known: a line of names before a row of numbers. */
function layoutOfStrangers(log: LogText): TextLayout | undefined {
  const at = log.head.findIndex((line) => numbersDelimiter(line.trim()) !== undefined);
  if (at < 0) return undefined;
  const delimiter = numbersDelimiter(log.head[at].trim())!;
  const firstRow = splitLine(log.head[at].trim(), delimiter);
  const before = at > 0 ? splitLine(log.head[at - 1].trim().replace(/^[#%]+/, ''), delimiter) : [];
  const names = before.length === firstRow.length ? before : firstRow.map((_, k) => String(k + 1));
  const unique = new Set(names).size === names.length ? names : names.map((name, k) => `${name}#${k + 1}`);
  return {
    delimiter, names: unique, linesBefore: at, firstRow, decimalPoint: '.', preamble: new Map(), notices: [], quoted: false,
  };
}

function openTable(file: LogFile, options: ReadOptions): Track {
  const stated = options.columns ?? {};
  const log = logText(file.bytes, file.name);
  const isMapped = Object.keys(stated).length > 0;
  const layout = isMapped ? describeTable(file).layout : findLayout(log, file.name, false);
  const imus = findImus(layout.names, file.name, stated);
  const read = (imu: ImuColumns): Columns => {
    const names = [imu.time, imu.temperature, ...(imu.accelerometer ?? []), ...(imu.gyroscope ?? [])];
    const present = [...new Set(names.filter((name): name is string => name !== undefined))];
    return readColumns(log, layout, present, file.name, options.skipBadLines ?? false);
  };
  const named = namedImus(imus, log, layout, read, Object.values(stated));
  const wanted = options.imu ?? (named.size === 1 ? [...named.keys()][0] : undefined);
  if (wanted === undefined || !named.has(wanted)) {
    const found = [...named.keys()];
    const column = [...named.values()].find((each) => each.labels)?.labels!.column;
    throw new SeveralImus(
      column === undefined
        ? `${file.name}: holds ${imus.size} IMUs: ${found.join(', ')}; choose one`
        : `${file.name}: column ${column} distinguishes ${found.length} IMUs: name one, as ${file.name}:${found[0]} ` +
          `(found: ${found.join(', ')}), or rename the column if it names no IMU`,
      found,
    );
  }
  const { prefix, labels, label } = named.get(wanted)!;
  const imu = imus.get(prefix)!;
  const all = read(imu);
  const columns = labels === undefined ? all : ofLabel(all, labels.rows, label);
  const { head, expected } = blocks(log, layout, all.lines.length);
  if (options.rate === undefined) refuseOtherStamps(file.name, log, layout, imu, options.skipBadLines ?? false);
  const isDate = imu.time !== undefined && /^\d{4}-\d{2}-\d{2}/.test(layout.firstRow[layout.names.indexOf(imu.time)] ?? '');
  const written: ImuColumns['units'] =
    layout.preamble.get('units') === 'SI'
      ? { accelerometer: 'm/s^2', gyroscope: 'rad/s', time: 's', temperature: 'degC' }
      : {};
  const ownRate = imu.time === undefined && options.rate === undefined ? statedRate(layout) : undefined;
  const corrected = layout.preamble.has('corrected') ? layout.preamble.get('corrected') || 'before it was read' : undefined;
  return {
    file: file.name,
    layout,
    raw: {
      time: imu.time === undefined ? undefined : columns.values.get(imu.time),
      force: three(columns, imu.accelerometer),
      rate: three(columns, imu.gyroscope),
      temperature: imu.temperature === undefined ? undefined : columns.values.get(imu.temperature),
    },
    lines: columns.lines,
    badLines: columns.badLines,
    columns: {
      units: { ...written, ...imu.units, ...(isDate ? { time: 'ns' } : {}) },
      others: imu.others,
      unknown: { ...imu.unknown, ...(isDate ? { time: undefined } : {}) },
    },
    rate: ownRate?.rate,
    head: labels === undefined ? head : Math.max(1, labels.rows.slice(0, head).filter((each) => each === label).length),
    expected: labels === undefined ? expected : columns.lines.length,
    notices: [...layout.notices, ...(ownRate ? [filled(tables.text.rateFromLine, ownRate)] : [])],
    isCorrected: corrected,
    imu: named.size === 1 ? '' : wanted,
  };
}

/** Refuses a gyroscope with stamps of its own, which the command brings to those of the accelerometer. */
function refuseOtherStamps(file: string, log: LogText, layout: TextLayout, imu: ImuColumns, skipBadLines: boolean): void {
  const { time, rateTime } = imu;
  if (time === undefined || rateTime === undefined) return;
  const { values, lines } = readColumns(log, layout, [time, rateTime], file, skipBadLines);
  const [force, rate] = [values.get(time)!, values.get(rateTime)!];
  const at = force.findIndex((each, row) => !Object.is(each + 0, rate[row] + 0));
  if (at < 0) return;
  throw new Failure(
    `${file}: line ${lines[at]}: ${time} is ${general(force[at], 15)} and ${rateTime} ${general(rate[at], 15)}: ` +
      'bring the accelerometer to the stamps of the gyroscope with --interpolate',
  );
}

interface NamedImu {
  prefix: string;
  labels?: RowLabels;
  label: string;
}

/** Returns the IMUs of a table by name: by the prefix of columns, by the label of rows, or by both. */
function namedImus(
  imus: Map<string, ImuColumns>,
  log: LogText,
  layout: TextLayout,
  read: (imu: ImuColumns) => Columns,
  stated: readonly string[],
): Map<string, NamedImu> {
  const named = new Map<string, NamedImu>();
  for (const [prefix, imu] of imus) {
    const candidates = labelColumns(imu, layout.names, stated);
    const lines = candidates.length ? read(imu).lines : new Uint32Array();
    const labels = candidates.map((name) => rowLabels(log, layout, name, lines)).find(Boolean);
    if (labels === undefined) named.set(prefix, { prefix, label: '' });
    for (const label of labels?.names ?? []) named.set(prefix ? `${prefix}.${label}` : label, { prefix, labels, label });
  }
  return named;
}

function ofLabel(columns: Columns, rows: readonly string[], label: string): Columns {
  const mine = (_: number, row: number) => rows[row] === label;
  return {
    values: new Map([...columns.values].map(([name, values]) => [name, values.filter(mine)])),
    lines: columns.lines.filter(mine),
    badLines: columns.badLines,
  };
}

function three(columns: Columns, names: readonly string[] | undefined): Rows | undefined {
  if (names === undefined) return undefined;
  const axes = names.map((name) => columns.values.get(name)!);
  const rows = new Float64Array(3 * axes[0].length);
  for (let k = 0; k < axes[0].length; k++) {
    for (let axis = 0; axis < 3; axis++) rows[3 * k + axis] = axes[axis][k];
  }
  return rows;
}

function statedRate(layout: TextLayout): { rate: number; key: string } | undefined {
  for (const key of tables.text.rateKeys) {
    const rate = numberOf((layout.preamble.get(key) ?? '').toLowerCase().replace(/hz$/, ''));
    if (rate !== undefined && rate > 0 && Number.isFinite(rate)) return { rate, key };
  }
  return undefined;
}

/** Returns the rows of the first block, and those that the size of a file lets expect. */
function blocks(log: LogText, layout: TextLayout, rows: number): { head: number; expected: number } {
  const ending = 1;
  const lines = log.head.slice(layout.linesBefore);
  const rowBytes = lines.reduce((sum, line) => sum + line.length + ending, 0) / Math.max(1, lines.length);
  const before = log.lines.slice(0, layout.linesBefore).reduce((sum, line) => sum + line.length + ending, 0);
  const block = Math.trunc(Math.min(Math.max(rowBytes * CHUNK_SAMPLES, SMALLEST_BLOCK), LARGEST_BLOCK));
  let bytes = 0;
  let head = 0;
  for (let at = layout.linesBefore; at < log.lines.length && bytes + log.lines[at].length + ending <= block; at++) {
    bytes += log.lines[at].length + ending;
    if (log.lines[at].trim()) head += 1;
  }
  return { head: Math.min(Math.max(head, 1), rows), expected: Math.trunc((log.bytes - before) / rowBytes) };
}

const PARTNERS = [['accelerometer', 'gyroscope'], ['accel', 'gyro'], ['acc', 'gyro'], ['acc', 'gyr']];

/** Reads accelerometer and gyroscope from files of their own: time and three axes in each. */
function openPair(files: readonly LogFile[], options: ReadOptions): Track {
  const [first, second] = files;
  const words = (name: string): string[] => name.toLowerCase().match(/[a-z]+/g) ?? [];
  const pair = PARTNERS.map(([here, there]) =>
    words(first.name).includes(here) && words(second.name).includes(there)
      ? [first, second]
      : words(first.name).includes(there) && words(second.name).includes(here)
        ? [second, first]
        : undefined,
  ).find(Boolean);
  if (pair === undefined) {
    throw new Failure(
      `${first.name} and ${second.name}: are no pair of one log; give one file, or two whose names differ in acc and gyro`,
    );
  }
  const [force, rate] = pair.map((file) => triadFile(file, options));
  const rows = Math.min(force.time.length, rate.time.length);
  for (let k = 0; k < rows; k++) {
    if (force.time[k] !== rate.time[k]) {
      throw new Failure(
        `${pair[0].name}: line ${force.lines[k]}: time ${general(force.time[k], 15)} is ${general(rate.time[k], 15)} in ` +
          `${pair[1].name}; both files need the same times`,
      );
    }
  }
  if (force.time.length !== rate.time.length) {
    const [shorter, longer] = force.time.length < rate.time.length ? pair : [pair[1], pair[0]];
    throw new Failure(`${shorter.name}: ends before ${longer.name}; copy it again, or cut the longer file to the same rows`);
  }
  return {
    file: pair[0].name,
    layout: rate.layout,
    raw: { time: rate.time, force: force.rows, rate: rate.rows, temperature: undefined },
    lines: rate.lines,
    badLines: [],
    columns: { units: {}, others: {}, unknown: {} },
    rate: undefined,
    head: Math.min(force.head, rate.head),
    expected: rate.expected,
    notices: [`accelerometer from ${pair[0].name}, gyroscope from ${pair[1].name}`],
    isCorrected: undefined,
    imu: '',
  };
}

function triadFile(file: LogFile, options: ReadOptions) {
  const log = logText(file.bytes, file.name);
  const layout = findLayout(log, file.name, true);
  if (layout.names.length !== 4) {
    throw new Failure(`${file.name}: has ${layout.names.length} columns where time and three axes are needed`);
  }
  if (layout.names.some((name, place) => name !== String(place + 1))) {
    throw new Failure(
      `${file.name}: names its columns, which are read of one file alone; give one table with the columns of both`,
    );
  }
  const texts = log.head.slice(layout.linesBefore, -1).map((line) => splitLine(line, layout.delimiter));
  const time = ['1', '2', '3', '4'].find((_, place) => increases(texts.map((row) => row[place])));
  if (time === undefined) throw new Failure(`${file.name}: none of its four columns increases as time does`);
  const axes = ['1', '2', '3', '4'].filter((name) => name !== time);
  const columns = readColumns(log, layout, [time, ...axes], file.name, options.skipBadLines ?? false);
  return {
    layout,
    time: columns.values.get(time)!,
    rows: three(columns, axes)!,
    lines: columns.lines,
    ...blocks(log, layout, columns.lines.length),
  };
}

/** Leaves out a gyroscope that reads nothing in any sample. */
function silenceGyroscope(track: Track): void {
  const { rate } = track.raw;
  if (rate === undefined || rate.some((value) => value !== 0 && !Number.isNaN(value))) return;
  const seen = rate.some(Number.isFinite) ? 'is 0 in all samples' : 'holds no number';
  track.notices = [...track.notices, `gyroscope ${seen}, and is left out as not recorded`];
  track.raw = { ...track.raw, rate: undefined };
}

function withRate(track: Track, options: ReadOptions): RawSamples {
  return options.rate === undefined ? track.raw : { ...track.raw, time: undefined };
}

function si(track: Track, options: ReadOptions, conversion: Conversion): Samples {
  const { raw } = track;
  const force = raw.force!;
  const rate = options.rate ?? track.rate;
  const count = force.length / 3;
  // Division by 1e9 rounds once where multiplication by 1e-9 would round twice.
  const ticks = Math.round(1 / conversion.time.scale);
  const time =
    raw.time === undefined || options.rate !== undefined
      ? Float64Array.from({ length: count }, (_, k) => k / rate!)
      : ticks === 1 ? raw.time.slice() : raw.time.map((each) => each / ticks);
  const { name, isUsed } = conversion.temperature;
  return {
    time,
    force: converted(force, perAxis(options.accelerometerZero), conversion.accelerometer.perAxis),
    rate: raw.rate
      ? converted(raw.rate, perAxis(options.gyroscopeZero), conversion.gyroscope.perAxis)
      : new Float64Array(3 * count),
    temperature: raw.temperature && isUsed ? (name === 'degC' ? raw.temperature : inCelsius(raw.temperature, name)) : undefined,
  };
}

/** Returns the units of which scales state the counts: a log may state them. */
function unitsOfCounts({ accelerometer, gyroscope }: Conversion): ReadOptions {
  return {
    ...(accelerometer.per && { accelerometerUnit: accelerometer.per }),
    ...(gyroscope.per && { gyroscopeUnit: gyroscope.per }),
  };
}

/** Returns the reading of a log whose numbers are counts, so many per SI unit as a calibration assumes. */
export function readAsCounts(options: ReadOptions, counts: readonly [number, number | undefined], correction: unknown): Record<string, unknown> {
  // They have four digits, by which they are printed and typed.
  const [force, rate] = counts.map((each) => (each === undefined ? undefined : Number(general(each))));
  const found = {
    ...options,
    accelerometerScale: force,
    accelerometerUnit: 'm/s^2',
    gyroscopeScale: rate,
    gyroscopeUnit: rate === undefined ? undefined : 'rad/s',
    raw: true,
  };
  return readingOf(found, correction as string | undefined);
}

/** Returns the options that changed readings, in the order of calibration files. */
function readingOf(options: ReadOptions, correction: string | undefined): Record<string, unknown> {
  const found: Record<string, unknown> = { axes: 'x,y,z' };
  const values = {
    accelerometer_zero: options.accelerometerZero,
    gyroscope_zero: options.gyroscopeZero,
    accelerometer_scale: options.accelerometerScale,
    gyroscope_scale: options.gyroscopeScale,
  };
  for (const [name, value] of Object.entries(values)) {
    if (value !== undefined && perAxis(value).some((each) => each !== 0)) found[name] = Float64Array.from(perAxis(value));
  }
  if (options.accelerometerUnit) found.accelerometer_unit = options.accelerometerUnit;
  if (options.gyroscopeUnit) found.gyroscope_unit = options.gyroscopeUnit;
  if (options.raw) found.raw = true;
  if (correction !== undefined) found.correction = correction;
  return found;
}

interface SampleTimes {
  kept_sigma: number | null;
  times: number[];
  sampling: 'even' | 'stamped' | 'between' | 'unshown';
  share: [number, number] | null;
  interval: number;
  latest: number;
  burst: number;
  lost: number;
  sigma: number;
  rate_sigma: number;
}

/** Fits even times where stamps come late; exact stamps stay as they are. */
function withSampleTimes(core: Core, recording: Recording, head: number): Recording {
  const { samples } = recording;
  if (!core.ask<boolean>({ ask: 'late' }, [samples.time.slice(0, head)])) return recording;
  const fitted = core.ask<SampleTimes | { scatter_of_steps: number }>({ ask: 'sample-times' }, [samples.time, samples.force, samples.rate]);
  if ('scatter_of_steps' in fitted) {
    const remark = 'stamps scatter, and show no even sampling that they could be fitted to: taken as they are';
    return { ...recording, notices: [...recording.notices, remark], stampSigma: fitted.scatter_of_steps };
  }
  const late = `stamps are late by up to ${general(fitted.latest * 1e3, 2)} ms`;
  const isBurst = fitted.burst > 1;
  const kept = fitted.kept_sigma;
  if (kept !== null) {
    if (fitted.sampling !== 'between') return { ...recording, stampSigma: kept };
    const [share, sigma] = fitted.share ?? [NaN, NaN];
    const remark =
      `${late} against even sampling, of which the signal shows ${fixed(share, 2)} ± ${fixed(sigma, 2)} as real: the ` +
      'sensor samples neither evenly nor when it is stamped; times were left as they are, and angles of turns are widened ' +
      `by ${general(kept * 1e3, 1)} ms of their rate; stamp samples by the sensor's own clock`;
    return { ...recording, notices: [...recording.notices, remark], stampSigma: kept };
  }
  const bursts = isBurst ? ` (bursts of ${general(fitted.burst, 3)} samples)` : '';
  const lost =
    isBurst && fitted.lost
      ? `; nothing shows where in a burst ${countOf('sample', fitted.lost)} got lost: the times of its other samples may be ` +
        'wrong by as many periods; repeat the recording without losses'
      : '';
  const remark =
    `${late}${bursts}; times were fitted, sampling period ${general(fitted.interval * 1e3, 6)} ms, uncertainty ` +
    `${general(fitted.sigma * 1e3, 1)} ms and ${general(fitted.rate_sigma * 1e6, 1)} ppm of a span` +
    lost;
  return {
    ...recording,
    samples: { ...samples, time: Float64Array.from(fitted.times) },
    notices: [...recording.notices, remark],
    paceSigma: fitted.rate_sigma,
  };
}
