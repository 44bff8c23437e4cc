"""Times as a wall clock shows them: times of day are read, and its steps are named with their remedy."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

from log_fixtures import made_up, read, refusal
from tumble.logs import ReadOptions, open_recording

RAD_S = ReadOptions(gyroscope_unit="rad/s")


def written(path, start, stamp, step=0.0, at=1000):
    """A log at 100 Hz whose clock steps by so many s, and the times since its start, s."""
    chunk = made_up(4000, rate=100.0)
    lines = ["time,ax,ay,az,gx,gy,gz"]
    for k, row in enumerate(np.column_stack([chunk.accelerometer, chunk.gyroscope]).tolist()):
        moment = start + timedelta(milliseconds=10 * k, seconds=step if k >= at else 0.0)
        lines.append(",".join([stamp(moment), *map(repr, row)]))
    path.write_text("\n".join(lines) + "\n")
    return path, chunk.time


@pytest.mark.parametrize("digits", [3, 6])
def test_times_of_day_are_read_to_their_last_digit(tmp_path, digits):
    def stamp(moment):
        return moment.strftime("%H:%M:%S.%f")[: 9 + digits]

    path, times = written(tmp_path / "log.csv", datetime(2026, 5, 1, 12, 59, 55), stamp)
    found = read(path, RAD_S)
    assert np.allclose(found.time - found.time[0], times, atol=1e-9)
    assert found.time[0] == 12 * 3600 + 59 * 60 + 55
    assert "gyroscope" in open_recording(path, RAD_S).metadata.triads


def test_a_damaged_time_of_day_is_named_with_its_line(tmp_path):
    path, _ = written(
        tmp_path / "log.csv", datetime(2026, 5, 1, 12), lambda each: each.strftime("%H:%M:%S.%f")
    )
    lines = path.read_text().splitlines()
    lines[99] = "12:00:0x" + lines[99][8:]
    path.write_text("\n".join(lines))
    assert "line 100 holds '12:00:0x.980000' in column time, which is not a number" in refusal(path, RAD_S)


@pytest.mark.parametrize(
    ("start", "form", "step", "said"),
    [
        (datetime(2026, 10, 25, 2, 59, 50), "%Y-%m-%dT%H:%M:%S.%f", -3600.0, "at the end of summer time"),
        (datetime(2026, 5, 1, 23, 59, 50), "%H:%M:%S.%f", 0.0, "as times of day do at midnight; write the"),
        (datetime(2026, 5, 1, 12), "%Y-%m-%dT%H:%M:%S.%f", -1800.0, "and goes on from there: the device"),
    ],
)
def test_a_step_of_the_clock_is_named_with_its_remedy(tmp_path, start, form, step, said):
    path, _ = written(tmp_path / "log.csv", start, lambda each: each.strftime(form), step)
    assert said in refusal(path, RAD_S)
