"""A still log that an operator watches: Allan deviations grow until the units lay still for long enough."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from tumble.foundation.errors import ProcedureError, TumbleError
from tumble.foundation.message import Message, message
from tumble.foundation.results import INTERVAL, Parameter
from tumble.foundation.units import TRIADS, UNITS, Triad
from tumble.foundation.words import LISTENING, join, length_of_time
from tumble.live import open_set
from tumble.logs.session import SessionProcedure
from tumble.procedures.noise.command_files import prepare
from tumble.procedures.noise.live import LiveNoise, NoiseStep
from tumble.procedures.noise.procedure import noise
from tumble.procedures.noise.report.text import unidentified
from tumble.procedures.noise.result import ASKED_FOR, ChannelNoise, DeviationCurve, NoiseResult
from tumble.tools.guided.answers import Answers
from tumble.tools.guided.field import RunField, UnitRole
from tumble.tools.guided.figures import AllanCurve, AllanFigure, RunFigure
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.outcome import FurthestParameter, RunOutcome, RunVerdict, UnitOutcome, worst
from tumble.tools.guided.run import RunKind
from tumble.tools.guided.view import CheckGroup, CheckItem, RunView, UnitLamp, ViewKind

MINUTE = 60.0
"""s."""
KINDS: Mapping[str, ViewKind] = {LISTENING: "listening", "found": "progress", "ended early": "ended early"}
"""Kinds of views by those of steps, where they differ."""
VERDICTS: Mapping[str, RunVerdict] = {"measured": "passed", "model not met": "failed"}
"""By the verdict of the procedure; `warned` for others."""
TITLES: Mapping[Triad, Message] = {
    "accelerometer": message("Allan deviation of the accelerometer"),
    "gyroscope": message("Allan deviation of the gyroscope"),
}
TITLES_OF_SEVERAL: Mapping[Triad, Message] = {
    "accelerometer": message("Allan deviation of the accelerometers, RMS of the axes"),
    "gyroscope": message("Allan deviation of the gyroscopes, RMS of the axes"),
}
FIELDS = (
    RunField(
        name="duration",
        label=message("Time at rest"),
        kind="number",
        default=120.0,
        unit="min",
        least=0.1,
        most=20_000.0,
        help=message("Bias instability and random walk take some hours."),
    ),
    RunField(
        name="calibration",
        label=message("Calibration to add the noise to"),
        kind="file",
        advanced=True,
    ),
)


class GuidedNoise:
    """One still log of one unit or several; see `GuidedRun`.

    Raises `TumbleError`, in one line, where the order cannot be carried out.
    """

    def __init__(self, order: RunOrder) -> None:
        answers = Answers(FIELDS, order.options)
        self._order = order
        self._calibration = answers.file("calibration")
        self._names = tuple(order.sources)
        if not self._names:
            raise ProcedureError("noise: no unit is named; give one or more")
        for name in self._names:
            prepare(order.folder, name)
        minutes, reading = answers.number("duration"), order.read_options()
        self._units = open_set(
            [f"{name}={address}" for name, address in order.sources.items()],
            reading,
            sender=order.sender,
            keep_going=True,
        )
        self._live = LiveNoise(
            self._units,
            order.folder,
            sources=order.sources,
            serials={name: each.serial for name, each in reading.items()},
            wanted=None if minutes is None else MINUTE * minutes,
            procedure=SessionProcedure(
                name="noise",
                operator=order.operator,
                station=order.station,
                options={"minutes": minutes, **({"resumed": True} if order.resume else {})},
            ),
            resume=order.resume,
        )

    def views(self) -> Iterator[RunView]:
        """See `GuidedRun`."""
        for step in self._live.steps():
            yield _view(step)

    def stop(self) -> None:
        """See `GuidedRun`."""
        self._live.stop()

    def act(self, action: str, subject: str = "") -> None:
        """See `GuidedRun`; there is nothing to be done beside stopping."""

    def outcome(self) -> RunOutcome:
        """See `GuidedRun`."""
        if not self._live.received:
            raise ProcedureError(
                f"{join(self._names)}: no sample came; check power, cables and the address, and go on with "
                "the same session"
            )
        losses = {loss.name: loss for loss in self._units.losses if loss.is_heavy}
        units = tuple(self._of_unit(name, str(losses.get(name, ""))) for name in self._names)
        return RunOutcome(
            verdict=worst(tuple(unit.verdict for unit in units)),
            units=units,
            complete=self._live.is_reached,
        )

    def _of_unit(self, name: str, loss: str) -> UnitOutcome:
        serial = self._order.serials.get(name, "")
        try:
            result = noise(f"{self._live.session}:{name}", calibration=self._calibration)
        except TumbleError as error:
            reasons = (Message(error.why),)
            return UnitOutcome(
                name=name, serial=serial, verdict="not observable", word="not measured", reasons=reasons
            )
        files = result.save(self._order.folder)
        verdict = VERDICTS.get(result.verdict, "warned")
        lost = (Message(loss),) if loss else ()
        return UnitOutcome(
            name=result.name,
            serial=result.serial,
            verdict="warned" if lost and verdict == "passed" else verdict,
            word=result.verdict,
            reasons=(*lost, *map(Message, unidentified(result)), *map(Message, result.warnings)),
            furthest=tuple(_furthest(result)),
            calibration=files["calibration"],
            page=files["report"],
        )


def _view(step: NoiseStep) -> RunView:
    return RunView(
        kind=KINDS.get(step.kind, step.kind),  # type: ignore[arg-type]
        elapsed=step.elapsed,
        instruction=_instruction(step),
        detail=_detail(step),
        remaining=_remaining(step),
        checks=(_time_check(step), *_term_checks(step)),
        lamps=tuple(UnitLamp(unit.name, unit.condition, unit.rate) for unit in step.units),
        figures=tuple(_figures(step)),
        subject=step.subject,
        warning=_warning(step),
    )


def _warning(step: NoiseStep) -> Message:
    if step.kind == "warning":
        return message("{unit}: {text}", unit=step.subject, text=step.text)
    return Message(step.text)


def _instruction(step: NoiseStep) -> Message:
    moving = join([unit.name for unit in step.units if unit.condition == "motion" and step.still[unit.name]])
    if step.kind == "done":
        return message("Done.")
    if step.kind == "ended early":
        return message("Ended early.")
    if moving:
        return message("{units} moves. Let it lie untouched.", units=moving)
    return message("Let it lie untouched.")


def _detail(step: NoiseStep) -> Message:
    still = length_of_time(_least(step)) if _least(step) else "0 s"
    if step.wanted is None:
        return message("At rest for {time}.", time=still)
    return message("At rest for {time} of {wanted}.", time=still, wanted=length_of_time(step.wanted))


def _least(step: NoiseStep) -> float:
    return min(step.still.values())


def _remaining(step: NoiseStep) -> float:
    return math.nan if step.wanted is None else max(0.0, step.wanted - _least(step))


def _time_check(step: NoiseStep) -> CheckGroup:
    items = (_at_rest(name, seconds, step.wanted) for name, seconds in step.still.items())
    return CheckGroup(message("Time at rest"), tuple(items))


def _at_rest(name: str, seconds: float, wanted: float | None) -> CheckItem:
    share = 0.0 if wanted is None else min(1.0, seconds / wanted)
    text = message("{time}", time=length_of_time(seconds) if seconds else "0 s")
    return CheckItem(name, share, done=share >= 1.0, current=share < 1.0, detail=text)


def _term_checks(step: NoiseStep) -> Iterator[CheckGroup]:
    """Returns which terms the record shows by now, of all channels."""
    channels = [each for found in step.channels.values() for each in found]
    if channels:
        items = (_shown(term, [each.term(term) for each in channels]) for term in ASKED_FOR)
        yield CheckGroup(message("Shown so far"), tuple(items))


def _shown(term: str, found: Sequence[Parameter]) -> CheckItem:
    shown = sum(each.observable for each in found)
    share = shown / len(found)
    text = message("{count} of {all} channels", count=shown, all=len(found))
    return CheckItem(term, share, done=share >= 1.0, detail=text)


def _figures(step: NoiseStep) -> Iterator[RunFigure]:
    for triad in TRIADS:
        own = {unit: [each for each in found if each.triad == triad] for unit, found in step.channels.items()}
        if len(own) == 1:
            [channels] = own.values()
            curves = tuple(_curve(each.name[-1], each.allan) for each in channels)
            yield AllanFigure(TITLES[triad], UNITS[triad], curves)
        elif own:
            curves = tuple(_mean_curve(unit, channels) for unit, channels in own.items())
            yield AllanFigure(TITLES_OF_SEVERAL[triad], UNITS[triad], curves)


def _curve(name: str, curve: DeviationCurve) -> AllanCurve:
    sigma = 0.5 * (curve.high - curve.low) / INTERVAL
    return AllanCurve(name, tuple(curve.tau.tolist()), tuple(curve.deviation.tolist()), tuple(sigma.tolist()))


def _mean_curve(name: str, channels: Sequence[ChannelNoise]) -> AllanCurve:
    """Returns the root mean square over the axes of a unit."""
    deviation = np.sqrt(np.mean([each.allan.deviation**2 for each in channels], axis=0))
    return AllanCurve(name, tuple(channels[0].allan.tau.tolist()), tuple(deviation.tolist()))


def _furthest(result: NoiseResult) -> Iterator[FurthestParameter]:
    """Returns the largest value of each term that was asked for, of each triad."""
    for triad in result.triads:
        for term in ASKED_FOR:
            own = [(each.name, each.term(term)) for each in result.channels if each.triad == triad]
            name, found = max(own, key=lambda each: math.inf if math.isnan(each[1].high) else each[1].high)
            yield FurthestParameter(
                f"{name} {term}", found.unit, found.value, found.sigma, within=found.observable
            )


RUN_KIND: Final = RunKind(
    word="noise",
    title=message("Still log"),
    summary=message("Finds the noise of units that lie untouched; their Allan deviations grow meanwhile."),
    roles=(UnitRole(name="unit", label=message("Unit"), most=None),),
    fields=FIELDS,
    begin=GuidedNoise,
)
