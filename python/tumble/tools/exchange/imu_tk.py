"""imu_tk: `.calib` files of one triad each, `x = T K (y - B)` (Tedaldi, Pretto and Menegatti 2014).

T has a diagonal of ones, for the accelerometer upper triangular: the z axis of the frame is that of the
accelerometer. A file is three matrices as text, with blank lines between them (calibration.h of imu_tk).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.errors import CalibrationFileError, ProcedureError
from tumble.foundation.files import BY_TUMBLE, HEAD_OF_OURS, FileKind
from tumble.foundation.numbers import number_of
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS, Triad
from tumble.foundation.words import short
from tumble.tools.exchange.calibration_parts import BIAS, MATRIX, frame_losses, section_of
from tumble.tools.exchange.target import OWN_AXES, Content, Read, Settings, Target, Written

_NUMBERS = 9 + 9 + 3
_LEAST = 1e-3
"""Least share of the largest diagonal element by which a column can be divided."""


def write_accelerometer(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the accelerometer."""
    return _write(calibrations, "accelerometer")


def write_gyroscope(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the gyroscope, in the frame of the accelerometer."""
    return _write(calibrations, "gyroscope")


def _write(calibrations: Sequence[Calibration], triad: Triad) -> Written:
    (calibration,) = calibrations
    section = getattr(calibration, triad)
    if section is None:
        raise ProcedureError(f"{calibration.name}: has no {triad} section; export the other one")
    case_from_frame = _case_from_frame(calibration)
    matrix = case_from_frame.T @ np.linalg.inv(section.M)
    scale = np.diag(matrix)
    if np.abs(scale).min() < _LEAST * np.abs(scale).max():
        raise ProcedureError(
            f"{calibration.name}: an axis of the {triad} is turned by 90 deg against the accelerometer, and "
            "misalignment in a .calib file has ones on its diagonal; export to another format"
        )
    parts = (matrix / scale, np.diag(scale), section.b[:, np.newaxis])
    text = "\n\n".join("\n".join(" ".join(repr(float(v)) for v in row) for row in part) for part in parts)
    lost = [loss for loss in frame_losses(calibration, case_from_frame.T) if loss.triad == triad]
    # imu_tk reads 21 numbers and no further (CalibratedTriad_::load).
    return Written(f"{text}\n{HEAD_OF_OURS}\n", tuple(lost))


def _case_from_frame(calibration: Calibration) -> FloatArray:
    """Rotation Q with `M^-1 = Q U`, U upper triangular with a positive diagonal."""
    if calibration.accelerometer is None:
        return np.eye(3)
    rotation, upper = np.linalg.qr(np.linalg.inv(calibration.accelerometer.M))
    turned: FloatArray = rotation * np.sign(np.diag(upper))
    return turned


def _reader(triad: Triad) -> Read:
    def read(text: str) -> list[Content]:
        words = text.partition("#")[0].split()
        found = [number_of(word) for word in words]
        if None in found:
            stray = short(words[found.index(None)])
            raise CalibrationFileError(f"holds {stray}; a .calib file of imu_tk holds numbers alone")
        numbers = np.array(found, dtype=np.float64)
        if not np.isfinite(numbers).all():
            stray = short(words[int(np.argmin(np.isfinite(numbers)))])
            raise CalibrationFileError(f"holds {stray}; numbers of a .calib file are finite")
        if len(numbers) != _NUMBERS:
            raise CalibrationFileError(
                f"holds {len(numbers)} numbers; a .calib file of imu_tk holds {_NUMBERS}: T, K and B"
            )
        misalignment, scale = numbers[:9].reshape(3, 3), numbers[9:18].reshape(3, 3)
        return [{"name": "imu_tk", triad: section_of(triad, misalignment @ scale, numbers[18:])}]

    return read


_KIND = FileKind("a .calib file of imu_tk", re.compile(rb"\A\s*[-+0-9.eE]+\s"), BY_TUMBLE)
_SOURCE = "https://bitbucket.org/alberto_pretto/imu_tk"

IMU_TK_ACCELEROMETER = Target(
    word="imu-tk-accelerometer",
    title="imu_tk, accelerometer",
    ending=".calib",
    kind=_KIND,
    holds={"accelerometer": (*BIAS, *MATRIX)},
    leaves_out=TRIADS[1:],
    write=write_accelerometer,
    source=_SOURCE,
    axes=OWN_AXES,
    read=_reader("accelerometer"),
)
IMU_TK_GYROSCOPE = Target(
    word="imu-tk-gyroscope",
    title="imu_tk, gyroscope",
    ending=".calib",
    kind=_KIND,
    holds={"gyroscope": (*BIAS, *MATRIX)},
    leaves_out=TRIADS[:1],
    write=write_gyroscope,
    source=_SOURCE,
    axes=OWN_AXES,
    read=_reader("gyroscope"),
)
