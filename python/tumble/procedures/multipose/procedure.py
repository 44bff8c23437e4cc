"""The multi-pose procedure on a log: an IMU held still in many orientations, turned by hand in between."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.acquisition.acquire import (
    acquire,
    refuse_if_damaged,
    refuse_if_misread,
    refuse_if_rate_misread,
    rejected_rests_of,
    rests_of,
    stood_still,
    trace_of,
    unused_rest,
)
from tumble.acquisition.imu import Imu, log_name
from tumble.acquisition.notices import notices
from tumble.acquisition.stamps import open_sampled
from tumble.acquisition.standstills import standstills
from tumble.calibration.document import Calibration
from tumble.calibration.start import started_from
from tumble.calibration.temperature_counts import TemperatureCounts
from tumble.foundation.arrays import AXES
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError
from tumble.foundation.gravity import local_gravity
from tumble.foundation.growing_array import GrowingArray
from tumble.foundation.log_reading import LogReading, read_as_counts
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.provenance import Provenance, date_now, log_digest
from tumble.foundation.recording import (
    Chunk,
    FloatArray,
    Metadata,
    Recording,
    RecordingSource,
    SampleProgress,
)
from tumble.foundation.results import LARGEST_WIDENING, Rest, TriadResult
from tumble.foundation.units import TRIADS
from tumble.logs import ReadOptions, open_recording, parse_spec
from tumble.logs.session import procedure_of
from tumble.poses.triads import triad_result
from tumble.procedures.magnetometer.earth_field import EarthField, earth_field
from tumble.procedures.magnetometer.procedure import calibrated, resting_accelerometer, track_of
from tumble.procedures.magnetometer.result import MagnetometerResult
from tumble.procedures.multipose.dead_band import DeadBand
from tumble.procedures.multipose.messages import (
    MORE_MAY_SHOW,
    NO_SENSOR_HAS,
    NOT_RANDOM,
    explain,
    tremor_words,
)
from tumble.procedures.multipose.pose_means import (
    each_points_elsewhere,
    held,
    with_noise_of_means,
    without_time,
)
from tumble.procedures.multipose.result import (
    Faces,
    FerrarisTriad,
    MultiposeResult,
    NextOrientation,
    NextTurn,
    NominalScale,
    PoseFit,
    TimeBase,
    TurnFit,
)
from tumble.procedures.multipose.sections import (
    FULL_TURNS,
    Section,
    Sections,
    are_faces,
    sections_of,
    sections_of_folder,
)
from tumble.procedures.multipose.stated_rate import StampedRate, stamped_rate
from tumble.procedures.multipose.turn_bias import TurnBias, TurnLoss

OWN_AXES = "the case frame is that of the accelerometer's own axes: no equipment shows how it is mounted"
"""Reason why the mounting of the accelerometer is not observable."""

FEW_TO_CHECK = 4
"""Directions beyond the nine unknowns, below which hardly anything checks them."""
STANDS_OUT = 0.5
"""Weight in the robust loss below which a pose is named."""
DECISIVE = 0.95
"""Leverage above which nothing but the pose itself shows what it shows."""

LARGEST_NON_LINEARITY = 1e-3
"""g/g^2: second order beyond that of accelerometers."""
NOT_LINEAR = (
    "the accelerometer is not linear beyond what sensors are, by more than the square of the force: check "
    "its range, and that it was not corrected by another calibration"
)

ANGLES = slice(6, 12)
"""Angles among the parameters of a triad: non-orthogonality and mounting."""

_UNKNOWNS = {
    0: "scale x",
    3: "non-orthogonality xy",
    4: "scale y",
    6: "non-orthogonality zx",
    7: "non-orthogonality yz",
    8: "scale z",
    9: "bias x",
    10: "bias y",
    11: "bias z",
}
"""Parameter that dominates an element of [M row by row, b]."""

_RATE_UNKNOWNS = (
    *(
        f"scale {axis}" if axis == along else f"response of axis {axis} along {along}"
        for axis in "xyz"
        for along in "xyz"
    ),
    *(f"bias {axis}" for axis in "xyz"),
    *(f"g-sensitivity of axis {axis} along {along}" for axis in "xyz" for along in "xyz"),
)
"""Parameter that dominates an element of [M row by row, b] and then G row by row of a gyroscope."""


class TooLittleShownError(ProcedureError):
    """The poses do not show all that is asked of the accelerometer; more may."""


def multipose(
    source: RecordingSource,
    *,
    gravity: float | None = None,
    latitude: float | None = None,
    height: float | None = None,
    gravity_uncertainty: float | None = None,
    g_sensitivity: bool = False,
    earth_rate: bool = False,
    raw: bool = False,
    calibration: Calibration | str | Path | None = None,
    faces: bool = False,
    sections: Sections | None = None,
    pose_means: bool = False,
    magnetometer: EarthField | bool = False,
    current: bool = False,
    read: ReadOptions | None = None,
    operator: str = "",
    station: str = "",
    progress: SampleProgress | None = None,
) -> MultiposeResult:
    """Calibrates a unit that was held still in many orientations and turned by hand in between.

    At rest the length of specific force is gravity in any orientation, which shows scale, non-orthogonality
    and bias of the accelerometer; between rests the gyroscope has to turn gravity as the accelerometer finds
    it turned. Gravity is standard, or `gravity` in m/s^2, or follows from `latitude` in deg and `height` in
    m; `gravity_uncertainty` is its 1-sigma, m/s^2, by docs/theory/uncertainty.md if not given. With
    `g_sensitivity` the gyroscope's response to specific force is fitted. With `earth_rate`, which needs the
    latitude, the upward part of the Earth's rotation is taken off. With `raw`, readings are counts of a scale
    nobody knows, which gravity and the turns show. `calibration` is one of the unit: its noise weighs rests
    and turns, its temperature drift is taken off, and both are kept.

    With `faces` the unit lay on the six faces of a box, with a full turn about each axis: what is known of
    the directions then takes the place of more orientations. `sections` are labelled stretches, a file or
    a list of `Section`: what is labelled a rest is taken for one, and six faces for six faces. With
    `pose_means` each row of a table is the mean of a pose: the scatter of the means is their noise.

    With `magnetometer`, True or the Earth's field at the place, that of the log is calibrated at the same
    rests, in the frame of the accelerometer; with `current` its response to the current in the log as well.

    Raises `TumbleError`, in one line, where the poses do not show all that is asked of the accelerometer. A
    gyroscope that cannot be calibrated has its reason in `gyroscope_reason`.

    Method: docs/theory/multipose.md.
    """
    place = local_gravity(gravity, latitude, height, gravity_uncertainty)
    strength = place.value
    if earth_rate and latitude is None:
        raise ProcedureError("the Earth's rotation depends on latitude; give it with --latitude")
    if raw and magnetometer:
        raise ProcedureError("--magnetometer is of readings in SI units, --raw of counts; leave one out")
    if pose_means:
        _refuse_beside_means(faces=faces, sections=sections is not None, magnetometer=bool(magnetometer))
    recording = _opened(source, read, raw=raw, pose_means=pose_means)
    track = track_of(recording) if magnetometer else None
    if raw and calibration is not None:
        raise ProcedureError("--calibration is of readings in SI units, --raw of counts; leave one out")
    before = started_from(calibration, recording.metadata)
    labelled = _labelled(recording, sections)
    if pose_means:
        recording, labelled = held(recording)
    on_faces = faces or are_faces(labelled)
    unit = _acquired(recording, strength, raw=raw, progress=progress)
    has_gyroscope = "gyroscope" in unit.triads
    temperatures = TemperatureCounts(before, unit.triads)
    samples = _samples(unit, temperatures, progress)
    # Labelled sections are used as they are.
    frozen = [] if labelled else list(standstills(samples, unit.triads).frozen)
    spans = [(float(samples.time[first]), float(samples.time[last])) for first, last in frozen]
    used = _without(samples, frozen)

    def fit(before: Calibration | None, density: FloatArray | None = None) -> _core.MultiposeFigures:
        compensated = used if before is None else before.at_reference(used)
        return _core.multipose_of(
            compensated.time,
            compensated.accelerometer,
            compensated.gyroscope,
            strength,
            gyroscope=has_gyroscope,
            g_sensitivity=g_sensitivity,
            latitude=math.radians(latitude) if earth_rate and latitude is not None else None,
            raw=raw,
            noise_density=_known(before, "noise_density") if density is None else density,
            bias_instability=_known(before, "bias_instability"),
            faces=on_faces,
            sections=_placed(labelled, unit),
            pace_sigma=recording.metadata.pace_sigma,
            stamp_sigma=recording.metadata.stamp_sigma,
            gravity_sigma=place.sigma or 0.0,
        )

    noise_of_means = None
    try:
        if pose_means:
            figures, noise_of_means = with_noise_of_means(lambda density: fit(before, density))
        else:
            figures = fit(before)
        if before is not None and any(drift.scale for drift in before.temperature_drifts().values()):
            # The effect of a drifting scale depends on the bias, which the first fit estimates.
            figures = fit(_with_biases(before, figures))
    except _core.CoreError as error:
        kind = TooLittleShownError if error.args[0] in MORE_MAY_SHOW else ProcedureError
        raise kind(explain(*error.args) + _hint(recording, read), about=recording.name) from None
    found = replace(unit, acquired=figures["acquired"])
    gyroscope = _gyroscope(figures, found.acquired)
    stamped = stamped_rate(source, read) if has_gyroscope and not pose_means else None
    if gyroscope is not None and figures["gyroscope"] is not None:
        objections = _about_turns(figures["gyroscope"], stamped, on_faces=on_faces)
        gyroscope = replace(gyroscope, objections=(*gyroscope.objections, *objections))
    reason = _gyroscope_reason(figures, has_gyroscope)
    magnetic, magnetic_reason = _magnetometer(track, magnetometer, figures, unit, current=current)
    sha256 = log_digest(parse_spec(source).path) if isinstance(source, str | Path) else ""
    result = MultiposeResult(
        name=recording.name,
        source=log_name(recording),
        serial=recording.metadata.serial or (before.serial if before else ""),
        accelerometer=_accelerometer(figures, found.acquired, on_faces=on_faces),
        gyroscope=gyroscope,
        gyroscope_reason=reason,
        magnetometer=magnetic,
        magnetometer_reason=magnetic_reason,
        poses=tuple(_poses(figures["poses"])),
        turns=tuple(_turns(figures["gyroscope"])),
        next_orientation=_next(figures["next"]),
        next_turn=_next_turn(figures["gyroscope"]),
        rests=(
            *_trembling(rests_of(found.acquired, triads=unit.triads), figures),
            *rejected_rests_of(found.acquired),
            *_left_out(figures, found.acquired),
        ),
        trace=trace_of(found.acquired, unit.triads),
        gravity=strength,
        gravity_source=place.source,
        gravity_sigma=place.sigma,
        time_base=None if gyroscope is None else _time_base(recording.metadata, read),
        tolerance=figures["tolerance"],
        implausible_scale=_implausible(figures),
        faces=_faces(figures),
        nominal_scale=_nominal(figures),
        temperature=unit.acquired.temperature,
        log=replace(unit.log, sha256=sha256, reading=_reading(unit, _nominal(figures))),
        provenance=_provenance(source, operator, station),
        start_hash=before.hash() if before else "",
        start=before.content() if before else {},
        options={
            "g-sensitivity": g_sensitivity,
            "earth-rate": earth_rate,
            "raw": raw,
            "faces": on_faces,
            "pose-means": pose_means,
        },
        software=f"tumble {_core.__version__}",
    )
    warnings = (
        *(() if result.nominal_scale is None else stood_still(spans, unit.log.time)),
        *([] if noise_of_means is None else [_about_means(noise_of_means)]),
        *_warnings(result, found, figures, unit.acquired.missing),
        *_about_the_start(result),
        *([stamped.sentence()] if stamped is not None and _is_a_warning(stamped, gyroscope) else []),
        *temperatures.notices(),
        *(() if track is None else track.remarks),
        *(() if magnetic is None else magnetic.warnings),
        *([f"the magnetometer is not calibrated: {magnetic_reason}"] if magnetic_reason else []),
    )
    return replace(result, warnings=warnings)


def _refuse_beside_means(**others: bool) -> None:
    for name, given in others.items():
        if given:
            raise ProcedureError(f"--pose-means is of a table with a row a pose; leave out --{name}")


def _opened(source: RecordingSource, read: ReadOptions | None, *, raw: bool, pose_means: bool) -> Recording:
    """Opens a log; rows that are means of poses need no time."""
    if pose_means:
        read = without_time(read)
    opened = open_recording if pose_means else open_sampled
    return opened(source, as_counts(read) if raw else read)


def _hint(recording: Recording, read: ReadOptions | None) -> str:
    """Returns what may explain a refusal besides the poses."""
    if each_points_elsewhere(recording):
        return "; each row points elsewhere: if each is the mean of a pose, give --pose-means"
    return f"; is {read.rate:g} Hz of --rate right?" if read is not None and read.rate else ""


def _about_means(sigma: float) -> str:
    return (
        f"each row is taken for the mean of a pose, and the noise of a mean is the scatter about the fit, "
        f"{1e3 * sigma:.2g} mm/s^2"
    )


def _magnetometer(
    track: MagneticTrack | None,
    place: EarthField | bool,
    figures: _core.MultiposeFigures,
    unit: Imu,
    *,
    current: bool,
) -> tuple[MagnetometerResult | None, str]:
    """Returns the magnetometer, calibrated at the rests; else nothing, and the reason."""
    if track is None:
        return None, ""
    known = earth_field() if isinstance(place, bool) else place
    facts = unit.log
    try:
        return calibrated(
            track, resting_accelerometer(figures), known, current=current, name=unit.name, facts=facts
        ), ""
    except ProcedureError as error:
        return None, error.why


def _provenance(source: RecordingSource, operator: str, station: str) -> Provenance:
    """Returns operator and station: those stated, else those of the recorded session."""
    asked = procedure_of(source)
    return Provenance(
        date_now(), operator or (asked.operator if asked else ""), station or (asked.station if asked else "")
    )


def _labelled(recording: Recording, sections: Sections | None) -> tuple[Section, ...]:
    if sections is not None:
        return sections_of(sections)
    return sections_of_folder(recording) if recording.parts or recording.files else ()


def as_counts(read: ReadOptions | None) -> ReadOptions:
    """Returns options by which the numbers of a log are read as they stand."""
    return replace(read or ReadOptions(), as_numbers=True)


def _acquired(recording: Recording, gravity: float, *, raw: bool, progress: SampleProgress | None) -> Imu:
    """Reads the recording for the first time, and refuses what cannot serve."""
    if "accelerometer" not in recording.metadata.triads:
        raise ProcedureError(
            "holds no accelerometer readings, which show gravity; name a log that has them",
            about=recording.name,
        )
    unit = acquire(recording, None, progress)
    refuse_if_damaged(unit.name, unit, [] if raw else unit.faults)
    if raw or not len(unit.acquired.rest_times):
        return unit
    try:
        refuse_if_misread(unit.name, unit.acquired, gravity)
    except ProcedureError as error:
        raise ProcedureError(f"{error.why}; or take readings for counts, with --raw", unit.name) from None
    if "gyroscope" in unit.triads:
        refuse_if_rate_misread(unit.name, unit.acquired)
    return unit


def _with_biases(before: Calibration, figures: _core.MultiposeFigures) -> Calibration:
    """Puts the biases that were found in place of those of before."""
    gyroscope = figures["gyroscope"]
    found = {
        "accelerometer": figures["accelerometer"]["b"],
        "gyroscope": None if gyroscope is None else gyroscope["calibration"]["b"],
    }
    triads = {name: getattr(before, name) for name, b in found.items() if b is not None}
    return before.model_copy(
        update={name: triad and triad.model_copy(update={"b": found[name]}) for name, triad in triads.items()}
    )


def _known(before: Calibration | None, term: str) -> FloatArray | None:
    """Returns a term of the noise of all channels, (6,), NaN where it is not known."""
    if before is None:
        return None
    stated = [getattr(getattr(before, triad), term, None) for triad in TRIADS]
    return np.concatenate([np.full(3, np.nan) if values is None else values for values in stated])


def _samples(unit: Imu, temperatures: TemperatureCounts, progress: SampleProgress | None) -> Chunk:
    """Reads all samples, those without a number left out, and holds them once."""
    columns = (GrowingArray(), GrowingArray(AXES), GrowingArray(AXES), GrowingArray())
    for chunk in unit.recording.chunks():
        good = _holds_numbers(chunk, unit)
        rate = chunk.gyroscope if "gyroscope" in unit.triads else np.zeros((len(chunk), 3))
        temperature = np.full(len(chunk), np.nan) if chunk.temperature is None else chunk.temperature
        found = (chunk.time[good], chunk.accelerometer[good], rate[good], temperature[good])
        for column, values in zip(columns, found, strict=True):
            column.add(values)
        temperatures.add(int(good.sum()), temperature[good])
        if progress is not None:
            progress(unit.acquired.samples, None)
    return Chunk(*(column.whole() for column in columns))


def _without(samples: Chunk, frozen: list[tuple[int, int]]) -> Chunk:
    """Omits repetitions, which look like a rest in a turn; others take their place, and nothing is copied."""
    if not frozen or samples.temperature is None:
        return samples
    columns = (samples.time, samples.accelerometer, samples.gyroscope, samples.temperature)
    end = frozen[0][0] + 1
    for (_, last), (following, _) in zip(frozen, [*frozen[1:], (len(samples) - 1, 0)], strict=True):
        moved = following - last
        for column in columns:
            column[end : end + moved] = column[last + 1 : following + 1]
        end += moved
    return Chunk(*(column[:end] for column in columns))


def _holds_numbers(chunk: Chunk, unit: Imu) -> NDArray[np.bool_]:
    """(n,) which samples of a chunk hold numbers in all channels that were recorded."""
    good = np.isfinite(chunk.time) & np.isfinite(chunk.accelerometer).all(axis=1)
    return good & np.isfinite(chunk.gyroscope).all(axis=1) if "gyroscope" in unit.triads else good


def _placed(sections: Sequence[Section], unit: Imu) -> list[tuple[str, int, int]]:
    """Returns sections by their places among the samples that hold numbers.

    Raises `ProcedureError` where one ends after the log.
    """
    if not sections:
        return []
    good = np.concatenate([_holds_numbers(chunk, unit) for chunk in unit.recording.chunks()])
    last = max(sections, key=lambda each: each.end)
    if last.end > len(good):
        raise ProcedureError(
            f"{last.label} ends at sample {last.end}, the log at {len(good)}; sections count samples from 0",
            about=unit.name,
        )
    before = np.concatenate([[0], np.cumsum(good)])
    return [(each.label, int(before[each.start]), int(before[each.end])) for each in sections]


def _faces(figures: _core.MultiposeFigures) -> Faces | None:
    faces = figures["faces"]
    if faces is None:
        return None
    gyroscope = faces["gyroscope"]
    return Faces(
        tilt=faces["tilt"],
        sections=tuple(faces["sections"]),
        accelerometer=_ferraris(faces["accelerometer"]),
        gyroscope=None if gyroscope is None else _ferraris(gyroscope),
        K_ga=faces["g_sensitivity"],
    )


def _ferraris(figures: _core.FerrarisFigures) -> FerrarisTriad:
    compared = np.array(figures["parameters"] or []).reshape(-1, 2)
    values = compared[:, 0].copy()
    values[ANGLES] = np.degrees(values[ANGLES])
    scale, rotation, bias = (figures[name] for name in ("scale", "rotation", "bias"))
    return FerrarisTriad(np.diag(scale), rotation, bias, values, compared[:, 1])


def _trembling(rests: Sequence[Rest], figures: _core.MultiposeFigures) -> Iterator[Rest]:
    """Describes the tremor of each rest."""
    for rest, tremor in zip(rests, figures["tremors"], strict=True):
        yield replace(rest, remark=tremor_words(tremor))


def _left_out(figures: _core.MultiposeFigures, unit: _core.Acquired) -> Iterator[Rest]:
    """Lists the stretches in which the unit was held still that are not used, but for those rejected."""
    rejected = [(start, end) for start, end, _ in unit.rejected_rests]
    for start, end, tremor in figures["left_out"]:
        if not any(first < end and start < last for first, last in rejected):
            why = tremor_words(tremor) or "shorter than a rest, without the ends"
            yield unused_rest(start, end, why)


def _implausible(figures: _core.MultiposeFigures) -> float | None:
    return None if figures["gyroscope"] is None else figures["gyroscope"]["implausible_scale"]


def _accelerometer(figures: _core.MultiposeFigures, unit: _core.Acquired, *, on_faces: bool) -> TriadResult:
    found = triad_result(
        "accelerometer", figures["accelerometer"], unit.noise_density[:3], unit.bias_instability[:3], {}
    )
    assert found is not None
    if figures["non_linearity"] is not None and _is_beyond_sensors(figures["non_linearity"][0]):
        found = replace(found, objections=(*found.objections, NOT_LINEAR))
    if on_faces:
        return found
    parameters = tuple(
        replace(
            each,
            value=math.nan,
            sigma=math.inf,
            low=math.nan,
            high=math.nan,
            observable=False,
            reason=OWN_AXES,
        )
        if each.name.startswith("mounting")
        else each
        for each in found.parameters
    )
    return replace(
        found,
        parameters=parameters,
        unobservable=(f"mounting: {OWN_AXES}",),
        rank=figures["accelerometer"]["rank"],
    )


def _gyroscope(figures: _core.MultiposeFigures, unit: _core.Acquired) -> TriadResult | None:
    gyroscope = figures["gyroscope"]
    calibration = None if gyroscope is None else gyroscope["calibration"]
    return triad_result("gyroscope", calibration, unit.noise_density[3:], unit.bias_instability[3:], {})


def _gyroscope_reason(figures: _core.MultiposeFigures, has_gyroscope: bool) -> str:
    if not has_gyroscope:
        return "no gyroscope was read"
    refusal = figures["gyroscope_refusal"]
    return "" if refusal is None else explain(*refusal)


def _about_turns(
    figures: _core.MultiposeGyroscope, stamped: StampedRate | None, *, on_faces: bool
) -> Iterator[str]:
    """Lists what makes the gyroscope of the turns another one than that of the fit."""
    if stamped is not None and not stamped.agrees:
        yield stamped.sentence()
    band, bias = figures["dead_band"], figures["turn_bias"]
    if band is not None:
        yield DeadBand(*band).sentence()
    elif bias is not None and bias["contradicts"]:
        yield TurnBias(**bias).sentence()
    elif (loss := figures["turn_loss"]) is not None:
        yield TurnLoss(*loss).sentence()
    elif (stamped is None or stamped.agrees) and not on_faces:
        # On faces full turns show the scale, within the degree that a hand and an edge are known to.
        widening = figures["turn_widening"]
        if widening > LARGEST_WIDENING:
            yield NOT_RANDOM.format(times=widening)


def _is_a_warning(stamped: StampedRate, gyroscope: TriadResult | None) -> bool:
    """Returns whether a stated rate is no objection to the gyroscope, but worth a warning."""
    return bool(stamped.missing) if stamped.agrees else gyroscope is None


def _time_base(metadata: Metadata, read: ReadOptions | None) -> TimeBase:
    if metadata.rate is None:
        return TimeBase(None, "stamps of the log", metadata.pace_sigma)
    is_given = read is not None and read.rate is not None
    return TimeBase(metadata.rate, "given" if is_given else "stated in the log", metadata.pace_sigma)


def _poses(figures: _core.MultiposePoses) -> Iterator[PoseFit]:
    ups = figures["force"] / np.linalg.norm(figures["force"], axis=1)[:, None]
    for k, up in enumerate(ups):
        yield PoseFit(
            up=up,
            before=figures["before"][k],
            after=figures["after"][k],
            sigma=figures["sigma"][k],
            held_out=figures["held_out"][k],
            weight=figures["weight"][k],
            direction=figures["direction"][k],
            leverage=figures["leverage"][k],
            influence=figures["influence"][k],
        )


def _turns(figures: _core.MultiposeGyroscope | None) -> Iterator[TurnFit]:
    if figures is not None:
        each = zip(figures["turns"], figures["angles_before"], figures["angles_after"], strict=True)
        for (before, after), angle_before, angle in each:
            yield TurnFit(before, after, angle_before, angle)


def _next(figures: _core.NextOrientationFigures | None) -> NextOrientation | None:
    if figures is None:
        return None
    return NextOrientation(figures["up"], _UNKNOWNS[figures["unknown"]], figures["before"], figures["after"])


def _next_turn(figures: _core.MultiposeGyroscope | None) -> NextTurn | None:
    found = None if figures is None else figures["next"]
    if found is None:
        return None
    parameter = _RATE_UNKNOWNS[found["unknown"]]
    return NextTurn(found["axis"], found["up"], parameter, found["before"], found["after"])


def _reading(unit: Imu, nominal: NominalScale | None) -> LogReading:
    """Returns how the log was read; its counts by the scale for which the calibration holds."""
    if nominal is None:
        return unit.log.reading
    return read_as_counts(
        unit.log.reading, {"accelerometer": nominal.accelerometer, "gyroscope": nominal.gyroscope}
    )


def _nominal(figures: _core.MultiposeFigures) -> NominalScale | None:
    scale = figures["nominal_scale"]
    if scale is None:
        return None
    return NominalScale(1.0 / scale[0], None if figures["gyroscope"] is None else 1.0 / scale[1])


def _warnings(
    result: MultiposeResult, unit: Imu, figures: _core.MultiposeFigures, missing: int
) -> Iterator[str]:
    if result.nominal_scale is None:
        yield from notices(unit, missing)
    else:
        yield from _about_counts(result.nominal_scale)
    if result.faces is not None:
        yield from _about_faces(result.faces, result)
    elif result.directions - 9 < FEW_TO_CHECK:
        yield (
            f"{result.directions} orientations for nine unknowns: hardly anything checks the fit; 15 to 20 "
            "are good"
        )
    if figures["non_linearity"] is not None:
        yield _about_non_linearity(*figures["non_linearity"])
    outliers = [str(k + 1) for k, pose in enumerate(result.poses) if pose.weight < STANDS_OUT]
    if outliers:
        yield f"rest {', '.join(outliers)}: deviates from all others and weighs less in the fit; touched?"
    decisive = [str(k + 1) for k, pose in enumerate(result.poses) if pose.leverage > DECISIVE]
    if decisive and result.faces is None:
        yield (
            f"rest {', '.join(decisive)}: no other rest shows the same, so nothing checks it; add poses "
            "near it"
        )
    if result.implausible_scale:
        rate = unit.acquired.samples / max(unit.log.duration, 1e-9)
        yield NO_SENSOR_HAS.format(
            scale=result.implausible_scale, probable=rate * result.implausible_scale, rate=rate
        )
    named = {(start, end) for start, end, _ in unit.acquired.rejected_rests}
    for rest in result.left_out:
        if (rest.start, rest.end) not in named:
            yield f"{result.log.time.span(rest.start, rest.end)} s is not used: {rest.remark}"
    if result.gyroscope_reason:
        yield result.gyroscope_reason
    if figures["gyroscope"] is not None:
        yield from _about_the_gyroscope(figures["gyroscope"], result)
    for triad in result.triads:
        yield from triad.objections
        if triad.widening > 1.0:
            yield (
                f"{triad.triad}: residuals are {triad.widening:.1f} times what noise explains; its sigmas "
                "include that"
            )


def _is_beyond_sensors(square: Sequence[Sequence[float]]) -> bool:
    each = zip(*square, strict=True)
    return any(STANDARD_GRAVITY * (abs(value) - 2.0 * sigma) > LARGEST_NON_LINEARITY for value, sigma in each)


def _about_non_linearity(square: Sequence[Sequence[float]], magnitude: Sequence[Sequence[float]]) -> str:
    by_square = _each_axis(square, 1e6 * STANDARD_GRAVITY)
    # A term by the magnitude is half of what the scales of both signs differ by.
    by_sign = _each_axis(magnitude, 2e6)
    return (
        f"the accelerometer is not linear: by the square of the force it reads {by_square} ug/g^2 more, and "
        f"scales of both signs differ by {by_sign} ppm; bias and scale are found beside that, which no "
        "correction takes off"
    )


def _each_axis(term: Sequence[Sequence[float]], factor: float) -> str:
    each = zip("xyz", *term, strict=True)
    return ", ".join(f"{axis} {factor * value:+.2g} ± {factor * sigma:.1g}" for axis, value, sigma in each)


def _about_the_start(result: MultiposeResult) -> Iterator[str]:
    if "gyroscope" in result.start and result.gyroscope is None:
        yield ("the gyroscope is kept as --calibration has it, in the case frame of that one")


def _about_faces(faces: Faces, result: MultiposeResult) -> Iterator[str]:
    if result.gyroscope is not None and any(label in FULL_TURNS for label, _, _ in faces.sections):
        yield (
            f"a full turn is taken to be full within {math.degrees(_core.FULL_TURN_SIGMA):.2g} deg: little "
            "else in a session on six faces shows it"
        )
    if faces.gyroscope is None and "gyroscope" in {triad.triad for triad in result.triads}:
        yield "no full turn about each axis was found, so there is no gyroscope by the formulas of Ferraris"


def _about_counts(scale: NominalScale) -> Iterator[str]:
    gyroscope = (
        "" if scale.gyroscope is None else f" --gyroscope-scale {scale.gyroscope:g} --gyroscope-unit rad/s"
    )
    yield (
        "readings are counts, and the calibration holds for logs read with --accelerometer-scale "
        f"{scale.accelerometer:g} --accelerometer-unit m/s^2{gyroscope}"
    )


def _about_the_gyroscope(figures: _core.MultiposeGyroscope, result: MultiposeResult) -> Iterator[str]:
    with_g = figures["with_g_sensitivity"]
    if with_g is not None:
        yield (
            "the gyroscope's bias depends on how the unit is held: with --g-sensitivity gravity would be "
            f"turned to {math.degrees(with_g):.2g} deg, now {math.degrees(result.angle_after):.2g} deg"
        )
    if figures["bias_excess"] > 0.0:
        yield (
            f"the gyroscope's bias varies by {figures['bias_excess']:.2g} rad/s from rest to rest, more than "
            "noise explains; its sigmas include that"
        )
    if figures["turn_excess"] > 0.0:
        yield (
            f"turns are off by {math.degrees(figures['turn_excess']):.2g} deg beyond noise; the sigmas "
            "include that"
        )
