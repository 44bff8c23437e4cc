/** Steps of a person while a log is recorded, by what the core finds in it so far. */

import tables from 'tables';
import type { Core } from '../core';
import { Failure } from '../failure';
import type { ReadOptions } from '../log/conversion';
import { readLog } from '../log/reading';
import { acquire } from '../multipose/acquire';
import type { MultiposeFigures } from '../multipose/figures';
import type { Recorder } from './recorder';

const [FEWEST, ENOUGH] = [10, 15];
const WORTH_ADDING = 0.9;
/** Angle between orientations that count as two, rad. */
const APART = (9 * Math.PI) / 180;
/** s since a rest within which a unit counts as held. */
const RECENT = 0.5;

/** State of a recording. */
export interface Progress {
  /** Unit vectors that were up, one for each orientation. */
  held: number[][];
  next: MultiposeFigures['next'];
  isStill: boolean;
  /** No orientation to add lowers the largest sigma by enough. */
  isDone: boolean;
  trouble: string;
}

/** Follows a recording: the core looks at all of it again and again, which takes a fraction of a second. */
export class Guide {
  private rests = 0;
  private progress: Progress = { held: [], next: null, isStill: false, isDone: false, trouble: '' };

  constructor(
    private readonly core: Core,
    private readonly read: ReadOptions,
  ) {}

  /** Looks at all that was recorded until now. */
  look(recorder: Recorder): Progress {
    try {
      this.progress = { ...this.progress, ...this.found(recorder), trouble: '' };
    } catch (error) {
      if (!(error instanceof Failure)) throw error;
      this.progress = { ...this.progress, trouble: error.message };
    }
    return this.progress;
  }

  private found(recorder: Recorder): Partial<Progress> {
    const recording = readLog(this.core, [recorder.file()], this.read);
    const { samples, hasGyroscope } = recording;
    const unit = acquire(this.core, recording).acquired;
    const held = distinct(unit.rest_specific_force);
    const isStill = (unit.rest_times.at(-1)?.[1] ?? -Infinity) > samples.time[samples.time.length - 1] - RECENT;
    if (held.length < FEWEST || unit.rest_times.length <= this.rests) return { held, isStill };
    this.rests = unit.rest_times.length;
    const figures = this.core.ask<MultiposeFigures>(
      {
        ask: 'multipose', gravity: tables.units.gravity, gravity_sigma: 0, gyroscope: hasGyroscope,
        raw: false, faces: false, pace_sigma: 0, stamp_sigma: 0,
      },
      [samples.time, samples.force, samples.rate],
    );
    if (figures.refusal) return { held, isStill };
    const { next } = figures;
    const gains = next !== null && next.after < WORTH_ADDING * next.before;
    return { held, isStill, next: gains ? next : null, isDone: held.length >= ENOUGH && !gains };
  }
}

/** Returns the directions that differ. */
function distinct(means: readonly number[][]): number[][] {
  const found: number[][] = [];
  for (const mean of means) {
    const length = Math.hypot(...mean);
    const up = mean.map((value) => value / length);
    const isNear = (other: number[]) => up.reduce((sum, value, k) => sum + value * other[k], 0) > Math.cos(APART);
    if (!found.some(isNear)) found.push(up);
  }
  return found;
}
