"""Alignment of the units of a redundant set, from a log in which they moved together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from tumble import _core
from tumble.acquisition.duplicate_sensors import duplicate_sensors
from tumble.acquisition.imu import log_name
from tumble.acquisition.stamps import with_sample_times
from tumble.foundation.documents import document_kind, write_document
from tumble.foundation.errors import LogError, ProcedureError
from tumble.foundation.log_time import LogTime
from tumble.foundation.recording import FloatArray, Recording, RecordingSource, SampleProgress, sources_of
from tumble.foundation.sample_rates import on_slow_rate
from tumble.foundation.units import Triad
from tumble.logs import ReadOptions
from tumble.procedures.align.messages import explain
from tumble.procedures.align.outputs import describe_alignment
from tumble.procedures.align.result import AlignResult, UnitAlignment
from tumble.procedures.align.samples import UnitSamples, read_samples
from tumble.procedures.redundancy.logs import UnitLog, open_units, serials_of

LARGEST_OFFSET = 5.0
"""s by which clocks may differ by default."""
_SCHEMA = "tumble-redundancy/1"
SETTINGS_KIND = document_kind(_SCHEMA)


def align(
    primary: RecordingSource,
    secondaries: RecordingSource | Sequence[RecordingSource],
    log: str | Path | None = None,
    *,
    search: float = LARGEST_OFFSET,
    read: ReadOptions | Mapping[str, ReadOptions] | None = None,
    progress: SampleProgress | None = None,
) -> AlignResult:
    """Finds rotation, time offset and lever arm of secondaries against a primary that moved with them.

    Each unit is the name of an IMU in `log`, or `LOG:NAME`, or a recording. Clocks may differ by up to
    `search`, s; where logs have no time in common at all, their beginnings are aligned first. `read` holds
    the options of reading all of them, or each by what was typed. `progress` receives the samples done, and
    samples expected where they are known.

    Raises `TumbleError`, in one line, where a log cannot be read or its motion shows nothing.

    Method: docs/theory/align.md.
    """
    if not search >= 0.0:
        raise ProcedureError(f"--search {search:g}: give a time in s, zero or above")
    units = _opened(primary, secondaries, log, read)
    recordings = [_recorded(unit) for unit in units]
    samples = read_samples(units, progress)
    ours, *theirs = zip(units, samples, strict=True)
    # The core lets other threads run, and pairs have nothing to do with each other.
    with ThreadPoolExecutor() as pool:
        aligned = tuple(pool.map(lambda each: _aligned(ours, each, search), theirs))
    return AlignResult(
        primary=ours[0].name,
        source=log_name(recordings[0]),
        units=aligned,
        options={"search": search},
        warnings=(
            *duplicate_sensors((unit.name, read.gyroscope_digest) for unit, read in (ours, *theirs)),
            *(
                f"{unit.name}: {notice}"
                for unit, recording, read in zip(units, recordings, samples, strict=True)
                for notice in (
                    *recording.metadata.remarks,
                    *recording.metadata.assumptions,
                    *read.notices,
                    *on_slow_rate(read.rate),
                )
            ),
        ),
        software=f"tumble {_core.__version__}",
        serials=serials_of(units),
        time=LogTime(ours[1].start),
    )


def open_aligned(
    primary: RecordingSource,
    secondaries: RecordingSource | Sequence[RecordingSource],
    log: str | Path | None = None,
    read: ReadOptions | Mapping[str, ReadOptions] | None = None,
) -> list[Recording]:
    """Opens the recordings of all units, primary first, with the times that `align` takes them at."""
    return [_recorded(unit) for unit in _opened(primary, secondaries, log, read)]


def _opened(
    primary: RecordingSource,
    secondaries: RecordingSource | Sequence[RecordingSource],
    log: str | Path | None,
    read: ReadOptions | Mapping[str, ReadOptions] | None,
) -> tuple[UnitLog, ...]:
    units = open_units((primary, *sources_of(secondaries)), log, read, allow_missing=True, live_times=False)
    return tuple(replace(unit, recording=with_sample_times(_recorded(unit))) for unit in units)


def _recorded(unit: UnitLog) -> Recording:
    if unit.recording is None:
        raise LogError(unit.missing)
    return unit.recording


def _aligned(
    primary: tuple[UnitLog, UnitSamples], secondary: tuple[UnitLog, UnitSamples], search: float
) -> UnitAlignment:
    (our_unit, ours), (unit, theirs) = primary, secondary
    around = _difference(ours, theirs)
    try:
        figures = _core.align_units(
            ours.arrays,
            theirs.arrays,
            search=search,
            around=around,
            one_clock=_share_a_clock(_recorded(our_unit), _recorded(unit)),
            rate_bias=ours.gyroscope_bias,
            rate_bias_sigma=ours.gyroscope_bias_sigma,
        )
    except _core.CoreError as error:
        raise ProcedureError(f"{unit.name}: {explain(error, our_unit.name, search)}") from error
    rate = min(ours.rate, theirs.rate)
    span = min(each.end - each.start for each in (ours, theirs))
    figures = _with_uncertain_times(figures, (our_unit, unit), span)
    figures = _with_rounding(figures, ours, theirs)
    return describe_alignment(unit.name, unit.source, figures, around, LogTime(ours.start), rate)


def _with_uncertain_times(
    figures: _core.AlignFigures, units: Sequence[UnitLog], span: float
) -> _core.AlignFigures:
    """Widens offset and skew by what fitted times, or stamps that scatter and were kept, leave open.

    Stamps in the wrong by as much for all of a log show in no residual. `span` is s of motion that both saw
    (docs/theory/clocks.md, eq. 16). Times by lines of arrivals are compared as they are: the skew is that
    between the lines.
    """
    metadata = [_recorded(unit).metadata for unit in units]
    shifts, paces = zip(*(each.fit_sigmas for each in metadata), strict=True)
    kept = math.hypot(*(each.stamp_sigma for each in metadata))
    found = figures.copy()
    found["time_offset_sigma"] = math.hypot(figures["time_offset_sigma"], *shifts, kept)
    of_pace = math.sqrt(12.0) * kept / span if kept else 0.0
    found["skew_sigma"] = math.hypot(figures["skew_sigma"], *paces, of_pace)  # clocks.md, eq. 16
    return found


def _with_rounding(figures: _core.AlignFigures, ours: UnitSamples, theirs: UnitSamples) -> _core.AlignFigures:
    """Widens biases by what rounding leaves on them (docs/theory/align.md, "Clock and rotation")."""
    squares = figures["sensor_from_primary"] ** 2

    def widened(sigma: FloatArray, triad: Triad) -> FloatArray:
        added = theirs.rounding[triad] ** 2 + squares @ ours.rounding[triad] ** 2
        return np.asarray(np.sqrt(sigma**2 + added))

    found = figures.copy()
    found["gyroscope_bias_sigma"] = widened(figures["gyroscope_bias_sigma"], "gyroscope")
    if (forces := figures["forces"]) is not None:
        forces = forces.copy()
        forces["accelerometer_bias_sigma"] = widened(forces["accelerometer_bias_sigma"], "accelerometer")
        found["forces"] = forces
    return found


def _share_a_clock(ours: Recording, theirs: Recording) -> bool:
    """Returns whether one clock stamped both; clocks of sensors aligned to the computer's are separate."""
    one = bool(ours.metadata.clock) and ours.metadata.clock == theirs.metadata.clock
    return one and ours.metadata.pace_sigma == theirs.metadata.pace_sigma == 0.0


