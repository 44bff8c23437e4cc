"""Directions of the axes x, y and z of a unit in a vehicle: F or B, L or R, U or D each, such as FRD.

Autopilots use FRD (forward, right, down), robots FLU (forward, left, up; REP 103 of ROS).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, TypeAlias

Rotation: TypeAlias = tuple[tuple[int, ...], ...]
"""(3, 3), of zeros, ones and minus ones."""

FRD: Final = "FRD"
FLU: Final = "FLU"
_WORDS: Final = {"F": "forward", "B": "backward", "L": "left", "R": "right", "U": "up", "D": "down"}
_VECTORS: Final = {
    "F": (1, 0, 0), "B": (-1, 0, 0), "L": (0, 1, 0), "R": (0, -1, 0), "U": (0, 0, 1), "D": (0, 0, -1),
}  # fmt: skip
"""Unit vectors in FLU."""


def in_words(axes: str) -> str:
    """Prints `FRD: x forward, y right, z down`."""
    each = (f"{axis} {_WORDS[letter]}" for axis, letter in zip("xyz", axes, strict=True))
    return f"{axes}: {', '.join(each)}"


def are_axes(axes: str) -> bool:
    """Returns whether the letters name three directions at right angles, of a right-handed frame."""
    if len(axes) != len("xyz") or any(letter not in _VECTORS for letter in axes):
        return False
    (ax, ay, az), (bx, by, bz), z = (_VECTORS[letter] for letter in axes)
    return (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx) == z


def rotation(to: str, of: str) -> Rotation:
    """Returns the matrix that takes vectors in axes `of` into axes `to`."""
    return tuple(tuple(_dot(_VECTORS[row], _VECTORS[column]) for column in of) for row in to)


def turned(axes: str, matrix: Iterable[Iterable[float]]) -> str:
    """Returns the axes that (3, 3) signed permutation `matrix` turns these into."""
    columns = list(zip(*(_VECTORS[letter] for letter in axes), strict=True))
    rows = (tuple(_dot(row, column) for column in columns) for row in map(tuple, matrix))
    return "".join(next(each for each, vector in _VECTORS.items() if vector == row) for row in rows)


def _dot(one: Iterable[float], other: Iterable[float]) -> int:
    return round(sum(a * b for a, b in zip(one, other, strict=True)))
