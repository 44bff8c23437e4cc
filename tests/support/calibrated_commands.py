"""Commands that use a calibration with a log, as they are typed, and a log that all of them open."""

from __future__ import annotations

import numpy as np

CALIBRATED = {
    "spin": lambda log, other, known: (log, "--calibration", known),
    "multipose": lambda log, other, known: (log, "--calibration", known),
    "magnetometer": lambda log, other, known: (log, "--calibration", known),
    "noise": lambda log, other, known: (log, "--calibration", known),
    "thermal": lambda log, other, known: (log, "--calibration", known),
    "apply": lambda log, other, known: (known, log),
    "view": lambda log, other, known: (log, "--calibration", known, "--no-browser"),
    "turntable": lambda log, other, known: (log, other, "--reference-calibration", known),
    "redundancy": lambda log, other, known: (
        *("--primary", log, "--secondary", other, "--calibration", known),
    ),
}
"""Commands that use one calibration with a log of its unit, as they are typed."""
SEVERAL = {"noise": "logs", "thermal": "logs", "plateaus": "calibrations"}
"""Commands that take several logs or calibrations for those of one unit."""


def write_log(path, serial):
    random = np.random.default_rng(len(serial))
    count = 3000
    rows = np.column_stack(
        [
            np.arange(count) / 100.0,
            random.normal([0.0, 0.0, 9.8], 0.02, (count, 3)),
            random.normal(0.0, 0.002, (count, 3)),
            random.normal([20.0, 5.0, -40.0], 0.1, (count, 3)),
            np.full(count, 25.0),
        ]
    )
    head = f"# serial: {serial}\ntime,ax,ay,az,gx,gy,gz,mx,my,mz,temperature"
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.9g")
    return path
