"""`tumble.toml`: an option before the environment, that before the project, that before the user."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tumble.foundation.errors import TumbleError
from tumble.foundation.project_file import KEYS, project_settings, user_file
from turntable_sessions import one_line, typed


@pytest.fixture
def places(tmp_path, monkeypatch):
    """A project below a folder with a file of its own, and a user with another."""
    for name in KEYS:
        monkeypatch.delenv(f"TUMBLE_{name.upper()}", raising=False)
    user = tmp_path / "user" / "tumble"
    user.mkdir(parents=True)
    project = tmp_path / "project"
    (project / "deep" / "down").mkdir(parents=True)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "user"))
    monkeypatch.chdir(project / "deep" / "down")
    return project, user


def test_each_setting_comes_from_the_nearest_place(places, monkeypatch):
    project, user = places
    (user / "tumble.toml").write_text('operator = "user"\nstation = "user"\nmodel = "user"\n')
    (project / "tumble.toml").write_text('operator = "project"\nstation = "project"\n')
    monkeypatch.setenv("TUMBLE_OPERATOR", "environment")
    found = {name: (each.value, each.source) for name, each in project_settings().items()}
    assert found == {
        "operator": ("environment", "TUMBLE_OPERATOR"),
        "station": ("project", str(project / "tumble.toml")),
        "model": ("user", str(user / "tumble.toml")),
    }


def test_the_nearest_file_upwards_is_the_project(places):
    project, _ = places
    (project / "tumble.toml").write_text('operator = "far"\nstation = "far"\n')
    (project / "deep" / "tumble.toml").write_text('operator = "near"\n')
    assert {name: each.value for name, each in project_settings().items()} == {"operator": "near"}


def test_paths_begin_at_the_folder_of_the_file(places):
    project, _ = places
    (project / "tumble.toml").write_text('registry = "lab.db"\nlimits = "/etc/limits.yaml"\n')
    found = project_settings()
    assert found["registry"].value == str(project / "lab.db")
    assert found["limits"].value == "/etc/limits.yaml"
    (project / "tumble.toml").write_text('registry = "postgresql://host/lab"\n')
    assert project_settings()["registry"].value == "postgresql://host/lab"


@pytest.mark.parametrize(
    ("content", "wrong"),
    [
        (b'operater = "x"', "line 1: 'operater' is not a setting; did you mean operator"),
        (b'station = "a"\noperator = 1', "line 2: operator needs to be text"),
        (b"operator = ", "is not TOML"),
        (b'operator = "\xff"', "is no text in UTF-8"),
        (b'operator = " "', "needs to be a line of text"),
        (b'operator = "\\u001b[31m"', "needs to be a line of text"),
        (b'language = "Klingon"', "needs to be one of"),
        (b"[operator]\nname = 1", "line 1: operator needs to be text"),
        (b"a" * 100_000, "larger than 16 KiB"),
        (b'registry = "~nosuchuser/lab.db"', "~nosuchuser is no user with a home folder"),
        (b"x = " + b"[" * 5000, "tumble.toml"),
    ],
)
def test_a_wrong_file_is_one_line_that_says_where(places, content, wrong):
    project, _ = places
    (project / "tumble.toml").write_bytes(content)
    with pytest.raises(TumbleError) as error:
        project_settings()
    assert wrong in str(error.value)
    assert str(project / "tumble.toml") in str(error.value)
    assert "\n" not in str(error.value).strip()
    assert "\x1b" not in str(error.value)


@pytest.mark.parametrize(
    "words", [("inspect", "x.csv"), ("bench",), ("--debug", "registry", "list"), ("doctor",)]
)
def test_a_working_folder_that_was_removed_is_one_line(tmp_path, monkeypatch, words):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    done = subprocess.run(
        [sys.executable, "-m", "tumble", *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "the working folder cannot be used" in one_line(done.stderr)


def test_a_user_without_a_home_folder_has_no_file(tmp_path, monkeypatch):
    def without_home(_):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    monkeypatch.setattr("pathlib.Path.expanduser", without_home)
    assert user_file() == Path("/.config/tumble/tumble.toml")
    assert typed("doctor").code == 0


def test_doctor_shows_what_applies_and_from_where(places, monkeypatch):
    project, _ = places
    (project / "tumble.toml").write_text(
        'station = "floor"\nregistry = "postgresql://ann:secret@host/lab?password=secret"\n'
    )
    monkeypatch.setenv("TUMBLE_OPERATOR", "Ann")
    done = typed("doctor")
    assert f"station: works: floor, from {project / 'tumble.toml'}" in done.out
    assert "operator: works: Ann, from TUMBLE_OPERATOR" in done.out
    assert "secret" not in done.out
    assert "postgresql://***@host/lab" in done.out
    assert "secret" not in json.dumps(json.loads(typed("doctor", "--json").out))


def test_doctor_says_of_a_wrong_file_that_it_is_broken(places):
    project, _ = places
    (project / "tumble.toml").write_text("operator\n")
    done = typed("doctor")
    assert done.code == 0
    assert "tumble.toml: broken" in done.out
