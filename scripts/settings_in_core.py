"""The bounds that the core holds settings to, in Rust: made from the table of settings."""

from __future__ import annotations

from collections.abc import Sequence

from rust_text import ROOT, rendered

from tumble import _core

PATH = ROOT / "crates" / "tumble-core" / "src" / "redundancy" / "settings" / "bounds.rs"
TEMPLATE = "settings_in_core.rs.jinja"


def bounds() -> str:
    """Returns the source file. A setting without bounds needs none here."""
    rows = _core.setting_table("redundancy")
    by_name = {row["name"]: row for row in rows}
    numbers = [row for row in rows if row["kind"] == "number"]
    whole = [row for row in rows if row["kind"] in ("time", "count") and not row["none"]]
    pairs = [(row, by_name[row["more_than"]]) for row in rows if row["more_than"]]
    shares = [row for row in numbers if row["below"] is not None]
    positive = [row for row in numbers if row["above"] is not None]
    _all_have_an_error(numbers, [*positive, *shares])
    return rendered(
        TEMPLATE,
        positive=positive,
        above_one=[row for row in positive if row["above"] == 1.0],
        shares=shares,
        whole=[row for row in whole if row["above"] is not None or row["least"] == 1.0],
        larger=[pair for pair in pairs if pair[0]["kind"] == "number"],
        longer=[pair for pair in pairs if pair[0]["kind"] == "time"],
    )


def _all_have_an_error(numbers: Sequence[_core.SettingRow], looked_at: Sequence[_core.SettingRow]) -> None:
    """Refuses a bound for which the core has no `SettingError`: it would not be held to it."""
    for row in numbers:
        if row not in looked_at:
            raise ValueError(f"{row['name']}: the core has no SettingError for its bound; give it one first")
