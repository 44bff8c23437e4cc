"""Missions of redundant units, drawn from a seed: what carries them, units, faults and settings."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName
from tumble.tools.simulate.fault import AXES, Fault, FaultKind
from tumble.tools.simulate.flight.procedure import SimulatedFlight, simulate_flight
from tumble.tools.simulate.flight.scenario import VIBRATIONS, FlightMotion, FlightScenario, FlightUnit

GRADES = ("consumer", "industrial", "tactical")
"""Worst first."""
RATES_HZ = (100.0, 200.0, 250.0, 400.0, 500.0, 1000.0)
MOUNTINGS_DEG = ((0.0, 0.0, 0.0), (90.0, 0.0, 0.0), (0.0, 0.0, 90.0), (180.0, 0.0, 0.0), (0.0, 180.0, 0.0))
TRANSFER_SECONDS = 16.0
"""About how long take-off, hovering and landing take together."""
OFFSET_SIGMA = 5e-4
"""s, of the stated time offset; its error is at most twice that."""
FOREVER = 1e6
"""s: a fault that ends then does not end."""
CALIBRATION_SIGMA: dict[TriadName, float] = {"accelerometer": 0.005, "gyroscope": 0.0005}
"""Bias that the primary's own calibration, if it has one, leaves, m/s^2 and rad/s."""

ALWAYS: frozenset[FaultKind] = frozenset({"scale", "swapped-axes", "left-handed", "wrong-unit"})
"""From the start on."""
LASTING: frozenset[FaultKind] = frozenset(
    {"stuck", "moved", "bias-jump", "bias-drift", "noise", "dead", "time-backwards", "clock-jump"}
)
"""From `start` on."""
PASSING: frozenset[FaultKind] = frozenset(
    {"frozen", "spikes", "saturated", "nan", "gap", "absent", "late", "doubled"}
)
"""From `start` to `end`."""
SIZES: dict[FaultKind, tuple[tuple[float, float], tuple[float, float]]] = {
    "scale": ((0.8, 1.2), (0.8, 1.2)),
    "moved": ((1.0, 20.0), (1.0, 20.0)),
    "bias-jump": ((0.2, 5.0), (0.02, 0.5)),
    "bias-drift": ((0.2, 5.0), (0.02, 0.5)),
    "noise": ((0.5, 20.0), (0.05, 5.0)),
    "spikes": ((20.0, 100.0), (3.0, 20.0)),
    "saturated": ((0.5, 1.5), (0.3, 2.0)),
    "late": ((0.02, 1.0), (0.02, 1.0)),
    "time-backwards": ((0.02, 5.0), (0.02, 5.0)),
    "clock-jump": ((0.02, 5.0), (0.02, 5.0)),
}
"""Smallest and largest size, of accelerometer and of gyroscope; drawn evenly in logarithm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission:
    """All that was drawn from a seed."""

    seed: int
    scenario: FlightScenario
    known_arms: tuple[bool, ...]
    """Indicates for each unit whether the monitor is given its lever arm."""
    offset_errors: tuple[float, ...]
    """s by which the stated time offset of each unit is wrong."""
    calibrated: bool
    """Indicates whether the primary has a calibration of its own."""
    settings: dict[str, object]
    precision: str

    @property
    def faults(self) -> list[tuple[int, Fault]]:
        """Returns every fault with the number of its unit."""
        return [(number, each) for number, unit in enumerate(self.scenario.units) for each in unit.faults]

    def fly(self) -> SimulatedFlight:
        """Simulates it."""
        return simulate_flight(self.scenario)

    def told(self, flight: SimulatedFlight) -> list[_core.RedundancyUnit]:
        """Returns the units as the builder of the set describes them."""
        return [self._told(flight, number) for number in range(len(flight.units))]

    def calibration(self, flight: SimulatedFlight) -> dict[TriadName, tuple[FloatArray, FloatArray]] | None:
        """Returns the primary's own: M and b of each sensor, wrong by what a calibration leaves."""
        if not self.calibrated:
            return None
        random = np.random.default_rng([self.seed, 1])
        primary = flight.units[0]
        truths = {"accelerometer": primary.accelerometer, "gyroscope": primary.gyroscope}
        left = CALIBRATION_SIGMA
        return {
            name: (truths[name].M, truths[name].b + sigma * random.standard_normal(3))
            for name, sigma in left.items()
        }

    def _told(self, flight: SimulatedFlight, number: int) -> _core.RedundancyUnit:
        unit = flight.units[number]
        if number == 0:
            own = self.calibration(flight) or {}
            left = {str(name): (*model, CALIBRATION_SIGMA[name]) for name, model in own.items()}
            return _core.RedundancyUnit(
                1,
                specific_force_range=unit.grade.accelerometer.range,
                angular_rate_range=unit.grade.gyroscope.range,
                calibration=left or None,
            )
        return _core.RedundancyUnit(
            number + 1,
            sensor_from_primary=np.ascontiguousarray(unit.nominal_mounting),
            lever_arm=unit.lever_arm if self.known_arms[number] else None,
            time_offset=self.offset_errors[number] - unit.clock.offset,
            specific_force_range=unit.grade.accelerometer.range,
            angular_rate_range=unit.grade.gyroscope.range,
        )


