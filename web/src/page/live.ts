/** A recording that is made in this page: the person is led from one orientation to the next. */

import type { Core } from '../core';
import { Failure } from '../failure';
import { Guide, type Progress } from '../live/guide';
import { MotionSource, mayHaveMotion } from '../live/motion';
import type { Recorder } from '../live/recorder';
import { SerialSource, hasSerial } from '../live/serial';
import type { LogFile } from '../log/reading';
import { h, save } from './dom';
import { directionWords, drawSphere } from './drawing';
import { say, translated } from './words';

interface Source {
  recorder: Recorder | undefined;
  start(): Promise<void>;
  stop(): Promise<void>;
}

const LOOK_EVERY = 1000;

/** Buttons that begin a recording, and the part that leads through it. */
export class LivePart {
  readonly element: HTMLElement;
  private source: Source | undefined;
  private timer = 0;

  constructor(
    private readonly core: Core,
    private readonly given: (files: LogFile[]) => void,
    private readonly refuse: (error: unknown) => void,
  ) {
    this.element = h('div', { class: 'live' });
    this.offer();
  }

  private offer(): void {
    const date = () => new Date().toISOString().slice(0, 19).replaceAll(':', '-');
    const buttons = [
      ...(mayHaveMotion()
        ? [this.button(say('Use the sensors of this device'), () => new MotionSource(`device-${date()}`))]
        : []),
      ...(hasSerial() ? [this.button(say('Connect a board'), () => new SerialSource(`board-${date()}`))] : []),
    ];
    this.element.replaceChildren(...buttons);
  }

  private button(words: string, source: () => Source): HTMLElement {
    return h('button', { type: 'button', class: 'button', click: () => void this.begin(source()) }, words);
  }

  private async begin(source: Source): Promise<void> {
    try {
      this.element.replaceChildren(h('p', { class: 'help', role: 'status' }, say('Waiting for the first samples …')));
      await source.start();
      this.source = source;
      this.lead(source);
    } catch (error) {
      this.offer();
      // A person who chose no port wanted none.
      if (error instanceof DOMException && error.name === 'NotFoundError') return;
      this.refuse(error instanceof DOMException ? new Failure(`the port cannot be opened: ${error.message}; close other programs that use it`) : error);
    }
  }

  private lead(source: Source): void {
    const guide = new Guide(this.core, {});
    const instruction = h('p', { class: 'instruction', role: 'status' }, say('Hold the unit still'));
    const figures = h('p', { class: 'help' });
    const canvas = h('canvas', { class: 'sphere-picture', role: 'img', 'aria-label': say('Orientations') });
    const finish = h('button', { type: 'button', class: 'button primary', click: () => void this.end(true) }, say('Finish'));
    const stop = h('button', { type: 'button', class: 'button quiet', click: () => void this.end(false) }, say('Stop'));
    this.element.replaceChildren(h('div', { class: 'panel' }, instruction, figures, canvas, h('div', { class: 'formats' }, finish, stop)));
    const look = () => {
      const { recorder } = source;
      if (!recorder) return;
      const progress = guide.look(recorder);
      instruction.textContent = words(progress);
      figures.textContent = say('{count} orientations held, {seconds} s, {rate} samples a second', {
        count: progress.held.length,
        seconds: recorder.duration.toFixed(0),
        rate: recorder.frequency.toFixed(0),
      });
      drawSphere(canvas, { held: progress.held, next: progress.next?.up });
      if (progress.isDone) void this.end(true);
    };
    drawSphere(canvas, { held: [], next: undefined });
    this.timer = setInterval(look, LOOK_EVERY) as unknown as number;
  }

  private async end(isWanted: boolean): Promise<void> {
    const { source } = this;
    if (!source) return;
    this.source = undefined;
    clearInterval(this.timer);
    await source.stop();
    this.offer();
    if (!isWanted) return;
    if (!source.recorder) {
      this.refuse(new Failure('no samples came: check the sensor, and whether the browser may use it'));
      return;
    }
    const file = source.recorder.file();
    this.element.append(
      h(
        'button',
        { type: 'button', class: 'button small quiet', click: () => save(file.name, new Blob([file.bytes as BlobPart])) },
        say('Save the log'),
      ),
    );
    this.given([file]);
  }
}

function words({ held, next, isStill, trouble }: Progress): string {
  if (trouble && held.length === 0) return translated(trouble);
  if (!isStill) return next ? say('Turn it: {up}', { up: directionWords(next.up) }) : say('Hold the unit still');
  return next ? say('Held. Next: {up}', { up: directionWords(next.up) }) : say('Held. Turn it to another orientation');
}
