"""YAML from anywhere: read in bounded time and memory whatever it holds, into plain data or a `YAMLError`.

PyYAML leaves three doors open: nesting that exhausts the stack, aliases of aliases that unfold without end,
and constructors that raise whatever they like. JSON is read as the YAML that it is.

A subclass of `CSafeLoader` cannot close the first: 100 000 brackets end the process. `SafeLoader` raises, but
takes three times as long as this loader; both accept a key twice and read `1e-3` as text, 010 as 8, a date as
a date.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import yaml
from yaml.constructor import SafeConstructor
from yaml.resolver import Resolver

from tumble.foundation.words import short

DEEPEST = 64
"""Levels of nesting."""
MOST_NODES = 50_000
"""Keys, values, lists and mappings; what an alias stands for counts each time."""
LONGEST_NUMBER = 64
"""Characters of a number."""

if yaml.__with_libyaml__:
    from yaml._yaml import CParser as _Parser

    _Composer = _Parser
else:
    from yaml.composer import Composer
    from yaml.parser import Parser
    from yaml.reader import Reader
    from yaml.scanner import Scanner

    class _Parser(Reader, Scanner, Parser):  # type: ignore[no-redef]
        """Gives events."""

        def __init__(self, text: str) -> None:
            Reader.__init__(self, text)
            Scanner.__init__(self)
            Parser.__init__(self)

    class _Composer(_Parser, Composer):  # type: ignore[no-redef]
        """Gives nodes."""

        def __init__(self, text: str) -> None:
            _Parser.__init__(self, text)
            Composer.__init__(self)


_Mark: TypeAlias = Any
"""A place in a text, as either parser gives it."""


def parse(text: str) -> tuple[yaml.Node | None, Any]:
    """Returns the nodes of a text, which know their lines, and what they stand for.

    Raises `yaml.YAMLError` where it is no YAML, is larger or deeper than a document of ours can be, or holds
    what cannot be read as what it is declared to be.
    """
    try:
        _check_extent(text)
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
            return node, None if node is None else loader.construct_document(node)
        finally:
            loader.dispose()
    except (ValueError, OverflowError) as error:
        raise yaml.YAMLError(f"{type(error).__name__}: {error}") from error


def problem_in_words(error: yaml.YAMLError) -> str:
    """Describes the error, and its line where that is known."""
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        return f"line {error.problem_mark.line + 1}: {str(error.problem)[:_LONGEST_PROBLEM]}"
    lines = str(error)[:_LONGEST_PROBLEM].splitlines() or ["unreadable"]
    return f"not YAML: {lines[0]}"


_LONGEST_PROBLEM = 200


def _refusal(problem: str, mark: _Mark) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=mark)


@dataclass(slots=True)
class _Extent:
    """Size of a node together with all nodes that it refers to."""

    nodes: int = 1
    levels: int = 0

    def add(self, part: _Extent) -> None:
        """Counts a node among the parts of this one."""
        self.nodes += part.nodes
        self.levels = max(self.levels, 1 + part.levels)


def _check_extent(text: str) -> None:
    """Raises `yaml.YAMLError` where the nodes of a text, aliases unfolded, are too many or too deep.

    Events come before nodes: nothing has been built yet of a text that is refused.
    """
    parser = _Parser(text)
    document = _Extent()
    opened = [document]
    anchors: dict[str, _Extent] = {}
    unfolded = 0
    try:
        while parser.check_event():
            event: Any = parser.get_event()
            if isinstance(event, yaml.CollectionEndEvent):
                opened[-1].add(opened.pop())
                continue
            if not isinstance(event, yaml.NodeEvent):
                continue
            extent = _extent_of(event, anchors, opened)
            unfolded += extent.nodes
            if len(opened) + extent.levels > DEEPEST:
                raise _refusal(f"is nested more than {DEEPEST} levels deep", event.start_mark)
            if unfolded > MOST_NODES:
                raise _refusal(f"holds more than {MOST_NODES} keys and values", event.start_mark)
            if event.anchor is not None and not isinstance(event, yaml.AliasEvent):
                anchors[event.anchor] = extent
            if isinstance(event, yaml.CollectionStartEvent):
                opened.append(extent)
            else:
                opened[-1].add(extent)
    finally:
        parser.dispose()


def _extent_of(event: Any, anchors: Mapping[str, _Extent], opened: Sequence[_Extent]) -> _Extent:  # noqa: ANN401
    """Returns the extent of a node as far as it is known when it begins; an alias has that of its anchor."""
    if not isinstance(event, yaml.AliasEvent):
        return _Extent()
    found = anchors.get(event.anchor or "")
    if found is None:
        raise _refusal(f"found undefined alias {short(event.anchor)}", event.start_mark)
    if any(found is each for each in opened):
        raise _refusal(f"{short(event.anchor)} refers to itself", event.start_mark)
    return _Extent(found.nodes + 1, found.levels)


class _Loader(_Composer, SafeConstructor, Resolver):
    """Safe YAML that reads `1e-3` as a number, dates as text, and refuses a key given twice."""

    def __init__(self, text: str) -> None:
        _Composer.__init__(self, text)
        SafeConstructor.__init__(self)
        Resolver.__init__(self)

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:  # noqa: ANN401
        """Constructs the value of a node; a value of another type than it states is an error in the text."""
        kind = str(node.tag).rpartition(":")[2]
        if kind in ("int", "float") and len(node.value) > LONGEST_NUMBER:
            raise _refusal(
                f"a number of {len(node.value)} characters; {LONGEST_NUMBER} at most", node.start_mark
            )
        try:
            return super().construct_object(node, deep)
        except (ValueError, KeyError, IndexError, AttributeError, TypeError, OverflowError) as error:
            raise _refusal(f"{short(node.value)} cannot be read as {kind[:20]}", node.start_mark) from error

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Constructs a mapping with plain and unique keys."""
        seen: set[Any] = set()
        for key_node, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if not isinstance(key_node, yaml.ScalarNode):
                raise _refusal("a key needs to be a word", key_node.start_mark)
            if key_node.value in seen:
                raise _refusal(f"key {short(key_node.value)} is given twice", key_node.start_mark)
            seen.add(key_node.value)
        found: dict[Any, Any] = super().construct_mapping(node, deep)
        if len(found) < len(seen - {_MERGE}):  # words for one value, such as 1 and 1.0
            raise _refusal("two keys are equal", node.start_mark)
        return found

    def construct_decimal_int(self, node: yaml.ScalarNode) -> int:
        """Returns a whole number in decimal digits; another form is an error in the text."""
        return int(_checked(node, _WHOLE))

    def construct_decimal_float(self, node: yaml.ScalarNode) -> float:
        """Returns a number in decimal digits, infinity or NaN; another form is an error in the text."""
        if _UNBOUNDED.match(str(node.value)):
            return float(str(node.value).replace(".", ""))
        return float(_checked(node, _NUMBER))


