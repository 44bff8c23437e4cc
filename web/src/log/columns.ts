/** Which column of a table is which channel of which IMU. */

import tables from 'tables';
import { Failure } from '../failure';
import { listed } from '../printed';
import { pattern } from './pattern';
import { findUnit, unknownUnit, type Quantity } from './units';

const table = tables.columns;

interface Spelling {
  words: string[];
  pattern: RegExp;
}

const spellings = (rows: { words: string[]; pattern: string }[]): Spelling[] =>
  rows.map((each) => ({ words: each.words, pattern: pattern(each.pattern) }));

const TRIADS: [Quantity, Spelling[]][] = [
  ['accelerometer', spellings(table.triads.accelerometer)],
  ['gyroscope', spellings(table.triads.gyroscope)],
];
const MAGNETIC: [Quantity, Spelling[]][] = [['magnetometer', spellings(table.magnetic)]];
const SCALARS: [Quantity, Spelling[]][] = [
  ['time', spellings(table.scalars.time)],
  ['temperature', spellings(table.scalars.temperature)],
];
const BRACKETS = pattern(table.brackets);
const STATE = pattern(table.state);
const LEFT_OUT = pattern(table.leftOut);
const COUNTER = pattern(table.counter);

/** Meaning of the name of a column. */
export interface Column {
  quantity: Quantity;
  axis: number;
  imu: string;
  unit: string | undefined;
  /** Text that states a unit that is none of the quantity. */
  unknown?: string;
}

const IGNORED = new RegExp(`${table.ignored}|\\p{Cf}`, 'gu');

/** Returns a name as it is seen: composed, without letters that have no width. */
function seen(name: string): string {
  return name.replaceAll(IGNORED, '').normalize('NFC');
}

/** Reads the name of a column; nothing where it is none of ours. */
export function recognise(written: string): Column | undefined {
  const name = seen(written);
  if (name.length > table.longestName) return undefined;
  const bracketed = BRACKETS.exec(name);
  const whole = bracketed ? bracketed.groups!.name : name.trim();
  const bracket = bracketed ? described(bracketed.groups!.unit) : undefined;
  if (bracket !== undefined && whole === 'T' && table.degrees.includes(bracket.toLowerCase())) {
    return { quantity: 'temperature', axis: 0, imu: '', unit: 'degC' };
  }
  if (LEFT_OUT.test(whole)) return undefined;
  const state = STATE.exec(whole);
  const stem = state ? state.groups!.stem : whole;
  const raw = state && state.groups!.state !== 'CAL' ? ` ${state.groups!.state}` : '';
  for (const [quantity, rows] of [...TRIADS, ...MAGNETIC, ...SCALARS]) {
    const found = firstMatch(rows, stem);
    if (!found) continue;
    const axes: Record<string, number> = table.axis;
    const axis = found.groups!.axis === undefined ? 0 : axes[found.groups!.axis];
    const unknown = unknownUnit(bracket ?? '', quantity, isCertain(name));
    // Brackets that state no unit leave that of the name: `gx_dps (IMU1)`.
    const inName = unknown ? undefined : findUnit(found.groups!.unit ?? '', quantity);
    const unit = findUnit(bracket ?? '', quantity) ?? inName;
    return { quantity, axis, imu: prefix(stem, found) + raw, unit, unknown };
  }
  return undefined;
}

/** Returns whether what stands in the brackets behind a name is a unit: round ones may hold anything. */
function isCertain(name: string): boolean {
  return name.trimEnd().endsWith(']');
}

function described(bracket: string): string {
  const descriptors: Record<string, string> = table.descriptors;
  return descriptors[bracket.toLowerCase()] ?? bracket;
}

function firstMatch(rows: Spelling[], stem: string): RegExpExecArray | null {
  const name = stem.toLowerCase();
  const joined = name.replaceAll(' ', '_');
  for (const each of rows) {
    const found = each.words.some((word) => joined.includes(word)) ? each.pattern.exec(name) : null;
    if (found) return found;
  }
  return null;
}

