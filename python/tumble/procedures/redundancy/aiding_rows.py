"""Live rows of an aiding measurement, under names of columns or as JSON, on the clock of this computer."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tumble.foundation.errors import TumbleError
from tumble.foundation.numbers import number_of
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of, join
from tumble.live.clock import StampGate
from tumble.live.host_clock import HostClock
from tumble.live.labels import LabelRow
from tumble.logs.aiding import SCORE, SIGMA, SOUGHT, TIME, Aiding, aiding_measurements_in, is_column
from tumble.logs.options import ReadOptions
from tumble.logs.text import names_delimiter, split_line

SOONER = 0.05
"""s by which a row has to come sooner than any before to be doubted: its stamp may have a wrong digit."""


class AidingRows:
    """Makes aiding measurements of rows, whose times are put on the clock of this computer.

    `joined_midway` marks that the first line may have lost its front. For the rest see `LiveAiding`.
    """

    def __init__(
        self,
        source: str,
        units: Sequence[str],
        *,
        sigma: float | None = None,
        clock_rate: float = 1.0,
        joined_midway: bool = False,
    ) -> None:
        self.used = 0
        """Rows with a measurement."""
        self.objection = ""
        """Why what came cannot be used, as far as nothing could."""
        self._left_out = 0
        self._source = source
        self._scores = {f"{SCORE}{unit}" for unit in units}
        self._unknown: set[str] = set()
        """Scores of units that the set does not have."""
        self._sigma = sigma
        self._clock_rate = clock_rate
        self._may_be_torn = joined_midway
        self._names: Sequence[str] = ()
        self._delimiter = ","
        self._gate = StampGate()
        self._clock = HostClock()
        self._newest = -math.inf
        self._least, self._doubted = math.inf, math.nan
        """s from a stamp to its arrival: the least so far, and one that would be less by far."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on the received rows, for the user."""
        unknown = f"scores are of no unit of the set: {join(sorted(self._unknown))}" if self._unknown else ""
        left_out = f"left out {count_of('row', self._left_out)} that say nothing" if self._left_out else ""
        return tuple(filter(None, (self._clock.remark, unknown, left_out)))

    def read(self, rows: Sequence[LabelRow], arrival: float) -> Iterator[Aiding]:
        """Returns the measurements of rows that came at `arrival`, s of `clock.now()`."""
        for row in rows:
            figures = self._figures(row)
            if figures is None:
                continue
            if found := self._said(figures, arrival):
                self.used += 1
                yield from found
            else:
                self._left_out += 1

    def _figures(self, row: LabelRow) -> Mapping[str, float] | None:
        """Returns the numbers of a row by their names; None of what is no row."""
        torn, self._may_be_torn = self._may_be_torn, False
        if isinstance(row, dict):
            return {name: value for name, value in row.items() if isinstance(value, float)}
        text = row.lstrip("#%").strip()
        if (delimiter := names_delimiter(text, ReadOptions(), SOUGHT)) is not None:
            names = split_line(text, delimiter)
            # One that lost its front, or is corrupt, may lack it.
            if TIME in names or (TIME not in self._names and not torn):
                self._names, self._delimiter = names, delimiter
            return None
        fields = split_line(text, self._delimiter)
        if torn:
            return None
        if len(fields) != len(self._names):
            return {}
        numbers = [number_of(field) if field else math.nan for field in fields]
        known = zip(self._names, numbers, strict=True)
        return {} if None in numbers else {name: number for name, number in known if number is not None}

    def _said(self, figures: Mapping[str, float], arrival: float) -> tuple[Aiding, ...]:
        known = {name: value for name, value in figures.items() if is_column(name)}
        self._unknown |= {name for name in known if name.startswith(SCORE)} - self._scores
        usable = {name: value for name, value in known.items() if name not in self._unknown}
        if any(value <= 0.0 for name, value in usable.items() if name.startswith(SIGMA)):
            return ()
        own = usable.pop(TIME, None)
        stamp = self._host_time(own, arrival) if any(map(math.isfinite, usable.values())) else None
        if stamp is None:
            return ()
        columns: dict[str, FloatArray] = {TIME: np.array([stamp])}
        columns |= {name: np.array([value]) for name, value in usable.items()}
        try:
            found = aiding_measurements_in(columns, self._source, self._sigma)
        except TumbleError as error:
            self.objection = self.objection or str(error)
            return ()
        return tuple(aiding for aiding in found if len(aiding.time))

    def _host_time(self, stamp: float | None, arrival: float) -> float | None:
        """Time of a row on the clock of this computer, s; None where its stamp is corrupt or old."""
        if stamp is None:
            return None if self._newest > -math.inf else self._clock_rate * arrival
        own = stamp / self._clock_rate
        if not self._gate.believed(np.array([own]))[0]:
            return None
        if self._gate.ran_back:
            self._gate.ran_back, self._newest, self._least = 0.0, -math.inf, math.inf
        if own <= self._newest or not self._is_borne_out(arrival - own):
            return None
        self._newest = own
        return self._clock_rate * float(self._clock.host_times(np.array([own]), arrival)[0])

    def _is_borne_out(self, delay: float) -> bool:
        """Returns whether the delay of a row is plausible, by other rows or by the one before it."""
        doubted, self._doubted = self._doubted, delay
        if delay < self._least - SOONER and math.isfinite(self._least) and abs(delay - doubted) > SOONER:
            return False
        self._least = min(self._least, delay)
        return True
