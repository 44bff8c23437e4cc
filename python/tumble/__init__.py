"""Tumble calibrates inertial measurement units over their whole life.

>>> import tumble
>>> result = tumble.turntable("reference.csv", ["target_1.csv", "target_2.csv"])  # doctest: +SKIP
>>> calibration = tumble.Calibration.load("target_1.yaml")  # doctest: +SKIP
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tumble._core import __version__
    from tumble.calibration import Calibration
    from tumble.errors import (
        CalibrationFileError,
        LogError,
        OutputError,
        ProcedureError,
        TumbleError,
    )
    from tumble.logs import ReadOptions, list_imus, open_recording, open_writer
    from tumble.poses import Pose, PoseList
    from tumble.procedures.align import align
    from tumble.procedures.apply import apply
    from tumble.procedures.inspect import inspect
    from tumble.procedures.limits import Limits
    from tumble.procedures.redundancy import redundancy
    from tumble.procedures.redundancy_settings import RedundancySettings
    from tumble.procedures.simulate import simulate_flight, simulate_spin, simulate_turntable
    from tumble.procedures.spin import spin
    from tumble.procedures.turntable import turntable
    from tumble.recording import Chunk, Recording
    from tumble.results import TargetResult, TurntableResult
    from tumble.results_align import AlignResult
    from tumble.results_redundancy import RedundancyResult
    from tumble.results_spin import SpinResult

__all__ = [
    "AlignResult",
    "Calibration",
    "CalibrationFileError",
    "Chunk",
    "Limits",
    "LogError",
    "OutputError",
    "Pose",
    "PoseList",
    "ProcedureError",
    "ReadOptions",
    "Recording",
    "RedundancyResult",
    "RedundancySettings",
    "SpinResult",
    "TargetResult",
    "TumbleError",
    "TurntableResult",
    "__version__",
    "align",
    "apply",
    "inspect",
    "list_imus",
    "open_recording",
    "open_writer",
    "redundancy",
    "simulate_flight",
    "simulate_spin",
    "simulate_turntable",
    "spin",
    "turntable",
]

_HOMES = {
    "tumble._core": ("__version__",),
    "tumble.calibration": ("Calibration",),
    "tumble.errors": ("CalibrationFileError", "LogError", "OutputError", "ProcedureError", "TumbleError"),
    "tumble.logs": ("ReadOptions", "list_imus", "open_recording", "open_writer"),
    "tumble.procedures.align": ("align",),
    "tumble.procedures.apply": ("apply",),
    "tumble.procedures.inspect": ("inspect",),
    "tumble.procedures.simulate": ("simulate_flight", "simulate_spin", "simulate_turntable"),
    "tumble.poses": ("Pose", "PoseList"),
    "tumble.procedures.limits": ("Limits",),
    "tumble.procedures.redundancy": ("redundancy",),
    "tumble.procedures.redundancy_settings": ("RedundancySettings",),
    "tumble.procedures.spin": ("spin",),
    "tumble.procedures.turntable": ("turntable",),
    "tumble.recording": ("Chunk", "Recording"),
    "tumble.results": ("TargetResult", "TurntableResult"),
    "tumble.results_align": ("AlignResult",),
    "tumble.results_redundancy": ("RedundancyResult",),
    "tumble.results_spin": ("SpinResult",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:  # noqa: ANN401
    """Import what is asked for, when it is: `tumble --help` need not wait for numpy and arrow."""
    if name not in _HOME:
        raise AttributeError(f"module 'tumble' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
