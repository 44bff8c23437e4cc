/** Sensors of a phone, as its browser gives them. */

import { Failure } from '../failure';
import { Recorder } from './recorder';

type Asking = typeof DeviceMotionEvent & { requestPermission?: () => Promise<'granted' | 'denied'> };

const RADIANS = Math.PI / 180;
const FORCE = ['ax [m/s^2]', 'ay [m/s^2]', 'az [m/s^2]'];
const RATE = ['gx [rad/s]', 'gy [rad/s]', 'gz [rad/s]'];

/** Returns whether this browser may have sensors of motion. */
export function mayHaveMotion(): boolean {
  return typeof DeviceMotionEvent !== 'undefined' && navigator.maxTouchPoints > 0;
}

/** Records the sensors of motion until stopped. */
export class MotionSource {
  recorder: Recorder | undefined;
  private hasGyroscope = false;
  private readonly listener = (event: DeviceMotionEvent) => this.take(event);
  /** Browsers of Apple read -1 g where the specific force is +1 g. */
  private readonly sign = navigator.vendor.startsWith('Apple') ? -1 : 1;

  constructor(private readonly name: string) {}

  /** Asks for permission where the browser wants that, and begins. */
  async start(): Promise<void> {
    const permission = (await (DeviceMotionEvent as Asking).requestPermission?.()) ?? 'granted';
    if (permission !== 'granted') {
      throw new Failure('the browser did not allow the sensors of motion: allow them for this page, and start again');
    }
    addEventListener('devicemotion', this.listener);
  }

  async stop(): Promise<void> {
    removeEventListener('devicemotion', this.listener);
  }

  private take({ accelerationIncludingGravity: force, rotationRate: rate, timeStamp }: DeviceMotionEvent): void {
    if (force?.x == null || force.y == null || force.z == null) return;
    const turns = [rate?.alpha, rate?.beta, rate?.gamma];
    const isWhole = turns.every((each) => each != null);
    if (!this.recorder) {
      this.hasGyroscope = isWhole;
      this.recorder = new Recorder(this.name, ['time [s]', ...FORCE, ...(isWhole ? RATE : [])]);
    }
    if (this.hasGyroscope && !isWhole) return;
    this.recorder.push(timeStamp / 1000, [
      ...[force.x, force.y, force.z].map((value) => this.sign * value),
      ...(this.hasGyroscope ? turns.map((value) => value! * RADIANS) : []),
    ]);
  }
}
