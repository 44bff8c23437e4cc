/** A log that is recorded live: what comes in is written down as a table of text, and read as any log. */

import type { LogFile } from '../log/reading';

/** Rows of a log as they come. */
export class Recorder {
  private readonly rows: string[] = [];
  private first: number | undefined;
  private last = 0;

  /** The first column is time, s. */
  constructor(
    private readonly name: string,
    private readonly columns: readonly string[],
  ) {}

  /** Takes a row at a time of any clock, s; one that is not later than the last is the same again. */
  push(time: number, values: readonly (number | string)[]): void {
    this.first ??= time;
    const since = time - this.first;
    if (this.rows.length && since <= this.last) return;
    this.last = since;
    this.rows.push([since, ...values].join(','));
  }

  get samples(): number {
    return this.rows.length;
  }

  /** s since the first row. */
  get duration(): number {
    return this.last;
  }

  get frequency(): number {
    return this.last > 0 ? (this.rows.length - 1) / this.last : NaN;
  }

  /** Returns the log as a file. */
  file(): LogFile {
    const text = [this.columns.join(','), ...this.rows, ''].join('\n');
    return { name: `${this.name}.csv`, bytes: new TextEncoder().encode(text) };
  }
}
