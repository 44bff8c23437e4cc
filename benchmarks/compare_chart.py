"""Draw `docs/images/compare.svg`: seven calibrations of a simulated unit over three years.

`python -m benchmarks.compare_chart`
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import tumble
from benchmarks.compare import calibrated, session, session_of
from tumble.calibration.document import Calibration
from tumble.report.svg import standalone_svg
from tumble.tools.compare.report.figures import history_sheet

CHART = Path(__file__).parent.parent / "docs" / "images" / "compare.svg"
DATES = ("2023-02-10", "2023-08-02", "2024-02-20", "2024-09-05", "2025-01-15", "2025-07-01", "2026-01-28")
RATE = np.array([4e-3, 0.0, -2e-3])
"""m/s^2 a year."""
SEED = 7


def main() -> None:
    """Simulates, calibrates, compares and draws."""
    unit = session(SEED)
    first = np.datetime64(DATES[0])
    calibrations = []
    for number, date in enumerate(DATES):
        years = (np.datetime64(date) - first) / np.timedelta64(1, "D") / 365.25
        found = calibrated(session_of(unit, SEED + 1 + number, RATE * years))
        calibrations.append(Calibration.model_validate(found.content() | {"date": date, "serial": "7"}))
    result = tumble.compare(calibrations)
    title = "Accelerometer of a simulated unit over three years of calibrations, with straight lines"
    sheet = history_sheet([each for each in result.history if each.name.startswith("accelerometer")])
    CHART.write_text(standalone_svg(sheet, title), encoding="utf-8")
    print(f"written to {CHART}")


if __name__ == "__main__":
    main()
