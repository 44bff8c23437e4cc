"""Recorded flights of others with two and more IMUs: what is reported, beside what the autopilot did.

`python -m benchmarks.flights.logs FOLDER [--only TEXT] [--no-faults]`

FOLDER holds each file of `tests/flights.yaml` as OWNER+NAME/PATH, at its commit; absent files are left out.
Then faults are put into the ten largest real ones at 45 Hz and more. `benchmarks/README.md` defines
the figures.
"""

from __future__ import annotations

import argparse
import hashlib
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq  # type: ignore[import-untyped]
import yaml
from pymavlink import DFReader  # type: ignore[import-untyped]
from rich.console import Console
from rich.progress import track
from scipy.stats import chi2

import tumble
from benchmarks.flights import sdlog2
from benchmarks.flights.replay import EVALUATE_EVERY, UNITS_OF_LOGS, events_of, table
from benchmarks.redundancy_fault import Kind, draw_fault
from benchmarks.redundancy_figures import by_kind, wide_console
from benchmarks.redundancy_judgement import INVALID, Event, judge
from benchmarks.redundancy_set import Samples
from benchmarks.results import Content, machine, save
from tumble.logs import open_recording
from tumble.procedures.redundancy.result import RedundancyResult

LIST = Path(__file__).parents[2] / "tests" / "flights.yaml"
SETTINGS: dict[str, object] = {"evaluate_every": EVALUATE_EVERY}
FAST_HZ = 45.0
"""From which on faults are put into a log; 50 Hz of an autopilot lose a sample now and then."""
LOGS = 10
KINDS: tuple[Kind, ...] = (
    "jump",
    "ramp",
    "scale",
    "noise",
    "stuck",
    "frozen",
    "wrong sign",
    "spikes",
    "dead",
)
LEAST = 1.0
"""m/s^2 of a jump or ramp, and a tenth of it in rad/s."""
SHARE = (0.4, 0.6)
"""Shares of a log between which a fault begins."""
SUBSYSTEMS = {16: "EKF check", 17: "EKF failsafe", 24: "EKF primary"}
"""Subsystems of ERR that concern inertial navigation (AP_Logger.h)."""
RESETS = {60: "EKF height reset", 62: "EKF yaw reset"}
"""Events of EV that concern it, likewise."""
HEALTH = {"AHlt": "accelerometer", "AH": "accelerometer", "GHlt": "gyroscope", "GH": "gyroscope"}
"""Fields of IMU by which ArduPilot states that a sensor is sound."""
IMUS = ("IMU", "IMU2", "IMU3")
TELLING = re.compile(
    r"\blane|\bprimary|accels? incons|gyros? incons|variance|imu\d? (fail|bad|error)", re.IGNORECASE
)


def listed() -> list[dict[str, Any]]:
    """Returns the rows of the list."""
    rows: list[dict[str, Any]] = yaml.safe_load(LIST.read_text(encoding="utf-8"))
    return rows


def place(folder: Path, row: Mapping[str, Any]) -> Path:
    """Returns where the file of a row lies."""
    return folder / str(row["repository"]).replace("/", "+") / str(row["path"])


def is_here(folder: Path, row: Mapping[str, Any]) -> bool:
    """Returns whether the file is there, at its version."""
    path = place(folder, row)
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == row["sha256"]


def replayed(folder: Path, row: Mapping[str, Any]) -> dict[str, Any]:
    """Replays a log, and returns what is reported of it and what its autopilot reported."""
    path = place(folder, row)
    result = _as_logged(path, row)
    named = [event for event in events_of(result) if _names(event)]
    return {
        "file": f"{row['repository']}: {row['path']}",
        "units": len(row["imus"]),
        "simulated": bool(row.get("simulated")),
        "rate": _rate(result),
        "seconds": result.end - result.start,
        "verdicts": len(named),
        "reasons": dict(Counter(str(event[3]["reason"]) for event in named)),
        "disagree": sum(event[2] == "disagree" for event in events_of(result)),
        "judged at rest": any(event[2] == "evaluated" for event in events_of(result)),
        "adopted": sum(event[2] == "adopted" for event in events_of(result)),
        "autopilot": list(sdlog2.autopilot(path) if _is_sdlog2(row) else autopilot(path)),
        "looked_at": row.get("verdicts") == len(named),
        "why": row.get("why", ""),
    }


