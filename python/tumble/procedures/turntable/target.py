"""One target of a turntable session: calibrated, described, held against its limits."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import (
    refuse_if_unfit,
    rejected_rests_of,
    rests_of,
    scale_notice,
    trace_of,
)
from tumble.acquisition.coarseness import coarse_channels
from tumble.acquisition.duplicate_sensors import duplicate_sensors
from tumble.acquisition.imu import Imu, log_name
from tumble.acquisition.notices import notices
from tumble.calibration.budget import Budget
from tumble.calibration.limits import Limits
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError, TumbleError
from tumble.foundation.provenance import NO_LOG
from tumble.foundation.results import Trace, TriadName, TriadResult
from tumble.foundation.units import TRIADS
from tumble.foundation.words import count_of, join
from tumble.poses.triads import triad_result
from tumble.procedures.turntable.budget import BudgetSources
from tumble.procedures.turntable.clock_steps import TimedTurns
from tumble.procedures.turntable.lost_rests import RestsBeside
from tumble.procedures.turntable.magnetometers import ReferenceMagnetometer, calibrated_magnetometer
from tumble.procedures.turntable.matching import PoseMatch
from tumble.procedures.turntable.messages import drift_words, explain
from tumble.procedures.turntable.off_diagonals import Treatment, off_diagonals
from tumble.procedures.turntable.rates import axis_responses
from tumble.procedures.turntable.reference import mounting_result
from tumble.procedures.turntable.result import AxisReading, ClockFit, OffDiagonal, TargetResult
from tumble.procedures.turntable.slips import LOOSE

PARTS_PER_MILLION = 1e6
LARGEST_RESIDUAL = 0.5
"""m/s^2: gravity out of place by 3 deg. A unit that turned as the reference did leaves far less."""

LEAST_SHOWN = 0.5
"""1-sigma of the asymmetry of an axis over the largest, beyond which it turned mostly one way. The prior is
the root mean square of the others: doubled, only an axis of which nothing shows is named."""
UNLIKELY = 1e-4
"""Chance of a chi-square so small that it deserves a remark, as one too large does."""

LARGEST_NON_ORTHOGONALITY = 3.0
"""deg: 5 % of cross-axis sensitivity, the worst that data sheets of consumer sensors allow."""


@dataclass(frozen=True, slots=True)
class TargetProcedure:
    """Inputs and settings that all targets of a session share."""

    reference: Imu
    fitted: _core.Reference
    match: PoseMatch
    settings: _core.TurntableSettings
    compared: Mapping[Treatment, _core.TurntableSettings]
    """The same with other truths, for comparison."""
    gravity: float
    limits: Limits | None
    response_asked_for: bool = False
    """Indicates whether the response of gyroscopes to specific force is fitted by request."""
    sources: BudgetSources | None = None
    """Sources of the budgets; None without a certificate of the reference."""
    magnetometer: ReferenceMagnetometer | None = None
    """Magnetometer of the reference, where it has one."""
    gyroscopes: dict[str, str] = field(default_factory=dict)
    """Name of the first unit with each gyroscope, by its digest."""

    def first_with_gyroscope(self, name: str, unit: Imu | TumbleError) -> str:
        """Returns the first unit with the gyroscope of this one: itself, unless one sensor has two names."""
        if isinstance(unit, TumbleError) or not unit.gyroscope_digest:
            return name
        return self.gyroscopes.setdefault(unit.gyroscope_digest, name)

    def _duplicates(self, name: str, unit: Imu) -> Iterator[str]:
        first = self.first_with_gyroscope(name, unit)
        names = (first, name) if first != name else ()
        return duplicate_sensors((each, unit.gyroscope_digest) for each in names)

    def calibrate(self, name: str, unit: Imu | TumbleError) -> TargetResult:
        """Calibrates one target; what hinders it becomes its failure."""
        if isinstance(unit, TumbleError):
            return _failed(name, unit)
        seen = _core.as_reference(self.reference.acquired, unit.acquired, self.settings)
        unit = replace(unit, acquired=seen)
        try:
            refuse_if_unfit(name, unit, self.gravity)
            figures = _core.calibrate_target(
                self.reference.acquired,
                self.fitted,
                unit.acquired,
                self.match.ups,
                self.settings,
                self._triads(name, unit),
            )
        except _core.CoreError as error:
            return _failed(name, ProcedureError(explain(error, self.match.names), about=name), unit)
        except TumbleError as error:
            return _failed(name, error, unit)
        stray = self._stray_rest(figures)
        if stray:
            return _failed(name, ProcedureError(stray, about=name), unit)
        result = self._budgeted(self._result(name, unit, figures), unit, figures)
        return self._decided(result) if self.limits else result

    def _budgeted(self, result: TargetResult, unit: Imu, figures: _core.TargetFigures) -> TargetResult:
        """Returns a target with the budget of each triad, where the reference has a certificate."""
        if self.sources is None:
            return result
        triads: dict[TriadName, TriadResult] = {}
        budgets: dict[TriadName, tuple[Budget, ...]] = {}
        for name in TRIADS:
            triad, found = getattr(result, name), figures[name]
            if triad is not None and found is not None:
                triads[name], budgets[name] = self.sources.budgeted(triad, found, unit, result.rests)
        return replace(
            result,
            accelerometer=triads.get("accelerometer"),
            gyroscope=triads.get("gyroscope"),
            budgets=budgets,
        )

    def _decided(self, result: TargetResult) -> TargetResult:
        """Returns a target held against its limits, by their decision rule where they have one."""
        assert self.limits is not None
        checks = self.limits.check(result)
        decision = self.limits.decide(result, checks, result.budgets)
        warnings = result.warnings
        if decision is not None and decision.verdict == "conditional pass":
            warnings = (*warnings, *decision.not_passed())
        return replace(result, checks=checks, decision=decision, warnings=warnings)

    def _triads(self, name: str, unit: Imu) -> tuple[bool, bool]:
        """Returns the triads that can be calibrated: both units have to show turns."""
        accelerometer, gyroscope = (triad in unit.triads for triad in TRIADS)
        gyroscope = gyroscope and "gyroscope" in self.reference.triads
        if not (accelerometer or gyroscope):
            raise ProcedureError(
                "has gyroscope readings only, and the reference has none to hold them against", about=name
            )
        return accelerometer, gyroscope

    def _stray_rest(self, figures: _core.TargetFigures) -> str:
        """Names the rest at which the target cannot have stood as the reference did; empty if none."""
        accelerometer = figures["accelerometer"]
        if accelerometer is None:
            return ""
        residuals = np.linalg.norm(accelerometer["residuals"], axis=1)
        worst = int(np.argmax(residuals))
        if residuals[worst] <= LARGEST_RESIDUAL:
            return ""
        _, rest, _ = accelerometer["labels"][worst]
        pose = f" ({self.match.names[rest]})" if rest in self.match.names else ""
        return (
            f"differs by {residuals[worst]:.2g} m/s^2 from what the reference measured, most at rest "
            f"{rest + 1}{pose}: it did not turn as the reference did; fasten it, and check that both logs, "
            "and the names of their files, belong together"
        )

    def _result(self, name: str, unit: Imu, figures: _core.TargetFigures) -> TargetResult:
        noise, instability = unit.acquired.noise_density, unit.acquired.bias_instability
        names = self.match.names
        poses = {
            rest: names[seen]
            for seen, first, last in figures["pairs"]
            if seen in names
            for rest in range(first, last + 1)
        }
        loose = (slip for angle, slip in self._slip(figures["accelerometer"]) if angle > LOOSE)
        turns = TimedTurns.of(self.reference, unit, figures)
        moved = (
            *self._drifting(unit, figures),
            *loose,
            *self._lost_in_time(unit, figures),
            *turns.objections(),
        )
        accelerometer = triad_result(
            "accelerometer", figures["accelerometer"], noise[:3], instability[:3], names
        )
        gyroscope = triad_result("gyroscope", figures["gyroscope"], noise[3:], instability[3:], names)
        result = TargetResult(
            name=name,
            source=log_name(unit.recording),
            serial=unit.recording.metadata.serial,
            accelerometer=_with_objections(accelerometer, moved),
            gyroscope=_with_objections(gyroscope, moved),
            rests=rests_of(unit.acquired, poses, unit.triads) + rejected_rests_of(unit.acquired),
            trace=trace_of(unit.acquired, unit.triads),
            clock=None if unit.recording.parts else _clock(figures["clock"]),
            axis_readings=(),
            temperature=unit.acquired.temperature,
            missing_samples=unit.acquired.missing,
            log=unit.log,
        )
        magnetic = calibrated_magnetometer(self.magnetometer, unit, figures, result.accelerometer, names)
        result = replace(result, magnetometer=magnetic.triad, field=magnetic.field)
        return replace(
            result,
            axis_readings=self._axis_readings(result, figures),
            off_diagonals=self._off_diagonals(unit),
            responses=axis_responses(figures["responses"]),
            warnings=(
                *notices(unit),
                *scale_notice(unit.acquired, self.gravity),
                *self._unshown(unit, result),
                *self._duplicates(name, unit),
                *turns.warnings(),
                *self._warnings(result, figures, rounded=bool(coarse_channels(unit.acquired, unit.triads))),
                *magnetic.warnings,
            ),
        )

    def _axis_readings(self, result: TargetResult, figures: _core.TargetFigures) -> tuple[AxisReading, ...]:
        """Prepares the source's figures: X and Y at the poses, before and after R_e^-1."""
        mounting = mounting_result(self.fitted)
        known = [(seen, first) for seen, first, _ in figures["pairs"] if seen in self.match.names]
        if mounting is None or not known or figures["accelerometer"] is None:
            return ()
        ideal = self.gravity * self.match.ups[[seen for seen, _ in known]]
        rests = [result.rests[first] for _, first in known]
        measured = np.array([rest.specific_force for rest in rests])
        sigma = np.array([rest.specific_force_sigma for rest in rests])
        compensated = mounting.in_table_frame(measured)
        labels = tuple(self.match.names[seen] for seen, _ in known)
        return (
            AxisReading("X", labels, ideal[:, 0], measured[:, 0], compensated[:, 0], sigma[:, 0]),
            AxisReading("Y", labels, ideal[:, 1], measured[:, 1], compensated[:, 1], sigma[:, 1]),
        )

    def _off_diagonals(self, unit: Imu) -> tuple[OffDiagonal, ...]:
        """Fits once more as if mounting were ignored, compensated as published, and measured."""
        if mounting_result(self.fitted) is None or "accelerometer" not in unit.triads:
            return ()
        try:
            fits = {each: self._accelerometer(unit, settings) for each, settings in self.compared.items()}
        except _core.CoreError:
            # A comparison needs the fits to all truths.
            return ()
        return off_diagonals(fits)

    def _accelerometer(self, unit: Imu, settings: _core.TurntableSettings) -> _core.TriadFigures:
        figures = _core.calibrate_target(
            self.reference.acquired, self.fitted, unit.acquired, self.match.ups, settings, (True, False)
        )
        accelerometer = figures["accelerometer"]
        assert accelerometer is not None, "it was asked for"
        return accelerometer

    def _about_direction(self, triad: TriadResult) -> str:
        """Describes residuals that go with the direction of gravity."""
        tilt = math.degrees(triad.by_direction / self.gravity)
        return (
            f"{triad.triad} residuals go with the face that is up, by {1e3 * triad.by_direction:.2g} mm/s^2: "
            f"the fixture flexes or slipped, as by {tilt:.1g} deg, or a sensor is not linear; the sigmas "
            "include it; fasten the unit in a stiffer fixture"
        )

    def _slip(self, figures: _core.TriadFigures | None) -> Iterator[tuple[float, str]]:
        """Reports a turn of the unit in its fixture between two rests, deg, which the fit took in."""
        if figures is None or "slip" not in figures:
            return
        before, behind, angle, sigma, holds_behind = figures["slip"]
        names = self.match.names
        rests = " and ".join(
            f"rest {rest + 1}" + (f" ({names[rest]})" if rest in names else "") for rest in (before, behind)
        )
        _, ended = self.reference.acquired.rest_times[before]
        began, _ = self.reference.acquired.rest_times[behind]
        yield (
            math.degrees(angle),
            f"slipped by {math.degrees(angle):.3f} ± {math.degrees(sigma):.1g} deg against the reference "
            f"between {rests}, at {ended:.1f} to {began:.1f} s: the mounting is that "
            f"{'behind' if holds_behind else 'before'}, and the fit includes the turn; fasten the unit",
        )

    def _response(self, gyroscope: TriadResult | None) -> Iterator[str]:
        """Reports that the response to specific force was fitted without a request."""
        if self.response_asked_for or gyroscope is None or gyroscope.g_sensitivity is None:
            return
        largest = math.degrees(float(np.abs(gyroscope.g_sensitivity).max())) * STANDARD_GRAVITY
        yield (
            f"gyroscope responds to specific force, by up to {largest:.2g} deg/s at 1 g: its residuals show "
            f"that (chance alone does in 1 of {1 / _core.RESPONSE_FALSE_ALARM:.0f} sessions), so the "
            "response was fitted; --no-g-sensitivity leaves it out"
        )

    def _unshown(self, unit: Imu, result: TargetResult) -> Iterator[str]:
        """Describes values that a unit with one triad, or beside one, leaves open."""
        if "accelerometer" in unit.triads and result.accelerometer is None:
            yield "the rests point in too few directions: the accelerometer is not calibrated"
        if "gyroscope" in unit.triads and "gyroscope" not in self.reference.triads:
            yield "the reference has no gyroscope, so the gyroscope could not be calibrated"
        if "gyroscope" not in unit.triads and not unit.recording.parts and self._shares_no_clock(unit):
            yield "its clock is taken for that of the reference, as without a gyroscope no turn shows another"

    def _shares_no_clock(self, unit: Imu) -> bool:
        """Returns whether there is no evidence that one clock stamped target and reference."""
        clock = unit.recording.metadata.clock
        return not clock or clock != self.reference.recording.metadata.clock

    def _drifting(self, unit: Imu, figures: _core.TargetFigures) -> Iterator[str]:
        """Reports a target that drifted at rests of the reference: its bias then is of the other rests."""
        drifted = sum(why == "drifting" for _, _, why in unit.acquired.rejected_rests)
        lost = min(drifted, len(self._lost(figures)))
        if lost:
            yield (
                f"specific force drifts in {count_of('rest', lost)} in which the reference stands still: the "
                "unit warms up, or turns slowly in its fixture; let it warm up, fasten it and record again"
            )

    def _lost_in_time(self, unit: Imu, figures: _core.TargetFigures) -> Iterator[str]:
        """Describes losses of rests that are no mere remark; files of poses have no common time."""
        lost = self._lost(figures)
        if lost and not unit.recording.parts:
            yield from RestsBeside.of(self.reference, unit, figures, lost).objections(unit.log.time)

    def _lost(self, figures: _core.TargetFigures) -> list[int]:
        """Returns the rests of the reference that are none of the target."""
        seen = {rest for rest, _, _ in figures["pairs"]} | set(figures["continued"])
        return [k for k in range(len(self.match.ups)) if k not in seen]

    def _warnings(
        self, result: TargetResult, figures: _core.TargetFigures, *, rounded: bool
    ) -> Iterator[str]:
        contradiction = figures["clock"]["contradiction"]
        if contradiction:
            yield (
                f"the turns lie {contradiction[0]:.3f} s apart although the clock is stated to be shared; "
                "try --clock apart"
            )
        # Errors that rests share are in the sigmas, and residuals show less of them.
        alike = rounded or any(triad.by_direction for triad in result.triads)
        lost = [str(k + 1) for k in self._lost(figures)]
        if lost:
            yield f"rest {', '.join(lost)} of the reference is not a rest of this unit; not used"
        yield from self._response(result.gyroscope)
        yield from _drift(figures["accelerometer"])
        yield from (slip for angle, slip in self._slip(figures["accelerometer"]) if angle <= LOOSE)
        yield from _asymmetry(figures["gyroscope"])
        yield from dict.fromkeys(each for triad in result.triads for each in triad.objections)
        for triad in result.triads:
            if triad.by_direction:
                yield self._about_direction(triad)
            elif triad.widening > 1.0:
                worst = int(np.argmax(np.abs(triad.residuals / triad.residual_sigma).max(axis=1)))
                yield (
                    f"{triad.triad} residuals exceed the noise (chi-square {triad.chi_square:.3g} for "
                    f"{triad.degrees_of_freedom}), most at {triad.residual_labels[worst]}: "
                    f"all sigmas were widened by a factor of {triad.widening:.2g}"
                )
            if not alike and triad.degrees_of_freedom > 0 and 1.0 - triad.p_value < UNLIKELY:
                yield (
                    f"{triad.triad} residuals are smaller than the noise explains (chi-square "
                    f"{triad.chi_square:.3g} for {triad.degrees_of_freedom}; chance leaves so little in "
                    f"fewer than 1 of {1 / UNLIKELY:.0f} sessions): the sigmas are too large"
                )
            if triad.triad != "magnetometer":
                # Soft iron leaves as much.
                yield from _skewed_axes(triad)


