"""Which rest of the reference is which pose of the list: by direction, or by file where each has its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TypeAlias

import numpy as np

from tumble.acquisition.acquire import rests_after_rates
from tumble.acquisition.imu import Imu, pose_files
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import FloatArray, Recording
from tumble.foundation.words import count_of
from tumble.poses.pose_list import SIX_FACES, Pose, PoseList, angle_between

LARGEST_TIP = 10.0
"""deg between a pose as listed and as recorded, mounting angle included; beyond it the pose is tipped."""
LARGEST_CONFUSION = 25.0
"""deg; beyond it a rest is no pose of the list at all."""


@dataclass(frozen=True, slots=True)
class PoseMatch:
    """The reference's rests beside the pose list."""

    ups: FloatArray
    """(k, 3) up of each rest in the table frame, NaN where its pose is not known."""
    names: dict[int, str]
    """Name of the pose of each rest that has one."""
    reason: str
    """Reason why no pose is known; empty if poses are."""
    warnings: tuple[str, ...] = ()

    @property
    def known(self) -> bool:
        """Returns whether any pose is known."""
        return bool(self.names)


def match_poses(
    recording: Recording,
    forces: FloatArray,
    parts: Sequence[int],
    poses: PoseList | None,
    turned: Sequence[bool | None],
) -> PoseMatch:
    """Matches rests, by mean specific force (k, 3), to poses; `turned` is as of `turned_between_rests`.

    Raises `ProcedureError` where a pose of the list is missing, tipped, or mislabelled.
    """
    nothing = np.full(forces.shape, np.nan)
    if poses is None:
        return PoseMatch(nothing, {}, "no pose list was given")
    if recording.parts:
        labelled = _by_file(recording, parts, poses)
        _refuse_mislabelled(recording, forces, labelled, parts, poses)
        strange = [recording.parts[part].name for k, part in enumerate(parts) if k not in labelled]
        return _matched(forces, parts, labelled, poses, _strange_files(strange), turned)
    nearest = [_nearest(force, poses) for force in forces]
    labelled = {k: pose for k, (pose, angle) in enumerate(nearest) if angle <= LARGEST_TIP}
    if poses is SIX_FACES and not _shows_six_faces(labelled, len(forces)):
        return PoseMatch(
            nothing, {}, "the rests do not show the six faces; name the poses with --poses to estimate it"
        )
    for k, (pose, angle) in enumerate(nearest):
        if LARGEST_TIP < angle <= LARGEST_CONFUSION and pose not in labelled.values():
            raise ProcedureError(
                f"rest {k + 1} is tipped {angle:.1f} deg from pose {pose.name!r}, more "
                f"than {LARGEST_TIP:g} deg; level the table, correct the pose list, or use --poses none",
                about=recording.name,
            )
    missing = [pose.name for pose in poses if pose not in labelled.values()]
    if missing:
        raise ProcedureError(
            f"pose {missing[0]!r} is missing, {len(poses) - len(missing)} of {len(poses)} "
            f"were found in {count_of('rest', len(forces))}; record it, take it off the list, "
            "or use --poses none",
            about=recording.name,
        )
    return _matched(forces, parts, labelled, poses, _extras(nearest), turned)


def _nearest(force: FloatArray, poses: PoseList) -> tuple[Pose, float]:
    angles = [angle_between(force, pose.up) for pose in poses]
    best = int(np.argmin(angles))
    return poses[best], angles[best]


def _shows_six_faces(labelled: dict[int, Pose], rests: int) -> bool:
    """Returns whether a recording without a list was made at the six faces."""
    distinct = {pose.name for pose in labelled.values()}
    return len(distinct) >= 4 and 2 * len(labelled) >= rests


def _by_file(recording: Recording, parts: Sequence[int], poses: PoseList) -> dict[int, Pose]:
    """Poses by the name of their file: `file` of the pose, or its name in the spelling of a file."""
    stems = pose_files(recording)
    by_stem = poses.files()
    for stem, pose in by_stem.items():
        if stem not in stems:
            raise ProcedureError(
                f"no file for pose {pose.name!r} (looked for {stem}.*); "
                "record it, take it off the list, "
                "or use --poses none",
                about=recording.name,
            )
    labelled = ((k, by_stem.get(stems[part])) for k, part in enumerate(parts))
    return {k: pose for k, pose in labelled if pose is not None}


