/** Fields by which a person states what a log does not: columns, units, rate, scale. */

import tables from 'tables';
import { CHANNELS, type Channel } from '../log/columns';
import type { ReadOptions } from '../log/conversion';
import type { SessionOptions } from '../multipose/procedure';
import { h } from './dom';
import { say } from './words';

/** Fields of one log; `changed` is called whenever a person changed one. */
export class Controls {
  readonly element: HTMLElement;
  private readonly number = new Map<string, HTMLInputElement>();
  private readonly choice = new Map<string, HTMLSelectElement>();
  private readonly flag = new Map<string, HTMLInputElement>();
  private readonly columns: HTMLElement;
  private selects: [string, HTMLSelectElement][] = [];
  private readonly imus: HTMLElement;
  private imu: string | undefined;

  constructor(private readonly changed: () => void) {
    this.columns = h('div', { class: 'table-columns' });
    this.imus = h('div', { class: 'imus', role: 'group' });
    this.element = h(
      'div',
      { class: 'controls' },
      this.imus,
      this.columns,
      h(
        'div',
        { class: 'form-row' },
        this.numberField('rate', say('Sample rate, Hz'), '--rate'),
        this.choiceField('timeUnit', say('Unit of time'), '--time-unit', Object.keys(tables.units.values.time)),
      ),
      h(
        'div',
        { class: 'form-row' },
        this.choiceField('accelerometerUnit', say('Unit of the accelerometer'), '--accelerometer-unit', Object.keys(tables.units.values.accelerometer)),
        this.numberField('accelerometerScale', say('Counts per unit'), '--accelerometer-scale'),
      ),
      h(
        'div',
        { class: 'form-row' },
        this.choiceField('gyroscopeUnit', say('Unit of the gyroscope'), '--gyroscope-unit', Object.keys(tables.units.values.gyroscope)),
        this.numberField('gyroscopeScale', say('Counts per unit'), '--gyroscope-scale'),
      ),
      h(
        'div',
        { class: 'form-row' },
        this.numberField('gravity', say('Local gravity, m/s²'), '--gravity'),
        this.textField('serial', say('Serial number'), '--serial'),
      ),
      this.flagField('raw', say('Readings are counts of a scale that nobody knows'), '--raw'),
      this.flagField('faces', say('The unit lay on the six faces of a box'), '--faces'),
      this.flagField('skipBadLines', say('Leave out lines that cannot be read, up to 1 %'), '--skip-bad-lines'),
    );
  }

  /** Shows the columns of a table with its first rows, each with a choice of what it is. */
  showColumns(names: readonly string[], rows: readonly string[][], known: Partial<Record<Channel, string>>): void {
    this.selects = names.map((name) => {
      const options = [h('option', { value: '' }, say('not read')), ...CHANNELS.map((each) => h('option', { value: each }, each))];
      const select = h('select', { 'aria-label': say('Meaning of column {name}', { name }), change: () => this.changed() }, ...options);
      select.value = CHANNELS.find((channel) => known[channel] === name) ?? '';
      return [name, select];
    });
    const head = this.selects.map(([name, select]) => h('th', { scope: 'col' }, h('span', { class: 'mono' }, name), select));
    const body = rows.map((row) => h('tr', {}, ...names.map((_, k) => h('td', { class: 'mono' }, row[k] ?? ''))));
    this.columns.replaceChildren(
      h('p', { class: 'help', id: 'columns-help' }, say('Choose the meaning of each column; the first rows of the log stand below.')),
      h(
        'div',
        { class: 'scrolled', tabindex: '0', role: 'region', 'aria-label': say('Columns of the log') },
        h('table', { class: 'table' }, h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...body)),
      ),
    );
  }

  /** Lets a person choose one of several IMUs. */
  showImus(names: readonly string[]): void {
    this.imus.setAttribute('aria-label', say('IMU of the log'));
    this.imus.replaceChildren(
      ...names.map((name) =>
        h(
          'button',
          {
            type: 'button', class: 'button small',
            'aria-pressed': String(this.imu === name),
            click: () => {
              this.imu = name;
              this.showImus(names);
              this.changed();
            },
          },
          name || say('without a name'),
        ),
      ),
    );
  }

  /** Forgets what was stated of another log. */
  forget(): void {
    this.imu = undefined;
    this.selects = [];
    this.columns.replaceChildren();
    this.imus.replaceChildren();
  }

  get options(): SessionOptions {
    const number = (name: string) => {
      const text = this.number.get(name)!.value.trim();
      return text === '' ? undefined : Number(text);
    };
    const chosen = this.selects.filter(([, select]) => select.value !== '');
    const columns = Object.fromEntries(chosen.map(([name, select]) => [select.value, name])) as ReadOptions['columns'];
    const read: ReadOptions = {
      columns: chosen.length ? columns : undefined,
      imu: this.imu,
      rate: number('rate'),
      timeUnit: this.choice.get('timeUnit')!.value || undefined,
      accelerometerUnit: this.choice.get('accelerometerUnit')!.value || undefined,
      gyroscopeUnit: this.choice.get('gyroscopeUnit')!.value || undefined,
      accelerometerScale: number('accelerometerScale'),
      gyroscopeScale: number('gyroscopeScale'),
      raw: this.flag.get('raw')!.checked,
      skipBadLines: this.flag.get('skipBadLines')!.checked,
      serial: this.number.get('serial')!.value,
    };
    return { read, gravity: number('gravity'), faces: this.flag.get('faces')!.checked };
  }

  private field(name: string, label: string, option: string, input: HTMLElement): HTMLElement {
    input.id = name;
    return h('div', { class: 'field' }, h('label', { for: name }, label, ' ', h('span', { class: 'mono option' }, option)), input);
  }

  private numberField(name: string, label: string, option: string): HTMLElement {
    const input = h('input', { type: 'number', step: 'any', min: '0', inputmode: 'decimal', change: () => this.changed() });
    this.number.set(name, input);
    return this.field(name, label, option, input);
  }

  private textField(name: string, label: string, option: string): HTMLElement {
    const input = h('input', { type: 'text', maxlength: '1000', autocomplete: 'off', change: () => this.changed() });
    this.number.set(name, input);
    return this.field(name, label, option, input);
  }

  private choiceField(name: string, label: string, option: string, values: readonly string[]): HTMLElement {
    const select = h(
      'select',
      { change: () => this.changed() },
      h('option', { value: '' }, say('as the log shows')),
      ...values.map((value) => h('option', { value }, value)),
    );
    this.choice.set(name, select);
    return this.field(name, label, option, select);
  }

  private flagField(name: string, label: string, option: string): HTMLElement {
    const input = h('input', { type: 'checkbox', id: name, change: () => this.changed() });
    this.flag.set(name, input);
    return h('label', { class: 'flag-row', for: name }, input, h('span', {}, label, ' ', h('span', { class: 'mono option' }, option)));
  }
}
