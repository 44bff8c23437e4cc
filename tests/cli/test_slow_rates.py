"""Rates that follow no motion: `inspect` and the procedures state one sentence, and use the rests."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from tumble.foundation.recording import Chunk
from tumble.foundation.sample_rates import on_slow_rate
from tumble.logs import open_writer
from tumble.tools.simulate import simulate_multipose, simulate_spin
from typed_commands import typed


@pytest.fixture
def slow(tmp_path):
    """The log of a unit that was held in many orientations, at 2.5 Hz."""
    recording = simulate_multipose(seed=3, rest_seconds=12.0).recording
    chunks = list(recording.chunks())
    names = ("time", "accelerometer", "gyroscope")
    time, force, rate = (np.concatenate([getattr(chunk, name) for chunk in chunks]) for name in names)
    step = round(0.4 / float(np.median(np.diff(time))))
    path = tmp_path / "slow.parquet"
    with open_writer(path) as writer:
        writer.write(Chunk(time[::step], force[::step], rate[::step]))
    return path


def test_inspect_and_procedures_state_one_sentence_on_a_slow_rate(slow, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    seen = tumble.inspect(slow)
    assert any("too slow to follow any motion" in warning for warning in seen.remarks)
    spin = next(service for service in seen.services if service.procedure == "spin")
    assert any("too slow to follow any motion" in missing for missing in spin.missing)
    found = tumble.multipose(slow)
    assert any("too slow to follow any motion" in warning for warning in found.warnings)
    twin = slow.with_name("twin.parquet")
    twin.write_bytes(slow.read_bytes())
    of_set = tumble.redundancy(slow, [twin]).warnings
    assert sum("too slow to follow any motion" in warning for warning in of_set) == 2
    assert "tooslowtofollowanymotion" in typed("inspect", slow).out.replace(" ", "").replace("\n", "")


def test_usual_rates_are_not_slow():
    recording = simulate_spin(seed=3).recording
    assert not any("too slow" in warning for warning in tumble.spin(recording).warnings)
    assert on_slow_rate(5.0) == ()
    assert on_slow_rate(float("nan")) == ()
