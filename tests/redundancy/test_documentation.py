"""Statements of docs/how-to/redundancy.md hold: options, settings, events and messages."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import tumble
from tumble._core import VOCABULARY
from tumble.foundation.setting_table import explain
from tumble.procedures.redundancy.monitor import settings_from
from tumble.procedures.redundancy.units import UnitSettings

ROOT = Path(__file__).parents[2]
HOW_TO = (ROOT / "docs" / "how-to" / "redundancy.md").read_text(encoding="utf-8")
EVENT_TEXT = (ROOT / "crates" / "tumble-lab" / "src" / "redundancy" / "event_text.rs").read_text(
    encoding="utf-8"
)
PACKAGE = Path(tumble.__file__).parent


def section(title):
    """Text under a heading, without its examples."""
    text = HOW_TO.split(f"## {title}\n")[1].split("\n## ")[0]
    return re.sub(r"```.*?```", "", text, flags=re.DOTALL)


def quoted(text):
    return set(re.findall(r"`([^`]+)`", text))


def test_the_settings_of_the_how_to_are_those_of_the_model():
    done = subprocess.run(
        [sys.executable, ROOT / "scripts" / "write_settings.py", "--check"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert {setting.name for setting in explain("redundancy")} <= quoted(section("Settings"))


def test_known_properties_of_a_unit_are_documented():
    assert set(UnitSettings.model_fields) <= quoted(section("Settings"))


def test_the_settings_file_of_the_how_to_is_one():
    text = re.search(r"```yaml\n(.*?)```", HOW_TO, re.DOTALL)[1]
    content = yaml.safe_load(text)
    # The alignment it names is not here.
    content["units"]["imu3"]["sensor_from_primary"] = [0.0, 0.0, 0.1]
    settings = settings_from(content)
    assert (settings.secondary_accelerometer_threshold, settings.evaluate_every) == ("last+0.05", None)


REASONED = (
    "withheld",
    "refused",
    "abandoned",
    "record rejected",
    "aiding left out",
    "unhealthy",
    "selected",
)
"""Events whose reasons are a kind of the vocabulary of their own."""

STORE = ("corrupt", "against another primary")
"""Why the store of a host, and not the monitor, rejects a record."""


def event_rows():
    """Events and their figures in the how-to."""
    rows = re.findall(r"^\| (`.*?) \| .*? ?\| (.*) \|$", section("Events"), re.MULTILINE)
    return {event: quoted(means) for events, means in rows for event in quoted(events)}


def test_the_events_of_the_how_to_are_those_of_the_monitor():
    assert event_rows().keys() == set(VOCABULARY["event"])


@pytest.mark.parametrize("event", REASONED)
def test_reasons_in_the_how_to_are_those_of_monitor_and_store(event):
    words = {*VOCABULARY[event], *(STORE if event == "record rejected" else ())}
    settings = {setting.name for setting in explain("redundancy")} - words
    assert event_rows()[event] - settings == words


def test_every_figure_of_an_event_is_documented():
    words = set(re.findall(r'\("([a-z][a-z_]+)",', EVENT_TEXT))
    assert len(words) > 12
    assert words - quoted(section("Events")) == set()


def test_the_files_of_the_store_are_named_as_the_how_to_names_them(tmp_path):
    from stored_errors import ONE, TWO, an_error
    from tumble.procedures.redundancy.store import ErrorStore

    ErrorStore(tmp_path, ONE).save(TWO, an_error())
    written = {path.name for path in tmp_path.iterdir()}
    assert written <= quoted(section("The store"))
