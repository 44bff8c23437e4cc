"""Shared by formats: single precision, all powers of a polynomial, a line a parameter."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from tumble.calibration.temperature_drift import HIGHEST_ORDER
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.firmware.correction import Stored, Thermal
from tumble.foundation.firmware.magnetometers import StoredMagnetometer
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import UNITS, Triad
from tumble.foundation.words import short
from tumble.tools.exchange.magnetometers import section_of_stored
from tumble.tools.exchange.target import Content


def single(value: float) -> str:
    """Prints a number so that single precision reads it back exactly."""
    return f"{float(np.float32(value)):.9g}"


def c_float(value: float) -> str:
    """Prints a constant of single precision for C."""
    text = single(value)
    return f"{text}f" if any(sign in text for sign in ".e") else f"{text}.0f"


def yaml_number(value: float) -> str:
    """Prints a number so that it is read back exactly; YAML 1.1 takes 1e-05, without a point, for text."""
    digits, sign, exponent = repr(float(value)).partition("e")
    return f"{digits if '.' in digits else f'{digits}.0'}{sign}{exponent}" if sign else digits


def all_powers(coefficients: Sequence[FloatArray]) -> FloatArray:
    """Returns (3, 3) coefficients of powers 1 to 3, by axis; zero beyond those given."""
    powers = np.zeros((HIGHEST_ORDER, 3))
    powers[: len(coefficients)] = np.reshape(coefficients, (-1, 3))
    return powers


def stored_calibrations(
    imus: Mapping[str, Mapping[Triad, Stored]], magnetometers: Mapping[str, StoredMagnetometer]
) -> list[Content]:
    """Returns the calibrations of those IMUs, by name, of which firmware stores something.

    Autopilots do not state which IMU a magnetometer is beside: it goes to that of the same number.
    """
    return [
        _calibration(name, found, magnetometers.get(name))
        for name, found in imus.items()
        if found or name in magnetometers
    ]


def _calibration(
    name: str, found: Mapping[Triad, Stored], magnetometer: StoredMagnetometer | None
) -> Content:
    content: Content = {"name": name}
    for triad, each in found.items():
        if each.device:
            content.setdefault("serial", str(each.device))
        constant = 0.0 if each.thermal is None else each.thermal.constant
        section: Content = {
            "unit": UNITS[triad],
            "M": np.diag(1.0 / each.scale),
            "b": each.offset + constant,
        }
        content[triad] = section | _drift_section(each.thermal)
    if magnetometer is not None:
        if magnetometer.device:
            content.setdefault("serial", str(magnetometer.device))
        content["magnetometer"] = section_of_stored(magnetometer)
    return content


def _drift_section(thermal: Thermal | None) -> dict[str, object]:
    """Returns the section of a calibration file; nothing where firmware does not follow temperature."""
    if thermal is None:
        return {}
    bias = tuple(thermal.coefficients)
    return {
        "temperature_drift": {"reference": thermal.reference, "range": np.array(thermal.range), "bias": bias}
    }


def numbers_of(text: str, separator: str, name: int, value: int) -> dict[str, float]:
    """Reads a line a parameter: fields between separators, of which these are its name and its value.

    Raises `CalibrationFileError` with the line that is none.
    """
    found: dict[str, float] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        fields = re.split(separator, line.strip())
        if not line.strip() or line.startswith("#"):
            continue
        try:
            found[fields[name]] = float(fields[value])
        except (IndexError, ValueError):
            raise CalibrationFileError(f"line {number}: {short(line)} is no parameter") from None
    return found
