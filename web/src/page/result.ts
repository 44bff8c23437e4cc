/** The result of a session: verdict, meaning, before and after, parameters, files. */

import tables from 'tables';
import { TARGETS, exported, type ExportSettings, type TargetWord } from '../exports';
import { Failure } from '../failure';
import { calibrationContent, calibrationText } from '../multipose/calibration';
import { meaning } from '../multipose/meaning';
import type { MultiposeResult } from '../multipose/procedure';
import type { Parameter } from '../multipose/triad';
import { general } from '../printed';
import { h, save } from './dom';
import { directionWords, drawSphere, gravityChart } from './drawing';
import { say, translated } from './words';

const VERDICTS = {
  calibrated: ['good', '✓'],
  'partly calibrated': ['warn', '◐'],
  'model not met': ['bad', '✕'],
} as const;

/** Words of a verdict. */
function verdictWords(result: MultiposeResult): string {
  switch (result.verdict) {
    case 'calibrated':
      return say('Calibrated');
    case 'partly calibrated':
      return say('Accelerometer calibrated, gyroscope not');
    case 'model not met':
      return say('Not to be trusted yet');
  }
}

/** Builds the part of the page that shows a result. */
export function resultPart(result: MultiposeResult, digest: string, date: Date): HTMLElement {
  const [kind, sign] = VERDICTS[result.verdict];
  const canvas = h('canvas', { class: 'sphere-picture', role: 'img', 'aria-label': sphereWords(result) });
  const part = h(
    'section',
    { class: 'result', 'aria-labelledby': 'verdict' },
    h(
      'div',
      { class: `verdict-line ${kind}` },
      h('span', { class: 'verdict-sign', 'aria-hidden': 'true' }, sign),
      h('h2', { class: 'verdict-words', id: 'verdict', tabindex: '-1' }, verdictWords(result)),
    ),
    ...meaning(result).map((sentence) => h('p', { class: 'meaning' }, sentence)),
    filesPart(result, digest, date, canvas),
    h(
      'div',
      { class: 'panel' },
      h('h3', { class: 'section' }, say('Gravity before and after')),
      h(
        'p',
        { class: 'legend' },
        h('span', { class: 'key before' }, `■ ${say('raw')}`),
        h('span', { class: 'key after' }, `● ${say('calibrated')}`),
        h('span', {}, say('length of gravity less {gravity} m/s², in m/s²', { gravity: general(result.gravity) })),
      ),
      gravityChart(result.figures.poses.before, result.figures.poses.after) as unknown as HTMLElement,
    ),
    h('div', { class: 'panel' }, h('h3', { class: 'section' }, say('Orientations')), canvas, nextWords(result)),
    parametersPart(result),
    warningsPart(result),
  );
  drawSphere(canvas, sphereOf(result));
  return part;
}

function sphereOf({ figures }: MultiposeResult) {
  const held = figures.poses.force.map((force) => {
    const length = Math.hypot(...force);
    return force.map((value) => value / length);
  });
  return { held, next: figures.next?.up };
}

function sphereWords({ directions, figures }: MultiposeResult): string {
  return say('{directions} orientations in {rests} rests, each a point on the sphere that shows which way was up.', {
    directions, rests: figures.poses.force.length,
  });
}

const WORTH_ADDING = 0.9;

function nextWords({ figures, directions }: MultiposeResult): HTMLElement {
  const seen = say('{directions} orientations were held.', { directions });
  const { next } = figures;
  if (next === null || next.after >= WORTH_ADDING * next.before) return h('p', {}, seen);
  const unknowns: Record<string, string> = tables.multipose.unknowns;
  const words = say('The next best one has {up}: it would lower the largest sigma, of {parameter}, from {before} % to {after} %.', {
    up: directionWords(next.up),
    parameter: translated(unknowns[next.unknown]),
    before: general(100 * next.before, 2),
    after: general(100 * next.after, 2),
  });
  return h('p', {}, seen, ' ', words);
}

function shown({ value, sigma, unit, isObservable }: Parameter): string {
  if (!isObservable) return say('not observable');
  const decimals = Math.max(0, 1 - Math.floor(Math.log10(sigma)));
  const digits = Number.isFinite(decimals) ? Math.min(decimals, 12) : 6;
  return `${value.toFixed(digits).replace('-', '−')} ± ${sigma.toFixed(digits)}${unit === '1' ? '' : ` ${unit}`}`;
}

