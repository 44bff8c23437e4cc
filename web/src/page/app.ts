/** The page: a log is given, its calibration comes out; nothing leaves the computer. */

import type { Core } from '../core';
import { Failure } from '../failure';
import { UnknownColumns, findImus, type Channel } from '../log/columns';
import { SeveralImus, describeTable, readLog, type LogFile } from '../log/reading';
import { firstRows } from '../log/text';
import { sha256 } from '../multipose/calibration';
import { multipose } from '../multipose/procedure';
import { Controls } from './controls';
import { h } from './dom';
import { LivePart } from './live';
import { resultPart } from './result';
import { LANGUAGES, preferred, say, setLanguage, translated } from './words';

const ROWS_SHOWN = 4;
/** Bytes of the largest log that a tab of a browser has the memory for. */
const LARGEST_LOG = 1 << 28;

export class App {
  private files: LogFile[] = [];
  private controls!: Controls;
  private trouble!: HTMLElement;
  private outcome!: HTMLElement;
  private details!: HTMLDetailsElement;
  private given!: HTMLElement;
  private run = 0;

  constructor(
    private readonly root: HTMLElement,
    private readonly core: Core,
    private language = preferred(navigator.languages),
  ) {
    this.build();
  }

  private build(): void {
    setLanguage(this.language);
    document.documentElement.lang = this.language;
    document.title = say('Calibrate an IMU in this page');
    this.controls = new Controls(() => void this.calibrate());
    this.trouble = h('p', { class: 'trouble', role: 'alert' });
    this.outcome = h('div', { 'aria-live': 'polite' });
    this.given = h('p', { class: 'help', role: 'status' });
    this.details = h(
      'details',
      { class: 'more panel' },
      h('summary', {}, say('Reading of the log')),
      this.controls.element,
    );
    this.details.hidden = true;
    this.root.replaceChildren(
      this.head(),
      h(
        'main',
        { class: 'screen' },
        h(
          'div',
          { class: 'screen-head' },
          h('h1', { class: 'title' }, say('Calibrate an IMU in this page')),
          h('p', { class: 'lead' }, say('Hold the IMU still for three seconds in 15 to 20 different orientations, turn it by hand in between, log it all, and give the log here. Nothing is uploaded, nothing is stored.')),
        ),
        this.giving(),
        new LivePart(this.core, (files) => this.show(files), (error) => this.refuse(error)).element,
        this.trouble,
        this.details,
        this.outcome,
      ),
    );
  }

  private head(): HTMLElement {
    const options = Object.entries(LANGUAGES).map(([code, name]) => h('option', { value: code, lang: code }, name));
    const select = h('select', { 'aria-label': say('Language'), id: 'language' }, ...options);
    select.value = this.language;
    select.addEventListener('change', () => {
      this.language = select.value;
      this.build();
      if (this.files.length) this.show(this.files);
      document.getElementById('language')!.focus();
    });
    return h(
      'header',
      { class: 'head' },
      h('div', { class: 'brand' }, h('span', { class: 'brand-mark', 'aria-hidden': 'true' }), h('span', { class: 'brand-name' }, 'Tumble')),
      h('div', { class: 'head-end' }, select),
    );
  }

  private giving(): HTMLElement {
    const input = h('input', { type: 'file', id: 'log', multiple: true, class: 'visually-hidden' });
    input.addEventListener('change', () => {
      const files = [...(input.files ?? [])];
      // The same log may be chosen again, after it was mended.
      input.value = '';
      void this.take(files);
    });
    const zone = h(
      'div',
      { class: 'panel drop' },
      input,
      h('label', { class: 'button primary large', for: 'log' }, say('Choose a log')),
      h('p', { class: 'help' }, say('or drop it here: a table of text (CSV, TSV) with accelerometer and gyroscope; or two files, one for each')),
      this.given,
    );
    const over = (event: DragEvent) => {
      event.preventDefault();
      zone.classList.toggle('over', event.type === 'dragover');
    };
    zone.addEventListener('dragover', over);
    zone.addEventListener('dragleave', over);
    zone.addEventListener('drop', (event) => {
      over(event);
      void this.take([...(event.dataTransfer?.files ?? [])]);
    });
    return zone;
  }

