"""A simulated spin: scenario in, recording and truth out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import radians, sqrt
from typing import Any

import numpy as np

from tumble import _core
from tumble.foundation.recording import Chunk, FloatArray, Recording
from tumble.tools.simulate import scenario_json
from tumble.tools.simulate.fault import AXES
from tumble.tools.simulate.grade import Grade, TriadGrade
from tumble.tools.simulate.scenario import ScenarioError
from tumble.tools.simulate.spin.scenario import SpinScenario
from tumble.tools.simulate.unit import TriadTruth, triad_truth


@dataclass(frozen=True, slots=True)
class SimulatedSpin:
    """A recording of a robot that turned on the spot, and what is true of it."""

    scenario: SpinScenario
    samples: Chunk = field(repr=False)
    recording: Recording
    accelerometer: TriadTruth
    gyroscope: TriadTruth
    up: FloatArray
    """(3,) turning axis upwards across the floor, unit length, case frame."""
    roll: float
    pitch: float
    """rad, mounting of the IMU as `tumble spin` states it."""
    uphill_bearing: float
    """rad counter-clockwise from the case's x laid onto the floor, at the first heading."""
    lever_arm: FloatArray
    """(3,) m, case frame: the IMU from the turning axis, across it."""
    heading: FloatArray = field(repr=False)
    """(n,) rad at each sample, counter-clockwise, never folded."""
    moving: FloatArray = field(repr=False)
    """(n,) 1 where the wheels turn."""
    rests: FloatArray
    """(k, 2) start and end of each rest, s."""
    turns: FloatArray
    """(m, 2) start and end of each turn, s."""
    turned: FloatArray
    """(m,) rad truly turned in each, counter-clockwise positive."""

    @property
    def accelerometer_bias(self) -> FloatArray:
        """(3,) m/s^2, mean over the recording."""
        bias: FloatArray = self.accelerometer.b + self.accelerometer.drift
        return bias

    @property
    def gyroscope_bias(self) -> FloatArray:
        """(3,) rad/s, mean over the recording."""
        bias: FloatArray = self.gyroscope.b + self.gyroscope.drift
        return bias

    @property
    def floor_tilt(self) -> float:
        """Returns the tilt of the first floor, rad."""
        return radians(self.scenario.floor_tilt_deg)


def simulate_spin(scenario: SpinScenario | None = None, **changes: Any) -> SimulatedSpin:  # noqa: ANN401
    """Plays a scenario; `changes` are fields of `SpinScenario`, set on top of it or of its defaults.

    Raises `ScenarioError`, in one line, where a figure makes no sense.
    """
    scenario = replace(scenario or SpinScenario(), **changes)
    played = scenario_json.play(_core.simulate_spin, _native(scenario), "spin")
    unit = played["unit"]
    samples = Chunk(unit["time"], unit["accelerometer"], unit["gyroscope"], unit["temperature"])
    _refuse_unrecorded(scenario, samples)
    return SimulatedSpin(
        scenario=scenario,
        samples=samples,
        recording=Recording.from_arrays(
            "spin",
            samples.time,
            samples.accelerometer,
            samples.gyroscope,
            samples.temperature,
            serial=f"SIM-{scenario.seed}",
        ),
        accelerometer=triad_truth(unit["accelerometer_truth"]),
        gyroscope=triad_truth(unit["gyroscope_truth"]),
        up=played["up"],
        roll=played["roll"],
        pitch=played["pitch"],
        uphill_bearing=played["uphill_bearing"],
        lever_arm=played["lever_arm"],
        heading=played["heading"],
        moving=played["moving"],
        rests=played["rests"],
        turns=played["turns"],
        turned=played["turned"],
    )


def _refuse_unrecorded(scenario: SpinScenario, samples: Chunk) -> None:
    """Raises `ScenarioError` where a disturbance begins after the last sample: nothing would show it."""
    end = float(samples.time.max(initial=0.0))
    for disturbance in scenario.disturbances:
        if disturbance.start > end:
            raise ScenarioError(
                f"a disturbance at {disturbance.start:g} s, but the recording ends at {end:.2f} s; "
                "give an earlier time or a longer plan"
            )


