"""Tumble calibrates inertial measurement units over their whole life.

>>> import tumble
>>> result = tumble.turntable("reference.csv", ["target_1.csv", "target_2.csv"])  # doctest: +SKIP
>>> calibration = tumble.Calibration.load("target_1.yaml")  # doctest: +SKIP
"""

from __future__ import annotations

import sys
from types import ModuleType

from tumble import lazy

TYPE_CHECKING = False  # typing takes longer to import than all else that is needed to heed Control-C
if TYPE_CHECKING:
    from tumble._core import __version__
    from tumble.align.procedure import align
    from tumble.align.result import AlignResult
    from tumble.apply.procedure import apply
    from tumble.calibration.document import Calibration
    from tumble.compare.procedure import compare
    from tumble.compare.result import CompareResult
    from tumble.convert.procedure import convert
    from tumble.errors import (
        CalibrationFileError,
        LogError,
        OutputError,
        ProcedureError,
        TumbleError,
    )
    from tumble.exchange.procedure import export, import_calibrations
    from tumble.inspect.procedure import inspect
    from tumble.logs import ReadOptions, list_imus, open_recording, open_writer
    from tumble.multipose.procedure import multipose
    from tumble.multipose.result import MultiposeResult
    from tumble.noise.procedure import noise
    from tumble.noise.result import NoiseResult
    from tumble.recording import Chunk, Recording
    from tumble.redundancy.monitor import RedundancyMonitor
    from tumble.redundancy.procedure import redundancy
    from tumble.redundancy.result import RedundancyResult
    from tumble.redundancy.settings import RedundancySettings
    from tumble.redundancy.witness import Witness
    from tumble.simulate import (
        simulate_flight,
        simulate_multipose,
        simulate_spin,
        simulate_static,
        simulate_thermal,
        simulate_turntable,
    )
    from tumble.spin.machine import SpinMachine
    from tumble.spin.procedure import spin
    from tumble.spin.result import SpinResult
    from tumble.thermal.procedure import thermal
    from tumble.thermal.result import ThermalResult
    from tumble.turntable.limits import Limits
    from tumble.turntable.poses import Pose, PoseList
    from tumble.turntable.procedure import turntable
    from tumble.turntable.result import TargetResult, TurntableResult

__all__ = [
    "AlignResult",
    "Calibration",
    "CalibrationFileError",
    "Chunk",
    "CompareResult",
    "Limits",
    "LogError",
    "MultiposeResult",
    "NoiseResult",
    "OutputError",
    "Pose",
    "PoseList",
    "ProcedureError",
    "ReadOptions",
    "Recording",
    "RedundancyMonitor",
    "RedundancyResult",
    "RedundancySettings",
    "SpinMachine",
    "SpinResult",
    "TargetResult",
    "ThermalResult",
    "TumbleError",
    "TurntableResult",
    "Witness",
    "__version__",
    "align",
    "apply",
    "compare",
    "convert",
    "export",
    "import_calibrations",
    "inspect",
    "list_imus",
    "multipose",
    "noise",
    "open_recording",
    "open_writer",
    "redundancy",
    "simulate_flight",
    "simulate_multipose",
    "simulate_spin",
    "simulate_static",
    "simulate_thermal",
    "simulate_turntable",
    "spin",
    "thermal",
    "turntable",
]

_HOMES = {
    "tumble._core": ("__version__",),
    "tumble.calibration.document": ("Calibration",),
    "tumble.errors": ("CalibrationFileError", "LogError", "OutputError", "ProcedureError", "TumbleError"),
    "tumble.logs": ("ReadOptions", "list_imus", "open_recording", "open_writer"),
    "tumble.align.procedure": ("align",),
    "tumble.apply.procedure": ("apply",),
    "tumble.compare.procedure": ("compare",),
    "tumble.compare.result": ("CompareResult",),
    "tumble.convert.procedure": ("convert",),
    "tumble.exchange.procedure": ("export", "import_calibrations"),
    "tumble.inspect.procedure": ("inspect",),
    "tumble.multipose.procedure": ("multipose",),
    "tumble.multipose.result": ("MultiposeResult",),
    "tumble.noise.procedure": ("noise",),
    "tumble.noise.result": ("NoiseResult",),
    "tumble.simulate": (
        "simulate_flight",
        "simulate_multipose",
        "simulate_spin",
        "simulate_static",
        "simulate_thermal",
        "simulate_turntable",
    ),
    "tumble.turntable.poses": ("Pose", "PoseList"),
    "tumble.turntable.limits": ("Limits",),
    "tumble.redundancy.procedure": ("redundancy",),
    "tumble.redundancy.monitor": ("RedundancyMonitor",),
    "tumble.redundancy.settings": ("RedundancySettings",),
    "tumble.redundancy.witness": ("Witness",),
    "tumble.spin.machine": ("SpinMachine",),
    "tumble.spin.procedure": ("spin",),
    "tumble.thermal.procedure": ("thermal",),
    "tumble.thermal.result": ("ThermalResult",),
    "tumble.turntable.procedure": ("turntable",),
    "tumble.recording": ("Chunk", "Recording"),
    "tumble.turntable.result": ("TargetResult", "TurntableResult"),
    "tumble.align.result": ("AlignResult",),
    "tumble.redundancy.result": ("RedundancyResult",),
    "tumble.spin.result": ("SpinResult",),
}
_NAMES = frozenset(name for names in _HOMES.values() for name in names)


class _Package(ModuleType):
    """A procedure is a function and a folder of one name; `tumble.spin` is the function.

    An import of `tumble.spin.result` binds the folder as `tumble.spin`, which would hide the function.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _NAMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


__getattr__ = lazy.attributes(__name__, _HOMES)


def __dir__() -> list[str]:
    return __all__
