"""Rests and motions in turn become spins: linked, fitted, and freed of motions that corrupt the fit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tumble import _core
from tumble.acquisition.imu import ChannelFault
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Rest
from tumble.procedures.spin.chain import Chain, FailedChain
from tumble.procedures.spin.drive import drive_failure, drove_a_circle
from tumble.procedures.spin.failure import SpinFailure, SpinFailureKind, UnusedInterval
from tumble.procedures.spin.motions import (
    FEWEST_SAMPLES,
    SMALLEST_SPIN,
    first_turn,
    is_nudge,
    motion_failure,
    nearest_rest,
    turned_about,
)
from tumble.procedures.spin.result import FULL_TURN
from tumble.procedures.spin.segments import Segment
from tumble.procedures.spin.turns import Angle, TrueTurns

LARGEST_SCALE_ERROR = 0.1
"""Largest scale error of a gyroscope; a larger deviation of a true angle is a counting error."""
LARGEST_AXIS_CHANGE = 0.3
"""m by which the turning axis of a robot may shift from one turn to the next."""


@dataclass(frozen=True, slots=True)
class Criteria:
    """Criteria of the judgement, and prior knowledge of the user."""

    settings: _core.SpinSettings
    still: float
    """s that the longest rest of a spin lasts at least."""
    turns: float | None
    """Turns asked for; None if nobody asked."""
    true_turns: TrueTurns | None
    faults: tuple[ChannelFault, ...] = ()


@dataclass(frozen=True, slots=True)
class FittedSpin:
    """A spin and what the core made of it."""

    chain: Chain
    figures: _core.SpinFigures
    blocks: _core.SpinBlockFigures


def chains_of(
    segments: Iterable[tuple[Segment, bool]], rests: Sequence[Rest], criteria: Criteria, given: bool
) -> Iterator[Chain | UnusedInterval]:
    """Links rests and motions to chains; a motion that cannot be part of a spin ends one and is refused.

    With each segment comes whether the chain ends there. `rests` are those of the recording, at least one.
    A drive ends a chain as soon as it is known to be one, so that a day of driving need not be kept.
    """
    links: list[Segment] = []
    for segment, ends_here in segments:
        is_motion = segment.rest is None and len(segment.samples) >= FEWEST_SAMPLES
        failure = (
            motion_failure(segment, nearest_rest(segment, rests), criteria.faults, given)
            if is_motion
            else None
        )
        if not failure and (is_motion or segment.rest):
            links.append(segment)
        if failure or ends_here:
            yield Chain(tuple(links), given)
            links = []
        elif segment.rest and not given and _alone(Chain(tuple(links[-3:])), criteria)[1]:
            yield Chain(tuple(links))
            links = [segment]
        if failure:
            yield UnusedInterval(segment.start, segment.end, failure)
    yield Chain(tuple(links), given)


def fit_or_split(chain: Chain, criteria: Criteria) -> Iterator[FittedSpin | UnusedInterval]:
    """Fits a chain as one spin; where one of its motions corrupts that, takes it out and fits the rest."""
    if not _moves(chain):
        if chain.given and chain.segments:
            kind = SpinFailureKind.NO_TURN if chain.rests else SpinFailureKind.NO_REST
            yield UnusedInterval(chain.start, chain.end, SpinFailure(kind))
        return
    if chain.segments[0].rest is None:
        first, *others = chain.segments
        if not is_nudge(first, chain.rests[0]):
            yield UnusedInterval(first.start, first.end, SpinFailure(SpinFailureKind.MOVED_FIRST))
        yield from fit_or_split(Chain(tuple(others), chain.given), criteria)
        return
    turned = sum(turned_about(motion, nearest_rest(motion, chain.rests)) for motion in chain.motions)
    if turned < SMALLEST_SPIN:
        failure = SpinFailure(SpinFailureKind.NO_TURN, {"turned": turned})
        yield UnusedInterval(chain.start, chain.end, failure)
        return
    stray = _first_stray(chain, criteria)
    if stray is not None:
        yield from _without_motion(*stray, chain, criteria)
        return
    attempt = _attempt(chain, criteria)
    if isinstance(attempt, FittedSpin):
        yield attempt
    elif attempt.motion is None or chain.given:
        yield UnusedInterval(chain.start, chain.end, attempt.failure)
    else:
        yield from _without_motion(attempt.motion, attempt.failure, chain, criteria)


def _moves(chain: Chain) -> bool:
    """Returns whether there is a rest, and a motion that is more than a knock."""
    rests = chain.rests
    return bool(rests) and not all(is_nudge(motion, nearest_rest(motion, rests)) for motion in chain.motions)


def _first_stray(chain: Chain, criteria: Criteria) -> tuple[Segment, SpinFailure] | None:
    """Finds a motion that was no turn on the spot by itself: beside others it would corrupt their fit."""
    if chain.given or len(chain.motions) < 2:
        return None
    arms: list[tuple[Segment, FloatArray]] = []
    for motion in chain.motions:
        at = chain.segments.index(motion)
        arm, failed = _alone(Chain(chain.segments[at - 1 : at + 2]), criteria)
        if failed is not None:
            return motion, failed.failure
        if arm is not None:
            arms.append((motion, arm))
    return _another_axis(arms)


def _alone(chain: Chain, criteria: Criteria) -> tuple[FloatArray | None, FailedChain | None]:
    """Fits a single motion with the rests beside it: its lever arm, (3,) m, and whether it was a drive."""
    if (
        chain.segments[0].rest is None
        or len(chain.motions) != 1
        or is_nudge(chain.motions[0], chain.rests[0])
    ):
        return None, None
    try:
        figures, blocks = _fit(chain, criteria.settings)
    except _core.CoreError:
        # The fit with the others judges a part that is too small by itself, or unfit for another reason.
        return None, None
    return figures["lever_arm"], drive_failure(chain, figures, blocks)


def _another_axis(arms: Sequence[tuple[Segment, FloatArray]]) -> tuple[Segment, SpinFailure] | None:
    """Finds a motion about another axis than most, the one furthest from the IMU first; `arms` are (3,) m."""
    if not arms:
        return None
    vectors = np.array([arm for _, arm in arms])
    apart = np.linalg.norm(vectors[:, None] - vectors[None], axis=2) > LARGEST_AXIS_CHANGE
    odd = apart.sum(axis=1)
    if not odd.any():
        return None
    last = max(range(len(arms)), key=lambda k: (odd[k], np.linalg.norm(vectors[k])))
    return arms[last][0], drove_a_circle(vectors[last])


def _without_motion(
    faulty_motion: Segment, failure: SpinFailure, chain: Chain, criteria: Criteria
) -> Iterator[FittedSpin | UnusedInterval]:
    """Fits what lies before and after a motion, and the turn it began with, if it did not only turn."""
    at = chain.segments.index(faulty_motion)
    first = first_turn(faulty_motion, nearest_rest(faulty_motion, chain.rests))
    yield from fit_or_split(Chain((*chain.segments[:at], *first)), criteria)
    yield UnusedInterval(first[0].end if first else faulty_motion.start, faulty_motion.end, failure)
    yield from fit_or_split(Chain(chain.segments[at + 1 :]), criteria)


def _attempt(chain: Chain, criteria: Criteria) -> FittedSpin | FailedChain:
    try:
        figures, blocks = _fit(chain, criteria.settings)
        if criteria.true_turns is not None:
            turned = figures["turned_clockwise"], figures["turned_counter_clockwise"]
            known = criteria.true_turns.angle(*turned, SMALLEST_SPIN)
            contradiction = _contradiction(turned, known)
            if contradiction:
                return FailedChain(contradiction)
            figures, blocks = _fit(chain, criteria.settings, known)
    except _core.CoreError as error:
        failure = SpinFailure.of_core(*error.args)
        return FailedChain(failure, _motion_at(chain, failure.figures.get("time")))
    return (
        _turned_too_little(figures, criteria)
        or drive_failure(chain, figures, blocks)
        or _rested_too_shortly(chain, criteria)
        or FittedSpin(chain, figures, blocks)
    )


def _fit(
    chain: Chain, settings: _core.SpinSettings, true_angle: Angle | None = None
) -> tuple[_core.SpinFigures, _core.SpinBlockFigures]:
    samples = chain.samples
    return _core.fit_spin(
        samples.time,
        samples.accelerometer,
        samples.gyroscope,
        chain.rest_times,
        settings,
        true_angle=true_angle,
    )


def _contradiction(turned: tuple[float, float], known: Angle) -> SpinFailure | None:
    """Reports a contradiction between gyroscope and true angle."""
    for angle, truth, clockwise in zip(turned, known, (True, False), strict=False):
        if math.isfinite(truth) and abs(angle - truth) > LARGEST_SCALE_ERROR * truth:
            figures = {"turned": angle, "true": truth, "clockwise": float(clockwise)}
            return SpinFailure(SpinFailureKind.MISCOUNTED, figures)
    return None


def _turned_too_little(figures: _core.SpinFigures, criteria: Criteria) -> FailedChain | None:
    """Object to a turn smaller than asked for."""
    turned = figures["turned_clockwise"] + figures["turned_counter_clockwise"]
    wanted = FULL_TURN * (criteria.turns or 0.0)
    # A robot commanded to turn by so much stops a little early or late, and its gyroscope has a scale error.
    if turned < 0.98 * wanted:
        figures_of_both = {"turned": turned, "wanted": wanted}
        return FailedChain(SpinFailure(SpinFailureKind.TURNED_TOO_LITTLE, figures_of_both))
    return None


def _rested_too_shortly(chain: Chain, criteria: Criteria) -> FailedChain | None:
    """Object to rests shorter than asked for."""
    longest = max(float(end - start) for start, end in chain.rest_times)
    # The segmenter leaves out the ends of a rest, where the robot may still settle.
    if longest >= criteria.still - 0.5:
        return None
    figures = {"longest": longest, "wanted": criteria.still}
    return FailedChain(SpinFailure(SpinFailureKind.RESTED_TOO_SHORTLY, figures))


def _motion_at(chain: Chain, time: float | None) -> Segment | None:
    """Finds the motion at or nearest to a time; None where there is no time to go by."""
    if time is None:
        return None
    return min(chain.motions, key=lambda each: max(each.start - time, time - each.end, 0.0))
