"""Calibration files of earlier versions."""

from __future__ import annotations

from tumble.calibration.document import Calibration

VERSION_1 = """\
schema: tumble-calibration/1
name: reference
accelerometer:
  unit: m/s^2
  M:
  - [1, 0, 0]
  - [0, 1, 0]
  - [0, 0, 1]
  b: [1e-3, 0, -2]
  noise_density: [null, 1e-3, 1e-3]
"""
VERSION_2 = (
    VERSION_1.replace("/1", "/2")
    + """\
  temperature_drift:
    reference: 25.0
    range: [-20.0, 70.0]
    bias:
    - [1.0e-3, 0.0, -2.0e-3]
    - [0.0, 1.0e-5, 0.0]
    scale:
    - [1.0e-5, -2.0e-5, 0.0]
    bias_sigma:
    - [1.0e-5, 1.0e-5, 1.0e-5]
    - [1.0e-6, 1.0e-6, null]
    hysteresis: [1.0e-3, null, 2.0e-3]
"""
)


def load(folder, text):
    path = folder / "unit.yaml"
    path.write_text(text)
    return Calibration.load(path)
