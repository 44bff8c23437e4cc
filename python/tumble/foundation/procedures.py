"""The procedures, one row each: commands, names of files and of the package, and inspection read them.

A new procedure is a folder of `procedures/` and its row here; `tumble/__init__.py` names its function and
result for type checkers.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as of the package, which reads the rows before Control-C is heeded
if TYPE_CHECKING:
    from collections.abc import Iterator


class Procedure:
    """A folder `procedures/WORD`: `procedure.py` has the function WORD, `result.py` what it finds.

    `command.py` has WORD_command, `summary_document.py` WordDocument, which `--json` prints, and
    docs/how-to/WORD.md explains its use.
    """

    __slots__ = (
        *(
            "endings",
            "files",
            "guided",
            "result",
            "roles",
            "serves",
            "simulated",
            "summary",
            "takes_one_log",
            "title",
        ),
        *("typed", "word"),
    )

    def __init__(
        self,
        word: str,
        result: str,
        summary: str,
        *,
        title: str,
        endings: tuple[str, ...] = (),
        files: tuple[str, ...] = (),
        guided: bool = False,
        roles: tuple[str, ...] = (),
        serves: bool = True,
        simulated: str = "",
        takes_one_log: bool = False,
        typed: str = "",
    ) -> None:
        self.word = word
        self.result = result
        """Type of what it finds."""
        self.summary = summary
        """First line of the help of its command."""
        self.title = title
        """Title of its page in the list of pages."""
        self.endings = endings
        """Behind the name of a unit in the names of its files."""
        self.files = files
        """Names of its other files, without extension."""
        self.guided = guided
        """Indicates whether `guided_run.py` of the folder guides an operator; see `tumble.tools.guided`."""
        self.roles = roles
        """Roles of units that it takes together: that of the first, and that of the others; else empty."""
        self.serves = serves
        """Indicates whether `serves.py` of the folder judges which recordings suit the procedure."""
        self.simulated = simulated
        """Simulated recording for trials: a word of `tumble simulate`."""
        self.takes_one_log = takes_one_log
        """Indicates whether one log, and nothing else, is enough to run it."""
        self.typed = typed
        """Arguments of its command for that recording, in the folder `{0}`."""

    @property
    def folder(self) -> str:
        """Name of the package that it is."""
        return f"tumble.procedures.{self.word}"


PROCEDURES = (
    Procedure(
        "turntable",
        "TurntableResult",
        "Calibrate targets on a turntable against a co-mounted reference.",
        title="On a turntable",
        files=("turntable", "summary", "batch"),
        guided=True,
        roles=("reference", "target"),
        simulated="turntable",
        typed="{0}/reference.csv {0}/target_1.csv {0}/target_2.csv --poses {0}/poses.yaml",
    ),
    Procedure(
        "spin",
        "SpinResult",
        "Find the biases of a robot's IMU from a turn on the spot.",
        title="By a spin of a robot",
        endings=("spin", "live"),
        simulated="spin",
        takes_one_log=True,
        typed="{0}/spin.csv",
        guided=True,
    ),
    Procedure(
        "redundancy",
        "RedundancyResult",
        "Replay a redundant set: a primary IMU keeps its secondaries calibrated.",
        title="In a redundant set",
        endings=("redundancy",),
        files=("events",),
        roles=("primary", "secondary"),
        simulated="flight",
        typed="--primary {0}/primary.csv --secondary {0}/secondary_1.csv --secondary {0}/secondary_2.csv "
        "--settings {0}/units.yaml",
        guided=True,
    ),
    Procedure(
        "multipose",
        "MultiposeResult",
        "Calibrate an IMU that was held still in many orientations, without equipment.",
        title="In many orientations",
        endings=("multipose",),
        simulated="multipose",
        takes_one_log=True,
        typed="{0}/multipose.csv",
        guided=True,
    ),
    Procedure(
        "magnetometer",
        "MagnetometerResult",
        "Calibrate a magnetometer by the Earth's field: hard iron, soft iron, mounting.",
        title="Magnetometer",
        endings=("magnetometer",),
        simulated="magnetometer",
        takes_one_log=True,
        typed="{0}/magnetometer.csv",
    ),
    Procedure(
        "noise",
        "NoiseResult",
        "Find the noise of a sensor that stands still: Allan deviations and the terms they show.",
        title="Noise",
        endings=("noise",),
        simulated="static",
        takes_one_log=True,
        typed="{0}/static.csv",
        guided=True,
    ),
    Procedure(
        "thermal",
        "ThermalResult",
        "Find how bias and scale of a unit change with temperature.",
        title="Temperature",
        endings=("thermal",),
        simulated="thermal",
        takes_one_log=True,
        typed="{0}/thermal.csv",
    ),
    Procedure(
        "align",
        "AlignResult",
        "Find rotation, time offset and lever arm between units that moved together.",
        title="Align units",
        serves=False,
        files=("align",),
        roles=("primary", "secondary"),
        simulated="flight",
        typed="--primary {0}/primary.csv --secondary {0}/secondary_1.csv --secondary {0}/secondary_2.csv",
    ),
)
"""Procedures in the order of their presentation."""


def homes() -> Iterator[tuple[str, tuple[str, ...]]]:
    """Returns the modules from which the package has functions and results, with their names."""
    for each in PROCEDURES:
        yield f"{each.folder}.procedure", (each.word,)
        yield f"{each.folder}.result", (each.result,)