/** Returns the words that distinguish sensors of one kind: those before the name, and its range. */
function prefix(stem: string, found: RegExpExecArray): string {
  const imu = found.groups!.imu;
  const range = found.groups!.range;
  // The prefix stands first; its letters are taken as they were written.
  const parts = [imu ? stem.slice(0, imu.length) : '', range ?? ''];
  return parts.filter(Boolean).join('_');
}

export type Channel = 'time' | 'ax' | 'ay' | 'az' | 'gx' | 'gy' | 'gz' | 'temperature';
export const CHANNELS: Channel[] = ['time', 'ax', 'ay', 'az', 'gx', 'gy', 'gz', 'temperature'];

/** Columns of one IMU, by name, with the units that their names state. */
export interface ImuColumns {
  accelerometer: string[] | undefined;
  gyroscope: string[] | undefined;
  time: string | undefined;
  /** Stamps of the gyroscope where they are others than those of the accelerometer. */
  rateTime?: string | undefined;
  temperature: string | undefined;
  units: Partial<Record<Quantity, string>>;
  /** Units that columns of the same sensor state as well. */
  others: Partial<Record<Quantity, string[]>>;
  /** Units that are stated and unknown, and the columns that state them. */
  unknown: Partial<Record<Quantity, UnknownUnit>>;
}

/** A text that stands where a unit stands, and names none that is known. */
export interface UnknownUnit {
  column: string;
  text: string;
}

/** Says that columns have to be named, and which there are. */
export class UnknownColumns extends Failure {}

type Recognised = Map<string, Column | undefined>;

/** Returns the columns of every IMU of a table, by prefix, with what a person states of them by channel. */
export function findImus(
  names: readonly string[],
  file: string,
  stated: Partial<Record<Channel, string>> = {},
): Map<string, ImuColumns> {
  const recognised: Recognised = new Map(names.map((name) => [name, recognise(name)]));
  addCounter(recognised);
  forgetOtherTriads(recognised, stated);
  const isStated = (['ax', 'ay', 'az', 'gx', 'gy', 'gz'] as const).some((key) => key in stated);
  const known = [...recognised.values()].filter(
    (column) => column && (column.quantity === 'accelerometer' || column.quantity === 'gyroscope'),
  );
  const prefixes = isStated ? [''] : [...new Set(known.map((column) => column!.imu))];
  const found = new Map<string, ImuColumns>();
  for (const each of prefixes) {
    const imu = imuColumns(each, recognised, stated);
    if (imu) found.set(each, imu);
  }
  if (found.size === 0) throw new UnknownColumns(withoutGravity(names, file) ?? incomplete(names, file));
  const whole = new Map([...found].filter(([, imu]) => imu.accelerometer && imu.gyroscope));
  const read = whole.size ? whole : withSharedGyroscope(found);
  refuseDoubled(read, file, recognised, stated);
  return read;
}

/** Takes columns that are stated for one triad, and named as of the other, for no columns of that one. */
function forgetOtherTriads(recognised: Recognised, stated: Partial<Record<Channel, string>>): void {
  const triads = [
    [['ax', 'ay', 'az'], 'gyroscope'],
    [['gx', 'gy', 'gz'], 'accelerometer'],
  ] as const;
  for (const [channels, other] of triads) {
    for (const channel of channels) {
      const name = stated[channel];
      if (name !== undefined && recognised.get(name)?.quantity === other) recognised.set(name, undefined);
    }
  }
}

/** Time column where no name states it: the only one with a unit of time behind it, as `mcu_us`. */
function addCounter(recognised: Recognised): void {
  if ([...recognised.values()].some((column) => column?.quantity === 'time')) return;
  const matches = [...recognised].flatMap(([name, column]) => {
    const found = column === undefined ? COUNTER.exec(seen(name).trim().toLowerCase()) : null;
    return found ? [[name, found.groups!.unit] as const] : [];
  });
  if (matches.length !== 1) return;
  const [[name, unit]] = matches;
  recognised.set(name, { quantity: 'time', axis: 0, imu: '', unit: findUnit(unit, 'time') });
}

