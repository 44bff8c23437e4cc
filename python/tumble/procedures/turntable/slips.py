"""Detection of units that slipped or were swapped, by gravity at a pose that comes again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.poses.pose_list import PoseList, angle_between
from tumble.procedures.turntable.matching import LARGEST_TIP

LOOSE = 0.2
"""deg by which gravity moves against the reference's between two visits of a pose: biases drift by less."""
NOT_KNOWN = 0.1
"""Share of the reference's own motion that an uncalibrated target may show differently."""
OTHER_AXES = 20.0
"""deg, from which it is no slip but another unit, or other axes."""
LIKER = 0.5
"""Two units are swapped where each is nearer by this factor to what the other showed than to its own."""

FEWEST_VISITS = 6
"""Visits from which an exchange is detected without a pose that came again: two more than a fit takes up."""
EXCHANGED = 0.2
"""Two units are exchanged where the readings of both, exchanged, fit the reference better by this factor."""


@dataclass(frozen=True, slots=True)
class Visit:
    """One rest of the reference at a pose, and what the units showed there."""

    pose: str
    time: float
    """s, of its beginning."""
    reference: FloatArray
    """(3,) specific force, m/s^2."""
    targets: Mapping[str, FloatArray]
    """The same of each target that rested then."""


@dataclass(frozen=True, slots=True)
class Slip:
    """A target that showed something else at a pose than it did before."""

    target: str
    visit: Visit
    angle: float
    """deg."""
    other: str = ""
    """The target it was swapped with."""


def visits_of(
    reference: _core.Acquired, targets: Mapping[str, _core.Acquired], poses: PoseList
) -> list[Visit]:
    """Returns all rests at poses of the list; all times are of one clock."""
    visits = []
    for span, force in zip(reference.rest_times, reference.rest_specific_force, strict=True):
        angles = [angle_between(force, pose.up) for pose in poses]
        best = int(np.argmin(angles))
        if angles[best] <= LARGEST_TIP:
            seen = {name: _during(span, unit) for name, unit in targets.items()}
            shown = {name: each for name, each in seen.items() if each is not None}
            visits.append(Visit(poses[best].name, float(span[0]), force, shown))
    return visits


def slips(visits: Sequence[Visit], matrices: Mapping[str, FloatArray], gravity: float) -> Iterator[Slip]:
    """Compares each visit with the first of the same pose; `matrices` (3, 3) turn truth into readings."""
    first: dict[str, Visit] = {}
    for visit in visits:
        before = first.setdefault(visit.pose, visit)
        found = dict(_moved(before, visit, matrices, gravity))
        for name, angle in found.items():
            yield Slip(name, visit, angle, _swapped_with(name, found, before, visit, matrices))


def _during(span: FloatArray, unit: _core.Acquired) -> FloatArray | None:
    """Mean specific force of the rest of a unit that shares most of a span; None where none shares half."""
    if not len(unit.rest_times):
        return None
    shared = np.minimum(unit.rest_times[:, 1], span[1]) - np.maximum(unit.rest_times[:, 0], span[0])
    best = int(np.argmax(shared))
    return unit.rest_specific_force[best] if 2.0 * shared[best] > span[1] - span[0] else None


def _moved(
    before: Visit, visit: Visit, matrices: Mapping[str, FloatArray], gravity: float
) -> Iterator[tuple[str, float]]:
    """Names the targets whose gravity did not move as that of the reference did, with the angle, deg."""
    itself = visit.reference - before.reference
    most = LOOSE + NOT_KNOWN * np.degrees(np.linalg.norm(itself) / gravity)
    for name in before.targets.keys() & visit.targets.keys():
        moved = visit.targets[name] - before.targets[name] - matrices[name] @ itself
        angle = float(np.degrees(np.linalg.norm(moved) / gravity))
        if angle > most:
            yield name, angle


def _swapped_with(
    name: str,
    found: Mapping[str, float],
    before: Visit,
    visit: Visit,
    matrices: Mapping[str, FloatArray],
) -> str:
    """Names the target that changed places with this one; empty if none did."""
    itself = visit.reference - before.reference

    def off(shows: str, showed: str) -> float:
        expected = before.targets[showed] + matrices[showed] @ itself
        return float(np.linalg.norm(visit.targets[shows] - expected))

    for one, other in combinations(sorted(found), 2):
        crossed, own = off(one, other) + off(other, one), off(one, one) + off(other, other)
        if name in (one, other) and crossed < LIKER * own:
            return other if name == one else one
    return ""


@dataclass(frozen=True, slots=True)
class Exchange:
    """Two targets whose plugs were exchanged: from a visit on each shows what the other is."""

    one: str
    other: str
    since: Visit


def exchanges(visits: Sequence[Visit], suspects: Sequence[str]) -> Iterator[Exchange]:
    """Finds pairs of targets that fit the reference far better with their readings exchanged from a visit on.

    Every target is fitted by y = M u + b to the reference's specific force u of the visits; no pose need come
    again. Both targets of a pair have to fit badly as they are, and well exchanged.
    """
    for one, other in combinations(sorted(suspects), 2):
        seen = [visit for visit in visits if visit.targets.keys() >= {one, other}]
        if len(seen) < FEWEST_VISITS:
            continue
        forces = np.array([visit.reference for visit in seen])
        pair = np.array([[visit.targets[name] for name in (one, other)] for visit in seen])
        own = _misfit(forces, pair)
        crossed = {
            k: _misfit(forces, np.concatenate([pair[:k], pair[k:, ::-1]])) for k in range(1, len(seen))
        }
        best = min(crossed, key=lambda k: float(crossed[k].max()))
        if np.all(crossed[best] < EXCHANGED * own):
            yield Exchange(one, other, seen[best])


def _misfit(forces: FloatArray, pair: FloatArray) -> FloatArray:
    """Root mean square residual (2,), m/s^2, of the readings (n, 2, 3) of two targets, each fitted alone."""
    regressors = np.column_stack([forces, np.ones(len(forces))])
    readings = pair.reshape(len(pair), 6)
    residual = readings - regressors @ np.linalg.lstsq(regressors, readings, rcond=None)[0]
    misfit: FloatArray = np.sqrt(np.mean(np.square(residual).reshape(len(pair), 2, 3), axis=(0, 2)))
    return misfit
