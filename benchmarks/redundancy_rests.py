"""Effect of rests on a calibration in motion: errors left, and whether the stated sigmas hold.

`python -m benchmarks.redundancy_rests [--runs 400] [--no-save]`

Simulated pairs of units on a shaking body, with bias instability and warming, that rest between motions; and
the eight IMUs on one board, calibrated in one half of the recording and held against the rests of the other.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks import redundancy_board as board
from benchmarks.redundancy_judgement import Event
from benchmarks.redundancy_set import SENSORS, Samples, SimulatedSet, Unit, simulate_set
from benchmarks.results import Content, machine, save
from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL, TriadName

RUNS = 400
REST_SECONDS = 8.0
MOTION_SECONDS = 11.0
MOTIONS = 5
SETTINGS: dict[str, object] = {"collect": 40.0}
"""The motions but the last are collected, and the rests between them with them."""
HALVES = ((0.0, 245.0), (245.0, board.SHAKING))
"""s of the recording of the board: ten rests each."""
BOARD_SETTINGS = {**board.SETTINGS, "collect": 10.0}
WAYS = {"motion": False, "motion and rests": True}

Records = dict[tuple[int, TriadName], Mapping[str, object]]


def adopted(
    told: Sequence[_core.RedundancyUnit], said: Sequence[Samples], settings: Mapping[str, object], rests: bool
) -> tuple[Records, list[Event]]:
    """Replays a set; returns what it adopted first of each sensor, and all events."""
    monitor = _core.RedundancyMonitor(list(told), {**settings, "fit_rests": rests}, "f64")
    played = monitor.replay(
        [each.time for each in said],
        [each.specific_force for each in said],
        [each.angular_rate for each in said],
    )
    records: Records = {}
    for record in monitor.records():
        sensor: TriadName = "accelerometer" if record["sensor"] == "accelerometer" else "gyroscope"
        records[int(str(record["identity"])) - 1, sensor] = record
    return records, [(t, unit, what, dict(figures)) for t, unit, what, figures in played["events"]]


def simulated(seed: int) -> tuple[SimulatedSet, float]:
    """Draws a pair of units, and how long they are flown, s."""
    random = np.random.default_rng([seed, 7])
    starts = REST_SECONDS + (REST_SECONDS + MOTION_SECONDS) * np.arange(MOTIONS)
    duration = float(starts[-1] + MOTION_SECONDS + REST_SECONDS)
    spans = np.column_stack([starts, starts + MOTION_SECONDS])
    return simulate_set(random, 2, spans, duration, "strong" if seed % 2 else "weak"), duration


def relation(
    flown: SimulatedSet, sensor: TriadName, span: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Returns the true M and b of the secondary against the primary, with the mean drift over a span, s."""
    biases = [
        unit.bias[sensor] + said.drift[sensor][slice(*np.searchsorted(said.arrival, span))].mean(axis=0)
        for unit, said in zip(flown.units, flown.samples, strict=True)
    ]
    first, second = (unit.matrix[sensor] for unit in flown.units)
    matrix = second @ np.linalg.inv(first)
    return matrix, np.asarray(biases[1] - matrix @ biases[0])


def judged(seed: int, rests: bool) -> Iterator[tuple[TriadName, str, FloatArray, FloatArray]]:
    """Errors over sigma and the errors of what a mission adopted first, by sensor and parameter."""
    flown, duration = simulated(seed)
    told = [unit.told(number) for number, unit in enumerate(flown.units)]
    settings = {**SETTINGS, "evaluate_every": duration}
    records, events = adopted(told, flown.samples, settings, rests)
    begin = min((time for time, _, what, _ in events if what == "motion began"), default=0.0)
    for (_, sensor), record in records.items():
        end = next(t for t, _, what, f in events if what == "adopted" and f["sensor"] == sensor)
        matrix, bias = relation(flown, sensor, (begin, end))
        truths = {"bias": _bias_given(record, matrix, bias, flown.units[0], sensor), "matrix": matrix}
        for name, truth in truths.items():
            sigma = np.asarray(record[f"{name}_sigma"]).ravel()
            error = (np.asarray(record[name]) - truth).ravel()
            shown = np.isfinite(sigma)
            yield sensor, name, (error / sigma)[shown], error[shown]


def _bias_given(
    record: Mapping[str, object], matrix: FloatArray, bias: FloatArray, primary: Unit, sensor: TriadName
) -> FloatArray:
    """Returns the bias that is right beside the parts of M that were left as they were: at rest, level."""
    shown = np.isfinite(np.asarray(record["matrix_sigma"]))
    left = np.where(shown, 0.0, matrix - np.asarray(record["matrix"]))
    up = primary.matrix[sensor] @ np.array([0.0, 0.0, STANDARD_GRAVITY if sensor == "accelerometer" else 0.0])
    return np.asarray(bias + left @ up)


