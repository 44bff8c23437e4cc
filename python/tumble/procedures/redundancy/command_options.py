"""Options of `tumble redundancy`, by what they are about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypedDict

import typer

from tumble.cli.durations import seconds_of
from tumble.cli.live_options import LIVE, LiveDurationOption, SenderOption, ToOption
from tumble.cli.options import Options, refuse_given
from tumble.cli.shared_options import PrimaryCalibrationOption
from tumble.foundation.errors import ProcedureError

if TYPE_CHECKING:
    from tumble.calibration.document import Calibration
    from tumble.foundation.results import Precision
    from tumble.procedures.redundancy.factory import Factory
    from tumble.procedures.redundancy.settings import RedundancySettings


class PrecisionOption(str, Enum):
    """Floats to compute with."""

    F64 = "f64"
    F32 = "f32"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayOptions(Options):
    """Logs to be replayed, and commands during the replay."""

    secondary: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME|LOG:NAME", help="A secondary, in the same form; repeatable, up to 7."),
    ] = None
    unit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=CHANNEL:LOG,...",
            help="A unit of single-axis sensors with a log each, as imu2=ax:x.csv,ay:y.csv,gz:yaw.csv:rate, "
            "CHANNEL of ax ay az gx gy gz and LOG:COLUMN where a log holds several; repeatable. A unit that "
            "neither --primary nor --secondary names is a secondary.",
        ),
    ] = None
    command: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TIME:evaluate|return",
            help="A command to the monitor, s from the start of the logs: evaluate now, or return to the "
            "primary; repeatable.",
        ),
    ] = None
    allow_missing: Annotated[
        bool,
        typer.Option(
            "--allow-missing", help="Replay a unit whose log cannot be read as one that sends nothing."
        ),
    ] = False
    output_log: Annotated[
        Path | None,
        typer.Option(
            "--output-log",
            metavar="FILE",
            help="Write what the platform would have used, sample by sample: time, specific force, "
            "angular rate, source, flags; .csv or .parquet.",
        ),
    ] = None

    def refuse_with_live(self) -> None:
        """Raise `ProcedureError` where one of them was typed with `--live`."""
        of_logs = {
            "--secondary": self.secondary,
            "--command": self.command,
            "--output-log": self.output_log,
            "--allow-missing": self.allow_missing,
            "--unit": self.unit,
        }
        refuse_given(of_logs, "is for logs; leave it out, or leave out --live")


class Stated(TypedDict):
    """Settings of the monitor as the procedure takes them."""

    settings: RedundancySettings
    precision: Precision
    as_published: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingsOptions(Options):
    """Settings of the monitor."""

    settings: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Settings, and what is known of each unit, such as what tumble align wrote (YAML); "
            "repeatable, a later one overrides an earlier one.",
        ),
    ] = None
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="A setting, or units.UNIT.NAME=VALUE; overrides those of --settings; repeatable.",
        ),
    ] = None
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help="Begin from the settings of the literature: thresholds on the norm, an offset an axis, "
            "and each calibration replaces the last.",
        ),
    ] = False
    precision: Annotated[
        PrecisionOption, typer.Option(help="Floats to compute with: f32 as on a device.")
    ] = PrecisionOption.F64

    def stated(self) -> Stated:
        """Read them; raises `TumbleError` where a file or a setting makes no sense."""
        from tumble.procedures.redundancy.settings import RedundancySettings

        settings = RedundancySettings()
        for path in self.settings or ():
            settings = settings.and_then(RedundancySettings.load(path))
        return {
            "settings": settings.changed(self.changes or []),
            "precision": self.precision.value,
            "as_published": self.as_published,
        }


class Known(TypedDict):
    """Knowledge of the units as the procedure takes it."""

    calibration: Calibration | None
    store: Path | None
    factory: Factory


@dataclass(frozen=True, slots=True, kw_only=True)
class SetOptions(Options):
    """Knowledge of the units beforehand."""

    calibration: PrimaryCalibrationOption = None
    store: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder of stored errors; adopted errors are written there. Without it there are none "
            "at the start, and adopted errors go to the folder store of the results.",
        ),
    ] = None
    factory: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[UNIT=]FILE",
            help="Turntable calibration of a secondary, which becomes its first error in --store; of the "
            "unit that it names, or UNIT; repeatable.",
        ),
    ] = None

    def stated(self) -> Known:
        """Read them; raises `TumbleError` where a calibration cannot be read."""
        from tumble.calibration.document import Calibration

        calibration = Calibration.load(self.calibration) if self.calibration else None
        return {
            "calibration": calibration,
            "store": self.store,
            "factory": _factory(self.factory or []),
        }


class AidingMeasurements(TypedDict):
    """Aiding measurements as the procedure takes them."""

    aiding: Sequence[str]
    aiding_sigma: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class AidingOptions(Options):
    """Measurements of other sensors on board."""

    aiding: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE|SOURCE",
            help="Table (CSV) of what something else on board says, which settles what two units cannot: "
            "time, and velocity vx, vy, vz or vn, ve, vd (level frame), climb, or body_vx, body_vy, body_vz, "
            "m/s, or yaw, rad, or heading_deg, or score_UNIT, the innovations of an estimator; with --live "
            "where such rows come from, as "
            "udp://:9200; repeatable.",
        ),
    ] = None
    aiding_sigma: Annotated[
        float | None,
        typer.Option(metavar="M/S", help="Sigma of velocities in --aiding without a column sigma."),
    ] = None

    def stated(self) -> AidingMeasurements:
        """Give them by name."""
        return {"aiding": self.aiding or (), "aiding_sigma": self.aiding_sigma}


@dataclass(frozen=True, slots=True, kw_only=True)
class RedundancyLiveOptions(Options):
    """Options that only sensors that run have a use for."""

    live: Annotated[
        bool,
        typer.Option("--live", help="Watch units while they run: NAME=SOURCE...", rich_help_panel=LIVE),
    ] = False
    to: ToOption = None
    record: Annotated[
        Path | None,
        typer.Option(
            "--record",
            metavar="DIR",
            help="Record all samples into a session, whose replay gives the same.",
            rich_help_panel=LIVE,
        ),
    ] = None
    duration: LiveDurationOption = None
    dashboard: Annotated[
        bool,
        typer.Option(
            "--dashboard",
            help="Show each unit, its deviations against their thresholds, and the source.",
            rich_help_panel=LIVE,
        ),
    ] = False
    sender: SenderOption = None

    def refuse_without_live(self) -> None:
        """Raise `ProcedureError` where one of them was typed with logs."""
        only_live = {
            "--to": self.to,
            "--record": self.record,
            "--duration": self.duration,
            "--from": self.sender,
            "--dashboard": self.dashboard,
        }
        refuse_given(only_live, "is for sensors that run; give --live, or leave it out")

    def seconds(self) -> float | None:
        """Give how long to watch, if that was typed."""
        return None if self.duration is None else seconds_of("--duration", self.duration)


def _factory(texts: list[str]) -> Factory:
    """Read `UNIT=FILE`, or files alone; of both at once each file is given the name that it states."""
    from tumble.calibration.document import Calibration

    parted = [text.rpartition("=") for text in texts]
    if not any(name for name, _, _ in parted):
        return texts
    named: dict[str, Calibration] = {}
    for name, _, path in parted:
        calibration = Calibration.load(path)
        if named.setdefault(name or calibration.name, calibration) is not calibration:
            raise ProcedureError(f"--factory {path}: {name or calibration.name} has a calibration already")
    return named
