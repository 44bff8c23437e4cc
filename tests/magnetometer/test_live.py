"""A magnetometer that is calibrated live, beside accelerometer and gyroscope."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import tumble
from tumble.foundation.errors import ProcedureError
from tumble.live import open_set
from tumble.procedures.magnetometer.earth_field import earth_field
from tumble.procedures.multipose.guide import OrientationGuide
from tumble.procedures.multipose.live import LiveMultipose
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.run import run_kind
from tumble.tools.record import live_procedure
from tumble.tools.simulate import simulate_magnetometer
from tumble.tools.simulate.magnetometer.files import write_magnetometer
from turntable_sessions import one_line, typed

pytestmark = pytest.mark.usefixtures("simulated_clock")

DATES = re.compile(r"\d{4}-\d{2}-\d{2}T[\d:.]+Z")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compass")
    return write_magnetometer(simulate_magnetometer(seed=7, rate=50.0), folder)["log"]


@pytest.fixture
def each_piece(monkeypatch):
    """Lets a session look at each piece of a log that is read as fast as it can be."""
    monkeypatch.setattr(live_procedure, "BETWEEN_REPORTS", 0.0)


def live(log, folder, *more):
    return typed(
        *("multipose", "--live", f"replay:{log}?speed=max", "--magnetometer", "--field", "48"),
        *("--pose-seconds", "3s", "-o", folder, *more),
    )


def test_live_gives_what_its_recording_gives_to_the_bit(log, each_piece, tmp_path):
    goal = ("--until", "magnetometer bias 0.05, magnetometer mounting 0.2 deg")
    done = live(log, tmp_path / "live", "--json", *goal)
    assert done.code == 0, done.err
    events = [json.loads(line) for line in done.out.splitlines()]
    result = events[-1]
    assert "magnetometer" in {each["sensor"] for each in result["parameters"]}
    last = next(each for each in reversed(events) if each["event"] == "done")
    assert last["field"]["coverage"] == result["magnetometer"]["coverage"] > 0.7
    assert [each["unit"] for each in last["goals"]] == ["uT", "deg"]
    assert np.linalg.norm(last["field"]["now"]) == pytest.approx(1.0)
    again = typed(
        *("multipose", tmp_path / "live" / "session", "--magnetometer", "--field", "48"),
        *("-o", tmp_path / "again"),
    )
    assert again.code == 0, again.err
    [one], [other] = ((tmp_path / name).glob("*.multipose.yaml") for name in ("live", "again"))
    assert DATES.sub("", one.read_text()) == DATES.sub("", other.read_text())
    session = tumble.logs.open_recording(tmp_path / "live" / "session")
    units = open_set([f"{session.name}=replay:{log}"])
    resumed = LiveMultipose(units, tmp_path / "live", sources={session.name: str(log)}, resume=True)
    before = resumed._acquired.recordings()[session.name].magnetic
    assert np.array_equal(before.field, session.magnetic.field)
    assert np.array_equal(before.time, session.magnetic.time)


def test_orientation_that_lowers_the_largest_sigma_most_is_next():
    made = simulate_magnetometer(seed=3, orientations=13, rate=50.0)
    result = tumble.multipose(made.recording, magnetometer=earth_field(48.0))
    field, orientation = result.magnetometer.next_field, result.next_orientation
    guide = OrientationGuide()
    guide.follow(replace(result, next_orientation=replace(orientation, after=orientation.before)))
    # Field and up are as far apart there as in all other orientations: by the dip.
    below = np.degrees(np.arccos(guide.wanted_field @ guide.wanted)) - 90.0
    assert below == pytest.approx(result.magnetometer.dip.value, abs=0.1)
    none = replace(result.magnetometer, next_field=replace(field, after=field.before))
    guide.follow(replace(result, magnetometer=none))
    assert guide.wanted_field is None
    assert guide.wanted is orientation.up


def test_silent_magnetometer_is_reported_and_its_rests_count(log, each_piece, tmp_path):
    lines = log.read_text().splitlines()
    kept = len(lines) * 2 // 3
    broken = [
        line if k < kept else ",".join([*line.split(",")[:-3], "", "", ""]) for k, line in enumerate(lines)
    ]
    path = tmp_path / "loose.csv"
    path.write_text("\n".join([*broken, ""]))
    done = live(path, tmp_path / "live")
    assert done.code == 3, done.err
    assert done.err.count("its magnetometer gives no readings any more") == 1
    assert "the magnetic field was met from" in done.err.splitlines()[-1]
    assert "magnetometer: 12 rests" in done.out
    assert typed("multipose", path, "--magnetometer", "--field", "48", "-o", tmp_path / "again").code == 0
    [one], [other] = ((tmp_path / name).glob("*.multipose.yaml") for name in ("live", "again"))
    found, again = map(tumble.Calibration.load, (one, other))
    assert np.array_equal(found.magnetometer.M, again.magnetometer.M)


def test_page_shows_the_field_on_a_sphere_of_its_own(log, each_piece, tmp_path):
    order = RunOrder(
        folder=tmp_path,
        sources={"imu": f"replay:{log}?speed=max"},
        options={"held": 3.0, "magnetometer": True, "field": 48.0},
    )
    run = run_kind("multipose").begin(order)
    last = list(run.views())[-1]
    assert [str(figure.title) for figure in last.figures][1] == "Directions of the magnetic field"
    assert len(last.figures[1].held) == 18
    assert run.outcome().verdict == "passed"
    with pytest.raises(ProcedureError, match="choose to calibrate it too"):
        run_kind("multipose").begin(replace(order, options={"field": 48.0}))


def test_unit_without_a_magnetometer_is_refused_at_its_first_rest(log, each_piece, tmp_path):
    path = tmp_path / "bare.csv"
    path.write_text("\n".join(",".join(line.split(",")[:-3]) for line in log.read_text().splitlines()[:600]))
    done = live(path, tmp_path / "live")
    assert done.code == 2
    _, refusal = done.err.splitlines()
    assert "bare: sends no readings of a magnetometer; name its columns" in refusal
    done = live(path, tmp_path / "other", "--current")
    assert "--current is for recordings" in one_line(done.err)
