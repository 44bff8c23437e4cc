"""A simulated table behind a TCP port, which understands the words of any profile."""

from __future__ import annotations

import re
import selectors
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from types import TracebackType
from typing import TypeAlias

import numpy as np

from tumble.foundation import clock
from tumble.tools.simulate.scenario import ScenarioError
from tumble.tools.table.profile import TableProfile, pattern, written
from tumble.tools.table.simulated import SimulatedTable

Answer: TypeAlias = Callable[[int | None, Mapping[str, float]], str]
"""Obeys or answers one line: axis (None for all), values of its fields in rad, rad/s and rad/s^2."""

POLL = 0.05
"""s between two looks whether to end."""
LONGEST_LINE = 4096
REFUSED = "ERR"
"""Reply to an unknown command, where the profile has no word for that."""


class TableServer:
    """Serves one program at a time: commands of two would mix.

    Raises `ScenarioError` where the port is taken.
    """

    def __init__(self, table: SimulatedTable, profile: TableProfile, host: str, port: int) -> None:
        self._table = table
        self._profile = profile
        self._numbers = profile.numbers()
        self._speeds = np.array([axis.limits.rate for axis in table.axes])
        self._rates = np.zeros(len(table.axes))
        self._told = {
            "angle": table.position(),
            "rate": np.zeros(len(table.axes)),
            "acceleration": np.array([axis.limits.acceleration for axis in table.axes]),
        }
        self._words = list(self._understood())
        self._ended = threading.Event()
        try:
            self._socket = socket.create_server((host, port))
        except OSError as error:
            raise ScenarioError(
                f"table at {host}:{port}: {error.strerror or error}; give another port"
            ) from error
        self.port: int = self._socket.getsockname()[1]
        self._thread = clock.thread(self._serve, name="table")

    def __enter__(self) -> TableServer:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        clock.wait(self._thread)
        self._socket.close()

    def answer(self, line: str) -> str:
        """Obeys a line, and returns what is replied to it."""
        for form, act in self._words:
            if found := form.fullmatch(line):
                groups = found.groupdict()
                number = groups.pop("axis", None)
                if number is not None and number not in self._numbers:
                    break
                axis = None if number is None else self._numbers.index(number)
                units = self._profile.units
                return act(axis, {name: float(text) * units.factor(name) for name, text in groups.items()})
        errors = self._profile.replies.errors
        return errors[0] if errors else REFUSED

    def _understood(self) -> Iterator[tuple[re.Pattern[str], Answer]]:
        commands, queries = self._profile.commands, self._profile.queries
        taken = self._profile.replies.acknowledge or ""

        def command(act: Callable[[slice], None]) -> Answer:
            def obey(axis: int | None, values: Mapping[str, float]) -> str:
                axes = slice(None) if axis is None else slice(axis, axis + 1)
                for name, value in values.items():
                    self._told[name][axes] = value
                act(axes)
                return taken

            return obey

        for text in commands.enable:
            yield pattern(text), command(lambda _axes: None)
        for each, act in (
            (commands.stop, self._stop),
            (commands.acceleration, lambda _axes: None),
            (commands.speed, self._limit_speed),
            (commands.goto, self._goto),
            (commands.rate, self._turn),
        ):
            if each is not None:
                yield pattern(each), command(act)
        if queries.position is not None:
            yield pattern(queries.position.send), self._position
        if queries.settled is not None:
            yield pattern(queries.settled.send), self._settled

    def _limit_speed(self, axes: slice) -> None:
        self._speeds[axes] = self._told["rate"][axes]

    def _goto(self, axes: slice) -> None:
        has_rate = "{rate" in (self._profile.commands.goto or "")
        speeds = self._told["rate"] if has_rate else self._speeds
        self._table.move(axes, self._told["angle"], speeds, self._told["acceleration"])

    def _turn(self, axes: slice) -> None:
        self._rates[axes] = self._told["rate"][axes]
        self._table.turn(axes, self._rates, self._told["acceleration"])

    def _stop(self, _axes: slice) -> None:
        self._rates[:] = 0.0
        self._table.stop()

    def _position(self, axis: int | None, _values: Mapping[str, float]) -> str:
        assert self._profile.queries.position is not None, "it was understood"
        place = axis or 0
        angle = float(self._table.position()[place]) / self._profile.units.factor("angle")
        return written(self._profile.queries.position.reply, self._numbers[place], angle=angle)

    def _settled(self, axis: int | None, _values: Mapping[str, float]) -> str:
        assert self._profile.queries.settled is not None, "it was understood"
        return self._profile.queries.settled.written(self._numbers[axis or 0], settled=self._table.settled())

    def _serve(self) -> None:
        while not self._ended.is_set():
            if clock.readable(self._socket.fileno(), POLL):
                client, _ = self._socket.accept()
                with client:
                    self._converse(client)

    def _converse(self, client: socket.socket) -> None:
        line, text = self._profile.line, b""
        end = line.write_end.encode()
        with selectors.DefaultSelector() as selector:
            selector.register(client, selectors.EVENT_READ)
            while not self._ended.is_set():
                if not clock.select(selector, POLL):
                    continue
                try:
                    piece = client.recv(LONGEST_LINE)
                    *lines, text = (text + piece).split(end)
                    for each in lines:
                        client.sendall(self._reply(each.decode("ascii", errors="replace").strip()))
                except OSError:
                    return
                if not piece or len(text) > LONGEST_LINE:
                    return

    def _reply(self, command: str) -> bytes:
        line = self._profile.line
        reply = self.answer(command)
        echo = command + line.read_end if line.echo else ""
        said = reply + line.read_end if reply else ""
        return f"{echo}{said}{line.prompt + line.read_end if line.prompt else ''}".encode("ascii")
