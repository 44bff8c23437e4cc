"""A robot turns on the spot on a floor that is not level: its log, its calibration, and the error of that.

python examples/03_spin.py [FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import tumble
from tumble.tools.simulate import write_spin


def main(folder: Path) -> None:
    """Simulates, calibrates, and compares the result with the truth."""
    simulated = tumble.simulate_spin(seed=7, floor_tilt_deg=2.0, unevenness=0.2)
    log = write_spin(simulated, folder)["log"]

    result = tumble.spin(log)
    print(result)
    result.calibration.save(folder / "spin.yaml")

    errors = {
        "level-free": result.spins[0].level_free.value - simulated.accelerometer_bias,
        "published": result.spins[0].published.value - simulated.accelerometer_bias,
    }
    for method, error in errors.items():
        print(f"error of the accelerometer bias, {method}: {1e3 * np.linalg.norm(error):.1f} mm/s^2")
    assert np.linalg.norm(errors["level-free"]) < 0.02 * np.linalg.norm(errors["published"])


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "spin"))
