/** Patterns of the tables, which are written for Python. */

/** A pattern that matches a whole text. */
export function pattern(text: string): RegExp {
  const ignoresCase = text.startsWith('(?i)');
  return new RegExp(`^(?:${text.replace('(?i)', '').replaceAll('(?P<', '(?<')})$`, ignoresCase ? 'i' : '');
}
