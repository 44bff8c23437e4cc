"""A table's language, as a laboratory writes it down: commands, queries, units and limits, in YAML."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, field_validator, model_validator

from tumble.foundation.documents import Document, Vector, document_content, read_document
from tumble.foundation.errors import TableError
from tumble.foundation.file_status import entries, exists
from tumble.foundation.schemas import TABLE_PROFILE
from tumble.tools.table.axes import Axis, AxisLimits

SCHEMA: Literal["tumble-table-profile/1"] = "tumble-table-profile/1"

FIELD = re.compile(r"\{(?P<name>[a-z]*)(?::(?P<sign>\+?)(?P<digits>\d?))?\}")
"""`{angle}`, `{angle:3}` with three digits after the point, `{angle:+3}` with its sign always."""
NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
PER_AXIS = "{axis}"
"""Field of a command that is sent once for each axis."""
FORMS = {"axis": r"\S*?", "status": r"(?:0[xX]|#[hH])?[0-9A-Fa-f]+"}
"""Forms of fields other than numbers."""
DIGITS = 4
"""Digits after the point, where a field does not state them."""

Positive = Annotated[float, Field(gt=0.0, strict=False)]

ANGLES = {"deg": math.pi / 180.0, "rad": 1.0, "rev": 2.0 * math.pi}
"""rad in one of each."""
RATES = {"deg/s": ANGLES["deg"], "rad/s": 1.0, "rev/min": ANGLES["rev"] / 60.0}
ACCELERATIONS = {"deg/s^2": ANGLES["deg"], "rad/s^2": 1.0}


def _bits(given: object) -> object:
    """Reads a hexadecimal mask such as 0x06, which is text in our YAML, as manuals of tables state them."""
    return int(given, 16) if isinstance(given, str) and given.lower().startswith("0x") else given


BitMask = Annotated[int, Field(ge=0), BeforeValidator(_bits)]
"""Bits of a status."""


def _sendable(text: str) -> str:
    """Refuses text that no line carries: found at a stop, it would leave the table moving."""
    if not text.isascii():
        raise ValueError(f"{text!r} cannot be sent, as it is not ASCII; write it in letters of the table")
    return text


Sent = Annotated[str, AfterValidator(_sendable)]
"""Text that goes over the line to the table, or comes from it."""


class Units(Document):
    """Units of all numbers in this file and on the line."""

    angle: Literal["deg", "rad", "rev"] = "deg"
    rate: Literal["deg/s", "rad/s", "rev/min"] = "deg/s"
    acceleration: Literal["deg/s^2", "rad/s^2"] = "deg/s^2"

    def factor(self, quantity: str) -> float:
        """Returns what a number of a field is multiplied with to be in rad, rad/s or rad/s^2."""
        match quantity:
            case "angle":
                return ANGLES[self.angle]
            case "rate":
                return RATES[self.rate]
        return ACCELERATIONS[self.acceleration]


class Line(Document):
    """Framing of the bytes in both directions."""

    write_end: Sent = "\n"
    """End of every command and query."""
    read_end: Annotated[Sent, Field(min_length=1)] = "\n"
    """End of every reply, where there is no prompt."""
    prompt: Annotated[Sent, Field(min_length=1)] | None = None
    """Prompt of the table when it is ready again, after every command and query; none if not given."""
    echo: bool = False
    """Indicates whether the table repeats a command before it replies."""
    timeout: Positive = 2.0
    """s for which the table may leave a query, or a command that is acknowledged, unanswered."""
    baud: Annotated[int, Field(gt=0)] = 9600
    data_bits: Annotated[int, Field(ge=5, le=8)] = 8
    parity: Literal["none", "even", "odd"] = "none"
    stop_bits: Literal[1, 2] = 1


class ProfileAxis(Document):
    """One axis."""

    name: Annotated[str, Field(min_length=1)]
    """Name in messages and `--table-limits`."""
    number: Sent = ""
    """Text that replaces `{axis}` on the line."""
    about: Vector
    """Direction it turns about where all angles are zero: x and y level, z up."""
    angle: Annotated[tuple[float, float], Field(strict=False)] | None = None
    """Lowest and highest; an axis that turns without end has none."""
    rate: Positive
    acceleration: Positive

    @field_validator("about")
    @classmethod
    def _has_direction(cls, about: np.ndarray) -> np.ndarray:
        if not np.linalg.norm(about) > 0.0:
            raise ValueError("is zero, which is no direction; give one such as [0, 0, 1]")
        return about

    @model_validator(mode="after")
    def _angles_ascend(self) -> ProfileAxis:
        if self.angle is not None and not self.angle[0] < self.angle[1]:
            raise ValueError(f"angle of axis {self.name!r}: give the lowest, then a higher one")
        return self

    def axis(self, units: Units) -> Axis:
        """Returns the axis in the form of procedures."""
        x, y, z = (self.about / np.linalg.norm(self.about)).tolist()
        deg = units.factor("angle")
        span = None if self.angle is None else (self.angle[0] * deg, self.angle[1] * deg)
        limits = AxisLimits(
            self.rate * units.factor("rate"), self.acceleration * units.factor("acceleration"), span
        )
        return Axis(self.name, (x, y, z), limits)


def _fields(text: str, allowed: tuple[str, ...]) -> str:
    """Checks the fields of a command; raises `ValueError` for an unknown one."""
    left = FIELD.sub("", text)
    unknown = [match["name"] for match in FIELD.finditer(text) if match["name"] not in allowed]
    if any(match["name"] == "axis" and match[0] != PER_AXIS for match in FIELD.finditer(text)):
        raise ValueError(f"{text!r} states digits of an axis, which has none; write {PER_AXIS}")
    if "{" in left or "}" in left or unknown:
        known = ", ".join(f"{{{name}}}" for name in allowed) or "none"
        raise ValueError(f"{text!r} holds a field that is none of its own; known here: {known}")
    return text


FIELDS_OF_COMMANDS = {
    "acceleration": ("acceleration",),
    "speed": ("rate",),
    "goto": ("angle", "rate", "acceleration"),
    "rate": ("rate", "acceleration"),
    "stop": ("",),
}
"""Fields of each command besides `{axis}`; the first is needed, the others are optional."""


class Commands(Document):
    """Commands to the table; a command is sent once for each axis where it holds `{axis}`."""

    enable: tuple[Sent, ...] = Field(default=(), strict=False)
    """Sent before the first motion, in this order."""
    acceleration: Sent | None = None
    """Sets the acceleration of motions to come: `{acceleration}`."""
    speed: Sent | None = None
    """Sets the largest rate of a motion to an angle: `{rate}`."""
    goto: Sent | None = None
    """Moves to an angle: `{angle}`; may also hold `{rate}` and `{acceleration}` of that motion."""
    rate: Sent | None = None
    """Turns at a rate until the next command: `{rate}`; may also hold `{acceleration}`."""
    stop: Sent
    """Brings the table to rest."""

    @field_validator("enable")
    @classmethod
    def _enable(cls, texts: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(_fields(text, ("axis",)) for text in texts)

    @field_validator("acceleration", "speed", "goto", "rate", "stop")
    @classmethod
    def _known_fields(cls, text: str | None, info: object) -> str | None:
        if text is None:
            return None
        command = str(getattr(info, "field_name", ""))
        needed, *extra = FIELDS_OF_COMMANDS[command]
        if needed and needed not in [match["name"] for match in FIELD.finditer(text)]:
            raise ValueError(f"{text!r} has no {{{needed}}}, so that it could not say which")
        if not text.strip():
            raise ValueError("is empty, which commands nothing; give the words of the table")
        return _fields(text, ("axis", *filter(None, (needed, *extra))))

    @model_validator(mode="after")
    def _moves(self) -> Commands:
        if self.goto is None and self.rate is None:
            raise ValueError("move nothing; give goto, rate or both")
        return self


class Query(Document):
    """A question, asked once for each axis where it holds `{axis}`."""

    send: Sent
    reply: str
    """Pattern of the reply, `{angle}` for a number; blanks at either end do not count."""

    @field_validator("send")
    @classmethod
    def _known_fields(cls, text: str) -> str:
        return _fields(text, ("axis",))


class StateQuery(Query):
    """A question whether an axis has ended its motion: one word, or bits of a status number.

    Without bits, `reply` is the reply of an axis that has ended its motion; any other reply means that it
    moves. With bits, `reply` holds `{status}`.
    """

    bits_set: BitMask = 0
    """Bits that are 1 when the motion has ended."""
    bits_clear: BitMask = 0
    """Bits that are 0 then."""
    base: Literal[10, 16] = 10
    """Base of the status; a prefix 0x or #H marks base 16 in any case."""

    @model_validator(mode="after")
    def _bits_fit_the_reply(self) -> StateQuery:
        fields = [match["name"] for match in FIELD.finditer(self.reply)]
        if self._has_bits != ("status" in fields):
            raise ValueError("bits_set and bits_clear need {status} in reply, and {status} needs one of them")
        if self.bits_set & self.bits_clear:
            raise ValueError("a bit cannot be both set and clear; name it in one of the two")
        return self

    @property
    def _has_bits(self) -> bool:
        return bool(self.bits_set | self.bits_clear)

    def is_settled(self, reply: str) -> bool:
        """Returns True if the reply reports the end of the motion.

        Raises `ValueError` where the reply holds no status.
        """
        found = pattern(self.reply).fullmatch(reply)
        if not self._has_bits:
            return found is not None
        if found is None:
            raise ValueError(f"expected {self.reply!r}")
        prefix, digits = re.fullmatch(r"(0[xX]|#[hH])?(.*)", found["status"]).groups()  # type: ignore[union-attr]
        status = int(digits, 16 if prefix else self.base)
        return status & (self.bits_set | self.bits_clear) == self.bits_set

    def written(self, axis: str, *, settled: bool) -> str:
        """Returns the reply of a table whose axis has ended its motion, or has not."""
        if not self._has_bits:
            return self.reply if settled else f"not {self.reply}"
        status = self.bits_set if settled else self.bits_clear
        return written(self.reply.replace("{status}", f"{status:{'X' if self.base == 16 else 'd'}}"), axis)


