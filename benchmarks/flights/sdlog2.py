"""Logs of PX4 before 2017 (sdlog2), as pymavlink reads them: all IMUs at the rate of the logger.

Its messages TIME date all that come after them (PX4 1.4, sdlog2_messages.h).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from pymavlink import DFReader  # type: ignore[import-untyped]

from benchmarks.redundancy_set import Samples

FORCE = ("AccX", "AccY", "AccZ")
"""m/s^2, in the axes of the vehicle."""
RATE = ("GyroX", "GyroY", "GyroZ")
"""rad/s, likewise."""
FLAGS: Mapping[str, str] = {"fNaN": "not a number", "fHealth": "health", "fTOut": "timeout"}
"""Flags of the estimator in EST0."""


def recorded(path: Path, imus: Sequence[str]) -> list[Samples]:
    """Returns what each IMU gave, by the name of its messages, in s since the log began."""
    rows: dict[str, list[list[float]]] = {name: [] for name in imus}
    for time, message in _dated(path, imus):
        rows[message.get_type()].append([time, *(float(getattr(message, name)) for name in (*FORCE, *RATE))])
    found = [np.array(rows[name]) for name in imus]
    start = min(float(each[0, 0]) for each in found)
    times = [each[:, 0] - start for each in found]
    return [Samples(time, time, each[:, 1:4], each[:, 4:]) for time, each in zip(times, found, strict=True)]


def autopilot(path: Path) -> Iterator[str]:
    """Returns when a flag of the estimator changed, and to what."""
    start, last = None, dict.fromkeys(FLAGS, 0)
    for time, message in _dated(path, ["EST0"]):
        start = time if start is None else start
        for name, title in FLAGS.items():
            value = getattr(message, name, 0)
            if value != last[name]:
                yield f"estimator {title} {value} at {time - start:.1f} s"
            last[name] = value


def _dated(path: Path, kinds: Sequence[str]) -> Iterator[tuple[float, DFReader.DFMessage]]:
    """Returns messages, each with its time, s."""
    log, time = DFReader.DFReader_binary(str(path)), None
    while (message := log.recv_match(type=["TIME", *kinds])) is not None:
        if message.get_type() == "TIME":
            time = 1e-6 * message.StartTime
        elif time is not None:
            yield time, message
