/** Two sentences on a result, for a person who wants to know whether to use it. */

import { say, translated } from '../page/words';
import { plain } from '../printed';
import type { MultiposeResult } from './procedure';

const DEGREES = 180 / Math.PI;

export function meaning(result: MultiposeResult): [string, string] {
  return [aboutAccelerometer(result), aboutGyroscope(result)];
}

function aboutAccelerometer({ verdict, lengths, gravity, accelerometer, gyroscope }: MultiposeResult): string {
  if (verdict === 'model not met') {
    const objection = [...accelerometer.objections, ...(gyroscope?.objections ?? [])][0];
    return objection
      ? say('Do not use it yet: {reason}.', { reason: translated(objection) })
      : say('Do not use it yet: the readings deviate from the model by more than their noise explains.');
  }
  return say('Held still, the accelerometer was off by {before} mm/s² and is off by {after} mm/s² with this calibration: a tilt of {angle} degrees.', {
    before: plain(1e3 * lengths.before),
    after: plain(1e3 * lengths.after),
    angle: plain((lengths.after / gravity) * DEGREES),
  });
}

function aboutGyroscope({ gyroscope, gyroscopeReason, angles }: MultiposeResult): string {
  if (!gyroscope) return say('The gyroscope is not calibrated: {reason}.', { reason: translated(gyroscopeReason) });
  return say('After a turn the gyroscope missed gravity by {before} degrees with its bias alone, and misses it by {after} degrees now.', {
    before: plain(angles.before * DEGREES),
    after: plain(angles.after * DEGREES),
  });
}
