/** Calibrations for other programs: names, limits and statements are those of the tables of the command. */

import tables from 'tables';
import { sha256 } from './multipose/calibration';
import { Failure } from './failure';
import type { MultiposeResult } from './multipose/procedure';
import type { TriadResult } from './multipose/triad';
import { escaped, exact, fixed, Float, general } from './printed';

const table = tables.exports;

export type TargetWord = keyof typeof table.targets;
export const TARGETS = Object.keys(table.targets) as TargetWord[];

/** Numbers that a format needs and no calibration holds. */
export interface ExportSettings {
  accelerometerId?: number;
  gyroscopeId?: number;
  countsPerG?: number;
}

/** A file for another program, and the parts of the calibration that it does not hold. */
export interface Exported {
  name: string;
  content: string;
  lost: string[];
  remarks: string[];
}

type Content = Record<string, unknown>;

/** Writes a calibration for another program; `content` is that of its file. */
export async function exported(
  result: MultiposeResult,
  content: Content,
  word: TargetWord,
  settings: ExportSettings = {},
): Promise<Exported> {
  const target = table.targets[word];
  const { name } = result.recording;
  const triads = [result.accelerometer, ...(result.gyroscope ? [result.gyroscope] : [])];
  const { lines, remarks } = await written(word, result, content, settings);
  const holds = target.holds as Record<string, string[]>;
  const lost = triads.flatMap((each) =>
    table.parts
      .filter((part) => !(holds[each.triad] ?? []).includes(part))
      .filter((part) => part !== 'mounting' || each.triad !== 'accelerometer')
      .map((part) => `${each.triad}: ${part}`),
  );
  const about = target.body
    ? `; the log of ${comment(name)} does not define its axes: they are taken for these, or give --set axes=...`
    : '';
  const statement = `axes: ${target.axesInWords}${about}`;
  return {
    name: `${name}.${word}${target.ending}`,
    content: withRemarks(lines, target.ending, [statement, ...doubts(result, content)]),
    lost,
    remarks: [...target.remarks, ...remarks],
  };
}

interface Written {
  lines: string[];
  remarks: string[];
}

async function written(word: TargetWord, result: MultiposeResult, content: Content, settings: ExportSettings): Promise<Written> {
  switch (word) {
    case 'c':
      return { lines: await cSource(result, content), remarks: [] };
    case 'ardupilot':
      return arduPilot(result);
    case 'px4':
      return { lines: px4(result, settings), remarks: [] };
    case 'betaflight':
      return { lines: betaflight(result, settings), remarks: [] };
  }
}

/** Prints a number so that single precision reads it back exactly. */
export function single(value: number): string {
  return general(Math.fround(value), 9);
}

function comment(text: string): string {
  const line = escapedForComment(text);
  return line.length <= 80 ? line : `${line.slice(0, 77)}...`;
}

function escapedForComment(text: string): string {
  return escaped(text) === text ? text : [...text].map((letter) => (escaped(letter) === letter ? letter : ' ')).join('');
}

const withinC = (line: string) =>
  line.replaceAll('\\', '/').replaceAll('??', '? ?').replaceAll('*/', '* /').replaceAll('/*', '/ *');

const HEAD = ['%', '---', '#', '//', '/*'];

/** Writes remarks behind the comments that a file begins with. */
function withRemarks(lines: string[], ending: string, remarks: string[]): string {
  const isC = ending === '.h';
  const notes = remarks.map((each) => escapedForComment(each).split(/\s+/).join(' '));
  const printed = notes.map((note) => (isC ? `/* ${withinC(note)} */` : `# ${note}`));
  const first = lines.findIndex((line) => !HEAD.some((mark) => line.startsWith(mark)));
  const place = first < 0 ? lines.length : first;
  return [...lines.slice(0, place), ...printed, ...lines.slice(place)].map((line) => `${line}\n`).join('');
}

