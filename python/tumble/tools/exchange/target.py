"""Format of another program: the parts it holds, the settings it needs, its files."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from tumble.calibration.document import Calibration
from tumble.calibration.doubts import doubts
from tumble.calibration.turned_axes import in_axes
from tumble.foundation.body_axes import FLU, FRD, are_axes, in_words
from tumble.foundation.errors import ProcedureError
from tumble.foundation.files import BY_TUMBLE, FileKind
from tumble.foundation.log_reading import CORRECTION, counts_in, turns
from tumble.foundation.units import CALIBRATED_TRIADS, TRIADS, CalibratedTriad
from tumble.foundation.words import join, short
from tumble.tools.exchange import axes
from tumble.tools.exchange.c_names import is_reserved
from tumble.tools.exchange.calibration_parts import Loss, Part, losses
from tumble.tools.exchange.remark_lines import with_remarks


@dataclass(frozen=True, slots=True)
class Setting:
    """Setting that a target needs and no calibration contains."""

    name: str
    """Name as in `--set NAME=VALUE`."""
    meaning: str
    default: str | None = None
    """Default; None where it has to be given."""


AS_CALIBRATED = "those of the readings that were calibrated, as nothing is turned"
OWN_AXES = "those of the accelerometer itself, nearest to those of the readings"
ANY_AXES = "any, as noise is the root mean square over them"

AXES = Setting(
    axes.SETTING,
    "directions of the calibration's x, y and z in the vehicle (F or B, L or R, U or D), such as "
    f"{FLU}, in place of its log's",
    "",
)


class Settings:
    """Values of a target's settings, one for all units or, between commas, one for each."""

    def __init__(self, target: str, settings: Sequence[Setting], typed: Mapping[str, str]) -> None:
        self._target = target
        self._settings = {setting.name: setting for setting in settings}
        if unknown := [name for name in typed if name not in self._settings]:
            known = join(sorted(self._settings)) or "no settings"
            raise ProcedureError(f"{target} has no setting {short(unknown[0])}; it has {known}")
        self._values = {name: setting.default for name, setting in self._settings.items()} | dict(typed)

    def text(self, name: str, unit: int = 0, units: int = 1) -> str:
        """Returns the value for one of so many units; raises `ProcedureError` where there is none."""
        value = self._values[name]
        if value is None:
            raise ProcedureError(f"{self._target} needs --set {name}=...: {self._settings[name].meaning}")
        values = value.split(",")
        if len(values) not in (1, units):
            raise ProcedureError(
                f"--set {name}={value} has {len(values)} values for {units} calibrations; give one for each"
            )
        return values[unit if len(values) > 1 else 0].strip()

    def refusal(self, name: str, remedy: str) -> ProcedureError:
        """Returns the error for a value that will not do."""
        return ProcedureError(f"--set {name}={self._values[name]}: {remedy}")

    def whole_number(self, name: str, unit: int = 0, units: int = 1) -> int:
        """Returns it as a whole number; hexadecimal will do."""
        text = self.text(name, unit, units)
        try:
            return int(text, 0)
        except ValueError:
            raise self.refusal(name, "give a whole number") from None

    def c_name(self, name: str) -> str:
        """Returns a name that C and C++ leave to their users."""
        text = self.text(name)
        if not re.fullmatch(r"[A-Za-z_]\w*", text, re.ASCII):
            raise self.refusal(name, "give a name of C")
        if is_reserved(text):
            raise self.refusal(name, "C, C++ or tumble.h has this name for something else; give another")
        return text

    def topic(self, name: str) -> str:
        """Returns the name of a topic of ROS."""
        text = self.text(name)
        if not re.fullmatch(r"[~/A-Za-z][\w/]*", text, re.ASCII):
            raise self.refusal(name, "give a name of a topic, such as /imu/data")
        return text

    def body_axes(self, name: str, unit: int, units: int) -> str:
        """Returns directions of x, y and z in a vehicle, such as FRD; empty where none are given."""
        text = self.text(name, unit, units).upper()
        if text and not are_axes(text):
            raise self.refusal(name, f"give directions of x, y and z in a vehicle, such as {FRD} or {FLU}")
        return text

    def positive_number(self, name: str) -> float:
        """Returns it as a number above zero."""
        text = self.text(name)
        try:
            number = float(text)
        except ValueError:
            number = 0.0
        if not 0.0 < number < float("inf"):
            raise self.refusal(name, "give a number above zero")
        return number


def _on_top(calibration: Calibration) -> Iterator[str]:
    """Warns of a calibration that holds for samples that were corrected before, or turned when read."""
    if turned := turns(calibration.log_reading):
        yield (
            f"the calibration {calibration.name} holds for readings that are changed as by {turned}; change "
            "them alike"
        )
    if counts := counts_in(calibration.log_reading):
        yield (
            f"the calibration {calibration.name} holds for counts that are read with {counts}; what converts "
            "them otherwise needs another"
        )
    if before := calibration.log_reading.get(CORRECTION):
        yield (
            f"the calibration {calibration.name} holds on top of another correction ({before}), which the "
            "readings need first"
        )


@dataclass(frozen=True, slots=True)
class Exported:
    """A file for another program, and its losses."""

    content: bytes
    losses: tuple[Loss, ...]
    """Errors that stay, as the target cannot hold what would remove them."""
    remarks: tuple[str, ...] = ()
    """Remarks and further steps for the user."""
    warnings: tuple[str, ...] = ()
    """Verdicts of the calibrations that whoever uses the file has to know of; they stand in its head."""


