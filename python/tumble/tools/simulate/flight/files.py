"""A simulated flight on disk: the logs as any logger would write them, and the truth beside them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tumble.foundation.documents import write_document
from tumble.foundation.files import prepare_folder
from tumble.foundation.plain import plain
from tumble.foundation.recording import Chunk, FloatArray, SampleProgress
from tumble.logs import Facts, open_mcap_writer, open_writer
from tumble.logs.aiding import Aiding
from tumble.tools.simulate.files import (
    TRUTH,
    LogFormat,
    cut,
    options,
    pieces,
    triad_content,
    without_none,
)
from tumble.tools.simulate.flight.procedure import SimulatedFlight, SimulatedFlightUnit

IDEAL = "ideal"
"""Name of the unit without errors, at the primary's place."""
SECOND = 1.0
"""s of all units that stand together in a log that holds several."""

_HEADER = """\
The truth of this simulated flight. SI units, angles in rad unless a key ends in _deg; frames as in
docs/conventions.md. y = M u + b + c (T - 25 degC) + G f, M = K L Q; u is the truth at the unit's own place,
in the case frame of the primary; b is today's, ageing included; drift is the mean of what bias instability
and temperature add. T = start + rise (1 - exp(-t / time_constant)). The log `ideal` is of a unit without
errors at the primary's place, on the flight's clock."""


_UNITS_HEADER = """\
What the builder of this simulated flight knows of its units; for tumble redundancy --settings."""


@dataclass(frozen=True, slots=True)
class _Log:
    """Samples that a unit recorded, and their arrival."""

    name: str
    samples: Chunk
    arrival: FloatArray
    serial: str


def write_flight(
    flight: SimulatedFlight,
    directory: str | Path,
    format: LogFormat = "csv",  # noqa: A002
    velocity: Aiding | None = None,
    progress: SampleProgress | None = None,
) -> dict[str, Path]:
    """Writes one log a unit, `units.yaml` and `truth.yaml`; returns the path of each by what it is.

    `units.yaml` are settings of `tumble redundancy` with the facts that a builder knows of the units.

    `velocity` are aiding measurements of it, written beside them as `velocity.csv`.

    MCAP is one log, `flight.mcap`, in which each unit is a topic and logged when it arrived. A unit without
    samples has no log. `progress` receives the samples written and those there are.

    Raises `OutputError` where the folder cannot be written to.
    """
    folder = prepare_folder(directory)
    logs = [log for log in _logs(flight) if len(log.samples)]
    report = _counted(progress, sum(len(log.samples) for log in logs))
    write = _write_together if format == "mcap" else _write_apart
    paths = write(folder, logs, format, report)
    paths["units"] = folder / "units.yaml"
    write_document(paths["units"], _UNITS_HEADER, known_of_units(flight))
    paths["truth"] = folder / "truth.yaml"
    write_document(paths["truth"], _HEADER, flight_truth(flight))
    if velocity is not None:
        paths["velocity"] = velocity.save(folder / "velocity.csv")
    return paths


def known_of_units(flight: SimulatedFlight) -> dict[str, Any]:
    """Returns what a builder knows of the units, in the form of settings of `tumble redundancy`.

    That is nominal rotation, lever arm, range and time offset, but none of the errors.
    """
    primary, *_ = flight.units
    content = {
        "schema": "tumble-redundancy/1",
        "units": {unit.name: _known(unit, primary) for unit in flight.units if len(unit.samples)},
    }
    return {key: plain(value) for key, value in content.items()}


def _known(unit: SimulatedFlightUnit, primary: SimulatedFlightUnit) -> dict[str, Any]:
    ranges = {
        "specific_force_range": unit.grade.accelerometer.range,
        "angular_rate_range": unit.grade.gyroscope.range,
    }
    if unit is primary:
        return ranges
    return {
        "sensor_from_primary": unit.nominal_mounting,
        "lever_arm": unit.lever_arm,
        "time_offset": primary.clock.offset - unit.clock.offset,
        **ranges,
    }


def flight_truth(flight: SimulatedFlight) -> dict[str, Any]:
    """Returns the truth as plain mappings, lists, numbers and text."""
    scenario = flight.scenario
    content: dict[str, Any] = {
        "schema": TRUTH,
        "seed": scenario.seed,
        "motion": scenario.motion,
        "duration": flight.duration,
        "gravity": scenario.gravity,
        "rests": flight.rests,
        "manoeuvres": flight.manoeuvres,
        "temperature": {
            "start": scenario.temperature_celsius,
            "rise": scenario.warm_up_kelvin,
            "time_constant": scenario.warm_up_seconds,
        },
        "units": {unit.name: _unit(unit) for unit in flight.units},
        "options": options(scenario),
    }
    return {key: plain(value) for key, value in content.items()}


def _unit(unit: SimulatedFlightUnit) -> dict[str, Any]:
    return {
        "serial": unit.recording.metadata.serial,
        "grade": unit.grade.name,
        "samples": len(unit.samples),
        "lever_arm": unit.lever_arm,
        "nominal_mounting": unit.nominal_mounting,
        "accelerometer": triad_content(unit.accelerometer) | {"ageing": unit.accelerometer_ageing},
        "gyroscope": triad_content(unit.gyroscope) | {"ageing": unit.gyroscope_ageing},
        "clock": {"offset": unit.clock.offset, "skew_ppm": unit.clock.skew, "phase": unit.clock.phase},
        "latency": unit.latency,
        "faults": [without_none(asdict(fault)) for fault in unit.faults],
    }


def _logs(flight: SimulatedFlight) -> Iterator[_Log]:
    for unit in flight.units:
        yield _Log(unit.name, unit.samples, unit.arrival, unit.recording.metadata.serial)
    rate = flight.scenario.units[0].rate_hz
    truth = flight.truth(np.arange(0.0, flight.duration, 1.0 / rate))
    samples = Chunk(truth.time, truth.specific_force, truth.angular_rate)
    yield _Log(IDEAL, samples, truth.time, "")


def _counted(progress: SampleProgress | None, expected: int) -> Callable[[int], None]:
    done = 0

    def report(samples: int) -> None:
        nonlocal done
        done += samples
        if progress is not None:
            progress(done, expected)

    return report


def _write_apart(
    folder: Path, logs: list[_Log], format_name: str, report: Callable[[int], None]
) -> dict[str, Path]:
    paths = {log.name: folder / f"{log.name}.{format_name}" for log in logs}
    for log in logs:
        with open_writer(paths[log.name], format_name, Facts(serial=log.serial)) as writer:
            for chunk in pieces(log.samples):
                writer.write(chunk)
                report(len(chunk))
    return paths


def _write_together(
    folder: Path, logs: list[_Log], format_name: str, report: Callable[[int], None]
) -> dict[str, Path]:
    """Writes a second of every unit, then the next second, by the time of arrival."""
    path = folder / f"flight.{format_name}"
    end = max(float(log.arrival[-1]) for log in logs)
    with open_mcap_writer(path) as writer:
        for start in np.arange(0.0, end + SECOND, SECOND):
            for log in logs:
                first, last = np.searchsorted(log.arrival, [start, start + SECOND])
                if last > first:
                    chunk = cut(log.samples, slice(first, last))
                    writer.write(chunk, log.name, log.arrival[first:last])
                    report(len(chunk))
    return {"log": path}
