"""Options that state facts that a log lacks, shared by all commands that read logs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any

import typer

from tumble.cli.options import Options
from tumble.foundation.errors import LogError
from tumble.foundation.log_formats import stem_of
from tumble.foundation.numbers import number_of
from tumble.foundation.words import in_utf8
from tumble.logs.options import AxisValues, ReadOptions
from tumble.logs.spec import parse_spec

_PANEL = "Reading options: what the log does not state"


def _option(metavar: str, text: str) -> Any:  # noqa: ANN401 - the type of what typer gives is its own affair
    return typer.Option(metavar=metavar, help=text, rich_help_panel=_PANEL, show_default=False)


def _flag_option(name: str, text: str) -> Any:  # noqa: ANN401
    return typer.Option(name, help=text, rich_help_panel=_PANEL)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingOptions(Options):
    """An option for each field of `ReadOptions`, as it is typed."""

    columns: Annotated[
        str | None,
        _option(
            "ax=NAME,...",
            "Column for any of time ax ay az gx gy gz mx my mz temperature current throttle: name, or "
            "position from 1.",
        ),
    ] = None
    accelerometer_unit: Annotated[str | None, _option("m/s^2|g|mg", "Unit of the accelerometer.")] = None
    gyroscope_unit: Annotated[str | None, _option("rad/s|deg/s", "Unit of the gyroscope.")] = None
    time_unit: Annotated[str | None, _option("s|ms|us|ns", "Unit of time.")] = None
    temperature_unit: Annotated[str | None, _option("degC|K|degF", "Unit of temperature.")] = None
    magnetometer_unit: Annotated[str | None, _option("uT|nT|T|G|mG", "Unit of the magnetometer.")] = None
    accelerometer_scale: Annotated[
        str | None, _option("N[,N,N]", "Counts per unit of the accelerometer: 16384, with unit g.")
    ] = None
    accelerometer_zero: Annotated[
        str | None, _option("N[,N,N]", "What the accelerometer reads at zero, in the unit of the log.")
    ] = None
    gyroscope_scale: Annotated[
        str | None, _option("N[,N,N]", "Counts per unit of the gyroscope: 131, with unit deg/s.")
    ] = None
    magnetometer_scale: Annotated[
        str | None, _option("N[,N,N]", "Counts per unit of the magnetometer: 1090, with unit G.")
    ] = None
    counts: Annotated[
        str | None,
        _option("G,DPS", "Counts of 16 bits of a sensor with these ranges, in g and deg/s, such as 2,250."),
    ] = None
    gyroscope_zero: Annotated[
        str | None, _option("N[,N,N]", "What the gyroscope reads at zero, in the unit of the log.")
    ] = None
    accelerometer_sign: Annotated[
        int, _option("1|-1", "-1 for a sensor that reads -g where it should read +g.")
    ] = 1
    axes: Annotated[
        str,
        _option(
            "X,Y,Z", "Case axes in terms of the log's, such as y,-x,z; x,y,-z corrects a left-handed log."
        ),
    ] = "x,y,z"
    rate: Annotated[float | None, _option("HZ", "Samples per second, in place of the log's time.")] = None
    topic: Annotated[str | None, _option("NAME", "Which IMU of the file; the same as LOG:NAME.")] = None
    magnetometer_name: Annotated[
        str | None, _option("NAME", "Which magnetometer of the file: a topic, or a column prefix.")
    ] = None
    skip_lines: Annotated[int, _option("N", "Lines to skip before the column names.")] = 0
    skip_bad_lines: Annotated[
        bool,
        _flag_option("--skip-bad-lines", "Leave out lines of a text log that cannot be read, up to 1 %."),
    ] = False
    undo_correction: Annotated[
        bool,
        _flag_option(
            "--undo-correction", "Undo what an autopilot did to the samples, by the parameters in its log."
        ),
    ] = False
    interpolate: Annotated[
        bool,
        _flag_option(
            "--interpolate", "Bring an accelerometer with times of its own to those of the gyroscope."
        ),
    ] = False
    serial: Annotated[str, _option("TEXT", "Serial number of the unit.")] = ""

    def read(self) -> ReadOptions:
        """Turn what was typed into `ReadOptions`; raises `LogError` where it makes no sense."""
        typed = {name: getattr(self, name) for name in _NAMES}
        return ReadOptions(
            **{name: _value(name, value) for name, value in typed.items() if value is not None}
        )


_NAMES = tuple(field.name for field in fields(ReadingOptions))


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingOptionsOfSeveral(ReadingOptions):
    """The same, of commands that read several logs, each of which may have options of its own."""

    exceptions: Annotated[
        list[str] | None,
        typer.Option(
            "--for",
            metavar="NAME:OPTION=VALUE",
            help="An option for one log or unit only, such as target_2:gyroscope-unit=deg/s; repeatable.",
            rich_help_panel=_PANEL,
            show_default=False,
        ),
    ] = None

    def read_each(self, sources: Sequence[str]) -> dict[str, ReadOptions]:
        """Give the options of each source, as `read_options_for`."""
        return read_options_for(self.read(), self.exceptions or (), sources)


def read_options_for(
    shared: ReadOptions, exceptions: Sequence[str], sources: Sequence[str]
) -> dict[str, ReadOptions]:
    """Options of each source: the shared ones, but for `NAME:OPTION=VALUE` of one of them.

    A source goes by what was typed, by the name of its file without folder and extension, or by that and the
    name of its IMU.
    """
    options = dict.fromkeys(sources, shared)
    for text in exceptions:
        setting, _, typed = text.partition("=")
        name, _, option = setting.rpartition(":")
        field = option.strip().removeprefix("--").replace("-", "_")
        if field not in _NAMES or not typed:
            known = ", ".join(key.replace("_", "-") for key in _NAMES)
            raise LogError(f"--for {text}: expected NAME:OPTION=VALUE, with one of {known}")
        meant = [source for source in sources if in_utf8(name) in map(in_utf8, _names(source))]
        if not meant:
            raise LogError(f"--for {text}: no recording is named {name!r}; there are {', '.join(sources)}")
        for source in meant:
            options[source] = replace(options[source], **{field: _value(field, typed)})
    return options


def _names(source: str) -> tuple[str, ...]:
    try:
        spec = parse_spec(source)
    except LogError:
        # The bare name of an IMU, where the log is named apart.
        return (source,)
    imu = (spec.imu or "").strip("/").replace("/", "_")
    stem = stem_of(spec.path)
    return source, stem, f"{stem}-{imu}"


def _value(name: str, typed: Any) -> Any:  # noqa: ANN401
    if name == "columns":
        return _mapping(typed)
    if name == "counts":
        return _ranges(typed)
    if name.endswith(("_scale", "_zero")):
        return _numbers(name, typed)
    if name in ("skip_bad_lines", "undo_correction", "interpolate"):
        return _flag(name, typed)
    kind = {"rate": float, "skip_lines": int, "accelerometer_sign": int}.get(name, str)
    try:
        value = kind(typed)
    except ValueError:
        raise LogError(f"--{name.replace('_', '-')} {typed}: give a number") from None
    if name == "skip_lines" and value < 0:
        raise LogError(f"--skip-lines {typed}: give 0 or more")
    return value


def _ranges(text: str) -> tuple[float, float]:
    numbers = [number_of(word) for word in text.split(",")]
    if len(numbers) != 2 or not all(number and 0.0 < number < math.inf for number in numbers):
        raise LogError(
            f"--counts {text}: give the ranges of accelerometer and gyroscope in g and deg/s, as 2,250"
        )
    accelerometer, gyroscope = (float(number) for number in numbers if number)
    return accelerometer, gyroscope


def _flag(name: str, typed: Any) -> bool:  # noqa: ANN401
    words = {"yes": True, "true": True, "no": False, "false": False}
    if str(typed).lower() not in words:
        raise LogError(f"--{name.replace('_', '-')} {typed}: give yes or no")
    return words[str(typed).lower()]


def _mapping(text: str) -> dict[str, str]:
    pairs = [pair.partition("=") for pair in text.split(",")]
    if not all(sign and value for _, sign, value in pairs):
        raise LogError(f"--columns {text}: expected pairs such as ax=NAME,ay=NAME")
    mapping: dict[str, str] = {}
    for key, _, value in pairs:
        if key.strip() in mapping:
            raise LogError(f"--columns {text}: {key.strip()} is given twice")
        mapping[key.strip()] = value.strip()
    return mapping


def _numbers(name: str, text: str) -> AxisValues:
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3):
        raise LogError(
            f"--{name.replace('_', '-')} {text}: give one number, or three as N,N,N for x, y and z"
        )
    return numbers[0] if len(numbers) == 1 else numbers