def _as_logged(path: Path, row: Mapping[str, Any]) -> RedundancyResult:
    """Replays a log as it is, or by way of a log for each unit where the program has no reader."""
    if _is_sdlog2(row):
        return _by_way_of_logs(sdlog2.recorded(path, row["imus"]))
    return tumble.redundancy(row["imus"][0], row["imus"][1:], log=path, settings=SETTINGS)


def _is_sdlog2(row: Mapping[str, Any]) -> bool:
    return bool(row.get("format") == "sdlog2")


def _by_way_of_logs(samples: Sequence[Samples]) -> RedundancyResult:
    with tempfile.TemporaryDirectory(prefix="flights-") as name:
        logs = [Path(name) / f"u{number}.parquet" for number in range(len(samples))]
        for path, each in zip(logs, samples, strict=True):
            pq.write_table(table(each), path)
        return tumble.redundancy(logs[0], logs[1:], settings=SETTINGS, read=UNITS_OF_LOGS)


def _names(event: Event) -> bool:
    return event[2] == "unhealthy" and event[3]["reason"] not in INVALID


def _rate(result: RedundancyResult) -> float:
    assert result.output is not None
    return float(1.0 / np.median(np.diff(result.output.time)))


def autopilot(path: Path) -> Iterator[str]:
    """Returns what ArduPilot reported of its IMUs and filters: health, errors, resets, lanes, messages."""
    log, lane, sound = _opened(path), None, dict[tuple[int, str], int]()
    while (message := log.recv_match(type=[*IMUS, "ERR", "EV", "MSG", "NKF4", "XKF4"])) is not None:
        kind, time = message.get_type(), f"{message._timestamp - log.clock.timebase:.1f} s"
        if kind in IMUS:
            yield from (f"{each} at {time}" for each in _changes(message, sound))
        elif kind == "ERR" and message.Subsys in SUBSYSTEMS:
            yield f"{SUBSYSTEMS[message.Subsys]} {message.ECode} at {time}"
        elif kind == "EV" and message.Id in RESETS:
            yield f"{RESETS[message.Id]} at {time}"
        elif kind == "MSG" and TELLING.search(message.Message):
            yield f"{message.Message} at {time}"
        elif kind in ("NKF4", "XKF4") and hasattr(message, "PI"):
            if lane not in (None, message.PI):
                yield f"lane {lane} to {message.PI} at {time}"
            lane = message.PI


def _opened(path: Path) -> DFReader.DFReader:
    if path.read_bytes()[:2] == b"\xa3\x95":
        return DFReader.DFReader_binary(str(path))
    return DFReader.DFReader_text(str(path))


def _changes(message: DFReader.DFMessage, sound: dict[tuple[int, str], int]) -> Iterator[str]:
    """Returns which sensors of an IMU turned unhealthy, or sound again."""
    number = getattr(message, "I", IMUS.index(message.get_type()))
    for field, sensor in HEALTH.items():
        if (value := getattr(message, field, None)) is None:
            continue
        if value != sound.get((number, sensor), 1):
            yield f"{sensor} of IMU {number} {'sound' if value else 'unhealthy'}"
        sound[number, sensor] = value


def recorded(folder: Path, row: Mapping[str, Any]) -> list[Samples]:
    """Reads what each IMU of a log gave, from the first sample of all on."""
    if _is_sdlog2(row):
        return sdlog2.recorded(place(folder, row), row["imus"])
    found = []
    for imu in row["imus"]:
        chunks = list(open_recording(f"{place(folder, row)}:{imu}").chunks())
        time = np.concatenate([chunk.time for chunk in chunks])
        readings = (
            np.vstack([getattr(chunk, name) for chunk in chunks]) for name in ("accelerometer", "gyroscope")
        )
        found.append((time, *readings))
    start = min(float(time[0]) for time, *_ in found)
    return [Samples(time - start, time - start, force, rate) for time, force, rate in found]


