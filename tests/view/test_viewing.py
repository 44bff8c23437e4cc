"""Logs, sessions and results as they are typed, opened to be shown together."""

import json

import pytest

from log_fixtures import made_up, write
from tumble.bench.authority import acting
from tumble.bench.log.procedure_panel import Workplace
from tumble.foundation.errors import LogError, TumbleError
from tumble.foundation.files import prepare_folder
from tumble.foundation.recording import Metadata, Recording
from tumble.logs.session import Session, SessionUnit
from tumble.tools.record.session_files import write_session
from tumble.tools.view.samples import KeptSamples
from tumble.tools.view.viewing import ViewedUnit, Viewing, open_viewing
from turntable_sessions import typed


def gathered(*sources, **options):
    viewing = open_viewing([str(each) for each in sources], **options)
    viewing.gather()
    assert viewing.is_done
    return viewing


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    """A unit held in many orientations, its calibration, and the JSON that the command printed."""
    folder = tmp_path_factory.mktemp("multipose")
    assert typed("simulate", "multipose", "-o", folder / "hand").code == 0
    done = typed("multipose", folder / "hand" / "multipose.csv", "-o", folder / "hand" / "results", "--json")
    (folder / "hand" / "result.json").write_text(done.out)
    return folder / "hand"


@pytest.mark.parametrize("name", ["results/multipose.yaml", "results", "result.json"])
def test_a_result_opens_its_log_with_its_rests(calibrated, name):
    unit = gathered(calibrated / name).units[0]
    assert not unit.problem
    assert not unit.remarks
    assert unit.samples.calibration is not None
    printed = json.loads((calibrated / "result.json").read_text())
    rests = [mark for mark in unit.marks if mark.kind == "rest"]
    assert [mark.used for mark in rests] == [rest["used"] for rest in printed["rests"]]
    assert [mark.start for mark in rests] == pytest.approx([rest["start"] for rest in printed["rests"]])
    accelerometer = unit.result.residuals[0]
    assert accelerometer.value.shape == (len(accelerometer.labels), 3)


def test_a_log_that_changed_since_is_named(calibrated, tmp_path):
    text = (calibrated / "results" / "multipose.yaml").read_text()
    (tmp_path / "old.yaml").write_text(text)
    log = (calibrated / "multipose.csv").read_text()
    (tmp_path / "multipose.csv").write_text(log[: log.rindex("\n", 0, -2) + 1])
    unit = gathered(tmp_path / "old.yaml").units[0]
    assert unit.remarks == ["multipose.csv is not, or no longer, the log that the result was found from"]


def test_a_result_without_its_log_asks_for_it(calibrated, tmp_path):
    (tmp_path / "alone.yaml").write_text((calibrated / "results" / "multipose.yaml").read_text())
    with pytest.raises(TumbleError, match=r"log multipose.csv is not beside it, .*give it with --log"):
        open_viewing([str(tmp_path / "alone.yaml")])
    gathered(tmp_path / "alone.yaml", log=str(calibrated / "multipose.csv"))


def test_units_of_one_session_share_their_time(tmp_path):
    folder = prepare_folder(tmp_path / "session")
    write(folder / "a.parquet", made_up(2000, start=5.0))
    write(folder / "b.parquet", made_up(2000, start=6.5))
    units = tuple(SessionUnit(name=name, source=f"{name}.csv") for name in "ab")
    write_session(folder, Session(started="2026-11-26T05:00:00Z", clock="log", ended="x", units=units))
    viewing = gathered(folder)
    assert [unit.name for unit in viewing.units] == ["a", "b"]
    assert [unit.samples.lines(0.0, 99.0, 9999)[0].time[0] for unit in viewing.units] == [0.0, 1.5]
    assert not viewing.remarks


def test_logs_with_clocks_of_their_own_begin_together(tmp_path):
    paths = [write(tmp_path / f"{start:g}.csv", made_up(2000, start=start)) for start in (5.0, 6.5)]
    viewing = gathered(*paths)
    assert [unit.samples.lines(0.0, 99.0, 9999)[0].time[0] for unit in viewing.units] == [0.0, 0.0]
    assert viewing.remarks == ["the units have no common clock: each begins at its own first sample"]


def test_a_calibration_of_none_of_the_units_is_refused(calibrated, tmp_path):
    paths = [str(write(tmp_path / f"{name}.csv", made_up(2000))) for name in "ab"]
    with pytest.raises(TumbleError, match="is of unit SIM-1-1, which is none of those shown"):
        open_viewing(paths, calibrations=[calibrated / "results" / "multipose.yaml"])


def test_a_log_that_breaks_off_is_shown_as_far_as_it_was_read():
    def chunks():
        yield made_up(2000)
        raise LogError("log.csv: line 2001 holds 'no' in column time")

    recording = Recording(Metadata.of_arrays("log"), chunks)
    viewing = Viewing("log", [ViewedUnit("log", KeptSamples(recording))])
    viewing.gather()
    (unit,) = viewing.units
    assert unit.problem == "log.csv: line 2001 holds 'no' in column time"
    assert unit.stage == "failed"
    assert len(unit.samples.lines(0.0, 10.0, 5000)[0].time) == 2000


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["missing.csv"], "missing.csv: no such file or folder; check the path"),
        (["--port", "99999999"], "--port"),
        ([], "missing argument"),
    ],
)
def test_a_mistake_is_one_line(arguments, why, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if arguments[:1] == ["--port"]:
        arguments = [str(write(tmp_path / "log.csv", made_up(300))), *arguments]
    done = typed("view", "--no-browser", *arguments)
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert why in done.err


def test_without_the_extra_a_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr("tumble.bench.log.command.find_spec", lambda name: None)
    done = typed("view", "log.csv")
    assert done.code == 2
    assert done.err.endswith("type: python -m pip install 'tumble-imu[bench]'\n")


def test_a_document_is_no_result_by_its_name_alone(tmp_path):
    (tmp_path / "result.json").write_text(json.dumps({"schema": "tumble-multipose-result/1", "targets": [1]}))
    with pytest.raises(TumbleError, match="names no log of one unit"):
        open_viewing([str(tmp_path / "result.json")])


def test_results_of_a_bench_stay_in_its_folder(tmp_path):
    place = Workplace(tmp_path, is_bound=True)
    with acting(lambda: True):
        assert place.place("unit-tumble") == tmp_path / "unit-tumble"
    for typed_ in ("../out", "/tmp/out"):
        with acting(lambda: True), pytest.raises(TumbleError, match="is not within"):
            place.place(typed_)
