"""A spin that a page guides: stand still, then turn on the spot, with the turns that are left."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final, cast

from tumble.calibration.document import Calibration
from tumble.calibration.unit_files import prepare_unit_files
from tumble.foundation.errors import LogError, ProcedureError
from tumble.foundation.message import NOTHING, Message, message
from tumble.foundation.words import LISTENING
from tumble.live import Source, open_source
from tumble.live.losses import SampleLoss
from tumble.procedures.spin.guided_source import GuidedSource, floor_from_case
from tumble.procedures.spin.live import LiveSpin, LiveSpinOptions, LiveStepKind, SpinStep
from tumble.procedures.spin.machine import SpinMachine
from tumble.procedures.spin.result import SpinResult
from tumble.procedures.spin.settings import DEFAULT, DEFAULT_TURNS
from tumble.tools.guided.answers import Answers
from tumble.tools.guided.field import RunField, UnitRole
from tumble.tools.guided.furthest import furthest_from_ideal
from tumble.tools.guided.gravity_fields import GRAVITY_FIELDS, gravity_of
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.outcome import RunOutcome, RunVerdict, UnitOutcome
from tumble.tools.guided.run import RunKind
from tumble.tools.guided.view import (
    BodyView,
    CheckGroup,
    CheckItem,
    RunView,
    UnitLamp,
    UnitLampState,
    ViewKind,
)
from tumble.tools.record.recorded_source import recorded_source
from tumble.tools.record.session_folders import next_session_folder

KINDS: Mapping[LiveStepKind, ViewKind] = {
    LISTENING: "listening",
    "turning first": "warning",
    "still broken": "warning",
    "still done": "wanted",
    "done": "done",
}
"""Kinds of views by those of steps; `progress` for others."""
VERDICTS: Mapping[str, RunVerdict] = {"calibrated": "passed", "model not met": "failed"}
"""By the verdict of the procedure; `warned` for others."""
HINTS: Mapping[str, Message] = {
    "none": message("Turn on the spot."),
    "good": message("Good. Go on turning."),
    "too slow": message("Turn faster."),
    "too fast": message("Turn more slowly."),
}
"""Instructions by the pace of the turn."""
FIELDS = (
    RunField(
        name="still",
        label=message("Time to stand still"),
        kind="number",
        default=DEFAULT.still,
        unit="s",
        least=1.0,
        most=600.0,
    ),
    RunField(
        name="turns", label=message("Turns"), kind="number", default=DEFAULT_TURNS, least=0.5, most=100.0
    ),
    RunField(
        name="rate",
        label=message("Rate of turn"),
        kind="number",
        unit="deg/s",
        least=5.0,
        most=720.0,
        help=message("{rate} deg/s if it is not given.", rate=f"{math.degrees(DEFAULT.rate):.0f}"),
    ),
    RunField(
        name="wait",
        label=message("Time until it stands still"),
        kind="number",
        default=DEFAULT.still_timeout,
        unit="s",
        least=1.0,
        most=3600.0,
        advanced=True,
    ),
    RunField(
        name="level_floor",
        label=message("Take the floor for level"),
        kind="flag",
        default=False,
        advanced=True,
    ),
    *GRAVITY_FIELDS,
    RunField(name="calibration", label=message("Calibration to apply first"), kind="file", advanced=True),
)


class GuidedSpin:
    """One spin of one robot; see `GuidedRun`. A spin that fails has an outcome that states why.

    Raises `TumbleError`, in one line, where the order cannot be carried out.
    """

    def __init__(self, order: RunOrder) -> None:
        answers = Answers(FIELDS, order.options)
        if len(order.sources) != 1:
            raise ProcedureError("spin: takes one unit at a time; name one source")
        [(self._name, self._typed)] = order.sources.items()
        calibration = answers.file("calibration")
        self._calibration = None if calibration is None else Calibration.load(calibration)
        self._options = _options(answers)
        # A machine alone refuses what a run would refuse later.
        SpinMachine(self._options, calibration=self._calibration)
        read = order.read_options()[self._name]
        stream = open_source(self._typed, read, sender=order.sender)
        self._source = GuidedSource(stream, self._name)
        self._serial = read.serial or getattr(stream, "serial", "")
        self._folder = order.folder
        prepare_unit_files(self._folder, self._name, "live")
        self._session = next_session_folder(self._folder)
        self._live: LiveSpin | None = None
        self._why_not = ""
        """Reason why there is no result."""
        self._heading = self._turned = 0.0

    def views(self) -> Iterator[RunView]:
        """See `GuidedRun`."""
        source = cast("Source", self._source)
        recorded = recorded_source(source, self._session, typed=self._typed, serial=self._serial)
        newest: SpinStep | None = None
        try:
            with recorded as samples, samples:
                self._live = LiveSpin(
                    samples,
                    self._options,
                    typed=self._typed,
                    serial=self._serial,
                    calibration=self._calibration,
                )
                for newest in self._live.steps():
                    yield self._view(newest)
        except (LogError, ProcedureError) as error:
            if isinstance(error, LogError) and not self._source.is_stopped:
                raise
            self._why_not = "stopped" if self._source.is_stopped else error.why
            if newest is not None:
                yield self._view(newest, ended=self._why_not)

    def stop(self) -> None:
        """See `GuidedRun`."""
        self._source.is_stopped = True

    def act(self, action: str, subject: str = "") -> None:
        """See `GuidedRun`; there is nothing to be done beside stopping."""

    def outcome(self) -> RunOutcome:
        """See `GuidedRun`."""
        if self._live is None or self._why_not:
            failed = UnitOutcome(
                name=self._name,
                serial=self._serial,
                verdict="not observable",
                word="not calibrated",
                reasons=(Message(self._why_not or "no sample came"),),
            )
            return RunOutcome(verdict=failed.verdict, units=(failed,), complete=False)
        result = self._live.result()
        unit = self._of_result(result)
        return RunOutcome(verdict=unit.verdict, units=(unit,))

    def _of_result(self, result: SpinResult) -> UnitOutcome:
        files = result.save(self._folder)
        loss = SampleLoss(self._name, self._source.samples, self._source.missing, 0)
        lost = (Message(str(loss)),) if loss.is_heavy else ()
        verdict = VERDICTS.get(result.verdict, "warned")
        biases = [
            *result.accelerometer_bias.parameters("accelerometer"),
            *result.gyroscope_bias.parameters("gyroscope"),
        ]
        hidden = dict.fromkeys(each.reason for each in biases if not each.observable)
        return UnitOutcome(
            name=result.name,
            serial=result.serial,
            verdict="warned" if lost and verdict == "passed" else verdict,
            word=result.verdict,
            reasons=tuple(map(Message, hidden)) + lost + tuple(map(Message, result.warnings)),
            furthest=furthest_from_ideal((each.name, each) for each in biases),
            calibration=files["calibration"],
            page=files["report"],
        )

    def _view(self, step: SpinStep, ended: str = "") -> RunView:
        self._note_heading(step)
        kind = "ended early" if ended else KINDS.get(step.kind, "progress")
        progress = step.progress
        left = progress["still_wanted"] - progress["still"]
        return RunView(
            kind=kind,
            elapsed=self._source.elapsed,
            instruction=message("Ended early.") if ended else self._instruction(step),
            detail=_detail(step),
            remaining=max(0.0, left) if step.state == "still" else math.nan,
            checks=(_rest(step), _turns(step)),
            lamps=(UnitLamp(self._name, _lamp(step), self._source.rate),),
            bodies=self._body(),
            subject=self._name if kind == "warning" else "",
            warning=Message(ended) if ended else _warning(step, self._options),
        )

    def _note_heading(self, step: SpinStep) -> None:
        turned = step.progress["turned"]
        self._heading += math.copysign(turned - self._turned, step.progress["rate"])
        self._turned = turned

    def _body(self) -> tuple[BodyView, ...]:
        up = self._source.up
        if up is None:
            return ()
        x, y, z = map(float, up)
        return (BodyView(self._name, (x, y, z), turned_now=floor_from_case(up, self._heading)),)

    def _instruction(self, step: SpinStep) -> Message:
        if step.kind == "done":
            return message("Done. The robot may stop.")
        if step.state == "still":
            return message("Let the robot stand still.")
        return HINTS["none" if step.progress["at_rest"] else step.pace]


def _options(answers: Answers) -> LiveSpinOptions:
    rate = answers.number("rate")
    stated = gravity_of(answers)
    return LiveSpinOptions(
        still=answers.number("still") or DEFAULT.still,
        turns=answers.number("turns") or DEFAULT_TURNS,
        rate=DEFAULT.rate if rate is None else math.radians(rate),
        wait=answers.number("wait"),
        level_floor=answers.flag("level_floor"),
        gravity=stated["gravity"],
        latitude=stated["latitude"],
        height=stated["height"],
    )


def _detail(step: SpinStep) -> Message:
    progress = step.progress
    if step.state == "still":
        return message(
            "{still} of {wanted} s", still=f"{progress['still']:.1f}", wanted=f"{progress['still_wanted']:g}"
        )
    return message(
        "{turned} of {wanted} turns, either way; {rate} deg/s now",
        turned=f"{progress['turned'] / math.tau:.2f}",
        wanted=f"{progress['turned_wanted'] / math.tau:.4g}",
        rate=f"{abs(math.degrees(progress['rate'])):.0f}",
    )


def _warning(step: SpinStep, options: LiveSpinOptions) -> Message:
    still = f"{options.still:g}"
    if step.kind == "turning first":
        return message(
            "It turns before it stood still. Stop it, and let it stand still for {still} s.", still=still
        )
    if step.kind == "still broken":
        return message("It moved. Let it stand still for {still} s, from the beginning.", still=still)
    return NOTHING


def _rest(step: SpinStep) -> CheckGroup:
    progress = step.progress
    done = step.state != "still"
    share = 1.0 if done else min(1.0, progress["still"] / progress["still_wanted"])
    return CheckGroup(
        message("Stand still"), (CheckItem("rest", share, done=done, current=not done, detail=NOTHING),)
    )


def _turns(step: SpinStep) -> CheckGroup:
    """Returns an item for each turn; the last may be a part of one."""
    turned, wanted = (step.progress[key] / math.tau for key in ("turned", "turned_wanted"))
    is_over = step.state == "done"
    items = []
    for number in range(math.ceil(wanted)):
        size = min(1.0, wanted - number)
        share = 1.0 if is_over else min(1.0, max(0.0, (turned - number) / size))
        current = step.state == "spin" and number <= turned < number + size
        items.append(CheckItem(str(number + 1), share, done=share >= 1.0, current=current))
    return CheckGroup(message("Turns"), tuple(items))


def _lamp(step: SpinStep) -> UnitLampState:
    if step.time is None:
        return "waiting"
    return (
        "rest"
        if step.progress["at_rest"] or (step.progress["still"] > 0.0 and step.state == "still")
        else "motion"
    )


RUN_KIND: Final = RunKind(
    word="spin",
    title=message("Spin of a robot"),
    summary=message("Finds the biases of a robot's IMU: it stands still, then turns on the spot."),
    roles=(UnitRole(name="unit", label=message("Robot")),),
    fields=FIELDS,
    resumes=False,
    begin=GuidedSpin,
)
