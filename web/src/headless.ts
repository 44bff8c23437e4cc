/** The page without a page: jobs as lines of JSON in, what a person would be shown as lines of JSON out; for tests. */

import { readFileSync } from 'node:fs';
import { basename } from 'node:path';
import { createInterface } from 'node:readline';
import { Core } from './core';
import { TARGETS, exported, type TargetWord } from './exports';
import { Failure } from './failure';
import { recognise } from './log/columns';
import type { ReadOptions } from './log/conversion';
import { readLog } from './log/reading';
import { calibrationContent, calibrationText, sha256 } from './multipose/calibration';
import { multipose, type MultiposeResult } from './multipose/procedure';

interface Job {
  names?: string[];
  files?: string[];
  gravity?: number;
  faces?: boolean;
  read?: ReadOptions;
  date?: string;
}

async function done(core: Core, job: Job): Promise<unknown> {
  if (job.names) return job.names.map((name) => recognise(name) ?? null);
  const files = job.files!.map((path) => ({ name: basename(path), bytes: new Uint8Array(readFileSync(path)) }));
  try {
    const read = job.read ?? {};
    const recording = readLog(core, files, read);
    const found = multipose(core, recording, { read, gravity: job.gravity, faces: job.faces });
    const own = files.find((file) => file.name === recording.source.split(':')[0])!;
    const [digest, date] = [await sha256(own.bytes), new Date(job.date!)];
    const content = calibrationContent(found, digest, date);
    const exports = Object.fromEntries(
      await Promise.all(TARGETS.map(async (word) => [word, await exportedText(found, content, word)] as const)),
    );
    return { text: calibrationText(found, digest, date), warnings: found.warnings, exports };
  } catch (error) {
    if (!(error instanceof Failure)) throw error;
    return { failure: error.message };
  }
}

const SETTINGS = { accelerometerId: 1310988, gyroscopeId: 2490378 };

async function exportedText(found: MultiposeResult, content: Record<string, unknown>, word: TargetWord): Promise<string> {
  try {
    return (await exported(found, content, word, SETTINGS)).content;
  } catch (error) {
    if (!(error instanceof Failure)) throw error;
    return error.message;
  }
}

const core = await Core.of(readFileSync(process.argv[2]));
for await (const line of createInterface({ input: process.stdin })) {
  process.stdout.write(`${JSON.stringify(await done(core, JSON.parse(line) as Job))}\n`);
}
