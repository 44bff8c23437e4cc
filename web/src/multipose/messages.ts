/** Why a triad has no calibration, in words a person can act on. */

import tables from 'tables';
import { countOf, fixed, general } from '../printed';
import type { Refusal } from './figures';

const table = tables.multipose;
const FACES = 6;

export function explain([word, figures]: Refusal): string {
  const constant: Record<string, string> = table.refusals;
  if (word in constant) return constant[word];
  switch (word) {
    case 'too few directions': {
      const rests = countOf('rest', figures.rests);
      const seen =
        figures.found === 1
          ? `shows one orientation only, in ${rests}: any nine numbers fit that`
          : `shows ${figures.found} orientations, in ${rests}; nine unknowns would fit so few whatever their values`;
      const faces = figures.found === FACES ? table.sixFaces : '';
      return (
        `${seen}; hold the unit still for 3 s or longer in ${figures.needed} different orientations or more, 15 to 20 ` +
        `are good${faces}`
      );
    }
    case 'faces missing':
      return (
        `shows no rest on ${figures.missing!.join(', ')}; lay the unit for 3 s or longer on each of six faces, each axis ` +
        'up (_p) and down (_a), or calibrate without --faces from 10 orientations or more'
      );
    case 'poses leave open':
      return (
        `its poses lie almost in a plane or on a cone, and leave open: ${open(figures.shares!)}; add poses across it, ` +
        'with each axis up, down and in between'
      );
    case 'turns leave open':
      return `the turns leave open of the gyroscope: ${open(figures.shares!)}; turn about each axis, also while it is level`;
    case 'gyroscope contradicts':
      return (
        `gyroscope and accelerometer disagree by ${fixed(figures.angle, 0)} deg about how the unit turned, whatever the ` +
        'scale; check units and axes of both, and that both belong to one unit'
      );
    default:
      throw new Error(`no words for ${word}`);
  }
}

function open(shares: readonly number[]): string {
  const order = shares.map((share, place) => ({ share, place })).sort((a, b) => b.share - a.share);
  return order.filter(({ share }) => share > table.notableShare).map(({ place }) => table.shares[place]).join(', ');
}

/** Describes how a unit trembled, by the amplitude of its angular rate, rad/s, and its frequency, Hz. */
export function tremorWords(tremor: [number, number] | null): string {
  return tremor === null ? '' : `trembles: ${general(1e3 * tremor[0], 2)} mrad/s at ${general(tremor[1], 2)} Hz`;
}
