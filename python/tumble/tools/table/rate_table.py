"""Interface of every driver of a table."""

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import Protocol

from tumble.foundation.recording import FloatArray
from tumble.tools.table.axes import Axis


class RateTable(Protocol):
    """A table with one to three axes that obeys commands.

    It is a context manager: entering it opens the line, and moves nothing. All arrays are (axes,), from the
    axis on the floor up, in rad, rad/s and rad/s^2. No driver checks limits: `GuardedTable` does, for all.

    Raises `TableError`, in one line, where the line cannot be opened or is lost, where the table refuses a
    command, and where it leaves a query or a command unanswered for longer than it may take.
    """

    @property
    def name(self) -> str:
        """Name of the table in messages."""

    @property
    def address(self) -> str:
        """Address by which another process opens it; empty for a table that ends with this one."""

    @property
    def documents(self) -> Mapping[str, str]:
        """Texts with which another process opens it without reading a file; those of its `TableAddress`."""

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes, with the limits of the maker."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks for the user, such as that this driver was never tested on hardware."""

    def prepare(self) -> None:
        """Imports what it takes to open and to stop the table; opens nothing."""

    def __enter__(self) -> RateTable: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def enable(self) -> None:
        """Switches the drives on; nothing where there is nothing to switch."""

    def goto(self, angles: FloatArray, rate: FloatArray, acceleration: FloatArray) -> None:
        """Begins to move to these angles, no faster than that; returns at once."""

    def rate(self, rates: FloatArray, acceleration: FloatArray) -> None:
        """Begins to turn at these rates, and goes on; returns at once."""

    def settled(self) -> bool:
        """Indicates whether the last motion has ended: at its angles, or at its rates."""

    def position(self) -> FloatArray:
        """Returns the angles; NaN where the table does not report them."""

    def stop(self) -> None:
        """Brings all axes to rest, whatever they do."""
