"""The C structs of settings, in Rust: made from the tables of settings and the defaults of the core."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rust_text import ROOT, rendered

from tumble import _core

SOURCES = ROOT / "crates" / "tumble-capi" / "src"
TEMPLATE = "settings_in_c.rs.jinja"

TYPES = {
    "time": "u64",
    "number": "f32",
    "threshold": "Threshold",
    "count": "u32",
    "choice": "MaybeUninit<{0}>",
    "flag": "MaybeUninit<bool>",
}
"""Larger fields stand before smaller ones, so that a struct has no holes."""
OF = {
    "choice": "MaybeUninit::new({0}::of({1}))",
    "flag": "MaybeUninit::new({1})",
    "threshold": "Threshold::of({1})",
}
IN_CORE = {"choice": "code({0})?.in_core()", "flag": "truth({0})", "threshold": "{0}.in_core()?"}


@dataclass(frozen=True, slots=True)
class Mirror:
    """A struct of C and the one of the core that it stands for."""

    table: _core.SettingTable
    path: Path
    struct: str
    core: str
    """Path of the core's struct."""
    about: str
    call: str
    """Fills it with defaults."""
    conversion: str
    """Documentation of the conversion to the core's type."""
    checked: bool
    """True if bounds are checked here, and not by the core."""
    imports: tuple[str, ...] = ()
    choices: bool = False
    graded: bool = False
    """True if defaults are those of a grade."""
    moved: dict[str, str] = field(default_factory=dict)
    """Fields that stand before others, not where the table has them: the layout stays as it was."""


MIRRORS = (
    Mirror(
        table="spin",
        path=SOURCES / "spin" / "settings.rs",
        struct="SpinSettings",
        core="tumble_core::spin::settings::SpinSettings",
        about="Settings of a spin. Fill it with tumble_spin_defaults(), or with "
        "tumble_spin_defaults_for_grade() for a unit of another grade than consumer, then change what is to "
        "be different.",
        call="tumble_spin_defaults",
        conversion="Converts them to the core's type, if they are within their bounds.",
        checked=True,
        imports=("grade::Grade",),
        graded=True,
    ),
    Mirror(
        table="redundancy",
        path=SOURCES / "redundancy" / "settings.rs",
        struct="RedundancySettings",
        core="tumble_core::redundancy::settings::RedundancySettings",
        about="Settings of the monitor of a redundant set. Fill it with "
        "tumble_redundancy_defaults(), then change what is to be different; names are those of the settings "
        "file that `tumble redundancy` reads on a workstation.",
        call="tumble_redundancy_defaults",
        conversion="Converts them to the core's type; the core checks them for contradictions.",
        checked=False,
        imports=("record::FitModel", "redundancy::choice::{Adoption, Data, Gate, Scope, Threshold}"),
        choices=True,
        moved={"window": "rest_settle", "gravity": "motion_specific_force"},
    ),
)


@dataclass(frozen=True, slots=True)
class Field:
    """A field of the struct, as the template writes it."""

    name: str
    path: str
    type: str
    about: str
    of: str
    in_core: str


def text_of(mirror: Mirror) -> str:
    """Returns the source file of a struct."""
    rows = _in_order(mirror)
    return rendered(TEMPLATE, mirror=mirror, fields=[_field(row) for row in rows], bounds=_bounds(rows))


def _in_order(mirror: Mirror) -> list[_core.SettingRow]:
    """Returns the rows in the order of the fields."""
    kinds = list(TYPES)
    rows = sorted(
        _core.setting_table(mirror.table),
        key=lambda row: kinds.index("number" if row["kind"] == "threshold" else row["kind"]),
    )
    for name, before in mirror.moved.items():
        row = next(row for row in rows if row["name"] == name)
        rows.remove(row)
        rows.insert(next(i for i, other in enumerate(rows) if other["name"] == before), row)
    return rows


def _field(row: _core.SettingRow) -> Field:
    name, kind, core = row["name"], row["kind"], f"core.{row['path']}"
    if row["none"]:
        of, in_core = f"{core}.unwrap_or_default()", f"unless_zero(self.{name})"
    else:
        of = OF.get(kind, "{1}").format(row["type"], core)
        in_core = IN_CORE.get(kind, "{0}").format(f"self.{name}")
    return Field(name, row["path"], TYPES[kind].format(row["type"]), _about(row), of, in_core)


def _about(row: _core.SettingRow) -> str:
    words = [row["meaning"], f"Default: {_default(row)}."]
    if row["more_than"]:
        longer = "Longer" if row["kind"] == "time" else "Larger"
        words.insert(1, f"{longer} than `{row['more_than']}`.")
    return " ".join(words)


def _default(row: _core.SettingRow) -> str:
    value, unit = row["default"], row["unit"]
    match row["kind"]:
        case "flag":
            return str(value).lower()
        case "choice":
            type_words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", str(row["type"]))
            return f"::TUMBLE_{type_words}_{value}".upper().replace(" ", "_")
        case "threshold":
            return f"fixed, {value} {unit}"
    figure = 0.0 if value is None else float(str(value))
    typed = f"{figure:.7g} {unit}"
    if row["kind"] == "time":
        typed = f"{round(figure * 1e6):,} microseconds".replace(",", " ")
    none = f", {row['none']}" if value is None else f"; 0: {row['none']}" if row["none"] else ""
    return typed.strip() + none


def _bounds(rows: Sequence[_core.SettingRow]) -> dict[str, object]:
    """Returns the fields within each bound; where there may be none, that is stated as 0."""
    above = [row for row in rows if row["above"] is not None and not row["none"]]
    numbers = [row for row in rows if row["kind"] == "number" and row not in above]
    least = [row for row in numbers if row["least"] is not None or row["none"]]
    return {
        "positive": _listed([row for row in above if row["kind"] == "number"]),
        "not_negative": _listed(least),
        "free": _listed([row for row in numbers if row not in least]),
        "times": _listed([row for row in above if row["kind"] == "time"]),
        "more_than": [(row["name"], row["more_than"]) for row in rows if row["more_than"]],
    }


def _listed(rows: Sequence[_core.SettingRow]) -> str:
    return ", ".join(f"self.{row['name']}" for row in rows)
