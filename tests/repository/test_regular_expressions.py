"""Regular expressions take time that grows with the length of a text, and not with its square."""

from __future__ import annotations

import re
import subprocess
import sys

import regular_expressions
from regular_expressions import is_slow
from repetitions import few

BOUNDED = {
    "columns.py": "names of at most 100 letters (_LONGEST_NAME)",
    "labels.py": "lines of at most 4096 bytes (LONGEST_LINE)",
    "setting_table.py": "thresholds of at most 100 letters",
    "translation.py": "pages of our own, in which signs of others are escaped",
    "catalogue.py": "texts of our own, and templates",
    "c_names.py": "a name that whoever runs the command types",
    "address.py": "an address that whoever runs the command types",
    "printed.ts": "numbers of our own",
    "reading.ts": "names of files",
}
"""Files with expressions that see short texts alone, and why."""


def test_time_grows_with_the_length_of_a_text():
    words = [sys.executable, regular_expressions.__file__, *BOUNDED]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == []


def test_expressions_that_are_slow_are_found():
    matched = (r"\s*([^,;=\t]+?)\s*[,;]*", r"(.*?)\s*(?:\((.*)\))?", r"\d+\.?\d*")
    for pattern in few(matched, 1):
        assert is_slow(re.compile(pattern), "fullmatch")
    searched = (r"\s+$", r'^"+|"+$', r"([A-Za-z_][\w ]*?)\s*[:=]", r"[a-z][\w.]*://")
    for pattern in few(searched, 2):
        assert is_slow(re.compile(pattern), "search")
    assert not is_slow(re.compile(r"\s*\d+(?:\.\d*)?\s*"), "fullmatch")
    assert not is_slow(re.compile(r"\s+[,;]"), "fullmatch")


def test_all_of_the_page_are_looked_at():
    places = {place.partition(":")[0] for place, _, _ in regular_expressions.of_the_page()}
    assert {"text.ts", "serial.ts", "rows.ts", "yaml.ts"} <= places