class Queries(Document):
    """Questions to the table; without `position` its angles are not known."""

    position: Query | None = None
    settled: StateQuery | None = None

    @field_validator("position")
    @classmethod
    def _holds_an_angle(cls, query: Query | None) -> Query | None:
        if query is not None and "angle" not in [m["name"] for m in FIELD.finditer(query.reply)]:
            raise ValueError("reply has no {angle}")
        return query


class Replies(Document):
    """Replies of the table to a command."""

    acknowledge: str | None = None
    """Replied to every command that was taken; none if not given."""
    errors: tuple[Annotated[str, Field(min_length=1)], ...] = Field(default=(), strict=False)
    """A reply that begins with one of these refuses a command."""


class TableProfile(Document):
    """A table that is commanded by lines of text over TCP or a serial line."""

    schema_: Literal["tumble-table-profile/1"] = Field(default=SCHEMA, alias="schema")
    name: Annotated[str, Field(min_length=1)]
    """Make and model."""
    tried: str | None = None
    """Hardware on which this was tested, when and by whom; without it users are warned."""
    notes: tuple[str, ...] = Field(default=(), strict=False)
    """Sources of the values: those from documents, and assumptions."""
    units: Units = Units()
    line: Line = Line()
    axes: Annotated[tuple[ProfileAxis, ...], Field(strict=False, min_length=1, max_length=3)]
    """Axes from the one on the floor up."""
    commands: Commands
    queries: Queries = Queries()
    replies: Replies = Replies()

    @model_validator(mode="after")
    def _fits_together(self) -> TableProfile:
        for objection in self._objections():
            raise ValueError(objection)
        return self

    def _objections(self) -> Iterator[str]:
        names = [axis.name for axis in self.axes]
        for command, (figure, *_) in FIELDS_OF_COMMANDS.items() if len(names) > 1 else ():
            text = getattr(self.commands, command)
            if figure and text is not None and PER_AXIS not in text:
                yield f"commands.{command} {text!r} moves one of {len(names)} axes; write {PER_AXIS} in it"
        if len(set(names)) < len(names):
            yield f"two axes are called {max(names, key=names.count)!r}; give each its own name"
        if self.commands.goto is not None and self.queries.position is None:
            yield "goto needs queries.position: limits of angle are held against where the table is"
        limited = [axis.name for axis in self.axes if axis.angle is not None]
        if limited and self.queries.position is None:
            yield f"axis {limited[0]!r} has limits of angle, which need queries.position"

    def numbers(self) -> tuple[str, ...]:
        """Returns what stands for `{axis}`, for each axis."""
        return tuple(axis.number or str(place) for place, axis in enumerate(self.axes, start=1))


