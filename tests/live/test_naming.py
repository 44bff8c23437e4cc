"""Units and their sources as they are typed."""

from __future__ import annotations

import pytest

from tumble.foundation.errors import LogError
from tumble.live.naming import parse_named_sources


def test_units_keep_their_order_and_a_source_may_hold_equal_signs():
    named = parse_named_sources(["b=udp://:9000?from=10.0.0.7", "a=replay:log.csv"])
    assert [(name, address.text) for name, address in named.items()] == [
        ("b", "udp://:9000?from=10.0.0.7"),
        ("a", "replay:log.csv"),
    ]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "no unit to listen to; give NAME=SOURCE"),
        (["udp://:9000"], "udp://:9000: names no unit; give NAME=SOURCE"),
        (["udp://:9000?from=10.0.0.7"], "names no unit"),
        (["=udp://:9000"], "names no unit"),
        (["a/b=udp://:9000"], "'a/b' cannot name a unit; .* such as a_b"),
        (["a=udp"], "no live source"),
        (["a=udp://:9000", "a=udp://:9001"], "a is named twice"),
        (["a=udp://:9000", "b=udp://:9000"], "a and b are the same source"),
        (["a=udp://:9000?from=h", "b=UDP:9000"], None),
    ],
)
def test_words_without_units_are_refused_in_one_line(words, says):
    if says is None:
        assert len(parse_named_sources(words)) == 2
        return
    with pytest.raises(LogError, match=says) as caught:
        parse_named_sources(words)
    assert "\n" not in str(caught.value)
