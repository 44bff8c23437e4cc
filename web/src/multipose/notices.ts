/** What makes a recording unfit, and what was left out of it or assumed, in the words of the command. */

import tables from 'tables';
import type { Recording } from '../log/reading';
import { countOf, filled, fixed } from '../printed';
import type { AcquireAnswer, AcquiredFigures, ChannelFault } from './figures';

const checks = tables.checks;
const { units } = tables.multipose;
const words = checks.messages;

/** Prints the times of a recording from its first sample, s, as the command does. */
export class LogTime {
  constructor(private readonly start: number) {}

  at(time: number, decimals = 1): string {
    return `${this.printed(time, decimals)} s`;
  }

  span(first: number, last: number): string {
    return `${this.printed(first, 1)} to ${this.printed(last, 1)}`;
  }

  private printed(time: number, decimals: number): string {
    const text = fixed(time - this.start, decimals);
    return Number(text) === 0 ? fixed(0, decimals) : text;
  }
}

export function logTime({ samples }: Recording): LogTime {
  return new LogTime(samples.time[0]);
}

function triadOf(channel: string): 'accelerometer' | 'gyroscope' {
  return channel.startsWith('accelerometer') ? 'accelerometer' : 'gyroscope';
}

/** Returns the faults of the channels that were recorded. */
export function recordedFaults(faults: readonly ChannelFault[], { hasGyroscope }: Recording): ChannelFault[] {
  return faults.filter((fault) => hasGyroscope || triadOf(fault.channel) !== 'gyroscope');
}

/** Names a channel that shows nothing, or nothing at rest; nothing if there is none. */
export function deadChannel(faults: readonly ChannelFault[], time: LogTime): string | undefined {
  for (const { channel, kind, value, first, last } of faults) {
    const known = { channel, value, unit: units[triadOf(channel)] };
    if (kind === 'stuck') return filled(words.stuck, { ...known, span: time.span(first, last) });
    if (kind === 'saturated at rest') return filled(words.saturatedAtRest, { ...known, first: time.at(first, 3) });
  }
  return undefined;
}

/** Refuses samples of several units that take turns. */
export function takeTurns({ units: count }: AcquireAnswer): string | undefined {
  const places: Record<string, string> = words.places;
  return count > 1 ? filled(words.takeTurns, { units: count, place: places[count] }) : undefined;
}

/** Describes stretches, s, in which all readings stood still. */
export function* stoodStill({ frozen }: AcquireAnswer, time: LogTime): Generator<string> {
  for (const [first, last] of frozen) yield filled(words.stoodStill, { span: time.span(first, last) });
}

/** Yields a notice on each kind of samples left out, and the remarks of the reader, in the order of the command. */
export function* notices(recording: Recording, answer: AcquireAnswer, unit: AcquiredFigures, duration: number): Generator<string> {
  const time = logTime(recording);
  if (!recording.hasGyroscope) yield filled(words.notRecorded, { triad: 'gyroscope' });
  const confirmed = unit.consistency[0] === 'consistent' ? recording.conversion.gyroscope.doubt : '';
  yield* recording.notices.filter((notice) => notice !== confirmed || confirmed === '');
  yield* stoodStill(answer, time);
  const rate = unit.samples / duration;
  if (rate < checks.slowest) yield filled(words.slowRate, { rate });
  if (recording.reading.correction !== undefined) yield filled(words.corrected, { what: words.holds, remedy: '' });
  const rejections: Record<string, string> = checks.restRejections;
  for (const [first, last, why] of unit.rejected_rests) {
    yield filled(words.noRest, { span: time.span(first, last), why: rejections[why] });
  }
  const faults = recordedFaults(unit.faults, recording);
  for (const fault of faults) yield atRangeEnd(fault, unit, time);
  yield* coarse(recording, unit);
  yield* gaps(faults, unit, time);
  const { missing } = answer.acquired;
  if (missing) {
    const share = (100 * missing) / (unit.samples + missing);
    yield filled(words.missing, { counted: countOf('sample', missing), share });
  }
}

/** Returns of each turn whether it is known in full, and its start and end, s. */
function turnsOf(unit: AcquiredFigures): [boolean, number, number][] {
  return unit.turn_complete.map((complete, k) => [complete, unit.rest_times[k][1], unit.rest_times[k + 1][0]]);
}

const touches = ({ runs }: ChannelFault, start: number, end: number) =>
  runs.some(([first, last]) => first <= end && start <= last);

/** Describes how often a channel was at the end of its range, and the effect. */
function atRangeEnd(fault: ChannelFault, unit: AcquiredFigures, time: LogTime): string {
  const turns = turnsOf(unit);
  const touched = turns.filter(([, start, end]) => touches(fault, start, end));
  const seen = filled(words.atRangeEnd, {
    channel: fault.channel,
    samples: fault.samples,
    all: countOf('sample', unit.samples),
    touched: touched.length,
    turns: countOf('turn', turns.length),
  });
  const first = filled(words.firstAt, { seen, first: time.at(fault.first) });
  if (triadOf(fault.channel) === 'accelerometer') return filled(words.turnsUsed, { seen: first });
  if (touched.length === 0) return first;
  const named = touched.slice(0, words.mostNamed).map(([, start, end]) => `${time.span(start, end)} s`).join(', ');
  const more = touched.length - words.mostNamed;
  return filled(words.turnsLeftOut, { seen, spans: more > 0 ? filled(words.andMore, { spans: named, count: more }) : named });
}

/** Yields a notice on each triad that is coarser than its noise, and on each with a dead band. */
function* coarse({ hasGyroscope }: Recording, unit: AcquiredFigures): Generator<string> {
  for (const triad of hasGyroscope ? (['accelerometer', 'gyroscope'] as const) : (['accelerometer'] as const)) {
    const own = unit.coarse_channels.filter(([channel]) => triadOf(channel) === triad);
    const steps = own.filter(([, step]) => step > 0);
    const bands = own.filter(([, , band]) => band > 0);
    const about = (found: typeof own) => ({ triad, axes: found.map(([channel]) => channel.at(-1)).join(', '), unit: units[triad] });
    const largest = (found: typeof own, place: 1 | 2 | 3 | 4) => Math.max(...found.map((each) => each[place]));
    if (steps.length) yield filled(words.coarse, { ...about(steps), step: largest(steps, 1), sigma: largest(steps, 4) });
    if (bands.length) yield filled(words.deadBand, { ...about(bands), width: largest(bands, 2), zeros: 100 * largest(bands, 3) });
  }
}

function* gaps(faults: readonly ChannelFault[], unit: AcquiredFigures, time: LogTime): Generator<string> {
  for (const [complete, start, end] of turnsOf(unit)) {
    const isSaturated = faults.some((fault) => triadOf(fault.channel) === 'gyroscope' && touches(fault, start, end));
    if (!complete && !isSaturated) yield filled(words.gap, { span: time.span(start, end) });
  }
}
