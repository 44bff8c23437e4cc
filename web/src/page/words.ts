/** Texts in the language of the person, from the catalogue of the package. */

import tables from 'tables';

type Values = Record<string, string | number>;

const PLACE = /\{(\w+)\}/g;
const { texts, seams } = tables.catalogue as { texts: Record<string, string>; seams: Record<string, string> };

export const LANGUAGES: Record<string, string> = { en: 'English', 'zh-CN': '简体中文' };

let language = 'en';

/** Returns the language that a browser asks for, of those there are. */
export function preferred(wanted: readonly string[]): string {
  return wanted.some((each) => each.toLowerCase().startsWith('zh')) && !wanted[0]?.toLowerCase().startsWith('en')
    ? 'zh-CN'
    : 'en';
}

export function setLanguage(code: string): void {
  language = code in LANGUAGES ? code : 'en';
}

/** Says a text of the page with values in its places. */
export function say(text: string, values: Values = {}): string {
  const own = language === 'en' ? text : (texts[text] ?? text);
  return own.replaceAll(PLACE, (_, name: string) => String(values[name] ?? ''));
}

interface Template {
  pattern: RegExp;
  translation: string;
  landmark: string;
}

let templates: Template[] | undefined;

/** Says a message that was put together elsewhere: whole, by the template it was made from, or by its parts. */
export function translated(text: string): string {
  return language === 'en' ? text : (found(text, 0) ?? text);
}

const DEEPEST = 4;
const SEAMS = ['; ', ': ', ', '];

function found(text: string, depth: number): string | undefined {
  if (!/[A-Za-z]{2}/.test(text)) return text;
  if (Object.hasOwn(texts, text)) return texts[text];
  if (depth > DEEPEST) return undefined;
  for (const { pattern, translation, landmark } of (templates ??= made())) {
    const match = text.includes(landmark) ? pattern.exec(text) : null;
    if (!match) continue;
    const groups = match.groups ?? {};
    return translation.replaceAll(PLACE, (_, name: string) => found(groups[name] ?? '', depth + 1) ?? groups[name] ?? '');
  }
  for (const seam of SEAMS) {
    const place = text.indexOf(seam);
    if (place <= 0) continue;
    const [first, rest] = [text.slice(0, place), text.slice(place + seam.length)];
    const [own, other] = [found(first, depth + 1), found(rest, depth + 1)];
    if (own !== undefined || other !== undefined) return `${own ?? first}${seams[seam] ?? seam}${other ?? rest}`;
  }
  return undefined;
}

function made(): Template[] {
  const letters = (text: string) => text.replaceAll(PLACE, '').length;
  return Object.entries(texts)
    .filter(([text]) => /\{\w+\}/.test(text) && letters(text) >= 12)
    .sort(([one], [other]) => letters(other) - letters(one))
    .map(([text, translation]) => {
      const seen = new Set<string>();
      const parts = text.split(/\{(\w+)\}/);
      const pattern = parts.map((part, k) => {
        if (k % 2 === 0) return part.replaceAll(/[.*+?^${}()|[\]\\]/g, '\\$&');
        if (seen.has(part)) return `\\k<${part}>`;
        seen.add(part);
        return `(?<${part}>.*?)`;
      });
      const landmark = parts.filter((_, k) => k % 2 === 0).reduce((most, part) => (part.length > most.length ? part : most));
      return { pattern: new RegExp(`^${pattern.join('')}$`, 's'), translation, landmark };
    });
}
