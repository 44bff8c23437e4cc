"""End of a program by a signal: what moves is stopped first, then all is left in order.

Python runs handlers of signals in the main thread, between two steps of Python, and a library may keep that
thread for minutes. So a thread of this module receives each signal as well, and stops what moves at once.
"""

from __future__ import annotations

import logging
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Stop = Callable[[int], None]
"""Stops something, once or again, from any thread; it gets the number of the signal, 0 for none."""

_OTHERS = {"SIGCHLD", "SIGCONT", "SIGURG", "SIGWINCH", "SIGKILL", "SIGSTOP", "SIGCLD", "SIGINFO"}
_SUSPENSIONS = {"SIGTSTP", "SIGTTIN", "SIGTTOU"}
_FAULTS = {"SIGSEGV", "SIGBUS", "SIGFPE", "SIGILL", "SIGTRAP", "SIGSYS"}
"""Signals that the processor raises in native code: after a handler in Python they would come again."""


def _numbers(names: set[str]) -> frozenset[int]:
    return frozenset(int(getattr(signal, name)) for name in names if hasattr(signal, name))


SUSPENDING = _numbers(_SUSPENSIONS)
"""Signals that suspend a program, such as that of Ctrl-Z."""
ENDING = frozenset(map(int, signal.valid_signals())) - SUSPENDING - _numbers(_OTHERS | _FAULTS)
"""Signals that end a program which does not handle them."""
SUSPENDED_WITHIN = 2.0
"""s that a suspension waits for what moves to be stopped."""
_WAKING = getattr(signal, "SIGURG", None)
"""Signal that does nothing but to end a wait of the main thread; None on systems without it."""
_WAKES, _WAKES_EVERY = 20, 0.05
"""Times that the main thread is woken at most, and s between them: native code may hold it for minutes."""
_log = logging.getLogger(__name__)


class EndedBySignal(SystemExit):
    """Leaves every `with` on the way; the command line then ends by the signal itself."""

    def __init__(self, number: int) -> None:
        super().__init__(128 + number)
        self.signal_number = number


def end_of(number: int) -> BaseException:
    """Returns the exception by which a signal ends a program: `KeyboardInterrupt` for that of Ctrl-C."""
    return KeyboardInterrupt() if number == signal.SIGINT else EndedBySignal(number)


@contextmanager
def watched() -> Iterator[None]:
    """Heeds all signals that end or suspend the program; nothing outside the main thread, or within another.

    A signal that was ignored, or that has a handler already, keeps its handling; what is registered is
    stopped all the same where it has a handler.
    """
    with _WATCH.entered():
        yield


@contextmanager
def stopped_at_the_end(stop: Stop) -> Iterator[None]:
    """Has `stop` called when a signal ends or suspends the program, while the block runs in any thread.

    Raises `RuntimeError` in another thread than the main one where that one is not within `watched`.
    """
    with _WATCH.entered():
        if not _WATCH.is_entered:
            raise RuntimeError(
                "signals are not heeded: enter tumble.foundation.ending.watched in the main one"
            )
        _WATCH.stops.append(stop)
        try:
            yield
        finally:
            _WATCH.stops.remove(stop)


@contextmanager
def shielded() -> Iterator[None]:
    """Delays the end by signals until the block has run; they end no other thread than the main one."""
    with _WATCH.entered(), _WATCH.shielded():
        yield


@contextmanager
def stopped_by_signals(stop: Callable[[], None]) -> Iterator[list[int]]:
    """Calls `stop` at the first signal that would end the program while the block runs; a second one ends it.

    The list that it gives holds the number of that signal.
    """
    received: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield received
        return
    with watched():
        before = {number: handler for number in ENDING if callable(handler := signal.getsignal(number))}

        def handle(number: int, _frame: object) -> None:
            received.append(number)
            stop()
            signal.signal(number, before[number])

        for number in before:
            signal.signal(number, handle)
        try:
            yield received
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