def shipped() -> tuple[str, ...]:
    """Returns the names of the profiles that come with Tumble."""
    return tuple(file.name.removesuffix(".yaml") for file in entries(Path(__file__).with_name("profiles")))


def load_profile(name: str) -> TableProfile:
    """Reads a profile that comes with Tumble, by its name, or a file of the user.

    Raises as `profile_text` and `profile_of`.
    """
    return profile_of(name, profile_text(name))


def profile_text(name: str) -> str:
    """Returns the text of a profile that comes with Tumble, by its name, or of a file of the user.

    Raises `CalibrationFileError` where the file cannot be read, and `TableError` where there is no profile of
    that name.
    """
    if name in shipped():
        with resources.as_file(resources.files("tumble.tools.table") / "profiles" / f"{name}.yaml") as path:
            return document_content(path, TABLE_PROFILE.what)
    if not Path(name).suffix and not exists(Path(name)):
        raise TableError(f"{name}: no such profile; known: {', '.join(shipped())}, or give a file")
    return document_content(name, TABLE_PROFILE.what)


@lru_cache(maxsize=8)
def profile_of(name: str, text: str) -> TableProfile:
    """Returns the profile of a text, which bears a name in messages.

    A bench asks for that of its table several times a second, to see whether its file was changed.

    Raises `CalibrationFileError`, in one line with file, line and key, where it is none.
    """
    return read_document(name, TableProfile, TABLE_PROFILE, text=text)


def written(text: str, axis: str, **values: float) -> str:
    """Puts an axis and numbers, in units of the line, into a command.

    Rates and accelerations are cut, not rounded: what is written is never more than was allowed.
    """

    def one(match: re.Match[str]) -> str:
        if match["name"] == "axis":
            return axis
        digits = int(match["digits"] or DIGITS) if match["digits"] != "0" else 0
        value = values[match["name"]]
        if match["name"] != "angle":
            # Beyond the last digit by less than arithmetic leaves: 60 deg/s must not become 59.9999.
            value = math.trunc(value * 10.0**digits * (1.0 + 1e-12)) / 10.0**digits
        sign = "+" if match["sign"] else ""
        return f"{value:{sign}.{digits}f}"

    return FIELD.sub(one, text)


def pattern(text: str) -> re.Pattern[str]:
    """Converts a command or reply with fields to a pattern; each field is a group of its name."""
    parts, end = [], 0
    for match in FIELD.finditer(text):
        parts.append(re.escape(text[end : match.start()]))
        parts.append(f"(?P<{match['name']}>{FORMS.get(match['name'], NUMBER)})")
        end = match.end()
    parts.append(re.escape(text[end:]))
    return re.compile("".join(parts))