def faulted(samples: Sequence[Samples], kind: Kind, faulty: int, seed: Sequence[int]) -> dict[str, Any]:
    """Puts a fault into one IMU of a log, replays it as a user would, and judges what is reported."""
    random = np.random.default_rng(list(seed))
    end = min(float(each.time[-1]) for each in samples)
    start = float(random.uniform(*SHARE)) * end
    fault = draw_fault(random, kind, start, LEAST)
    given = [fault.inject(each) if number == faulty else each for number, each in enumerate(samples)]
    judgement = judge(events_of(_by_way_of_logs(given)), faulty, start, end)
    return {
        "kind": kind,
        "faulty": faulty,
        "sensor": fault.sensor,
        "size": fault.size,
        "units": len(samples),
        "velocity": None,
        "angle": None,
        "misled": 0,
        "outcome": judgement.outcome,
        "isolated": judgement.isolated,
        "seen": judgement.seen,
        "also": judgement.also,
        "changes": judgement.changes,
        "without_source": judgement.without_source,
    }


def with_faults(folder: Path, rows: Sequence[Mapping[str, Any]], console: Console) -> list[dict[str, Any]]:
    """Puts every kind of fault into each log, its IMUs taken in turn."""
    found = []
    for number, row in enumerate(track(rows, "faults", console=console)):
        samples = recorded(folder, row)
        for index, kind in enumerate(KINDS):
            faulty = (number + index) % len(samples)
            found.append(faulted(samples, kind, faulty, (number, index)) | {"file": row["path"]})
    return found


def interval(count: int, hours: float) -> tuple[float, float]:
    """Returns the 95 % interval of a rate an hour, of so many events of a Poisson process."""
    low = 0.0 if count == 0 else float(chi2.ppf(0.025, 2 * count)) / 2.0
    return low / hours, float(chi2.ppf(0.975, 2 * count + 2)) / 2.0 / hours


def summary(logs: Sequence[Mapping[str, Any]], faults: Sequence[Mapping[str, Any]]) -> Content:
    """Puts all figures together."""
    return {
        "logs": list(logs),
        "groups": groups_of(logs),
        "faults": by_kind(faults, {"all": KINDS}),
    }


def groups_of(logs: Sequence[Mapping[str, Any]]) -> Content:
    """Returns rates of real logs at 45 Hz and more, of slower ones, and of simulated ones."""
    real = [each for each in logs if not each["simulated"]]
    groups = {
        "45 Hz and more": [each for each in real if each["rate"] >= FAST_HZ],
        "slower": [each for each in real if each["rate"] < FAST_HZ],
        "simulated by ArduPilot": [each for each in logs if each["simulated"]],
    }
    return {name: _rates(those) for name, those in groups.items() if those}


def _rates(logs: Sequence[Mapping[str, Any]]) -> Content:
    hours = sum(each["seconds"] for each in logs) / 3600.0
    verdicts = sum(each["verdicts"] for each in logs)
    low, high = interval(verdicts, hours)
    return {"logs": len(logs), "hours": hours, "verdicts": verdicts, "low": low, "high": high}


def main(arguments: Sequence[str] | None = None) -> int:
    """Replays all logs that are there; exits code 1 where a verdict was not looked at yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="", metavar="TEXT", help="of the paths of the logs")
    parser.add_argument("--no-faults", action="store_true", help="health alone, and keep no figures")
    options = parser.parse_args(arguments)
    console = wide_console()
    rows = [row for row in listed() if options.only in str(row["path"])]
    here = [row for row in rows if is_here(options.folder, row)]
    console.print(f"{len(here)} of {len(rows)} logs are in {options.folder}")
    logs = [replayed(options.folder, row) for row in track(here, "logs", console=console)]
    for each in logs:
        console.print(each, highlight=False)
    if not options.no_faults:
        fast = [
            row
            for row, log in zip(here, logs, strict=True)
            if log["rate"] >= FAST_HZ and not log["simulated"]
        ]
        longest = sorted(fast, key=lambda row: -place(options.folder, row).stat().st_size)[:LOGS]
        figures = summary(logs, with_faults(options.folder, longest, console))
        console.print({name: figures[name] for name in ("groups", "faults")}, highlight=False)
        if len(here) == len(listed()):
            save("flight_logs", {**figures, "machine": machine()})
    return int(not all(each["looked_at"] for each in logs))


if __name__ == "__main__":
    sys.exit(main())
