"""A simulated turntable session: scenario in, recordings of all units and their truth out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import radians
from typing import Any

import numpy as np

from tumble import _core
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import FloatArray, Recording
from tumble.tools.simulate import scenario_json
from tumble.tools.simulate.turntable.magnetometers import fields_of, magnetometer_of
from tumble.tools.simulate.turntable.scenario import REFERENCE, TurntableScenario
from tumble.tools.simulate.unit import PPM, MagnetometerTruth, SimulatedUnit, simulated_unit

CENTRE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class TrueRest:
    """The table at rest."""

    pose: str
    start: float
    end: float
    """s of the session's clock."""
    table_error: FloatArray
    """(3,) rotation vector, rad, table frame, by which the table misses the pose."""
    specific_force: FloatArray
    """(3,) m/s^2, case frame."""
    angular_rate: FloatArray
    """(3,) rad/s, case frame: the Earth's."""


@dataclass(frozen=True, slots=True)
class SimulatedTurntable:
    """A session: reference and targets, with their truth."""

    scenario: TurntableScenario
    reference_unit: SimulatedUnit
    target_units: tuple[SimulatedUnit, ...]
    R_e: FloatArray
    """(3, 3) mounting of the shared structure, case_from_table."""
    mounting: FloatArray
    """(3,) rotation vector of R_e, rad."""
    earth_rate: FloatArray
    """(3,) rad/s, level frame: x east, y north, z up."""
    rests: tuple[TrueRest, ...]
    duration: float
    """s."""

    @property
    def reference(self) -> Recording:
        """Recording of the reference."""
        return self.reference_unit.recording

    @property
    def targets(self) -> tuple[Recording, ...]:
        """Recordings of the targets."""
        return tuple(unit.recording for unit in self.target_units)

    @property
    def units(self) -> tuple[SimulatedUnit, ...]:
        """The reference, then the targets."""
        return (self.reference_unit, *self.target_units)

    def __getitem__(self, name: str) -> SimulatedUnit:
        """Returns the unit of that name; raises `KeyError`."""
        for unit in self.units:
            if unit.name == name:
                return unit
        raise KeyError(name)


def simulate_turntable(scenario: TurntableScenario | None = None, **changes: Any) -> SimulatedTurntable:  # noqa: ANN401
    """Plays a scenario; `changes` are fields of `TurntableScenario`, set on top of it or of its defaults.

    Raises `ScenarioError`, in one line, where a figure makes no sense.
    """
    scenario = replace(scenario or TurntableScenario(), **changes)
    fields = fields_of(scenario) if scenario.magnetometer else None
    played = scenario_json.play(
        lambda text: _core.simulate_turntable(text, fields), _native(scenario), "session"
    )
    units = [played["reference"], *played["targets"]]
    reference, *targets = (
        _unit(scenario, name, figures, _magnetic(scenario, name, played, k) if fields else None)
        for k, (name, figures) in enumerate(zip(scenario.unit_names, units, strict=True))
    )
    return SimulatedTurntable(
        scenario=scenario,
        reference_unit=reference,
        target_units=tuple(targets),
        R_e=played["case_from_table"],
        mounting=played["mounting"],
        earth_rate=played["earth_rate"],
        rests=tuple(_rests(scenario, played["rests"])),
        duration=played["duration"],
    )


def _native(scenario: TurntableScenario) -> dict[str, Any]:
    """Puts together the scenario of `turntable.rs`."""
    return {
        "conditions": scenario_json.conditions(
            seed=scenario.seed,
            temperature_celsius=scenario.temperature_celsius,
            warm_up_kelvin=scenario.warm_up_kelvin,
            warm_up_seconds=scenario.warm_up_seconds,
            bias_instability=scenario.bias_instability,
            quantisation=scenario.quantisation,
            g_sensitivity=scenario.g_sensitivity,
        ),
        "table": _native_table(scenario),
        "mounting": scenario_json.in_radians(scenario.mounting_angle_deg),
        "reference": _native_unit(scenario, REFERENCE),
        "targets": [_native_unit(scenario, name) for name in scenario.target_names],
    }


