/** Layout of a text log: delimiter, names, and the first row of numbers. */

import tables from 'tables';
import { Failure } from '../failure';
import { countOf, quoted } from '../printed';
import { recognise } from './columns';
import { findUnit, guessAccelerometerUnit, restNorm } from './units';

const table = tables.text;
const BLANKS = ' ';
const TIME_STAMP = new RegExp(`^${table.timeStamp}`);

/** Layout by which a table is read. */
export interface TextLayout {
  delimiter: string;
  names: string[];
  /** Number of lines before the first row of numbers. */
  linesBefore: number;
  firstRow: string[];
  decimalPoint: string;
  preamble: Map<string, string>;
  notices: string[];
  quoted: boolean;
}

/** Text of a log. */
export interface LogText {
  /** Lines without their ends. */
  lines: string[];
  /** Lines of its beginning, by which its layout is found. */
  head: string[];
  bytes: number;
  isWhole: boolean;
}

/** Decodes a log: UTF-8, UTF-16 with its mark, or as Windows writes it in the west. */
export function logText(bytes: Uint8Array, file: string): LogText {
  const text = decoded(bytes);
  refuseOtherThanText(text, file);
  const lines = text.split(/\r\n|\n/);
  if (lines.at(-1) === '') lines.pop();
  const isWhole = text.length <= table.headBytes;
  const cut = isWhole ? lines.length : text.slice(0, table.headBytes).split(/\r\n|\n/).length - 1;
  return { lines, head: lines.slice(0, Math.max(1, cut)), bytes: bytes.length, isWhole };
}

function decoded(bytes: Uint8Array): string {
  if (bytes[0] === 0xff && bytes[1] === 0xfe) return new TextDecoder('utf-16le').decode(bytes);
  if (bytes[0] === 0xfe && bytes[1] === 0xff) return new TextDecoder('utf-16be').decode(bytes);
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder('windows-1252').decode(bytes);
  }
}

