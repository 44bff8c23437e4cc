"""Noise terms: do intervals hold the truth, how fast beside allantools, and does memory stay flat?

`python -m benchmarks.noise_terms [--records 204] [--hours 3]`

allantools, the peer, is asked for its `oadev` over the same averaging times of the same samples.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
from rich.console import Console

from benchmarks.results import Content, machine, save
from benchmarks.spin import CORES
from tumble import _core

TERMS = ("quantisation", "white noise", "bias instability", "random walk", "ramp")
CHANNELS = 6
COVERAGE = (0.91, 0.985)
"""Coverage by 204 records: 95 % within the limits of chance for 99 of 100 such shares."""
PROMISED = ("white noise", "bias instability", "random walk")
FASTER = 20.0
LARGEST_NOISE_GROWTH = 1.05
RATE_HZ, PEER_RATE_HZ = 10.0, 400.0

TRUTHS: dict[str, tuple[float, ...]] = {
    "N, B, K, 2 h": (0.0, 1e-3, 3e-4, 6e-5, 0.0),
    "N, B below, K below, 2 h": (0.0, 1e-3, 1e-4, 1e-5, 0.0),
    "Q, N, B, K, 2 h": (1e-3, 1e-3, 3e-4, 6e-5, 0.0),
}
"""Q, N, B, K and R; of some the length shows little, and a bound has to hold."""
SAMPLES = 72_000


def _sessions(task: tuple[str, int]) -> list[list[tuple[bool, bool]]]:
    """Coverage and identifiability of each channel and term: interval holds the truth, term identifiable."""
    name, session = task
    truth = TRUTHS[name]
    seed = 1000 * list(TRUTHS).index(name) + session
    source = _core.StillNoise(seed, np.array([truth] * CHANNELS), RATE_HZ, SAMPLES)
    record = _core.NoiseRecord(CHANNELS, True)
    record.push(source.draw(SAMPLES))
    record.end_stretch()
    found = []
    for channel in record.conclude(1.0 / RATE_HZ):
        fit = channel["fit"]
        assert fit is not None
        held = [
            (bool(term["low"] <= true <= term["high"]), bool(term["identifiable"]))
            for term, true in zip(fit["terms"], truth, strict=True)
        ]
        found.append(held)
    return found


def intervals(records: int) -> list[Content]:
    """Returns the share of intervals that hold the truth, for each truth and term."""
    sessions = -(-records // CHANNELS)
    rows = []
    with ProcessPoolExecutor(CORES, get_context("spawn")) as pool:
        for name, truth in TRUTHS.items():
            tasks = [(name, session) for session in range(sessions)]
            channels = [channel for found in pool.map(_sessions, tasks) for channel in found]
            shares = np.array(channels).mean(axis=0)
            rows.append(
                {
                    "name": name,
                    "records": len(channels),
                    "truth": dict(zip(TERMS, truth, strict=True)),
                    "coverage": dict(zip(TERMS, shares[:, 0].tolist(), strict=True)),
                    "identifiable": dict(zip(TERMS, shares[:, 1].tolist(), strict=True)),
                }
            )
    return rows


def speed(hours: float) -> Content:
    """Time both over the same samples and averaging times; the best of three, and of the peer of one."""
    samples = round(3600.0 * hours * PEER_RATE_HZ)
    values = np.random.default_rng(1).normal(size=(samples, CHANNELS))
    ours, with_fit, found = [], [], []
    for _ in range(3):
        record = _core.NoiseRecord(CHANNELS, True)
        begin = time.perf_counter()
        record.push(values)
        record.end_stretch()
        ours.append(time.perf_counter() - begin)
        found = record.conclude(1.0 / PEER_RATE_HZ)
        with_fit.append(time.perf_counter() - begin)
    taus = found[0]["allan"][:, 0]
    content: Content = {
        "hours": hours,
        "averaging_times": len(taus),
        "seconds": min(ours),
        "seconds_with_fit": min(with_fit),
    }
    return content | _peer(values, found, taus, min(with_fit))


def _peer(
    values: np.ndarray[Any, np.dtype[np.float64]], found: list[Any], taus: object, ours: float
) -> Content:
    import allantools

    begin = time.perf_counter()
    curves = [
        allantools.oadev(column, rate=PEER_RATE_HZ, data_type="freq", taus=taus)
        for column in np.ascontiguousarray(values.T)
    ]
    seconds = time.perf_counter() - begin
    apart = [
        np.abs(np.interp(tau, mine["allan"][:, 0], mine["allan"][:, 1]) / deviation - 1.0)
        for mine, (tau, deviation, _, _) in zip(found, curves, strict=True)
    ]
    sigmas = [
        gap * np.sqrt(2.0 * np.interp(tau, mine["allan"][:, 0], mine["allan"][:, 4]))
        for gap, mine, (tau, *_) in zip(apart, found, curves, strict=True)
    ]
    return {
        "peer": f"allantools {allantools.__version__}",
        "peer_seconds": seconds,
        "times_faster": seconds / ours,
        "largest_difference_sigmas": float(np.max(sigmas)),
    }


def memory() -> Content:
    """Measures how much a record ten times as long takes more, MiB, besides its samples."""
    grown = []
    record = _core.NoiseRecord(CHANNELS)
    chunk = np.random.default_rng(1).normal(size=(65_536, CHANNELS))
    for chunks in (16, 144):
        for _ in range(chunks):
            record.push(chunk)
        grown.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)
    return {"mebibytes": grown, "growth": grown[1] / grown[0]}


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=204, help="simulated records of each truth")
    parser.add_argument("--hours", type=float, default=3.0, help="length of the record that is timed")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    content: Content = {"machine": machine(), "memory": memory(), "intervals": intervals(options.records)}
    content["speed"] = speed(options.hours)
    console.print(content)
    if not options.no_save:
        console.print(f"written to {save('noise_terms', content)}")
    return content


if __name__ == "__main__":
    main()
