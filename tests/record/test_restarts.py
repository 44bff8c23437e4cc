"""Live commands keep to what a device stated: over a restart, and where it states something else."""

from __future__ import annotations

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

from live_fixtures import piped, resting, text_lines
from tumble.foundation import clock
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.logs.session import Session
from turntable_sessions import typed

TABLE = resting(240)
LATER = TABLE + 2.4 * np.eye(7)[0]
STATED = "time,gx [deg/s],gy [deg/s],gz [deg/s],ax [g],ay [g],az [g]"
OTHER = "time,gx [rad/s],gy [rad/s],gz [rad/s],ax [g],ay [g],az [g]"


def sent(table, header=STATED):
    """Bytes of a device that measures deg/s and g."""
    shown = np.column_stack([table[:, 0], np.degrees(table[:, 4:]), table[:, 1:4] / STANDARD_GRAVITY])
    return text_lines(np.round(shown, 6), header=header)


def recorded(folder):
    table = pq.read_table(folder / "imu.parquet").to_pandas()
    return table[["ax", "ay", "az", "gx", "gy", "gz"]].to_numpy(), Session.load(folder).units[0]


def number_left_out(unit):
    return sum(int(each.split()[2]) for each in unit.remarks if each.startswith("left out"))


def test_a_device_that_restarts_is_recorded_in_the_units_it_stated(tmp_path, monkeypatch):
    data = sent(TABLE) + sent(TABLE) + sent(np.vstack([TABLE, LATER]))
    assert len(data) < 65536
    with piped(monkeypatch, data):
        done = typed("record", "imu=stdin:", "-o", tmp_path / "session", "--json")
    events = [json.loads(line) for line in done.out.splitlines()]
    lost = [each for each in events if each["event"] == "lost"]
    assert "time ran back by 2.39 s" in lost[0]["reason"]
    assert not lost[0]["is_final"]
    found, unit = recorded(tmp_path / "session")
    # All of it waited in the pipe: what came behind the restart in one piece is counted.
    assert np.allclose(found[:240], TABLE[:, 1:], rtol=0.0, atol=1e-5)
    assert len(found) + number_left_out(unit) == 4 * 240


def test_a_device_that_states_other_units_is_recorded_no_further(tmp_path, monkeypatch):
    with piped(monkeypatch, sent(TABLE) + sent(LATER, OTHER)):
        done = typed("record", "imu=stdin:", "-o", tmp_path / "session")
    assert done.code == 3
    assert done.err.count(f"columns were named '{STATED}' so far, and are now named '{OTHER}'") == 2
    assert "trying again" not in done.err
    found, unit = recorded(tmp_path / "session")
    assert np.allclose(found, TABLE[:, 1:], rtol=0.0, atol=1e-5)
    assert any(
        each.startswith("was read no further: imu: stdin:: columns were named") for each in unit.remarks
    )


def in_two_parts(tmp_path, monkeypatch, first, second):
    """Records twice into one session; returns how the second recording ended."""
    folder = tmp_path / "session"
    with piped(monkeypatch, first):
        done = typed("record", "imu=stdin:", "-o", folder)
    assert done.code == 0, done.err
    # All that was piped at once is as long as this by the clock of the device.
    clock.sleep(LATER[-1, 0])
    with piped(monkeypatch, second):
        return typed("record", "imu=stdin:", "-o", folder, "--resume")


@pytest.mark.usefixtures("simulated_clock")
def test_a_recording_that_goes_on_is_read_as_before_without_names(tmp_path, monkeypatch):
    """The device stated its columns as it was switched on, and another command reads on."""
    done = in_two_parts(tmp_path, monkeypatch, sent(TABLE), sent(LATER, header=None))
    assert (done.code, "assumed" in done.out + done.err) == (0, False), done.err
    found, unit = recorded(tmp_path / "session")
    # The first line may lack its front.
    assert len(found) in (2 * len(TABLE), 2 * len(TABLE) - 1)
    later = LATER[2 * len(TABLE) - len(found) :]
    assert np.allclose(found, np.vstack([TABLE, later])[:, 1:], rtol=0.0, atol=1e-5)
    assert unit.read_as.units == {
        "accelerometer": "g",
        "gyroscope": "deg/s",
        "time": "s",
        "temperature": "degC",
    }


@pytest.mark.usefixtures("simulated_clock")
def test_a_recording_that_goes_on_is_not_read_under_other_names(tmp_path, monkeypatch):
    done = in_two_parts(tmp_path, monkeypatch, sent(TABLE), sent(LATER, OTHER))
    assert done.code == 3
    assert f"columns were named '{STATED}' so far, and are now named '{OTHER}'" in done.err
    found, _ = recorded(tmp_path / "session")
    assert np.allclose(found, TABLE[:, 1:], rtol=0.0, atol=1e-5)


@pytest.mark.parametrize(
    "words",
    [
        ("spin", "--live", "stdin:"),
        ("multipose", "--live", "stdin:"),
        ("turntable", "--live", "reference=stdin:", "target=file:{log}?from=start"),
        ("redundancy", "--live", "primary=stdin:", "b=file:{log}?from=start", "--record", "{log}.session"),
    ],
    ids=lambda words: words[0],
)
def test_no_live_procedure_reads_on_under_other_names(tmp_path, monkeypatch, words):
    data, log = sent(TABLE) + sent(LATER, OTHER), tmp_path / "log.csv"
    log.write_bytes(data)
    with piped(monkeypatch, data):
        done = typed(*(word.format(log=log) for word in words), "-o", tmp_path / "results")
    assert done.code != 0
    assert f"columns were named '{STATED}' so far, and are now named '{OTHER}'" in done.err + done.out
    (session,) = tmp_path.rglob("session.yaml")
    assert all(unit.samples <= 240 for unit in Session.load(session.parent).units)
