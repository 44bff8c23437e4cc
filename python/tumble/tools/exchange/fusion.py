"""Fusion of x-io Technologies: C constants for `FusionModelInertial`, once `FusionCalibrationInertial`.

Either corrects `M ((y - b) * s)`, in g and deg/s (FusionModel.h). M is the whole correction, so that s only
changes the unit: readings in m/s^2 and rad/s go in.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.files import FileKind
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.calibration_parts import BIAS, MATRIX
from tumble.tools.exchange.parameters import c_float
from tumble.tools.exchange.remark_lines import c_comment
from tumble.tools.exchange.target import AS_CALIBRATED, Settings, Target, Written

UNITS_OF_SI = {"accelerometer": 1.0 / STANDARD_GRAVITY, "gyroscope": float(np.degrees(1.0))}
"""g and deg/s that are 1 m/s^2 and 1 rad/s."""


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the constants of one IMU."""
    (calibration,) = calibrations
    lines = [
        f"// Calibration of {c_comment(calibration.name)} by Tumble. FusionModelInertial, in older versions",
        "// FusionCalibrationInertial, takes readings in m/s^2 and rad/s and gives g and deg/s.",
    ]
    for triad in TRIADS:
        section = getattr(calibration, triad)
        matrix = np.eye(3) if section is None else np.linalg.inv(section.M)
        offset = np.zeros(3) if section is None else section.b
        elements = ", ".join(map(c_float, matrix.ravel()))
        lines += [
            f"static const FusionMatrix {triad}Misalignment = {{.array = {{{elements}}}}};",
            _vector(f"{triad}Sensitivity", np.full(3, UNITS_OF_SI[triad])),
            _vector(f"{triad}Offset", offset),
        ]
    return Written("\n".join(lines) + "\n")


def _vector(name: str, values: FloatArray) -> str:
    elements = ", ".join(map(c_float, values))
    return f"static const FusionVector {name} = {{.array = {{{elements}}}}};"


FUSION = Target(
    word="fusion",
    title="Fusion of x-io Technologies, constants in C",
    ending=".h",
    kind=FileKind("constants of Fusion, as Tumble writes them", re.compile(rb"\A// Calibration of ")),
    holds=dict.fromkeys(TRIADS, (*BIAS, *MATRIX)),
    write=write,
    source="https://github.com/xioTechnologies/Fusion#inertial-model",
    axes=f"{AS_CALIBRATED}; FusionRemap turns into those of the body afterwards",
)