function refuseOtherThanText(text: string, file: string): void {
  const head = text.slice(0, table.headBytes);
  const odd = head.replaceAll(/[^\u0000-\u0008\u000b\u000e-\u001f]/g, '').length;
  if (odd > Math.max(4, head.length / 100)) {
    throw new Failure(`${file}: is no text; this page reads tables of text (CSV, TSV), the tumble command other logs too`);
  }
  if (/^schema: tumble-/m.test(head)) throw new Failure(`${file}: is a file that Tumble wrote, not a log; give another file`);
  if (/^\s*[{[<]/.test(head)) {
    throw new Failure(`${file}: not a log but JSON or XML; expected a table with one sample per line`);
  }
}

/** Returns the fields of a line, without the blanks and quotes around them. */
export function splitLine(line: string, delimiter: string): string[] {
  if (delimiter === BLANKS) {
    const whole = line.trim();
    const words = whole === '' ? [] : whole.split(/\s+/);
    return whole.includes('"') ? words.map(unquoted) : words;
  }
  const parts = line.split(delimiter);
  return line.includes('"') ? parts.map((part) => unquoted(part.trim())) : parts.map((part) => part.trim());
}

function unquoted(field: string): string {
  return withoutEnd(field.replace(/^"+/, ''), '"');
}

const NUMBER = /^\s*[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?\s*$/;

/** Reads a number, with sign, fraction and exponent, or `nan` or `inf`; nothing for all else. */
export function numberOf(text: string, decimalPoint = '.'): number | undefined {
  const plain = decimalPoint === '.' ? text : text.replaceAll(decimalPoint, '.');
  if (NUMBER.test(plain)) return Number(plain);
  const word = plain.trim().toLowerCase().replace(/^[+-]/, '');
  if (word === 'nan') return NaN;
  if (word === 'inf' || word === 'infinity') return plain.trim().startsWith('-') ? -Infinity : Infinity;
  return undefined;
}

/** Finds delimiter, column names and first row of numbers. */
export function findLayout(log: LogText, file: string, isMapped: boolean): TextLayout {
  const preamble = new Map<string, string>();
  for (const [k, raw] of log.head.slice(0, table.linesSearched).entries()) {
    const text = raw.trim();
    const body = text.replace(/^[#%/]+/, '').trim();
    const delimiter = namesDelimiter(body);
    if (delimiter !== undefined) return named(file, log, k + 1, splitLine(body, delimiter), preamble);
    if (!/^[#%]/.test(text) && numbersDelimiter(text) !== undefined) {
      return unnamed(log, k + 1, isMapped, preamble);
    }
    const [key, value] = keyValue(body);
    if (key) preamble.set(key, value);
  }
  const shown = log.head.length ? `; line 1 reads ${quoted(log.head[0].trim())}` : '';
  throw new Failure(
    `${file}: not a log: found neither column names such as ax, ay, az, gx, gy, gz nor rows of numbers${shown}`,
  );
}

function isChannel(name: string): boolean {
  const quantity = recognise(name)?.quantity;
  return quantity === 'accelerometer' || quantity === 'gyroscope' || quantity === 'magnetometer';
}

function namesDelimiter(text: string): string | undefined {
  const known = (delimiter: string) => splitLine(text, delimiter).filter(isChannel).length;
  const best = largestBy(table.delimiters, known);
  const fields = splitLine(text, best).length;
  // Prose may hold a word or two that look like names; a row of names holds little else.
  const needed = best === BLANKS ? Math.floor((fields + 1) / 2) : 1;
  return fields > 1 && known(best) >= needed ? best : undefined;
}

function largestBy<T>(values: readonly T[], size: (value: T) => number): T {
  return values.reduce((best, value) => (size(value) > size(best) ? value : best));
}

/** Delimiter that splits a line into most numbers, at least two. */
export function numbersDelimiter(text: string): string | undefined {
  const numeric = table.delimiters.filter((delimiter) => {
    const parts = splitLine(text, delimiter);
    return parts.length > 1 && parts.every((part) => isNumber(part, decimalPointOf(text, delimiter)));
  });
  return numeric.length ? largestBy(numeric, (each) => splitLine(text, each).length) : undefined;
}

function decimalPointOf(text: string, delimiter: string): string {
  return delimiter !== ',' && text.includes(',') && !text.includes('.') ? ',' : '.';
}

function isNumber(text: string, decimalPoint = '.'): boolean {
  return text === '' || numberOf(text, decimalPoint) !== undefined;
}

/** Returns key and value of a line `key, value`; two empty texts of any other line. */
function keyValue(text: string): [string, string] {
  const first = text.search(/[,;:=\t]/);
  if (first < 0) return ['', ''];
  const key = text.slice(0, first).trim().toLowerCase();
  const rest = text.slice(first).trimStart();
  const [sign, behind] = /^[,;:=]/.test(rest) ? [rest[0], rest.slice(1)] : ['\t', rest];
  // A colon and a blank introduce one value, as Tumble writes it; other signs part cells of a table.
  const isOne = sign === ':' && /^\s/.test(behind);
  const value = withoutEnd(behind.trim(), ',;').trimEnd();
  return key && value && (isOne || !/[,;=\t]/.test(value)) ? [key, value] : ['', ''];
}

/** Cuts signs off the end of a text. A regular expression would try each run of them up to its end. */
function withoutEnd(text: string, signs: string): string {
  let end = text.length;
  while (end > 0 && signs.includes(text[end - 1])) end -= 1;
  return text.slice(0, end);
}

function named(file: string, log: LogText, number: number, names: string[], preamble: Map<string, string>): TextLayout {
  const full = log.head.slice(number, number + table.rowsSearched).filter((line) => line.trim());
  let whole = full.slice(0, table.rowsCompared);
  const skipped = log.head.slice(0, number - 1).filter((line) => !/^(#|%|\/\/)/.test(line)).length;
  const units = whole.length ? unitsBelow(whole[0], names) : [];
  let before = number;
  if (units.length) {
    before += 1;
    whole = whole.slice(1);
    names = names.map((name, k) => (units[k] && name && !/[\])]$/.test(name) ? `${name} [${units[k]}]` : name));
  }
  const rows = whole.map((line) => line.trim());
  if (rows.length === 0) throw new Failure(`${file}: line ${number} names columns, but no samples follow`);
  const row = soundest(rows, names.length);
  const delimiter = rowDelimiter(row, names.length);
  const distinct = refuseRepeated(file, number, names);
  if (endInDelimiter(whole, delimiter, distinct.length)) distinct.push(table.afterLast);
  return {
    delimiter,
    names: distinct,
    linesBefore: before,
    firstRow: splitLine(row, delimiter),
    decimalPoint: decimalPointOf(row, delimiter),
    preamble,
    notices: skipped ? [`skipped ${countOf('line', skipped)} before the column names`] : [],
    quoted: areQuoted(rows),
  };
}

/** Returns the units in the line below the names; none where it holds none. */
function unitsBelow(line: string, names: string[]): string[] {
  const units = splitLine(line, rowDelimiter(line, names.length)).map((unit) => unit.replaceAll(/[()]/g, ''));
  if (units.length !== names.length || units.some((unit) => numberOf(unit) !== undefined)) return [];
  const fits = units.some((unit, k) => {
    const column = recognise(names[k]);
    return column && findUnit(unit, column.quantity);
  });
  return fits ? units : [];
}

function endInDelimiter(rows: string[], delimiter: string, columns: number): boolean {
  if (delimiter === BLANKS) return false;
  const ended = rows.filter((row) => row.endsWith(delimiter) && row.split(delimiter).length === columns + 1);
  return 2 * ended.length > rows.length;
}

function soundest(rows: string[], columns: number): string {
  return (
    rows.find((row) => soundFields(row, columns) === columns) ?? largestBy(rows, (row) => soundFields(row, columns))
  );
}

function soundFields(row: string, columns: number): number {
  const delimiter = rowDelimiter(row, columns);
  return splitLine(row, delimiter).length === columns ? soundBy(row, delimiter) : -1;
}

function soundBy(row: string, delimiter: string): number {
  const point = decimalPointOf(row, delimiter);
  return splitLine(row, delimiter).filter((field) => isTimeStamp(field) || isNumber(field, point)).length;
}

function rowDelimiter(row: string, columns: number): string {
  const fitting = table.delimiters.filter((delimiter) => splitLine(row, delimiter).length === columns);
  if (fitting.length) return largestBy(fitting, (delimiter) => soundBy(row, delimiter));
  return largestBy(table.delimiters, (delimiter) => splitLine(row, delimiter).length);
}

function refuseRepeated(file: string, number: number, names: string[]): string[] {
  const met = new Set<string>();
  return names.map((name, place) => {
    if (!met.has(name)) {
      met.add(name);
      return name;
    }
    if (recognise(name)) throw new Failure(`${file}: line ${number} names column '${name}' twice; rename one of them`);
    return `${name}#${place + 1}`;
  });
}

function unnamed(
  log: LogText,
  number: number,
  isMapped: boolean,
  preamble: Map<string, string>,
): TextLayout {
  const whole = log.head.slice(number - 1).slice(0, table.rowsSearched).filter((line) => line.trim());
  const rows = whole.map((line) => line.trim());
  const [row, delimiter] = typicalRow(rows);
  const fields = splitLine(row, delimiter);
  let [names, notices] = namesFor(rows, delimiter, fields.length, isMapped);
  const header = number > 1 ? splitLine(log.head[number - 2].trim().replaceAll(/^[#%]+/g, ''), delimiter) : [];
  const titled = header.length === fields.length && !header.some((each) => isNumber(each));
  if (titled && !isMapped && number > 1) [names, notices] = [header, []];
  if (endInDelimiter(whole, delimiter, fields.length)) names = [...names, table.afterLast];
  return {
    delimiter,
    names,
    linesBefore: number - 1,
    firstRow: fields,
    decimalPoint: decimalPointOf(row, delimiter),
    preamble,
    notices,
    quoted: areQuoted(rows),
  };
}

/** Returns the first row as wide as most, and their delimiter: the very first may be torn. */
function typicalRow(rows: string[]): [string, string] {
  const numeric = rows.slice(0, table.rowsCompared).flatMap((row) => {
    const delimiter = numbersDelimiter(row);
    return delimiter === undefined ? [] : [{ row, delimiter, shape: `${delimiter}${splitLine(row, delimiter).length}` }];
  });
  const count = (shape: string) => numeric.filter((each) => each.shape === shape).length;
  const usual = largestBy(numeric, (each) => count(each.shape));
  return [usual.row, usual.delimiter];
}

function namesFor(
  rows: string[],
  delimiter: string,
  count: number,
  isMapped: boolean,
): [string[], string[]] {
  const known: Record<string, string[]> = table.plainNames;
  if (isMapped || !(count in known)) return [Array.from({ length: count }, (_, k) => String(k + 1)), []];
  const names = known[count];
  if (names.includes('time') && !increases(rows.map((row) => splitLine(row, delimiter)[0]))) {
    return [Array.from({ length: count }, (_, k) => String(k + 1)), []];
  }
  const assumed = 'no column names: assumed to be ';
  if (gyroscopeStandsFirst(rows, delimiter)) {
    const turned = [...names.slice(0, -6), ...names.slice(-3), ...names.slice(-6, -3)];
    return [turned, [`${assumed}${turned.join(', ')}, as only the last three read gravity`]];
  }
  return [names, [`${assumed}${names.join(', ')}`]];
}

function gyroscopeStandsFirst(rows: string[], delimiter: string): boolean {
  const read = rows
    .map((row) => splitLine(row, delimiter).slice(-6).map((field) => numberOf(field, decimalPointOf(row, delimiter))))
    .filter((row) => row.length === 6 && !row.includes(undefined)) as number[][];
  if (read.length === 0) return false;
  const unit = (first: number) =>
    guessAccelerometerUnit(restNorm(Float64Array.from(read.flatMap((row) => row.slice(first, first + 3)))));
  return unit(0) === undefined && unit(3) !== undefined;
}

/** Returns whether numbers hardly ever decrease, as times do. */
export function increases(texts: readonly string[]): boolean {
  const numbers = texts.map((text) => numberOf(text, ',')).filter((each): each is number => each !== undefined);
  const backwards = numbers.slice(1).filter((each, k) => numbers[k] > each).length;
  return backwards <= Math.floor(numbers.length / 20);
}

function areQuoted(rows: string[]): boolean {
  const compared = rows.slice(0, table.rowsCompared);
  return 2 * compared.filter((row) => row.includes('"')).length > compared.length;
}

/** Returns whether a field is a date and time such as `2024-05-01T12:00:00.25`. */
export function isTimeStamp(text: string): boolean {
  return TIME_STAMP.test(text);
}

/** Returns the first rows of a table, to be shown. */
export function firstRows(log: LogText, layout: TextLayout, count: number): string[][] {
  const lines = log.head.slice(layout.linesBefore).filter((line) => line.trim());
  return lines.slice(0, count).map((line) => splitLine(line, layout.delimiter));
}
