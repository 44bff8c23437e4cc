"""Screens as they were looked at last: a picture of each in docs/images, and the boxes of its parts.

With TUMBLE_PICTURES in the environment both are written anew; a person then looks at them, as at any change.
Fonts and graphics differ between machines, and runs between moments: boxes are compared within tolerances,
and pictures by the mean colours of squares, so that only what a person would see counts.
"""

from __future__ import annotations

import io
import json
import os
from pathlib import Path

import numpy as np
from PIL import Image

from bench_pages import await_rest

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs" / "images"
SCREENS = ROOT / "tests" / "bench" / "screens"
WIDTH, HEIGHT = 1400, 900
SQUARE = 100
"""px of a square whose mean colour is compared."""
FAR_COLOUR, MOST_FAR = 28.0, 0.15
"""Difference of a mean colour, of 255, that can be seen, and the share of squares that may have it."""
FAR_X, FAR_Y, FAR_HEIGHT = 90.0, 90.0, 60.0
"""px that a part may be moved, or be higher, as fonts and numbers of a run differ."""
SHADES = 96
"""Colours of a picture that is kept."""
_PARTS = """() => {
  const named = "h1:not(.instruction), h2, .screen-link, .button, th[scope=col]";
  const unnamed = ".instruction, .verdict, .verdict-word, .panel, .kind, .source, .tile, " +
    ".goal, .lamp-row, .body, .sphere, .plot, .unit-row, .job-row, .unit-tile, .events, " +
    ".stop-bar.shown, .tumble-plot, input, select";
  const parts = [];
  for (const element of document.querySelectorAll(`.head, ${named}, ${unnamed}`)) {
    const box = element.getBoundingClientRect();
    if (!element.checkVisibility() || box.width === 0 || box.top > 900) continue;
    const style = getComputedStyle(element);
    const name = element.matches(named) && !element.matches(".kind, .unit-row, .job-row, .unit-tile")
      ? element.innerText.trim().replace(/[0-9]+/g, "0").slice(0, 40) : "";
    parts.push({
      part: element.classList[0] ?? element.tagName.toLowerCase(), name,
      box: [box.x, box.y, box.width, box.height].map(Math.round),
      text: `${style.color} ${style.fontSize}`, ground: style.backgroundColor,
    });
  }
  return parts;
}"""


def differences(page, name):
    """Names what a person would see to differ from the screen as it was looked at last."""
    page.set_viewport_size({"width": WIDTH, "height": HEIGHT})
    page.evaluate("window.scrollTo(0, 0)")
    page.mouse.move(0, 0)
    page.wait_for_function("!document.querySelector('.q-notification')")
    page.evaluate("document.activeElement.blur()")
    # A busy computer loses samples of its own simulated units; warnings push down all that is below them.
    page.add_style_tag(content=".warnings { display: none }")
    await_rest(page)
    parts, picture = page.evaluate(_PARTS), page.screenshot()
    if "TUMBLE_PICTURES" in os.environ:
        _keep(name, parts, picture)
    kept = json.loads((SCREENS / f"{name}.json").read_text(encoding="utf-8"))
    return [*moved(kept, parts), *recoloured(IMAGES / f"bench-{name}.png", picture)]


def _keep(name, parts, picture):
    lines = ",\n".join(json.dumps(each, ensure_ascii=False) for each in parts)
    SCREENS.mkdir(exist_ok=True)
    (SCREENS / f"{name}.json").write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    shown = Image.open(io.BytesIO(picture)).convert("RGB")
    shown.quantize(SHADES).save(IMAGES / f"bench-{name}.png", optimize=True)


def moved(kept, parts):
    """Names parts that are gone, new, elsewhere, or look different; of many alike two are compared."""
    before, now = _by_name(kept), _by_name(parts)
    for key in before.keys() | now.keys():
        label = " ".join(filter(None, key))
        if key not in now:
            yield f"{label}: is gone"
        elif key not in before:
            yield f"{label}: is new"
        else:
            for old, new in zip(before[key][:2], now[key][:2], strict=False):
                yield from (f"{label}: {what}" for what in _changed(old, new))


def _by_name(parts):
    found = {}
    for each in parts:
        found.setdefault((each["part"], each["name"]), []).append(each)
    return found


def _changed(old, new):
    (x, y, width, height), box = old["box"], new["box"]
    far = (FAR_X, FAR_Y, FAR_X, max(FAR_HEIGHT, 0.3 * height))
    if any(abs(a - b) > limit for a, b, limit in zip((x, y, width, height), box, far, strict=True)):
        yield f"was at {old['box']} and is at {box}"
    if old["text"] != new["text"]:
        yield f"its text was {old['text']} and is {new['text']}"


def recoloured(path, picture):
    """Compares mean colours of squares."""
    kept = _squares(Image.open(path))
    found = _squares(Image.open(io.BytesIO(picture)))
    far = np.abs(kept - found).max(axis=2) > FAR_COLOUR
    if far.mean() > MOST_FAR:
        places = ", ".join(f"({SQUARE * x}, {SQUARE * y})" for y, x in np.argwhere(far)[:8])
        yield f"{far.mean():.0%} of the picture has other colours, first at {places}"


def _squares(image):
    pixels = np.asarray(image.convert("RGB"), dtype=float)
    rows, columns = HEIGHT // SQUARE, WIDTH // SQUARE
    return pixels.reshape(rows, SQUARE, columns, SQUARE, 3).mean(axis=(1, 3))