def _checked(node: yaml.ScalarNode, form: re.Pattern[str]) -> str:
    text = str(node.value)
    if not form.match(text):
        raise ValueError(text)
    return text


# PyYAML follows YAML 1.1, which takes `1e-3` for text, 010 for 8 and 1:30 for 90. These are the forms of 1.2.
_WHOLE = re.compile(r"^[-+]?[0-9]+$")
_NUMBER = re.compile(r"^[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?$")
_UNBOUNDED = re.compile(r"^(?:[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$")
_TAG = "tag:yaml.org,2002:"
_MERGE = "<<"
"""Key that adds the keys of another mapping."""
_Loader.yaml_implicit_resolvers = {
    first: [
        (tag, form)
        for tag, form in resolvers
        # A serial number or a name that looks like a date stays the text it is.
        if tag.removeprefix(_TAG) not in ("timestamp", "int", "float")
    ]
    for first, resolvers in _Loader.yaml_implicit_resolvers.items()
}
_Loader.yaml_constructors = {
    **_Loader.yaml_constructors,
    f"{_TAG}int": _Loader.construct_decimal_int,
    f"{_TAG}float": _Loader.construct_decimal_float,
}


def state_numbers(kind: Any) -> None:  # noqa: ANN401 - a loader or dumper of PyYAML
    """Has a loader take for a number, and a dumper not leave as bare text, what is one in our documents."""
    kind.add_implicit_resolver(f"{_TAG}int", _WHOLE, list("-+0123456789"))
    kind.add_implicit_resolver(f"{_TAG}float", _NUMBER, list("-+.0123456789"))
    kind.add_implicit_resolver(f"{_TAG}float", _UNBOUNDED, list("-+."))


state_numbers(_Loader)
