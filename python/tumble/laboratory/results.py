"""Results as the registry keeps them: what of a calibration file and its page becomes rows."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from tumble.calibration.contributions import NOISE, part
from tumble.calibration.document import KIND, Calibration, MagnetometerCalibration, TriadCalibration
from tumble.calibration.limits import Limits
from tumble.foundation.days import mistake_in_date
from tumble.foundation.documents import LARGEST_DOCUMENT
from tumble.foundation.error_decomposition import PAIRS
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_reading import read_whole
from tumble.foundation.file_status import entries, is_file, is_folder
from tumble.foundation.files import PAGE
from tumble.foundation.plain import finite, finite_or_none
from tumble.foundation.procedures import PROCEDURES
from tumble.foundation.units import CALIBRATED_TRIADS, CALIBRATED_UNITS, CalibratedTriad
from tumble.foundation.words import quoted
from tumble.laboratory.chain import sha256_of_json

AXES = ("x", "y", "z")
LARGEST_PAGE = 64 << 20
"""Bytes."""
SIMPLE = "simple"
"""Decision rule: within the limit, whatever the uncertainty."""
_DECIMALS = 9
"""Decimals of M and b that distinguish two results whose options do not; beyond them computers differ."""
_WORDS = frozenset(procedure.word for procedure in PROCEDURES)
_NOISE_UNITS = {"noise_density": "/sqrt(Hz)", "bias_instability": "", "random_walk": "/s/sqrt(Hz)"}


@dataclass(frozen=True, slots=True)
class Run:
    """A run of a procedure that gave a calibration, or parts of it."""

    procedure: str
    options: Mapping[str, Any]
    software: str
    date: str
    operator: str
    station: str
    logs: tuple[Mapping[str, Any], ...]
    verdict: str

    @property
    def origin(self) -> str:
        """Hash that distinguishes runs: a part that a later calibration took over was measured once."""
        logs = sorted(log.get("sha256", "") for log in self.logs)
        return sha256_of_json([self.procedure, finite(self.options), self.date, logs])


@dataclass(frozen=True, slots=True)
class RegisteredParameter:
    """A number of a result with its uncertainty."""

    name: str
    """`accelerometer bias x`."""
    unit: str
    value: float | None
    """None where the data do not show it."""
    u: float | None
    """Combined standard uncertainty; None where it is not stated, or the value is not observable."""
    common: float | None
    """Part of `u` that the reference leaves on all its targets alike; None where nobody states it."""
    origin: str
    measured: str
    """Date of the run that found it."""


@dataclass(frozen=True)
class Result:
    """A calibration with all that the registry keeps of it."""

    calibration: Calibration
    document: bytes
    page: bytes | None
    source: str
    """Place that it came from, for messages."""

    @cached_property
    def content(self) -> Mapping[str, Any]:
        """Content of the calibration file as plain data."""
        return self.calibration.content()

    @cached_property
    def run(self) -> Run:
        """Run that made the file: the latest of those that gave a part of it."""
        return latest_run(self.content)

    @cached_property
    def identity(self) -> str:
        """Hash of inputs, options and method version: the same run twice is one result.

        Options that a file does not state, such as units of a log, show in M and b, which therefore count to
        nine decimals.
        """
        content, run = self.content, self.run
        reference = content.get("reference", {})
        figures = {
            triad: [_rounded(content[triad]["M"]), _rounded(content[triad]["b"])]
            for triad in CALIBRATED_TRIADS
            if triad in content
        }
        return sha256_of_json(
            {
                "unit": [self.calibration.name, self.calibration.serial],
                "procedure": run.procedure,
                "options": finite(run.options),
                "software": run.software,
                "inputs": sorted(log.get("sha256", "") for log in run.logs),
                "reference": [
                    reference.get("log", {}).get("sha256", ""),
                    reference.get("calibration_hash", ""),
                ],
                "gravity": content.get("gravity", {}).get("value"),
                "limits": content.get("limits"),
                "parts": sorted(
                    [each["method"]["procedure"], *each["gave"]] for each in content.get("contributions", ())
                ),
                "figures": figures,
            }
        )

    @property
    def session(self) -> str:
        """Hash that is the same for all units of one run."""
        content, run = self.content, self.run
        shared = content.get("reference", {}).get("log", {}).get("sha256", "")
        own = sorted(log.get("sha256", "") for log in run.logs)
        return sha256_of_json(
            [
                run.procedure,
                finite(run.options),
                run.software,
                run.operator,
                run.station,
                shared or own,
                run.date,
            ]
        )

    def refuse_false_dates(self) -> None:
        """Raises `TumbleError` where a run that gave a part of it has no date on which it may have been."""
        for run in runs_of(self.content):
            if run.date and (mistake := mistake_in_date(run.date)):
                raise TumbleError(f"the date {quoted(run.date)} {mistake}", about=self.source)

    def recordings(self) -> Iterator[tuple[str, Mapping[str, Any]]]:
        """Yield the role and description of each log."""
        for log in self.run.logs:
            yield "unit", log
        if shared := self.content.get("reference", {}).get("log"):
            yield "reference", shared

    @cached_property
    def parameters(self) -> tuple[RegisteredParameter, ...]:
        """All numbers of the calibration that a run found."""
        return tuple(_parameters(self.calibration, self.content))


def read_results(places: Iterable[Path | str]) -> Iterator[Result]:
    """Read calibration files of procedures: files that are named, and all that lie in folders that are.

    Raises `TumbleError` where a file cannot be read or is not a procedure's result; in a folder other files
    are passed over.
    """
    for place in map(Path, places):
        if is_folder(place):
            for path in entries(place):
                if path.suffix in (".yaml", ".yml") and is_file(path) and KIND.begins(path):
                    found = read_result(path)
                    if found.run.procedure in _WORDS:
                        yield found
            continue
        found = read_result(place)
        if found.run.procedure not in _WORDS:
            made = found.run.procedure or "nobody knows what"
            raise TumbleError(
                f"was made by {made}, not by a procedure of Tumble; give results of "
                f"{', '.join(sorted(_WORDS))}",
                about=str(place),
            )
        yield found


def read_result(path: Path) -> Result:
    """Read a calibration file and the page beside it; raises `TumbleError` where that cannot be done."""
    calibration = Calibration.load(path)
    page = path.with_suffix(".html")
    document = read_whole(path, LARGEST_DOCUMENT, "calibration file")
    shown = None
    if is_file(page) and PAGE.begins(page) and page.stat().st_size <= LARGEST_PAGE:
        shown = read_whole(page, LARGEST_PAGE, "page")
    return Result(calibration, document, shown, str(path))


def latest_run(content: Mapping[str, Any]) -> Run:
    """Return the run that a calibration file was written by, from its content."""
    known = runs_of(content)
    # The contribution is the later of one second: it was added to what stood there.
    return max(enumerate(known), key=lambda each: (each[1].date, each[0]))[1] if known else _NOTHING


def runs_of(content: Mapping[str, Any]) -> list[Run]:
    """Return all runs that gave a part of a calibration file, from its content, its method first."""
    runs = [_own_run(content), *map(_contributed, content.get("contributions", ()))]
    return [run for run in runs if run is not None]


_NOTHING = Run("", {}, "", "", "", "", (), "")


def _own_run(content: Mapping[str, Any]) -> Run | None:
    if "method" not in content:
        return None
    logs = [content["log"]] if "log" in content else []
    return _contributed({**content, "logs": logs})


def _contributed(content: Mapping[str, Any]) -> Run:
    method = content["method"]
    return Run(
        procedure=method["procedure"],
        options=method.get("options", {}),
        software=content.get("software", ""),
        date=content.get("date", ""),
        operator=content.get("operator", ""),
        station=content.get("station", ""),
        logs=tuple(content.get("logs", ())),
        verdict=content.get("verdict", ""),
    )


def _parameters(calibration: Calibration, content: Mapping[str, Any]) -> Iterator[RegisteredParameter]:
    own = _own_run(content)
    given = {name: _contributed(each) for each in content.get("contributions", ()) for name in each["gave"]}
    for triad in CALIBRATED_TRIADS:
        section: TriadCalibration | None = getattr(calibration, triad)
        if section is None:
            continue
        for group, numbers in _groups(triad, section):
            run = given.get(part(triad, group), own)
            if run is None:
                continue
            for name, unit, value, u, common in numbers:
                yield RegisteredParameter(f"{triad} {name}", unit, value, u, common, run.origin, run.date)


Number = tuple[str, str, float | None, float | None, float | None]
"""Name, unit, value, combined standard uncertainty, and the common part of it."""


def _groups(triad: CalibratedTriad, section: TriadCalibration) -> Iterator[tuple[str, Sequence[Number]]]:
    """Yield the numbers of each part of a triad that was found."""
    unit = CALIBRATED_UNITS[triad]
    sigma = section.sigma
    inherited = section.inherited.sigma if section.inherited is not None else None
    if sigma is not None and "bias" in section.estimated:
        common = _axes(inherited.bias if inherited else None)
        yield "bias", _numbers("bias", AXES, unit, section.b, sigma.bias, common)
    if sigma is not None and "matrix" in section.estimated and section.angles is not None:
        scale = np.linalg.norm(section.M, axis=1)
        common = _axes(inherited.scale if inherited else None)
        numbers = [*_numbers("scale", AXES, "1", scale, sigma.scale, common)]
        angles, spread = section.angles, sigma
        pairs = [
            [getattr(each, pair) if each is not None else None for pair in PAIRS]
            for each in (
                angles.non_orthogonality,
                spread.non_orthogonality,
                inherited.non_orthogonality if inherited else None,
            )
        ]
        numbers += _numbers("non-orthogonality", PAIRS, "deg", *pairs)
        common = _axes(inherited.mounting if inherited else None)
        numbers += _numbers("mounting", AXES, "deg", angles.mounting, spread.mounting, common)
        yield "matrix", numbers
    response = getattr(section, "g_sensitivity", None)
    if response is not None:
        spread_of = getattr(section, "g_sensitivity_sigma", None)
        pairs_of = [f"{row}{column}" for row in AXES for column in AXES]
        spreads = [None] * 9 if spread_of is None else spread_of.ravel()
        yield (
            "g-sensitivity",
            _numbers("g-sensitivity", pairs_of, "rad/s per m/s^2", response.ravel(), spreads, [None] * 9),
        )
    if isinstance(section, MagnetometerCalibration) and section.current is not None:
        spreads_of = [None] * 3 if section.current_sigma is None else section.current_sigma
        unit_of = section.unit_of_current
        yield "current", _numbers("current", AXES, unit_of, section.current, spreads_of, [None] * 3)
    noise = [
        number
        for key in NOISE
        if (values := getattr(section, key)) is not None
        for number in _numbers(
            key.replace("_", "-"), AXES, f"{unit}{_NOISE_UNITS[key]}", values, [None] * 3, [None] * 3
        )
    ]
    if noise:
        yield "noise", noise


def _axes(values: Any) -> Sequence[float | None]:  # noqa: ANN401 - three numbers, or nothing
    return [None] * 3 if values is None else values


def _numbers(
    group: str,
    axes: Sequence[str],
    unit: str,
    values: Iterable[float | None],
    sigmas: Iterable[float | None],
    commons: Iterable[float | None],
) -> list[Number]:
    found: list[Number] = []
    for axis, value, sigma, common in zip(axes, values, sigmas, commons, strict=True):
        known, u, shared = (None if each is None else finite_or_none(each) for each in (value, sigma, common))
        observable = known is not None and (sigma is None or u is not None)
        found.append(
            (f"{group} {axis}", unit, known if observable else None, u, shared if observable else None)
        )
    return found


def limit_of(limits: Limits | None, parameter: str) -> float | None:
    """Return the largest magnitude that limits allow of a parameter; None where they do not limit it."""
    triad, _, rest = parameter.partition(" ")
    group, _, axis = rest.rpartition(" ")
    section = getattr(limits, triad, None)
    return None if section is None else section.groups().get(group, {}).get(axis)


def ideal(parameter: str) -> float:
    """Return the value of a parameter of a perfect unit, from which its limit counts."""
    return 1.0 if " scale " in parameter else 0.0


def beyond_limits(result: Result) -> Iterator[str]:
    """Name each parameter that is beyond its limit, or is not observable where one is stated."""
    limits = result.calibration.limits
    for each in result.parameters:
        limit = limit_of(limits, each.name)
        if limit is None:
            continue
        if each.value is None:
            yield f"{each.name} is not observable"
        elif abs(each.value - ideal(each.name)) > limit:
            yield f"{each.name} {each.value:.6g} beyond {limit:g} {each.unit}"


def limits_document(limits: Limits) -> bytes:
    """Return limits as the bytes under whose hash they are stored."""
    return json.dumps(limits.content(), sort_keys=True, separators=(",", ":")).encode()


def _rounded(values: Any) -> list[Any]:  # noqa: ANN401 - nested lists of numbers
    rounded: list[Any] = (np.round(np.array(values, dtype=float), _DECIMALS) + 0.0).tolist()
    return rounded