def _native_table(scenario: TurntableScenario) -> dict[str, Any]:
    ups = {pose.name: pose.up for pose in scenario.poses}
    return {
        "poses": [
            {"up": ups[name], "tip": radians(scenario.tipped_deg.get(name, 0.0))}
            for name in scenario.visited()
        ],
        "rest_duration": scenario.rest_seconds,
        "profile": scenario.turn_profile,
        "limits": {
            "rate": radians(scenario.turn_rate_dps),
            "acceleration": radians(scenario.turn_acceleration_dps2),
        },
        "heading_turn": radians(scenario.heading_turn_deg),
        "rates": [radians(rate) for rate in scenario.rates_dps],
        "rate_duration": scenario.seconds_per_rate,
        "error": radians(scenario.table_error_deg),
        "gravity": scenario.gravity,
        "latitude": scenario_json.in_radians_or_none(scenario.latitude_deg),
    }


def _native_unit(scenario: TurntableScenario, name: str) -> dict[str, Any]:
    is_reference = name == REFERENCE
    offset, skew = scenario.clock_offset_seconds, scenario.clock_skew_ppm * PPM
    # The clock of the reference is that of the session.
    apart = scenario.clocks == "apart" and not is_reference
    return scenario_json.unit(
        scenario.grade_of(name),
        perfect=is_reference and scenario.perfect_reference,
        rate=scenario.rate_of(name),
        mounting=scenario_json.in_radians(scenario.mounting_of(name)),
        lever_arm=scenario.lever_arm_m.get(name, CENTRE),
        clock={"drawn": {"offset": offset, "skew": skew}} if apart else scenario_json.given_clock(),
        faults=_native_faults(scenario, name),
    )


def _native_faults(scenario: TurntableScenario, name: str) -> list[dict[str, Any]]:
    largest = {"accelerometer": scenario.gravity, "gyroscope": radians(scenario.turn_rate_dps)}
    return [
        scenario_json.injected_fault(fault, scenario.rest_seconds / 2, largest[fault.triad])
        for fault in scenario.faults_of(name)
    ]


def _magnetic(
    scenario: TurntableScenario, name: str, played: _core.SimulatedSession, place: int
) -> tuple[MagneticTrack, MagnetometerTruth]:
    figures = [played["reference"], *played["targets"]][place]
    offset, skew, _ = figures["clock"]
    time = figures["time"]
    near = np.zeros(len(time))
    if scenario.disturbed:
        rests, at = played["rests"], scenario.disturbed - 1
        own = (time - offset) / (1.0 + skew)
        near = ((own >= rests["start"][at]) & (own <= rests["end"][at])).astype(float)
    return magnetometer_of(scenario, name, time, played["fields"][place], near)


def _unit(
    scenario: TurntableScenario,
    name: str,
    figures: _core.SimulatedUnitFigures,
    magnetic: tuple[MagneticTrack, MagnetometerTruth] | None,
) -> SimulatedUnit:
    return simulated_unit(
        figures,
        name=name,
        grade=scenario.grade_of(name),
        serial=f"SIM-{scenario.seed}-{scenario.unit_names.index(name)}",
        clock="turntable" if scenario.clocks == "shared" else "",
        faults=scenario.faults_of(name),
        magnetic=magnetic,
    )


def _rests(scenario: TurntableScenario, figures: _core.TrueRestFigures) -> Iterator[TrueRest]:
    visited = scenario.visited()
    for row, pose in enumerate(figures["pose"]):
        yield TrueRest(
            pose=visited[pose],
            start=float(figures["start"][row]),
            end=float(figures["end"][row]),
            table_error=figures["table_error"][row],
            specific_force=figures["specific_force"][row],
            angular_rate=figures["angular_rate"][row],
        )
