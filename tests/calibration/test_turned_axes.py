"""A calibration that states its axes means the same to whatever is used with it, in axes of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exchange_units import calibration
from log_fixtures import made_up
from tumble.acquisition.acquire import corrected
from tumble.calibration.start import applied_first, started_from
from tumble.calibration.turned_axes import in_axes, turned
from tumble.foundation.body_axes import rotation
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Chunk, Recording
from tumble.logs import open_recording
from tumble.tools.apply.procedure import apply
from tumble.tools.compare.procedure import compare
from tumble.tools.plateaus.sessions import _refuse_unlike
from tumble.tools.view.samples import KeptSamples

TURN = np.array(rotation("FRD", "FLU"), dtype=float)
FLU = calibration(5).model_copy(update={"axes": "FLU"})


def recording(axes, turn):
    """A log that states its axes, whose readings are those of one unit, turned."""
    chunk = made_up(200)
    log = Recording.from_arrays("unit", chunk.time, chunk.accelerometer @ turn.T, chunk.gyroscope @ turn.T)
    return replace(log, metadata=replace(log.metadata, body=axes))


def written(found, axes, turn, path):
    apply(found, recording(axes, turn), path)
    (chunk,) = open_recording(path).chunks()
    return chunk


def test_a_log_in_other_axes_is_corrected_as_that_of_calibration(tmp_path):
    flu = written(FLU, "FLU", np.eye(3), tmp_path / "flu.csv")
    frd = written(FLU, "FRD", TURN, tmp_path / "frd.csv")
    assert np.allclose(frd.accelerometer, flu.accelerometer @ TURN.T, atol=1e-9)
    assert np.allclose(frd.gyroscope, flu.gyroscope @ TURN.T, atol=1e-9)
    done = apply(FLU, recording("FRD", TURN), tmp_path / "frd.csv")
    assert "the calibration unit holds in FLU and is turned into FRD" in done.warnings[0]


@pytest.mark.parametrize("axes", ["", "FLU"])
def test_nothing_is_turned_where_axes_agree_or_one_states_none(tmp_path, axes):
    assert in_axes(FLU, axes) is FLU
    assert in_axes(calibration(5), "FRD").axes is None
    assert not any(
        "turned" in line for line in apply(FLU, recording(axes, TURN), tmp_path / "l.csv").warnings
    )


def test_what_is_corrected_first_is_so_in_the_axes_of_the_log():
    log = recording("FRD", TURN)
    found = applied_first(FLU, log.metadata)
    assert found.axes == "FRD"
    (chunk,) = log.chunks()
    ours = corrected(Chunk(chunk.time, chunk.accelerometer @ TURN, chunk.gyroscope @ TURN), FLU)
    for one, two in zip(ours, corrected(chunk, found), strict=True):
        assert np.allclose(one @ TURN.T, two, atol=1e-12)


def test_what_is_shown_is_corrected_in_the_axes_of_the_log():
    turned_log, plain_log = (
        KeptSamples(recording(axes, turn), FLU) for axes, turn in (("FRD", TURN), ("FLU", np.eye(3)))
    )
    for log in (turned_log, plain_log):
        log.read()
    for channel, sign in zip(plain_log.channels, [*np.diag(TURN), *np.diag(TURN)], strict=True):
        shown, plain = (log.values("calibrated", channel, slice(0, 200)) for log in (turned_log, plain_log))
        assert np.allclose(shown, sign * plain, atol=1e-9)


def test_a_calibration_in_other_axes_is_no_start_and_no_plateau():
    with pytest.raises(ProcedureError, match="has the axes FRD, that of --calibration FLU"):
        started_from(FLU, recording("FRD", TURN).metadata)
    with pytest.raises(ProcedureError, match="has the axes FRD, one FLU"):
        _refuse_unlike(
            [FLU, turned(calibration(6).model_copy(update={"axes": "FLU"}), "FRD")], ["one", "two"]
        )


def test_one_unit_in_two_axes_is_compared_in_one():
    sections = {
        triad: getattr(FLU, triad).model_copy(update={"covariance": 1e-8 * np.eye(12)})
        for triad in ("accelerometer", "gyroscope")
    }
    unit = FLU.model_copy(update=sections)
    found = compare([unit, turned(unit, "FRD")])
    assert found.pairs[0].verdict == "same"
    assert any("is turned into FLU" in note for note in found.notes)
    wrong = compare([unit, unit.model_copy(update={"axes": "FRD"})])
    assert wrong.pairs[0].verdict == "differ"
