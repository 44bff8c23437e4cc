"""A session by hand that a page guides: orientations held, the next one, and the unit as it stands."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

from tumble.calibration.unit_files import prepare_unit_files
from tumble.foundation.errors import ProcedureError
from tumble.foundation.goal import Goal
from tumble.foundation.message import NOTHING, Message, message
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CALIBRATED_TRIADS, TRIADS
from tumble.foundation.words import LISTENING
from tumble.live import open_set
from tumble.poses.by_hand import MOST_ORIENTATIONS, orientation_parts
from tumble.procedures.magnetometer.earth_field import EarthField, earth_field
from tumble.procedures.multipose.guide import HELD
from tumble.procedures.multipose.live import (
    ORIENTATIONS,
    LiveMultipose,
    MultiposeStep,
    MultiposeStepKind,
    calibrated,
    session_procedure,
)
from tumble.procedures.multipose.procedure import multipose
from tumble.procedures.multipose.result import MultiposeResult
from tumble.tools.guided.answers import Answers
from tumble.tools.guided.field import RunField, UnitRole
from tumble.tools.guided.figures import CaseDirection, SphereFigure
from tumble.tools.guided.furthest import furthest_from_ideal
from tumble.tools.guided.gravity_fields import GRAVITY_FIELDS, gravity_of
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.outcome import RunOutcome, RunVerdict, UnitOutcome
from tumble.tools.guided.run import RunKind
from tumble.tools.guided.view import BodyView, CheckGroup, CheckItem, GoalShare, RunView, UnitLamp, ViewKind

KINDS: Mapping[MultiposeStepKind, ViewKind] = {
    LISTENING: "listening",
    "orientation wanted": "wanted",
    "rest done": "held",
    "progress": "progress",
    "warning": "warning",
    "done": "done",
    "ended early": "ended early",
}
VERDICTS: Mapping[str, RunVerdict] = {"calibrated": "passed", "model not met": "failed"}
"""By the verdict of the procedure; `warned` for others."""
FIELDS = (
    RunField(
        name="orientations",
        label=message("Orientations"),
        kind="number",
        least=10,
        most=MOST_ORIENTATIONS,
        help=message("{count} if neither a number nor a goal is given.", count=ORIENTATIONS),
    ),
    RunField(
        name="held",
        label=message("Time at rest in each"),
        kind="number",
        default=HELD,
        unit="s",
        least=1.0,
        most=600.0,
    ),
    RunField(
        name="goal",
        label=message("Goal"),
        kind="text",
        help=message("Go on until every sigma is as small: bias 0.001, scale 0.02 %"),
        advanced=True,
    ),
    RunField(
        name="duration",
        label=message("Longest duration"),
        kind="number",
        unit="min",
        least=0.1,
        most=1440.0,
        advanced=True,
    ),
    RunField(
        name="g_sensitivity",
        label=message("Fit the g-sensitivity"),
        kind="flag",
        default=False,
        advanced=True,
    ),
    RunField(
        name="earth_rate",
        label=message("Take the Earth's rotation off"),
        kind="flag",
        default=False,
        help=message("It needs the latitude."),
        advanced=True,
    ),
    RunField(
        name="magnetometer",
        label=message("Calibrate the magnetometer too"),
        kind="flag",
        default=False,
    ),
    RunField(
        name="field",
        label=message("Strength of the Earth's field"),
        kind="number",
        unit="uT",
        least=15.0,
        most=100.0,
        help=message("Else it follows from latitude and longitude, or scales are relative."),
        advanced=True,
    ),
    *GRAVITY_FIELDS,
    RunField(
        name="longitude",
        label=message("Longitude"),
        kind="number",
        unit="deg",
        least=-180.0,
        most=360.0,
        help=message("The Earth's magnetic field follows from latitude and longitude."),
        advanced=True,
    ),
    RunField(name="calibration", label=message("Calibration to start from"), kind="file", advanced=True),
)


class GuidedMultipose:
    """One session of one unit in a hand; see `GuidedRun`.

    Raises `TumbleError`, in one line, where the order cannot be carried out.
    """

    def __init__(self, order: RunOrder) -> None:
        answers = Answers(FIELDS, order.options)
        if len(order.sources) != 1:
            raise ProcedureError("multipose: takes one unit at a time; name one source")
        [(name, address)] = order.sources.items()
        goal, minutes = answers.text("goal"), answers.number("duration")
        self._folder = order.folder
        self._options: dict[str, Any] = {
            **gravity_of(answers),
            "g_sensitivity": answers.flag("g_sensitivity"),
            "earth_rate": answers.flag("earth_rate"),
            "calibration": answers.file("calibration"),
            **_earth_field_of(answers),
        }
        self._units = open_set(
            [f"{name}={address}"], order.read_options(), sender=order.sender, keep_going=True
        )
        prepare_unit_files(order.folder, name, "multipose")
        triads = CALIBRATED_TRIADS if "magnetometer" in self._options else TRIADS
        self._live = LiveMultipose(
            self._units,
            order.folder,
            sources=order.sources,
            serial=order.serials.get(name, ""),
            goal=Goal.parse(goal, triads) if goal else None,
            orientations=answers.whole("orientations"),
            held=answers.number("held") or HELD,
            duration=None if minutes is None else 60.0 * minutes,
            calibrate=partial(multipose, **self._options),
            magnetometer="magnetometer" in self._options,
            procedure=session_procedure(goal, order.operator, order.station, resume=order.resume),
            resume=order.resume,
        )

    def views(self) -> Iterator[RunView]:
        """See `GuidedRun`."""
        for step in self._live.steps():
            yield self._view(step)

    def stop(self) -> None:
        """See `GuidedRun`."""
        self._live.stop()

    def act(self, action: str, subject: str = "") -> None:
        """See `GuidedRun`; there is nothing to be done beside stopping."""

    def outcome(self) -> RunOutcome:
        """See `GuidedRun`."""
        result = calibrated(self._live, self._options)
        files = result.save(self._folder)
        lost = tuple(Message(str(loss)) for loss in self._units.losses if loss.is_heavy)
        reasons = (*self._why_not(result), *lost, *map(Message, result.warnings))
        verdict = VERDICTS.get(result.verdict, "warned")
        if verdict == "passed" and (lost or not self._live.is_reached):
            verdict = "warned"
        unit = UnitOutcome(
            name=result.name,
            serial=result.serial,
            verdict=verdict,
            word=result.verdict,
            reasons=reasons,
            furthest=furthest_from_ideal(
                (f"{triad.triad} {each.name}", each) for triad in result.triads for each in triad.parameters
            ),
            calibration=files["calibration"],
            page=files["report"],
        )
        return RunOutcome(
            verdict=verdict,
            units=(unit,),
            complete=self._live.is_reached,
        )

    def _why_not(self, result: MultiposeResult) -> Iterator[Message]:
        if result.gyroscope is None:
            yield message("The gyroscope was not calibrated: {why}.", why=result.gyroscope_reason)
        if result.magnetometer_reason:
            yield message("The magnetometer was not calibrated: {why}.", why=result.magnetometer_reason)
        magnetic = () if result.magnetometer is None else result.magnetometer.triads
        for triad in (*result.triads, *magnetic):
            if not triad.model_met:
                yield message(
                    "{triad}: residuals are {widening} times the noise: the model is not met.",
                    triad=triad.triad,
                    widening=f"{triad.widening:.3g}",
                )
        if not self._live.is_reached:
            yield message("Not all that was asked for was shown.")

    def _view(self, step: MultiposeStep) -> RunView:
        wanted = _direction(step.up)
        now = _direction(self._live.up)
        held = tuple(_triple(up) for up in self._live.held)
        return RunView(
            kind=KINDS[step.kind],
            elapsed=step.elapsed,
            instruction=_instruction(step),
            detail=_detail(step),
            remaining=max(0.0, step.still_wanted - step.still) if _is_held(step) else math.nan,
            checks=(_orientations(step), *_field_met(step)),
            lamps=(UnitLamp(step.name, step.condition, step.rate),),
            goals=tuple(
                GoalShare(each.term.name, each.unit, each.sigma, each.term.sigma, each.target)
                for each in step.goals
            ),
            bodies=(BodyView(step.name, now, wanted, off=step.off),),
            figures=(
                SphereFigure(held, wanted, now, message("Orientations held so far")),
                *self._field_figures(step),
            ),
            subject=step.subject,
            warning=_warning(step),
        )

    def _field_figures(self, step: MultiposeStep) -> Iterator[SphereFigure]:
        """Returns the sphere of the field, where a magnetometer is calibrated."""
        if (field := step.field) is not None:
            met = tuple(_triple(each) for each in self._live.fields)
            title = message("Directions of the magnetic field")
            yield SphereFigure(met, _direction(field.wanted), _direction(field.now), title)


def _warning(step: MultiposeStep) -> Message:
    if step.kind == "warning":
        return message("{unit}: {text}", unit=step.subject, text=step.text)
    return Message(step.text)


def _is_held(step: MultiposeStep) -> bool:
    """Returns whether a rest is under way that does not count yet."""
    return 0.0 < step.still < step.still_wanted


def _instruction(step: MultiposeStep) -> Message:
    if step.kind == "done":
        return message("Done.")
    if step.kind == "ended early":
        return message("Ended early.")
    if _is_held(step):
        return message("Hold it still.")
    if step.up is None:
        return message("Let it stand still as it lies.")
    return message("Turn it to {orientation}.", orientation=orientation_parts(step.up)[0])


def _detail(step: MultiposeStep) -> Message:
    if step.kind == LISTENING:
        return message("Waiting for samples of {unit}.", unit=step.name)
    if _is_held(step):
        return message("{still} of {wanted} s", still=f"{step.still:.1f}", wanted=f"{step.still_wanted:g}")
    if step.up is None or math.isnan(step.off):
        return NOTHING
    left = message("{angle} deg to go", angle=f"{step.off:.0f}")
    if step.field is not None and math.isfinite(step.field.off):
        about = message("field: {angle} deg to go", angle=f"{step.field.off:.0f}")
        left = message("{left}; {field}", left=left, field=about)
    tilt = orientation_parts(step.up)[1]
    return message("{tilt}; {left}", tilt=tilt, left=left) if tilt else left


def _orientations(step: MultiposeStep) -> CheckGroup:
    """Returns one item for all orientations: the sphere beside it shows which."""
    wanted = step.orientations_wanted
    name = str(step.orientations) if wanted is None else f"{step.orientations} / {wanted}"
    share = 0.0 if wanted is None else min(1.0, step.orientations / wanted)
    done = step.kind == "done"
    turns = message("{count} turns", count=step.turns)
    item = CheckItem(name, 1.0 if done else share, done=done, current=not done, detail=turns)
    return CheckGroup(message("Orientations"), (item,))


def _field_met(step: MultiposeStep) -> Iterator[CheckGroup]:
    """Returns the share of all directions that the field was met from."""
    if step.field is None:
        return
    share = step.field.coverage if step.field.directions else 0.0
    done = step.kind == "done"
    item = CheckItem(f"{100.0 * share:.0f} %", share, done=done, current=not done)
    yield CheckGroup(message("Directions of the magnetic field"), (item,))


def _earth_field_of(answers: Answers) -> dict[str, EarthField]:
    """Returns the field as `multipose` takes it, where a magnetometer is to be calibrated.

    Raises `ProcedureError` where it is stated by halves, or without a magnetometer.
    """
    strength, longitude = answers.number("field"), answers.number("longitude")
    if not answers.flag("magnetometer"):
        if strength is not None or longitude is not None:
            raise ProcedureError("the Earth's field is about a magnetometer; choose to calibrate it too")
        return {}
    latitude, height = answers.number("latitude"), answers.number("height")
    found = earth_field(strength, latitude=latitude, longitude=longitude, height=height)
    return {"magnetometer": found}


def _direction(up: FloatArray | None) -> CaseDirection | None:
    return None if up is None else _triple(up)


def _triple(up: FloatArray) -> CaseDirection:
    x, y, z = map(float, up)
    return x, y, z


RUN_KIND: Final = RunKind(
    word="multipose",
    title=message("Many orientations"),
    summary=message(
        "Calibrates one unit without equipment: turn it by hand, and hold it still in each orientation."
    ),
    roles=(UnitRole(name="unit", label=message("Unit")),),
    fields=FIELDS,
    begin=GuidedMultipose,
)
