"""The same from Python, without files: simulate, calibrate, correct readings, and check the result.

python examples/02_from_python.py
"""

from __future__ import annotations

import numpy as np

import tumble
from tumble.tools.simulate import simulate_turntable


def main() -> None:
    """Calibrates two targets in memory."""
    session = simulate_turntable(seed=7, grades=("industrial", "tactical"))
    targets = [unit.recording for unit in session.units[1:]]
    result = tumble.turntable(session["reference"].recording, targets, g_sensitivity=True)
    print(result)

    target = result["target_1"]
    calibration = result.calibration_of(target)
    print(calibration)

    # At rest a calibrated accelerometer reads the length of gravity in every pose.
    measured = np.array([rest.specific_force for rest in target.rests])
    corrected, _ = calibration.correct(measured, np.zeros_like(measured))
    before = np.abs(np.linalg.norm(measured, axis=1) - result.gravity).max()
    after = np.abs(np.linalg.norm(corrected, axis=1) - result.gravity).max()
    print(f"largest error of |f| at rest: {before:.4f} m/s^2 before, {after:.4f} after")
    assert after < before / 10, "the calibration made little difference"


if __name__ == "__main__":
    main()
