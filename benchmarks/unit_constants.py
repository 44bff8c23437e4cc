"""Units that readings show, under constants that are halved and doubled: right, asked for, assumed and wrong.

`python -m benchmarks.unit_constants`

Data: every log of `../shared/data` whose units are stated, by itself or by its README. Its samples are put
as a log without a stated unit would hold them, in rad/s and deg/s, with times in s, ms and us; of each the
unit is guessed as a reader does (docs/theory/units.md).
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from benchmarks.results import Content, machine, save
from tumble.foundation.errors import TumbleError
from tumble.foundation.recording import FloatArray
from tumble.logs import open_recording, unit_evidence
from tumble.logs.options import ReadOptions
from tumble.logs.reading import list_imus
from tumble.logs.unit_evidence import rest_in
from tumble.logs.units import UNITS, guess_gyroscope_unit, guess_time_unit, peak, smallest_norm, usual_step

DATA = Path(__file__).parents[2] / "shared" / "data"
HEAD = 4096
"""Samples of which units are guessed."""
OUTCOMES = ("right", "assumed", "asked", "assumed wrongly", "wrong")
"""Taken with a reason or with a warning; asked for; another one taken with a warning or with a reason."""
STATED = ("column name", "message definition")
"""Reasons of units that a log states."""
STATED_BY_README = ("quadrotor", "mimu4444", "mpu9150", "cases", "redundancy_cases", "live_session_busy")
"""Folders of logs in SI units whose columns state none."""
RATE_UNITS = ("rad/s", "deg/s")
TIME_UNITS = ("s", "ms", "us")


@dataclass(frozen=True, slots=True)
class Head:
    """Beginning of one IMU of a log, in SI units."""

    name: str
    time: FloatArray
    force: FloatArray | None
    rate: FloatArray | None
    samples: int
    states_time: bool


def heads() -> Iterator[Head]:
    """Yields the beginning of every IMU whose units are known for certain."""
    for path in sorted(DATA.rglob("*")):
        if not path.is_file() or path.name.startswith("truth") or path.suffix in (".md", ".yaml"):
            continue
        try:
            names = list_imus(path) or ("",)
        except (TumbleError, OSError):
            continue
        for name in names:
            try:
                head = _head(path, name)
            except (TumbleError, OSError):
                continue
            if head is not None:
                yield head


def _head(path: Path, name: str) -> Head | None:
    folder = path.relative_to(DATA).parts[0]
    source = f"{path}:{name}" if name else str(path)
    by_readme = folder in STATED_BY_README
    recording = open_recording(source, ReadOptions(gyroscope_unit="rad/s") if by_readme else None)
    metadata = recording.metadata
    if not by_readme and metadata.gyroscope_unit.reason not in STATED:
        return None
    chunks = list(recording.chunks())
    time = np.concatenate([chunk.time for chunk in chunks])
    force, rate = (
        np.concatenate([getattr(chunk, triad) for chunk in chunks])[:HEAD]
        if triad in metadata.triads
        else None
        for triad in ("accelerometer", "gyroscope")
    )
    states_time = metadata.time_unit.reason in STATED
    return Head(source, time[:HEAD] - time[0], force, rate, len(time), states_time)


def outcomes(head: Head) -> Iterator[tuple[str, str]]:
    """Yields quantity and outcome of each guess."""
    if head.rate is not None:
        for unit in RATE_UNITS:
            yield "gyroscope", _of_rate(head, unit)
    for unit in TIME_UNITS if head.states_time else ():
        yield "time", _of_time(head, unit)


def _of_rate(head: Head, unit: str) -> str:
    assert head.rate is not None
    readings = head.rate / UNITS["gyroscope"][unit]
    rest = None if head.force is None else rest_in(head.force, readings, usual_step(head.time))
    likely, reason = guess_gyroscope_unit(smallest_norm(readings), peak(readings), rest)
    if likely is None:
        return "asked"
    if likely == unit:
        return "assumed" if reason == "assumed" else "right"
    return "wrong" if reason != "assumed" else "assumed wrongly"


def _of_time(head: Head, unit: str) -> str:
    stamps = np.round(head.time / UNITS["time"][unit], 6 if unit == "s" else 0)
    guess = guess_time_unit(stamps, unit_evidence.IMU_RATE, head.samples)
    if guess.is_open:
        return "asked"
    if guess.name == unit:
        return "assumed" if guess.others else "right"
    return "assumed wrongly" if guess.others else "wrong"


def constants() -> Iterator[tuple[str, Any]]:
    """Yields every constant of the evidence: its name, and the number."""
    for name, value in vars(unit_evidence).items():
        if not name.lstrip("_").isupper():
            continue
        if is_dataclass(value):
            for part in fields(value):
                yield f"{name}.{part.name}", getattr(value, part.name)
        elif isinstance(value, int | float):
            yield name, value


@contextmanager
def varied(name: str, by: float) -> Iterator[None]:
    """Multiplies a constant while the block runs, in every module that has it; logarithms shift."""
    name, _, part = name.partition(".")
    before = getattr(unit_evidence, name)
    after: Any
    if part:
        after = replace(before, **{part: getattr(before, part) * by})
    elif name in ("ASKED", "CERTAIN"):
        after = before + math.log(by)
    else:
        after = type(before)(before * by)
    holders = [
        module
        for key, module in list(sys.modules.items())
        if key.startswith("tumble.") and vars(module).get(name) is before
    ]
    try:
        for module in holders:
            setattr(module, name, after)
        yield
    finally:
        for module in holders:
            setattr(module, name, before)


def counted(found: Sequence[Head]) -> Counter[tuple[str, str]]:
    """Counts the outcomes of all logs."""
    return Counter(itertools.chain.from_iterable(outcomes(head) for head in found))


def rows(found: Sequence[Head]) -> Iterator[Content]:
    """Counts outcomes under the constants as they are, and with each halved and doubled."""
    yield _row("as they are", 1.0, counted(found))
    for (name, _), by in itertools.product(list(constants()), (0.5, 2.0)):
        with varied(name, by):
            yield _row(name, by, counted(found))


def _row(name: str, by: float, count: Counter[tuple[str, str]]) -> Content:
    return {"constant": name, "times": by} | {
        quantity: {kind: count[quantity, kind] for kind in OUTCOMES} for quantity in ("gyroscope", "time")
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    found = list(heads())
    content: Content = {"machine": machine(), "heads": len(found), "rows": []}
    console.print(f"{len(found)} IMUs")
    for row in rows(found):
        content["rows"].append(row)
        console.print(row)
    if not options.no_save:
        console.print(f"written to {save('unit_constants', content)}")


if __name__ == "__main__":
    main()
