"""A magnetometer is corrected beside the chunks of its IMU."""

from __future__ import annotations

from contextlib import contextmanager

import numpy as np
import pytest

from exchange_units import with_current
from tumble.foundation.errors import ProcedureError
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, Recording
from tumble.tools.apply import procedure
from tumble.tools.apply.magnetic import corrected

COUNT = 40


def track(calibration, truth, current, **facts):
    section = calibration.magnetometer
    field = truth @ section.M.T + section.b + current[:, np.newaxis] * section.current
    return MagneticTrack(np.linspace(-0.2, 1.3, COUNT), field, current, **facts)


def recording(magnetic, pieces=3):
    time = np.linspace(0.0, 1.0, 90)
    chunks = [Chunk(each, np.ones((30, 3)), np.zeros((30, 3))) for each in np.split(time, pieces)]
    metadata = Recording.from_arrays("unit", time, np.ones((90, 3)), np.zeros((90, 3))).metadata
    return Recording(metadata, lambda: iter(chunks), read_magnetic=lambda: magnetic)


@pytest.fixture
def written(monkeypatch):
    """Chunks that `apply` hands to its writer."""
    chunks = []

    class Kept:
        def write(self, chunk):
            chunks.append(chunk)

    @contextmanager
    def open_writer(*_, **__):
        yield Kept()

    monkeypatch.setattr(procedure, "open_writer", open_writer)
    return chunks


@pytest.fixture
def truth():
    return 40.0 * np.random.default_rng(8).normal(size=(COUNT, 3))


def test_every_reading_is_written_once_and_corrected(tmp_path, written, truth):
    calibration = with_current(8, "A")
    magnetic = track(calibration, truth, np.linspace(0.0, 20.0, COUNT))
    applied = procedure.apply(calibration, recording(magnetic), tmp_path / "out.csv")
    found = MagneticTrack.joined(chunk.magnetic for chunk in written)
    assert found.field == pytest.approx(truth, abs=1e-9)
    assert np.array_equal(found.time, magnetic.time)
    assert found.already_corrected
    assert all(chunk.magnetic.time.max() <= chunk.time.max() for chunk in written[:-1])
    assert not any("current" in warning for warning in applied.warnings)


def test_effect_of_a_current_that_the_log_lacks_is_reported(tmp_path, written, truth):
    calibration = with_current(8, "A")
    magnetic = track(calibration, truth, np.ones(COUNT), current_unit="1")
    applied = procedure.apply(calibration, recording(magnetic), tmp_path / "out.csv")
    assert (
        "the calibration has the effect of current, which the log does not state; it is left in"
        in applied.warnings
    )
    left = corrected(calibration, magnetic).field - truth
    section = calibration.magnetometer
    assert left == pytest.approx(np.tile(np.linalg.solve(section.M, section.current), (COUNT, 1)), abs=1e-9)


def test_corrected_magnetometer_is_not_corrected_again(tmp_path, truth):
    calibration = with_current(8, "A")
    magnetic = track(calibration, truth, np.ones(COUNT), already_corrected=True)
    with pytest.raises(ProcedureError, match="was corrected already"):
        procedure.apply(calibration, recording(magnetic), tmp_path / "out.csv")
