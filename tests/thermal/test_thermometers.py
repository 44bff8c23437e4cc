"""A thermometer that stands still or fails has no temperature; one that works is never found to fail."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from tumble.acquisition.thermometer import ThermometerWatch
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Chunk, Recording

HOURS = 1.0
RATE_HZ = 5.0
SLOPES = np.array([2e-3, 1e-3, -1e-3, 1e-4, 2e-4, -1e-4])
FAR = 4.5
"""Sigmas that no slope misses by."""


def truth(seed):
    print(f"seed {seed}")
    draws = np.random.default_rng(seed)
    time = np.arange(int(3600 * HOURS * RATE_HZ)) / RATE_HZ
    warmth = 5.0 + 25.0 * (1.0 - np.cos(2.0 * np.pi * time / time[-1]))
    noise = draws.normal(size=(len(time), 6)) * np.repeat([0.02, 0.002], 3)
    readings = np.array([0.1, 0.2, 9.8, 0.0, 0.0, 0.0]) + SLOPES * (warmth[:, None] - 30.0) + noise
    return time, readings, warmth, draws


def shown(warmth, draws, noise, hold, step):
    """Readings of a thermometer that is read every so many samples, with noise, in steps."""
    read = warmth + draws.normal(0.0, noise, len(warmth))
    held = read[np.arange(len(read)) // hold * hold]
    return np.round(held / step) * step if step else held


def stuck(time, read, _):
    read[(time > 900) & (time < 1500)] = read[time > 900][0]


def zero(time, read, _):
    read[(time > 900) & (time < 1500)] = 0.0


def missing(time, read, _):
    read[(time > 900) & (time < 1500)] = np.nan


def zeros(_, read, draws):
    read[draws.integers(0, len(read), 50)] = 0.0


THERMOMETERS = {"fine": (0.02, 1, 0.0), "slow": (0.02, 5, 0.0), "in steps": (0.02, 5, 0.125)}


@pytest.mark.parametrize("fails", [stuck, zero, missing, zeros])
@pytest.mark.parametrize("kind", THERMOMETERS)
def test_drift_is_that_of_the_time_with_a_temperature(tmp_path, kind, fails):
    time, readings, warmth, draws = truth(31)
    read = shown(warmth, draws, *THERMOMETERS[kind])
    fails(time, read, draws)
    log = tmp_path / "unit.csv"
    table = np.column_stack([time, readings, read])
    head = "time [s],ax,ay,az,gx [rad/s],gy [rad/s],gz [rad/s],temperature"
    np.savetxt(log, table, delimiter=",", header=head, comments="", fmt="%.7f")
    log.write_text(log.read_text().replace("nan", ""))
    found = tumble.thermal(log)
    for axis, slope in zip(found, SLOPES, strict=True):
        per_kelvin = next(each for each in axis.parameters() if each.name == "bias per K")
        assert abs(per_kelvin.value - slope) < FAR * per_kelvin.sigma, axis.name
    assert any("stood still or failed" in line for line in found.warnings)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("noise", "hold", "step"),
    [*THERMOMETERS.values(), (0.2, 1, 0.0), (0.5, 1, 1.0), (0.02, 1, 1.0), (0.02, 300, 0.0), (0.0, 1, 0.125)],
)
def test_a_thermometer_that_works_never_fails(seed, noise, hold, step):
    time, readings, warmth, draws = truth(seed)
    read = shown(warmth, draws, noise, hold, step)
    # A log may pause for a while.
    kept = (time < 1200) | (time > 1200 + 200 * seed)
    watch = ThermometerWatch()
    for rows in np.array_split(np.flatnonzero(kept), 5):
        watch.push(Chunk(time[rows], readings[rows, :3], readings[rows, 3:], read[rows]))
    assert watch.faults() == ()


def test_a_jump_that_stays_is_refused():
    time, readings, warmth, draws = truth(7)
    read = shown(warmth, draws, 0.02, 1, 0.0) + 8.0 * (time > 2000)
    recording = Recording.from_arrays("unit", time, readings[:, :3], readings[:, 3:], temperature=read)
    with pytest.raises(ProcedureError, match=r"jumps by 8.* at 2000.* and stays.*; cut the log there"):
        tumble.thermal(recording)