def _with_objections(triad: TriadResult | None, objections: tuple[str, ...]) -> TriadResult | None:
    return triad and replace(triad, objections=(*triad.objections, *objections))


def _asymmetry(figures: _core.TriadFigures | None) -> Iterator[str]:
    """Names axes whose scale differs by direction, and those that turned one way only."""
    if figures is None or "asymmetry" not in figures:
        return
    values, sigmas = (1e6 * np.array(each) for each in figures["asymmetry"])
    most = float(np.abs(values).max())
    one_way = [axis for axis, sigma in zip("xyz", sigmas, strict=True) if sigma > LEAST_SHOWN * most]
    verb, whose = ("turns", "its") if len(one_way) == 1 else ("turn", "their")
    rest = (
        f"; {join(one_way)} {verb} mostly one way, so that {whose} scale is uncertain by as much: turn it "
        "both ways"
        if one_way
        else ""
    )
    yield (
        f"the gyroscope has another scale at positive than at negative rates, by up to {most:.2g} ppm: the "
        f"mean of both is given{rest}"
    )


def _drift(figures: _core.TriadFigures | None) -> Iterator[str]:
    """Reports biases that drifted so far that the fit took it in."""
    if figures is not None and "drift" in figures:
        yield (
            "accelerometer biases drifted over the session, against the reference, "
            f"{drift_words(figures['drift'])}, which the fit includes: b is the mean; let the unit warm up "
            "first"
        )


