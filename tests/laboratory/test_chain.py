"""Laws of the chain: no row, order or entry can be changed without a hash that no longer fits."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from tumble.laboratory.chain import FIRST, content_hash, next_entry, stored

values = st.one_of(
    st.none(), st.integers(-(2**31), 2**31), st.floats(allow_nan=False, allow_infinity=False), st.text()
)
rows = st.dictionaries(st.sampled_from("abcdef"), values, min_size=1)
contents = st.dictionaries(st.sampled_from(["unit", "session"]), st.lists(rows, max_size=4))


def kept(row):
    return {name: stored(value) for name, value in row.items() if value is not None}


@given(contents, st.randoms())
def test_the_order_of_rows_does_not_count(content, random):
    shuffled = {name: random.sample(found, len(found)) for name, found in content.items()}
    assert content_hash(shuffled) == content_hash(content)


@given(st.lists(rows, min_size=1, max_size=4), st.data())
def test_one_changed_value_changes_the_hash(found, data):
    place = data.draw(st.integers(0, len(found) - 1))
    name = data.draw(st.sampled_from(sorted(found[place])))
    changed = [*found]
    changed[place] = found[place] | {name: data.draw(values)}
    same = sorted(map(repr, map(kept, found))) == sorted(map(repr, map(kept, changed)))
    clean = [{"unit": [kept(row) for row in each]} for each in (found, changed)]
    assert (content_hash(clean[0]) == content_hash(clean[1])) == same


@given(rows)
def test_a_column_that_a_later_version_adds_changes_no_hash(row):
    assert content_hash({"unit": [row | {"later": None}], "later": []}) == content_hash({"unit": [row]})


@given(rows)
def test_a_row_in_another_table_is_another_content(row):
    assert content_hash({"unit": [row]}) != content_hash({"session": [row]})


@given(st.lists(contents, min_size=1, max_size=5))
def test_each_entry_follows_from_all_before_it(added):
    entries = []
    for content in added:
        last = entries[-1] if entries else None
        entries.append(next_entry(last, "2026-01-01T00:00:00Z", "Ann", "result added", content))
    assert [entry.number for entry in entries] == list(range(1, len(added) + 1))
    assert entries[0].previous == FIRST
    assert all(entry.hash == entry.expected_hash for entry in entries)
    assert all(later.previous == entry.hash for entry, later in pairwise(entries))
    for field in ("date", "who", "what", "content", "previous"):
        assert replace(entries[-1], **{field: "other"}).expected_hash != entries[-1].hash


@given(st.one_of(st.text(), st.floats()))
def test_what_is_stored_is_stored_the_same_again(value):
    once = stored(value)
    assert stored(once) == once
    if isinstance(once, str):
        assert "\x00" not in once
        once.encode("utf-8")
