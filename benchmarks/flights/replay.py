"""Flights written as a user's logs are, and replayed as `tumble redundancy` replays them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]
import yaml

import tumble
from benchmarks.flights.missions import Flight, Mission
from benchmarks.redundancy_judgement import Event
from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Precision, TriadName
from tumble.logs import ReadOptions
from tumble.procedures.redundancy.result import RedundancyResult, SecondaryError

EVALUATE_EVERY = 10.0
"""s: the flights are shorter than what the program waits by default."""

UNITS_OF_LOGS = ReadOptions(accelerometer_unit="m/s^2", gyroscope_unit="rad/s")


@dataclass(frozen=True, slots=True)
class Replayed:
    """Both flights of a mission through the program."""

    before: tuple[Flight, RedundancyResult] | None
    flight: Flight
    result: RedundancyResult


def replayed(mission: Mission, folder: Path | None = None) -> Replayed:
    """Flies a mission, writes it, and replays it; the logs stay in `folder` where one is given."""
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="flights-") as name:
            return replayed(mission, Path(name))
    before, flight = mission.fly()
    store = folder / "store"
    if before is None:
        return Replayed(None, flight, _result(flight, folder / "flight", mission.precision, store))
    first = _result(before, folder / "before", mission.precision, store)
    return Replayed((before, first), flight, _result(flight, folder / "flight", mission.precision, store))


def _result(flight: Flight, folder: Path, precision: Precision, store: Path) -> RedundancyResult:
    logs, settings = write(flight, folder)
    return tumble.redundancy(
        logs[0], logs[1:], settings=settings, store=store, precision=precision, read=UNITS_OF_LOGS
    )


def write(flight: Flight, folder: Path) -> tuple[list[Path], Path]:
    """Writes the log of each unit, and what is stated of all: the logs, primary first, and the settings."""
    folder.mkdir(parents=True, exist_ok=True)
    logs = []
    for number, (unit, samples) in enumerate(zip(flight.units, flight.recorded, strict=True)):
        logs.append(folder / f"u{number}.parquet")
        temperature = unit.logged_temperature(samples.arrival, flight.warming)
        pq.write_table(table(samples, temperature), logs[-1])
    units = {f"u{number}": each for number, each in enumerate(_stated(flight))}
    settings = folder / "units.yaml"
    stated = yaml.safe_dump({"evaluate_every": EVALUATE_EVERY, "units": units})
    settings.write_text(stated, encoding="utf-8")
    return logs, settings


def table(samples: Samples, temperature: FloatArray | None = None) -> pa.Table:
    """Returns samples as a log has them: whole microseconds, single precision; temperature (n,) degC."""
    columns = {"time_us": np.round(1e6 * samples.time).astype(np.int64)}
    for name, readings in (("a", samples.specific_force), ("g", samples.angular_rate)):
        columns |= {f"{name}{axis}": readings[:, i].astype(np.float32) for i, axis in enumerate("xyz")}
    if temperature is not None:
        columns["temperature"] = temperature.astype(np.float32)
    return pa.table(columns)


def _stated(flight: Flight) -> list[dict[str, object]]:
    found = []
    for number, unit in enumerate(flight.units):
        stated: dict[str, object] = {
            "specific_force_range": unit.triads["accelerometer"].range,
            "angular_rate_range": float(unit.triads["gyroscope"].range),
        }
        if number:
            stated["sensor_from_primary"] = unit.turn.tolist()
        if unit.stated_arm is not None:
            stated["lever_arm"] = unit.stated_arm.tolist()
        found.append(stated)
    return found


def events_of(result: RedundancyResult) -> list[Event]:
    """Returns what was reported, as `judge` takes it: units by their number."""
    number = {name: index for index, name in enumerate((result.primary, *result.secondaries))}
    return [(each.time, number[each.unit], each.event, dict(each.figures)) for each in result.events]


def stored_at_end(result: RedundancyResult) -> dict[tuple[int, TriadName], SecondaryError]:
    """Returns what is stored at the end, by number of the unit and sensor."""
    number = {name: index for index, name in enumerate((result.primary, *result.secondaries))}
    return {(number[each.unit], each.sensor): each for each in result.errors}


def missing_output(
    result: RedundancyResult, recorded: Sequence[Samples], stalls: Sequence[Sequence[float]], end: float
) -> float:
    """Returns for how many s there was no output, those left out in which all units stall.

    Gaps of a sample or two, and of what a change of source takes, are no gap.
    """
    assert result.output is not None
    slowest = max(float(np.median(np.diff(each.time))) for each in recorded if len(each.time) > 1)
    time = np.concatenate([result.output.time, [end]])
    total = 0.0
    for start, until in pairwise(time):
        if until - start < LEAST_GAP:
            continue
        idle = sum(max(0.0, min(until, last) - max(start, first)) for first, last in stalls)
        gap = until - start - idle
        total += gap if gap > LEAST_GAP + 3.0 * slowest else 0.0
    return float(total)


LEAST_GAP = 0.25
"""s."""
