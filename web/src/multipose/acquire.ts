/** A recording, cut into rests and turns by the core. */

import type { Core } from '../core';
import type { Recording } from '../log/reading';
import type { AcquireAnswer } from './figures';

/** Cuts a recording into rests and turns, and looks for what makes it unfit. */
export function acquire(core: Core, { samples, hasGyroscope, paceSigma, stampSigma }: Recording): AcquireAnswer {
  const arrays = [samples.time, samples.force, samples.rate, ...(samples.temperature ? [samples.temperature] : [])];
  const request = {
    ask: 'acquire',
    temperature: samples.temperature !== undefined,
    gyroscope: hasGyroscope,
    pace_sigma: paceSigma,
    stamp_sigma: stampSigma,
  };
  return core.ask<AcquireAnswer>(request, arrays);
}