def _refuse_mislabelled(
    recording: Recording, forces: FloatArray, labelled: dict[int, Pose], parts: Sequence[int], poses: PoseList
) -> None:
    angles = {k: angle_between(forces[k], pose.up) for k, pose in labelled.items()}
    if angles and min(angles.values()) > 180.0 - LARGEST_TIP:
        raise ProcedureError(
            "reads -g where its poses have +g, in every file; change the sign with --accelerometer-sign -1",
            about=recording.name,
        )
    for k, pose in labelled.items():
        if angles[k] <= LARGEST_TIP:
            continue
        file = recording.parts[parts[k]].name
        shown, off = _nearest(forces[k], poses)
        if off <= LARGEST_TIP:
            said = f"file {file!r} shows pose {shown.name!r}, not {pose.name!r}"
        else:
            said = f"file {file!r} is tipped {angles[k]:.1f} deg from pose {pose.name!r}"
        raise ProcedureError(f"{said}; rename the file or record the pose again", about=recording.name)


def _extras(nearest: Sequence[tuple[Pose, float]]) -> tuple[str, ...]:
    extra = [k + 1 for k, (_, angle) in enumerate(nearest) if angle > LARGEST_TIP]
    if not extra:
        return ()
    listed = ", ".join(map(str, extra))
    return (
        f"rest {listed} of the reference matches no pose; it is used for the targets, not for the mounting "
        "angle",
    )


def _strange_files(names: Sequence[str]) -> tuple[str, ...]:
    if not names:
        return ()
    return (
        f"file {', '.join(names)} matches no pose; it is used for the targets, not for the mounting angle",
    )


def _matched(
    forces: FloatArray,
    parts: Sequence[int],
    labelled: dict[int, Pose],
    poses: PoseList,
    warnings: tuple[str, ...],
    turned: Sequence[bool | None],
) -> PoseMatch:
    ups = np.full(forces.shape, np.nan)
    for k, pose in labelled.items():
        ups[k] = pose.up
    names = {k: pose.name for k, pose in labelled.items()}
    visits = _visits(names, parts, poses)
    return PoseMatch(ups, names, "", (*warnings, *_interrupted(visits, turned), *_repeated(visits)))


def turned_between_rests(unit: Imu) -> tuple[bool | None, ...]:
    """Returns, for each rest but the first, whether the unit was turned since the rest before.

    A bump ends in the attitude in which it began, so that the integral of the rate over it is small, heading
    included; a turn about the vertical shows in it alone, a full one too. None where nothing shows it: there
    is no gyroscope, or samples are missing.
    """
    acquired, rates = unit.acquired, rests_after_rates(unit.acquired)
    if "gyroscope" not in unit.triads:
        return tuple(True if k in rates else None for k in range(1, len(acquired.rest_times)))
    pauses = acquired.rest_times[1:, 0] - acquired.rest_times[:-1, 1]
    angles = acquired.turn_angles - acquired.rest_angular_rate[:-1] * pauses[:, np.newaxis]
    far = np.degrees(np.linalg.norm(angles, axis=1)) > LARGEST_TIP
    return tuple(
        True if k in rates else bool(is_far) if is_known else None
        for k, (is_far, is_known) in enumerate(zip(far, acquired.turn_complete, strict=True), start=1)
    )


Visits: TypeAlias = dict[str, list[list[int]]]
"""Rests of each pose, in the order of the list, for each time that the table was turned to it."""


def _visits(names: dict[int, str], parts: Sequence[int], poses: PoseList) -> Visits:
    """Rests of one pose in a row are one visit to it."""
    visits: Visits = {pose.name: [] for pose in poses}
    for k in sorted(names):
        of_pose = visits[names[k]]
        if of_pose and of_pose[-1][-1] == k - 1 and parts[k] == parts[k - 1]:
            of_pose[-1].append(k)
        else:
            of_pose.append([k])
    return visits


def _interrupted(visits: Visits, turned: Sequence[bool | None]) -> Iterator[str]:
    """Describes rests in a row between which the table did not turn about the vertical."""
    for name, of_pose in visits.items():
        for visit in of_pose:
            between = [turned[k - 1] for k in visit[1:]]
            stood = [len(list(same)) + 1 for was_turned, same in groupby(between) if was_turned is False]
            for rests in stood:
                yield f"the rest at {name} was disturbed and fell into {rests} rests; all are used"
            if None in between:
                yield (
                    f"{count_of('rest', len(visit))} in a row at {name}: one that was disturbed, or turns "
                    "about the vertical between them, which no gyroscope shows; all are used"
                )


def _repeated(visits: Visits) -> list[str]:
    repeated = [f"{name} ({len(of_pose)} times)" for name, of_pose in visits.items() if len(of_pose) > 1]
    return [f"poses recorded more than once, all used: {', '.join(repeated)}"] if repeated else []
