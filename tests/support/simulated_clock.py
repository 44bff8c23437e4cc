"""A clock whose time does not pass by itself, over real sockets: sessions of minutes take a second.

Threads take turns. One runs until it waits, and all that it sends has arrived by then. Once all wait, the
first whose event is set, line is ready or work is done goes on, in a fixed order; without one, time passes to
the next moment that one of them waits for. So a session is the same each run, however busy the computer is. A
busy computer is simulated: threads wake up `late`, by so many s on average, drawn from `seed`.

>>> with SimulatedClock():
...     began = clock.now()
...     clock.sleep(3600.0)
...     clock.now() - began
3600.0
"""

from __future__ import annotations

import asyncio
import faulthandler
import math
import select
import selectors
import signal
import sys
import threading
import time
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager

import numpy as np
import pytest

from tumble.foundation import clock

BEGINS = 10_000.0
"""s of `now` at which it begins."""
DATE = 1_795_651_200
"""s since 1970 at which it begins, and which all that tests make bears: 2026-11-26."""
LONGEST = 86_400.0
"""s that a simulation may take: beyond them, a thread waits for what never comes."""
TICK = 1e-9
"""s that the shortest wait takes, as no clock stands still."""
LOOK = 1e-4
"""s that a library takes to look at the clock: some look again and again instead of waiting."""
HANGS_AFTER = 600.0
"""s of the computer without a turn, after which a thread hangs outside of the clock."""


class SimulationError(AssertionError):
    """All wait for what never comes, a thread goes on after the test, or one waits that takes no part."""


class _Ended(BaseException):
    """Ends a thread whose simulation has ended."""


class _Turn:
    """One that takes part: a thread, or some work of an executor."""

    def __init__(self, name, is_met=lambda: True, late=0.0):
        self.name = name
        self.may_run = threading.Lock()
        self.may_run.acquire()
        self.await_(is_met, "its beginning", math.inf, late)
        self.signals = deque()
        """Signals that have come to it."""
        self.has_ended = False

    def await_(self, is_met, awaited, deadline, late):
        """Sets the condition on which it goes on, which has a name, or the time, s; it wakes up `late`, s."""
        self._is_met, self._awaited, self._deadline, self._late = is_met, awaited, deadline, late
        self._wakes = deadline + late

    def wakes_at(self, now):
        """Returns the time, s, at which it goes on, as far as is known at `now`."""
        if self.signals:
            return now
        if now + self._late < self._wakes and self._is_met():
            self._wakes = now + self._late
        return self._wakes

    def __str__(self):
        until = "" if self._deadline == math.inf else f", until {self._deadline:.6f} s"
        return f"{self.name} waits for {self._awaited}{until}"


class ComputerClock(clock.Clock):
    """The clock of the computer, by which tests wait for events alone."""

    def sleep(self, seconds):
        raise AssertionError(f"waits {seconds} s by the computer's clock; take the fixture simulated_clock")


@contextmanager
def simulated_if_live(words):
    """Runs a live command by a simulated clock, unless a test has put another clock in force."""
    is_live = "--live" in words or (words[:1] == ["record"] and "--finish" not in words)
    if is_live and isinstance(clock._in_force, ComputerClock):
        with SimulatedClock():
            yield
    else:
        yield


