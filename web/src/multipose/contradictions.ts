/** What makes the gyroscope of the turns another one than that of the fit, in the words of the command. */

import tables from 'tables';
import type { Core } from '../core';
import type { Recording } from '../log/reading';
import { countOf, filled, general, withSign } from '../printed';
import type { MultiposeFigures, StampedRate, TurnBiasFigures } from './figures';

const table = tables.multipose;
const AXES = 'xyz';

/** A rate that a person stated, beside that of the stamps of the log. */
export interface StatedRate extends StampedRate {
  stated: number;
}

/** Compares the rate that a person stated, Hz, with the stamps of the log; nothing where there are none to compare. */
export function statedRate(core: Core, { stamps }: Recording, stated: number | undefined): StatedRate | undefined {
  if (stamps === undefined || stated === undefined) return undefined;
  const shown = core.ask<StampedRate | null>({ ask: 'stamped-rate', stated }, [stamps]);
  return shown ? { stated, ...shown } : undefined;
}

/** Names both rates, and the samples that are missing. */
export function statedRateWords({ stated, shown, missing, agrees }: StatedRate): string {
  const lost = missing ? `, with ${countOf('sample', missing)} missing` : '';
  if (agrees) {
    return (
      `--rate states ${general(stated)} Hz, and the log's stamps show ${general(shown, 5)} Hz${lost}: a turn that lost ` +
      'samples is cut short; leave out --rate'
    );
  }
  const off = 100 * (shown / stated - 1);
  return (
    `--rate states ${general(stated)} Hz, but the log's stamps show ${general(shown, 5)} Hz${lost}: the gyroscope's scale ` +
    `is off by ${withSign(off, 2)} %; leave out --rate, or the time column if that is wrong`
  );
}

/** Tests whether a stated rate is no objection to the gyroscope, but worth a warning. */
export function isAWarning({ missing, agrees }: StatedRate, hasGyroscope: boolean): boolean {
  return agrees ? missing > 0 : !hasGyroscope;
}

/** Lists the objections to the gyroscope of a fit. */
export function* contradictions(
  figures: NonNullable<MultiposeFigures['gyroscope']>,
  rate: StatedRate | undefined,
  onFaces: boolean,
): Generator<string> {
  const contradicts = rate !== undefined && !rate.agrees;
  if (contradicts) yield statedRateWords(rate);
  const { dead_band: band, turn_bias: bias, turn_loss: loss, turn_widening: widening } = figures;
  if (band) {
    yield `the gyroscope has a dead band: about ${AXES[band[0]]} it reads no rate below ${general(1e3 * band[1], 2)} mrad/s ` +
      'in any turn; its bias cannot be found from rests';
  } else if (bias?.contradicts) {
    yield turnBiasWords(bias);
  } else if (loss) {
    yield turnLossWords(loss);
  } else if (!contradicts && !onFaces && widening > table.largestWidening) {
    // On faces full turns show the scale, within the degree that a hand and an edge are known to.
    yield filled(table.notRandom, { times: widening });
  }
}

function turnLossWords(loss: [number, number]): string {
  const [angle, sigma] = loss.map((each) => (each * 180) / Math.PI);
  return (
    `the gyroscope loses ${general(angle, 2)} ± ${general(sigma, 1)} deg in every turn, however far it goes: it zeroes itself ` +
    'while it turns slowly, or has a dead band; turns do not show its scale'
  );
}

function turnBiasWords({ difference, sigma }: TurnBiasFigures): string {
  const sizes = difference.map((value, axis) => Math.abs(value) / sigma[axis]);
  const axis = sizes.indexOf(Math.max(...sizes));
  const apart =
    `${withSign(1e3 * difference[axis], 2)} ± ${general(1e3 * sigma[axis], 1)} mrad/s about ${AXES[axis]}`;
  return (
    `the gyroscope reads otherwise in turns than at rest, by ${apart}: it zeroes itself at rest, or has a dead band; its ` +
    'bias cannot be found from rests'
  );
}