def _skewed_axes(triad: TriadResult) -> Iterator[str]:
    """Names axes farther off a right angle than any sensor's: six poses do not exclude a slip."""
    for parameter in triad.parameters:
        if parameter.name.startswith("non-orthogonality") and parameter.observable:
            at_least = max(parameter.low, -parameter.high)
            if at_least > LARGEST_NON_ORTHOGONALITY:
                yield (
                    f"{triad.triad} {parameter.name} is {parameter.value:.1f} deg, more than usual for a "
                    "sensor: did the unit slip in its fixture between poses? Fasten it and record again"
                )


def _clock(figures: _core.ClockFigures) -> ClockFit:
    return ClockFit(
        shared=figures["shared"],
        offset=figures["offset"],
        offset_sigma=figures["offset_sigma"],
        skew=figures["skew"] * PARTS_PER_MILLION,
        skew_sigma=figures["skew_sigma"] * PARTS_PER_MILLION,
        turns=figures["turns"],
    )


def _failed(name: str, error: TumbleError, unit: Imu | None = None) -> TargetResult:
    nothing = np.empty((0, 3))
    return TargetResult(
        name=name,
        source=log_name(unit.recording) if unit else name,
        serial=unit.recording.metadata.serial if unit else "",
        accelerometer=None,
        gyroscope=None,
        rests=rests_of(unit.acquired, triads=unit.triads) + rejected_rests_of(unit.acquired) if unit else (),
        trace=trace_of(unit.acquired, unit.triads) if unit else Trace(np.empty(0), nothing, nothing),
        clock=None,
        axis_readings=(),
        temperature=unit.acquired.temperature if unit else None,
        missing_samples=unit.acquired.missing if unit else 0,
        log=unit.log if unit else NO_LOG,
        failure=str(error),
        failure_reason=error.why,
    )
