"""Read what Kalibr, OpenVINS and ROS 2 keep in YAML: chains of IMUs, noise, and parameters of nodes.

Formulas are those that `kalibr`, `openvins` and `robots` write by. Neither chain has a field for biases.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import yaml

from tumble.foundation.bounded_yaml import parse, problem_in_words
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.magnetic import LoadUnit
from tumble.foundation.noise_terms import KALIBR as NOISE_NAMES
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CALIBRATED_TRIADS, FIELD_UNITS, TRIADS, UNITS, Triad
from tumble.foundation.words import short
from tumble.tools.exchange.calibration_parts import section_of
from tumble.tools.exchange.target import Content

KALIBR_MODELS = ("calibrated", "scale-misalignment", "scale-misalignment-size-effect")
OPENVINS_MODELS = ("calibrated", "kalibr", "rpng")
_IDEAL = np.eye(3)
TESLA = FIELD_UNITS["T"]
"""uT in the unit of messages of ROS."""
MAGNETIC_LOADS: Mapping[LoadUnit, str] = {"A": "magnetometer_current", "1": "magnetometer_throttle"}
"""Parameters for the effect of current on a magnetometer, by the unit of the current."""


def read_kalibr(text: str) -> list[Content]:
    """Reads the IMUs of a chain, `imu.yaml` of Kalibr's results among them: `w_m = M C w + A C a`."""
    return [_kalibr(name, imu) for name, imu in _chain(text)]


def read_openvins(text: str) -> list[Content]:
    """Reads the IMUs of a chain of OpenVINS, whose matrices correct: `Tw = D^-1`, `Tg` of corrected force."""
    return [_openvins(name, imu) for name, imu in _chain(text.partition("\n")[2])]


def read_noise(text: str) -> list[Content]:
    """Reads noise alone, as `imu.yaml` gives it to Kalibr."""
    stated, content = _mapping(_yaml(text), "the file"), Content(name="imu")
    for triad in TRIADS:
        if noise := _noise(stated, triad):
            content[triad] = {"unit": UNITS[triad], "M": _IDEAL, "b": np.zeros(3)} | noise
    return [content] if len(content) > 1 else []


def read_autoware(text: str) -> list[Content]:
    """Reads the offset that Autoware subtracts of angular velocity."""
    stated = _parameters(text)
    names = [f"angular_velocity_offset_{axis}" for axis in "xyz"]
    bias = _numbers([stated.get(name) for name in names], "angular_velocity_offset_x, y and z", (3,))
    return [{"name": "imu", "gyroscope": section_of("gyroscope", _IDEAL, bias)}]


def read_ros2(text: str) -> list[Content]:
    """Reads corrections and biases as Tumble writes them for a node of one's own."""
    stated, content = _parameters(text), Content(name="imu")
    for triad in CALIBRATED_TRIADS:
        if f"{triad}_correction" in stated:
            correction = _numbers(stated[f"{triad}_correction"], f"{triad}_correction", (9,)).reshape(3, 3)
            bias = _numbers(stated.get(f"{triad}_bias"), f"{triad}_bias", (3,))
            content[triad] = section_of(triad, correction, bias * (TESLA if triad == "magnetometer" else 1.0))
    for unit, name in MAGNETIC_LOADS.items():
        if name in stated and "magnetometer" in content:
            effect = {"current": TESLA * _numbers(stated[name], name, (3,)), "current_unit": unit}
            content["magnetometer"] = {**_mapping(content["magnetometer"], ""), **effect}
    response = _numbers(stated.get("gyroscope_g_sensitivity", [0.0] * 9), "gyroscope_g_sensitivity", (9,))
    if response.any() and "gyroscope" in content:
        content["gyroscope"] = {**_mapping(content["gyroscope"], ""), "g_sensitivity": response.reshape(3, 3)}
    return [content] if len(content) > 1 else []


def _kalibr(name: str, imu: Mapping[str, Any]) -> Content:
    model = imu.get("model", KALIBR_MODELS[0])
    if model not in KALIBR_MODELS:
        raise CalibrationFileError(f"{name}: model {short(model)} is none of {', '.join(KALIBR_MODELS)}")
    if model == KALIBR_MODELS[0]:
        return _content(name, imu, _IDEAL, _IDEAL, np.zeros((3, 3)))
    gyroscopes = _mapping(imu.get("gyroscopes"), f"{name}: gyroscopes")
    force = _matrix(_mapping(imu.get("accelerometers"), f"{name}: accelerometers"), "M", name)
    matrix, response, turned = (_matrix(gyroscopes, key, name) for key in ("M", "A", "C_gyro_i"))
    return _content(name, imu, force, matrix @ turned, response @ turned)


