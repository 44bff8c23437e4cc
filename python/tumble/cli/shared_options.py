"""Options that mean the same in every command that has them, each declared once."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer

from tumble.cli.options import Options
from tumble.foundation.translation import LANGUAGES, speak


def _spoken(code: str) -> str:
    if code:
        speak(code, "--language")
    return code


JsonOption: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print JSON instead of text; live events and samples a line each.")
]
QuietOption: TypeAlias = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print only what failed; no progress.")
]
LanguageOption: TypeAlias = Annotated[
    str,
    typer.Option(
        "--language",
        metavar="|".join(LANGUAGES),
        callback=_spoken,
        help="Language of pages and screens; else as TUMBLE_LANG or the system has it. JSON is English.",
        show_default=False,
    ),
]
VerboseOption: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--verbose", "-v", help="Print all that was found, however long: every target, spin and fault."
    ),
]
JobsOption: TypeAlias = Annotated[
    int | None, typer.Option(min=1, help="Targets calibrated at a time; all cores if not given.")
]
OperatorOption: TypeAlias = Annotated[
    str,
    typer.Option(
        envvar="TUMBLE_OPERATOR", metavar="NAME", help="Operator, for the record.", show_default=False
    ),
]
StationOption: TypeAlias = Annotated[
    str, typer.Option(envvar="TUMBLE_STATION", metavar="NAME", help="Where that is done.", show_default=False)
]

RateOption: TypeAlias = Annotated[float, typer.Option(help="Samples a second, Hz.")]
"""Rate of what is simulated."""


def _calibration(text: str) -> Any:  # noqa: ANN401 - what typer makes of an option
    return typer.Option("--calibration", metavar="FILE", help=text, show_default=False)


CalibrationOption: TypeAlias = Annotated[
    Path | None,
    _calibration(
        "Calibration of the unit to build on: what is found replaces that part of it, all else of it is "
        "used and kept."
    ),
]
PrimaryCalibrationOption: TypeAlias = Annotated[Path | None, _calibration("The primary's own calibration.")]


def format_option(formats: str, usual: str) -> Any:  # noqa: ANN401 - what typer makes of an option
    """Return the option that names the format of a file; `usual` is the one taken without it."""
    return typer.Option(
        "--format", metavar=formats, help=f"Format of the file; {usual} if not given.", show_default=False
    )


class LogFormatWord(str, Enum):
    """Format of a log that is written."""

    CSV = "csv"
    PARQUET = "parquet"
    MCAP = "mcap"


@dataclass(frozen=True, slots=True, kw_only=True)
class VoiceOptions(Options):
    """Form, extent and language of the output."""

    as_json: JsonOption = False
    quiet: QuietOption = False
    language: LanguageOption = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class LongVoiceOptions(VoiceOptions):
    """The same, of commands that leave out what makes a summary long."""

    verbose: VerboseOption = False


@dataclass(frozen=True, slots=True, kw_only=True)
class MakerOptions(Options):
    """Operator and station, which pages and files of a result carry."""

    operator: OperatorOption = ""
    station: StationOption = ""

    def stated(self) -> AbstractContextManager[None]:
        """Have results that are found in the block keep both."""
        from tumble.foundation.provenance import made_by

        return made_by(self.operator, self.station)