@dataclass(frozen=True, slots=True)
class Written:
    """Result of the writer of a target."""

    content: str
    losses: tuple[Loss, ...] = ()
    """Beside those that follow from the parts that the target holds."""
    remarks: tuple[str, ...] = ()


Write: TypeAlias = Callable[[Sequence[Calibration], Settings], Written]
Content: TypeAlias = dict[str, object]
"""Content of a calibration file."""
READINGS = "readings"
"""Key of a content: by triad, the unit of readings that are in no unit of the triad, such as counts."""
Read: TypeAlias = Callable[[str], list[Content]]
ReadParameters: TypeAlias = Callable[[Mapping[str, float]], list[Content]]


@dataclass(frozen=True, slots=True)
class Target:
    """A format of another program."""

    word: str
    """Word after `--format`."""
    title: str
    ending: str
    """Ending of its files, with the dot."""
    kind: FileKind
    """Kind, by the beginning of its files."""
    holds: Mapping[CalibratedTriad, Collection[Part]]
    write: Write
    source: str
    """Source of names, units and formula."""
    axes: str
    """Axes in which the program corrects, in words."""
    body: str = ""
    """Directions of these in a vehicle, as in `body_axes`; empty where the program takes any."""
    leaves_out: Collection[CalibratedTriad] = ()
    """Triads that its files are not about; no loss is reported for these."""
    own_settings: tuple[Setting, ...] = ()
    """Beside that of axes."""
    most: int = 1
    """Units in one file."""
    remarks: tuple[str, ...] = field(default=())
    """Remarks and further steps for every file of this format."""
    read: Read | None = None
    """Reads its files; None where they hold no calibration, or none that can be read back."""
    is_own: bool = False
    """Indicates whether only Tumble writes this format."""
    encoding: str = "utf-8"
    """Encoding of its text."""
    read_parameters: ReadParameters | None = None
    """Reads the parameters in a log of its firmware; None where it keeps none there."""

    @property
    def settings(self) -> tuple[Setting, ...]:
        """All its settings."""
        return (*self.own_settings, AXES) if self.body else self.own_settings

    @property
    def output_kind(self) -> FileKind:
        """Kind that its files replace: those that name Tumble in their head, but records, which are ours."""
        return self.kind if self.kind.mark is not None or self.is_own else replace(self.kind, mark=BY_TUMBLE)

    @property
    def axes_in_words(self) -> str:
        """Axes in which the program corrects."""
        return f"{self.axes} ({in_words(self.body)})" if self.body else self.axes

    def export(self, calibrations: Sequence[Calibration], typed: Mapping[str, str]) -> Exported:
        """Creates a file of one calibration or several.

        Raises `ProcedureError`, in one line, where it takes fewer, needs a setting, or takes no such values.
        """
        settings = Settings(self.word, self.settings, typed)
        if len(calibrations) > self.most:
            raise ProcedureError(
                f"{self.word} holds {self.most} of the {len(calibrations)} calibrations; leave some out"
            )
        self._refuse_magnetometers_alone(calibrations)
        before = [self._with_axes(calibrations, place, settings) for place in range(len(calibrations))]
        calibrations = [in_axes(each, self.body) for each in before]
        written = self.write(calibrations, settings)
        about = [
            triad
            for triad in CALIBRATED_TRIADS
            if triad not in self.leaves_out and (triad in TRIADS or triad in self.holds)
        ]
        held = {triad: self.holds.get(triad, ()) for triad in about}
        lost = [loss for each in calibrations for loss in losses(each, held)]
        warnings = tuple(doubt for each in calibrations for doubt in (*doubts(each), *_on_top(each)))
        stated = axes.statement(self.body, self.axes_in_words, before)
        noted = with_remarks(written.content, self.ending, (stated, *warnings))
        silent = warnings and noted is None
        no_place = (f"a file for {self.word} has no place for the warning",) if silent else ()
        content = (noted or written.content).encode(self.encoding)
        remarks = (
            stated,
            *self.remarks,
            *written.remarks,
            *no_place,
            *self._without_magnetometer(calibrations),
        )
        return Exported(content, (*lost, *written.losses), remarks, warnings)

    def _refuse_magnetometers_alone(self, calibrations: Sequence[Calibration]) -> None:
        """Raises `ProcedureError` where a calibration is of a magnetometer only, which has no place."""
        for each in calibrations:
            if "magnetometer" not in self.holds and [name for name, _ in each.triads()] == ["magnetometer"]:
                raise ProcedureError(
                    f"{each.name}: has a magnetometer section only, and {self.word} has no place for one"
                )

    def _without_magnetometer(self, calibrations: Sequence[Calibration]) -> Iterator[str]:
        if "magnetometer" in self.holds:
            return
        if names := [each.name for each in calibrations if each.magnetometer is not None]:
            yield f"the magnetometer of {join(names)} is left out: {self.word} has no place for one"

    def _with_axes(self, calibrations: Sequence[Calibration], place: int, settings: Settings) -> Calibration:
        """Returns a calibration with the axes that the user states, if any, in place of its log's."""
        stated = settings.body_axes(AXES.name, place, len(calibrations)) if self.body else ""
        return calibrations[place].model_copy(update={"axes": stated}) if stated else calibrations[place]