/** Warns of a verdict that whoever uses the file has to know of, and of what the readings went through before. */
function doubts(result: MultiposeResult, content: Content): string[] {
  const { name } = result.recording;
  const reading = content.reading as Record<string, unknown>;
  const date = String(content.date).slice(0, 10);
  const found: string[] = [];
  if (result.verdict === 'model not met') {
    found.push(
      `the calibration ${name} has the verdict 'model not met' (multipose, ${date}): its errors are larger than its sigmas say`,
    );
  }
  const zeros = ['accelerometer_zero', 'gyroscope_zero'].filter((key) => key in reading);
  if (zeros.length) {
    const typed = zeros.map((key) => `--${key.replace('_', '-')} ${Array.from(reading[key] as Float64Array, (each) => general(each)).join(',')}`);
    found.push(`the calibration ${name} holds for readings that are changed as by ${typed.join(' ')}; change them alike`);
  }
  if (reading.raw) {
    const scales = ['accelerometer', 'gyroscope'].filter((triad) => `${triad}_scale` in reading);
    const typed = scales.map((triad) => {
      const [scale] = reading[`${triad}_scale`] as Float64Array;
      return `--${triad}-scale ${general(scale)} --${triad}-unit ${reading[`${triad}_unit`] as string}`;
    });
    found.push(`the calibration ${name} holds for counts that are read with ${typed.join(' ')}; what converts them otherwise needs another`);
  }
  if (reading.correction) {
    found.push(`the calibration ${name} holds on top of another correction (${reading.correction as string}), which the readings need first`);
  }
  return found;
}

function cFloat(value: number): string {
  const text = single(value);
  return /[.e]/.test(text) ? `${text}f` : `${text}.0f`;
}

async function cSource(result: MultiposeResult, content: Content): Promise<string[]> {
  const row = (values: readonly number[]) => `{${values.map(cFloat).join(', ')}}`;
  const triad = (found: TriadResult | undefined, name: string) => [
    `    .${name} = {`,
    `        .matrix = {${(found?.figures.M ?? [[1, 0, 0], [0, 1, 0], [0, 0, 1]]).map(row).join(', ')}},`,
    `        .bias = ${row(found?.figures.b ?? [0, 0, 0])},`,
    '    },',
  ];
  return [
    `/* Calibration of ${withinC(comment(result.recording.name))} by Tumble; hash ${await hash(content)}. */`,
    '#include "tumble.h"',
    '',
    'static const tumble_calibration calibration = {',
    ...triad(result.accelerometer, 'accelerometer'),
    ...triad(result.gyroscope, 'gyroscope'),
    '};',
  ];
}

/** Digest of a calibration: the same however its file is laid out. */
export async function hash(content: Content): Promise<string> {
  // A file without a magnetometer has the digest that it had in the version before.
  const text = canonical({ ...content, schema: 'tumble-calibration/2' });
  return sha256(new TextEncoder().encode(text));
}

function canonical(value: unknown): string {
  if (value instanceof Float) return number(value.value);
  if (ArrayBuffer.isView(value)) return `[${Array.from(value as Float64Array, number).join(',')}]`;
  if (Array.isArray(value)) return `[${value.map(canonical).join(',')}]`;
  if (value !== null && typeof value === 'object') {
    const items = Object.entries(value).filter(([, item]) => item !== undefined).sort(([one], [other]) => (one < other ? -1 : 1));
    return `{${items.map(([key, item]) => `${ascii(key)}:${canonical(item)}`).join(',')}}`;
  }
  return typeof value === 'string' ? ascii(value) : JSON.stringify(value);
}

const number = (value: number) => (Number.isNaN(value) ? 'null' : exact(value));

function ascii(text: string): string {
  return JSON.stringify(text).replaceAll(/[\u007f-\uffff]/g, (letter) =>
    letter === '\u007f' ? letter : `\\u${letter.charCodeAt(0).toString(16).padStart(4, '0')}`,
  );
}

const AXES = ['X', 'Y', 'Z'];
const triple = (name: string, values: readonly number[], line: (name: string, value: number) => string) =>
  values.map((value, axis) => line(name.replace('{}', AXES[axis]), value));

