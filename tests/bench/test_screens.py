"""The comparison of screens names what a person would see, and nothing that fonts or numbers change."""

from __future__ import annotations

import copy
import io
import json

import pytest
from PIL import Image

from screens import IMAGES, SCREENS, moved, recoloured

NAMES = sorted(path.stem for path in SCREENS.glob("*.json"))


@pytest.fixture
def kept():
    return json.loads((SCREENS / "sources.json").read_text(encoding="utf-8"))


def test_each_screen_has_a_picture_in_the_manual():
    manual = (IMAGES.parent / "how-to" / "bench.md").read_text(encoding="utf-8")
    assert NAMES
    assert [name for name in NAMES if f"(../images/bench-{name}.png)" not in manual] == []
    assert [name for name in NAMES if not (IMAGES / f"bench-{name}.png").is_file()] == []


def test_other_fonts_and_numbers_change_nothing(kept):
    now = copy.deepcopy(kept)
    for each in now:
        x, y, width, height = each["box"]
        each["box"] = [x + 12, y + 20, 1.05 * width, height + 8]
    assert list(moved(kept, now)) == []


def test_parts_that_are_gone_new_or_elsewhere_are_named(kept):
    now = [each for each in copy.deepcopy(kept) if each["name"] != "Fleet"]
    heading = next(each for each in now if each["part"] == "title")
    heading["box"][0] += 300
    heading["text"] = "rgb(0, 0, 0) 12px"
    now.append({**heading, "name": "Oops"})
    found = sorted(moved(kept, now))
    assert [line.partition(":")[0] for line in found] == [
        "screen-link Fleet", "title Oops", "title Sources", "title Sources",
    ]  # fmt: skip


def test_a_picture_without_its_style_is_noticed():
    path = IMAGES / "bench-result.png"
    assert list(recoloured(path, path.read_bytes())) == []
    plain = io.BytesIO()
    Image.new("RGB", Image.open(path).size, "white").save(plain, "png")
    assert len(list(recoloured(path, plain.getvalue()))) == 1