class SimulatedClock(clock.Clock):
    """In force while it is entered. Whoever enters it takes part, as do threads that `clock.thread` makes.

    Work of an executor takes `work` s. It begins so many s `later` than another, as if that had been before.
    """

    def __init__(self, seed=0, late=0.0, work=0.0, later=0.0):
        self._random = np.random.default_rng(seed)
        self._late = late
        self._work = work
        self._now = self._began = BEGINS + later
        self._main = _Turn(threading.current_thread().name)
        self._turns = [self._main]
        """Those that take part, in the order in which they began."""
        self._running = self._main
        self._of_thread = threading.local()
        self._of_thread.turn = self._main
        self._failure = None
        self._passed = 0
        """Turns that were passed on."""
        self._stack = ExitStack()
        if late:
            print(f"seed {seed}, {late} s late")

    def __enter__(self):
        with ExitStack() as stack:
            stack.enter_context(clock.replaced_by(self))
            stack.enter_context(_waits_of_libraries())
            over = threading.Event()
            watchdog = threading.Thread(target=self._watch, args=(over,), daemon=True)
            watchdog.start()
            stack.callback(watchdog.join)
            stack.callback(over.set)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, kind, error, trace):
        left = [turn for turn in self._turns if turn is not self._main]
        is_well = error is None and self._failure is None
        try:
            self._end(left)
        finally:
            self._of_thread.turn = None
            self._stack.close()
        if left and is_well:
            raise SimulationError(f"not ended: {', '.join(turn.name for turn in left)}")

    def now(self):
        return self._now

    def utc(self):
        return DATE + (self._now - BEGINS)

    def sleep(self, seconds):
        self._wait_until(lambda: False, "time to pass", seconds)

    def wait(self, awaited, longest=None):
        if isinstance(awaited, threading.Event):
            return self._wait_until(awaited.is_set, "an event", longest)
        if isinstance(awaited, threading.Thread):
            has_ended = self._wait_until(
                lambda: not awaited.is_alive(), f"the end of {awaited.name}", longest
            )
            if has_ended:
                # It has nothing left to do but to leave the interpreter.
                awaited.join()
            return has_ended
        return self._wait_until(awaited.done, "work", longest)

    def select(self, lines, longest=None):
        if longest is None or longest > 0.0:
            places = [key.fd for key in lines.get_map().values()]
            self._wait_until(lambda: bool(lines.select(0.0)), f"lines {places}", longest)
        return lines.select(0.0)

    def thread(self, work, arguments, name):
        return _Thread(self, target=work, args=arguments, name=name or None, daemon=True)

    def executor(self, name):
        return _Executor(self, name or "work")

    def interrupt(self, number=signal.SIGINT):
        """Sends a signal to the thread that entered the simulation, which receives it where it waits."""
        self._main.signals.append(number)

    def interrupt_later(self, seconds, number=signal.SIGINT):
        """Does so in so many s; returns the thread that does."""

        def interrupt():
            clock.sleep(seconds)
            self.interrupt(number)

        thread = clock.thread(interrupt, name="interrupter")
        thread.start()
        return thread

    def run(self, coroutine):
        """Runs a coroutine in an event loop that waits by this clock; returns what it returns."""
        with closing(_Loop(self)) as loop:
            try:
                return loop.run_until_complete(coroutine)
            finally:
                loop.run_until_complete(loop.shutdown_asyncgens())

    def takes_part(self):
        """Returns whether the thread that asks takes part."""
        return getattr(self._of_thread, "turn", None) is not None

    def _wait_until(self, is_met, awaited, longest):
        """Lets others run until a condition is met, `longest` s at most; returns whether it is."""
        turn = getattr(self._of_thread, "turn", None)
        if turn is None or turn is not self._running:
            raise SimulationError(f"{threading.current_thread().name} waits, but takes no part")
        deadline = math.inf if longest is None else self._now + max(TICK, longest)
        turn.await_(is_met, awaited, deadline, self._lateness())
        while True:
            self._refuse_after_the_end(turn)
            self._pass_on(turn)
            self._refuse_after_the_end(turn)
            if not turn.signals:
                return is_met()
            signal.raise_signal(turn.signals.popleft())

    def _lateness(self):
        return self._random.exponential(self._late) if self._late else 0.0

    def _refuse_after_the_end(self, turn):
        if self._failure is not None:
            raise self._failure if turn is self._main else _Ended

    def _pass_on(self, turn):
        """Lets the next one run, and returns when it is this one's turn."""
        chosen = self._next(self._turns.index(turn) + 1)
        if chosen is turn:
            return
        chosen.may_run.release()
        try:
            turn.may_run.acquire()
        except BaseException as error:  # Ctrl-C of whoever runs the tests
            self._failure = self._failure or error
            turn.may_run.acquire()
            raise

    def _next(self, place):
        """Lets time pass until one goes on, and returns that; begins to look at a place in their order."""
        self._running = self._chosen(self._turns[place:] + self._turns[:place])
        self._passed += 1
        return self._running

    def _chosen(self, order):
        while self._failure is None:
            wakes = [turn.wakes_at(self._now) for turn in order]
            moment = min(wakes)
            if moment <= self._now:
                return next(turn for turn, at in zip(order, wakes, strict=True) if at <= self._now)
            if moment > self._began + LONGEST:
                self._failure = SimulationError(f"what they wait for never comes:\n{self}")
            else:
                self._now = moment
        return self._main

    def _begin(self, name, is_met=lambda: True):
        """Adds one that goes on when the others wait, and a condition is met."""
        turn = _Turn(name, is_met, self._lateness())
        self._turns.append(turn)
        return turn

    def _take_first_turn(self, turn):
        """Waits, in the thread of that one, until it is its turn for the first time."""
        turn.may_run.acquire()
        self._of_thread.turn = turn

    def _leave(self, turn):
        """Takes one out that has ended."""
        turn.has_ended = True
        place = self._turns.index(turn)
        self._turns.remove(turn)
        if turn is self._running:
            self._next(place).may_run.release()

    def _end(self, left):
        """Ends those that still take part, one after another."""
        self._failure = self._failure or _Ended()
        for turn in left:
            if not turn.has_ended:
                self._running = turn
                turn.may_run.release()
                self._main.may_run.acquire()

    def _watch(self, over):
        """Ends a process that hangs."""
        before = -1
        while not over.wait(HANGS_AFTER):
            if self._passed == before:
                print(f"{self._running.name} hangs outside of the clock:\n{self}", file=sys.stderr)
                faulthandler.dump_traceback()
                signal.raise_signal(signal.SIGABRT)
            before = self._passed

    def __str__(self):
        return "\n".join([f"at {self._now:.6f} s", *(f"  {turn}" for turn in self._turns)])


