"""Statements of docs/how-to/live.md on live sources hold."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from live_fixtures import scripted
from tumble.live import parse_address, schemes
from tumble.live.rows import MOVING_NAMES
from tumble.logs.mavlink_messages import KINDS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "how-to" / "live.md").read_text(encoding="utf-8")
SOURCES = "".join(
    re.sub(r'"\s*\n\s*f?"', "", path.read_text(encoding="utf-8"))
    for path in sorted((ROOT / "python" / "tumble").rglob("*.py"))
)


def section(title):
    return re.split(r"^#+ ", PAGE.split(f"# {title}\n")[1], maxsplit=1, flags=re.MULTILINE)[0]


def test_every_address_it_shows_can_be_read():
    shown = re.findall(r"^\| ((?:`[^`]+`(?:, )?)+) \|", section("Sources"), re.MULTILINE)
    addresses = [address for cell in shown for address in re.findall(r"`([^`]+)`", cell)]
    assert {parse_address(address).scheme for address in addresses} == set(schemes())


def test_the_lines_it_shows_are_read():
    block = re.findall(r"(?:^ {4}\S.*\n)+", section("Lines of text"), re.MULTILINE)[0]
    names, *rows = [line.strip() for line in block.splitlines()]
    data = "\n".join([names, *rows * 12, ""]).encode()
    found = first_of(scripted([b"start\n" + data], rate=100.0))
    assert found.accelerometer[0] == pytest.approx(np.array([0.0132, -0.0071, 0.9987]) * 9.80665)
    assert found.gyroscope[0] == pytest.approx(np.radians([0.31, -0.12, 0.05]))


def test_the_objects_it_shows_are_read():
    lines = [line.strip() for line in section("JSON").splitlines() if line.startswith("    {")]
    assert len(lines) == 2
    for line in lines:
        found = first_of(scripted([json.dumps([json.loads(line)] * 24).encode()], whole=True, rate=100.0))
        assert found.accelerometer[0] == pytest.approx([0.13, -0.07, 9.79])
        assert found.gyroscope[0] == pytest.approx([0.005, -0.002, 0.001])


def first_of(source):
    with source:
        return next(chunk for chunk in source if len(chunk))


def test_names_it_gives_are_those_of_the_program():
    assert "'tumble-imu[live]'" in PAGE
    for kind in KINDS:
        assert f"`{kind}`" in PAGE
    for name in re.findall(r"`(\w+)`", section("The state of the wheels")):
        assert name in MOVING_NAMES


def test_events_it_names_are_those_of_the_program():
    from typing import get_args

    from tumble.procedures.spin.live import LiveStepKind

    told = set(re.findall(r"`([a-z ]+)`", section("From a program").split("follow them")[0]))
    assert told == {*get_args(LiveStepKind), "result", "failed"}


def test_python_it_shows_compiles():
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) == 4
    for block in blocks:
        compile(block, "live.md", "exec")
