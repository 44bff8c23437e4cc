"""Which poses and turns a table should make: those that leave least uncertainty for the time they take.

The parameters are those of the turntable's fit, docs/theory/turntable.md (11): rows of M and b of an
accelerometer, of which a rest at the direction `u` shows `g u . m + b`, and of a gyroscope, of which a rest
shows b and a turn, (14), the integral of its rate. White noise of density N leaves N^2 / T of either in T
seconds. Each parameter is held against a goal; what is minimised is the mean square of sigma over goal, times
the time it takes: sigma falls with the root of time, so their product is what a minute buys (A-optimality per
minute; Pukelsheim, *Optimal Design of Experiments*, 2006, chapter 6).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import TableError
from tumble.foundation.recording import FloatArray
from tumble.poses.pose_list import SIX_FACES, Pose, PoseList
from tumble.tools.table.axes import Axis, body_motion, ups
from tumble.tools.table.motion import AxisMotion, travel_time

GRID_DEG = 15.0
"""Angles to choose from."""
APART_DEG = 25.0
"""Least angle between two poses: two in the same place check nothing."""
FEWEST = 6
"""Poses: four would do for the parameters, but leave nothing to check the model by."""
MOST = 9
STARTS = 2
"""Draws from which poses are exchanged beside the greedy choice."""
MOST_TURNS = 6
"""Turns there and back for the gyroscope: two about each direction."""
EXACT = 9
"""Poses up to which the shortest order is found for certain: all that a plan has."""
ABOUT = 0.25
"""Share of a turn by which an executed turn may deviate: a unit may be mounted 10 deg askew."""
UNSEEN = 1e12
"""Variance over goal, squared, of what nothing shows."""
STEPS = 64
"""Pieces in which a motion of several axes is integrated."""


@dataclass(frozen=True, slots=True)
class Goals:
    """Goals of the calibration, and the noise; a better unit needs less time."""

    accelerometer_bias: float = 1e-3
    """m/s^2."""
    accelerometer_matrix: float = 1e-4
    """Goal for each element of M."""
    gyroscope_bias: float = 1e-5
    """rad/s."""
    gyroscope_matrix: float = 1e-4
    accelerometer_noise: float = 1e-3
    """N, m/s^2 / sqrt(Hz)."""
    gyroscope_noise: float = 1e-4
    """rad/s / sqrt(Hz)."""


@dataclass(frozen=True, slots=True)
class TableTurn:
    """A motion about one axis, there and on; for the gyroscope."""

    axis: int
    """Which, from the floor up."""
    angle: float
    """rad, from where it is."""


@dataclass(frozen=True)
class PosePlan:
    """Where a table goes, in this order."""

    axes: tuple[Axis, ...]
    angles: FloatArray
    """(n, axes) rad, of each rest."""
    start: FloatArray
    """(axes,) rad, where it comes from."""
    rest: float
    """s at each."""
    goals: Goals = field(default_factory=Goals)
    turns: tuple[tuple[int, TableTurn], ...] = ()
    """Turns there and back, with the rest before each; a rest follows either."""

    @cached_property
    def route(self) -> FloatArray:
        """(m, axes) rad, of all rests, those between turns included, in their order."""
        return self._route([True] * len(self.angles), self.turns)

    def left(self, shown: Sequence[bool], turned: FloatArray) -> FloatArray:
        """Returns what is left of the route (m, axes), rad, once some rests and turns were made.

        `shown` marks the rests that were; `turned` (n, 3) are rotations, rad, between one rest and
        the next in the frame of the table, or nearly. A turn of which there or back lacks is made again.
        """
        made = list(turned)
        turns = tuple(each for each in self.turns if not _was_made(self._rotation(*each), made))
        numbers = {number for number, _ in turns}
        wanted = [not each or number in numbers for number, each in enumerate(shown)]
        return self._route(wanted, turns)

    def _route(self, wanted: Sequence[bool], turns: Sequence[tuple[int, TableTurn]]) -> FloatArray:
        stops: list[FloatArray] = []
        for number, angles in enumerate(self.angles):
            stops += [angles] if wanted[number] else []
            for _, turn in (each for each in turns if each[0] == number):
                stops += [_turned(angles, turn), angles]
        return np.array(stops).reshape(-1, len(self.axes))

    def _rotation(self, number: int, turn: TableTurn) -> FloatArray:
        """Returns a turn as rotation (3,) in the frame of the table, rad; its axis is fixed there."""
        speed = np.zeros((1, len(self.axes)))
        speed[0, turn.axis] = turn.angle
        rotation, _ = body_motion(self.axes, self.angles[[number]], speed, np.zeros_like(speed))
        found: FloatArray = rotation[0]
        return found

    @property
    def ups(self) -> FloatArray:
        """(n, 3) directions of the table frame that point up at the rests."""
        return ups(self.axes, self.angles)

    def poses(self) -> PoseList:
        """Directions of the rests as a pose list, for the calibration; not those that end turns."""
        return PoseList(tuple(Pose(f"pose {number}", up) for number, up in enumerate(self.ups, start=1)))

    @property
    def motion_seconds(self) -> float:
        """Time of all motions, s."""
        stops = [self.start, *self.route]
        return sum(_travel(self.axes, one, other) for one, other in pairwise(stops))

    @property
    def seconds(self) -> float:
        """Time of rests and motions, s."""
        return self.motion_seconds + self.rest * len(self.route)

    @cached_property
    def sigma(self) -> FloatArray:
        """(24,) sigma over goal: rows (m, b) of the accelerometer's three axes, then the gyroscope's."""
        sigma: FloatArray = np.sqrt(np.concatenate([np.tile(each, 3) for each in self._variances()]))
        return sigma

    @property
    def sigma_per_minute(self) -> float:
        """Objective: root mean square of sigma over goal that a minute leaves, s / 60 and root."""
        return math.sqrt(float(np.mean(np.square(self.sigma))) * self.seconds / 60.0)

    def _variances(self) -> tuple[FloatArray, FloatArray]:
        goals = self.goals
        accelerometer = _information(
            np.column_stack([STANDARD_GRAVITY * ups(self.axes, self.route), np.ones(len(self.route))]),
            np.full(len(self.route), self.rest / goals.accelerometer_noise**2),
        )
        gyroscope = np.diag([0.0, 0.0, 0.0, len(self.route) * self.rest / goals.gyroscope_noise**2])
        for one, other in pairwise(self.route):
            gyroscope += _turn_information(self.axes, one, other) / goals.gyroscope_noise**2
        return (
            _variance(accelerometer, goals.accelerometer_matrix, goals.accelerometer_bias),
            _variance(gyroscope, goals.gyroscope_matrix, goals.gyroscope_bias),
        )


def plan_poses(
    axes: Sequence[Axis],
    rest: float,
    start: FloatArray | None = None,
    goals: Goals | None = None,
    *,
    gyroscope: bool = True,
    grid_deg: float = GRID_DEG,
) -> PosePlan:
    """Chooses poses, their order and turns for least sigma per minute.

    `axes` with their limits, `rest` s at each pose, `start` (axes,) rad where the table is (zero if not
    given). Without `gyroscope` no turns are added.

    Raises `TableError` where the table reaches too few directions: one that only turns about the vertical.
    """
    goals = goals or Goals()
    start = np.zeros(len(axes)) if start is None else np.asarray(start, dtype=np.float64)
    grid = reachable(axes, grid_deg)
    exchange = _Exchange(axes, grid, start, rest, goals)
    best: PosePlan | None = None
    for count in range(FEWEST, min(MOST, len(grid)) + 1):
        sets = [in_shortest_order(axes, angles, start) for angles in exchange.sets(count)]
        found = min((PosePlan(tuple(axes), each, start, rest, goals) for each in sets), key=_price)
        if best is not None and _price(found) >= _price(best):
            break
        best = found
    if best is None or best._variances()[0].max() >= UNSEEN:
        raise TableError(
            "the table reaches too few directions for an accelerometer: it needs a second axis, or a level "
            "one; turn the units over by hand, and leave the turns to the table"
        )
    return with_turns(best) if gyroscope else best


def reachable(axes: Sequence[Axis], grid_deg: float = GRID_DEG) -> FloatArray:
    """Angles (n, axes), rad, on a grid within the limits; of one direction up, the nearest to zero."""
    columns = [_angles_of(axis, math.radians(grid_deg)) for axis in axes]
    angles = np.array(list(product(*columns)))
    angles = angles[np.argsort(np.abs(angles).sum(axis=1), kind="stable")]
    rounded = np.round(ups(axes, angles), 6) + 0.0
    _, first = np.unique(rounded, axis=0, return_index=True)
    distinct: FloatArray = angles[np.sort(first)]
    return distinct


def in_shortest_order(axes: Sequence[Axis], angles: FloatArray, start: FloatArray) -> FloatArray:
    """Puts rests (n, axes) in the order that takes least time from `start` on.

    For certain up to `EXACT` of them (Held and Karp, *J. SIAM* 10, 1962), else by exchanges of pieces.
    """
    stops = np.vstack([start, angles])
    between = np.array([[_travel(axes, one, other) for other in stops] for one in stops])
    order = _exact_order(between) if len(angles) <= EXACT else _exchanged_order(between)
    return stops[order[1:]]


def _angles_of(axis: Axis, step: float) -> FloatArray:
    low, high = axis.limits.angle or (-math.pi, math.pi - 1e-9)
    low, high = max(low, -math.pi), min(high, math.pi)
    found: FloatArray = step * np.arange(
        math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1
    ).astype(np.float64)
    within: FloatArray = found if axis.limits.angle else found[found < math.pi - 1e-9]
    return within


def _travel(axes: Sequence[Axis], one: FloatArray, other: FloatArray) -> float:
    """Returns the time from rest to rest, s: axes move at once, the slowest counts."""
    return max(
        travel_time(float(distance), axis.limits.rate, axis.limits.acceleration)
        for axis, distance in zip(axes, other - one, strict=True)
    )


def _information(rows: FloatArray, weights: FloatArray) -> FloatArray:
    information: FloatArray = (rows * weights[:, np.newaxis]).T @ rows
    return information


def _variance(information: FloatArray, matrix_goal: float, bias_goal: float) -> FloatArray:
    """Returns the variances (..., 4) of a row of M and of b over their goals squared.

    `information` is (..., 4, 4). An unobservable parameter has `UNSEEN`.
    """
    goals = np.array([matrix_goal, matrix_goal, matrix_goal, bias_goal])
    values, vectors = np.linalg.eigh(information * np.outer(goals, goals))
    inverse = 1.0 / np.maximum(values, 1.0 / UNSEEN)
    variances: FloatArray = np.minimum(np.einsum("...ij,...j->...i", vectors**2, inverse), UNSEEN)
    return variances


def _turn_information(axes: Sequence[Axis], one: FloatArray, other: FloatArray) -> FloatArray:
    """Returns the information (4, 4) of a motion over N^-2: row (integral of the rate / T, 1), weight T."""
    seconds = _travel(axes, one, other)
    if seconds == 0.0:
        return np.zeros((4, 4))
    motions = [AxisMotion(float(angle)) for angle in one]
    for axis, motion, target in zip(axes, motions, other, strict=True):
        motion.goto(0.0, float(target), axis.limits.rate, axis.limits.acceleration)
    times = (np.arange(STEPS) + 0.5) * seconds / STEPS
    states = (
        np.stack(each, axis=1) for each in zip(*(motion.states(times) for motion in motions), strict=True)
    )
    mean, _ = body_motion(axes, *states)
    row = np.append(mean.mean(axis=0), 1.0)
    return seconds * np.outer(row, row)


def _price(plan: PosePlan) -> float:
    """Variance of the accelerometer times the time: what poses are chosen for."""
    return float(plan._variances()[0].mean()) * plan.seconds


class _Exchange:
    """Chooses rests out of a grid, for a price: the variance of the accelerometer times the time it takes."""

    def __init__(
        self, axes: Sequence[Axis], grid: FloatArray, start: FloatArray, rest: float, goals: Goals
    ) -> None:
        self._grid = grid
        self._rest = rest
        self._goals = goals
        self._directions = ups(axes, grid)
        rows = np.column_stack([STANDARD_GRAVITY * self._directions, np.ones(len(grid))])
        self._shown = rest / goals.accelerometer_noise**2 * rows[:, :, np.newaxis] * rows[:, np.newaxis, :]
        self._near = self._directions @ self._directions.T > math.cos(math.radians(APART_DEG))
        # The start is the last of the stops.
        stops = np.vstack([grid, start])
        times = [_travel_times(stops[:, number], axis) for number, axis in enumerate(axes)]
        self._apart = np.max(times, axis=0)

    def sets(self, count: int) -> Iterator[FloatArray]:
        """Returns sets of `count` rests, each as good as exchanging one at a time can make it."""
        generator = np.random.default_rng(0)
        faces = [int(np.argmax(self._directions @ pose.up)) for pose in SIX_FACES]
        begun: list[list[int]] = [[], *([faces] if count == len(faces) else [])]
        begun += [generator.choice(len(self._grid), count, replace=False).tolist() for _ in range(STARTS)]
        for path in begun:
            yield self._grid[self._exchanged(self._ordered(path), count)]

    def _exchanged(self, path: list[int], count: int) -> list[int]:
        while len(path) < count:
            _, path = self._with_best(path)
        best, improved = math.inf, True
        while improved:
            improved = False
            for stop in tuple(path):
                price, found = self._with_best([each for each in path if each != stop])
                if price < best * (1.0 - 1e-9):
                    path, best, improved = found, price, True
        return path

    def _with_best(self, path: list[int]) -> tuple[float, list[int]]:
        """Adds the rest of least price, where it lengthens the way least; returns the price."""
        between, stops = self._apart, [len(self._grid), *path]
        on = between[stops]
        # Between two stops, then behind the last: (gaps, grid).
        longer = np.vstack([on[:-1] + on[1:] - np.diagonal(on[:-1][:, stops[1:]])[:, np.newaxis], on[-1:]])
        longer = longer[:, :-1]
        way = sum(between[one, other] for one, other in pairwise(stops)) + longer.min(axis=0)
        goals = self._goals
        information = self._shown[path].sum(axis=0) + self._shown
        variances = _variance(information, goals.accelerometer_matrix, goals.accelerometer_bias).mean(axis=1)
        prices = variances * (self._rest * (len(path) + 1) + way)
        prices[self._near[path].any(axis=0)] = math.inf
        chosen = int(np.argmin(prices))
        gap = int(np.argmin(longer[:, chosen]))
        return float(prices[chosen]), [*path[:gap], chosen, *path[gap:]]

    def _ordered(self, path: list[int]) -> list[int]:
        stops = [len(self._grid), *path]
        return [stops[each] for each in _exchanged_order(self._apart[np.ix_(stops, stops)])[1:]]


def _travel_times(angles: FloatArray, axis: Axis) -> FloatArray:
    """Returns times (n, n), s, between angles (n,) of one axis."""
    distances = np.abs(np.subtract.outer(angles, angles))
    rate, acceleration = axis.limits.rate, axis.limits.acceleration
    times: FloatArray = np.where(
        distances * acceleration < rate * rate,
        2.0 * np.sqrt(distances / acceleration),
        distances / rate + rate / acceleration,
    )
    return times * (distances > 0.0)


def _exact_order(between: FloatArray) -> list[int]:
    """Order of all stops from the first on, for certain."""
    count = len(between)
    best: dict[tuple[int, int], tuple[float, int]] = {(1, 0): (0.0, -1)}
    for visited in range(1, 1 << count, 2):
        for last in range(count):
            if (visited, last) not in best:
                continue
            so_far = best[visited, last][0]
            for next_one in range(1, count):
                if visited >> next_one & 1:
                    continue
                key, length = (visited | 1 << next_one, next_one), so_far + float(between[last, next_one])
                if key not in best or length < best[key][0]:
                    best[key] = (length, last)
    visited = (1 << count) - 1
    last = min(
        (each for each in range(count) if (visited, each) in best), key=lambda each: best[visited, each][0]
    )
    order = []
    while last >= 0:
        order.append(last)
        visited, last = visited & ~(1 << last), best[visited, last][1]
    return order[::-1]


def _exchanged_order(between: FloatArray) -> list[int]:
    """Order of all stops from the first on: the nearest next, then pieces turned or moved (2-opt, Or-opt)."""
    order, left = [0], set(range(1, len(between)))
    while left:
        order.append(min(left, key=lambda each: float(between[order[-1], each])))
        left.remove(order[-1])

    def length(stops: list[int]) -> float:
        return float(sum(between[one, other] for one, other in pairwise(stops)))

    best, improved = length(order), True
    while improved:
        improved = False
        for first, last in ((i, j) for i in range(1, len(order)) for j in range(i + 1, len(order) + 1)):
            piece, rest = order[first:last], order[:first] + order[last:]
            turned = order[:first] + piece[::-1] + order[last:]
            moved = (
                [rest[:at] + piece + rest[at:] for at in range(1, len(rest) + 1)] if len(piece) <= 3 else []
            )
            for candidate in (turned, *moved):
                if (found := length(candidate)) < best - 1e-9:
                    order, best, improved = candidate, found, True
                    break
            if improved:
                break
    return order


def _was_made(rotation: FloatArray, made: list[FloatArray]) -> bool:
    """Removes a rotation and its way back from those executed; returns whether both were there."""
    found: list[FloatArray] = []
    for wanted in (rotation, -rotation):
        most = ABOUT * float(np.linalg.norm(wanted))
        number = next((n for n, each in enumerate(made) if np.linalg.norm(each - wanted) <= most), None)
        if number is None:
            made += found
            return False
        found.append(made.pop(number))
    return True


def _turned(angles: FloatArray, turn: TableTurn) -> FloatArray:
    moved = np.array(angles)
    moved[turn.axis] += turn.angle
    return moved


def with_turns(plan: PosePlan) -> PosePlan:
    """Adds turns, one after the other, as long as a minute buys more with them, `MOST_TURNS` at most."""
    candidates = [
        (number, TableTurn(axis, angle))
        for number in range(len(plan.angles))
        for axis, each in enumerate(plan.axes)
        for angle in _spans(each, float(plan.angles[number][axis]))
    ]
    while candidates and len(plan.turns) < MOST_TURNS:
        with_each = [replace(plan, turns=(*plan.turns, each)) for each in candidates]
        best = min(with_each, key=lambda each: each.sigma_per_minute)
        if best.sigma_per_minute >= plan.sigma_per_minute * (1.0 - 1e-6):
            break
        candidates.remove(best.turns[-1])
        plan = best
    return plan


def _spans(axis: Axis, angle: float) -> list[float]:
    """Returns turns that an axis can make from an angle: whole ones, or as far as its limits let it."""
    if axis.limits.angle is None:
        return [2.0 * math.pi]
    low, high = axis.limits.angle
    return [far - angle for far in (low, high) if abs(far - angle) > math.radians(GRID_DEG)]
