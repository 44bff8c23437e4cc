"""Labels of the units that share a line of text: `a: 1,2,3`, a column, a field of JSON."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

from tumble.live.address import Address
from tumble.logs.json_objects import OBJECTS
from tumble.logs.options import ReadOptions
from tumble.logs.row_labels import MOST_LABELS, label_names
from tumble.logs.text import names_delimiter, numbers_delimiter, split_line
from tumble.logs.track import none_such, several

LabelRow: TypeAlias = str | dict[str, Any]
"""A line of text, or an object of JSON."""
FOR_ALL = None
"""Label of what is for every unit, as names of columns are."""
UNLABELLED = ""
ROWS_TO_HEAR = 20
"""Rows with labels after which it is decided which units there are."""
ROWS_WITHOUT_LABEL = 5
"""Rows without a label after which they are those that are read, unless more have one: some are torn."""
_PREFIXED = re.compile(r"(?P<label>[A-Za-z_][\w./-]*)\s*(?P<between>[:,;|\s])\s*(?P<row>[^\s].*)")
_NUMBERS_IN_WORDS = ("nan", "inf", "infinity")
_BEGIN_NUMBER = frozenset("0123456789+-.")


MOST_KEPT = 100
"""Rows without a decision after which the reader of rows reports their fault."""


class LabelledRow(NamedTuple):
    """A row, and the unit it is of."""

    label: str | None
    """`UNLABELLED` where it has no label."""
    row: LabelRow


class LabelReader:
    """Takes lines apart: whose each is, and the objects of JSON it holds."""

    def __init__(self, options: ReadOptions) -> None:
        self._options = options
        self._lines_to_skip = options.skip_lines
        self.heard: Counter[str] = Counter()
        """Rows with each label so far."""
        self._prefixes: set[str] = set()
        self._column: int | None = None
        """Number of the column with the label, once names of columns came that include one."""
        self._delimiter = ","

    def expect(self, label: str) -> None:
        """Accepts a word as the name of a unit, however many other words came."""
        self._prefixes.add(label)

    def follow(self, previous: LabelReader) -> None:
        """Goes on with the labels of the line that this one is the return of."""
        self.heard.update(previous.heard)
        self._prefixes |= previous._prefixes
        self._column, self._delimiter = previous._column, previous._delimiter

    def read(self, lines: Sequence[bytes]) -> list[LabelledRow]:
        """Label lines, in their order."""
        rows: list[LabelledRow] = []
        for line in lines:
            if self._lines_to_skip > 0:
                self._lines_to_skip -= 1
                continue
            text = line.decode("utf-8", "replace").strip("\ufeff \t\r\n\f\v")
            if self._column is None and text[:1] in _BEGIN_NUMBER:
                rows.append(LabelledRow(UNLABELLED, text))
            else:
                objects = text.startswith(("{", "["))
                rows += self._counted(_objects(text, UNLABELLED) if objects else self._labelled(text))
        return rows

    def _counted(self, rows: list[LabelledRow]) -> list[LabelledRow]:
        for label, _ in rows:
            if label and (label in self.heard or len(self.heard) < MOST_LABELS):
                self.heard[label] += 1
        return rows

    def _labelled(self, text: str) -> list[LabelledRow]:
        if self._column is not None and (label := self._field(text)) is not None:
            return [LabelledRow(label, text)]
        if (found := _PREFIXED.fullmatch(text)) and self._is_prefix(**found.groupdict()):
            return _objects(found["row"], found["label"])
        # Under a column of labels, what has none is torn: whoever reads rows counts it.
        for_all = self._are_names(text) or self._column is not None
        return [LabelledRow(FOR_ALL if for_all else UNLABELLED, text)]

    def _field(self, text: str) -> str | None:
        """Label in the column of labels; None where the row has none, or names columns."""
        assert self._column is not None, "asked only where there is one"
        fields = split_line(text, self._delimiter)
        label = fields[self._column] if len(fields) > self._column else ""
        return None if not label or label_names((label,)) else label

    def _is_prefix(self, label: str, between: str, row: str) -> bool:
        if label in self._prefixes:
            return True
        if label.lower() in _NUMBERS_IN_WORDS or len(self._prefixes) >= MOST_LABELS:
            return False
        named = between == ":" and names_delimiter(row, self._options) is not None
        if not (named or row.startswith("{") or numbers_delimiter(row) is not None):
            return False
        self._prefixes.add(label)
        return True

    def _are_names(self, text: str) -> bool:
        """Returns whether a line names columns, and stores which of them holds labels."""
        body = text.lstrip("#%").strip()
        delimiter = names_delimiter(body, self._options)
        if delimiter is None:
            return False
        names = split_line(body, delimiter)
        columns = [names.index(name) for name in label_names(tuple(names))]
        self._column, self._delimiter = columns[0] if columns else None, delimiter
        return True


def _objects(text: str, label: str) -> list[LabelledRow]:
    """Reads an object of JSON, or an array of them; what is none stays text."""
    if not text.startswith(("{", "[")):
        return [LabelledRow(label, text)]
    try:
        value = OBJECTS.decode(text)
    except (ValueError, RecursionError):
        return [LabelledRow(label, text)]
    objects = value if isinstance(value, list) else [value]
    rows = [LabelledRow(label or _label_in(each), each) for each in objects if isinstance(each, dict)]
    return rows or [LabelledRow(label, text)]


def _label_in(value: dict[str, Any]) -> str:
    for name in label_names(tuple(value)):
        label = value[name]
        if isinstance(label, str) and label:
            return label
        if isinstance(label, float) and label.is_integer():
            return str(int(label))
    return UNLABELLED


class LabelChoice:
    """Keeps back what comes until it is known which rows are those of the unit that is read."""

    def __init__(self, address: Address, wanted: str | None, *, joined_midway: bool) -> None:
        self.label: str | None = None
        """Label of the rows that are read, once it is decided."""
        self.prefix: str | None = None
        """Name of the unit where columns are distinguished by the front of their names, and no rows are."""
        self._address = address
        self._wanted = wanted
        self._holds_all = False
        self._is_open = True
        """Indicates whether later rows may change the decision."""
        self._may_be_torn = joined_midway
        """Indicates whether the next row may have lost its label with its front."""
        self._without_label = 0
        self._kept: list[LabelledRow] = []

    def follow(self, previous: LabelChoice) -> None:
        """Keeps to the choice of the source that this one is the return of, where it was made."""
        if previous.label is not None or previous._holds_all:
            self.label, self.prefix, self._holds_all = previous.label, previous.prefix, previous._holds_all
            self._is_open = previous._is_open

    @property
    def keeps(self) -> bool:
        """Indicates whether rows are kept back, of whatever unit, where none is wanted."""
        return self._wanted is None and bool(self._kept)

    def mine(self, rows: Sequence[LabelledRow]) -> list[LabelRow]:
        """Returns those of the unit, with those of before once it is decided which they are.

        Raises `LogError` that lists the units received, where the one that is wanted is none of them, or
        there are several and none is wanted.
        """
        if self._is_open:
            rows = self._weigh(rows)
        return [row for label, row in rows if self._holds_all or label in (self.label, FOR_ALL)]

    def _weigh(self, rows: Sequence[LabelledRow]) -> Sequence[LabelledRow]:
        """Decides whose rows are read, and returns those that are no longer to be kept back."""
        torn, self._may_be_torn = int(self._may_be_torn), False
        self._without_label += sum(
            each.label == UNLABELLED and not _says_nothing(each) for each in rows[torn:]
        )
        kept = [*self._kept, *rows]
        self._decide(Counter(label for label, _ in kept if label), len(kept))
        if not self._is_open:
            self._kept = []
            return kept
        # Without a label nothing is to be waited for: arrival may be the only time that samples have.
        waits = [bool(each.label) or not (self.label == UNLABELLED or _says_nothing(each)) for each in kept]
        self._kept = [each for each, wait in zip(kept, waits, strict=True) if wait]
        return [LabelledRow(FOR_ALL, each.row) for each, wait in zip(kept, waits, strict=True) if not wait]

    def _decide(self, labels: Counter[str], kept: int) -> None:
        if self._wanted in labels:
            self.label, self.prefix, self._is_open = self._wanted, None, False
        elif self._without_label > labels.total():
            self.label, self.prefix = UNLABELLED, self._wanted
            self._is_open = self._without_label < ROWS_WITHOUT_LABEL
        elif labels.total() >= ROWS_TO_HEAR:
            self.prefix, self._is_open = None, False
            self._choose(labels)
        elif kept >= MOST_KEPT:
            self.label, self.prefix, self._is_open = UNLABELLED, self._wanted, False

    def _choose(self, labels: Counter[str]) -> None:
        names = sorted(name for name, count in labels.items() if count > 1)
        if self._wanted is not None:
            raise none_such(self._address.text, "unit", self._wanted, names or sorted(labels))
        # A label that is new in every row is a counter.
        if 2 * len(labels) > labels.total():
            self._holds_all = True
        elif len(names) > 1:
            raise several(self._address.text, self._address.text.partition("?")[0], names)
        else:
            self.label = names[0]


def _says_nothing(each: LabelledRow) -> bool:
    """Returns whether the row has neither a label nor a possible sample."""
    return each.label == UNLABELLED and isinstance(each.row, str) and each.row[:1] not in _BEGIN_NUMBER
