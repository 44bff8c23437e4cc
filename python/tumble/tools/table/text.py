"""A table that is commanded by lines of text, over TCP or a serial line, in the words of a profile."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any

import numpy as np

from tumble.foundation import clock
from tumble.foundation.errors import TableError
from tumble.foundation.recording import FloatArray
from tumble.logs.optional import imported
from tumble.tools.table.axes import Axis
from tumble.tools.table.profile import (
    PER_AXIS,
    Query,
    TableProfile,
    pattern,
    profile_of,
    profile_text,
    written,
)
from tumble.tools.table.registry import TableAddress

BACKEND = "@py"
"""pyvisa-py, which needs no library of a maker."""
MOST_STALE = 4
"""Answers to earlier questions that may come before that to a stop."""
LONGEST_REPLY = 4096
"""Bytes."""
_PLACE = re.compile(
    r"TCPIP\d*::(?:[^:\s]+|\[[0-9a-f:.%]+\])::\d+::SOCKET|ASRL(?!::)(?:(?!://)\S)+?(?:::INSTR)?",
    re.IGNORECASE,
)
"""Addresses of PyVISA that are plain lines of text; over its others a read may last for ever."""
_CHECK_LINE = "check the rate of the line, its end of a reply in the profile, and the address"
UNTRIED = "this profile is untested on hardware: begin slowly, a hand on the emergency stop"


def open_text(address: TableAddress) -> TextRateTable:
    """Opens `text:TCPIP::HOST::PORT::SOCKET?profile=NAME` or `text:ASRL/dev/ttyUSB0::INSTR?...`.

    `profile` is the name of one that comes with Tumble, or a file.

    Raises `TableError` or `CalibrationFileError` where the profile is missing or wrong.
    """
    address.refuse_other_settings("profile")
    name = address.settings.get("profile")
    if not _PLACE.fullmatch(address.place) or not name:
        raise TableError(
            f"{address.text}: say where and in which words: text:TCPIP::HOST::PORT::SOCKET?profile=NAME, or "
            "text:ASRL/dev/ttyUSB0::INSTR?profile=NAME; see tumble table list"
        )
    return TextRateTable(address, profile_of(name, address.document("profile", profile_text)))


class TextRateTable:
    """Speaks the words of a profile through PyVISA; a `RateTable`."""

    def __init__(self, address: TableAddress, profile: TableProfile) -> None:
        self.name = profile.name
        self.address = address.text
        self.documents = address.documents
        self.axes: tuple[Axis, ...] = tuple(axis.axis(profile.units) for axis in profile.axes)
        self.remarks = () if profile.tried else (UNTRIED,)
        self._address = address
        self._profile = profile
        self._manager: Any = None
        self._line: Any = None
        self._as_many_as_asked: Any = None
        """Status of a read of which PyVISA warns."""
        self._rates = np.zeros(len(self.axes))
        self._at_speed = 0.0
        """s of `clock.now()` when a rate is reached, where the table cannot be asked."""

    def prepare(self) -> None:
        """See `RateTable`."""
        imported("pyvisa", self._address.text, "live").ResourceManager(BACKEND)
        # Looking up a host imports this.
        "".encode("idna")

    def __enter__(self) -> TextRateTable:
        pyvisa = imported("pyvisa", self._address.text, "live")
        imported("pyvisa_py", self._address.text, "live")
        try:
            self._manager = pyvisa.ResourceManager(BACKEND)
            self._line = self._manager.open_resource(self._address.place, **self._settings(pyvisa))
            self._as_many_as_asked = pyvisa.constants.StatusCode.success_max_count_read
            self._keep_others_away()
        except Exception as error:
            self._close()
            raise TableError(
                f"{self._address.text}: cannot be opened: {_first_line(error)}; is the table on, does "
                "another program hold the line, and is the address as PyVISA writes it?"
            ) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close()

    def enable(self) -> None:
        """See `RateTable`."""
        for text in self._profile.commands.enable:
            self._command(text)

    def goto(self, angles: FloatArray, rate: FloatArray, acceleration: FloatArray) -> None:
        """See `RateTable`; raises `TableError` where the profile has no such command."""
        commands = self._profile.commands
        if commands.goto is None:
            raise TableError(f"{self.name}: has no command to go to an angle; turn it at a rate")
        self._command(commands.acceleration, acceleration=acceleration)
        self._command(commands.speed, rate=rate)
        self._command(commands.goto, angle=angles, rate=rate, acceleration=acceleration)

    def rate(self, rates: FloatArray, acceleration: FloatArray) -> None:
        """See `RateTable`; raises `TableError` where the profile has no such command."""
        commands = self._profile.commands
        if commands.rate is None:
            raise TableError(f"{self.name}: has no command to turn at a rate; send it to an angle")
        self._command(commands.acceleration, acceleration=acceleration)
        self._command(commands.rate, rate=rates, acceleration=acceleration)
        self._at_speed = clock.now() + float(np.max(np.abs(rates - self._rates) / acceleration))
        self._rates = np.array(rates)

    def stop(self) -> None:
        """See `RateTable`."""
        slowest = np.array([axis.limits.acceleration for axis in self.axes])
        self._at_speed = clock.now() + float(np.max(np.abs(self._rates) / slowest))
        self._rates = np.zeros(len(self.axes))
        texts = self._each(self._profile.commands.stop)
        # Every axis is commanded before any answer is waited for, which may never come.
        for text in texts:
            self._send(text)
        if self._is_answered:
            for text in texts:
                self._wait_for_acknowledgement(text)

    def settled(self) -> bool:
        """See `RateTable`; a table that cannot be asked has when its ramp must be over."""
        query = self._profile.queries.settled
        if query is None:
            return clock.now() >= self._at_speed
        for text, reply in self._asked(query):
            try:
                settled = query.is_settled(reply)
            except ValueError as error:
                raise TableError(f"{self.name}: replied {reply!r} to {text!r}, {error}") from None
            if not settled:
                return False
        return True

    def position(self) -> FloatArray:
        """See `RateTable`."""
        query = self._profile.queries.position
        if query is None:
            return np.full(len(self.axes), np.nan)
        form, factor = pattern(query.reply), self._profile.units.factor("angle")
        angles = []
        for text, reply in self._asked(query):
            found = form.fullmatch(reply)
            if found is None:
                raise TableError(f"{self.name}: replied {reply!r} to {text!r}, expected {query.reply!r}")
            angle = float(found["angle"]) * factor
            if not math.isfinite(angle):
                raise TableError(f"{self.name}: replied {reply[:40]!r} to {text!r}, which is no angle")
            angles.append(angle)
        # A table that is asked once for all its axes answers for all of them.
        known: FloatArray = np.broadcast_to(np.array(angles), (len(self.axes),)).copy()
        return known

    def _asked(self, query: Query) -> list[tuple[str, str]]:
        return [(text, self._exchange(text, replied=True)) for text in self._each(query.send)]

    def _command(self, text: str | None, **values: FloatArray) -> None:
        """Sends a command, once for each axis where it names one; nothing where the profile has none."""
        for command in self._each(text, **values) if text else ():
            reply = self._exchange(command, replied=self._is_answered)
            if self._profile.replies.acknowledge not in (None, reply):
                raise TableError(
                    f"{self.name}: replied {reply!r} to {command!r}; see the manual of the table"
                )

    @property
    def _is_answered(self) -> bool:
        """Returns whether the table replies to a command."""
        return self._profile.replies.acknowledge is not None or self._profile.line.prompt is not None

    def _wait_for_acknowledgement(self, text: str) -> None:
        """Reads until a stop is acknowledged: first may come what answers an earlier question."""
        wanted = self._profile.replies.acknowledge
        replies = [self._answer(text)]
        while wanted not in (None, replies[-1]):
            if len(replies) > MOST_STALE:
                raise TableError(f"{self.name}: replied {replies[-1]!r} to {text!r}")
            replies.append(self._answer(text))

    def _each(self, text: str, **values: FloatArray) -> list[str]:
        numbers = self._profile.numbers()
        count = len(numbers) if PER_AXIS in text else 1
        in_units = {key: each / self._profile.units.factor(key) for key, each in values.items()}
        return [
            written(text, numbers[axis], **{key: float(each[axis]) for key, each in in_units.items()})
            for axis in range(count)
        ]

    def _exchange(self, text: str, *, replied: bool) -> str:
        """Sends a line, and returns what is replied; raises `TableError` for silence and refusals."""
        self._send(text)
        return self._answer(text) if replied else ""

    def _send(self, text: str) -> None:
        line = self._profile.line
        with self._failures_at(text):
            self._line.write_raw((text + line.write_end).encode("ascii"))
            if line.echo and line.prompt is None:
                self._read()

    def _answer(self, text: str) -> str:
        """Reads what is replied to a line that was sent."""
        line = self._profile.line
        with self._failures_at(text):
            reply = self._read()
        if line.echo and line.prompt is not None:
            reply = reply.removeprefix(text).strip()
        for refused in self._profile.replies.errors:
            if reply.startswith(refused):
                raise TableError(f"{self.name}: refused {text!r}: {reply!r}; see the manual of the table")
        return reply

    @contextmanager
    def _failures_at(self, text: str) -> Iterator[None]:
        """Converts errors of a line of text to one line."""
        try:
            yield
        except TableError:
            raise
        except Exception as error:
            if "TMO" in str(error) or "timeout" in str(error).lower():
                raise TableError(
                    f"{self.name}: no answer to {text!r} within {self._profile.line.timeout:g} s; is the "
                    "table on, and the profile right?"
                ) from error
            raise TableError(f"{self.name}: the line was lost at {text!r}: {_first_line(error)}") from error

    def _read(self) -> str:
        line = self._profile.line
        end = line.prompt or line.read_end
        raw = self._bytes_until(end[-1].encode("ascii"))
        return raw.decode("ascii", errors="replace").strip().removesuffix(end.strip()).strip()

    def _bytes_until(self, last: bytes) -> bytes:
        """Reads byte by byte: PyVISA reads on as long as anything comes, as of a line at another rate."""
        until, reply = clock.now() + self._profile.line.timeout, bytearray()
        while not reply.endswith(last):
            if len(reply) >= LONGEST_REPLY or (reply and clock.now() > until):
                raise TableError(f"{self.name}: sends {len(reply)} bytes without an end; {_CHECK_LINE}")
            with self._line.ignore_warning(self._as_many_as_asked):
                piece, _ = self._line.visalib.read(self._line.session, 1)
            reply += piece
        return bytes(reply)

    def _settings(self, pyvisa: Any) -> dict[str, Any]:  # noqa: ANN401 - a module has no type of its own
        line, kinds = self._profile.line, pyvisa.constants
        settings: dict[str, Any] = {
            "timeout": 1e3 * line.timeout,
            "open_timeout": int(1e3 * line.timeout),
            "read_termination": (line.prompt or line.read_end)[-1],
        }
        if self._address.place.upper().startswith("ASRL"):
            settings |= {
                "baud_rate": line.baud,
                "data_bits": line.data_bits,
                "parity": getattr(kinds.Parity, line.parity),
                "stop_bits": kinds.StopBits.one if line.stop_bits == 1 else kinds.StopBits.two,
            }
        return settings

    def _keep_others_away(self) -> None:
        """Locks a serial line: two programs that read it would each get half of the replies."""
        session = self._manager.visalib.sessions[self._line.session]
        if hasattr(session.interface, "exclusive"):
            session.interface.exclusive = True

    def _close(self) -> None:
        if self._line is not None:
            self._line.close()
            self._line = None


def _first_line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