function imuColumns(
  prefix: string,
  recognised: Recognised,
  stated: Partial<Record<Channel, string>>,
): ImuColumns | undefined {
  const place = (quantity: Quantity, axis: number, imu: string) =>
    [...recognised].find(
      ([, column]) => column?.quantity === quantity && column.axis === axis && column.imu === imu,
    )?.[0];
  const triad = (keys: readonly Channel[], quantity: Quantity) =>
    keys.map((key, axis) => stated[key] ?? place(quantity, axis, prefix));
  const shared = (key: Channel, quantity: Quantity) =>
    stated[key] ?? place(quantity, 0, prefix) ?? place(quantity, 0, '');
  const force = triad(['ax', 'ay', 'az'], 'accelerometer');
  const rate = triad(['gx', 'gy', 'gz'], 'gyroscope');
  const inPart = [force, rate].some((names) => names.includes(undefined) && names.some(Boolean));
  if (inPart || ![...force, ...rate].some(Boolean)) return undefined;
  const [time, rateTime] = stamps(prefix, recognised, stated, place('time', 0, prefix), place('time', 0, ''));
  const temperature = shared('temperature', 'temperature');
  const units: Partial<Record<Quantity, string>> = {};
  const named: [Quantity, (string | undefined)[]][] = [
    ['accelerometer', force], ['gyroscope', rate], ['time', [time]], ['temperature', [temperature]],
  ];
  const others: Partial<Record<Quantity, string[]>> = {};
  const unknown: ImuColumns['unknown'] = {};
  for (const [quantity, names] of named) {
    for (const column of names) {
      const text = column && unknownOf(column, quantity, recognised, Object.values(stated));
      if (text) unknown[quantity] ??= { column, text };
    }
    const found = names.map((name) => name && unitOf(name, quantity, recognised, Object.values(stated)));
    // A head may state the unit behind the last axis alone.
    const [unit, ...rest] = new Set(found.filter(Boolean) as string[]);
    if (unit) units[quantity] = unit;
    if (rest.length) others[quantity] = rest;
  }
  return {
    accelerometer: force[0] ? (force as string[]) : undefined,
    gyroscope: rate[0] ? (rate as string[]) : undefined,
    time,
    rateTime: force[0] && rate[0] ? rateTime : undefined,
    temperature,
    units,
    others,
    unknown,
  };
}

/** Returns a text without some letters at its ends. */
function stripped(text: string, letters: string): string {
  let [start, end] = [0, text.length];
  while (start < end && letters.includes(text[start])) start += 1;
  while (start < end && letters.includes(text[end - 1])) end -= 1;
  return text.slice(start, end);
}

/** Returns the stamps of an IMU, and those of its gyroscope where they are others. */
function stamps(
  prefix: string,
  recognised: Recognised,
  stated: Partial<Record<Channel, string>>,
  ofPrefix: string | undefined,
  plain: string | undefined,
): [string | undefined, string | undefined] {
  if (stated.time !== undefined) return [stated.time, undefined];
  const own = new Map<string, string | undefined>();
  const times = [...recognised].filter(([, column]) => column?.quantity === 'time');
  for (const [name, column] of times) {
    const imu = column!.imu;
    if (!imu.startsWith(prefix)) continue;
    const word = stripped(imu.slice(prefix.length), '_ ./:-').toLowerCase();
    const triad = Object.entries(table.triadWords).find(([, words]) => words.includes(word))?.[0];
    const isOfImu = prefix !== '' && word !== '' && /^[_ .\/:-]/.test(imu.slice(prefix.length)) && !table.otherWords.includes(word);
    if (triad && !own.has(triad)) own.set(triad, name);
    else if (!triad && isOfImu && !own.has('')) own.set('', name);
  }
  const only = times.length === 1 ? times[0][0] : undefined;
  const shared = (prefix ? ofPrefix : undefined) ?? own.get('') ?? ofPrefix ?? plain ?? only;
  const force = own.get('accelerometer') ?? shared ?? own.get('gyroscope');
  const rate = own.get('gyroscope') ?? shared ?? force;
  return [force, rate === force ? undefined : rate];
}

