"""How far the selected output is from what a faultless primary would say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from benchmarks.redundancy_flown import SENSORS, Flown, after_time_jumped, error_left, root_mean_square
from benchmarks.redundancy_truth import faulty, reference, spans
from benchmarks.redundancy_verdict import Verdict
from tumble.recording import FloatArray

BoolArray = npt.NDArray[np.bool_]
IndexArray = npt.NDArray[np.int_]


def judge_output(flown: Flown, verdict: Verdict) -> None:
    time = flown.joined("output_time")
    keep = ~after_time_jumped(flown, time) & (time >= 0.0)
    if keep.sum() < 2:
        return
    window = flown.window
    grid = flown.joined("window_time")
    usable = ~after_time_jumped(flown, grid) & (np.diff(grid, prepend=-np.inf) > 0.0)
    grid, measure = grid[usable], None
    measure = reference(flown.mission, flown.flight, grid, window)
    truth = flown.flight.truth(grid, window)
    source = flown.joined("output_unit")
    index = np.rint((time[keep] - grid[0]) / window).astype(int)
    phases = _phases(flown, grid, source[keep], index)
    for name in SENSORS:
        channel = "specific_force" if name == "accelerometer" else "angular_rate"
        said = _window_means(flown.joined(f"output_{channel}")[keep], index, len(grid))
        error = said - measure[name]
        compensated = [x[usable] - measure[name] for x in flown.of_units(f"{channel}_compensated")]
        plain = [
            error_left(flown, k, name, None, x[usable] @ u.nominal_mounting.T, truth, measure[name])
            for k, (x, u) in enumerate(zip(flown.of_units(channel), flown.flight.units, strict=True))
        ]
        for phase, within in phases.items():
            figures = _phase_figures(flown, grid, within, error, compensated, plain)
            if figures is not None:
                verdict.output[f"{phase}, {name}"] = figures
        if not flown.mission.faults:
            good = np.isfinite(error).all(axis=1)
            verdict.faultless[name] = root_mean_square(error[good], flown.window)


def _phases(flown: Flown, grid: FloatArray, source: FloatArray, index: IndexArray) -> dict[str, BoolArray]:
    """Windows before a fault of the primary, from it to a second after the switch, and from then on."""
    starts = [max(spans(f)[0], 0.0) for f in flown.flight.units[0].faults if f.kind != "doubled"]
    first = min(starts, default=np.inf)
    switched = next((e[0] for e in flown.events if e[2] == "selected" and e[0] > first and e[1] > 0), np.inf)
    of_window = np.full(len(grid), -1)
    of_window[index[(index >= 0) & (index < len(grid))]] = source[(index >= 0) & (index < len(grid))]
    if not np.isfinite(switched):
        return {"before": (grid < first) & (of_window == 0)}
    return {
        "before": (grid < first) & (of_window == 0),
        "during": (grid >= first) & (grid < switched + 1.0),
        "after": (grid >= switched + 1.0) & (of_window > 0),
    }


def _window_means(values: FloatArray, index: IndexArray, count: int) -> FloatArray:
    """Mean (count, 3) of what falls into each window."""
    inside = (index >= 0) & (index < count) & np.isfinite(values).all(axis=1)
    number = np.bincount(index[inside], minlength=count)
    with np.errstate(invalid="ignore"):
        sums = [np.bincount(index[inside], values[inside, k], minlength=count) for k in range(3)]
        return np.where(number[:, None] > 0, np.column_stack(sums) / np.maximum(number, 1)[:, None], np.nan)


def _phase_figures(
    flown: Flown,
    grid: FloatArray,
    within: BoolArray,
    error: FloatArray,
    compensated: Sequence[FloatArray],
    plain: Sequence[FloatArray],
) -> dict[str, float] | None:
    good = within & np.isfinite(error).all(axis=1)
    if good.sum() < 3:
        return None
    return {
        "output": root_mean_square(error[good], flown.window),
        "best": min(_fault_free(flown, grid, good, compensated), default=float("nan")),
        "uncalibrated": min(_fault_free(flown, grid, good, plain), default=float("nan")),
        "windows": int(good.sum()),
    }


def _fault_free(
    flown: Flown, grid: FloatArray, good: BoolArray, errors: Sequence[FloatArray]
) -> Iterator[float]:
    """Give what each secondary without fault leaves over the same windows."""
    for number, unit in enumerate(flown.flight.units):
        there = good & np.isfinite(errors[number]).all(axis=1)
        if number > 0 and there.sum() >= 0.9 * good.sum() and not faulty(unit, grid[good]).any():
            yield root_mean_square(errors[number][there], flown.window)
