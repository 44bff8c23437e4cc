/** A mistake that a person can mend: one line with its place, its cause and the remedy. */
export class Failure extends Error {}