def honesty(runs: int, console: Console) -> Content:
    """Measures errors and coverage with and without rests."""
    found: dict[str, Content] = {}
    for way, rests in WAYS.items():
        sigmas: dict[tuple[str, str], list[float]] = defaultdict(list)
        errors: dict[tuple[str, str], list[float]] = defaultdict(list)
        for run in track(range(runs), way, console=console):
            for sensor, name, over, error in judged(run, rests):
                sigmas[sensor, name] += list(over)
                errors[sensor, name] += list(error)
        found[way] = {
            f"{sensor}, {name}": {
                "number": len(over),
                "error": float(np.sqrt(np.mean(np.square(errors[sensor, name])))),
                "rmse_over_sigma": float(np.sqrt(np.mean(np.square(over)))),
                "coverage": float(np.mean(np.abs(over) < INTERVAL)),
            }
            for (sensor, name), over in sorted(sigmas.items())
        }
    return found


def rest_means(said: Samples, rests: Sequence[tuple[float, float]], sensor: TriadName) -> FloatArray:
    """Returns the mean (n, 3) at each rest."""
    readings = said.of(sensor)
    return np.array([readings[slice(*np.searchsorted(said.time, rest))].mean(axis=0) for rest in rests])


def rests_of(events: Sequence[Event]) -> list[tuple[float, float]]:
    """Returns the spans at rest, s."""
    began = [time for time, _, what, _ in events if what == "rest began"]
    ended = [time for time, _, what, _ in events if what == "rest ended"]
    return [(start, end) for start, end in zip(began, ended, strict=False) if end > start + 1.0]


def on_board(rests: bool) -> dict[int, dict[TriadName, list[float]]]:
    """Compares adoptions in each half of the recording with the rests of the other, by primary.

    Root mean square over those rests of the norm of what secondary and primary are apart, m/s^2 and rad/s.
    """
    recorded = board.recorded()
    found: dict[int, dict[TriadName, list[float]]] = {}
    for primary in board.NUMBERS:
        numbers = [primary, *(number for number in board.NUMBERS if number != primary)]
        left = found[primary] = {name: [] for name in SENSORS}
        replayed = [
            adopted(board.told(numbers), [recorded[n].part(*half) for n in numbers], BOARD_SETTINGS, rests)
            for half in HALVES
        ]
        for (records, _), (_, events) in zip(replayed, reversed(replayed), strict=True):
            spans = rests_of(events)
            for (unit, sensor), record in sorted(records.items()):
                first = rest_means(recorded[primary], spans, sensor)
                second = rest_means(recorded[numbers[unit]], spans, sensor)
                matrix, bias = np.asarray(record["matrix"]), np.asarray(record["bias"])
                apart = np.linalg.solve(matrix, (second - bias).T).T - first
                left[sensor].append(float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))))
    return found


def show(figures: Content, console: Console) -> None:
    """Prints the tables."""
    table = Table("sensor, parameter", "fit to", "numbers", "error, rms", "error over sigma", "95 % hold")
    for way, of in figures["simulated"].items():
        for name, each in of.items():
            table.add_row(
                name,
                way,
                str(each["number"]),
                f"{each['error']:.2g}",
                f"{each['rmse_over_sigma']:.2f}",
                f"{100 * each['coverage']:.1f} %",
            )
    console.print(table)
    columns = (f"{what} {name}" for name in SENSORS for what in ("calibrated", "median", "worst"))
    table = Table("primary", "fit to", *columns)
    for way, of in figures["board"].items():
        for primary, each in of.items():
            cells = [
                word
                for name in SENSORS
                for word in (
                    str(len(each[name])),
                    f"{1e3 * np.median(each[name] or [np.nan]):.2f}e-3",
                    f"{1e3 * max(each[name], default=np.nan):.2f}e-3",
                )
            ]
            table.add_row(str(primary), way, *cells)
    console.print(table)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measures, shows and saves."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument("--no-save", action="store_true")
    options = parser.parse_args(arguments)
    console = Console(width=140)
    figures: Content = {"runs": options.runs, "simulated": honesty(options.runs, console), "board": {}}
    if board.is_here():
        figures["board"] = {way: on_board(rests) for way, rests in WAYS.items()}
    show(figures, console)
    if not options.no_save:
        save("redundancy_rests", {**figures, "machine": machine()})
    return 0


if __name__ == "__main__":
    sys.exit(main())
