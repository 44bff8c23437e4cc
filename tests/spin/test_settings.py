"""Settings of a spin: defaults are the core's wherever they show, and what makes no sense is refused."""

from __future__ import annotations

import math
import re

import pytest

from tumble import _core
from tumble.foundation.setting_models import SpinSettings
from tumble.procedures.spin.live import LiveSpinOptions
from tumble.procedures.spin.settings import core_settings
from turntable_sessions import typed

TABLE = {row["name"]: row for row in _core.setting_table("spin")}


def test_defaults_of_a_live_spin_are_those_of_the_core():
    options = LiveSpinOptions()
    assert (options.still, options.rate) == (TABLE["still"]["default"], TABLE["rate"]["default"])
    assert options.turns * math.tau == TABLE["turn"]["default"]


def test_the_help_of_the_command_tells_the_defaults_of_the_core():
    text = re.sub(r"[│\s]+", " ", typed("spin", "--help").out)
    assert f"how long to stand still, {SpinSettings().still:g} s if not given" in text
    assert f"how much to turn, {SpinSettings().turn / math.tau:g} if not given" in text
    assert f"{SpinSettings().rate:g} rad/s if not given" in text


@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_settings_by_name_reach_the_machine(precision):
    settings = core_settings({"still": 7.5}, turns=1.5)
    progress = _core.SpinMachine(settings, precision).progress
    assert progress["still_wanted"] == 7.5
    assert progress["turned_wanted"] == 1.5 * math.tau
