"""Why a stretch of a log, or a live run, is no spin that can be used: a code with its figures.

`tumble.procedures.spin.messages` makes a line of it, where it is printed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from tumble import _core
from tumble.foundation.log_time import LogTime
from tumble.foundation.results import Figures


class SpinFailureKind(Enum):
    """Kinds of failure: words of the core, and further ones that only a whole log shows."""

    NEVER_STILL = "never still"
    NO_REST = "no rest"
    NO_TURN = "no turn"
    TURNED_TOO_LITTLE = "turned too little"
    NOT_ONE_AXIS = "not one axis"
    LIFTED = "lifted"
    SATURATED = "saturated"
    FLOOR_TOO_STEEP = "floor too steep"
    SAMPLE_RATE_TOO_LOW = "sample rate too low"
    SAMPLES_MISSING = "samples missing"
    STREAM_STOPPED = "stream stopped"
    UNSOLVABLE = "unsolvable"

    VIBRATING = "vibrating"
    DRIFTING = "drifting"
    TURNING = "turning"
    """The last three are those of `Acquired.rejected_rests`: why something quiet was no rest."""

    NO_REST_FOR_LONG = "no rest for long"
    MOVED_FIRST = "moved first"
    BIAS_CHANGED = "bias changed"
    PUSHED = "pushed"
    TIPPED = "tipped"
    DROVE = "drove"
    DROVE_A_CIRCLE = "drove a circle"
    RESTED_TOO_SHORTLY = "rested too shortly"
    DEGREES_FOR_RADIANS = "degrees for radians"
    MISCOUNTED = "miscounted"


@dataclass(frozen=True, slots=True)
class SpinFailure:
    """A code and its figures: SI units, times in s of the clock of the samples."""

    kind: SpinFailureKind
    figures: Figures = field(default_factory=dict)

    @classmethod
    def of_core(cls, word: str, figures: Figures) -> SpinFailure:
        """Converts `SpinMachine.failure`, or the arguments of a `CoreError` of `fit_spin`."""
        return cls(SpinFailureKind(word), figures)

    def from_start(self, time: LogTime) -> SpinFailure:
        """Returns the failure with its time, where it has one, from the first sample of the recording."""
        if "time" not in self.figures:
            return self
        return SpinFailure(self.kind, {**self.figures, "time": time.since(self.figures["time"])})


@dataclass(frozen=True, slots=True)
class UnusedInterval:
    """From when to when, s, a log shows no spin that can be used, and why."""

    start: float
    end: float
    failure: SpinFailure

    def from_start(self, time: LogTime) -> UnusedInterval:
        """Returns the interval with times from the first sample of the recording."""
        return UnusedInterval(time.since(self.start), time.since(self.end), self.failure.from_start(time))


def rejected_rests(unit: _core.Acquired) -> list[UnusedInterval]:
    """Lists what looked like a rest of a recording and is none."""
    return [
        UnusedInterval(start, end, SpinFailure.of_core(word, {})) for start, end, word in unit.rejected_rests
    ]