def _openvins(name: str, imu: Mapping[str, Any]) -> Content:
    model = imu.get("model", OPENVINS_MODELS[0])
    if model not in OPENVINS_MODELS:
        raise CalibrationFileError(f"{name}: model {short(model)} is none of {', '.join(OPENVINS_MODELS)}")
    keys = ("Tw", "R_IMUtoGYRO", "Ta", "R_IMUtoACC", "Tg")
    if not any(key in imu for key in keys):
        return _content(name, imu, _IDEAL, _IDEAL, np.zeros((3, 3)))
    Tw, to_gyroscope, Ta, to_accelerometer, Tg = (_matrix(imu, key, name) for key in keys)
    return _content(name, imu, Ta @ to_accelerometer, Tw @ to_gyroscope, Tg)


def _content(
    name: str, imu: Mapping[str, Any], force: FloatArray, rate: FloatArray, response: FloatArray
) -> Content:
    """Puts together forward matrices (3, 3) of both triads and a g-sensitivity."""
    content: Content = {"name": name}
    for triad, matrix in zip(TRIADS, (force, rate), strict=True):
        content[triad] = {"unit": UNITS[triad], "M": matrix, "b": np.zeros(3)} | _noise(imu, triad)
    if response.any():
        content[TRIADS[1]] = {**_mapping(content[TRIADS[1]], name), "g_sensitivity": response}
    return content


def _noise(stated: Mapping[str, Any], triad: Triad) -> dict[str, FloatArray]:
    """Returns noise density and random walk, alike for all axes, as far as they are stated."""
    keys = zip(("noise_density", "random_walk"), NOISE_NAMES[triad], strict=True)
    return {key: np.full(3, _numbers(stated[name], name, ())) for key, name in keys if name in stated}


def _chain(text: str) -> list[tuple[str, Mapping[str, Any]]]:
    stated = _mapping(_yaml(text), "the file")
    found = [(name, _mapping(imu, name)) for name, imu in stated.items() if str(name).startswith("imu")]
    if not found and any(str(name).startswith("cam") for name in stated):
        raise CalibrationFileError(
            "is a chain of cameras, and says nothing of an IMU; give the results' imu.yaml"
        )
    return found


def _parameters(text: str) -> Mapping[str, Any]:
    """Finds the parameters of the first node."""
    for node in _mapping(_yaml(text), "the file").values():
        if isinstance(node, Mapping) and "ros__parameters" in node:
            return _mapping(node["ros__parameters"], "ros__parameters")
    raise CalibrationFileError("holds no ros__parameters")


def _yaml(text: str) -> Any:  # noqa: ANN401 - what YAML holds
    try:
        return parse(text)[1]
    except yaml.YAMLError as error:
        raise CalibrationFileError(f"{problem_in_words(error)}; correct the YAML there") from None


def _mapping(stated: object, what: str) -> Mapping[str, Any]:
    if not isinstance(stated, Mapping):
        raise CalibrationFileError(f"{what} holds {short(stated)} where keys are needed")
    return stated


def _matrix(stated: Mapping[str, Any], key: str, name: str) -> FloatArray:
    if key not in stated:
        raise CalibrationFileError(f"{name}: has no {key}; all matrices of its model are needed")
    return _numbers(stated[key], f"{name}: {key}", (3, 3))


def _numbers(stated: object, what: str, shape: tuple[int, ...]) -> FloatArray:
    try:
        # YAML 1.1 takes 1e-05 for text, and Kalibr writes such.
        numbers = np.array(stated, dtype=np.float64)
    except (TypeError, ValueError):
        raise CalibrationFileError(f"{what} is {short(stated)}, no {_words(shape)}") from None
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise CalibrationFileError(f"{what} is {short(stated)}, no {_words(shape)}")
    return numbers


def _words(shape: tuple[int, ...]) -> str:
    return f"{'x'.join(map(str, shape))} numbers" if shape else "number"
