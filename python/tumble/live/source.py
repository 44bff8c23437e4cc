"""What a live source is: samples of one IMU, as they come."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol

from tumble.recording import Chunk, FloatArray


@dataclass(frozen=True, slots=True)
class LiveChunk(Chunk):
    """Samples that came together, in SI units and the case frame of the IMU; it may hold none."""

    moving: FloatArray | None = None
    """(n,) 1 where wheels turn, 0 where they stand, NaN where nobody knows; None where nobody ever does."""


class Source(Protocol):
    """A stream of samples that ends when whoever reads it has enough, or when there is no more.

    It is a context manager: entering it opens the line, leaving it lets go of the line. Between the two it is
    iterated once. While nothing comes it gives an empty chunk every `HEARTBEAT` seconds or so, so that its
    reader can tell silence from waiting. It ends where a stream has an end, as a replayed log has.

    Raises `LogError`, in one line, where the line cannot be opened, is lost, or carries what no IMU says.
    """

    @property
    def name(self) -> str:
        """Short name for tables and file names: `ttyUSB0`."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a user should know of the samples given so far: units taken for granted, samples left out."""

    @property
    def gyroscope_unit_is_assumed(self) -> bool:
        """Whether rad/s were taken for granted, for want of a word from the stream or the user."""

    def __enter__(self) -> Source: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def __iter__(self) -> Iterator[LiveChunk]: ...


HEARTBEAT = 0.1
"""Longest time, s, for which a source keeps its reader waiting without a word."""
