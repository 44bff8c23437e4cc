"""The poses a turntable is driven to: which direction of the table frame points up at each of them.

At a pose whose `up` is `n`, a perfect accelerometer mounted square to the table reads `g n`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path, PurePath, PurePosixPath
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from tumble.foundation.documents import Document, Vector, read_document, write_document
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.recording import FloatArray
from tumble.foundation.schemas import POSES
from tumble.foundation.words import count_of

SCHEMA: Literal["tumble-poses/1"] = "tumble-poses/1"

FEWEST_POSES = 4
"""Three axes and a bias each: with fewer, some of them stay open whatever the directions are."""
SAME_DIRECTION = 1.0
"""deg: two poses closer than this are the same pose written twice."""

RATE_SECONDS = 20.0
"""s at each rate if nothing is stated."""

_HEADER = f"""\
Poses of a turntable: `up` is the direction of the table frame that points up, of any length but zero.
A pose may name its `file` within the folder of each IMU; then every pose does.
Schema: tumble schema {POSES.name}"""


class PoseError(CalibrationFileError, ValueError):
    """A pose without a name or a direction; models of files take it for a value that does not fit."""


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """One attitude of the table. Raises `PoseError` where `up` has no direction."""

    name: str
    up: FloatArray
    """(3,) unit vector in the table frame; made so from any length given."""
    file: str | None = None
    """Name of this pose's recording within the folder of each IMU, where there is one file a pose."""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise PoseError("a pose needs a name")
        try:
            up = np.array(self.up, dtype=np.float64)
        except (TypeError, ValueError):
            up = np.empty(0)
        if up.shape != (3,) or not np.all(np.isfinite(up)):
            raise PoseError(f"pose {self.name!r}: up needs three finite numbers")
        length = float(np.linalg.norm(up))
        if length == 0.0:
            raise PoseError(
                f"pose {self.name!r}: up is zero, which is no direction; give one such as [0, 0, 1]"
            )
        if self.file is not None and not _stays_inside(self.file):
            raise PoseError(
                f"pose {self.name!r}: file {self.file!r} has to lie within the folder of each IMU"
            )
        up /= length
        up.flags.writeable = False
        object.__setattr__(self, "up", up)


@dataclass(frozen=True, slots=True)
class PoseList:
    """The poses of a session, in the order they are written; they may be driven to in any other.

    Raises `CalibrationFileError` for fewer than `FEWEST_POSES`, for a name or direction given twice, and
    where some poses name a file and others do not.
    """

    poses: tuple[Pose, ...]
    source: str = field(default="poses", compare=False)
    """File the list comes from, for messages."""
    rates: tuple[float, ...] = ()
    """rad/s at which a table that turns by itself turns after the poses, both ways, each `rate_seconds`."""
    rate_seconds: float = RATE_SECONDS

    def __post_init__(self) -> None:
        problem = _problem(self.poses)
        if problem:
            raise CalibrationFileError(f"{self.source}: {problem}")

    @classmethod
    def load(cls, path: Path | str) -> PoseList:
        """Reads a pose list; raises `CalibrationFileError` in one line: file, line, key and remedy."""
        document = read_document(path, PoseFile, POSES)
        return cls(
            tuple(entry.pose() for entry in document.poses),
            str(path),
            tuple(math.radians(rate) for rate in document.rates),
            document.rate_seconds,
        )

    def save(self, path: Path | str) -> None:
        """Writes the list in full or not at all; raises `OutputError` where it cannot be written."""
        entries = [{"name": pose.name, "up": pose.up, "file": pose.file} for pose in self.poses]
        rates = {"rates": [math.degrees(rate) for rate in self.rates], "rate_seconds": self.rate_seconds}
        content = PoseFile.model_validate({"poses": entries, **(rates if self.rates else {})}).content()
        write_document(path, _HEADER, content)

    def files(self) -> dict[str, Pose]:
        """Returns each pose by the name of its file, in lower case and without ending."""
        return {
            PurePath(pose.file or pose.name.replace(" ", "_")).stem.casefold(): pose for pose in self.poses
        }

    def without(self, names: Collection[str]) -> PoseList | None:
        """Returns the list without some of its poses; None where too few are left."""
        left = tuple(pose for pose in self.poses if pose.name not in names)
        return replace(self, poses=left) if len(left) >= FEWEST_POSES else None

    def directions(self) -> FloatArray:
        """(k, 3) unit vectors of `up` in the table frame."""
        return np.array([pose.up for pose in self.poses])

    def __iter__(self) -> Iterator[Pose]:
        return iter(self.poses)

    def __len__(self) -> int:
        return len(self.poses)

    def __getitem__(self, index: int) -> Pose:
        return self.poses[index]


class PoseEntry(Document):
    """One pose."""

    name: Annotated[str, Field(min_length=1)]
    """Name in tables and pictures."""
    up: Vector
    """Direction of the table frame that points up, of any length but zero."""
    file: str | None = None
    """Name of its recording within the folder of each IMU."""

    @model_validator(mode="after")
    def _is_a_pose(self) -> PoseEntry:
        self.pose()
        return self

    def pose(self) -> Pose:
        """Returns the pose in the form of procedures."""
        return Pose(self.name, self.up, self.file)


class PoseFile(Document):
    """Poses of a turntable session."""

    schema_: Literal["tumble-poses/1"] = Field(default=SCHEMA, alias="schema")
    poses: tuple[PoseEntry, ...] = Field(strict=False, json_schema_extra={"minItems": FEWEST_POSES})
    rates: tuple[Annotated[float, Field(gt=0.0, strict=False)], ...] = Field(default=(), strict=False)
    """deg/s at which a table that turns by itself turns the gyroscopes after the poses, both ways."""
    rate_seconds: Annotated[float, Field(gt=0.0, strict=False)] = RATE_SECONDS
    """s at each of these rates."""


def _stays_inside(file: str) -> bool:
    path = PurePosixPath(file)
    return bool(file) and not path.is_absolute() and ".." not in path.parts


def _problem(poses: tuple[Pose, ...]) -> str:
    """First thing wrong with the list as a whole, empty if nothing is."""
    if len(poses) < FEWEST_POSES:
        held = count_of("pose", len(poses))
        return f"holds {held}, needs at least {FEWEST_POSES}; six faces up in turn are best"
    for one, other in combinations(poses, 2):
        if one.name == other.name:
            return f"two poses are named {one.name!r}; give each its own name"
        angle = angle_between(one.up, other.up)
        if angle < SAME_DIRECTION:
            return (
                f"poses {one.name!r} and {other.name!r} point up within {angle:.2g} deg of each other; "
                "keep one; repeats need not be listed"
            )
    without = [pose.name for pose in poses if pose.file is None]
    if without and len(without) < len(poses):
        return f"pose {without[0]!r} names no file while others do; give every pose a file or none"
    return ""


def angle_between(one: FloatArray, other: FloatArray) -> float:
    """Angle between two vectors, (3,) each, deg; by the arc tangent, which is exact for small angles too."""
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(one, other)), one @ other)))


SIX_FACES = PoseList(
    (
        Pose("X up", np.array([1.0, 0.0, 0.0])),
        Pose("X down", np.array([-1.0, 0.0, 0.0])),
        Pose("Y up", np.array([0.0, 1.0, 0.0])),
        Pose("Y down", np.array([0.0, -1.0, 0.0])),
        Pose("Z up", np.array([0.0, 0.0, 1.0])),
        Pose("Z down", np.array([0.0, 0.0, -1.0])),
    ),
    "the six faces",
)
"""Each axis up, then down, the other two level."""
