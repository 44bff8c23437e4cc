"""Rests in the hand that tremble: poses used, and whether sigmas of multi-pose hold.

`python -m benchmarks.tremor [--sessions 24]`
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
from rich.console import Console

import tumble
from benchmarks.bound import TRIADS
from benchmarks.hands import session, sigmas_off, trembling
from benchmarks.results import Content, machine, save
from tumble.foundation.results import INTERVAL

BASE_SEED = 27_800
POSES = 22
COVERAGE = (0.93, 0.97)
FREQUENCIES = (6.0, 11.0)
"""Hz; each session draws its own."""
AMPLITUDES = (0.02, 0.05, 0.08)
"""deg about each axis."""
TREMBLING = (16, POSES)
"""Rests that tremble, of all."""


def trial(shaken: int, amplitude: float, seed: int) -> Content:
    """Plays a session; returns the poses it uses and errors over sigma."""
    draws = np.random.default_rng(seed)
    hand, rests = session(seed, POSES)
    chosen = sorted(draws.permutation(len(rests))[:shaken])
    recording = trembling(
        hand,
        [rests[place] for place in chosen],
        amplitude=np.radians(amplitude),
        frequency=draws.uniform(*FREQUENCIES),
        seed=seed,
    )
    found = tumble.multipose(recording)
    used = sum(
        any(rest.used and rest.start < end and start < rest.end for rest in found.rests)
        for start, end in rests
    )
    off = dict(zip(TRIADS, sigmas_off(found, hand), strict=True))
    return {"used": used, "of": len(rests), **off}


def statistics(shaken: int, amplitude: float, sessions: int) -> Content:
    """Returns the figures of one tremor."""
    trials = [trial(shaken, amplitude, BASE_SEED + k) for k in range(sessions)]
    row: Content = {
        "trembling": shaken,
        "amplitude": amplitude,
        "sessions": sessions,
        "seeds": [BASE_SEED, BASE_SEED + sessions - 1],
        "used": sum(each["used"] for each in trials),
        "of": sum(each["of"] for each in trials),
    }
    for triad in TRIADS:
        off = np.concatenate([each[triad] for each in trials])
        row[triad] = {
            "z": float(np.sqrt(np.mean(off**2))),
            "coverage": float(np.mean(np.abs(off) < INTERVAL)),
        }
    return row


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=24, help="simulated sessions of each tremor")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    cases = [(0, 0.0), *((shaken, amplitude) for shaken in TREMBLING for amplitude in AMPLITUDES)]
    content: Content = {
        "machine": machine(),
        "poses": POSES,
        "frequencies": FREQUENCIES,
        "tremors": [statistics(*case, options.sessions) for case in cases],
    }
    console = Console()
    console.print(content)
    if not options.no_save:
        console.print(f"written to {save('tremor', content)}")


if __name__ == "__main__":
    main()
