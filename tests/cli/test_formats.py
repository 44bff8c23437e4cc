"""`tumble formats`: all that is read and written, once each."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from tumble.foundation.log_formats import LOG_FORMATS, LogFormat
from tumble.logs.formats import reader_of
from tumble.tools.convert.procedure import TARGETS as WRITTEN
from tumble.tools.exchange.registry import TARGETS
from turntable_sessions import typed

ROOT = Path(__file__).parents[2]


def test_every_format_is_listed_with_an_example():
    done = typed("formats", "--json")
    assert done.code == 0
    content = json.loads(done.out)
    assert [row["format"] for row in content["logs read"]] == [each.name for each in LOG_FORMATS]
    assert [row["format"] for row in content["logs written"]] == list(WRITTEN)
    assert [row["format"] for row in content["calibrations"]] == list(TARGETS)
    rows = [row for name in ("logs read", "logs written", "calibrations") for row in content[name]]
    assert all(row["example"].startswith("tumble ") and row["what"] for row in rows)
    assert ".gz" in content["packed"]


def test_the_list_names_what_is_missing_and_how_to_get_it(monkeypatch):
    asked = ["h5py>=3; extra == 'formats'", "numpy>=1.26"]
    monkeypatch.setattr(metadata, "requires", lambda name: asked)
    version = metadata.version

    def without_h5py(name):
        if name == "h5py":
            raise metadata.PackageNotFoundError(name)
        return version(name)

    monkeypatch.setattr(metadata, "version", without_h5py)
    said = typed("formats").text
    assert "Not installed: h5py; type: python -m pip install 'tumble-imu[formats]'" in said
    rows = json.loads(typed("formats", "--json").out)["logs read"]
    installed = {row["format"]: row["installed"] for row in rows}
    assert installed["csv"]
    assert not installed["hdf5"]


@pytest.mark.parametrize("log_format", LOG_FORMATS, ids=lambda each: each.name)
def test_the_module_of_a_format_has_what_a_reader_has(log_format):
    assert isinstance(log_format, LogFormat)
    reader = reader_of(log_format, Path("log"))
    wanted = ["open_logged_imu", "list_imus"] + ["recognises"] * log_format.looks_inside
    assert all(callable(getattr(reader, name)) for name in wanted)


def test_the_table_of_the_page_is_that_of_the_code():
    check = [sys.executable, ROOT / "scripts" / "write_formats.py", "--check"]
    done = subprocess.run(check, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
