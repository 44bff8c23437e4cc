"""The sample of mutants follows from its seed, each part has its share, and one build holds all of Rust."""

from __future__ import annotations

import json
import random

import pytest
from mutant_sample import Mutant, Span, merged, shuffled, wilson
from mutants_rust import Text, is_switchable, parsed, switched

LINES = {"core": 700, "store": 100, "procedures": 200}


def made(changes=2):
    """Mutants of three parts, as many places as lines, each with so many changes."""
    return [
        Mutant(part, f"{part}.rs", Span(line, 1, line, 2), change)
        for part, lines in LINES.items()
        for line in range(1, lines + 1)
        for change in "+-*/"[:changes]
    ]


def test_order_of_mutants_follows_from_the_seed_alone():
    mutants = made()
    order = merged(shuffled(mutants, 1), LINES)
    random.Random(3).shuffle(mutants)
    assert merged(shuffled(mutants, 1), LINES) == order
    assert merged(shuffled(mutants, 2), LINES) != order


def test_draw_of_a_part_does_not_depend_on_other_parts():
    alone = [mutant for mutant in made() if mutant.part == "store"]
    assert shuffled(alone, 1)["store"] == shuffled(made(), 1)["store"]


def test_each_place_is_drawn_once_whatever_its_changes():
    drawn = shuffled(made(1) + made(4), 1)
    assert {part: len({mutant.span for mutant in each}) for part, each in drawn.items()} == LINES
    assert {part: len(each) for part, each in drawn.items()} == LINES


def test_every_beginning_of_the_order_has_parts_by_lines():
    order = [mutant.part for mutant in merged(shuffled(made(), 1), LINES)]
    for size in range(1, len(order)):
        for part, lines in LINES.items():
            assert abs(order[:size].count(part) - size * lines / sum(LINES.values())) <= 1


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9, 1.0])
def test_interval_holds_its_share_and_shrinks_with_the_count(share):
    few, many = wilson(round(20 * share), 20), wilson(round(2000 * share), 2000)
    assert few[0] - 1e-15 <= many[0] - 1e-15 <= share <= many[1] + 1e-15 <= few[1] + 1e-15
    assert 3 * (many[1] - many[0]) < few[1] - few[0]


SOURCE = """//! A file with braces in "{ strings" and comments {.

/// Doubles {.
#[inline]
fn double<const N: usize>(x: [f64; { N }]) -> f64 where [(); { N }]: {
    // '}' is a letter here.
    let close = '}';
    fn plus(a: f64) -> f64 { a + 1.0 }
    x[0] * plus(2.0)
}

const fn two() -> usize { 1 + 1 }

fn all() -> impl Iterator<Item = usize> { 0..two() }
"""


def place(text, within=SOURCE):
    """Span of a text that is met once."""
    start = within.index(text)
    end = start + len(text)
    line, end_line = within.count("\n", 0, start) + 1, within.count("\n", 0, end) + 1
    return Span(line, start - within.rfind("\n", 0, start), end_line, end - within.rfind("\n", 0, end))


def mutant(old, new, function):
    return Mutant("tumble-core", "a.rs", place(old), new, place(function))


DOUBLE = SOURCE[SOURCE.index("#[inline]") : SOURCE.index("}\n\nconst") + 1]
PLUS = "fn plus(a: f64) -> f64 { a + 1.0 }"


def test_list_of_cargo_mutants_becomes_spans_and_changes():
    def span(line, column, end_line, end_column):
        return {
            "start": {"line": line, "column": column},
            "end": {"line": end_line, "column": end_column},
        }

    listed = {
        "name": "a.rs:9:10: replace * with +",
        "package": "tumble-core",
        "file": "a.rs",
        "function": {"function_name": "double", "return_type": "-> f64", "span": span(*place(DOUBLE))},
        "span": span(*place("* plus")[:3], place("* plus").column + 1),
        "replacement": "+",
        "genre": "BinaryOperator",
    }
    [found] = parsed(json.dumps([listed]))
    text = Text(SOURCE)
    assert text.cut(found.span) == "*"
    assert text.mutated(found) == SOURCE.replace("* plus", "+ plus")
    assert parsed(json.dumps([{**listed, "function": None}]))[0].function is None


def test_one_file_holds_every_mutant_and_the_body_as_it_was():
    numbered = {
        3: mutant("x[0] *", "x[0] /", DOUBLE),
        8: mutant("a + 1.0", "a - 1.0", PLUS),
    }
    out, lines = switched(Text(SOURCE), numbered, "switch")
    body = DOUBLE[DOUBLE.index(": {") + 3 : -1]
    assert out.count(body) == 1
    written = out.splitlines()
    for number, (first, last) in lines.items():
        copy = "\n".join(written[first - 1 : last])
        change = numbered[number]
        assert copy == Text(SOURCE).mutated(change)[SOURCE.index(body) :][: len(copy)]
        assert written[first - 2].endswith(f"if switch::is_active({number}) {{")
    assert out.startswith(SOURCE[: SOURCE.index(body)])
    assert out.endswith(SOURCE[SOURCE.index("}\n\nconst") :])


def test_what_the_compiler_evaluates_is_built_alone():
    text = Text(SOURCE)
    assert is_switchable(text, mutant("x[0] *", "x[0] /", DOUBLE))
    assert not is_switchable(text, mutant("1 + 1", "1 - 1", "const fn two() -> usize { 1 + 1 }"))
    assert not is_switchable(
        text, mutant("0..two", "1..two", "fn all() -> impl Iterator<Item = usize> { 0..two() }")
    )
    assert not is_switchable(text, Mutant("tumble-core", "a.rs", Span(1, 1, 1, 2), ""))
