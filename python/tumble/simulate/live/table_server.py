"""A simulated table behind a TCP port, which understands the words of any profile."""

from __future__ import annotations

import re
import selectors
import socket
import threading
from collections.abc import Callable, Iterator
from types import TracebackType

import numpy as np

from tumble.simulate.scenario import ScenarioError
from tumble.table.profile import TableProfile, pattern, written
from tumble.table.simulated import SimulatedTable

POLL = 0.05
"""s between two looks whether to end."""
LONGEST_LINE = 4096
REFUSED = "ERR"
"""Said to what is not understood, where the profile has no word for that."""


class TableServer:
    """Serves one program at a time: commands of two would mix.

    Raises `ScenarioError` where the port is taken.
    """

    def __init__(self, table: SimulatedTable, profile: TableProfile, host: str, port: int) -> None:
        self._table = table
        self._profile = profile
        self._numbers = profile.numbers()
        self._speeds = np.array([axis.limits.rate for axis in table.axes])
        self._accelerations = np.array([axis.limits.acceleration for axis in table.axes])
        self._rates = np.zeros(len(table.axes))
        self._targets = table.position()
        self._words: list[tuple[re.Pattern[str], Callable[[int | None, float], str]]] = list(
            self._understood()
        )
        self._ended = threading.Event()
        try:
            self._socket = socket.create_server((host, port))
        except OSError as error:
            raise ScenarioError(
                f"table at {host}:{port}: {error.strerror or error}; give another port"
            ) from error
        self.port: int = self._socket.getsockname()[1]
        self._thread = threading.Thread(target=self._serve, name="table", daemon=True)

    def __enter__(self) -> TableServer:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()
        self._socket.close()

    def answer(self, line: str) -> str:
        """Obey a line, and give what is replied to it."""
        for form, act in self._words:
            if found := form.fullmatch(line):
                groups = found.groupdict()
                number = groups.pop("axis", None)
                if number is not None and number not in self._numbers:
                    break
                axis = None if number is None else self._numbers.index(number)
                return act(axis, float(next(iter(groups.values()), "nan")))
        errors = self._profile.replies.errors
        return errors[0] if errors else REFUSED

    def _understood(self) -> Iterator[tuple[re.Pattern[str], Callable[[int | None, float], str]]]:
        commands, queries, units = self._profile.commands, self._profile.queries, self._profile.units
        taken = self._profile.replies.acknowledge or ""

        def command(
            act: Callable[[slice, float], None], quantity: str = ""
        ) -> Callable[[int | None, float], str]:
            factor = units.factor(quantity) if quantity else 1.0

            def obey(axis: int | None, value: float) -> str:
                act(slice(None) if axis is None else slice(axis, axis + 1), value * factor)
                return taken

            return obey

        for text in commands.enable:
            yield pattern(text), command(lambda _axes, _value: None)
        for each, act, quantity in (
            (commands.stop, self._stop, ""),
            (commands.acceleration, self._accelerate, "acceleration"),
            (commands.speed, self._speed, "rate"),
            (commands.goto, self._goto, "angle"),
            (commands.rate, self._turn, "rate"),
        ):
            if each is not None:
                yield pattern(each), command(act, quantity)
        if queries.position is not None:
            yield pattern(queries.position.send), self._position
        if queries.settled is not None:
            yield pattern(queries.settled.send), self._settled

    def _accelerate(self, axes: slice, value: float) -> None:
        self._accelerations[axes] = value

    def _speed(self, axes: slice, value: float) -> None:
        self._speeds[axes] = value

    def _goto(self, axes: slice, value: float) -> None:
        self._targets[axes] = value
        self._table.move(axes, self._targets, self._speeds, self._accelerations)

    def _turn(self, axes: slice, value: float) -> None:
        self._rates[axes] = value
        self._table.turn(axes, self._rates, self._accelerations)

    def _stop(self, _axes: slice, _value: float) -> None:
        self._rates[:] = 0.0
        self._table.stop()

    def _position(self, axis: int | None, _value: float) -> str:
        assert self._profile.queries.position is not None, "it was understood"
        place = axis or 0
        angle = float(self._table.position()[place])
        factor = self._profile.units.factor("angle")
        return written(self._profile.queries.position.reply, self._numbers[place], factor, angle=angle)

    def _settled(self, axis: int | None, _value: float) -> str:
        assert self._profile.queries.settled is not None, "it was understood"
        reply = self._profile.queries.settled.reply
        return reply if self._table.settled() else f"not {reply}"

    def _serve(self) -> None:
        while not self._ended.is_set():
            self._socket.settimeout(POLL)
            try:
                client, _ = self._socket.accept()
            except TimeoutError:
                continue
            with client:
                self._converse(client)

    def _converse(self, client: socket.socket) -> None:
        line, text = self._profile.line, b""
        end = line.write_end.encode()
        with selectors.DefaultSelector() as selector:
            selector.register(client, selectors.EVENT_READ)
            while not self._ended.is_set():
                if not selector.select(POLL):
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
