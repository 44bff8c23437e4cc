"""The spin procedure on a log: a wheeled robot that stood still and turned on the spot."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from numbers import Real
from pathlib import Path

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import (
    acquire,
    refuse_if_damaged,
    refuse_if_misread,
    rests_of,
    scale_notice,
    trace_of,
)
from tumble.acquisition.coarseness import coarse_notices
from tumble.acquisition.imu import Imu, log_name
from tumble.acquisition.notices import correction_notice
from tumble.acquisition.stamps import open_sampled
from tumble.calibration.document import Calibration
from tumble.calibration.start import applied_first
from tumble.foundation.errors import ProcedureError
from tumble.foundation.gravity import local_gravity
from tumble.foundation.recording import Recording, RecordingSource, SampleProgress
from tumble.foundation.results import Rest
from tumble.foundation.sample_rates import on_slow_rate
from tumble.foundation.words import count_of, short
from tumble.logs import ReadOptions
from tumble.procedures.spin.chain import Chain
from tumble.procedures.spin.combination import CombinedBiases, combine
from tumble.procedures.spin.failure import SpinFailure, SpinFailureKind, UnusedInterval, rejected_rests
from tumble.procedures.spin.gravity import bias_sigma
from tumble.procedures.spin.messages import SMALLEST_SHOWN, cause, explain, remedy
from tumble.procedures.spin.motions import credible_faults
from tumble.procedures.spin.outputs import describe_spin
from tumble.procedures.spin.preset import TurnPreset
from tumble.procedures.spin.result import Spin, SpinResult
from tumble.procedures.spin.search import Criteria, FittedSpin, chains_of, fit_or_split
from tumble.procedures.spin.segments import (
    LONGEST_SPIN,
    Interval,
    Segment,
    UnreadSegment,
    read_intervals,
    rest_from,
    segments_within,
    true_rests,
)
from tumble.procedures.spin.settings import core_settings
from tumble.procedures.spin.turns import TrueTurns

SHORTEST_STILL = 2.0
"""s that at least one rest of a spin lasts by default."""
MOST_NAMED = 3
"""Stretches that the line of an error names; the rest it counts."""


def spin(
    source: RecordingSource,
    *,
    still: float = SHORTEST_STILL,
    duration: float | None = None,
    rate: float | None = None,
    turns: float | None = None,
    true_turns: TrueTurns | str | None = None,
    level_floor: bool = False,
    at: Sequence[tuple[float, float]] = (),
    gravity: float | None = None,
    latitude: float | None = None,
    height: float | None = None,
    gravity_uncertainty: float | None = None,
    calibration: Calibration | str | Path | None = None,
    read: ReadOptions | None = None,
    progress: SampleProgress | None = None,
) -> SpinResult:
    """Finds the biases of the IMU of a robot that stood still and turned on the spot, once or several times.

    Rest and spin are found by themselves, or lie between the times `at`, s from its start. A
    spin whose longest rest is shorter than `still`, s, or that turned less than `turns`, is not used. Turns
    that depart from a preset `duration`, s, `rate`, rad/s, or number of `turns` are used, with a warning.
    `true_turns` is what each spin truly turned, where that is known, and shows the gyroscope's scale about
    the turning axis; text is read as `TrueTurns.parse` has it. With `level_floor` the floor is taken to be
    level, which is the published method. A `calibration` is applied first: what is found is the bias it
    leaves. `gravity_uncertainty` is the 1-sigma of gravity, m/s^2, by docs/theory/uncertainty.md if not
    given. `progress` receives samples done, and samples expected where they are known.

    Raises `TumbleError`, in one line, where no spin can be used.

    Method: docs/theory/spin.md.
    """
    place = local_gravity(gravity, latitude, height, gravity_uncertainty)
    strength = place.value
    recording = open_sampled(source, read)
    applied = applied_first(calibration, recording.metadata)
    preset = TurnPreset(duration, rate, turns)
    settings = core_settings(
        {"gravity": strength, "still": still, "level_floor": level_floor},
        latitude=latitude,
        bias_instability=applied.bias_instability if applied else None,
    )
    unit = _acquired(recording, applied, strength, progress)
    known = TrueTurns.parse(true_turns) if isinstance(true_turns, str) else true_turns
    criteria = Criteria(settings, still, turns, known, credible_faults(unit.faults))
    found = _search(unit, applied, criteria, at, progress)
    refused = sorted((each for each in found if isinstance(each, UnusedInterval)), key=_start_of)
    fitted = sorted(
        (each for each in found if isinstance(each, FittedSpin)), key=lambda each: each.chain.start
    )
    if not fitted:
        raise ProcedureError(
            f"{recording.name}: {_nothing_found([each.from_start(unit.log.time) for each in refused], unit)}"
        )
    spins = tuple(
        describe_spin(
            each.figures,
            each.blocks,
            each.chain.rests,
            (each.chain.start, each.chain.end),
            label=f"spin {number}",
            gravity=strength,
            gravity_sigma=bias_sigma(place, applied),
            level_floor=level_floor,
            preset=preset,
            pace_sigma=recording.metadata.pace_sigma,
            stamp_sigma=recording.metadata.stamp_sigma,
        )
        for number, each in enumerate(fitted, start=1)
    )
    combined = combine(spins).with_gravity(spins[-1].up, bias_sigma(place, applied))
    return SpinResult(
        name=recording.name,
        source=log_name(recording),
        serial=recording.metadata.serial,
        axes=recording.metadata.body,
        reading=recording.metadata.reading,
        spins=spins,
        accelerometer_bias=combined.accelerometer_bias,
        gyroscope_bias=combined.gyroscope_bias,
        covariance=combined.covariance,
        agreement=combined.agreement,
        refused=tuple(
            (interval.start, interval.end, explain(interval.failure.from_start(unit.log.time)))
            for interval in refused
        ),
        trace=trace_of(unit.acquired),
        gravity=strength,
        gravity_source=place.source,
        gravity_sigma=place.sigma,
        temperature=unit.acquired.temperature,
        calibration_hash=applied.hash() if applied else "",
        applied=applied.content() if applied else {},
        options={
            "still": still,
            **preset.options,
            "true-turns": str(known) if known else None,
            "level-floor": level_floor,
            "at": [list(times) for times in at],
        },
        warnings=(
            *_notices(unit),
            *scale_notice(unit.acquired, strength),
            *combined.warnings,
            *scale_warning(combined, spins, applied, strength),
        ),
        software=f"tumble {_core.__version__}",
        time=unit.log.time,
    )


def _acquired(
    recording: Recording, applied: Calibration | None, gravity: float, progress: SampleProgress | None
) -> Imu:
    """Reads the recording for the first time: where it stood still, and whether it can serve."""
    if recording.parts:
        raise ProcedureError(
            f"{recording.name}: is a folder of {count_of('log', len(recording.parts))}, one per pose; "
            "give the one log in which the robot stands and turns"
        )
    recording.need_both_triads("a spin")
    unit = acquire(recording, applied, _first_half(progress))
    refuse_if_damaged(unit.name, unit, credible_faults(unit.faults))
    if len(unit.acquired.rest_times):
        refuse_if_misread(unit.name, unit.acquired, gravity)
    return unit


def _search(
    unit: Imu,
    applied: Calibration | None,
    criteria: Criteria,
    at: Sequence[tuple[float, float]],
    progress: SampleProgress | None,
) -> list[FittedSpin | UnusedInterval]:
    """Reads the recording again, and fits what may be spins as soon as their samples are there."""
    quiet = sorted([*rests_of(unit.acquired), *_rests_refused_as_turning(unit, applied)], key=_start_of)
    rests = true_rests(quiet)
    if not rests:
        return [*rejected_rests(unit.acquired)]
    logged = _logged(unit)
    windows = _windows(at, logged, unit)
    unread_segments = [
        (number, unread) for number, window in enumerate(windows) for unread in segments_within(window, rests)
    ]
    endless = [
        unread
        for _, unread in ([] if at else unread_segments)
        if unread.rest is None and unread.interval.within(logged).seconds > LONGEST_SPIN
    ]
    kept = [(number, unread) for number, unread in unread_segments if unread not in endless]
    intervals = [unread.interval for _, unread in kept]
    pieces = read_intervals(unit.recording, applied, intervals, _second_half(progress, unit.acquired.samples))
    segments = (
        (Segment(samples, unread.rest), _ends(number, unread, following))
        for samples, (number, unread), following in zip(pieces, kept, [*kept[1:], None], strict=True)
    )
    found: list[FittedSpin | UnusedInterval] = [
        _too_long(unread.interval.within(logged)) for unread in endless
    ]
    for link in chains_of(segments, rests, criteria, given=bool(at)):
        found += fit_or_split(link, criteria) if isinstance(link, Chain) else [link]
    return [_explained(each, quiet, rests) for each in found]


def _explained(
    found: FittedSpin | UnusedInterval, quiet: Sequence[Rest], rests: Sequence[Rest]
) -> FittedSpin | UnusedInterval:
    """Names the rest of another bias that the motion before the first rest holds, if it holds one."""
    if not isinstance(found, UnusedInterval) or found.failure.kind is not SpinFailureKind.MOVED_FIRST:
        return found
    inside = [each for each in quiet if found.start <= each.start and each.end <= found.end]
    others = [each for each in inside if all(each is not rest for rest in rests)]
    if not others:
        return found
    longest = max(others, key=lambda rest: rest.end - rest.start)
    change = longest.angular_rate - rests[0].angular_rate
    axis = int(np.argmax(np.abs(change)))
    figures = {"start": longest.start, "end": longest.end, "axis": axis, "change": float(change[axis])}
    return replace(found, failure=SpinFailure(SpinFailureKind.BIAS_CHANGED, figures))


def _rests_refused_as_turning(unit: Imu, applied: Calibration | None) -> list[Rest]:
    """Finds rests refused for another rate than those beside them: a robot turning evenly outvotes them."""
    turning = (each for each in rejected_rests(unit.acquired) if each.failure.kind is SpinFailureKind.TURNING)
    intervals = sorted((Interval(each.start, each.end) for each in turning), key=_start_of)
    if not intervals:
        return []
    pieces = read_intervals(unit.recording, applied, intervals)
    return [rest_from(samples) for samples in pieces if len(samples) > 1]


def _start_of(each: Rest | Interval | UnusedInterval) -> float:
    return each.start


def _logged(unit: Imu) -> Interval:
    """From when to when the recording goes, s."""
    time = unit.acquired.trace()[0]
    return Interval(float(time[0]), float(time[-1]))


def _windows(at: Sequence[tuple[float, float]], logged: Interval, unit: Imu) -> list[Interval]:
    """Returns the times to search for spins; raises `ProcedureError` where they do not fit the recording."""
    time = unit.log.time
    _refuse_no_intervals(at)
    windows = [Interval(start + time.zero, end + time.zero) for start, end in sorted(at)]
    for (start, end), window, following in zip(sorted(at), windows, [*windows[1:], None], strict=False):
        said = f"{unit.name}: spin from {start:g} to {end:g} s"
        if not window.start < window.end:
            raise ProcedureError(f"{said}: ends before it begins; give START:END")
        if window.within(logged).seconds <= 0.0:
            raise ProcedureError(
                f"{said}: lies outside the log, which lasts {time.at(logged.end)}; give "
                "seconds from its start"
            )
        if following and following.start < window.end:
            raise ProcedureError(
                f"{said}: overlaps that from {time.since(following.start):g} s; give intervals "
                "that do not overlap"
            )
    return windows or [Interval(-math.inf, math.inf)]


def _refuse_no_intervals(at: object) -> None:
    """Raises `ProcedureError`, in one line, where times are no list of pairs of numbers."""
    for each in at if isinstance(at, Sequence) and not isinstance(at, str) else [at]:
        pair = each if isinstance(each, Sequence) and not isinstance(each, str) else ()
        if len(pair) != 2 or not all(isinstance(time, Real) for time in pair):
            raise ProcedureError(
                f"at {short(each)}: is no interval; give pairs of times such as (10.0, 25.0)"
            )


def _ends(number: int, unread: UnreadSegment, following: tuple[int, UnreadSegment] | None) -> bool:
    """Returns whether a spin cannot go on from a segment to the following one."""
    if following is None:
        return True
    window, after = following
    return window != number or after.interval.start != unread.interval.end


def _too_long(interval: Interval) -> UnusedInterval:
    failure = SpinFailure(SpinFailureKind.NO_REST_FOR_LONG, {"duration": interval.seconds})
    return UnusedInterval(interval.start, interval.end, failure)


def _nothing_found(refused: Sequence[UnusedInterval], unit: Imu) -> str:
    """One line: why no spin was found, and what to do."""
    advice = "let the robot stand still for 5 s, then turn on the spot once round or more"
    times = unit.acquired.rest_times
    if len(times) == 0:
        why = _named(refused)
        return f"shows no rest of 1 s or longer{': ' if why else ''}{why}; {advice}"
    if not refused:
        return explain(SpinFailure(SpinFailureKind.NO_TURN))
    hint = ""
    little = any(_shows_too_small_a_turn(interval.failure) for interval in refused)
    if little and unit.recording.metadata.gyroscope_unit.name == "deg/s":
        hint = "; if its gyroscope was logged in rad/s, give --gyroscope-unit rad/s"
    if len(refused) == 1 and remedy(refused[0].failure):
        return f"shows no spin that can be used: {_named(refused)}{hint}"
    return f"shows no spin that can be used: {_named(refused)}; {advice}{hint}"


def _shows_too_small_a_turn(failure: SpinFailure) -> bool:
    """Returns whether it turned less than it should have, as if a gyroscope in deg/s were read as rad/s."""
    if failure.kind is SpinFailureKind.NO_TURN:
        return failure.figures.get("turned", 0.0) >= SMALLEST_SHOWN
    return failure.kind in (SpinFailureKind.PUSHED, SpinFailureKind.TURNED_TOO_LITTLE)


def _named(refused: Sequence[UnusedInterval]) -> str:
    """Lists the longest segments with their reasons; of several, without the remedy of each."""
    longest = sorted(
        sorted(refused, key=lambda interval: interval.start - interval.end)[:MOST_NAMED], key=_start_of
    )
    words = explain if len(refused) == 1 else cause
    named = [
        f"{interval.start:.1f} to {interval.end:.1f} s {words(interval.failure)}" for interval in longest
    ]
    more = len(refused) - len(longest)
    return ", ".join([*named, *([f"and {more} more"] if more else [])])


def _notices(unit: Imu) -> Iterator[str]:
    """Describes omissions, and remarks of the reader for the user.

    A robot that turned at a rate of robots confirms the unit of the gyroscope.
    """
    yield from unit.recording.metadata.remarks
    yield from unit.recording.metadata.assumptions_but("gyroscope")
    yield from unit.notices
    yield from on_slow_rate(unit.rate)
    yield from coarse_notices(unit.acquired, unit.triads)
    yield from correction_notice(unit.recording.metadata, "these biases hold")


def scale_warning(
    combined: CombinedBiases, spins: Sequence[Spin], applied: Calibration | None, gravity: float
) -> Iterator[str]:
    """Describes the effect of a scale error on the accelerometer bias, unless it was calibrated before."""
    if not combined.accelerometer_bias.observable:
        return
    if applied and applied.accelerometer and "matrix" in applied.accelerometer.estimated:
        return
    axis = "xyz"[int(np.argmax(np.abs(spins[-1].up)))]
    yield (
        "along the vertical a scale error of the accelerometer cannot be separated from bias: 1 % of it "
        f"would be {0.01 * gravity:.2g} m/s^2, mostly of {axis}; nor across the vertical an angle between "
        f"accelerometer and gyroscope: 0.1 deg would be {gravity * math.radians(0.1):.2g} m/s^2; a turntable "
        "calibration, given with --calibration, corrects both"
    )


def _first_half(progress: SampleProgress | None) -> SampleProgress | None:
    """Counts the samples of a first pass, and expects as many again."""
    if progress is None:
        return None
    return lambda done, expected: progress(done, None if expected is None else 2 * expected)


def _second_half(progress: SampleProgress | None, samples: int) -> SampleProgress | None:
    if progress is None:
        return None
    return lambda done, _: progress(samples + done, 2 * samples)