def _native(scenario: SpinScenario) -> dict[str, Any]:
    """Puts together the scenario of `spin.rs`."""
    return {
        "conditions": scenario_json.conditions(
            seed=scenario.seed,
            temperature_celsius=scenario.temperature_celsius,
            bias_instability=scenario.bias_instability,
            quantisation=scenario.quantisation,
            g_sensitivity=False,
        ),
        "plan": _native_plan(scenario),
        "unit": scenario_json.unit(
            _grade(scenario),
            perfect=scenario.matrix_errors == 0.0,
            rate=scenario.rate_hz,
            mounting=[0.0, 0.0, 0.0],
            biases=[scenario.accelerometer_bias, scenario.gyroscope_bias],
            lever_arm=scenario.lever_arm_m,
            clock=scenario_json.given_clock(),
            faults=[*_scale_errors(scenario.gyroscope_scale), *_faults(scenario)],
        ),
    }


def _native_plan(scenario: SpinScenario) -> dict[str, Any]:
    return {
        "steps": list(_steps(scenario)),
        "floor": scenario_json.floor(scenario.floor_tilt_deg, scenario.uphill_deg),
        "acceleration": scenario.turn_acceleration,
        "unevenness": (scenario.unevenness, scenario.unevenness_hz),
        "slips": scenario.slips,
        "vibration": scenario.vibration,
        "disturbances": [
            {"start": d.start, "duration": d.seconds, "tilt": radians(d.tilt_deg), "lift": d.lift_m}
            for d in scenario.disturbances
        ],
        "mounting": scenario_json.in_radians((scenario.roll_deg, scenario.pitch_deg, scenario.yaw_deg)),
        "gravity": scenario.gravity,
        "latitude": scenario_json.in_radians_or_none(scenario.latitude_deg),
    }


def _steps(scenario: SpinScenario) -> Iterator[dict[str, Any]]:
    tilt_deg, uphill_deg = scenario.floor_tilt_deg, scenario.uphill_deg
    slow_turn = scenario.slow_turn
    for step in scenario.plan:
        tilt_deg = tilt_deg if step.floor_tilt_deg is None else step.floor_tilt_deg
        uphill_deg = uphill_deg if step.uphill_deg is None else step.uphill_deg
        angle = step.turns * 2.0 * np.pi
        match step.kind:
            case "rest":
                yield {"rest": {"duration": step.seconds, "slow_turn": slow_turn}}
            case "turn":
                yield {"turn": {"angle": angle, "rate": scenario.turn_rate}}
                slow_turn = 0.0
            case "drive":
                floor = scenario_json.floor(tilt_deg, uphill_deg)
                drive = {"duration": step.seconds, "speed": scenario.drive_speed, "bend": angle}
                yield {"drive": drive | {"floor": floor}}


def _grade(scenario: SpinScenario) -> Grade:
    grade, share = scenario.unit_grade, scenario.matrix_errors

    def triad(of: TriadGrade, noise: float | None, largest: float | None) -> TriadGrade:
        return replace(
            of,
            noise_density=of.noise_density if noise is None else noise / sqrt(scenario.rate_hz),
            scale_error=of.scale_error * share,
            non_orthogonality=of.non_orthogonality * share,
            alignment=of.alignment * share,
            range=of.range if largest is None else largest,
        )

    return replace(
        grade,
        accelerometer=triad(grade.accelerometer, scenario.accelerometer_noise, scenario.accelerometer_range),
        gyroscope=triad(grade.gyroscope, scenario.gyroscope_noise, None),
    )


def _scale_errors(error: float) -> list[dict[str, Any]]:
    """Returns the scale error of the gyroscope, the same on all axes."""
    scale = {"kind": "scale", "channels": "gyroscope", "size": 1.0 + error}
    return [scale | {"axis": axis} for axis in range(len(AXES))]


def _faults(scenario: SpinScenario) -> list[dict[str, Any]]:
    largest = {"accelerometer": scenario.gravity, "gyroscope": scenario.turn_rate}
    middle = scenario.plan[0].seconds / 2
    return [scenario_json.injected_fault(fault, middle, largest[fault.triad]) for fault in scenario.faults]