  /** Takes files from a person; those of before stay where these cannot be taken. */
  private async take(chosen: File[]): Promise<void> {
    if (chosen.length === 0) return;
    try {
      if (chosen.length > 2) throw new Failure(`${chosen.length} files: give one log, or one file for each of its two sensors`);
      for (const file of chosen) if (file.size > LARGEST_LOG) throw tooLarge(file);
      this.show(await Promise.all(chosen.map(async (file) => ({ name: file.name, bytes: await unpacked(file) }))));
    } catch (error) {
      this.refuse(error);
    }
  }

  private show(files: LogFile[]): void {
    this.files = files;
    this.controls.forget();
    this.given.textContent = files.map((file) => file.name).join(' + ');
    this.details.hidden = false;
    this.details.open = false;
    void this.calibrate();
  }

  private async calibrate(): Promise<void> {
    if (this.files.length === 0) return;
    const run = ++this.run;
    this.trouble.textContent = '';
    this.outcome.replaceChildren(h('p', { class: 'help', role: 'status' }, say('Calibrating …')));
    // The words show before the work begins.
    await new Promise((resolve) => setTimeout(resolve, 0));
    if (run !== this.run) return;
    try {
      const options = this.controls.options;
      const recording = readLog(this.core, this.files, options.read);
      const result = multipose(this.core, recording, options);
      const own = this.files.find((file) => recording.source === file.name || recording.source.startsWith(`${file.name}:`))!;
      const part = resultPart(result, await sha256(own.bytes), new Date());
      if (run === this.run) this.outcome.replaceChildren(part);
    } catch (error) {
      if (run !== this.run) return;
      this.outcome.replaceChildren();
      this.refuse(error);
    }
  }

  private refuse(error: unknown): void {
    if (!(error instanceof Failure)) {
      const what = error instanceof Error ? error.message : String(error);
      this.trouble.textContent = say('This is a mistake of the page, not of yours: {what}. Please report it with the log.', { what });
      throw error;
    }
    this.trouble.textContent = translated(error.message);
    if (this.files.length === 0) return;
    this.details.open = true;
    if (error instanceof SeveralImus) this.controls.showImus(error.names);
    if (error instanceof UnknownColumns) this.askForColumns();
  }

  /** Lets a person choose what each column is. */
  private askForColumns(): void {
    const [file] = this.files;
    const { layout, log } = describeTable(file);
    if (this.controls.options.read.columns) return;
    this.controls.showColumns(layout.names, firstRows(log, layout, ROWS_SHOWN), knownColumns(layout.names, file.name));
  }
}

function knownColumns(names: string[], file: string): Partial<Record<Channel, string>> {
  try {
    const [imu] = findImus(names, file).values();
    return { time: imu.time };
  } catch {
    return {};
  }
}

/** Returns the bytes of a file, unpacked where gzip packed it, as far as a log may be long. */
async function unpacked(file: File): Promise<Uint8Array> {
  const bytes = new Uint8Array(await file.arrayBuffer());
  if (bytes[0] !== 0x1f || bytes[1] !== 0x8b) return bytes;
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip')).getReader();
  const pieces: Uint8Array<ArrayBuffer>[] = [];
  let length = 0;
  for (;;) {
    const piece = await reader.read().catch(() => {
      throw new Failure(`${file.name}: the gzip file is damaged or cut short; copy it again`);
    });
    if (piece.done) return new Uint8Array(await new Blob(pieces).arrayBuffer());
    pieces.push(piece.value);
    length += piece.value.length;
    if (length > LARGEST_LOG) {
      await reader.cancel();
      throw tooLarge(file);
    }
  }
}

function tooLarge(file: File): Failure {
  return new Failure(`${file.name}: is larger than ${LARGEST_LOG >> 20} MiB; give a part of it, or use the tumble command`);
}
