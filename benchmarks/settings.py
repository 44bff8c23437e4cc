"""The sessions of the accuracy figures: design settings, and what varies from cell to cell."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from math import pi
from typing import Literal

from tumble.tools.simulate import Grade, TurntableScenario

RATE_HZ = 200.0
REST_SECONDS = 10.0
TURN_SECONDS = 5.0
"""Every turn is by 90 deg: one second of acceleration, three of constant rate, one of deceleration."""
TURN_RATE_DPS = 22.5

ORDER = ("X up", "Y up", "Z up", "X down", "Y down", "Z down")
"""The six faces in an order in which neighbours are 90 deg apart: turns about all three axes."""

DEGREE = pi / 180.0
BASE_SEED = 20_250_000_000
"""Session i of cell c is simulated with seed `BASE_SEED + 1 000 000 c + i`."""
SEEDS_A_CELL = 1_000_000

Clocks = Literal["shared", "apart"]


def _grade(
    name: str,
    like: str,
    force: tuple[float, float],
    rate: tuple[float, float],
    scale_error: float,
    non_orthogonality: float,
) -> Grade:
    """Grade of these (noise a sample, turn-on bias); bias instability is that of the grade `like`."""
    base = Grade.named(like)

    def triad_of(figures: tuple[float, float], accelerometer: bool) -> dict[str, float]:
        return {
            "noise_density": figures[0] / RATE_HZ**0.5,
            "turn_on_bias": figures[1],
            "scale_error": scale_error,
            "non_orthogonality": non_orthogonality,
            "alignment": 0.0,
            "temperature_coefficient": 0.0,
            "range": 1e3 if accelerometer else 1e2,
            "g_sensitivity": 0.0,
        }

    return replace(
        base,
        name=name,
        accelerometer=replace(base.accelerometer, **triad_of(force, True)),
        gyroscope=replace(base.gyroscope, **triad_of(rate, False)),
    )


def target_grade() -> Grade:
    """Noise 0.02 m/s^2, 0.002 rad/s a sample; bias 0.3 m/s^2; non-orthogonality 0.5 deg."""
    return _grade("target", "consumer", (0.02, 0.3), (0.002, 0.02), 0.01, 0.5 * DEGREE)


def reference_grade() -> Grade:
    """Noise 0.003 m/s^2 and 0.0002 rad/s a sample, instability `tactical`."""
    return _grade("reference", "tactical", (0.003, 0.02), (0.0002, 0.001), 0.0, 0.0)


def design_scenario() -> TurntableScenario:
    """Settings of section 1 of the design: six poses of 2000 samples, white noise, Earth rate on."""
    return TurntableScenario(
        grades=(target_grade(),),
        reference=reference_grade(),
        perfect_reference=True,
        rate_hz=RATE_HZ,
        bias_instability=False,
        quantisation=False,
        g_sensitivity=False,
        visits=ORDER,
        rest_seconds=REST_SECONDS,
        turn_rate_dps=TURN_RATE_DPS,
        turn_acceleration_dps2=TURN_RATE_DPS,
        turn_profile="trapezoid",
    )


@dataclass(frozen=True, slots=True)
class Cell:
    """One combination of what varies."""

    number: int
    mounting_deg: float
    """Angle of the structure that reference and target share, about an axis drawn for each session."""
    table_error_deg: float
    """Error of the table at each pose, 1 sigma about each axis."""
    bias_instability: bool
    clocks: Clocks

    @property
    def name(self) -> str:
        """All of it in a line."""
        noise = "bias instability" if self.bias_instability else "white"
        angles = f"mounting {self.mounting_deg:g} deg, table {self.table_error_deg:g} deg"
        return f"{angles}, {noise}, clocks {self.clocks}"

    def seed(self, session: int) -> int:
        """Seed of a session of this cell."""
        return BASE_SEED + SEEDS_A_CELL * self.number + session

    def scenario(self, session: int) -> TurntableScenario:
        """Returns session number `session` of this cell."""
        return replace(
            design_scenario(),
            seed=self.seed(session),
            mounting_angle_deg=self.mounting_deg,
            table_error_deg=self.table_error_deg,
            bias_instability=self.bias_instability,
            clocks=self.clocks,
        )


MOUNTINGS_DEG = (0.0, 1.0, 3.0)
TABLE_ERRORS_DEG = (0.0, 0.05, 0.2)


def cells() -> Iterator[Cell]:
    """All combinations, numbered."""
    clocks: tuple[Clocks, ...] = ("shared", "apart")
    combinations = product((False, True), clocks, MOUNTINGS_DEG, TABLE_ERRORS_DEG)
    for number, (unstable, clock, mounting, error) in enumerate(combinations):
        yield Cell(number, mounting, error, unstable, clock)
