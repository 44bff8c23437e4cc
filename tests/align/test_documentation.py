"""Statements of docs/how-to/align.md hold: options, messages, settings and the example."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

import tumble
from tumble.procedures.redundancy.settings import RedundancySettings

HOW_TO = (Path(__file__).parents[2] / "docs" / "how-to" / "align.md").read_text(encoding="utf-8")
PACKAGE = Path(tumble.__file__).parent


def test_the_settings_shown_are_settings_of_redundancy():
    (shown,) = re.findall(r"```yaml\n(.*?)```", HOW_TO, re.DOTALL)
    settings = RedundancySettings.model_validate(yaml.safe_load(shown))
    assert settings.units["imu2"].lever_arm[2] == -0.002