def _difference(ours: UnitSamples, theirs: UnitSamples) -> float:
    """Returns the offset to search around, s: none, unless the logs have no time in common."""
    apart = ours.end < theirs.start or theirs.end < ours.start
    return ours.start - theirs.start if apart else 0.0


def unit_settings(result: AlignResult) -> dict[str, dict[str, object]]:
    """Returns what `tumble redundancy` is to know of each secondary: what was shown, and nothing else."""
    return {unit.name: _settings(unit) for unit in result.units}


def _settings(unit: UnitAlignment) -> dict[str, object]:
    found: dict[str, object] = {}
    if unit.sensor_from_primary is not None:
        found["sensor_from_primary"] = unit.sensor_from_primary.tolist()
    if bool(np.isfinite(unit.lever_arm).all()):
        found["lever_arm"] = unit.lever_arm.tolist()
    return {**found, "time_offset": unit.time_offset} if math.isfinite(unit.time_offset_sigma) else found


def write_settings(result: AlignResult, path: Path | str) -> None:
    """Writes the settings of the units as YAML that `tumble redundancy --settings` reads."""
    header = (
        f"Units of a redundant set relative to {result.primary}: rotation from its case frame, place in it "
        "(m), and what is to be added to their time (s). What the motion did not show is left out."
    )
    write_document(path, header, {"schema": _SCHEMA, "units": unit_settings(result)})
