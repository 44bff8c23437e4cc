"""Procedures hand their results over where a registry is set; a registry that fails loses no result."""

from __future__ import annotations

import json

import pytest

import postgres
from made_up_calibrations import made_up, save
from tumble.laboratory.registry import Registry
from turntable_sessions import one_line, typed


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    """A simulated spin."""
    folder = tmp_path_factory.mktemp("robot")
    assert typed("simulate", "spin", "--turns", "2", "--seed", "7", "-o", folder).code == 0
    return folder / "spin.csv"


@pytest.fixture(autouse=True)
def working_folder(tmp_path, monkeypatch):
    """No settings of the user or of folders above apply."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "user"))


def test_a_result_goes_where_the_option_says(registry, robot, tmp_path):
    address = registry.address.path or registry.address.url.render_as_string(hide_password=False)
    done = typed("spin", robot, "-o", tmp_path / "out", "--registry", str(address).replace("+psycopg", ""))
    assert done.code == 0
    assert "tumble: 1 result added to the registry" in done.err
    (row,) = registry.list()
    assert (row["procedure"], row["serial"]) == ("spin", "SIM-7")
    shown = registry.show("SIM-7")
    assert registry.document(shown.calibration["page"]) == (tmp_path / "out" / "spin.html").read_bytes()


def test_a_result_goes_where_the_project_file_says(robot, tmp_path):
    Registry.create(tmp_path / "lab.db")
    (tmp_path / "tumble.toml").write_text(
        'registry = "lab.db"\nmodel = "M1"\noperator = "Ann"\nstation = "floor"\n'
    )
    done = typed("spin", robot, "-o", "out", "--station", "table", "--json")
    assert done.code == 0
    assert json.loads(done.out)
    shown = Registry(tmp_path / "lab.db").show("SIM-7")
    assert (shown.unit["model"], shown.session["operator"], shown.session["station"]) == (
        "M1",
        "Ann",
        "table",
    )


def test_other_calibrations_in_the_folder_stay_out(robot, tmp_path):
    Registry.create(tmp_path / "lab.db")
    save(tmp_path / "out", made_up(serial="other"))
    assert typed("spin", robot, "-o", "out", "--registry", "lab.db").code == 0
    assert [row["serial"] for row in Registry("lab.db").list()] == ["SIM-7"]


def test_a_unit_without_a_serial_is_warned_of(robot, tmp_path):
    Registry.create(tmp_path / "lab.db")
    nameless = save(tmp_path / "a", made_up(serial="", name="imu"), made_up(serial="7", log="7"))
    done = typed("registry", "add", nameless, "--registry", "lab.db")
    assert done.code == 0
    assert "warning: imu: no serial is stated" in one_line(f"tumble: error: {done.err}")
    assert typed("registry", "add", nameless, "--registry", "lab.db").err == ""


def test_without_a_registry_nothing_is_said_of_one(robot):
    done = typed("spin", robot, "-o", "out")
    assert (done.code, done.err) == (0, "")


@pytest.fixture
def own_server():
    """A server that a test may stop."""
    with postgres.running() as running:
        yield running


def test_a_server_that_went_away_leaves_the_result_to_add(own_server, robot, tmp_path):
    server, address = own_server, own_server.make("goes_away")
    Registry.create(address, documents=str(tmp_path / "documents"))
    server.stop()
    try:
        done = typed("spin", robot, "-o", "out here", "--registry", address)
    finally:
        server.start()
    assert done.code == 3
    (line,) = [line for line in done.err.splitlines() if "registry" in line]
    assert "the results are written: type tumble registry add '" in line
    assert "word" not in line
    assert len(Registry(address).list()) == 0
    again = typed("registry", "add", tmp_path / "out here", "--registry", address)
    assert again.code == 0
    assert len(Registry(address).list()) == 1


def test_a_project_file_that_is_wrong_stops_before_any_work(robot, tmp_path):
    (tmp_path / "tumble.toml").write_text('operater = "Ann"\n')
    done = typed("spin", robot, "-o", "out")
    assert done.code == 2
    assert one_line(done.err).endswith("line 1: 'operater' is not a setting; did you mean operator?")
    assert not (tmp_path / "out").exists()
