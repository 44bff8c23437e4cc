"""Scenario in, session out: what people write in degrees goes to the native simulator in rad."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from math import radians
from typing import Any

import numpy as np

from tumble import _core
from tumble.recording import Chunk, Recording
from tumble.simulate.fault import AXES, Fault
from tumble.simulate.flight_scenario import FlightScenario
from tumble.simulate.grade import Grade
from tumble.simulate.scenario import (
    REFERENCE,
    STANDARD_GRAVITY,
    RotationDeg,
    ScenarioError,
    TurntableScenario,
)
from tumble.simulate.session import (
    ClockTruth,
    SimulatedTurntable,
    SimulatedUnit,
    TriadTruth,
    TrueRest,
)

PPM = 1e-6
FOREVER = 1e9
"""s, beyond any recording."""
NATIVE_KINDS = {
    "bias-jump": "bias",
    "bias-drift": "bias",
    "absent": "gap",
    "dead": "gap",
    "time-backwards": "clock-jump",
}
"""What the native simulator calls a fault, where it knows it as a case of another."""
CENTRE = (0.0, 0.0, 0.0)


def simulate_turntable(scenario: TurntableScenario | None = None, **changes: Any) -> SimulatedTurntable:  # noqa: ANN401
    """Play a scenario; `changes` are fields of `TurntableScenario`, set on top of it or of its defaults.

    Raises `ScenarioError`, in one line, where a figure makes no sense.
    """
    scenario = replace(scenario or TurntableScenario(), **changes)
    try:
        played = _core.simulate_turntable(_plain_scenario(scenario))
    except ValueError as error:
        raise ScenarioError(f"the session cannot be simulated: {error}; change that option") from error
    reference, *targets = (
        _unit(scenario, name, figures)
        for name, figures in zip(scenario.unit_names, [played["reference"], *played["targets"]], strict=True)
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


def _plain_scenario(scenario: TurntableScenario) -> dict[str, Any]:
    """Put together what `_core.simulate_turntable` asks for."""
    return {
        "conditions": plain_conditions(scenario),
        "table": _plain_table(scenario),
        "mounting": in_radians(scenario.mounting_angle_deg),
        "reference": _plain_unit(scenario, REFERENCE),
        "targets": [_plain_unit(scenario, name) for name in scenario.target_names],
    }


def plain_conditions(scenario: TurntableScenario | FlightScenario) -> dict[str, Any]:
    """Give what all units of a scenario share as the native simulator asks for it."""
    return {
        "seed": scenario.seed,
        "temperature_start": scenario.temperature_celsius,
        "temperature_rise": scenario.warm_up_kelvin,
        "warming_time": scenario.warm_up_seconds,
        "bias_instability": scenario.bias_instability,
        "quantisation": scenario.quantisation,
        "g_sensitivity": scenario.g_sensitivity,
    }


def _plain_table(scenario: TurntableScenario) -> dict[str, Any]:
    ups = {pose.name: pose.up.tolist() for pose in scenario.poses}
    latitude = scenario.latitude_deg
    return {
        "poses": [
            {"up": ups[name], "tip": radians(scenario.tipped_deg.get(name, 0.0))}
            for name in scenario.visited()
        ],
        "rest_duration": scenario.rest_seconds,
        "profile": scenario.turn_profile,
        "turn_rate": radians(scenario.turn_rate_dps),
        "turn_acceleration": radians(scenario.turn_acceleration_dps2),
        "heading_turn": radians(scenario.heading_turn_deg),
        "error": radians(scenario.table_error_deg),
        "gravity": scenario.gravity,
        "latitude": None if latitude is None else radians(latitude),
    }


def _plain_unit(scenario: TurntableScenario, name: str) -> dict[str, Any]:
    is_reference = name == REFERENCE
    # The clock of the reference is that of the session.
    apart = scenario.clocks == "apart" and not is_reference
    return {
        "grade": asdict(scenario.grade_of(name)),
        "perfect": is_reference and scenario.perfect_reference,
        "rate": scenario.rate_of(name),
        "mounting": in_radians(scenario.mounting_of(name)),
        "ageing": [0.0, 0.0],
        "lever_arm": scenario.lever_arm_m.get(name, CENTRE),
        "clock": {
            "drawn": apart,
            "offset": scenario.clock_offset_seconds if apart else 0.0,
            "skew": scenario.clock_skew_ppm * PPM if apart else 0.0,
            "phase": 0.0,
        },
        "latency": 0.0,
        "faults": _plain_faults(scenario, name),
    }


def _plain_faults(scenario: TurntableScenario, name: str) -> list[dict[str, Any]]:
    largest = {"accelerometer": scenario.gravity, "gyroscope": radians(scenario.turn_rate_dps)}
    return [
        plain_fault(fault, scenario.rest_seconds / 2, largest[fault.triad])
        for fault in scenario.faults_of(name)
    ]


def plain_fault(fault: Fault, middle: float, largest: float) -> dict[str, Any]:
    """Give a fault as the native simulator asks for it.

    `middle` of the first rest, s, is when it starts if it does not say; `largest` is what its triad reads at
    most, m/s^2 or rad/s.
    """
    axis = AXES.index(fault.axis)
    start, end = _fault_span(fault, middle)
    return {
        "kind": NATIVE_KINDS.get(fault.kind, fault.kind),
        "channels": fault.triad,
        "axis": axis,
        "other_axis": (axis + 1) % 3,
        "start": start,
        "end": end,
        "size": _fault_size(fault, largest),
    }


def _fault_span(fault: Fault, middle: float) -> tuple[float, float]:
    start = middle if fault.start is None else fault.start
    match fault.kind:
        case "saturated":
            return -FOREVER if fault.start is None else start, FOREVER if fault.end is None else fault.end
        case "absent":
            return -FOREVER, FOREVER if fault.end is None else fault.end
        case "dead":
            return start, FOREVER
        case "bias-jump":
            return start, start
    return start, start + 1.0 if fault.end is None else fault.end


def _fault_size(fault: Fault, largest: float) -> float:
    """In the unit the simulator asks for."""
    accelerometer = fault.triad == "accelerometer"
    usual = {
        "scale": 1.2,
        "moved": 2.0,
        "bias-jump": 1.0 if accelerometer else 0.1,
        "bias-drift": 1.0 if accelerometer else 0.1,
        "noise": 1.0 if accelerometer else 0.1,
        "spikes": 50.0 if accelerometer else 10.0,
        "saturated": 0.8,
        "late": 0.5,
        "time-backwards": 1.0,
        "clock-jump": 1.0,
    }
    size = usual.get(fault.kind, 0.0) if fault.size is None else fault.size
    match fault.kind:
        case "moved":
            return radians(size)
        case "saturated":
            return largest * size
        case "wrong-unit":
            return 1.0 / STANDARD_GRAVITY if accelerometer else float(np.degrees(1.0))
        case "time-backwards":
            return -size
    return size


def in_radians(rotation: RotationDeg) -> float | list[float]:
    """Give a rotation in rad."""
    return radians(rotation) if isinstance(rotation, int | float) else [radians(part) for part in rotation]


def _unit(scenario: TurntableScenario, name: str, figures: _core.SimulatedUnitFigures) -> SimulatedUnit:
    return simulated_unit(
        figures,
        name=name,
        grade=scenario.grade_of(name),
        serial=f"SIM-{scenario.seed}-{scenario.unit_names.index(name)}",
        clock="turntable" if scenario.clocks == "shared" else "",
        faults=scenario.faults_of(name),
    )


def simulated_unit(
    figures: _core.SimulatedUnitFigures,
    *,
    name: str,
    grade: Grade,
    serial: str,
    clock: str,
    faults: Sequence[Fault],
) -> SimulatedUnit:
    """Put a unit together from what the native simulator gives; `clock` names the time base it shares."""
    samples = Chunk(figures["time"], figures["accelerometer"], figures["gyroscope"], figures["temperature"])
    offset, skew, phase = figures["clock"]
    return SimulatedUnit(
        name=name,
        grade=grade,
        samples=samples,
        recording=Recording.from_arrays(
            name,
            samples.time,
            samples.accelerometer,
            samples.gyroscope,
            samples.temperature,
            serial=serial,
            clock=clock,
        ),
        accelerometer=triad_truth(figures["accelerometer_truth"]),
        gyroscope=triad_truth(figures["gyroscope_truth"]),
        clock=ClockTruth(offset, skew / PPM, phase),
        faults=tuple(faults),
    )


def triad_truth(figures: _core.TriadTruthFigures) -> TriadTruth:
    """Put the truth of a triad together from what the native simulator gives."""
    return TriadTruth(
        M=figures["M"],
        b=figures["b"],
        K=np.diag(figures["scale"]),
        L=figures["L"],
        Q=figures["Q"],
        mounting=figures["mounting"],
        non_orthogonality=figures["non_orthogonality"],
        g_sensitivity=figures["g_sensitivity"],
        drift=figures["drift"],
        temperature_coefficient=figures["temperature_coefficient"],
        noise_density=figures["noise_density"],
        bias_instability=figures["bias_instability"],
        quantisation=figures["quantisation"],
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
