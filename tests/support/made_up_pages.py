"""Pages of made-up results, one for each state in which a page shows something of its own."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import report_fixtures as sessions
import report_redundancy_cases as missions
import report_spin_cases as spins
from align_motions import Motion, Sensor, drawn, recordings
from tumble.procedures.align.procedure import align
from tumble.procedures.align.report.page import ALIGN_REPORT
from tumble.procedures.redundancy.report.page import REDUNDANCY_REPORT
from tumble.procedures.spin.report.page import SPIN_REPORT
from tumble.procedures.turntable.report.pages import records_of, render_batch, render_target


def aligned(seed=71):
    """An alignment of two units that moved every way."""
    units = recordings(Motion(seed), (Sensor(rate_hz=100.0), drawn(seed, rate_hz=100.0)), 30.0)
    return align(units[0], units[1:])


SPINS = {
    "spin": spins.session,
    "spin of several": spins.several,
    "spin too short": lambda: spins.session(spins.short_spin()),
    "spin not observable": spins.unobserved,
}
MISSIONS = {
    f"redundancy {name}": getattr(missions, name)
    for name in ("mission", "quiet", "untriggered", "missing", "unfit", "disputed", "everything", "unseen")
}
RESULTS = {
    **{name: (SPIN_REPORT, make) for name, make in SPINS.items()},
    **{name: (REDUNDANCY_REPORT, make) for name, make in MISSIONS.items()},
    "align": (ALIGN_REPORT, aligned),
}
"""Page and result of every procedure that has one page, by name."""


def _batch():
    batch = sessions.batch()
    return render_batch(batch, records_of(batch))


def _target(place):
    batch = sessions.batch()
    return render_target(batch, batch.targets[place])


PAGES = {
    "turntable": _batch,
    **{f"target {place + 1}": partial(_target, place) for place in range(5)},
    **{name: lambda page=page, make=make: page.render(make()) for name, (page, make) in RESULTS.items()},
}
"""Text of every page, by name."""


def write_pages(folder: Path) -> None:
    """Writes every page to a file of its name."""
    for name, rendered in PAGES.items():
        (folder / f"{name}.html").write_text(rendered(), encoding="utf-8")
