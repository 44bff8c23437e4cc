/** A board on a serial port that prints its readings, a line for each sample. */

import { Failure } from '../failure';
import { recognise } from '../log/columns';
import { Recorder } from './recorder';

/** The part of Web Serial that the page uses. */
interface Port {
  open(options: { baudRate: number; bufferSize: number }): Promise<void>;
  close(): Promise<void>;
  readable: ReadableStream<Uint8Array> | null;
}
type WithSerial = Navigator & { serial?: { requestPort(): Promise<Port> } };

const RATES = [115200, 921600, 9600, 57600, 230400, 460800, 250000, 500000, 1000000, 38400, 19200];
const BUFFER = 1 << 20;
/** Bytes by which a rate is judged, and ms to wait for them. */
const [JUDGED, PATIENCE] = [600, 1500];
const LONGEST_LINE = 2000;
/** s between lines that arrive together. */
const APART = 1e-5;
const NUMBER = /[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?/g;
/** Name, sign and value; names and blanks have a longest length, as each letter may begin a name. */
const LABELLED = /([A-Za-z_][\w ]{0,39}?)\s{0,3}[:=]\s{0,3}([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)/g;

export function hasSerial(): boolean {
  return 'serial' in navigator;
}

/** Returns the values of a line, by name where it names them; nothing where it is no sample. */
export function valuesOf(line: string): { names: string[] | undefined; values: string[] } | undefined {
  const pairs = [...line.matchAll(LABELLED)];
  if (pairs.length >= 3) return { names: pairs.map((pair) => pair[1].trim()), values: pairs.map((pair) => pair[2]) };
  const fields = line.trim().split(/[\s,;|]+/).filter(Boolean);
  const values = fields.filter((field) => field.replace(NUMBER, '') === '');
  return values.length >= 3 && values.length === fields.length ? { names: undefined, values } : undefined;
}

/** Returns the names of a line that names columns; nothing where it does not. */
export function namesOf(line: string): string[] | undefined {
  const fields = line.trim().split(/[\t,;|]+/).map((field) => field.trim()).filter(Boolean);
  return fields.filter((field) => recognise(field)).length >= 3 ? fields : undefined;
}

/** Records a serial port until stopped; times of rows are those of their arrival, unless lines have their own. */
export class SerialSource {
  recorder: Recorder | undefined;
  /** Baud rate at which lines were recognised. */
  baudRate: number | undefined;
  /** Lines that were no samples. */
  others = 0;
  private names: string[] | undefined;
  private columns: string[] | undefined;
  private text = '';
  private arrived = 0;
  private reader: ReadableStreamDefaultReader<Uint8Array> | undefined;
  private port: Port | undefined;

  constructor(
    private readonly name: string,
    private readonly now: () => number = () => performance.now() / 1000,
  ) {}

  /** Asks for a port, finds its rate, and begins. */
  async start(): Promise<void> {
    const { serial } = navigator as WithSerial;
    const port = await serial!.requestPort();
    for (const baudRate of RATES) {
      await port.open({ baudRate, bufferSize: BUFFER });
      const reader = port.readable!.getReader();
      const heard = await this.hear(reader);
      if (isText(heard)) {
        Object.assign(this, { port, reader, baudRate });
        // The first line may be torn.
        this.take(heard.slice(heard.indexOf('\n') + 1));
        void this.follow(reader);
        return;
      }
      await reader.cancel();
      reader.releaseLock();
      await port.close();
    }
    throw new Failure(
      `the port gave no lines of numbers at ${RATES.join(', ')} baud: print the readings of a sample on a line, as ax,ay,az,gx,gy,gz`,
    );
  }

  async stop(): Promise<void> {
    await this.reader?.cancel();
    this.reader?.releaseLock();
    await this.port?.close();
    this.reader = this.port = undefined;
  }

  /** Reads enough to judge a rate by. */
  private async hear(reader: ReadableStreamDefaultReader<Uint8Array>): Promise<string> {
    const decoder = new TextDecoder();
    let heard = '';
    let timer = 0;
    const late = new Promise<undefined>((resolve) => {
      timer = setTimeout(() => resolve(undefined), PATIENCE) as unknown as number;
    });
    while (heard.length < JUDGED) {
      const piece = await Promise.race([reader.read(), late]);
      if (!piece || piece.done) break;
      heard += decoder.decode(piece.value, { stream: true });
    }
    clearTimeout(timer);
    return heard;
  }

  private async follow(reader: ReadableStreamDefaultReader<Uint8Array>): Promise<void> {
    const decoder = new TextDecoder();
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return;
      this.take(decoder.decode(value, { stream: true }));
    }
  }

  private take(piece: string): void {
    const lines = (this.text + piece).split(/\r?\n/);
    this.text = lines.pop()!.slice(-LONGEST_LINE);
    const arrived = this.now();
    for (const whole of lines) {
      const line = whole.slice(-LONGEST_LINE);
      // Lines that arrive together have times of their own, so that each is a row.
      this.arrived = Math.max(arrived, this.arrived + APART);
      this.takeLine(line, this.arrived);
    }
  }

  private takeLine(line: string, arrived: number): void {
    const found = valuesOf(line);
    if (!found) {
      this.names = namesOf(line) ?? this.names;
      this.others += line.trim() === '' ? 0 : 1;
      return;
    }
    const { values } = found;
    this.columns ??= this.columnsOf(found.names ?? (this.names?.length === values.length ? this.names : undefined), values.length);
    if (values.length + 1 !== this.columns.length) {
      this.others += 1;
      return;
    }
    this.recorder ??= new Recorder(this.name, this.columns);
    this.recorder.push(arrived, values);
  }

  /** Names the columns: as lines do, else by their number as in a log without names. */
  private columnsOf(names: string[] | undefined, count: number): string[] {
    const plain = ['ax', 'ay', 'az', 'gx', 'gy', 'gz'];
    const others = (from: number, left: number) => Array.from({ length: left }, (_, k) => `column ${from + k}`);
    const own =
      names ?? (count >= 6 ? [...others(1, count - 6), ...plain] : [...plain.slice(0, 3), ...others(4, count - 3)]);
    const clean = own.map((name) => name.replaceAll(/[",\r\n]/g, ' '));
    const hasTime = clean.some((name) => recognise(name)?.quantity === 'time');
    return [hasTime ? 'arrival' : 'time [s]', ...clean];
  }
}

/** Tests whether most of a text are lines of numbers. */
function isText(heard: string): boolean {
  const lines = heard.split(/\r?\n/).slice(1, -1).map((line) => line.slice(-LONGEST_LINE)).filter((line) => line.trim());
  return lines.length >= 2 && 2 * lines.filter((line) => valuesOf(line)).length > lines.length;
}
