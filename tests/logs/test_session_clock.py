"""Times of a recorded session, laid anew by one line from each sensor's own clock."""

import numpy as np
import pytest

from tumble.live import LiveChunk
from tumble.live.host_clock import HostClock
from tumble.logs import ReadOptions, open_recording
from tumble.logs.session import Session
from tumble.tools.record.writer import RecordedUnit, SessionWriter

RATE = 100.0
SKEW = 40e-6
"""By which the sensor's clock is fast."""


class Sensor:
    """Source with the properties that a session needs."""

    name = "unit"
    clock = serial = ""
    already_corrected = None
    remarks = ()
    stamped = True


def recorded(folder, seed, *, seconds=120.0, set_back_at=None, corrupt_at=None, held_up=0.0):
    """Records a unit over a line that is late, as on a busy computer; returns true times."""
    generator = np.random.default_rng(seed)
    print(f"seed {seed}")
    taken = 1000.0 + np.arange(int(seconds * RATE)) / RATE
    stamps = 5.0 + (taken - taken[0]) * (1.0 + SKEW)
    if set_back_at is not None:
        stamps[taken - taken[0] >= set_back_at] -= 3.0
    if corrupt_at is not None:
        stamps[corrupt_at] += 0.04
    # Quieter from half time on, so that the line is found to have been too high.
    late = np.where(taken < taken[0] + 0.5 * seconds, 4e-3, 1e-3)
    way = np.where(taken - taken[0] < (set_back_at or 0.0), held_up, 0.0)
    arrival = np.maximum.accumulate(taken + way + generator.exponential(late))
    clock = HostClock()
    with SessionWriter(folder, {"unit": RecordedUnit(Sensor(), "udp://:9000", "")}, "host") as writer:
        for k, (stamp, came) in enumerate(zip(stamps, arrival, strict=True)):
            host = clock.host_times(np.array([stamp]), came)
            said = np.full((1, 3), 9.8), np.zeros((1, 3))
            chunk = LiveChunk(host, *said, arrival=came, sensor_time=stamps[k : k + 1])
            writer.take("unit", chunk)
            if k % 200 == 0:
                writer._flush_at = 0.0
                writer.flush()
        writer.finish("done")
    return taken


def times(folder, **options):
    chunks = open_recording(folder, ReadOptions(**options)).chunks()
    return np.concatenate([chunk.time for chunk in chunks])


@pytest.mark.parametrize("seed", range(3))
def test_pace_of_a_recorded_unit_is_even_despite_live_slewing(tmp_path, seed):
    taken = recorded(tmp_path / "session", seed)
    live, anew = times(tmp_path / "session", live_times=True), times(tmp_path / "session")
    assert len(anew) == len(taken)

    def uneven(found):
        return np.ptp(np.diff((found - taken)[::500])) / (500 / RATE)

    assert uneven(live) > 1e-4
    assert uneven(anew) < 1e-9
    # The pace itself is known from delays of ms over the whole session.
    pace = np.polyfit(taken - taken[0], anew - anew[0], 1)[0] - 1.0
    assert abs(pace) < 5e-6


def test_clock_that_was_set_back_has_one_line_before_and_one_after(tmp_path):
    taken = recorded(tmp_path / "session", 4, set_back_at=60.0)
    found = times(tmp_path / "session")
    assert (np.diff(found) > 0.0).all()
    # Until the leap is accepted its samples have the times that they were given.
    late = found - taken[-len(found) :] if len(found) == len(taken) else None
    assert late is not None
    assert np.abs(late[[0, 3000, 9000, -1]] - late[3000]).max() < 2e-3


def test_no_sample_before_a_leap_is_later_than_those_after_it(tmp_path):
    taken = recorded(tmp_path / "session", 5, set_back_at=60.0, held_up=0.05)
    found = times(tmp_path / "session")
    assert len(found) == len(taken)
    assert (np.diff(found) > 0.0).all()
    # The delayed samples move, as samples that arrive sooner are more accurate.
    assert np.abs(found - taken).max() < 0.02


def test_live_times_are_kept_for_output_that_repeats_the_session(tmp_path):
    recorded(tmp_path / "session", 5, seconds=30.0)
    assert Session.load(tmp_path / "session").clock == "host"
    live = times(tmp_path / "session", live_times=True)
    assert (times(tmp_path / "session") != live).any()


def test_a_stamp_that_was_corrupted_moves_no_line(tmp_path):
    recorded(tmp_path / "sound", 6)
    recorded(tmp_path / "corrupted", 6, corrupt_at=4000)
    # By as much as a line without that second differs.
    moved = times(tmp_path / "corrupted", skip_bad_lines=True) - np.delete(times(tmp_path / "sound"), 4000)
    assert np.abs(moved).max() < 2e-4


def test_times_that_are_the_stamps_stay_as_they_are(tmp_path):
    taken = np.arange(3000) / RATE
    with SessionWriter(
        tmp_path / "session", {"unit": RecordedUnit(Sensor(), "udp://:9000", "")}, "host"
    ) as writer:
        said = np.full((3000, 3), 9.8), np.zeros((3000, 3))
        writer.take("unit", LiveChunk(taken, *said, arrival=5.0))
        writer.finish("done")
    assert np.array_equal(times(tmp_path / "session"), taken)


@pytest.mark.parametrize("seed", range(3))
def test_a_busy_computer_makes_no_leap_of_a_sensor_that_runs_on(tmp_path, seed):
    generator = np.random.default_rng(seed)
    print(f"seed {seed}")
    count = 6000
    stamps = 5.0 + np.arange(count) / RATE
    # Over a program that is still loading nothing comes quickly; the live map as it was before: it stepped.
    late = generator.exponential(0.1, count) + np.where(np.arange(count) < 1500, 0.3, 0.0)
    arrival = np.maximum.accumulate(1000.0 + stamps + late)
    time = 1000.3 + stamps - np.where(np.arange(count) < 1500, 0.0, 0.2)
    # Samples of the seam came in a row, or the log would run backwards.
    time = np.maximum.accumulate(time) + 1e-6 * np.arange(count)
    with SessionWriter(tmp_path / "s", {"unit": RecordedUnit(Sensor(), "udp://:9000", "")}, "host") as writer:
        said = np.full((1, 3), 9.8), np.zeros((1, 3))
        for k in range(count):
            writer.take(
                "unit", LiveChunk(time[k : k + 1], *said, arrival=arrival[k], sensor_time=stamps[k : k + 1])
            )
        writer.finish("done")
    recording = open_recording(tmp_path / "s")
    steps = np.diff(np.concatenate([chunk.time for chunk in recording.chunks()]))
    assert np.ptp(steps) < 1e-9
    assert abs(steps[0] * RATE - 1.0) < 3.0 * recording.metadata.pace_sigma
    assert 0.0 < recording.metadata.pace_sigma < 2e-3
