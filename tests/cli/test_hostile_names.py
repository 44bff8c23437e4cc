"""Names from outside are shown escaped, the same way in all commands: none begins a line of its own."""

from __future__ import annotations

import ast
import json
import unicodedata
from pathlib import Path

import pytest

import tumble
from made_up_calibrations import made_up, save
from made_up_certificates import options, with_covariance
from tumble.calibration.document import Calibration
from tumble.foundation.translation import LANGUAGES
from tumble.foundation.words import plain, printable
from tumble.laboratory.registry import Registry
from turntable_sessions import typed

NAME = "a\nforged: all is well\u202e\x1b[31m\u061c\u2028\tb"
R = ("--registry", "lab.db")
COMMANDS = (
    ("registry", "add", "a", "--model", NAME, "--lot", NAME, "--manufacturer", NAME, *R),
    ("registry", "list", *R),
    ("registry", "show", NAME, *R),
    ("registry", "history", NAME, *R),
    ("registry", "due", NAME, *R),
    ("registry", "equipment", NAME, "--serial", NAME, "--kind", "reference", *R),
    ("registry", "equipment", *R),
    ("registry", "export", "x.csv", *R),
    ("certificate", "issue", "a", *options(), *R),
    ("certificate", "list", *R),
    ("certificate", "show", "IMU-2026-0001", *R),
    ("certificate", "withdraw", "IMU-2026-0001", "--why", NAME, *R),
    ("certificate", "list", *R),
    ("inspect", NAME),
    ("compare", "a/result_0.yaml", "a/result_0.yaml"),
)


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    """A registry, and a result of a unit whose serial and operator are hostile."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "nobody"))
    Registry.create(tmp_path / "lab.db")
    save(tmp_path / "a", with_covariance(made_up(serial=NAME, log="x", operator=NAME)))


def test_no_name_begins_a_line_or_steers_a_terminal(workplace):
    bad = []
    for words in COMMANDS:
        done = typed(*words)
        assert done.code in (0, 2, 3), done
        for line in (done.out + done.err).split("\n"):
            if line.lstrip().startswith("forged") or printable(line) != line:
                bad.append((words[:2], line))
    assert bad == []


def test_a_log_with_a_hostile_name_is_read(workplace):
    path = f"{NAME}.csv"
    assert typed("simulate", "spin", "--turns", "1", "--seed", "7", "-o", "made").code == 0
    Path("made/spin.csv").rename(path)
    for words in (("inspect", path), ("noise", path), ("spin", path), ("convert", path, "out.csv")):
        done = typed(*words)
        assert done.code in (0, 2, 3), done
        assert "no such file" not in done.err, words
        for line in (done.out + done.err).split("\n"):
            assert not line.lstrip().startswith("forged"), words
            assert printable(line) == line, words


def test_no_name_steers_a_page(workplace):
    assert typed("simulate", "spin", "--turns", "1", "--seed", "7", "-o", "made").code == 0
    Path("made/spin.csv").rename(f"{NAME}.csv")
    own = ("--operator", NAME, "--station", NAME, "--serial", NAME)
    for language in LANGUAGES:
        for words in (
            ("spin", f"{NAME}.csv", *own),
            ("noise", f"{NAME}.csv", *own),
            ("compare", "a/result_0.yaml", "a/result_0.yaml", *own[:4]),
        ):
            assert typed(*words, "-o", f"{words[0]}-{language}", "--language", language).code in (0, 3)
    assert typed("registry", "add", "a", "--model", NAME, *R).code == 0
    assert typed("registry", "history", NAME, "-o", "history", *R).code == 0
    pages = [page for page in Path().rglob("*.html") if page.parts[0] != "a"]
    assert len(pages) == 3 * len(LANGUAGES) + 1
    for page in pages:
        text = page.read_text()
        assert printable(text) == text, page
        assert "forged" in text, page


def test_what_a_notebook_shows_is_escaped(workplace):
    found = Calibration.load("a/result_0.yaml")._repr_html_()
    assert "forged" in found
    assert printable(found) == found
    functions = [
        (path, function)
        for path in Path(tumble.__file__).parent.rglob("*.py")
        for function in ast.walk(ast.parse(path.read_text()))
        if isinstance(function, ast.FunctionDef) and function.name == "_repr_html_"
    ]
    assert len(functions) > 10
    for path, function in functions:
        assert ast.unparse(function.body[-1]).startswith("return printable("), path


def test_json_keeps_a_name_as_it_is(workplace):
    assert typed(*COMMANDS[0]).code == 0
    (row,) = json.loads(typed("registry", "list", "--json", *R).out)["results"]
    assert row["serial"] == NAME


def test_what_is_plain_has_no_control_character():
    every = "".join(map(chr, range(0x2070)))
    assert plain(plain(every)) == plain(every)
    assert "Cc" not in map(unicodedata.category, plain(every))
    assert plain("\t\n") == r"\t\n"
