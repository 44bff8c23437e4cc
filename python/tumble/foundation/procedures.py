"""The procedures, one row each: commands, names of files and of the package, and inspection read them.

A new procedure is a folder of `procedures/` and its row here; `tumble/__init__.py` names its function and
result for type checkers.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as of the package, which reads the rows before Control-C is heeded
if TYPE_CHECKING:
    from collections.abc import Iterator


class Procedure:
    """A folder `procedures/WORD`: `procedure.py` has the function WORD, `result.py` what it finds."""

    __slots__ = ("endings", "result", "serves", "summary", "word")

    def __init__(
        self, word: str, result: str, summary: str, *, endings: tuple[str, ...] = (), serves: bool = True
    ) -> None:
        self.word = word
        self.result = result
        """Type of what it finds."""
        self.summary = summary
        """First line of the help of its command."""
        self.endings = endings
        """Behind the name of a unit in the names of its files."""
        self.serves = serves
        """Indicates whether `serves.py` of the folder judges which recordings suit the procedure."""

    @property
    def folder(self) -> str:
        """Name of the package that it is."""
        return f"tumble.procedures.{self.word}"


PROCEDURES = (
    Procedure(
        "turntable", "TurntableResult", "Calibrate targets on a turntable against a co-mounted reference."
    ),
    Procedure(
        "spin",
        "SpinResult",
        "Find the biases of a robot's IMU from a turn on the spot.",
        endings=("spin", "live"),
    ),
    Procedure(
        "redundancy",
        "RedundancyResult",
        "Replay a redundant set: a primary IMU keeps its secondaries calibrated.",
        endings=("redundancy",),
    ),
    Procedure(
        "multipose",
        "MultiposeResult",
        "Calibrate an IMU that was held still in many orientations, without equipment.",
        endings=("multipose",),
    ),
    Procedure(
        "noise",
        "NoiseResult",
        "Find the noise of a sensor that stands still: Allan deviations and the terms they show.",
        endings=("noise",),
    ),
    Procedure(
        "thermal",
        "ThermalResult",
        "Find how bias and scale of a unit change with temperature.",
        endings=("thermal",),
    ),
    Procedure(
        "align",
        "AlignResult",
        "Find rotation, time offset and lever arm between units that moved together.",
        serves=False,
    ),
)
"""Procedures in the order of their presentation."""


def homes() -> Iterator[tuple[str, tuple[str, ...]]]:
    """Returns the modules from which the package has functions and results, with their names."""
    for each in PROCEDURES:
        yield f"{each.folder}.procedure", (each.word,)
        yield f"{each.folder}.result", (each.result,)
