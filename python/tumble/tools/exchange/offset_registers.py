"""Offset registers of sensors on boards: a file for an Arduino sketch that writes the biases into the chip.

A chip adds whole steps to its readings, or subtracts them. Registers keep them until the power goes, so that
the sketch writes them at each start. Numbers are those of the makers:

- MPU-6050, MPU-6500, MPU-9250: InvenSense, "MPU Hardware Offset Registers Application Note", revision 1.2.
- BMI160, BMI270: Bosch Sensortec, BMI160_SensorAPI (bmi160_set_offsets) and BMI270_SensorAPI (bmi2.c).
- LSM6DSO: STMicroelectronics, DS12140, X_OFS_USR, and lsm6dso-pid.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError
from tumble.foundation.files import FileKind
from tumble.foundation.log_reading import turns
from tumble.foundation.units import UNITS, Triad
from tumble.tools.exchange.arduino import Add, Operation, Put, sketch
from tumble.tools.exchange.calibration_parts import BIAS, Loss
from tumble.tools.exchange.remark_lines import c_comment
from tumble.tools.exchange.target import Settings, Target, Written

_DEGREE = float(np.radians(1.0))


@dataclass(frozen=True, slots=True)
class _Offsets:
    """Offsets of a triad in a chip."""

    step: float
    """One count, m/s^2 or rad/s; negative where the chip subtracts."""
    largest: int
    """Largest count in either direction."""


@dataclass(frozen=True, slots=True)
class _Trims:
    """Words at three places, high byte first, that hold the trim of the factory in all bits but the last."""

    places: tuple[int, int, int]

    def operations(self, counts: Sequence[int]) -> Iterator[Operation]:
        for place, count in zip(self.places, counts, strict=True):
            yield Add(place, 2 * count)


@dataclass(frozen=True, slots=True)
class _Words:
    """Words side by side, high byte first."""

    first: int

    def operations(self, counts: Sequence[int]) -> Iterator[Operation]:
        for place, count in enumerate(counts):
            high, low = (count & 0xFFFF).to_bytes(2, "big")
            yield Put(self.first + 2 * place, high)
            yield Put(self.first + 2 * place + 1, low)


@dataclass(frozen=True, slots=True)
class _Bytes:
    """Bytes side by side, and bits elsewhere that make them count."""

    first: int
    enable: tuple[Put, ...]

    def operations(self, counts: Sequence[int]) -> Iterator[Operation]:
        for place, count in enumerate(counts):
            yield Put(self.first + place, count & 0xFF)
        yield from self.enable


@dataclass(frozen=True, slots=True)
class _TenBits:
    """Bytes side by side; behind them two upper bits of each, the first lowest, and the bit that enables."""

    first: int
    enable: int

    def operations(self, counts: Sequence[int]) -> Iterator[Operation]:
        for place, count in enumerate(counts):
            yield Put(self.first + place, count & 0xFF)
        upper = sum((count >> 8 & 0x3) << 2 * place for place, count in enumerate(counts))
        yield Put(self.first + 3, self.enable | upper, self.enable | 0x3F)


_Layout: TypeAlias = _Trims | _Words | _Bytes | _TenBits


@dataclass(frozen=True, slots=True)
class _Chip:
    """Offset registers of a chip."""

    name: str
    source: str
    """Source of its registers."""
    address: int
    """Its address on the bus, with the address pin low."""
    triads: Mapping[Triad, tuple[_Offsets, _Layout]]
    reset: tuple[Operation, ...] = ()
    """Operations that take it back to the state after power on, where it adds to its own registers."""

    def write(self, calibrations: Sequence[Calibration], settings: Settings) -> Written:
        """Writes the file of one IMU.

        Raises `ProcedureError` where it has no bias of a triad that the chip holds, one that is too large, or
        was found from a log that was turned.
        """
        (calibration,) = calibrations
        if turned := turns(calibration.log_reading):
            raise ProcedureError(
                f"{calibration.name}: was found from a log read with {turned}, so that it is not in "
                f"the axes of {self.name}; calibrate from the log as the chip reads"
            )
        counts = {triad: self._counts(calibration, triad) for triad in self.triads}
        operations = [
            operation
            for triad, (_, layout) in self.triads.items()
            for operation in layout.operations([int(count) for count in np.rint(counts[triad])])
        ]
        title = f"Offset registers of {self.name} for {c_comment(calibration.name)}, by Tumble"
        lost = [self._rounding(calibration, triad, exact) for triad, exact in counts.items()]
        return Written(sketch(title, self.address, operations, self.reset), tuple(lost))

    def _counts(self, calibration: Calibration, triad: Triad) -> np.ndarray:
        """Returns what removes the bias, (3,), before it is rounded to whole counts."""
        section = getattr(calibration, triad)
        if section is None:
            raise ProcedureError(
                f"{calibration.name}: has no {triad} section, which {self.name} has registers for"
            )
        offsets, _ = self.triads[triad]
        exact: np.ndarray = -section.b / offsets.step
        if np.abs(exact).max() > offsets.largest:
            most = abs(offsets.step) * offsets.largest
            raise ProcedureError(
                f"{calibration.name}: the {triad} has a bias of {np.abs(section.b).max():.3g} "
                f"{UNITS[triad]}, and {self.name} takes {most:.3g} at most; check the unit of the readings"
            )
        return exact

    def _rounding(self, calibration: Calibration, triad: Triad, exact: np.ndarray) -> Loss:
        size = abs(self.triads[triad][0].step) * float(np.abs(exact - np.rint(exact)).max())
        return Loss(calibration.name, triad, "rounding to counts", size)


_MPU_RATES = (_Offsets(_DEGREE / 32.8, 2**15 - 1), _Words(0x13))
_MPU_FORCES = _Offsets(STANDARD_GRAVITY / 1024.0, 2**14 - 1)
# Back to the trims of the factory, which a second start would otherwise add to again; then awake.
_MPU_RESET = (Put(0x6B, 0x80, wait_ms=100), Put(0x6B, 0x00, wait_ms=10))
_BMI_FORCES = _Offsets(STANDARD_GRAVITY / 256.0, 127)
_LSM_FORCES = _Offsets(-STANDARD_GRAVITY / 1024.0, 127)
_BMI_RATES = _Offsets(2000.0 * _DEGREE / 2**15, 511)

_APPLICATION_NOTE = "https://github.com/kriswiner/MPU9250/tree/master/Documents"

_CHIPS = {
    "registers-mpu6050": _Chip(
        "MPU-6050",
        _APPLICATION_NOTE,
        0x68,
        {"accelerometer": (_MPU_FORCES, _Trims((0x06, 0x08, 0x0A))), "gyroscope": _MPU_RATES},
        _MPU_RESET,
    ),
    "registers-mpu9250": _Chip(
        "MPU-6500, MPU-9250",
        _APPLICATION_NOTE,
        0x68,
        {"accelerometer": (_MPU_FORCES, _Trims((0x77, 0x7A, 0x7D))), "gyroscope": _MPU_RATES},
        _MPU_RESET,
    ),
    "registers-bmi160": _Chip(
        "BMI160",
        "https://github.com/boschsensortec/BMI160_SensorAPI",
        0x68,
        {
            "accelerometer": (_BMI_FORCES, _Bytes(0x71, (Put(0x77, 0x40, 0x40),))),
            "gyroscope": (_BMI_RATES, _TenBits(0x74, 0x80)),
        },
    ),
    "registers-bmi270": _Chip(
        "BMI270",
        "https://github.com/boschsensortec/BMI270_SensorAPI",
        0x68,
        {
            "accelerometer": (_BMI_FORCES, _Bytes(0x71, (Put(0x70, 0x08, 0x08),))),
            "gyroscope": (_BMI_RATES, _TenBits(0x74, 0x40)),
        },
    ),
    "registers-lsm6dso": _Chip(
        "LSM6DSO",
        "https://github.com/STMicroelectronics/lsm6dso-pid",
        0x6A,
        # Steps of 2^-10 g, and the offsets on.
        {"accelerometer": (_LSM_FORCES, _Bytes(0x73, (Put(0x15, 0x00, 0x08), Put(0x16, 0x02, 0x02))))},
    ),
}
REGISTERS = tuple(
    Target(
        word=word,
        title=f"offset registers of {chip.name}, for an Arduino sketch",
        ending=".h",
        kind=FileKind(
            "offset registers for a sketch, as Tumble writes them", re.compile(rb"\A// Offset registers of ")
        ),
        holds=dict.fromkeys(chip.triads, BIAS),
        write=chip.write,
        source=chip.source,
        axes="those of the chip itself, as it was read; nothing is turned",
        remarks=(
            "it corrects readings of a chip whose offset registers are as after power on, as those that were "
            "calibrated have to be",
        ),
    )
    for word, chip in _CHIPS.items()
)
