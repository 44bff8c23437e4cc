"""A simulated session of a magnetometer: a unit turned by hand in the Earth's field, held still or not."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, FloatArray, Recording
from tumble.poses.by_hand import why_not_so_many
from tumble.tools.simulate.scenario import ScenarioError, refuse_beyond_bounds, refuse_no_numbers, stated_by

TURN_SECONDS = 1.5
"""s that a hand takes from one orientation to the next."""
FORCE_NOISE, RATE_NOISE = 0.02, 0.003
"""Noise of a sample: m/s^2 and rad/s."""
STEP = 0.15
"""uT of one count of a usual magnetometer."""
MAGNET = np.array([6.0, -4.0, 5.0])
"""uT of a magnet that is near at a disturbed rest."""
LOADS = (0.0, 5.0, 10.0)
"""A of the motors at successive rests."""


@dataclass(frozen=True)
class MagneticScenario:
    """All that a session is made of."""

    seed: int = 1
    orientations: int = 18
    still: float = 4.0
    """s at rest in each orientation; zero for a unit that is turned without a rest."""
    rate: float = 100.0
    """Hz."""
    strength: float = 48.0
    """uT."""
    dip: float = 65.0
    """deg."""
    noise: float = 0.3
    """uT of a sample."""
    current: bool = False
    """Indicates whether motors run at several levels, at successive rests or over time."""
    disturbed: int = 0
    """Number of the rest near which a magnet lies; 0 for none."""
    step: float = STEP
    """uT of one count; 0 for readings without steps."""

    def __post_init__(self) -> None:
        refuse_no_numbers(**stated_by(self))
        refuse_beyond_bounds(**stated_by(self))
        if wrong := why_not_so_many(self.orientations):
            raise ScenarioError(wrong)
        if not 0 <= self.disturbed <= self.orientations:
            raise ScenarioError(f"disturbed: rest {self.disturbed} is none of 1 to {self.orientations}")


@dataclass(frozen=True)
class SimulatedMagnetometer:
    """A session with its truth, in the case frame of the accelerometer's own axes."""

    scenario: MagneticScenario

    @cached_property
    def _random(self) -> dict[str, np.random.Generator]:
        purposes = ("geometry", "orientations", "force", "rate", "field")
        seeds = np.random.SeedSequence(self.scenario.seed).spawn(len(purposes))
        return {name: np.random.default_rng(seed) for name, seed in zip(purposes, seeds, strict=True)}

    @cached_property
    def force_model(self) -> tuple[FloatArray, FloatArray]:
        """M (3, 3), lower triangular, and b (3,) m/s^2 of the accelerometer."""
        random = self._random["geometry"]
        return np.eye(3) + np.tril(random.normal(0.0, 0.01, (3, 3))), random.normal(0.0, 0.2, 3)

    @cached_property
    def model(self) -> tuple[FloatArray, FloatArray]:
        """M (3, 3) and b (3,) uT of the magnetometer."""
        _ = self.force_model
        random = self._random["geometry"]
        soft = np.eye(3) + random.normal(0.0, 0.06, (3, 3))
        return soft @ _rotation(random.normal(0.0, 0.15, 3)), random.normal(0.0, 30.0, 3)

    @cached_property
    def response(self) -> FloatArray:
        """(3,) uT/A."""
        return np.array([0.9, -0.4, 0.6]) if self.scenario.current else np.zeros(3)

    @cached_property
    def attitudes(self) -> FloatArray:
        """(k, 4) quaternions w x y z, case from world, of the orientations."""
        random, count = self._random["orientations"], self.scenario.orientations
        place = np.arange(count) + 0.5
        height, angle = 1.0 - 2.0 * place / count, place * np.pi * (3.0 - np.sqrt(5.0))
        across = np.sqrt(1.0 - height**2)
        ups = np.column_stack([across * np.cos(angle), across * np.sin(angle), height])
        ups += random.normal(0.0, 0.1, ups.shape)
        headings = random.uniform(0.0, 2.0 * np.pi, count)
        return np.array([_attitude(up, heading) for up, heading in zip(ups, headings, strict=True)])

    @cached_property
    def motion(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times (n,) s, attitudes (n, 4) and numbers (n,) of the rest that each sample is nearest to."""
        scenario, pace = self.scenario, self.scenario.still + TURN_SECONDS
        samples = int(scenario.rate * (pace * scenario.orientations - TURN_SECONDS))
        time = np.arange(samples) / scenario.rate
        rest = np.minimum((time // pace).astype(int), scenario.orientations - 1)
        share = np.clip((time - rest * pace - scenario.still) / TURN_SECONDS, 0.0, 1.0)
        after = np.minimum(rest + 1, scenario.orientations - 1)
        # A hand speeds up and slows down, but where it never rests.
        smooth = share if scenario.still == 0.0 else share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        return time, _between(self.attitudes[rest], self.attitudes[after], smooth), rest

    @cached_property
    def samples(self) -> Chunk:
        """Readings of the inertial sensors."""
        time, attitude, _ = self.motion
        force = _turned(attitude, np.array([0.0, 0.0, STANDARD_GRAVITY]))
        M, b = self.force_model
        noise = self._random["force"].normal(0.0, FORCE_NOISE, force.shape)
        rate = _rates(attitude, self.scenario.rate)
        drift = self._random["rate"].normal(0.0, RATE_NOISE, rate.shape)
        return Chunk(time, force @ M.T + b + noise, rate + drift)

    @cached_property
    def track(self) -> MagneticTrack:
        """Readings of the magnetometer, at the times of the samples."""
        scenario = self.scenario
        time, attitude, rest = self.motion
        dip = np.radians(scenario.dip)
        field = _turned(attitude, scenario.strength * np.array([np.cos(dip), 0.0, -np.sin(dip)]))
        field += np.where(rest[:, None] == scenario.disturbed - 1, MAGNET, 0.0)
        load = np.array(LOADS)[rest % len(LOADS)] if scenario.current else None
        M, b = self.model
        noise = self._random["field"].normal(0.0, scenario.noise, field.shape)
        effect = 0.0 if load is None else np.outer(load, self.response)
        readings = field @ M.T + b + effect + noise
        if scenario.step > 0.0:
            readings = scenario.step * np.round(readings / scenario.step)
        return MagneticTrack(time, readings, load)

    @property
    def recording(self) -> Recording:
        """The session as procedures read it."""
        samples = self.samples
        return Recording.from_arrays(
            "magnetometer",
            samples.time,
            samples.accelerometer,
            samples.gyroscope,
            magnetic=self.track,
        )


def simulate_magnetometer(**scenario: float | bool) -> SimulatedMagnetometer:
    """Simulates a unit that is turned by hand; arguments as the fields of `MagneticScenario`.

    Raises `ScenarioError` where they contradict each other.
    """
    return SimulatedMagnetometer(MagneticScenario(**scenario))  # type: ignore[arg-type]


def _rotation(vector: FloatArray) -> FloatArray:
    """Returns the rotation (3, 3) of a rotation vector, rad (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def _attitude(up: FloatArray, heading: float) -> FloatArray:
    """Returns the quaternion (4,), case from world, in which a direction of the case is up."""
    up = up / np.linalg.norm(up)
    axis = np.cross([0.0, 0.0, 1.0], up)
    half = 0.5 * np.arctan2(np.linalg.norm(axis), up[2])
    level = axis / max(float(np.linalg.norm(axis)), 1e-12)
    tilt = np.array([np.cos(half), *(np.sin(half) * level)])
    turn = np.array([np.cos(0.5 * heading), 0.0, 0.0, np.sin(0.5 * heading)])
    return _product(tilt, turn)


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Multiplies quaternions (..., 4)."""
    real = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    other = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([real, other], axis=-1)


def _between(first: FloatArray, last: FloatArray, share: FloatArray) -> FloatArray:
    """Interpolates quaternions (n, 4) along the shortest way."""
    cosine = np.sum(first * last, axis=1)
    last = np.where(cosine[:, None] < 0.0, -last, last)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    small = angle < 1e-6
    sine = np.where(small, 1.0, np.sin(angle))
    weights = [np.where(small, part, np.sin(part * angle) / sine) for part in (1.0 - share, share)]
    mixed = weights[0][:, None] * first + weights[1][:, None] * last
    return np.asarray(mixed / np.linalg.norm(mixed, axis=1)[:, None])


def _turned(attitude: FloatArray, vector: FloatArray) -> FloatArray:
    """Returns a vector (3,) of the world in the case at each attitude (n, 4)."""
    across = 2.0 * np.cross(attitude[:, 1:], vector)
    return np.asarray(vector + attitude[:, :1] * across + np.cross(attitude[:, 1:], across))


def _rates(attitude: FloatArray, rate: float) -> FloatArray:
    """Returns the angular rate (n, 3), rad/s, in the case, by central differences of attitudes."""
    before, after = np.roll(attitude, 1, axis=0), np.roll(attitude, -1, axis=0)
    before[0], after[-1] = attitude[0], attitude[-1]
    inverse = after * np.array([1.0, -1.0, -1.0, -1.0])
    # World from case turns by the rate in the case; case from world turns back.
    change = _product(before, inverse)
    signed = np.where(change[:, :1] < 0.0, -change, change)
    return np.asarray(signed[:, 1:] * rate)
