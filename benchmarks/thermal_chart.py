"""Draw `docs/images/thermal.svg`: what `tumble thermal` finds of a simulated gyroscope.

`python -m benchmarks.thermal_chart`
"""

from __future__ import annotations

from pathlib import Path

import tumble
from tumble.procedures.thermal.report.figures import drift_sheet
from tumble.report.svg import standalone_svg

CHART = Path(__file__).parent.parent / "docs" / "images" / "thermal.svg"


def main() -> None:
    """Simulates, estimates and draws."""
    session = tumble.simulate_thermal(seed=5, rate_hz=10.0, gyroscope_hysteresis=1e-3)
    result = tumble.thermal(session.recording)
    title = "Bias of a simulated gyroscope over temperature, warming and cooling, and the curves found"
    sheet = drift_sheet(result.of_triad("gyroscope"), result.blocks)
    CHART.write_text(standalone_svg(sheet, title), encoding="utf-8")
    print(f"written to {CHART}")


if __name__ == "__main__":
    main()