def draw(seed: int) -> Mission:
    """Draws a mission; the same for the same seed."""
    random = np.random.default_rng([seed, 0])
    scenario = _scenario(random, int(random.integers(2**63)))
    count = len(scenario.units)
    settings = _settings(random)
    return Mission(
        seed=seed,
        scenario=_with_faults(random, scenario),
        known_arms=(True, *(bool(random.random() < 0.5) for _ in range(1, count))),
        offset_errors=(
            0.0,
            *(OFFSET_SIGMA * float(np.clip(random.standard_normal(), -2.0, 2.0)) for _ in range(1, count)),
        ),
        calibrated=_needs_calibration(scenario) or bool(random.random() < 0.5),
        settings=settings,
        precision="f32" if random.random() < 0.5 else "f64",
    )


def _needs_calibration(scenario: FlightScenario) -> bool:
    """Returns whether the uncalibrated primary would hardly ever be valid."""
    return scenario.units[0].grade == GRADES[0]


def _scenario(random: np.random.Generator, seed: int) -> FlightScenario:
    motion: FlightMotion = "quadrotor" if random.random() < 0.6 else "vehicle"
    usual = VIBRATIONS[motion]
    strength = float(random.uniform(0.2, 1.5))
    vibration = replace(
        usual,
        specific_force=usual.specific_force * strength,
        angular_rate=usual.angular_rate * strength,
        flexing=float(random.uniform(0.0, 0.1)),
        at_rest=float(random.choice([0.0, 0.0, 0.0, 0.02])),
    )
    best = int(random.integers(len(GRADES)))
    primary = FlightUnit(
        grade=GRADES[best], ageing=float(random.uniform(0.0, 1.0)), rate_hz=float(random.choice(RATES_HZ))
    )
    secondaries = [_secondary(random, best) for _ in range(int(random.integers(1, 5)))]
    return FlightScenario(
        seed=seed,
        motion=motion,
        units=(primary, *secondaries),
        flights=int(random.integers(1, 4)),
        rest_seconds=float(random.uniform(5.0, 15.0)),
        motion_seconds=float(random.uniform(20.0, 90.0)),
        stops=int(random.integers(0, 3)),
        intensity=float(random.uniform(0.0, 1.0)),
        sway=(float(random.random()), float(random.random()), float(random.random())),
        turning=float(random.random()),
        ground_tilt_deg=float(random.uniform(0.0, 10.0)),
        uphill_deg=float(random.uniform(0.0, 360.0)),
        vibration=vibration,
        roll_deg=float(random.uniform(-5.0, 5.0)),
        pitch_deg=float(random.uniform(-5.0, 5.0)),
        yaw_deg=float(random.uniform(-180.0, 180.0)),
        temperature_celsius=float(random.uniform(15.0, 35.0)),
        warm_up_kelvin=float(random.uniform(0.0, 20.0)),
        latitude_deg=float(random.uniform(-90.0, 90.0)) if random.random() < 0.5 else None,
    )


def _secondary(random: np.random.Generator, best: int) -> FlightUnit:
    direction = random.standard_normal(3)
    arm = direction / np.linalg.norm(direction) * random.choice([0.0, random.uniform(0.0, 0.2)])
    x, y, z = (float(each) for each in arm)
    return FlightUnit(
        grade=GRADES[int(random.integers(best + 1))],
        lever_arm_m=(x, y, z),
        mounting_deg=MOUNTINGS_DEG[int(random.integers(len(MOUNTINGS_DEG)))],
        ageing=float(random.choice([0.0, 0.5, 1.0, 2.0])),
        rate_hz=float(random.choice(RATES_HZ)),
        filtered=bool(random.random() < 0.9),
        clock_offset_seconds=float(random.choice([0.0, random.uniform(-100.0, 100.0)])),
        clock_skew_ppm=float(random.choice([0.0, random.uniform(-5.0, 5.0)])),
        latency_seconds=float(random.uniform(0.0, 0.01)),
    )


