"""A simulated multi-pose session: one unit, orientations all over the sphere, turns by hand between them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from tumble.foundation.recording import FloatArray, Recording
from tumble.poses.by_hand import why_not_so_many
from tumble.poses.pose_list import SIX_FACES, Pose, PoseList
from tumble.tools.simulate.scenario import ScenarioError, refuse_no_numbers
from tumble.tools.simulate.turntable.procedure import SimulatedTurntable, simulate_turntable
from tumble.tools.simulate.unit import SimulatedUnit

SCATTER = 0.15
"""rad by which a hand misses an orientation it meant."""
HAND: dict[str, Any] = {"turn_rate_dps": 120.0, "turn_acceleration_dps2": 400.0, "heading_turn_deg": 20.0}
"""Motion of a hand that turns a unit, as fields of `TurntableScenario`."""


FACES: dict[str, Any] = {
    "visits": ("X up", "X up", "X down", "Y up", "Y up", "Y down", "Z up", "Z up", "Z down"),
    "heading_turn_deg": -360.0,
    "table_error_deg": 0.3,
}
"""A box laid on six faces by hand, each axis twice up with a full turn in between, clockwise."""
LABELS = {
    f"{axis.upper()} {way}": f"{axis}_{end}" for axis in "xyz" for way, end in (("up", "p"), ("down", "a"))
}
"""Labels of the faces in section lists."""


@dataclass(frozen=True, slots=True)
class SimulatedMultipose:
    """A session with its truth."""

    session: SimulatedTurntable
    """The hand as a table that turns one target, the unit."""
    on_faces: bool = False
    """Indicates whether it was laid on the six faces of a box, which is then the case frame."""

    @property
    def unit(self) -> SimulatedUnit:
        """The unit and its truth."""
        return self.session.target_units[0]

    @property
    def recording(self) -> Recording:
        """Recording of the unit."""
        return self.unit.recording

    @property
    def force_matrix(self) -> FloatArray:
        """(3, 3) M of the accelerometer in the frame a calibration finds it in: its own axes, or the box."""
        return np.asarray(self.unit.accelerometer.M @ self._frame)

    @property
    def rate_matrix(self) -> FloatArray:
        """(3, 3) M of the gyroscope in the same frame."""
        return np.asarray(self.unit.gyroscope.M @ self._frame)

    @property
    def _frame(self) -> FloatArray:
        """(3, 3) rotation to the case from the frame of the calibration."""
        return self.session.R_e if self.on_faces else np.asarray(self.unit.accelerometer.Q.T)

    @property
    def sections(self) -> tuple[tuple[str, int, int], ...]:
        """Label, first sample, and the one after the last, of rests and full turns on six faces."""
        if not self.on_faces:
            return ()
        time, rests = self.unit.samples.time, self.session.rests
        spans = [(LABELS[rest.pose], rest.start, rest.end) for rest in rests]
        for before, after in pairwise(rests):
            if before.pose == after.pose:
                spans.append((f"{before.pose[0].lower()}_rot", before.end, after.start))
        in_order = sorted(spans, key=lambda span: span[1])
        return tuple(
            (label, int(np.searchsorted(time, start)), int(np.searchsorted(time, end)))
            for label, start, end in in_order
        )


def simulate_multipose(
    *,
    seed: int = 1,
    orientations: int = 18,
    rest_seconds: float = 4.0,
    grade: str = "consumer",
    faces: bool = False,
    **changes: Any,  # noqa: ANN401
) -> SimulatedMultipose:
    """Simulates a unit of a grade, held still `rest_seconds`, s, in each of so many orientations.

    With `faces` it is a box laid on its six faces instead, and turned once round on three of them.
    `changes` are further fields of `TurntableScenario`. Raises `ScenarioError`, in one line, where a figure
    makes no sense.
    """
    refuse_no_numbers(seed=seed, orientations=orientations)
    if faces:
        laid = {**HAND, **FACES, **changes}
        session = simulate_turntable(
            seed=seed, poses=SIX_FACES, rest_seconds=rest_seconds, grades=(grade,), **laid
        )
        return SimulatedMultipose(session, on_faces=True)
    if why := why_not_so_many(orientations):
        raise ScenarioError(why)
    ups = spread(orientations, np.random.default_rng(seed))
    poses = PoseList(tuple(Pose(f"orientation {k}", up) for k, up in enumerate(ups, start=1)))
    session = simulate_turntable(
        seed=seed, poses=poses, rest_seconds=rest_seconds, grades=(grade,), **{**HAND, **changes}
    )
    return SimulatedMultipose(session)


def spread(count: int, random: np.random.Generator) -> FloatArray:
    """Draws directions (count, 3) that cover the sphere as well as a person's do, in random order."""
    place = np.arange(count) + 0.5
    height, bearing = 1.0 - 2.0 * place / count, np.pi * (3.0 - np.sqrt(5.0)) * place
    across = np.sqrt(1.0 - height**2)
    even = np.column_stack([across * np.cos(bearing), across * np.sin(bearing), height])
    turned, _ = np.linalg.qr(random.normal(size=(3, 3)))
    meant = even @ turned + SCATTER * random.normal(size=(count, 3))
    directions: FloatArray = (meant / np.linalg.norm(meant, axis=1)[:, None])[random.permutation(count)]
    return directions