function unitOf(name: string, quantity: Quantity, recognised: Recognised, stated: string[]): string | undefined {
  const column = recognised.get(name);
  if (column?.unit && column.quantity === quantity) return column.unit;
  const bracketed = stated.includes(name) ? BRACKETS.exec(seen(name)) : null;
  return bracketed ? findUnit(bracketed.groups!.unit, quantity) : undefined;
}

function unknownOf(name: string, quantity: Quantity, recognised: Recognised, stated: string[]): string | undefined {
  const column = recognised.get(name);
  if (column?.quantity === quantity && (column.unit || column.unknown)) return column.unknown;
  const bracketed = stated.includes(name) ? BRACKETS.exec(seen(name)) : null;
  return bracketed ? unknownUnit(bracketed.groups!.unit, quantity, isCertain(name)) : undefined;
}

/** Pairs each accelerometer with the gyroscope whose name begins as its own does, or with the only one. */
function withSharedGyroscope(imus: Map<string, ImuColumns>): Map<string, ImuColumns> {
  const gyroscopes = [...imus].filter(([, imu]) => !imu.accelerometer);
  const pairs = new Map<string, ImuColumns>();
  for (const [name, imu] of [...imus].filter(([, each]) => !each.gyroscope)) {
    const related = gyroscopes.filter(([other]) => name.startsWith(other)).sort((a, b) => b[0].length - a[0].length);
    const partner = related[0] ?? gyroscopes[0];
    if (!partner || (!related.length && gyroscopes.length > 1)) return imus;
    const { gyroscope, time, units, others, unknown } = partner[1];
    pairs.set(name, {
      ...imu, gyroscope, time: imu.time ?? time,
      rateTime: imu.time === undefined || imu.time === time ? undefined : time,
      units: { ...units, ...imu.units }, others: { ...others, ...imu.others },
      unknown: { ...unknown, ...imu.unknown },
    });
  }
  if (pairs.size === 1) return new Map([['', [...pairs.values()][0]]]);
  return pairs.size ? pairs : imus;
}

function withoutGravity(names: readonly string[], file: string): string | undefined {
  const found = names.find((name) => LEFT_OUT.test(name));
  return found === undefined
    ? undefined
    : `${file}: ${found} is acceleration without gravity, which is no specific force: record the accelerometer ` +
        'with gravity (phyphox: Acceleration with g), or name its columns below';
}

function incomplete(names: readonly string[], file: string): string {
  return `${file}: no three columns are known to be an accelerometer; columns found: ${listed(names)}; name them below`;
}

/** Refuses two columns that may be one channel of an IMU, where nobody states which of them is. */
function refuseDoubled(
  imus: Map<string, ImuColumns>,
  file: string,
  recognised: Recognised,
  stated: Partial<Record<Channel, string>>,
): void {
  const alike = new Map<string, string[]>();
  for (const [name, column] of recognised) {
    if (!column || column.quantity === 'time' || column.quantity === 'magnetometer') continue;
    const key = `${channelOf(column)} ${column.imu}`;
    alike.set(key, [...(alike.get(key) ?? []), name]);
  }
  const read = new Set([...imus.values()].flatMap((imu) => [...(imu.accelerometer ?? []), ...(imu.gyroscope ?? []), imu.temperature]));
  for (const [key, found] of alike) {
    const channel = key.split(' ')[0] as Channel;
    if (found.length > 1 && !(channel in stated) && found.some((name) => read.has(name))) {
      throw new UnknownColumns(`${file}: ${listed(found)} may each be ${channel}; name one below`);
    }
  }
}

function channelOf(column: Column): Channel {
  if (column.quantity === 'temperature') return 'temperature';
  return `${column.quantity === 'accelerometer' ? 'a' : 'g'}${'xyz'[column.axis]}` as Channel;
}
