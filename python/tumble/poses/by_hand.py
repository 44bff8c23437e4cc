"""Orientations of a unit by hand: what a person calls them, and the natural ones."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from tumble.foundation.message import NOTHING, Message, message
from tumble.foundation.recording import FloatArray

LEVEL = math.radians(10.0)
"""Tilt, rad, below which an axis is just called up or down."""
SMALL_PART = 0.3
"""Share of a tilt below which its part towards another axis is not named."""

MOST_ORIENTATIONS = 1000
"""Largest number of orientations: more than a day and a half of work by hand."""


def natural() -> FloatArray:
    """Directions (26, 3) that a person finds without thinking: faces, then corners, then edges."""
    each = [np.array(signs, dtype=float) for signs in product((1, 0, -1), repeat=3) if any(signs)]
    each.sort(key=lambda up: (1, 3, 2).index(int(np.abs(up).sum())))
    return np.array([up / np.linalg.norm(up) for up in each])


def orientation_words(up: FloatArray) -> str:
    """Describes the attitude of a unit in which this direction (3,) of its case points up.

    >>> orientation_words(np.array([0.77, -0.64, 0.0]))
    'x up, tilted by 40 deg so that -y rises'
    """
    return str(orientation_message(up))


def orientation_message(up: FloatArray) -> Message:
    """Describes the same for people of any language."""
    main, tilt = orientation_parts(up)
    return message("{main}, {tilt}", main=main, tilt=tilt) if tilt else main


def orientation_parts(up: FloatArray) -> tuple[Message, Message]:
    """Describes which axis is nearest to the vertical, and how it is tilted; no text where it is not."""
    main, second, third = sorted(range(3), key=lambda axis: -abs(up[axis]))
    name = message("{axis} up" if up[main] > 0.0 else "{axis} down", axis="xyz"[main])
    tilt = math.atan2(math.hypot(up[second], up[third]), abs(up[main]))
    if tilt < LEVEL:
        return name, NOTHING
    # A person cannot hold what is a small part of a tilt.
    named = (second, third) if abs(up[third]) > SMALL_PART * abs(up[second]) else (second,)
    rising = [f"{'+' if up[axis] > 0.0 else '-'}{'xyz'[axis]}" for axis in named]
    angle = f"{math.degrees(tilt):.0f}"
    if len(rising) == 1:
        return name, message("tilted by {angle} deg so that {axis} rises", angle=angle, axis=rising[0])
    text = "tilted by {angle} deg so that {axis} and {other} rise"
    return name, message(text, angle=angle, axis=rising[0], other=rising[1])


def direction_words(direction: FloatArray) -> str:
    """Describes a direction (3,) of the case by the axes that it lies along, or between.

    >>> direction_words(np.array([0.77, -0.64, 0.0]))
    'between +x and -y'
    >>> direction_words(np.array([0.0, 0.1, -0.99]))
    'along -z'
    """
    match _parts(direction):
        case [one]:
            return str(message("along {axis}", axis=one))
        case [one, two]:
            return str(message("between {axis} and {other}", axis=one, other=two))
        case [one, two, three]:
            return str(message("between {axis}, {other} and {third}", axis=one, other=two, third=three))
    raise ValueError(f"{direction} is no unit vector")


def axis_words(axis: FloatArray) -> str:
    """Describes an axis (3,) of rotation by the case axes between which it lies.

    >>> axis_words(np.array([0.77, -0.64, 0.0]))
    'the axis between +x and -y'
    """
    named = _parts(axis)
    return f"axis {named[0][1]}" if len(named) == 1 else f"the axis between {' and '.join(named)}"


def _parts(direction: FloatArray) -> list[str]:
    """Names the axes that a unit vector (3,) has a part along, the largest first, with their signs."""
    order = sorted(range(3), key=lambda k: -abs(direction[k]))
    return [
        f"{'+' if direction[k] > 0.0 else '-'}{'xyz'[k]}" for k in order if abs(direction[k]) > SMALL_PART
    ]


def why_not_so_many(orientations: int) -> str:
    """Describes why so many orientations are impossible by hand; empty where they are possible."""
    if 1 <= orientations <= MOST_ORIENTATIONS:
        return ""
    return f"--orientations {orientations}: give 1 to {MOST_ORIENTATIONS}"
