"""Live magnetometers: read beside an IMU, recorded, and replayed."""

import numpy as np
import pytest

from live_fixtures import chunks_of, resting, scripted
from tumble.foundation.magnetic import MagneticTrack
from tumble.live import open_source
from tumble.logs import ReadOptions, open_recording
from turntable_sessions import typed

TABLE = resting(400)
FIELD = np.array([20.0, -5.0, 42.0]) + np.random.default_rng(34).normal(0.0, 8.0, (400, 3))
"""uT."""


def lines(every: int = 1, unit: str = "", scale: float = 1.0) -> bytes:
    """Rows of text whose magnetometer has a reading in every so many."""
    names = ["time", "ax", "ay", "az", "gx", "gy", "gz", *(f"m{axis}{unit}" for axis in "xyz")]
    rows = [names]
    for number, (row, field) in enumerate(zip(TABLE.tolist(), (FIELD / scale).tolist(), strict=True)):
        rows.append([*map(repr, row), *(map(repr, field) if number % every == 0 else ("", "", ""))])
    return "".join(",".join(row) + "\n" for row in rows).encode()


@pytest.mark.parametrize(("unit", "scale"), [("", 1.0), ("_mG", 0.1)])
def test_text_carries_a_magnetometer_beside_the_imu(unit: str, scale: float) -> None:
    chunks = chunks_of(scripted([lines(1, unit, scale)]))
    np.testing.assert_allclose(np.concatenate([chunk.field for chunk in chunks if len(chunk)]), FIELD)
    joined = MagneticTrack.joined(chunk.magnetic for chunk in chunks)
    assert joined is not None
    np.testing.assert_allclose(joined.time, TABLE[:, 0])


def test_axes_of_the_case_hold_for_a_live_magnetometer() -> None:
    chunks = chunks_of(scripted([lines()], axes="y,-x,z"))
    turned = np.concatenate([chunk.field for chunk in chunks if len(chunk)])
    np.testing.assert_allclose(turned, FIELD[:, [1, 0, 2]] * [1.0, -1.0, 1.0])


def test_session_keeps_a_slower_magnetometer_and_replays_it(tmp_path) -> None:
    (tmp_path / "a.csv").write_bytes(lines(every=4))
    session = tmp_path / "session"
    done = typed("record", f"a=replay:{tmp_path}/a.csv?speed=max", "-o", session)
    assert done.code == 0, done.err
    found = open_recording(f"{session}:a", ReadOptions(live_times=True)).magnetic
    assert found is not None
    np.testing.assert_allclose(found.field, FIELD[::4])
    np.testing.assert_array_equal(found.time, TABLE[::4, 0])
    assert (found.unit, found.unit_reason) == ("uT", "session")
    with open_source(f"replay:{session}:a?speed=max") as source:
        joined = MagneticTrack.joined(chunk.magnetic for chunk in source)
    assert joined is not None
    np.testing.assert_allclose(joined.field, FIELD[::4])
