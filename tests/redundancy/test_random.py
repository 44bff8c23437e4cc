"""A replay of any readings ends: random faults on top of each other never bring it down."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from redundancy_sets import BIASED, FACING_DOWN, PRIMARY, SOUND, Imu, Said, motion, record
from repetitions import repetitions

TURNED = Imu("imu4", rate_hz=250.0, mounting=FACING_DOWN, accelerometer_bias=(0.2, 0.1, 0.3))
QUICKLY = {"collect": 5.0, "collect_timeout": 10.0, "fewest_pairs": 50, "evaluate_every": 3.0}
CHOICES = {
    "gate": ("secondary alone", "whole primary", "sensor by sensor"),
    "scope": ("all sensors", "triggering sensor"),
    "data": ("raw", "compensated"),
    "largest_fit_model": ("offset", "gain", "affine", "affine and lever arm"),
    "return_after": (0.5, 5.0, None),
    "vector_check": (True, False),
    "fit_rests": (True, False),
    "calibrated_only": (True, False),
}


@pytest.fixture(scope="module")
def flown():
    return record([PRIMARY, BIASED, SOUND, TURNED], 5, motion(moving=12.0, after=4.0))


def _no_numbers(said, span, generator):
    said.readings[span] = np.nan


def _infinite(said, span, generator):
    said.readings[span, generator.integers(6)] = np.inf


def _another_scale(said, span, generator):
    said.readings[span] *= 10.0 ** generator.uniform(-3.0, 6.0)


def _noise(said, span, generator):
    said.readings[span] += generator.normal(0.0, 10.0, said.readings[span].shape)


def _frozen(said, span, generator):
    said.readings[span] = said.readings[span][:1]


def _another_time(said, span, generator):
    said.time[np.argmax(span) :] += generator.choice([-1.0, 1.0]) * 10.0 ** generator.uniform(-3.0, 6.0)


def _coarse_time(said, span, generator):
    said.time[span] = np.round(said.time[span], 1)


def _wild_times(said, span, generator):
    some = generator.permutation(len(said.time))[:5]
    said.time[some] = generator.uniform(-1e3, 1e3, len(some))


def _silent(said, span, generator):
    said.time, said.readings = said.time[~span], said.readings[~span]


FAULTS = (
    _no_numbers,
    _infinite,
    _another_scale,
    _noise,
    _frozen,
    _another_time,
    _coarse_time,
    _wild_times,
    _silent,
)


def corrupted(unit, generator):
    """A copy with up to three faults, each over a random stretch."""
    said = Said(unit.imu, unit.time.copy(), unit.readings.copy())
    for _ in range(generator.integers(4)):
        begin, end = np.sort(generator.uniform(0.0, 21.0, 2))
        span = np.zeros(len(said.time), dtype=bool)
        span[int(begin * unit.imu.rate_hz) : int(end * unit.imu.rate_hz)] = True
        if span.any() and not span.all():
            FAULTS[generator.integers(len(FAULTS))](said, span, generator)
    return tumble.Recording.from_arrays(
        unit.imu.name, said.time, said.readings[:, :3], said.readings[:, 3:], clock="one"
    )


@pytest.mark.parametrize("seed", range(repetitions(80)))
def test_replay_of_units_with_random_faults_ends_with_a_result(flown, seed):
    print(f"seed {seed}")
    generator = np.random.default_rng(seed)
    recordings = [corrupted(unit, generator) for unit in flown.values()]
    drawn = {name: values[generator.integers(len(values))] for name, values in CHOICES.items()}
    result = tumble.redundancy(
        recordings[0],
        recordings[1:],
        settings={**QUICKLY, **drawn, "units": {"imu4": {"sensor_from_primary": FACING_DOWN.tolist()}}},
        precision=("f64", "f32")[generator.integers(2)],
    )
    for error in result.errors:
        assert np.isfinite(error.matrix).all()
        assert np.isfinite(error.bias).all()
        assert np.isfinite(error.residual)
        result.calibration_of(error.unit)
    for trace in result.traces:
        assert len(trace.specific_force) == len(result.window_time)
    assert all(span.start <= span.end for span in result.selected)
    known = {"", *(recording.name for recording in recordings)}
    assert {span.unit for span in result.selected} <= known
