/** Pictures of a result: gravity before and after, and the directions that were held. */

import { general } from '../printed';
import { say } from './words';

const SVG = 'http://www.w3.org/2000/svg';

function shape(tag: string, properties: Record<string, string | number>, text?: string): SVGElement {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(properties)) element.setAttribute(name, String(value));
  if (text !== undefined) element.textContent = text;
  return element;
}

/** Draws how far the length of gravity is off at each rest, as read and calibrated, m/s². */
export function gravityChart(before: readonly number[], after: readonly number[]): SVGElement {
  const [width, height, left, right, top, bottom] = [640, 260, 64, 12, 14, 34];
  const size = Math.max(...before.map(Math.abs), ...after.map(Math.abs), 1e-6) * 1.1;
  const x = (k: number) => left + ((k + 0.5) / before.length) * (width - left - right);
  const y = (value: number) => top + ((size - value) / (2 * size)) * (height - top - bottom);
  const words = say('Length of gravity less {gravity} at {count} rests: up to {before} m/s² raw, {after} m/s² calibrated.', {
    gravity: 'g',
    count: before.length,
    before: general(Math.max(...before.map(Math.abs)), 2),
    after: general(Math.max(...after.map(Math.abs)), 2),
  });
  const picture = shape('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', class: 'chart', 'aria-label': words });
  for (const value of [-size, 0, size].map((each) => each / 1.1)) {
    picture.append(
      shape('line', { x1: left, x2: width - right, y1: y(value), y2: y(value), class: 'grid' }),
      shape('text', { x: left - 8, y: y(value) + 6, class: 'tick', 'text-anchor': 'end' }, general(value, 2)),
    );
  }
  before.forEach((value, k) => picture.append(shape('rect', { x: x(k) - 5, y: y(value) - 5, width: 10, height: 10, class: 'before' })));
  after.forEach((value, k) => picture.append(shape('circle', { cx: x(k), cy: y(value), r: 5, class: 'after' })));
  picture.append(shape('text', { x: (left + width - right) / 2, y: height - 6, class: 'tick', 'text-anchor': 'middle' }, say('rest')));
  return picture;
}

interface Sphere {
  held: readonly (readonly number[])[];
  next: readonly number[] | undefined;
}

const SIZE = 520;

/** Draws the directions that were up, on a sphere seen from two sides, and the next best one. */
export function drawSphere(canvas: HTMLCanvasElement, { held, next }: Sphere): void {
  const context = canvas.getContext('2d')!;
  const style = getComputedStyle(document.body);
  const colour = (name: string) => style.getPropertyValue(name);
  [canvas.width, canvas.height] = [2 * SIZE, SIZE];
  context.fillStyle = colour('--surface');
  context.fillRect(0, 0, canvas.width, canvas.height);
  const radius = SIZE * 0.4;
  [1, -1].forEach((side, half) => {
    const [cx, cy] = [SIZE * (half + 0.5), SIZE / 2];
    context.strokeStyle = colour('--muted');
    context.lineWidth = 2;
    for (const share of [1 / 3, 2 / 3, 1]) {
      context.beginPath();
      context.arc(cx, cy, radius * share, 0, 2 * Math.PI);
      context.stroke();
    }
    context.fillStyle = colour('--text');
    context.font = '26px system-ui, sans-serif';
    context.textAlign = 'center';
    context.fillText(side > 0 ? '+z' : '−z', cx, 32);
    // Equal areas: what is held evenly looks even.
    const place = ([x, y, z]: readonly number[]) => {
      const away = radius * Math.sqrt(Math.max(0, 1 - side * z));
      const across = Math.hypot(x, y) || 1;
      return [cx + (side * away * x) / across, cy - (away * y) / across];
    };
    const onSide = (direction: readonly number[]) => side * direction[2] >= 0;
    context.fillStyle = colour('--good');
    for (const direction of held.filter(onSide)) {
      const [px, py] = place(direction);
      context.beginPath();
      context.arc(px, py, 9, 0, 2 * Math.PI);
      context.fill();
    }
    if (next && onSide(next)) {
      const [px, py] = place(next);
      context.strokeStyle = colour('--warn');
      context.lineWidth = 5;
      context.beginPath();
      context.arc(px, py, 15, 0, 2 * Math.PI);
      context.stroke();
    }
  });
}

/** Says which way up an orientation is, as the screens of the command do: `z up`, tilted so far towards another axis. */
export function directionWords(up: readonly number[]): string {
  const order = [0, 1, 2].sort((a, b) => Math.abs(up[b]) - Math.abs(up[a]));
  const [first, second] = order;
  const axis = (k: number) => `${up[k] < 0 ? '-' : '+'}${'xyz'[k]}`;
  const tilt = (Math.acos(Math.min(1, Math.abs(up[first]))) * 180) / Math.PI;
  return tilt < 5
    ? say('{axis} up', { axis: axis(first) })
    : say('{axis} up, tilted by {angle} degrees so that {other} rises', {
        axis: axis(first), angle: tilt.toFixed(0), other: axis(second),
      });
}
