"""A new procedure is a folder and its row: nothing else of the package knows it by name."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import tumble
from tumble.foundation.procedures import PROCEDURES

ROOT = Path(__file__).parents[2]
DUMMY = {
    "__init__.py": "",
    "procedure.py": "def magnetometer():\n    return 'found'\n",
    "result.py": "class MagnetometerResult: pass\n",
    "serves.py": "def services(evidence):\n    yield evidence.service('magnetometer', ('a magnetometer',))\n",
    "command.py": "def magnetometer_command() -> None:\n    print('north')\n",
}


@pytest.mark.parametrize("row", PROCEDURES, ids=lambda row: row.word)
def test_a_row_says_what_its_folder_holds(row):
    for module, name in (
        ("procedure", row.word),
        ("result", row.result),
        ("command", f"{row.word}_command"),
        *((("serves", "services"),) if row.serves else ()),
    ):
        assert hasattr(import_module(f"{row.folder}.{module}"), name)
    assert {row.word, row.result} <= set(tumble.__all__)
    summary = import_module(f"{row.folder}.command").__dict__[f"{row.word}_command"].__doc__
    assert summary.startswith(row.summary)
    assert (ROOT / "docs" / "how-to" / f"{row.word}.md").exists()


@pytest.fixture(scope="module")
def extended(tmp_path_factory):
    """A copy of the package with one more procedure: a folder and a row."""
    package = tmp_path_factory.mktemp("python") / "tumble"
    shutil.copytree(ROOT / "python" / "tumble", package, ignore=shutil.ignore_patterns("__pycache__"))
    folder = package / "procedures" / "magnetometer"
    folder.mkdir()
    for name, source in DUMMY.items():
        (folder / name).write_text(source)
    rows = package / "foundation" / "procedures.py"
    words = '"magnetometer", "MagnetometerResult", "Find the north.", endings=("magnetometer",)'
    row = f'    Procedure({words}),\n)\n"""Procedures in the order'
    source = rows.read_text()
    assert source.count(')\n"""Procedures in the order') == 1
    rows.write_text(source.replace(')\n"""Procedures in the order', row))
    return package.parent


def run(extended, *words):
    done = subprocess.run(
        [sys.executable, *words],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(extended)},
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_a_new_row_is_a_command_with_its_line_of_help(extended):
    assert "Find the north." in run(extended, "-m", "tumble", "--help")
    assert run(extended, "-m", "tumble", "magnetometer") == "north\n"


def test_a_new_row_is_a_function_and_a_type_of_the_package(extended):
    code = "import tumble; tumble.MagnetometerResult(); print(tumble.magnetometer())"
    assert run(extended, "-c", code) == "found\n"


def test_a_new_row_is_asked_what_a_recording_serves_for(extended, tmp_path):
    made = run(extended, "-m", "tumble", "simulate", "static", "--duration", "5", "-o", tmp_path, "--json")
    log = next(tmp_path.glob("*.csv"))
    assert made
    (inspection,) = json.loads(run(extended, "-m", "tumble", "inspect", str(log), "--json"))["logs"]
    services = {each["procedure"]: each["missing"] for each in inspection["services"]}
    assert services["magnetometer"] == ["a magnetometer"]


def test_a_new_row_names_files_of_units(extended):
    code = "from tumble.foundation.file_names import *; "
    code += "print(unit_stem('imu', 'magnetometer'), file_stem('a.magnetometer'))"
    assert run(extended, "-c", code) == "imu.magnetometer a_magnetometer\n"
