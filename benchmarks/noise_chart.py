"""Draw `docs/images/noise.svg`: what `tumble noise` finds of a simulated gyroscope.

`python -m benchmarks.noise_chart`
"""

from __future__ import annotations

from pathlib import Path

import tumble
from tumble.foundation.noise_terms import BIAS_INSTABILITY, RANDOM_WALK, WHITE
from tumble.procedures.noise.report.figures import deviation_sheet
from tumble.report.svg import standalone_svg

CHART = Path(__file__).parent.parent / "docs" / "images" / "noise.svg"


def main() -> None:
    """Simulates, measures and draws."""
    static = tumble.simulate_static(
        seed=5,
        duration=10_800.0,
        rate_hz=10.0,
        gyroscope={WHITE: 1e-3, BIAS_INSTABILITY: 3e-4, RANDOM_WALK: 6e-5},
    )
    result = tumble.noise(static.recording)
    channels = [channel for channel in result if channel.triad == "gyroscope"]
    title = "Allan deviation of a simulated gyroscope, 95 % intervals, and the terms found"
    CHART.write_text(standalone_svg(deviation_sheet(channels), title), encoding="utf-8")
    print(f"written to {CHART}")


if __name__ == "__main__":
    main()
