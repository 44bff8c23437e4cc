"""Step 1: a recording becomes the rests and turns of one unit, and is refused where it cannot be trusted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from tumble import _core
from tumble.acquisition import messages
from tumble.acquisition.alternation import AlternationWatch
from tumble.acquisition.duplicate_sensors import UnitHeads, refuse_copies
from tumble.acquisition.imu import ChannelFault, Imu, known, pose_files
from tumble.acquisition.standstills import standstills
from tumble.acquisition.thermometer import ThermometerFault, ThermometerWatch, thermometer_notices
from tumble.calibration.temperature_counts import TemperatureCounts
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.debugging import debug, is_debugged
from tumble.foundation.errors import ProcedureError
from tumble.foundation.log_time import LogTime
from tumble.foundation.provenance import LogFacts
from tumble.foundation.recording import Chunk, FloatArray, Recording, SampleProgress
from tumble.foundation.results import Rest, Trace
from tumble.foundation.units import TRIADS, UNITS, Triad
from tumble.foundation.words import count_of
from tumble.logs import ChunkStream, Counts
from tumble.logs.units import length_of_gravity, odd_step, usual_step

if TYPE_CHECKING:
    from tumble.calibration.document import Calibration

FEWEST_RESTS = 4
"""Four directions determine three axes and a bias."""
LARGEST_SHARE_NOT_FINITE = 0.01
NO_GRAVITY_RATIO = 0.05
"""Mean length of specific force at rest against gravity below which gravity was removed from it."""
WITHOUT_GRAVITY = (
    "gravity was removed from it; record the raw acceleration: another topic, column or setting of the driver"
)
LARGEST_GRAVITY_RATIO = 1.25
"""Mean length of specific force at rest against gravity: beyond it the unit is wrong, not the sensor."""
NOTABLE_GRAVITY_RATIO = 1.1
"""The same: beyond it no data sheet allows so much of bias and scale error."""


def acquire(
    recording: Recording,
    calibration: Calibration | None = None,
    progress: SampleProgress | None = None,
    rates: Literal["reference", "target"] | None = None,
) -> Imu:
    """Reads a recording once, in chunks, and keeps sums over its rests and turns.

    `rates` looks for constant rates, which are then no rests, as of a reference or of a target.
    `progress` receives samples done, and samples expected where they are known beforehand.

    Raises `LogError` where it cannot be read, `ProcedureError` where its rate is no
    IMU's, two files show one pose, or one is a copy of another.
    """
    if calibration is not None:
        from tumble.calibration.turned_axes import in_axes

        calibration = in_axes(calibration, recording.metadata.body)
    segmenter = _core.Segmenter(
        rates=rates,
        pace_sigma=recording.metadata.pace_sigma,
        stamp_sigma=recording.metadata.stamp_sigma,
    )
    counts = Counts()
    heads = UnitHeads(recording.metadata.triads)
    of_parts: dict[str, UnitHeads] = {}
    temperatures = TemperatureCounts(calibration, recording.metadata.triads)
    failed: list[ThermometerFault] = []
    turns = AlternationWatch(recording.metadata.triads)
    frozen: list[tuple[float, float]] = []
    stuck: list[ChannelFault] = []
    samples = 0
    duration = 0.0
    start = math.nan
    for name, part in zip(pose_files(recording) or ("",), recording.parts or (recording,), strict=True):
        segmenter.begin_part(name)
        of_parts[name] = UnitHeads(recording.metadata.triads)
        stream, thermometer = part.chunks(), ThermometerWatch()
        begun: float | None = None
        for chunk in stream:
            if samples == 0 and (odd := odd_step(usual_step(chunk.time))):
                raise ProcedureError(
                    f"{odd}; give the unit of its time with --time-unit", about=recording.name
                )
            heads.push(chunk)
            of_parts[name].push(chunk)
            temperatures.add(len(chunk), chunk.temperature)
            thermometer.push(chunk)
            turns.push(chunk)
            still = standstills(chunk, recording.metadata.triads)
            frozen += [(float(chunk.time[a]), float(chunk.time[b])) for a, b in still.frozen]
            stuck += still.stuck
            moving = still.moving(chunk)
            accelerometer, gyroscope = corrected(moving, calibration)
            push_recorded(segmenter, moving, accelerometer, gyroscope, recording.metadata.triads)
            samples += len(chunk)
            begun = float(chunk.time[0]) if begun is None else begun
            start = begun if math.isnan(start) else start
            ended = float(chunk.time[-1])
            if progress is not None:
                progress(samples, stream.expected if isinstance(stream, ChunkStream) else None)
        if isinstance(stream, ChunkStream):
            counts.add(stream.counts)
        duration += 0.0 if begun is None else ended - begun
        failed += thermometer.faults()
    digests = {name: each.digest() for name, each in of_parts.items()}
    refuse_copies(digests.items(), recording.name)
    turns.refuse(recording.name)
    about = recording.metadata
    facts = LogFacts(
        duration=duration,
        axes=about.body,
        reading=about.reading,
        time=LogTime(start),
        has_assumed_unit=any(unit.is_assumed for unit in (about.accelerometer_unit, about.gyroscope_unit)),
    )
    notices = (
        *counts.notices(),
        *temperatures.notices(),
        *thermometer_notices(failed, facts.time),
        *stood_still(frozen, facts.time),
    )
    acquired = segmenter.finish()
    _say_what_was_read(recording.name, samples, duration, acquired, notices)
    return Imu(
        recording,
        acquired,
        notices,
        facts,
        heads.gyroscope_digest(),
        heads.twice(),
        next(iter(digests.values())),
        tuple(stuck),
        tuple(failed),
        tuple(counts.clock_sets),
    )


def stood_still(frozen: Sequence[tuple[float, float]], time: LogTime) -> Iterator[str]:
    """Describes stretches, s, in which all readings stood still."""
    for first, last in frozen:
        yield messages.STOOD_STILL.format(span=time.span(first, last))


def _say_what_was_read(
    name: str, samples: int, duration: float, acquired: _core.Acquired, notices: Sequence[str]
) -> None:
    if not is_debugged(__name__):
        return
    rests, turns = len(acquired.rest_specific_force), len(acquired.turn_angles)
    debug(__name__, "%s: %d samples over %.3f s, %d rests, %d turns", name, samples, duration, rests, turns)
    for start, end, why in acquired.rejected_rests:
        debug(__name__, "%s: %.3f to %.3f s is no rest: %s", name, start, end, messages.REST_REJECTIONS[why])
    for notice in notices:
        debug(__name__, "%s: %s", name, notice)


def push_recorded(
    segmenter: _core.Segmenter,
    chunk: Chunk,
    accelerometer: FloatArray,
    gyroscope: FloatArray,
    triads: tuple[Triad, ...],
) -> None:
    """Passes samples to the core, which knows both triads; one that was not recorded is zero."""
    segmenter.push(
        chunk.time,
        accelerometer if "accelerometer" in triads else np.zeros((len(chunk), 3)),
        gyroscope if "gyroscope" in triads else np.zeros((len(chunk), 3)),
        chunk.temperature,
    )


def corrected(chunk: Chunk, calibration: Calibration | None) -> tuple[FloatArray, FloatArray]:
    """Specific force and angular rate, freed of what an earlier calibration knows, if there is one."""
    if calibration is None:
        return chunk.accelerometer, chunk.gyroscope
    return calibration.correct(chunk.accelerometer, chunk.gyroscope, chunk.temperature)


def refuse_if_unfit(name: str, imu: Imu, gravity: float) -> None:
    """Raises `ProcedureError`, in one line, for the first thing that makes the recording unfit for poses."""
    unit = imu.acquired
    refuse_if_damaged(name, imu, imu.faults)
    problem = _saturated_turns(unit, imu.faults, imu.log.time) or _rests(unit, imu.log.time)
    if problem:
        raise ProcedureError(problem, about=name)
    misread = _accelerometer_unit(unit, gravity) if "accelerometer" in imu.triads else None
    if misread is None and imu.triads == TRIADS:
        misread = _gyroscope_unit(unit)
    if misread:
        raise ProcedureError(misread.line_among_others(name), about=name)


def refuse_if_damaged(name: str, imu: Imu, faults: Sequence[ChannelFault]) -> None:
    """Raises `ProcedureError`, in one line, where samples, time or a channel cannot serve any procedure."""
    unit, time = imu.acquired, imu.log.time
    problem = _samples(unit) or _time(unit, time) or dead_channel(faults, time) or imu.axes_twice
    if problem:
        raise ProcedureError(problem, about=name)


def refuse_if_misread(name: str, unit: _core.Acquired, gravity: float) -> None:
    """Raises `ProcedureError`, in one line, where the length at rest shows a wrong accelerometer unit."""
    misread = _accelerometer_unit(unit, gravity)
    if misread:
        raise ProcedureError(misread.line(), about=name)


def refuse_if_rate_misread(name: str, unit: _core.Acquired) -> None:
    """Raises `ProcedureError`, in one line, where another unit or order of axes of the gyroscope fits.

    A gyroscope that fits in none is not refused: its scale may be far off.
    """
    misread = _gyroscope_unit(unit)
    if misread and misread.option:
        raise ProcedureError(misread.line(), about=name)


def _samples(unit: _core.Acquired) -> str:
    if unit.samples + unit.not_finite == 0:
        return "holds no samples; record again"
    if unit.not_finite > LARGEST_SHARE_NOT_FINITE * (unit.samples + unit.not_finite):
        return f"{unit.not_finite} samples are not numbers (NaN); repair the logger and record again"
    return ""


def _time(unit: _core.Acquired, time: LogTime) -> str:
    if unit.first_backwards is None:
        return ""
    when = time.at(unit.first_backwards, 6)
    return f"time does not advance at {when}; sort the samples and remove repeated time stamps"


def dead_channel(faults: Sequence[ChannelFault], time: LogTime) -> str:
    """Names a channel that shows nothing, or nothing at rest; empty if there is none."""
    for channel, kind, value, first, last, *_ in faults:
        known = {"channel": channel, "value": value, "unit": si_unit(channel)}
        if kind == "stuck":
            return messages.STUCK.format(**known, span=time.span(first, last))
        if kind == "saturated at rest":
            return messages.SATURATED_AT_REST.format(**known, first=time.at(first, 3))
    return ""


def _saturated_turns(unit: _core.Acquired, faults: Sequence[ChannelFault], time: LogTime) -> str:
    """Names the channel of the gyroscope that costs most turns; saturation in a few only costs these."""
    lost = sum(not complete for complete in unit.turn_complete)
    for fault in faults:
        if fault.is_of_gyroscope and 2 * lost > len(unit.turn_complete):
            turns = f"{lost} of {len(unit.turn_complete)} turns"
            seen = _saturated(fault.channel, fault.value, time.at(fault.first, 3))
            return f"{seen}, in {turns}; turn more slowly or choose a larger range"
    return ""


def _saturated(channel: str, value: float, first: str) -> str:
    return f"{channel} is saturated at {value:.6g} {si_unit(channel)}, first at {first}"


def si_unit(channel: str) -> str:
    """Returns the unit that a channel of that name is kept in."""
    return UNITS["accelerometer" if channel.startswith("accelerometer") else "gyroscope"]


def _rests(unit: _core.Acquired, time: LogTime) -> str:
    found = len(unit.rest_times)
    if found >= FEWEST_RESTS or unit.constant_rates:
        return ""
    refused = "".join(
        f"; {time.span(start, end)} s is not a rest: {messages.REST_REJECTIONS[why]}"
        for start, end, why in unit.rejected_rests[:3]
    )
    return (
        f"shows {count_of('rest', found)}, needs at least {FEWEST_RESTS} in different directions{refused}; "
        "hold each pose still for 5 s or longer"
    )


@dataclass(frozen=True, slots=True)
class _Misread:
    """A log that was read in a unit, or in an order of axes, that is not its own."""

    what: str
    option: str = ""
    value: str = ""
    """Option of the command line that corrects it, and its value, where one option does."""

    def line(self) -> str:
        """One line for a recording that is read alone."""
        return self.what + (f"; give --{self.option} {self.value}" if self.option else "")

    def line_among_others(self, name: str) -> str:
        """One line for a recording of that name among others."""
        alone = f", or for this log only --for {name}:{self.option}={self.value}" if self.option else ""
        return self.line() + alone


def scale_notice(unit: _core.Acquired, gravity: float) -> Iterator[str]:
    """Describes a length at rest farther from gravity than that of any sensor on sale."""
    if not len(unit.rest_times):
        return
    length = length_of_gravity(unit.rest_specific_force)
    if 0.0 < length < NO_GRAVITY_RATIO * gravity:
        yield f"accelerometer reads {length:.4g} m/s^2 at rest: {WITHOUT_GRAVITY}"
    elif length > 0.0 and abs(math.log(length / gravity)) > math.log(NOTABLE_GRAVITY_RATIO):
        yield (
            f"accelerometer reads {length:.4g} m/s^2 at rest, {length / gravity:.2f} of gravity: check its "
            "unit and its range, or whether it is damaged"
        )


def _accelerometer_unit(unit: _core.Acquired, gravity: float) -> _Misread | None:
    if not len(unit.rest_times):
        return None
    length = length_of_gravity(unit.rest_specific_force)
    ratio = length / gravity
    if 1 / LARGEST_GRAVITY_RATIO < ratio < LARGEST_GRAVITY_RATIO:
        return None
    seen = f"accelerometer reads {length:.4g} m/s^2 at rest, gravity is {gravity:.4g}"
    if ratio < NO_GRAVITY_RATIO:
        return _Misread(f"{seen}: {WITHOUT_GRAVITY}")
    if abs(math.log(ratio * STANDARD_GRAVITY)) < math.log(LARGEST_GRAVITY_RATIO):
        return _Misread(f"{seen}: g were taken for m/s^2", "accelerometer-unit", "g")
    if abs(math.log(ratio / STANDARD_GRAVITY)) < math.log(LARGEST_GRAVITY_RATIO):
        return _Misread(f"{seen}: m/s^2 were taken for g", "accelerometer-unit", "m/s^2")
    return _Misread(f"{seen}: the unit is not known; give its size with --accelerometer-scale")


def _gyroscope_unit(unit: _core.Acquired) -> _Misread | None:
    consistency, figure, axes = _core.gyroscope_consistency(unit)
    if consistency == "scaled" and figure > 1.0:
        return _Misread(
            "gyroscope turns gravity 57.3 times too far: deg/s were taken for rad/s",
            "gyroscope-unit",
            "deg/s",
        )
    if consistency == "scaled":
        return _Misread(
            "gyroscope turns gravity 57.3 times too little: rad/s were taken for deg/s",
            "gyroscope-unit",
            "rad/s",
        )
    if consistency == "permuted":
        return _axes(axes)
    if consistency == "inconsistent":
        return _Misread(
            f"gyroscope and accelerometer disagree by {figure:.0f} deg about how the unit turned, in any "
            "unit and order of axes; check that both belong to one unit"
        )
    return None


def _axes(fit: list[tuple[int, float]]) -> _Misread:
    """`fit`: for each axis of the accelerometer, index and sign of the gyroscope's that belongs to it."""
    in_order = all(index == row for row, (index, _) in enumerate(fit))
    if in_order and all(sign < 0 for _, sign in fit):
        return _Misread(
            "gyroscope turns the wrong way about every axis: the axes are left-handed (two are exchanged, or "
            "one has its sign turned)",
            "axes",
            "x,y,-z",
        )
    order = ",".join(f"{'-' if sign < 0 else ''}{'xyz'[index]}" for index, sign in fit)
    if in_order:
        signs = ",".join(f"{sign:.0f}" for _, sign in fit)
        return _Misread(
            f"gyroscope and accelerometer have opposite signs: the gyroscope fits as {order}",
            "gyroscope-scale",
            signs,
        )
    return _Misread(
        f"axes of gyroscope and accelerometer are swapped: the gyroscope fits as {order}; "
        "name the columns of both in one order with --columns"
    )


