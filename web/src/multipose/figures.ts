/** Figures of the core, as crates/tumble-web gives them: what is no number is null. */

type Vector = number[];
type Numbers = (number | null)[];

export interface TriadFigures {
  M: Vector[];
  b: Vector;
  covariance: Vector[];
  observed: boolean[];
  scale: Vector;
  L: Vector[];
  Q: Vector[];
  values: Vector;
  sigmas: Numbers;
  rank: number;
  widened: number;
  variance_freedom: number | null;
  chi_square: number | null;
  degrees_of_freedom: number;
  residuals: Vector[];
  residual_sigmas: Numbers[];
  labels: [string, number, number][];
}

/** A channel that cannot be trusted; times in s, values in SI. */
export interface ChannelFault {
  channel: string;
  kind: string;
  value: number;
  first: number;
  last: number;
  samples: number;
  /** First and last time of each run at the end of the range. */
  runs: [number, number][];
}

/** What a recording shows before it is calibrated. */
export interface AcquireAnswer {
  /** Units whose samples take turns; 1 of one. */
  units: number;
  /** First and last time, s, of stretches in which all readings stood still. */
  frozen: [number, number][];
  /** Channels that repeated one reading while others went on. */
  stuck: ChannelFault[];
  acquired: AcquiredFigures;
}

export interface AcquiredFigures {
  samples: number;
  not_finite: number;
  missing: number;
  first_backwards: number | null;
  temperature: [number, number, number] | null;
  rest_times: [number, number][];
  rest_specific_force: Vector[];
  turn_complete: boolean[];
  rejected_rests: [number, number, string][];
  noise_density: Numbers;
  bias_instability: Numbers;
  faults: ChannelFault[];
  /** Channel, step, half the width of the dead band, share of zeros, 1-sigma that both leave on a mean. */
  coarse_channels: [string, number, number, number, number][];
  consistency: [string, number, [number, number][]];
  trace: { time: number[]; channels: Vector[] };
}

export type Refusal = [string, Record<string, number> & { shares?: number[]; missing?: string[] }];

/** Bias that turns show less that of rests, rad/s. */
export interface TurnBiasFigures {
  difference: Vector;
  sigma: Vector;
  contradicts: boolean;
}

/** Rate that the stamps of a log show, Hz, beside one that was stated. */
export interface StampedRate {
  shown: number;
  missing: number;
  agrees: boolean;
}

export interface MultiposeFigures {
  refusal?: Refusal;
  tolerance: number;
  nominal_scale: [number, number] | null;
  accelerometer: TriadFigures;
  non_linearity: [Vector[], Vector[]] | null;
  poses: {
    force: Vector[];
    before: number[];
    after: number[];
    sigma: number[];
    weight: number[];
    leverage: number[];
    held_out: Numbers;
    direction: number[];
  };
  next: { up: Vector; unknown: number; before: number; after: number } | null;
  gyroscope: {
    calibration: TriadFigures;
    turns: [number, number][];
    angles_before: number[];
    angles_after: number[];
    with_g_sensitivity: number | null;
    implausible_scale: number | null;
    turn_excess: number;
    bias_excess: number;
    turn_bias: TurnBiasFigures | null;
    /** Angle that every turn loses, and its 1-sigma, rad; null where turns lose none. */
    turn_loss: [number, number] | null;
    /** Place of the axis, and half the width, rad/s. */
    dead_band: [number, number] | null;
    turn_widening: number;
  } | null;
  gyroscope_refusal: Refusal | null;
  left_out: [number, number, [number, number] | null][];
  acquired: AcquiredFigures;
}