class _Thread(threading.Thread):
    """A thread that takes part from its start."""

    def __init__(self, simulated, **arguments):
        super().__init__(**arguments)
        self._simulated = simulated
        self._turn = None

    def start(self):
        self._turn = self._simulated._begin(self.name)
        super().start()

    def run(self):
        self._simulated._take_first_turn(self._turn)
        try:
            self._simulated._refuse_after_the_end(self._turn)
            super().run()
        except _Ended:
            return
        finally:
            self._simulated._leave(self._turn)

    def is_alive(self):
        return super().is_alive() and not self._turn.has_ended


class _Executor(ThreadPoolExecutor):
    """Does work one after another; each takes part while it is done."""

    def __init__(self, simulated, name):
        super().__init__(1, thread_name_prefix=name)
        self._simulated = simulated
        self._name = name
        self._last = None

    def submit(self, work, /, *arguments, **named):
        before = self._last
        turn = self._simulated._begin(self._name, lambda: before is None or before.done())
        self._last = super().submit(self._in_turn, turn, work, arguments, named)
        # Others have their turn only once they see that the work is done.
        self._last.add_done_callback(lambda _: self._simulated._leave(turn))
        return self._last

    def shutdown(self, wait=True, *, cancel_futures=False):
        super().shutdown(wait=False, cancel_futures=cancel_futures)
        if wait and self._last is not None:
            self._simulated.wait(self._last)
        super().shutdown(wait=wait)

    def _in_turn(self, turn, work, arguments, named):
        self._simulated._take_first_turn(turn)
        self._simulated._refuse_after_the_end(turn)
        found = work(*arguments, **named)
        if self._simulated._work:
            self._simulated.sleep(self._simulated._work)
        return found


class _Selector(selectors.DefaultSelector):
    """Waits for the lines of an event loop."""

    def __init__(self, simulated):
        super().__init__()
        self._simulated = simulated

    def select(self, timeout=None):
        look = super().select
        if timeout is None or timeout > 0.0:
            self._simulated._wait_until(lambda: bool(look(0.0)), "an event loop", timeout)
        return look(0.0)


class _Loop(asyncio.SelectorEventLoop):
    """An event loop by the simulated clock."""

    def __init__(self, simulated):
        super().__init__(_Selector(simulated))
        self._simulated = simulated

    def time(self):
        return self._simulated.now()


class _LibraryCall:
    """A function by which libraries read the time or wait; threads that take part do so by their clock."""

    def __init__(self, own, other):
        self._own, self._other = own, other

    def __call__(self, *arguments):
        simulated = clock._in_force
        if isinstance(simulated, SimulatedClock) and simulated.takes_part():
            return self._own(simulated, *arguments)
        return self._other(*arguments)


def _look(read):
    def look(simulated):
        simulated._now += LOOK
        return read(simulated)

    return look


def _select(simulated, *lines_and_longest):
    *lines, longest = (*lines_and_longest, None)[:4]
    if longest is None or longest > 0.0:
        simulated._wait_until(lambda: any(_look_at_lines(*lines, 0.0)), "lines of a library", longest)
    return _look_at_lines(*lines, 0.0)


_look_at_lines = select.select
_CALLS = {
    (time, "monotonic"): _LibraryCall(_look(SimulatedClock.now), time.monotonic),
    (time, "time"): _LibraryCall(_look(SimulatedClock.utc), time.time),
    (time, "sleep"): _LibraryCall(SimulatedClock.sleep, time.sleep),
    (select, "select"): _LibraryCall(_select, select.select),
}


@contextmanager
def _waits_of_libraries():
    """Has libraries that wait for serial lines and tables wait by the clock in force."""
    with pytest.MonkeyPatch.context() as patch:
        for (module, name), call in _CALLS.items():
            patch.setattr(module, name, call)
        patch.setattr("serial.serialutil.Timeout.TIME", _CALLS[time, "monotonic"])
        yield
