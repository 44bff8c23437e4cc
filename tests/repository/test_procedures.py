"""A new procedure is a folder and its row: two files besides know it by name."""

from __future__ import annotations

import json
import os
import pkgutil
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import tumble
from tumble.foundation.procedures import PROCEDURES

ROOT = Path(__file__).parents[2]
COPIED = ("python/tumble", "scripts", "docs/how-to", "docs/reference", "docs/schema", "mkdocs.yml")
"""Files that may have to know a procedure."""
FOLDER = "python/tumble/procedures/barometer"
DUMMY = {
    "__init__.py": "",
    "procedure.py": "def barometer():\n    return 'found'\n",
    "result.py": "class BarometerResult: pass\n",
    "serves.py": "def services(evidence):\n    yield evidence.service('barometer', ('a barometer',))\n",
    "command.py": "def barometer_command() -> None:\n    print('north')\n",
    "summary_document.py": "from typing import Literal\nfrom pydantic import Field\n"
    "from tumble.foundation.printed import PrintedResult\n"
    "class BarometerDocument(PrintedResult):\n"
    "    schema_: Literal['tumble-barometer-result/1'] = "
    "Field('tumble-barometer-result/1', alias='schema')\n"
    "    verdict: str\n",
}


@pytest.mark.parametrize("row", PROCEDURES, ids=lambda row: row.word)
def test_a_row_says_what_its_folder_holds(row):
    for module, name in (
        ("procedure", row.word),
        ("result", row.result),
        ("command", f"{row.word}_command"),
        *((("serves", "services"),) if row.serves else ()),
        ("summary", "json_content"),
        ("summary_document", f"{row.word.capitalize()}Document"),
    ):
        assert hasattr(import_module(f"{row.folder}.{module}"), name)
    assert {row.word, row.result} <= set(tumble.__all__)
    summary = import_module(f"{row.folder}.command").__dict__[f"{row.word}_command"].__doc__
    assert summary.startswith(row.summary)
    assert (ROOT / "docs" / "how-to" / f"{row.word}.md").exists()


def changed(path, before, after):
    """Put something into a file, in the one place where it belongs."""
    source = path.read_text()
    assert source.count(before) == 1, (path, before)
    path.write_text(source.replace(before, after))


@pytest.fixture(scope="module")
def extended(tmp_path_factory):
    """A copy of the repository with one more procedure: a folder, and the files that must know it."""
    root = tmp_path_factory.mktemp("repository")
    for part in COPIED:
        leave = shutil.ignore_patterns("__pycache__")
        if (ROOT / part).is_dir():
            shutil.copytree(ROOT / part, root / part, ignore=leave)
        else:
            shutil.copy(ROOT / part, root / part)
    folder = root / FOLDER
    folder.mkdir()
    for name, source in DUMMY.items():
        (folder / name).write_text(source)
    row = '    Procedure("barometer", "BarometerResult", "Find the north.", title="North", '
    row += 'endings=("barometer",), files=("north",)),\n'
    changed(
        root / "python/tumble/foundation/procedures.py",
        ')\n"""Procedures in the order',
        f'{row})\n"""Procedures in the order',
    )
    names = '    "BarometerResult",\n    "barometer",\n'
    changed(root / "python/tumble/__init__.py", "__all__ = [\n", f"__all__ = [\n{names}")
    (root / "docs/how-to/barometer.md").write_text("# North\n")
    return root


def run(extended, *words):
    done = subprocess.run(
        [sys.executable, *words],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": f"{extended / 'python'}{os.pathsep}{extended / 'scripts'}"},
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_three_files_know_a_procedure_besides_its_folder(extended):
    """It was fourteen, and nine at the last count; its core and binding are not counted."""
    known = {
        path.relative_to(extended).as_posix()
        for part in COPIED
        for path in [extended / part, *(extended / part).rglob("*")]
        if path.is_file() and not path.is_relative_to(extended / FOLDER) and "__pycache__" not in path.parts
        if not (ROOT / path.relative_to(extended)).exists()
        or path.read_bytes() != (ROOT / path.relative_to(extended)).read_bytes()
    }
    assert known == {
        "python/tumble/foundation/procedures.py",
        "python/tumble/__init__.py",
        "docs/how-to/barometer.md",
    }


def test_the_layers_hold_with_a_new_procedure(extended):
    assert run(extended, "-c", "import check_layers; print(list(check_layers.python_breaches()))") == "[]\n"


def test_a_new_row_is_a_page_of_the_site_whose_commands_are_run(extended):
    code = "import check_commands; print(check_commands.PAGES)"
    assert "how-to/barometer.md" in run(extended, "-c", code)
    code = "import site_procedures as s; c = type('C', (), {})(); c.nav = [{s.SHELF: []}]; "
    code += "print(s.on_config(c).nav, s.on_page_markdown('<!-- procedures -->'))"
    shown = run(extended, "-c", code)
    assert "{'North': 'how-to/barometer.md'}" in shown
    assert "::: tumble.barometer" in shown


def test_a_new_row_has_its_schema(extended):
    assert "barometer-result" in run(extended, "-m", "tumble", "schema")
    made = json.loads(run(extended, "-m", "tumble", "schema", "barometer-result"))
    assert made["properties"]["schema"]["const"] == "tumble-barometer-result/1"


def test_a_new_row_is_a_command_with_its_line_of_help(extended):
    assert "Find the north." in run(extended, "-m", "tumble", "--help")
    assert run(extended, "-m", "tumble", "barometer") == "north\n"


def test_a_new_row_is_a_function_and_a_type_of_the_package(extended):
    code = "import tumble; tumble.BarometerResult(); print(tumble.barometer())"
    assert run(extended, "-c", code) == "found\n"


def test_a_new_row_is_asked_what_a_recording_serves_for(extended, tmp_path):
    made = run(extended, "-m", "tumble", "simulate", "static", "--duration", "5", "-o", tmp_path, "--json")
    log = next(tmp_path.glob("*.csv"))
    assert made
    (inspection,) = json.loads(run(extended, "-m", "tumble", "inspect", str(log), "--json"))["logs"]
    services = {each["procedure"]: each["missing"] for each in inspection["services"]}
    assert services["barometer"] == ["a barometer"]


def test_a_new_row_names_files_of_units(extended):
    code = "from tumble.foundation.file_names import *; "
    code += "print(unit_stem('imu', 'barometer'), file_stem('a.barometer'), 'north' in TAKEN)"
    assert run(extended, "-c", code) == "imu.barometer a_barometer True\n"


ALONE = ("tumble.__main__", "tumble.cli.console", "tumble.laboratory.migrations.env")
"""Modules that run the command, take Control-C for themselves or belong to a migration, once imported."""


def test_every_module_of_the_package_can_be_imported():
    """`tumble.procedures.spin` is a package, although `tumble.spin` is a function."""
    modules = sorted(each.name for each in pkgutil.walk_packages(tumble.__path__, "tumble."))
    assert len(modules) > 800
    assert [each for each in modules if each not in ALONE and import_module(each).__name__ != each] == []
