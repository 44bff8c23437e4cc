"""Tumble calibrates inertial measurement units over their whole life.

>>> import tumble
>>> result = tumble.turntable("reference.csv", ["target_1.csv", "target_2.csv"])  # doctest: +SKIP
>>> calibration = tumble.Calibration.load("target_1.yaml")  # doctest: +SKIP
"""

from __future__ import annotations

TYPE_CHECKING = False  # typing takes longer to import than all else that is needed to heed Control-C
if TYPE_CHECKING:
    from tumble._core import __version__
    from tumble.calibration.document import Calibration
    from tumble.calibration.limits import Limits
    from tumble.foundation.errors import (
        CalibrationFileError,
        LogError,
        OutputError,
        ProcedureError,
        TumbleError,
    )
    from tumble.foundation.recording import Chunk, Recording
    from tumble.laboratory.registry import Registry
    from tumble.logs import ReadOptions, list_imus, open_recording, open_writer
    from tumble.logs.aiding import Aiding
    from tumble.poses.pose_list import Pose, PoseList
    from tumble.procedures.align.procedure import align
    from tumble.procedures.align.result import AlignResult
    from tumble.procedures.magnetometer.procedure import magnetometer
    from tumble.procedures.magnetometer.result import MagnetometerResult
    from tumble.procedures.multipose.procedure import multipose
    from tumble.procedures.multipose.result import MultiposeResult
    from tumble.procedures.noise.procedure import noise
    from tumble.procedures.noise.result import NoiseResult
    from tumble.procedures.redundancy.monitor import RedundancyMonitor
    from tumble.procedures.redundancy.procedure import redundancy
    from tumble.procedures.redundancy.result import RedundancyResult
    from tumble.procedures.redundancy.settings import RedundancySettings
    from tumble.procedures.spin.machine import SpinMachine
    from tumble.procedures.spin.procedure import spin
    from tumble.procedures.spin.result import SpinResult
    from tumble.procedures.thermal.procedure import thermal
    from tumble.procedures.thermal.result import ThermalResult
    from tumble.procedures.turntable.procedure import turntable
    from tumble.procedures.turntable.result import TargetResult, TurntableResult
    from tumble.tools.apply.procedure import apply
    from tumble.tools.compare.procedure import compare
    from tumble.tools.compare.result import CompareResult
    from tumble.tools.convert.procedure import convert
    from tumble.tools.exchange.procedure import export, import_calibrations
    from tumble.tools.inspect.procedure import inspect
    from tumble.tools.plateaus.procedure import plateaus
    from tumble.tools.plateaus.result import PlateausResult
    from tumble.tools.simulate import (
        simulate_flight,
        simulate_magnetometer,
        simulate_multipose,
        simulate_plateaus,
        simulate_spin,
        simulate_static,
        simulate_thermal,
        simulate_turntable,
    )

__all__ = [
    "Aiding",
    "AlignResult",
    "Calibration",
    "CalibrationFileError",
    "Chunk",
    "CompareResult",
    "Limits",
    "LogError",
    "MagnetometerResult",
    "MultiposeResult",
    "NoiseResult",
    "OutputError",
    "PlateausResult",
    "Pose",
    "PoseList",
    "ProcedureError",
    "ReadOptions",
    "Recording",
    "RedundancyMonitor",
    "RedundancyResult",
    "RedundancySettings",
    "Registry",
    "SpinMachine",
    "SpinResult",
    "TargetResult",
    "ThermalResult",
    "TumbleError",
    "TurntableResult",
    "__version__",
    "align",
    "apply",
    "compare",
    "convert",
    "export",
    "import_calibrations",
    "inspect",
    "list_imus",
    "magnetometer",
    "multipose",
    "noise",
    "open_recording",
    "open_writer",
    "plateaus",
    "redundancy",
    "simulate_flight",
    "simulate_magnetometer",
    "simulate_multipose",
    "simulate_plateaus",
    "simulate_spin",
    "simulate_static",
    "simulate_thermal",
    "simulate_turntable",
    "spin",
    "thermal",
    "turntable",
]


def _homes() -> dict[str, tuple[str, ...]]:
    # It takes longer to import than all else of the package, until which Control-C shows a traceback.
    from tumble.foundation.procedures import homes

    return {
        **dict(homes()),
        "tumble._core": ("__version__",),
        "tumble.calibration.document": ("Calibration",),
        "tumble.foundation.errors": (
            "CalibrationFileError",
            "LogError",
            "OutputError",
            "ProcedureError",
            "TumbleError",
        ),
        "tumble.logs": ("ReadOptions", "list_imus", "open_recording", "open_writer"),
        "tumble.tools.apply.procedure": ("apply",),
        "tumble.tools.compare.procedure": ("compare",),
        "tumble.tools.compare.result": ("CompareResult",),
        "tumble.tools.convert.procedure": ("convert",),
        "tumble.tools.exchange.procedure": ("export", "import_calibrations"),
        "tumble.tools.inspect.procedure": ("inspect",),
        "tumble.tools.plateaus.procedure": ("plateaus",),
        "tumble.tools.plateaus.result": ("PlateausResult",),
        "tumble.tools.simulate": (
            "simulate_flight",
            "simulate_magnetometer",
            "simulate_multipose",
            "simulate_plateaus",
            "simulate_spin",
            "simulate_static",
            "simulate_thermal",
            "simulate_turntable",
        ),
        "tumble.laboratory.registry": ("Registry",),
        "tumble.poses.pose_list": ("Pose", "PoseList"),
        "tumble.calibration.limits": ("Limits",),
        "tumble.procedures.redundancy.monitor": ("RedundancyMonitor",),
        "tumble.procedures.redundancy.settings": ("RedundancySettings",),
        "tumble.logs.aiding": ("Aiding",),
        "tumble.procedures.spin.machine": ("SpinMachine",),
        "tumble.foundation.recording": ("Chunk", "Recording"),
        "tumble.procedures.turntable.result": ("TargetResult", "TurntableResult"),
    }


def __getattr__(name: str) -> object:
    # Each module that is imported with the package delays the moment from which the command heeds Control-C.
    from tumble.foundation import lazy

    globals()["__getattr__"] = lazy.attributes(__name__, _homes)
    return globals()["__getattr__"](name)


def __dir__() -> list[str]:
    return __all__
