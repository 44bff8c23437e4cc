"""Laws of all tables of settings: models have the core's defaults, and refuse what is out of its bounds."""

from __future__ import annotations

import math

import pytest

from tumble import _core
from tumble.foundation.errors import ProcedureError
from tumble.foundation.setting_models import SpinSettings
from tumble.foundation.setting_table import explain
from tumble.procedures.redundancy.settings import RedundancySettings
from tumble.procedures.spin.settings import core_settings

UNITS = {"", "s", "m", "rad", "m/s^2", "rad/s", "1/s^2", "m/s^2/K", "rad/s/K"}


def changed_set(name, value):
    """Changes a setting of a set as it is typed."""
    spelt = {math.inf: ".inf", -math.inf: "-.inf"}.get(value, ".nan" if value != value else value)
    RedundancySettings().changed([f"{name}={spelt}"])


TABLES = {
    "redundancy": (RedundancySettings().by_name(), changed_set),
    "spin": (SpinSettings().model_dump(), lambda name, value: core_settings({name: value})),
}
"""Defaults of the model of each table, and what changes one of its settings."""
ROWS = [(table, row) for table in TABLES for row in _core.setting_table(table)]
KINDS = {"flag": ("sometimes", "3"), "choice": ("sometimes", "3"), "threshold": ("0", "last*1", ".nan")}
"""Values that no setting of a kind has; a number has bounds besides."""


def outside(row):
    """Values that a setting cannot have."""
    if row["kind"] in KINDS:
        return KINDS[row["kind"]]
    bounds = [row["above"], None if row["least"] is None else row["least"] - 1, row["below"]]
    return [*(bound for bound in bounds if bound is not None), math.inf, -math.inf, math.nan, "text"]


@pytest.mark.parametrize("table", TABLES)
def test_defaults_of_a_model_are_those_of_the_core(table):
    named = {row["name"]: row["default"] for row in _core.setting_table(table)}
    own = TABLES[table][0]
    assert own == {name: named[name] for name in own}
    assert all(named[name] is None for name in named.keys() - own.keys())


@pytest.mark.parametrize(
    ("table", "row"), ROWS, ids=lambda given: given if isinstance(given, str) else given["name"]
)
def test_setting_out_of_bounds_is_refused_in_one_line_by_name(table, row):
    for value in outside(row):
        with pytest.raises(ProcedureError) as refused:
            TABLES[table][1](row["name"], value)
        line = str(refused.value)
        assert f"{row['name']} needs " in line, line
        assert "found" in line
        assert "\n" not in line


@pytest.mark.parametrize("row", _core.setting_table("spin"), ids=lambda row: row["name"])
def test_the_core_refuses_settings_of_a_spin_by_name(row):
    for value in outside(row):
        if isinstance(value, float):
            with pytest.raises(ValueError, match=f"'{row['name']}'"):
                _core.SpinSettings({row["name"]: value})


@pytest.mark.parametrize("table", TABLES)
def test_every_setting_has_its_meaning_in_one_sentence_and_its_unit(table):
    for setting in explain(table):
        assert setting.meaning.endswith("."), setting.name
        assert setting.unit in UNITS, setting.name
