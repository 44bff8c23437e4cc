"""Eight IMUs on one board, recorded by others: each of four, in `make soak` of all, aligned with each other.

The board states the places of its chips (9.45 mm from the middle, on both sides; those of even number are
on the other side). It does not state the place of the accelerometer within its housing, nor how squarely the
chips are soldered. Measured over all 56 pairs: lever arms 0.83 mm off at most, half of them 0.4 mm or less;
rotations 0.53 deg at most; offsets 0.043 ms at most. The limits leave a fifth for other processors.
"""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import tumble
from repetitions import SOAK
from turntable_sessions import typed

BOARD = Path(__file__).parents[3] / "shared" / "data" / "mimu4444"
LOG = BOARD / "exp_3.parquet"
ALL_UNITS = [f"imu{number}" for number in range(1, 9)]
UNITS = ALL_UNITS if SOAK else ALL_UNITS[:4]
OTHER_SIDE = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])

pytestmark = pytest.mark.skipif(not BOARD.is_dir(), reason="the recordings in ../shared/data are not here")


def board_from(unit):
    return np.eye(3) if UNITS.index(unit) % 2 == 0 else OTHER_SIDE


@pytest.fixture(scope="module")
def places():
    """(8, 3) m, on the board, as published."""
    lines = (BOARD / "IMU_positions.csv").read_text().splitlines()[1:4]
    table = np.array([[float(cell) for cell in line.split(",")[1:]] for line in lines]).T
    return dict(zip(ALL_UNITS, table, strict=True))


@pytest.fixture(scope="module")
def alignments():
    """Primary and secondary -> what was found."""
    found = {}
    for primary in UNITS:
        others = [unit for unit in UNITS if unit != primary]
        result = tumble.align(primary, others, LOG)
        found.update({(primary, unit.name): unit for unit in result})
    return found


def test_every_pair_is_aligned_in_full(alignments):
    assert set(alignments) == set(permutations(UNITS, 2))
    for pair, unit in alignments.items():
        assert all(parameter.observable for parameter in unit.parameters), pair


def test_lever_arms_are_those_of_the_published_places(alignments, places):
    distances = []
    for (primary, secondary), unit in alignments.items():
        published = board_from(primary).T @ (places[secondary] - places[primary])
        distances.append(np.linalg.norm(unit.lever_arm - published))
    print(f"lever arms off by {1e3 * np.median(distances):.2f} mm, {1e3 * max(distances):.2f} mm at most")
    assert np.median(distances) < 0.5e-3
    assert max(distances) < 1.0e-3


def test_sigmas_of_lever_arms_are_a_few_tenths_of_a_millimetre(alignments):
    sigmas = [np.sqrt(np.diag(unit.lever_arm_covariance)).max() for unit in alignments.values()]
    assert min(sigmas) > 0.03e-3
    assert max(sigmas) < 0.4e-3


def test_rotations_are_those_of_the_sides_of_the_board(alignments):
    angles = []
    for (primary, secondary), unit in alignments.items():
        nominal = board_from(secondary).T @ board_from(primary)
        angles.append(Rotation.from_matrix(unit.sensor_from_primary @ nominal.T).magnitude())
    print(f"rotations off by {np.degrees(np.median(angles)):.2f} deg, {np.degrees(max(angles)):.2f} at most")
    assert np.degrees(max(angles)) < 0.65


def test_units_read_out_together_have_no_offset(alignments):
    offsets = np.array([unit.time_offset for unit in alignments.values()])
    print(f"offsets {1e3 * np.abs(offsets).max():.3f} ms at most")
    assert np.abs(offsets).max() < 0.06e-3


def test_rotations_round_a_triangle_of_units_close(alignments):
    for one, two, three in permutations(UNITS, 3):
        turned = (
            alignments[three, one].sensor_from_primary
            @ alignments[two, three].sensor_from_primary
            @ alignments[one, two].sensor_from_primary
        )
        assert np.degrees(Rotation.from_matrix(turned).magnitude()) < 0.05, (one, two, three)


def test_saturated_samples_of_the_shaking_are_left_out_and_counted(alignments):
    for unit in alignments.values():
        counts = [int(line.split()[2]) for line in unit.warnings if "at the end of its range" in line]
        assert len(counts) == 2
        assert all(1000 < count < 1200 for count in counts)


def test_the_command_aligns_the_whole_board(tmp_path):
    secondaries = [word for unit in UNITS[1:] for word in ("--secondary", unit)]
    done = typed("align", LOG, "--primary", "imu1", *secondaries, "-o", tmp_path)
    assert done.code == 0, done.err
    assert (tmp_path / "align.yaml").read_text().count("lever_arm") == len(UNITS) - 1
