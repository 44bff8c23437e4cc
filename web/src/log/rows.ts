/** Columns of a table as numbers: every line counts, and one that cannot be read is named. */

import tables from 'tables';
import { Failure } from '../failure';
import { countOf } from '../printed';
import { isTimeStamp, numberOf, splitLine, type LogText, type TextLayout } from './text';

const table = tables.text;
const NULLS = new Set(table.nulls);

/** Columns by name, NaN where a field is empty; `lines` has the line of each row, from 1. */
export interface Columns {
  values: Map<string, Float64Array>;
  lines: Uint32Array;
  badLines: string[];
}

/** Reads columns of all rows. */
export function readColumns(
  log: LogText,
  layout: TextLayout,
  names: readonly string[],
  file: string,
  skipBadLines: boolean,
): Columns {
  const places = names.map((name) => layout.names.indexOf(name));
  const dated = places.map((place) => isTimeStamp(layout.firstRow[place] ?? ''));
  const most = Math.max(0, log.lines.length - layout.linesBefore);
  const columns = names.map(() => new Float64Array(most));
  const lines = new Uint32Array(most);
  const badLines: string[] = [];
  let rows = 0;
  for (let at = layout.linesBefore; at < log.lines.length; at++) {
    const line = log.lines[at];
    if (line === '' || (layout.delimiter === ' ' && line.trim() === '')) continue;
    const fields = splitLine(line, layout.delimiter);
    const problem =
      problemOf(line, fields, layout, at + 1 === log.lines.length) ??
      readRow(fields, places, dated, layout, names, columns, rows, line);
    if (problem !== undefined) {
      if (!skipBadLines) {
        throw new Failure(
          `${file}: line ${at + 1} ${problem}; repair or delete that line, or leave such lines out with --skip-bad-lines`,
        );
      }
      badLines.push(`line ${at + 1} ${problem}`);
      continue;
    }
    lines[rows] = at + 1;
    rows += 1;
  }
  const values = new Map(names.map((name, k) => [name, columns[k].subarray(0, rows)]));
  return { values, lines: lines.subarray(0, rows), badLines };
}

function problemOf(line: string, fields: string[], layout: TextLayout, isLast: boolean): string | undefined {
  const wanted = layout.names.length;
  if (fields.length !== wanted) {
    return isLast
      ? `breaks off after ${fields.length} of ${wanted} fields: the file is cut short`
      : `has ${countOf('field', fields.length)} where ${wanted} columns are named${oddByte(line)}`;
  }
  return undefined;
}

function readRow(
  fields: string[],
  places: number[],
  dated: boolean[],
  layout: TextLayout,
  names: readonly string[],
  columns: Float64Array[],
  row: number,
  line: string,
): string | undefined {
  for (let k = 0; k < places.length; k++) {
    const text = fields[places[k]];
    const value = NULLS.has(text) ? NaN : dated[k] ? nanoseconds(text) : numberOf(text, layout.decimalPoint);
    if (value === undefined) return `holds ${shown(text)} in column ${names[k]}, which is not a number${oddByte(line)}`;
    columns[k][row] = value;
  }
  return undefined;
}

/** Returns the time since 1970 of a date, ns, as close as a double comes to it. */
function nanoseconds(text: string): number | undefined {
  const found = /^(\d{4}-\d{2}-\d{2})[T ](\d{2}:\d{2}(?::\d{2})?)(?:[.,](\d{1,9}))?(Z|[+-]\d{2}:?\d{2})?$/.exec(text);
  if (!found) return undefined;
  const [, date, time, fraction = '', zone = 'Z'] = found;
  const second = Date.parse(`${date}T${time.length === 5 ? `${time}:00` : time}${zone}`);
  if (Number.isNaN(second)) return undefined;
  return Number(BigInt(second) * 1_000_000n + BigInt(fraction.padEnd(9, '0')));
}

function shown(text: string): string {
  const short = text.length > table.longestShown ? `${text.slice(0, table.longestShown)}...` : text;
  const plain = short.replaceAll('\\', '\\\\').replaceAll(/[^\x20-\x7e]/g, (letter) => {
    const code = letter.charCodeAt(0);
    return code < 256 ? `\\x${code.toString(16).padStart(2, '0')}` : `\\u${code.toString(16).padStart(4, '0')}`;
  });
  return plain.includes("'") && !plain.includes('"') ? `"${plain}"` : `'${plain.replaceAll("'", "\\'")}'`;
}

/** Names the first byte that no text log holds, and where it stands; empty if there is none. */
function oddByte(line: string): string {
  const at = line.search(/[^\t\x20-\x7e]/);
  if (at < 0) return '';
  const encoder = new TextEncoder();
  const place = encoder.encode(line.slice(0, at)).length + 1;
  const [byte] = encoder.encode(line.slice(at, at + 2));
  return `, byte ${place} is 0x${byte.toString(16).padStart(2, '0')}`;
}
