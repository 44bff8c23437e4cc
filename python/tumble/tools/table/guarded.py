"""A table that cannot be commanded beyond its limits, and that is stopped on every way out."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from types import TracebackType
from typing import TypeVar

import numpy as np

from tumble.foundation import clock
from tumble.foundation.ending import SUSPENDING, end_of, shielded, stopped_at_the_end
from tumble.foundation.errors import TableError
from tumble.foundation.recording import FloatArray
from tumble.tools.table.axes import FREE, Axis, AxisLimits
from tumble.tools.table.bounds import exceeded
from tumble.tools.table.motion import travel_time
from tumble.tools.table.rate_table import RateTable
from tumble.tools.table.survivor import Survivor, survivor

Answer = TypeVar("Answer")

POLL = 0.02
"""s between two questions whether the table has settled, and between two looks whether the line is free."""
PATIENCE, AT_LEAST = 1.5, 5.0
"""A motion is overdue after so many times what it should take, and so many s."""
SERVO_ERROR = math.radians(0.5)
"""rad by which a servo may swing beyond a limit of angle, or stand beside the angle it was sent to."""
STOPS = 2
"""Times that a stop is sent where the first was not answered."""
UNANSWERED = "the stop was not answered: USE THE EMERGENCY STOP"
IMPATIENCE = 0.25
"""s that the stop of a program that ends waits for an answer under way; then it is sent all the same."""


class HaltedTableError(TableError):
    """A command to a table that another thread has stopped for good."""


class GuardedTable:
    """Stands before any driver: limits before each command, a stop on every way out, nothing unless armed.

    `limits` of axes by their name come on top of those of the maker. Without `armed` no motion is sent; what
    would be is passed to `say`, one line each. All arrays are (axes,), from the axis on the floor up.

    Leaving it stops the table, and so does any signal that ends or suspends the program, whichever thread
    holds the table and whatever the main thread does. Outside the main thread it can be armed only where that
    one is within `tumble.foundation.ending.watched`. So does silence: a driver raises where a query is not
    answered in time. A line that is lost is opened once more to send the stop. After any error, and after
    `halt`, nothing moves until the table is entered again. A process beside the program stops a table that
    has an address where the program is killed or crashes.

    A motion to angles has settled when the driver reports it *and* the table stands there: a driver that
    reports the end of a motion before it began, or of one that a collision ended, is not relied on.
    """

    def __init__(
        self,
        table: RateTable,
        limits: Mapping[str, AxisLimits] | None = None,
        *,
        armed: bool = False,
        say: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self.armed = armed
        self.axes: tuple[Axis, ...] = tuple(
            replace(axis, limits=axis.limits.within((limits or {}).get(axis.name, FREE)))
            for axis in table.axes
        )
        self._table = table
        self._say = say
        self._enabled = False
        self._halted = False
        self._due = math.inf
        """s of `clock.now()` by which the motion under way has to have settled."""
        self._target: FloatArray | None = None
        """(axes,) rad of the last motion to angles; None after a motion at rates or a stop."""
        self._ended_by: int | None = None
        """Number of the signal by which the program ends or is suspended."""
        self._is_halted = False
        """Indicates whether another thread has stopped the table for good."""
        self._is_open = False
        self._line = threading.RLock()
        """Held by the thread that queries or commands the driver."""
        self._halting = threading.Lock()
        """Held by another thread than the one that drives the table, while that one stops it."""
        self._registered, self._beside = ExitStack(), ExitStack()
        self._survivor: Survivor | None = None

    @property
    def name(self) -> str:
        """Name of the table in messages."""
        return self._table.name

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on the driver for the user."""
        return self._table.remarks

    def __enter__(self) -> GuardedTable:
        self._enabled = self._halted = self._is_halted = False
        self._ended_by = None
        with ExitStack() as stack:
            if self.armed:
                try:
                    stack.enter_context(stopped_at_the_end(self._stop_at_the_end))
                except RuntimeError as error:
                    raise TableError(f"{self.name}: is not armed in a thread where {error}") from error
            self._table.__enter__()
            # A driver of another package may not state an address, or texts that it is opened with.
            if self.armed and (address := getattr(self._table, "address", "")):
                documents = getattr(self._table, "documents", {})
                self._survivor = self._beside.enter_context(survivor(address, documents))
            self._registered = stack.pop_all()
        self._is_open = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if self.armed:
                self._stop_for_sure(error)
        finally:
            # A table that is not registered any more is not stopped over a line that is closed.
            with ExitStack() as left:
                # It goes on with a stop that was not answered, over a line of its own.
                left.callback(self._beside.close)
                left.push(lambda *_: self._table.__exit__(kind, error, trace))
                # A stop that another thread has sent is answered over a line that is open.
                left.callback(self._halting.release)
                _acquired(self._halting)
                left.enter_context(self._alone())
                self._is_open = False
                self._registered.close()

    def goto(
        self, angles: FloatArray, rate: FloatArray | None = None, acceleration: FloatArray | None = None
    ) -> float:
        """Begins to move to these angles; returns the s it takes.

        Without `rate` and `acceleration`, the largest allowed.

        Raises `TableError` where a limit would be passed, and while the table moves.
        """
        angles, rate = self._figures(angles), self._figures(rate, "rate")
        acceleration = self._figures(acceleration, "acceleration")
        self._refuse_beyond_limits(angles, rate, acceleration)
        self._refuse_while_moving()
        distances = np.abs(angles - self._known_position())
        took = max(map(travel_time, distances.tolist(), rate.tolist(), acceleration.tolist()))
        targets = np.degrees(angles)
        if self._begins(took, f"go to {self._in_words(targets)} deg within {took:.1f} s"):
            self._target = angles
            self._move(lambda: self._table.goto(angles, rate, acceleration))
        return took

    def rate(self, rates: FloatArray, acceleration: FloatArray | None = None) -> float:
        """Begins to turn at these rates until the next command; returns the s it takes to reach them.

        Raises `TableError` where a limit would be passed, for an axis with limits of angle (it would pass
        them in time: `goto` it at a rate), and while the table changes its rate.
        """
        rates, acceleration = self._figures(rates), self._figures(acceleration, "acceleration")
        self._refuse_beyond_limits(np.full(len(self.axes), np.nan), rates, acceleration)
        for axis, rate in zip(self.axes, rates.tolist(), strict=True):
            if rate != 0.0 and axis.limits.angle is not None:
                raise TableError(
                    f"{self.name}: {axis.name} has limits of angle, which a rate would pass in time; "
                    "go to an angle at that rate"
                )
        self._refuse_while_moving()
        took = float(np.max(2.0 * np.array([axis.limits.rate for axis in self.axes]) / acceleration))
        turning = f"turn at {self._in_words(np.degrees(rates))} deg/s until told otherwise"
        if self._begins(took, turning):
            self._target = None
            self._move(lambda: self._table.rate(rates, acceleration))
        return took

    def settled(self) -> bool:
        """Returns True if the last motion has ended, at its angles where it had any.

        Raises `TableError` where it is overdue, has ended elsewhere, or went too far, and where the table was
        stopped by something else than a command of this thread.
        """
        self._refuse_after_a_stop()
        settled = self._guarded(self._table.settled)
        self._check_angles()
        missed = list(self._missed()) if settled else []
        if (not settled or missed) and self.armed and clock.now() > self._due:
            where = f"is at rest with {', '.join(missed)}" if missed else "has not settled in time"
            self._fail(TableError(f"{self.name}: {where}, and was stopped; is it blocked?"))
        return settled and not missed

    def wait(self) -> None:
        """Waits until the last motion has ended; raises as `settled`."""
        while not self.settled():
            clock.sleep(POLL)

    def position(self) -> FloatArray:
        """Returns the angles, rad; NaN where the table does not report them."""
        return self._guarded(self._table.position)

    def stop(self) -> None:
        """Brings all axes to rest, armed or not; raises `TableError` where that is not answered."""
        self._target = None
        self._stop_for_sure(None)

    def halt(self) -> None:
        """Stops the table for good, from any thread, whatever the one that drives it waits for.

        Nothing moves until the table is entered again; a table that was left needs no stop. Raises
        `TableError` where the stop is not answered.
        """
        self._is_halted = True
        self._target = None
        if self.armed and _acquired(self._halting):
            try:
                self._stop_for_sure(None, IMPATIENCE)
            finally:
                self._halting.release()

    def _figures(self, figures: FloatArray | None, what: str = "") -> FloatArray:
        """Returns (axes,) finite numbers; those of the limits if none are given."""
        if figures is None:
            return np.array([getattr(axis.limits, what) for axis in self.axes])
        numbers = np.asarray(figures, dtype=np.float64)
        if numbers.shape != (len(self.axes),) or not np.isfinite(numbers).all():
            names = ", ".join(axis.name for axis in self.axes)
            raise TableError(f"{self.name}: needs a number for each of {names}, found {figures}")
        if what and not (numbers > 0.0).all():
            raise TableError(f"{self.name}: {what} needs to be above zero, found {figures}")
        return numbers

    def _refuse_beyond_limits(self, angles: FloatArray, rates: FloatArray, accelerations: FloatArray) -> None:
        for axis, *figures in zip(self.axes, angles, rates, accelerations, strict=True):
            for objection in exceeded(axis, *map(float, figures)):
                raise TableError(f"{self.name}: {objection}; give less, or another --table-limits")

    def _refuse_while_moving(self) -> None:
        self._refuse_at_the_end()
        if self._halted:
            raise TableError(f"{self.name}: was stopped after an error; see to that, and start again")
        if not self.settled():
            raise TableError(f"{self.name}: still moves; wait until it has settled, or stop it")

    def _known_position(self) -> FloatArray:
        angles = self.position()
        if np.isnan(angles).any():
            raise TableError(f"{self.name}: cannot say where it is, so it cannot be sent to an angle")
        return angles

    def _begins(self, took: float, what: str) -> bool:
        """Prepares for a motion; without arms, only reports it."""
        if not self.armed:
            self._say(f"would {what}")
            return False
        if not self._enabled:
            if self._survivor is not None:
                self._survivor.wait_until_ready()
            self._guarded(self._table.enable)
            self._enabled = True
        self._due = clock.now() + PATIENCE * took + AT_LEAST
        return True

    def _check_angles(self) -> None:
        if not self.armed or all(axis.limits.angle is None for axis in self.axes):
            return
        for axis, angle in zip(self.axes, self.position().tolist(), strict=True):
            low, high = axis.limits.angle or (-math.inf, math.inf)
            if math.isnan(angle) or not low - SERVO_ERROR <= angle <= high + SERVO_ERROR:
                self._fail(
                    TableError(
                        f"{self.name}: {axis.name} is at {math.degrees(angle):.6g} deg, beyond its limits, "
                        "and was stopped; bring it back by hand"
                    )
                )

    def _missed(self) -> Iterator[str]:
        """Names the axes that stand elsewhere than the last motion was to end.

        An axis without limits of angle may report its angle less whole turns.
        """
        if self._target is None or not self.armed:
            return
        for axis, angle, target in zip(self.axes, self.position(), self._target, strict=True):
            error = angle - target
            if axis.limits.angle is None:
                error = math.remainder(error, math.tau)
            if not abs(error) <= SERVO_ERROR:
                yield (
                    f"{axis.name} at {math.degrees(angle):.6g} deg instead of {math.degrees(target):.6g} deg"
                )

    def _move(self, call: Callable[[], None]) -> None:
        """Commands a motion; one that is under way as the program ends is stopped once more."""

        def moved() -> None:
            self._refuse_at_the_end()
            call()
            self._refuse_at_the_end()

        self._guarded(moved)

    def _refuse_at_the_end(self) -> None:
        """Raises what ends the program where a signal does: in other threads than the main one an error."""
        self._refuse_after_a_stop()
        number = self._ended_by
        if number is None:
            return
        if number not in SUSPENDING and threading.current_thread() is threading.main_thread():
            raise end_of(number)
        raise self._was_stopped_at_the_end()

    def _was_stopped_at_the_end(self) -> TableError:
        return TableError(f"{self.name}: was stopped, as the program was to end or to be suspended")

    def _refuse_after_a_stop(self) -> None:
        """Raises `TableError` where no motion of this thread goes on any more."""
        if self._is_halted:
            raise HaltedTableError(f"{self.name}: was stopped; arm it again to go on")
        if self._ended_by in SUSPENDING:
            raise self._was_stopped_at_the_end()

    def _stop_at_the_end(self, number: int) -> None:
        """Stops the table for a program that ends; may be called by any thread, at any time."""
        self._ended_by, self._halted = number, True
        with self._alone(IMPATIENCE):
            self._table.stop()

    @contextmanager
    def _alone(self, patience: float = math.inf) -> Iterator[bool]:
        """Waits `patience` s at most until no other thread uses the line; gives whether none does."""
        is_alone = self._line.acquire(timeout=patience) if patience < math.inf else _acquired(self._line)
        try:
            yield is_alone
        finally:
            if is_alone:
                self._line.release()

    def _guarded(self, call: Callable[[], Answer]) -> Answer:
        """Queries or commands the driver; stops the table where that fails."""
        try:
            with self._alone():
                return call()
        except BaseException as error:
            if self.armed:
                self._fail(error)
            raise

    def _fail(self, error: BaseException) -> None:
        """Stops, then raises; where another thread has stopped the table, an error may come of that."""
        self._halted = True
        self._stop_for_sure(error)
        if isinstance(error, Exception):
            self._refuse_after_a_stop()
        raise error

    def _stop_for_sure(self, reason: BaseException | None, patience: float = math.inf) -> None:
        """Sends the stop until it is answered, the second time over a new line; no signal interrupts that.

        The first one waits `patience` s for another thread that uses the line. Raises `TableError`, with what
        came before, where it never is answered.
        """
        failure: BaseException | None = None
        with shielded():
            for wait in (patience, *(STOPS - 1) * [max(patience, AT_LEAST)]):
                with self._alone(wait) as is_alone:
                    if not self._is_open:
                        return
                    try:
                        if is_alone and isinstance(failure, Exception):
                            self._table.__exit__(None, None, None)
                            self._table.__enter__()
                        self._table.stop()
                    except BaseException as error:
                        failure = error
                    else:
                        self._note_answer(is_answered=True)
                        break
            else:
                self._note_answer(is_answered=False)
                raise self._unanswered(reason, failure) from failure
        # A Ctrl-C that came just before the stop, which was sent all the same.
        if failure is not None and not isinstance(failure, Exception):
            raise failure

    def _note_answer(self, *, is_answered: bool) -> None:
        if self._survivor is not None:
            self._survivor.is_answered = is_answered

    def _unanswered(self, reason: BaseException | None, failure: BaseException | None) -> TableError:
        before = f"{reason}; and " if isinstance(reason, TableError) and UNANSWERED not in str(reason) else ""
        return TableError(f"{before}{self.name}: {UNANSWERED} ({failure})")

    def _in_words(self, figures: FloatArray) -> str:
        return ", ".join(
            f"{axis.name} {figure:.6g}" for axis, figure in zip(self.axes, figures.tolist(), strict=True)
        )


def _acquired(lock: threading.Lock | threading.RLock) -> bool:
    """Waits until a lock is free, and takes it; returns True."""
    while not lock.acquire(blocking=False):
        clock.sleep(POLL)
    return True