function parametersPart({ accelerometer, gyroscope }: MultiposeResult): HTMLElement {
  const triads = gyroscope ? [accelerometer, gyroscope] : [accelerometer];
  const rows = accelerometer.parameters.map((parameter, k) =>
    h(
      'tr',
      {},
      h('th', { scope: 'row' }, translated(parameter.name)),
      ...triads.map((triad) => h('td', { title: triad.parameters[k].reason }, shown(triad.parameters[k]))),
    ),
  );
  return h(
    'div',
    { class: 'panel' },
    h('h3', { class: 'section' }, say('Parameters with their 1-sigma')),
    h(
      'div',
      { class: 'scrolled', tabindex: '0', role: 'region', 'aria-label': say('Parameters with their 1-sigma') },
      h(
        'table',
        { class: 'table' },
        h('thead', {}, h('tr', {}, h('td', {}), ...triads.map((each) => h('th', { scope: 'col' }, translated(each.triad))))),
        h('tbody', {}, ...rows),
      ),
    ),
  );
}

function warningsPart({ warnings }: MultiposeResult): HTMLElement | undefined {
  if (warnings.length === 0) return undefined;
  return h(
    'div',
    { class: 'panel' },
    h('h3', { class: 'section' }, say('Remarks')),
    h('ul', { class: 'remarks' }, ...warnings.map((warning) => h('li', {}, translated(warning)))),
  );
}

function filesPart(result: MultiposeResult, digest: string, date: Date, canvas: HTMLCanvasElement): HTMLElement {
  const content = calibrationContent(result, digest, date);
  const { name } = result.recording;
  const report = h('p', { class: 'help', role: 'status' });
  const ids = { accelerometerId: idField('accelerometer-id'), gyroscopeId: idField('gyroscope-id') };
  const perG = idField('counts-per-g', String(tables.exports.betaflight.countsPerG));
  const settings = (): ExportSettings => ({
    accelerometerId: typedNumber(ids.accelerometerId),
    gyroscopeId: typedNumber(ids.gyroscopeId),
    countsPerG: typedNumber(perG),
  });
  const give = async (word: TargetWord) => {
    try {
      const file = await exported(result, content, word, settings());
      save(file.name, file.content);
      const lost = file.lost.length ? say('It does not hold {parts}.', { parts: file.lost.map(translated).join(', ') }) : '';
      report.className = 'help';
      report.textContent = [say('{name} is written.', { name: file.name }), lost, ...file.remarks.map(translated)].filter(Boolean).join(' ');
    } catch (error) {
      if (!(error instanceof Failure)) throw error;
      report.className = 'trouble';
      report.textContent = translated(error.message);
    }
  };
  const button = (word: TargetWord) =>
    h('button', { type: 'button', class: 'button small', click: () => void give(word) }, translated(tables.exports.targets[word].title));
  return h(
    'div',
    { class: 'panel files' },
    h(
      'button',
      {
        type: 'button', class: 'button primary',
        click: () => save(`${name}.multipose.yaml`, calibrationText(result, digest, date)),
      },
      say('Save the calibration'),
    ),
    h('p', { class: 'help' }, say('Every tumble command takes the file {file}.', { file: `${name}.multipose.yaml` })),
    h('h3', { class: 'subsection' }, say('For other programs')),
    h('div', { class: 'formats' }, ...TARGETS.map(button)),
    h(
      'details',
      { class: 'more' },
      h('summary', {}, say('Numbers that PX4 and Betaflight need')),
      h(
        'div',
        { class: 'form-row' },
        labelled(say('Device id of the accelerometer, CAL_ACC0_ID'), ids.accelerometerId),
        labelled(say('Device id of the gyroscope, CAL_GYRO0_ID'), ids.gyroscopeId),
        labelled(say('Counts of 1 g in Betaflight, acc_1G'), perG),
      ),
    ),
    report,
    h(
      'button',
      {
        type: 'button', class: 'button small quiet',
        click: () => canvas.toBlob((blob) => blob && save(`${name}.orientations.png`, blob), 'image/png'),
      },
      say('Save the picture of the orientations'),
    ),
  );
}

function idField(id: string, value = ''): HTMLInputElement {
  return h('input', { type: 'number', id, min: '1', inputmode: 'numeric', value });
}

function typedNumber(input: HTMLInputElement): number | undefined {
  return input.value.trim() === '' ? undefined : Number(input.value);
}

function labelled(label: string, input: HTMLInputElement): HTMLElement {
  return h('div', { class: 'field' }, h('label', { for: input.id }, label), input);
}
