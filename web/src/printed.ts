/** Numbers and text as Python prints them, so that messages and files of page and command are the same. */

/** The most decimals that are asked for: no number halfway between two of few digits has more. */
const ALL = 100;

/** Returns digits cut off before `end` if those behind are exactly a half and the last one is even: Python rounds to even. */
function evenBelow(digits: string, end: number): string | undefined {
  const below = digits.slice(0, end).replace(/\.$/, '');
  return /^\.?50*$/.test(digits.slice(end)) && Number(below.at(-1)) % 2 === 0 ? below : undefined;
}

/** Prints a number with so many decimals, as `%.1f` does. */
export function fixed(value: number, decimals: number): string {
  const digits = value.toFixed(ALL);
  const point = digits.indexOf('.');
  return (point < 0 ? undefined : evenBelow(digits, point + 1 + decimals)) ?? value.toFixed(decimals);
}

/** Prints a number as a mantissa of so many decimals and an exponent, as `%.1e` does. */
function exponential(value: number, decimals: number): [string, string] {
  const [mantissa, exponent] = value.toExponential(ALL).split('e');
  const below = evenBelow(mantissa, mantissa.indexOf('.') + 1 + decimals);
  if (below !== undefined) return [below, exponent];
  const [own, power] = value.toExponential(decimals).split('e');
  return [own, power];
}

/** Prints a number with so many significant digits, as `%.4g` does. */
export function general(value: number, digits = 6): string {
  if (Number.isNaN(value)) return 'nan';
  if (!Number.isFinite(value)) return value > 0 ? 'inf' : '-inf';
  if (value === 0) return Object.is(value, -0) ? '-0' : '0';
  const [mantissa, exponent] = exponential(value, digits - 1);
  const power = Number(exponent);
  if (power < -4 || power >= digits) return `${trimmed(mantissa)}e${signed(power)}`;
  return trimmed(fixed(value, Math.max(0, digits - 1 - power)));
}

/** Prints a number with its sign and so many significant digits, as `%+.2g` does. */
export function withSign(value: number, digits: number): string {
  const text = general(value, digits);
  return text.startsWith('-') ? text : `+${text}`;
}

/** Prints a number of a sentence, with two significant digits at least and no exponent where there is a way around it. */
export function plain(value: number): string {
  return Math.abs(value) >= 10 && Math.abs(value) < 1e6 ? fixed(value, 0) : general(value, 2);
}

/** Prints a number so that it is read back bit by bit, as `repr` does. */
export function exact(value: number): string {
  if (Object.is(value, -0)) return '-0.0';
  const text = String(value);
  const [digits, exponent] = text.split('e');
  const size = Math.abs(value);
  if (exponent !== undefined) return `${digits}e${signed(Number(exponent))}`;
  if (size >= 1e16) {
    const [whole, power] = value.toExponential().split('e');
    return `${whole}e${signed(Number(power))}`;
  }
  if (size !== 0 && size < 1e-4) {
    const [whole, power] = value.toExponential().split('e');
    return `${whole}e${signed(Number(power))}`;
  }
  return text.includes('.') ? text : `${text}.0`;
}

function trimmed(text: string): string {
  return text.includes('.') ? text.replace(/\.?0+$/, '') : text;
}

function signed(power: number): string {
  const size = String(Math.abs(power)).padStart(2, '0');
  return `${power < 0 ? '-' : '+'}${size}`;
}

const PLACE = /\{(\w+)(?::\.(\d+)([fg]))?\}/g;

/** Puts values into the places of a text of the command, as `str.format` does. */
export function filled(text: string, values: Record<string, string | number>): string {
  return text.replaceAll(PLACE, (_, name: string, digits: string | undefined, kind: string | undefined) => {
    const value = values[name];
    if (typeof value !== 'number' || digits === undefined) return String(value);
    return kind === 'f' ? fixed(value, Number(digits)) : general(value, Number(digits));
  });
}

/** Prints `1 target`, `5 targets`. */
export function countOf(thing: string, count: number): string {
  return `${count} ${thing}${count === 1 ? '' : 's'}`;
}

const MOST_LISTED = 24;

/** Lists names for a message, the first of them where there are many. */
export function listed(names: readonly string[]): string {
  const shown = names.slice(0, MOST_LISTED).join(', ');
  return names.length > MOST_LISTED ? `${shown}, and ${names.length - MOST_LISTED} more` : shown;
}

const LONGEST_QUOTED = 60;

/** Quotes text from outside: its beginning, without control characters. */
export function quoted(text: string): string {
  const short = text.length > LONGEST_QUOTED ? `${text.slice(0, LONGEST_QUOTED)}...` : text;
  return `'${escaped(short)}'`;
}

// Characters that change the direction of the text behind them, beside those of control.
const OBEYED = /[\u0000-\u001f\u007f-\u009f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069]/g;

/** Writes characters that a screen obeys instead of showing as escapes. */
export function escaped(text: string): string {
  return text.replace(OBEYED, (letter) => {
    const named = { '\t': '\\t', '\n': '\\n', '\r': '\\r' }[letter];
    const code = letter.codePointAt(0)!;
    return named ?? (code < 256 ? `\\x${code.toString(16).padStart(2, '0')}` : `\\u${code.toString(16).padStart(4, '0')}`);
  });
}

/** A number that is printed with a point, as one of Python's is. */
export class Float {
  constructor(readonly value: number) {}
}

export function float(value: number): Float {
  return new Float(value);
}