def _with_faults(random: np.random.Generator, scenario: FlightScenario) -> FlightScenario:
    """Puts up to two faults on board, half of them in the primary; none in a fifth of the missions."""
    units = list(scenario.units)
    for _ in range(int(random.choice([0, 1, 1, 1, 2]))):
        number = 0 if random.random() < 0.5 else int(random.integers(1, len(units)))
        unit = units[number]
        units[number] = replace(unit, faults=(*unit.faults, _fault(random, scenario, number)))
    return replace(scenario, units=tuple(units))


def _fault(random: np.random.Generator, scenario: FlightScenario, number: int) -> Fault:
    kinds = sorted(PASSING | LASTING | ALWAYS)
    if number == 0:
        # The death of a primary is the hardest test of failover, so it is drawn more often.
        kinds += ["dead"] * 4
    kind = kinds[int(random.integers(len(kinds)))]
    sensor = int(random.integers(2))
    triads: tuple[TriadName, TriadName] = ("accelerometer", "gyroscope")
    low, high = SIZES.get(kind, ((1.0, 1.0), (1.0, 1.0)))[sensor]
    start = _start(random, scenario)
    lasting = float(random.choice([FOREVER, np.exp(random.uniform(np.log(0.02), np.log(20.0)))]))
    sign = random.choice([-1.0, 1.0]) if kind in {"bias-jump", "bias-drift"} else 1.0
    size = float(sign * np.exp(random.uniform(np.log(low), np.log(high))))
    if kind in {"bias-drift", "noise"}:
        lasting = float(random.uniform(1.0, 60.0))
    return Fault(
        kind=kind,
        triad=triads[sensor],
        axis=AXES[int(random.integers(3))],
        start=None if kind == "absent" else start,
        end=start if kind == "absent" else start + lasting,
        size=size if kind in SIZES else None,
    )


def _start(random: np.random.Generator, scenario: FlightScenario) -> float:
    """Draws when a fault begins: before the trigger, while pairs are collected, or at any time."""
    rest, moving = scenario.rest_seconds, scenario.motion_seconds
    duration = scenario.flights * (rest + moving + TRANSFER_SECONDS) + rest
    spans = ((0.1, rest), (rest, rest + moving), (0.1, duration), (0.6 * duration, 0.98 * duration))
    low, high = spans[int(random.integers(len(spans)))]
    return float(random.uniform(low, high))


def _settings(random: np.random.Generator) -> dict[str, object]:
    raw = bool(random.random() < 0.25)
    drawn: dict[str, object] = {
        "data": "raw" if raw else "compensated",
        "gate": str(random.choice(["secondary alone", "whole primary", "sensor by sensor"])),
        "scope": str(random.choice(["all sensors", "triggering sensor"])),
        "vector_check": bool(random.random() < 0.8),
        "evaluate_every": float(random.choice([5.0, 30.0, 600.0])),
        "window": float(random.choice([0.02, 0.05, 0.1])),
        "collect": float(random.uniform(20.0, 90.0)),
        "largest_fit_model": str(
            random.choice(
                ["offset", "gain", "affine", "affine and lever arm", "affine and lever arm"],
            )
        ),
        "return_after": [None, 1.0, 5.0][int(random.integers(3))],
        "calibrated_only": bool(random.random() < 0.3),
    }
    return drawn | _thresholds(random, raw)


def _thresholds(random: np.random.Generator, raw: bool) -> dict[str, object]:
    """Draws thresholds; those of raw data allow for the error that is known."""
    # 3 sigma of the worst grade: bias and 1 % of gravity, and of the gyroscope its bias.
    factory = (0.6, 0.4) if raw else (0.0, 0.0)
    # Corrected data that are wrong by more would be disputed before they trigger, which settings refuse.
    factor = float(random.uniform(0.7, 2.0 if raw else 1.5))
    names = ("secondary_accelerometer_threshold", "secondary_gyroscope_threshold")
    form = random.choice(["fixed", "margin", "ratio"])
    primary = {
        "primary_accelerometer_threshold": f"{(0.1 + (0.3 if raw else 0.0)) * factor:.6g}",
        "primary_gyroscope_threshold": f"{(0.01 + (0.3 if raw else 0.0)) * factor:.6g}",
    }
    secondary: dict[str, object] = {}
    for name, known, margin in zip(names, factory, (0.1, 0.01), strict=True):
        if form == "fixed":
            secondary[name] = f"{(known + margin) * factor:.6g}"
        elif form == "margin" or not raw:
            # A ratio of what held-out pairs left is hardly meant: under vibration it is no error at rest.
            secondary[name] = f"last+{margin * factor:.6g}"
        else:
            secondary[name] = f"last*{1.0 + factor:.6g}"
    return primary | secondary
