"""A calibration that is known to be wrong is reported wherever it is used."""

from __future__ import annotations

import json

import pyarrow.parquet as pq
import pytest

import tumble
from exchange_units import calibration, needed
from log_fixtures import made_up, write
from tumble.tools.exchange.registry import TARGETS
from turntable_sessions import typed

HAVE_NO_PLACE = {"imu-tk-accelerometer", "imu-tk-gyroscope", "record", "record-hex"}
"""Formats of numbers alone."""


@pytest.fixture(params=["fail", "model not met"])
def doubted(request, tmp_path):
    """A calibration file of that verdict."""
    path = tmp_path / "unit.yaml"
    calibration(3).model_copy(update={"verdict": request.param}).save(path)
    return path, request.param


def test_apply_warns_and_writes_it_into_the_header(doubted, tmp_path):
    path, verdict = doubted
    log = write(tmp_path / "log.csv", made_up(300))
    for name in ("out.csv", "out.parquet"):
        done = typed("apply", path, log, "-o", tmp_path / name)
        assert done.code == 0
        assert f"warning: the calibration unit has the verdict '{verdict}'" in done.err
    assert (
        f"# warning: the calibration unit has the verdict '{verdict}'" in (tmp_path / "out.csv").read_text()
    )
    kept = pq.read_schema(tmp_path / "out.parquet").metadata[b"tumble.warning"].decode()
    assert verdict in kept
    assert typed("inspect", tmp_path / "out.csv").code == 0


@pytest.mark.parametrize("word", TARGETS)
def test_export_warns_and_writes_it_into_the_head(doubted, tmp_path, word):
    path, verdict = doubted
    out = tmp_path / f"out{TARGETS[word].ending}"
    settings = [text for name, value in needed(word).items() for text in ("--set", f"{name}={value}")]
    done = typed("export", path, "--format", word, *settings, "-o", out)
    assert done.code == 0, done.err
    assert f"warning: the calibration unit has the verdict '{verdict}'" in done.err
    assert TARGETS[word].kind.begins(out)
    if word in HAVE_NO_PLACE:
        assert "no place for the warning" in done.out
        return
    assert verdict in out.read_text(encoding=TARGETS[word].encoding)
    if TARGETS[word].read is not None:
        sound = tmp_path / f"other{TARGETS[word].ending}"
        calibration(3).save(tmp_path / "sound.yaml")
        assert typed("export", tmp_path / "sound.yaml", "--format", word, *settings, "-o", sound).code == 0
        pairs = zip(tumble.import_calibrations(out), tumble.import_calibrations(sound), strict=True)
        for one, other in pairs:
            keep = {"name", "date", "log", "accelerometer", "gyroscope"} - {"log", "name"}
            left, right = one.content(), other.content()
            assert {key: left.get(key) for key in keep} == {key: right.get(key) for key in keep}


def test_compare_warns(doubted, tmp_path):
    path, verdict = doubted
    calibration(3).save(tmp_path / "sound.yaml")
    done = typed("compare", path, tmp_path / "sound.yaml", "--json", "-o", tmp_path / "out")
    assert f"warning: unit: the calibration unit has the verdict '{verdict}'" in done.err
    assert any(verdict in note for pair in json.loads(done.out)["pairs"] for note in pair["notes"])
    page = (tmp_path / "out" / "compare.html").read_text()
    assert verdict in page[page.index('id="warnings"') : page.index('id="notes"')]


def test_a_sound_calibration_is_used_without_a_word(tmp_path):
    calibration(3).model_copy(update={"verdict": "pass"}).save(tmp_path / "unit.yaml")
    log = write(tmp_path / "unit.csv", made_up(300))
    assert "verdict" not in typed("apply", tmp_path / "unit.yaml", log, "-o", tmp_path / "out.csv").err
    done = typed("export", tmp_path / "unit.yaml", "--format", "ros2", "-o", tmp_path / "out.yaml")
    assert "verdict" not in done.err + (tmp_path / "out.yaml").read_text()
