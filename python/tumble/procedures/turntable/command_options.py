"""Options of `tumble turntable`, by what they are about."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.options import Options
from tumble.cli.registry_option import laboratory, registry_in_use
from tumble.cli.shared_options import JobsOption
from tumble.foundation.errors import CalibrationFileError, ProcedureError, TumbleError

if TYPE_CHECKING:
    from tumble.calibration.document import Calibration
    from tumble.calibration.limits import Limits
    from tumble.poses.pose_list import PoseList
    from tumble.procedures.turntable.certified import CertifiedReference

SIX_FACES_WORD = "six-faces"
NO_POSES = "none"
_NOT_ASKED = (
    "no registry was given, which knows whether it was withdrawn; give --registry, or ask the laboratory"
)


class TruthOption(str, Enum):
    """Truth that the target is compared with; see docs/theory/turntable.md."""

    REFERENCE = "reference"
    ROTATE_TRUTH = "rotate-truth"
    ROTATE_MEASUREMENT = "rotate-measurement"
    IDEAL = "ideal"
    TABLE = "table"


class ClocksOption(str, Enum):
    """Clocks of reference and targets: one, or apart."""

    AUTO = "auto"
    SHARED = "shared"
    APART = "apart"


class PagesOption(str, Enum):
    """Which targets get a page of their own."""

    ALL = "all"
    FAILED = "failed"
    NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceOptions(Options):
    """Which unit is the reference, and what is known of it."""

    name: Annotated[
        str | None,
        typer.Option(
            "--reference",
            metavar="NAME",
            help="Of a session or of --live: the unit that is the reference; that of the name reference if "
            "not given.",
            show_default=False,
        ),
    ] = None
    calibration: Annotated[
        Path | None,
        typer.Option(
            "--reference-calibration",
            metavar="FILE",
            help="Calibration to apply to the reference first; its uncertainty goes to the targets.",
        ),
    ] = None
    grade: Annotated[
        str | None,
        typer.Option(
            "--reference-grade",
            metavar="NAME",
            help="Grade of the reference, whose figures go to the targets where no calibration states its "
            "uncertainty: consumer, industrial, tactical or reference.",
            show_default=False,
        ),
    ] = None

    reference_certificate: Annotated[
        Path | None,
        typer.Option(
            "--reference-certificate",
            metavar="FILE",
            help="Certificate of the reference (YAML; XML or PDF of Tumble), in place of its calibration: "
            "its values are applied, and each parameter has a budget of its uncertainty.",
            show_default=False,
        ),
    ] = None
    reference_signer: Annotated[
        Path | None,
        typer.Option(
            "--reference-signer",
            metavar="FILE",
            help="Public file (.crt) of the laboratory that must have signed that certificate.",
            show_default=False,
        ),
    ] = None
    reference_model: Annotated[
        str,
        typer.Option(
            "--reference-model",
            metavar="NAME",
            help="Model of the reference, which its certificate has to be of.",
            show_default=False,
        ),
    ] = ""
    target_grade: Annotated[
        str | None,
        typer.Option(
            "--target-grade",
            metavar="NAME",
            help="Grade of the targets, by which temperature moves their biases in the budgets: consumer, "
            "industrial, tactical or reference.",
            show_default=False,
        ),
    ] = None

    def applied(self) -> Calibration | None:
        """Read its calibration, if there is one."""
        from tumble.calibration.document import Calibration

        return Calibration.load(self.calibration) if self.calibration else None

    def certified(self) -> CertifiedReference | None:
        """Read its certificate, if there is one, before anything is recorded or read."""
        from tumble.procedures.turntable.certified import CertifiedReference

        if self.reference_certificate is not None and self.calibration is not None:
            raise TumbleError(
                "--reference-calibration and --reference-certificate both state the errors of the reference; "
                "give one of them"
            )
        found = CertifiedReference.of(self.reference_certificate, self.reference_signer)
        if found is None:
            return None
        address = registry_in_use()
        if not address:
            return replace(found, standing=_NOT_ASKED)
        answer = laboratory("certificate.standing").standing_of(address, found.facts)
        if answer.fault:
            raise CalibrationFileError(answer.fault, about=found.about)
        found = replace(found, standing=answer.sentence)
        if not found.certificate.leaves_drift_open:
            return found
        serial = found.certificate.reference.serial
        walks = laboratory("reference_drift").walks_of(address, serial) if serial else {}
        return replace(found, walks=walks)


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodOptions(Options):
    """Truth that is used, and parameters that are fitted."""

    poses: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|six-faces|none",
            help="Pose list; that of the session, or the six faces, if not given; `none` for unknown poses.",
        ),
    ] = None
    truth: Annotated[TruthOption, typer.Option(help="What is used as truth for the targets.")] = (
        TruthOption.REFERENCE
    )
    rates: Annotated[
        str | None,
        typer.Option(
            metavar="RATES",
            help="With --truth table: magnitudes of the commanded rates, deg/s, such as 10,30,60; those "
            "of the pose list if not given.",
            show_default=False,
        ),
    ] = None
    rate_accuracy: Annotated[
        float | None,
        typer.Option(
            metavar="PPM",
            help="With --truth table: 1-sigma of what all its rates are wrong by alike; 100 if not given.",
            show_default=False,
        ),
    ] = None
    as_published: Annotated[
        bool,
        typer.Option("--as-published", help="As in the literature: the same as --truth rotate-measurement."),
    ] = False
    clock: Annotated[ClocksOption, typer.Option(help="Whether all recordings were stamped by one clock.")] = (
        ClocksOption.AUTO
    )
    g_sensitivity: Annotated[
        bool | None,
        typer.Option(
            "--g-sensitivity/--no-g-sensitivity",
            help="Fit how the gyroscopes respond to specific force; if not given, where residuals show it.",
            show_default=False,
        ),
    ] = None

    def wanted_truth(self) -> TruthOption:
        """Give the truth, that of the literature where it was asked for."""
        if not self.as_published:
            return self.truth
        if self.truth not in (TruthOption.REFERENCE, TruthOption.ROTATE_MEASUREMENT):
            raise TumbleError(
                f"--as-published is --truth rotate-measurement, not {self.truth.value}; leave one out"
            )
        return TruthOption.ROTATE_MEASUREMENT

    def wanted_rates(self) -> list[float] | None:
        """Read the commanded rates, if they were typed."""
        return None if self.rates is None else _numbers("--rates", self.rates)

    def wanted_poses(self, session: str | None) -> PoseList | None:
        """Give the poses that are typed, those that a recorded session brings, or the six faces."""
        from tumble.poses.pose_list import SIX_FACES, PoseList
        from tumble.procedures.turntable.session_poses import poses_of

        if self.poses == NO_POSES:
            return None
        if self.poses is not None and self.poses != SIX_FACES_WORD:
            return PoseList.load(self.poses)
        listed = poses_of(session) if session and self.poses is None else None
        return listed or SIX_FACES

    def live_poses(self) -> PoseList | None:
        """Give the poses that are typed for a live session; None where a table may choose them."""
        if self.poses == NO_POSES:
            raise ProcedureError(
                "--poses none: a live session has to know which poses are wanted; leave it out"
            )
        return None if self.poses is None else self.wanted_poses(None)


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchOptions(Options):
    """Which targets are calibrated, and what is written of them."""

    limits: Annotated[
        Path | None, typer.Option("--limits", metavar="FILE", help="Limits that targets pass or fail.")
    ] = None
    decision: Annotated[
        str,
        typer.Option(
            metavar="simple|guarded[:GUARD]",
            help="Decision rule where the limits file states none; GUARD is the width of the guard band in "
            "U, 1 if not given.",
            show_default=False,
        ),
    ] = ""
    name_by: Annotated[
        str,
        typer.Option(
            metavar="file|folder|serial|REGEX", help="What targets are named by; of REGEX what it matches."
        ),
    ] = "file"
    pages: Annotated[
        PagesOption | None,
        typer.Option(
            help="Targets with a page; all of up to 50, of more those that failed.", show_default=False
        ),
    ] = None
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Leave out what is done in the folder and unchanged; with --live go on with its session.",
        ),
    ] = False
    jobs: JobsOption = None

    def wanted_limits(self) -> Limits | None:
        """Read the limits, if there are any."""
        from tumble.calibration.decision import rule_named
        from tumble.calibration.limits import Limits

        rule = rule_named(self.decision) if self.decision else None
        limits = Limits.load(self.limits) if self.limits else None
        return limits.with_rule(rule) if limits is not None and rule is not None else limits


def _numbers(option: str, text: str) -> list[float]:
    """Read numbers between commas."""
    try:
        return [float(each) for each in text.split(",")]
    except ValueError:
        raise TumbleError(f"{option} {text}: give numbers between commas, such as 10,30,60") from None
