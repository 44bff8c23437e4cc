"""The check of language finds what it bans, counts it, and the repository passes it."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GLOSSARY = """## Preferred and banned words

| banned | preferred |
|---|---|
| tells, told | reports |
| as read | raw |
| exclude* | exclude |

## Types
"""


def _loaded():
    path = ROOT / "scripts" / "check_language.py"
    spec = importlib.util.spec_from_file_location("check_language", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["check_language"] = module
    spec.loader.exec_module(module)
    return module


check = _loaded()
banned = check.BannedWords(GLOSSARY)


def findings(name, source):
    return [str(finding) for finding in check.findings_in(name, source, banned)]


@pytest.mark.parametrize("opening", sorted(check.OPENINGS))
@pytest.mark.parametrize("marker", ["///", "//!", "//"])
def test_openings_in_comments_of_rust_are_found(opening, marker):
    source = f"{marker} Mean of a rest.\n{marker}\n{marker} {opening} the unit moved.\nfn f() {{}}\n"
    assert findings("a.rs", source) == [f"a.rs:3: sentence begins with '{opening}'"]


def test_sentences_within_a_paragraph_are_held_to_the_rule():
    assert findings("a.rs", "/// Scatter of a block. How it is used\n/// is below.\n") == [
        "a.rs:1: sentence begins with 'How'"
    ]


def test_words_within_a_sentence_are_no_opening():
    assert findings("a.rs", "/// Returns whether it moved, and how\n/// What is ours stays.\n") == []


def test_banned_words_are_found_across_lines_with_any_ending():
    found = sorted(findings("a.rs", "// Sigmas as\n// read; excluded.\nlet a = 1; // told twice\n"))
    assert found == [
        "a.rs:1: 'as read' is banned; write: raw",
        "a.rs:2: 'excluded' is banned; write: exclude",
        "a.rs:3: 'told' is banned; write: reports",
    ]


def test_code_formulas_links_and_strings_are_exempt():
    source = "/// Calls `told()` ([`tells`](told)); $told$.\n/// ```\n/// told\n/// ```\n"
    assert findings("a.rs", source + 'let a = "told"; // `told`\n') == []


def test_long_sentences_of_pages_are_found_and_lists_are_none():
    long = "It measures " + "and " * 39
    found = ["a.md:2: sentence has 42 words, more than 40"]
    assert findings("a.md", f"# Page\n{long}turns.\n") == found
    assert findings("a.md", f"# Page\n{long}`code that` is short.\n")[0].startswith("a.md:2: sentence has")
    assert findings("a.md", f"| {long}rests; {long[3:]}turns |\n".replace("and " * 5, "")) == []
    assert findings("a.md", f"Text:\n\n    {long}turns.\n\n```\n{long}\n```\n") == []
    assert findings("a.md", f"{long[:99]}. {long[:99]}.\n\n- {long[:99]}\n- {long[:99]}\n") == []
    assert findings("CHANGELOG.md", f"{long}turns.\n") == []


def test_docstrings_and_comments_of_python_are_held():
    source = '"""What it is."""\n\nA = "told"\n"""As told."""\n\n# Whether it\n# tells.\n'
    assert sorted(findings("a.py", source)) == [
        "a.py:1: sentence begins with 'What'",
        "a.py:4: 'told' is banned; write: reports",
        "a.py:4: sentence begins with 'As'",
        "a.py:6: sentence begins with 'Whether'",
        "a.py:7: 'tells' is banned; write: reports",
    ]


def test_comments_of_c_are_held_to_the_rules():
    source = "/**\n * Mean.\n *\n * Of a rest.\n */\nint a; // told\n"
    assert findings("a.h", source) == [
        "a.h:4: sentence begins with 'Of'",
        "a.h:6: 'told' is banned; write: reports",
    ]


def test_pages_are_held_but_not_their_code_and_banned_words():
    page = f"# What it is\n\n- Mean.\n- Of a rest, told.\n\n```\ntold\n```\n\n{GLOSSARY}\nWhose is it?\n"
    assert findings("a.md", page) == [
        "a.md:4: sentence begins with 'Of'",
        "a.md:20: sentence begins with 'Whose'",
        "a.md:4: 'told' is banned; write: reports",
    ]


@pytest.mark.parametrize(("letters", "found"), [(60, 0), (61, 1)])
def test_names_of_tests_have_sixty_letters_at_most(letters, found):
    name = "n" * letters
    assert len(findings("a.rs", f"#[test]\n#[ignore]\nfn {name}() {{}}\n")) == found
    assert len(findings("a.py", f"def test_{name}(): ...\n")) == found


@pytest.mark.parametrize(("letters", "found"), [(72, 0), (73, 1)])
def test_commit_subjects_have_72_letters_at_most(letters, found):
    assert len(list(check.subject_findings(["abc123 " + "n" * letters]))) == found


def test_counts_may_neither_rise_nor_stay_above_the_findings():
    counted = {"a": 2, "b": 2, "c": 2}
    errors = list(check.ratchet_errors({"a": 3, "b": 2, "c": 1, "new": 1}, counted))
    assert [error.split(",")[0] for error in errors] == ["a: 3 findings", "c: 1 findings", "new: 1 findings"]
    assert check.lowered({"a": 3, "b": 2, "c": 1, "new": 1}, counted) == {"a": 2, "b": 2, "c": 1}


def test_a_file_belongs_to_the_longest_folder_that_holds_it():
    folders = ["crates", "crates/core", "crates/core/src/spin"]
    assert check.folder_of("crates/core/src/spin/a.rs", folders) == "crates/core/src/spin"
    assert check.folder_of("crates/core/src/a.rs", folders) == "crates/core"
    assert check.folder_of("scripts/a.py", folders) == "scripts"


def test_a_glossary_without_the_table_is_an_error():
    with pytest.raises(ValueError, match="no table"):
        check.BannedWords("# Glossary\n")


def test_the_glossary_bans_words_and_prefers_others():
    words = check.BannedWords((ROOT / check.GLOSSARY).read_text(encoding="utf-8"))
    assert len(words.preferred) > 20
    assert not set(words.preferred) & {each.lower() for each in words.preferred.values()}