def rests_of(
    unit: _core.Acquired, poses: dict[int, str] | None = None, triads: tuple[Triad, ...] = TRIADS
) -> tuple[Rest, ...]:
    """Lists the rests of a unit, with pose names where known; NaN for a triad that was not recorded."""
    poses = poses or {}
    forces = known(unit.rest_specific_force, "accelerometer", triads)
    force_sigmas = known(unit.rest_specific_force_sigma, "accelerometer", triads)
    rates = known(unit.rest_angular_rate, "gyroscope", triads)
    rate_sigmas = known(unit.rest_angular_rate_sigma, "gyroscope", triads)
    samples = unit.rest_samples
    return tuple(
        Rest(
            start=float(start),
            end=float(end),
            samples=samples[k],
            specific_force=forces[k],
            angular_rate=rates[k],
            specific_force_sigma=force_sigmas[k],
            angular_rate_sigma=rate_sigmas[k],
            pose=poses.get(k, ""),
        )
        for k, (start, end) in enumerate(unit.rest_times)
    )


def rests_after_rates(unit: _core.Acquired) -> frozenset[int]:
    """Returns the rests between which, and the rest before, the unit turned at a constant rate."""
    starts = [start for start, *_ in unit.constant_rates]
    after = np.searchsorted(unit.rest_times[:, 0], starts)
    return frozenset(int(rest) for rest in after)


def rejected_rests_of(unit: _core.Acquired) -> tuple[Rest, ...]:
    """Lists the stretches that only looked like rests, with the reason."""
    return tuple(
        unused_rest(start, end, messages.REST_REJECTIONS[why]) for start, end, why in unit.rejected_rests
    )


def unused_rest(start: float, end: float, why: str) -> Rest:
    """Describes a stretch, s, that is not used, for that reason."""
    unknown = np.full(3, np.nan)
    return Rest(start, end, 0, unknown, unknown, unknown, unknown, used=False, remark=why)


def trace_of(unit: _core.Acquired, triads: tuple[Triad, ...] = TRIADS) -> Trace:
    """Draws the recording at a glance; NaN for a triad that was not recorded."""
    time, forces, rates = unit.trace()
    return Trace(time, known(forces, "accelerometer", triads), known(rates, "gyroscope", triads))
