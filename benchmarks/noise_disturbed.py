"""Noise with disturbances: white noise N of an hour with a step, knock, ramp, hum or filter; false alarms.

`python -m benchmarks.noise_disturbed [--records 4]`

A record is six channels at 100 Hz for an hour, of known terms; each is made of its seed alone.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
from rich.console import Console

import tumble
from benchmarks.results import Content, machine, save
from tumble import _core
from tumble.foundation.noise_terms import WHITE
from tumble.foundation.recording import FloatArray, Recording
from tumble.procedures.noise.result import KNOCK, STEP, NoiseResult
from tumble.procedures.noise.result import RAMP_OF_LEVEL as RAMP

BASE_SEED = 27_600
LARGEST_ERROR = 0.02
"""Error of N, where a step had made it 14 % wrong."""
COVERAGE = (0.9, 1.0)
"""Share of a few channels."""
MOST_ALARMS = 0.02
CLEAR_STEP = 2.0
"""mm/s^2, where N is 1 mm/s^2/sqrt(Hz)."""
RATE_HZ, SECONDS = 100.0, 3600.0
DENSITY, FLICKER, WALK = 1e-3, 3e-4, 6e-5
"""N, B and K of a channel, unit/sqrt(Hz), unit and unit/s/sqrt(Hz)."""
MIDDLE = 0.5 * SECONDS
"""s, time of steps, ramps and knocks."""
UNSEEN_HUM = 99.8
"""Hz; sampled at 100 Hz it is a line at 0.2 Hz."""
CASES = ("none", "step", "knock", "ramp", "hum", "low-pass")
NAMED = {"step": STEP, "knock": KNOCK, "ramp": RAMP}
CLEAN = {
    "white noise": (0.0, DENSITY, 0.0, 0.0, 0.0),
    "and bias instability": (0.0, DENSITY, FLICKER, 0.0, 0.0),
    "and random walk": (0.0, DENSITY, FLICKER, WALK, 0.0),
}
"""Q, N, B, K and R of a clean hour."""
STEPS = (0.5, 1.0, 2.0, 4.0)
"""mm/s^2."""


def drawn(terms: Sequence[float], seed: int, seconds: float = SECONDS) -> tuple[FloatArray, FloatArray]:
    """Time (n,), s, and samples (n, 6) of channels of these terms."""
    samples = round(seconds * RATE_HZ)
    values = _core.StillNoise(seed, np.array([terms] * 6), RATE_HZ, samples).draw(samples)
    return np.arange(samples) / RATE_HZ, np.asarray(values)


def disturbed(case: str, seed: int) -> tuple[FloatArray, FloatArray]:
    """Time and samples of an hour of white noise and of one disturbance of every channel."""
    time, values = drawn(CLEAN["white noise"], seed)
    if case == "step":
        values[time >= MIDDLE] += 0.02
    elif case == "knock":
        struck = (time >= MIDDLE) & (time < MIDDLE + 0.2)
        values[struck] += 0.5 * np.sin(40.0 * np.pi * time[struck])[:, None]
    elif case == "ramp":
        values += 0.02 * np.clip((time - MIDDLE) / 100.0, 0.0, 1.0)[:, None]
    elif case == "hum":
        values += 0.005 * np.sin(2.0 * np.pi * UNSEEN_HUM * time)[:, None]
    elif case == "low-pass":
        # First order, 10 ms.
        response = np.exp(-np.arange(20.0))
        values = np.column_stack(
            [np.convolve(column, response / response.sum(), "valid") for column in values.T]
        )
        time = time[: len(values)]
    return time, values


def found_of(time: FloatArray, values: FloatArray) -> NoiseResult:
    """Noise of a unit that reads these samples and gravity."""
    return tumble.noise(
        Recording.from_arrays("still", time, values[:, :3] + [0.0, 0.0, 9.80665], values[:, 3:])
    )


def density(case: str, records: int) -> Content:
    """Error and coverage of N with one disturbance, and the share of channels that name it, or where it is
    no step, knock or ramp name none."""
    errors, held, identifiable, widths, named, warned = [], [], [], [], [], []
    for k in range(records):
        result = found_of(*disturbed(case, BASE_SEED + k))
        kinds = [
            [each.kind for each in result.disturbances if each.channel == channel.name] for channel in result
        ]
        named += [NAMED[case] in of if case in NAMED else not of for of in kinds]
        for channel in result:
            term = channel.term(WHITE)
            errors.append(term.value / DENSITY - 1.0)
            held.append(term.low <= DENSITY <= term.high)
            widths.append((term.high - term.low) / (2.0 * DENSITY))
            identifiable.append(term.observable)
            warned.append(channel.misfit > 0.0 or channel.filter > 0.0)
    return {
        "case": case,
        "channels": len(errors),
        "error": float(np.sqrt(np.mean(np.square(errors)))),
        "mean": float(np.mean(errors)),
        "half_width": float(np.mean(widths)),
        "coverage": float(np.mean(held)),
        "identifiable": float(np.mean(identifiable)),
        "named": float(np.mean(named)),
        "warned": float(np.mean(warned)),
    }


def watched(time: FloatArray, values: FloatArray) -> list[list[_core.DisturbanceFigures]]:
    """Disturbances of each channel."""
    watch = _core.NoiseWatch(6)
    watch.push(time, np.ascontiguousarray(values), True)
    return [of_channel for of_channel, _ in watch.conclude()]


def false_alarms(name: str, records: int) -> Content:
    """Counts disturbances that clean hours are given."""
    found = [
        each
        for k in range(records)
        for of in watched(*drawn(CLEAN[name], BASE_SEED + 100 + k))
        for each in of
    ]
    return {"noise": name, "channels": 6 * records, "alarms": len(found)}


def detection(size: float, records: int) -> Content:
    """Share of channels whose step of so many mm/s^2 is found as the only disturbance, at its time."""
    right = []
    for k in range(records):
        time, values = drawn(CLEAN["white noise"], BASE_SEED + 200 + k)
        values[time >= MIDDLE] += 1e-3 * size
        for of in watched(time, values):
            at_step = [
                each["kind"] == STEP and each["time"][0] - 30.0 < MIDDLE < each["time"][1] + 30.0
                for each in of
            ]
            right.append(at_step == [True])
    return {"size": size, "channels": len(right), "found": float(np.mean(right))}


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=4, help="simulated hours of each kind")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    content: Content = {
        "machine": machine(),
        "seeds": [BASE_SEED, BASE_SEED + options.records - 1],
        "density": [density(case, options.records) for case in CASES],
        "clean": [false_alarms(name, 2 * options.records) for name in CLEAN],
        "steps": [detection(size, options.records) for size in STEPS],
    }
    console = Console()
    console.print(content)
    if not options.no_save:
        console.print(f"written to {save('noise_disturbed', content)}")


if __name__ == "__main__":
    main()