class _Watch:
    """Handlers of one process, and the thread that receives signals while the main one is busy."""

    def __init__(self) -> None:
        self.stops: list[Stop] = []
        self.is_entered = False
        self._before: dict[int, Any] = {}
        self._shields = 0
        self._late: list[int] = []
        self._were_stopped = threading.Event()
        self._is_awake = threading.Event()
        self._reader: socket.socket | None = None
        self._writer: socket.socket | None = None
        self._fd_before = -1
        self._main = 0
        """Identifier of the main thread, which enters."""
        self._thread: threading.Thread | None = None

    @contextmanager
    def entered(self) -> Iterator[None]:
        """See `watched`."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        if self.is_entered:
            with self._taken_again():
                yield
            return
        self._begin()
        try:
            yield
        finally:
            try:
                # A thread that still holds something ends with the program.
                self.stop_all(0)
            finally:
                self._end()

    @contextmanager
    def _taken_again(self) -> Iterator[None]:
        """Receives signals first, also where an event loop has begun to since."""
        assert self._writer is not None, "it was entered"
        own, before = self._writer.fileno(), self._fd_before
        taken = signal.set_wakeup_fd(own, warn_on_full_buffer=False)
        if taken == own:
            yield
            return
        self._fd_before = taken
        try:
            yield
        finally:
            signal.set_wakeup_fd(taken, warn_on_full_buffer=False)
            self._fd_before = before

    @contextmanager
    def shielded(self) -> Iterator[None]:
        """See `shielded`."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        self._shields += 1
        try:
            yield
        finally:
            self._shields -= 1
            if not self._shields and self._late:
                late, self._late = self._late, []
                self._end_by(late[0])

    def stop_all(self, number: int) -> None:
        """Stops what is registered; what cannot be stopped is reported, and the rest is stopped."""
        for stop in list(self.stops):
            try:
                stop(number)
            except Exception as error:
                _log.error("%s", error)
        self._were_stopped.set()

    def forget(self) -> None:
        """Leaves a child that was forked as it would be without this: its parent stops what moves."""
        if self.is_entered:
            self.stops, self._thread = [], None
            self._end()

    def _begin(self) -> None:
        self._main = threading.get_ident()
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)
        self._fd_before = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
        self._thread = threading.Thread(target=self._listen, args=(self._reader,), name="ending", daemon=True)
        self._thread.start()
        self.is_entered = True
        if _WAKING is not None:
            self._before[_WAKING] = signal.signal(_WAKING, lambda _number, _frame: self._is_awake.set())
        for number in ENDING | SUSPENDING:
            handler = signal.getsignal(number)
            if handler is signal.SIG_DFL or (number == signal.SIGINT and callable(handler)):
                self._before[number] = handler
                signal.signal(number, self._suspend if number in SUSPENDING else self._heed)

    def _end(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before = {}
        signal.set_wakeup_fd(self._fd_before, warn_on_full_buffer=False)
        self.is_entered = False
        assert self._reader is not None, "it was entered"
        assert self._writer is not None, "it was entered"
        if self._thread is not None:
            self._writer.send(b"\0")
            self._thread.join()
        self._reader.close()
        self._writer.close()

    def _listen(self, reader: socket.socket) -> None:
        while (number := reader.recv(1)[0]) != 0:
            if self._fd_before >= 0:
                self._pass_on(number)
            if number in ENDING | SUSPENDING:
                self.stop_all(number)
                self._wake_main()

    def _wake_main(self) -> None:
        """Ends a wait of the main thread, which knows nothing of a signal that came just before it.

        The same holds for a signal that the system gave to another thread.
        """
        if _WAKING is None:
            return
        self._is_awake.clear()
        for _ in range(_WAKES):
            if not self.is_entered:
                return
            signal.pthread_kill(self._main, _WAKING)
            if self._is_awake.wait(_WAKES_EVERY):
                return

    def _pass_on(self, number: int) -> None:
        """Gives a signal to whoever received signals before, such as an event loop."""
        try:
            os.write(self._fd_before, bytes([number]))
        except OSError as error:
            _log.debug("a signal could not be passed on: %s", error)

    def _heed(self, number: int, frame: object) -> None:
        if self._shields:
            self._late.append(number)
            return
        self._end_by(number, frame)

    def _end_by(self, number: int, frame: object = None) -> None:
        handler = self._before.get(number)
        if callable(handler):
            handler(number, frame)
        else:
            raise end_of(number)

    def _suspend(self, number: int, _frame: object) -> None:
        """Suspends the program, as it would be without a handler, once what moves was stopped."""
        self._were_stopped.wait(SUSPENDED_WITHIN)
        self._were_stopped.clear()
        os.kill(os.getpid(), signal.SIGSTOP)


_WATCH = _Watch()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_WATCH.forget)
