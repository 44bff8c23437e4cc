/** Rows of a table that a column labels with the IMU they are of: each label is an IMU of its own. */

import tables from 'tables';
import type { ImuColumns } from './columns';
import { pattern } from './pattern';
import { splitLine, type LogText, type TextLayout } from './text';

const table = tables.labels;
const WHOLE = pattern(table.whole);
const FRACTION = pattern(table.fraction);
const NULLS = new Set(tables.text.nulls);

/** Labels of all rows of a table. */
export interface RowLabels {
  column: string;
  /** Those that name IMUs, two at least. */
  names: string[];
  rows: string[];
}

/** Returns the columns that may label the rows of an IMU, the surest first. */
export function labelColumns(imu: ImuColumns, names: readonly string[], stated: readonly string[]): string[] {
  const axes = [...(imu.accelerometer ?? []), ...(imu.gyroscope ?? [])];
  const read = new Set([imu.time, imu.temperature, ...axes, ...stated]);
  const spelled = (name: string) => name.split(/[./]/).pop()!;
  const others = names.filter((name) => !read.has(name) && axes[0].startsWith(name.slice(0, name.length - spelled(name).length)));
  return table.names.flatMap((each) => others.filter((name) => spelled(name).replaceAll(/[ _-]+/g, '').toLowerCase() === each));
}

/** Returns the labels in a column, by the lines that were read, where they name several IMUs. */
export function rowLabels(log: LogText, layout: TextLayout, column: string, lines: Uint32Array): RowLabels | undefined {
  const place = layout.names.indexOf(column);
  const words = Array.from(lines, (line) => splitLine(log.lines[line - 1], layout.delimiter)[place] ?? '');
  const known = new Map<string, string>();
  const counts = new Map<string, number>();
  let fractions = 0;
  for (const word of words) {
    if (!known.has(word)) known.set(word, labelOf(word));
    if (known.size > table.mostWords) return undefined;
    const label = known.get(word)!;
    if (label) counts.set(label, (counts.get(label) ?? 0) + 1);
    else if (FRACTION.test(word)) fractions += 1;
  }
  const total = [...counts.values()].reduce((sum, count) => sum + count, 0);
  // A label that is new in most rows is a counter, and readings are whole numbers now and then.
  if (2 * counts.size > total || fractions * table.few > total) return undefined;
  const names = [...counts].filter(([, count]) => count > 1).map(([label]) => label).sort();
  if (names.length < 2 || names.length > table.most) return undefined;
  return { column, names, rows: words.map((word) => known.get(word)!) };
}

function labelOf(word: string): string {
  if (NULLS.has(word)) return '';
  const whole = WHOLE.exec(word);
  if (whole) return String(Number(whole[1]) || 0);
  return FRACTION.test(word) || table.none.includes(word.toLowerCase()) ? '' : word;
}
