/** The calibration file of a unit that was held in many orientations. */

import tables from 'tables';
import { readAsCounts } from '../log/reading';
import { float } from '../printed';
import { documentText } from '../yaml';
import type { MultiposeResult } from './procedure';
import { triadContent } from './triad';

const { header, schema, software } = tables.calibration;

/** Digest of bytes, SHA-256 in hexadecimal. */
export async function sha256(bytes: Uint8Array): Promise<string> {
  const digest = new Uint8Array(await crypto.subtle.digest('SHA-256', bytes as BufferSource));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, '0')).join('');
}

/** Returns the text of the file, byte for byte what `tumble multipose` writes of the same log at that time. */
export function calibrationText(result: MultiposeResult, digest: string, date: Date): string {
  return documentText(header, calibrationContent(result, digest, date));
}

export function calibrationContent(result: MultiposeResult, digest: string, date: Date): Record<string, unknown> {
  const { recording, options, gyroscope, accelerometer, temperature } = result;
  return {
    schema,
    name: recording.name.trim(),
    serial: recording.serial,
    software,
    date: `${date.toISOString().slice(0, 19)}Z`,
    operator: '',
    station: '',
    reading: readingOf(result),
    log: { file: recording.source, sha256: digest, duration: float(result.duration) },
    verdict: result.verdict,
    method: {
      procedure: 'multipose',
      truth: 'gravity',
      options: {
        'g-sensitivity': false,
        'earth-rate': false,
        raw: options.read.raw ?? false,
        faces: options.faces ?? false,
        'pose-means': false,
      },
    },
    gravity:
      options.gravity === undefined
        ? { value: float(result.gravity), source: 'standard' }
        : { value: float(result.gravity), source: 'given', sigma: float(0) },
    temperature: temperature === null ? undefined : temperatureContent(temperature),
    accelerometer: triadContent(accelerometer),
    gyroscope: gyroscope && triadContent(gyroscope),
  };
}

/** Returns how the log was read; its counts by the scale for which the calibration holds. */
export function readingOf({ recording, options, figures, gyroscope }: MultiposeResult): Record<string, unknown> {
  if (figures.nominal_scale === null) return recording.reading;
  const [force, rate] = figures.nominal_scale;
  return readAsCounts(options.read, [1 / force, gyroscope && 1 / rate], recording.reading.correction);
}

function temperatureContent([low, mean, high]: [number, number, number]): Record<string, unknown> {
  return { low: float(low), mean: float(mean), high: float(high) };
}