function arduPilot(result: MultiposeResult): Written {
  const limits = table.ardupilot;
  const { name } = result.recording;
  const { b, scale } = result.accelerometer.figures;
  const inverse = scale.map((each) => 1 / each);
  const largest = Math.max(...b.map(Math.abs));
  if (largest > limits.offsetLimit) {
    throw new Failure(
      `${name}: a bias of ${general(largest, 3)} m/s^2 is more than the ${general(limits.offsetLimit)} that ArduPilot takes; check the sensor`,
    );
  }
  const [low, high] = limits.scaleLimits;
  if (Math.min(...inverse) < low || Math.max(...inverse) > high) {
    const worst = inverse.reduce((most, each) => (Math.abs(each - 1) > Math.abs(most - 1) ? each : most));
    throw new Failure(
      `${name}: a scale of ${general(worst, 4)} is not within the ${low} to ${high} that ArduPilot takes; calibrate readings in m/s^2`,
    );
  }
  const line = (parameter: string, value: number) => `${parameter},${single(value)}`;
  const notZero = (values: readonly number[]) => (values.every((each) => each === 0) ? [limits.notZero, 0, 0] : values);
  const lines = [
    '# Calibration by Tumble for ArduPilot: NAME,VALUE',
    ...triple(limits.names.accelerometer.offset, notZero(b), line),
    ...triple(limits.names.accelerometer.scale, inverse, line),
  ];
  if (!result.gyroscope) return { lines, remarks: [] };
  return {
    lines: [...lines, ...triple(limits.names.gyroscope.offset, notZero(result.gyroscope.figures.b), line), 'INS_GYR_CAL,0'],
    remarks: ['INS_GYR_CAL,0 keeps ArduPilot from finding gyroscope biases anew at each start'],
  };
}

function px4(result: MultiposeResult, settings: ExportSettings): string[] {
  const { prefixes, types, scaleLimits, largestId } = table.px4;
  const line = (name: string, value: string | number, type: number) => `1\t1\t${name}\t${value}\t${type}`;
  const device = (id: number | undefined, triad: string) => {
    if (id !== undefined && Number.isInteger(id) && id > 0 && id <= largestId) return id;
    throw new Failure(`PX4 needs the device id of the ${triad}: a whole number from 1 to ${largestId}, as the vehicle has it`);
  };
  const numbers = (name: string, values: readonly number[]) =>
    triple(name, values, (parameter, value) => line(parameter, single(value), types.number));
  const { b, scale } = result.accelerometer.figures;
  const inverse = scale.map((each) => 1 / each);
  inverse.forEach((value, axis) => {
    const name = `${prefixes.accelerometer}${AXES[axis]}SCALE`;
    if (value >= scaleLimits[0] && value <= scaleLimits[1]) return;
    throw new Failure(
      `${result.recording.name}: ${name} would be ${general(value, 4)}, and PX4 takes ${scaleLimits[0]} to ` +
        `${fixed(scaleLimits[1], 1)}; calibrate readings in m/s^2`,
    );
  });
  const lines = [
    '# Calibration by Tumble for PX4: load it in QGroundControl, Parameters, Tools, Load from file.',
    '# Vehicle-Id\tComponent-Id\tName\tValue\tType',
    line(`${prefixes.accelerometer}ID`, device(settings.accelerometerId, 'accelerometer'), types.whole),
    ...numbers(`${prefixes.accelerometer}{}OFF`, b),
    ...numbers(`${prefixes.accelerometer}{}SCALE`, inverse),
  ];
  if (!result.gyroscope) return lines;
  return [
    ...lines,
    line(`${prefixes.gyroscope}ID`, device(settings.gyroscopeId, 'gyroscope'), types.whole),
    ...numbers(`${prefixes.gyroscope}{}OFF`, result.gyroscope.figures.b),
  ];
}

function betaflight(result: MultiposeResult, settings: ExportSettings): string[] {
  const perG = settings.countsPerG ?? table.betaflight.countsPerG;
  if (!(perG > 0 && Number.isFinite(perG))) throw new Failure('Betaflight needs the counts of 1 g: give a number above zero');
  const unit = tables.units.gravity / perG;
  const counts = result.accelerometer.figures.b.map((bias) => rounded(bias / unit));
  if (counts.some((count) => Math.abs(count) > table.betaflight.largest)) {
    throw new Failure(`${result.recording.name}: a bias of ${Math.max(...counts)} counts is none of a sensor`);
  }
  return [
    `# Calibration of ${comment(result.recording.name)} by Tumble`,
    `set acc_calibration = ${counts.join(',')},1`,
    'save',
  ];
}

/** Rounds halves to even numbers, as numpy does. */
function rounded(value: number): number {
  const below = Math.floor(value);
  if (value - below !== 0.5) return Math.round(value) + 0;
  return below % 2 === 0 ? below : below + 1;
}
