/** YAML as calibration files hold it: rows of numbers and small records on one line; floats read back bit by bit. */

import { exact, Float } from './printed';

/** Prints a document under a comment; what is undefined is left out. */
export function documentText(header: string, content: Record<string, unknown>): string {
  const comment = header.split('\n').map((line) => `# ${line}\n`).join('');
  return comment + mapping(content, '');
}

function mapping(content: Record<string, unknown>, indent: string): string {
  return Object.entries(content)
    .filter(([, value]) => value !== undefined)
    .map(([key, value]) => `${indent}${scalar(key)}:${beside(value, indent)}`)
    .join('');
}

/** Prints a value behind its key. */
function beside(value: unknown, indent: string): string {
  if (isRecord(value) && !isSmall(value)) return `\n${mapping(value, `${indent}  `)}`;
  if (Array.isArray(value) && !isFlow(value)) {
    return `\n${value.map((item) => `${indent}- ${inFlow(item)}\n`).join('')}`;
  }
  return ` ${typeof value === 'string' ? scalar(value) : inFlow(value)}\n`;
}

function isRecord(value: unknown): value is Record<string, unknown> {
  return value !== null && typeof value === 'object' && !Array.isArray(value) && !ArrayBuffer.isView(value) && !(value instanceof Float);
}

/** A record of floats alone stands on one line. */
function isSmall(value: Record<string, unknown>): boolean {
  const items = Object.values(value);
  return items.length > 0 && items.every((item) => item === null || item instanceof Float);
}

function isFlow(value: unknown[]): boolean {
  return !value.some((item) => isRecord(item) || Array.isArray(item) || ArrayBuffer.isView(item));
}

function inFlow(value: unknown): string {
  if (value instanceof Float) return number(value.value);
  if (ArrayBuffer.isView(value)) return `[${Array.from(value as Float64Array, number).join(', ')}]`;
  if (Array.isArray(value)) return `[${value.map(inFlow).join(', ')}]`;
  if (isRecord(value)) {
    const items = Object.entries(value).map(([key, item]) => `${scalar(key)}: ${inFlow(item)}`);
    return `{${items.join(', ')}}`;
  }
  return typeof value === 'string' ? scalar(value, true) : String(value);
}

function number(value: number): string {
  return Number.isNaN(value) ? 'null' : exact(value);
}

const NUMBER_LIKE = /^(?:[-+]?[0-9]+|[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$/;
const OTHER_TYPES =
  /^(?:yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF|~|null|Null|NULL|=|<<|)$/;
// Whole numbers and times of YAML 1.1: with underscores, in other bases, in sixties; dates.
const OLDER_NUMBERS =
  /^(?:[-+]?0b[0-1_]+|[-+]?0[0-7_]+|[-+]?(?:0|[1-9][0-9_]*)|[-+]?0x[0-9a-fA-F_]+|[-+]?[1-9][0-9_]*(?::[0-5]?[0-9])+|[-+]?(?:[0-9][0-9_]*)\.[0-9_]*(?:[eE][-+][0-9]+)?|\.[0-9][0-9_]*(?:[eE][-+][0-9]+)?|[-+]?[0-9][0-9_]*(?::[0-5]?[0-9])+\.[0-9_]*)$/;
const DATES =
  /^(?:\d{4}-\d{2}-\d{2}|\d{4}-\d{1,2}-\d{1,2}(?:[Tt]|[ \t]+)\d{1,2}:\d{2}:\d{2}(?:\.\d*)?(?:[ \t]*(?:Z|[-+]\d{1,2}(?::\d{2})?))?)$/;

/** Prints text: bare where it reads back as text, in single quotes, or in double quotes where it holds control codes. */
function scalar(text: string, isFlow = false): string {
  if (needsDouble(text)) return doubleQuoted(text);
  const typed = NUMBER_LIKE.test(text) || OTHER_TYPES.test(text) || OLDER_NUMBERS.test(text) || DATES.test(text);
  return typed || !isBare(text, isFlow) ? `'${text.replaceAll("'", "''")}'` : text;
}

function isBare(text: string, isFlow: boolean): boolean {
  if (/^[\s]|[\s]$/.test(text)) return false;
  if (/^[#,[\]{}&*!|>'"%@`]/.test(text) || /^(?:---|\.\.\.)/.test(text)) return false;
  if (/^[-?:](?:\s|$)/.test(text)) return false;
  if (isFlow && /^[-?:]/.test(text) && text.length === 1) return false;
  if (/:(?:\s|$)| #/.test(text)) return false;
  return !(isFlow && /[,?[\]{}:]/.test(text) && (/[,?[\]{}]/.test(text) || /:(?:\s|$)/.test(text)));
}

function needsDouble(text: string): boolean {
  return /[^\x20-\x7e\u00a0-\ud7ff\ue000-\ufefe\uff00-\ufffd\u{10000}-\u{10ffff}]/u.test(text);
}

const NAMED: Record<string, string> = {
  '\0': '0', '\x07': 'a', '\b': 'b', '\t': 't', '\n': 'n', '\v': 'v', '\f': 'f', '\r': 'r', '\x1b': 'e', '"': '"',
  '\\': '\\', '\x85': 'N', '\xa0': '_', '\u2028': 'L', '\u2029': 'P',
};

function doubleQuoted(text: string): string {
  const letters = [...text].map((letter) => {
    if (letter in NAMED) return `\\${NAMED[letter]}`;
    if (!needsDouble(letter)) return letter;
    const code = letter.codePointAt(0)!.toString(16).toUpperCase();
    return code.length <= 2 ? `\\x${code.padStart(2, '0')}` : code.length <= 4 ? `\\u${code.padStart(4, '0')}` : `\\U${code.padStart(8, '0')}`;
  });
  return `"${letters.join('')}"`;
}
