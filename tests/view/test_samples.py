"""Samples that are kept for a chart: the same as those of the log, on the time that is shown."""

import numpy as np
import pytest
from scipy import signal

from log_fixtures import join, made_up, read, write
from tumble import _core
from tumble.acquisition.acquire import acquire, rests_of
from tumble.bench.log.chart_options import recording_plan
from tumble.calibration.document import AccelerometerCalibration, Calibration
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, Recording
from tumble.logs import open_recording
from tumble.tools.inspect.procedure import inspect
from tumble.tools.view.deviation import deviations
from tumble.tools.view.marks import acquired_of, marks_of
from tumble.tools.view.samples import PAUSE, KeptSamples
from tumble.tools.view.spectrum import amplitude_density, spectra


def kept(recording, calibration=None):
    samples = KeptSamples(recording, calibration)
    samples.read()
    return samples


def recording_of(chunk):
    return Recording.from_arrays("unit", chunk.time, chunk.accelerometer, chunk.gyroscope, chunk.temperature)


def same(one, other):
    for name in ("time", "accelerometer", "gyroscope", "temperature"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.fixture(scope="module")
def held():
    """A unit held still in several orientations."""
    return recording_of(made_up_rests())


def made_up_rests():
    """Six rests of 4 s and turns of 2 s between them, at 100 Hz."""
    random = np.random.default_rng(3)
    time = np.arange(3600) / 100.0
    place, within = np.divmod(time, 6.0)
    angle = (place + np.clip((within - 4.0) / 2.0, 0.0, 1.0)) * np.pi / 3.0
    force = 9.81 * np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
    rate = np.stack([0.0 * angle, np.gradient(angle, time), 0.0 * angle], axis=1)
    return Chunk(
        time + 50.0,
        force + random.normal(0.0, 0.01, force.shape),
        rate + random.normal(0.0, 0.001, rate.shape),
        np.full(len(time), 25.0),
    )


def test_kept_samples_are_those_of_the_log(tmp_path):
    path = write(tmp_path / "log.csv", made_up(8000, start=12.5))
    samples = kept(open_recording(path))
    same(join(list(samples.kept().chunks())), read(path))
    assert inspect(samples.kept()).lines() == inspect(open_recording(path)).lines()


def test_samples_can_be_asked_for_at_any_moment_of_reading(held):
    def ask(*_progress):
        asked.append((samples.lines(-1.0, 1e9, 10), samples.stretches(0.0, 1.0), samples.duration))

    both = Recording(held.metadata, lambda: iter(()), (held, held))
    for samples in (KeptSamples(held), KeptSamples(both)):
        asked = []
        ask()
        assert asked == [([], [], 0.0)]
        samples.read(ask)
        assert len(asked[-1][0]) == 7
    assert samples.duration > 2.0 * 30.0


def test_marks_are_the_rests_of_acquisition(held):
    samples = kept(held)
    rests = rests_of(acquire(held).acquired)
    marks = marks_of(samples, acquired_of(samples))
    found = [(mark.start, mark.end) for mark in marks if mark.kind == "rest"]
    assert found == [pytest.approx((rest.start - 50.0, rest.end - 50.0)) for rest in rests]
    turns = [mark for mark in marks if mark.kind == "turn"]
    assert [turn.label for turn in turns] == [f"{number}-{number + 1}" for number in range(1, len(rests))]
    assert [turn.start for turn in turns] == [end for _, end in found[:-1]]


def test_a_gap_breaks_the_line(tmp_path):
    chunk = made_up(3000)
    whole = np.ones(3000, bool)
    whole[1000:1400] = False
    parted = Chunk(chunk.time[whole], chunk.accelerometer[whole], chunk.gyroscope[whole])
    samples = kept(recording_of(parted))
    for bins in (50, 5000):
        line = samples.lines(0.0, 15.0, bins)[0]
        at = np.flatnonzero(np.isnan(line.value))
        assert len(at) == 1
        assert 999 / 200.0 < line.time[at[0]] < 1400 / 200.0
    assert [run.stop - run.start for run in samples.stretches(0.0, 15.0)] == [1000, 1600]


def test_files_of_poses_follow_one_another(tmp_path):
    folder = tmp_path / "poses"
    folder.mkdir()
    for name in ("a", "b"):
        write(folder / f"{name}.csv", made_up(2000, start=7.0))
    samples = kept(open_recording(folder))
    second = made_up(2000, start=7.0).time[-1] - 7.0 + PAUSE
    assert samples.duration == pytest.approx(2.0 * second - PAUSE)
    line = samples.lines(second, samples.duration, 10_000)[0]
    assert line.time[-1] == pytest.approx(samples.duration)
    marks = marks_of(samples, acquired_of(samples))
    assert {round(mark.start // second) for mark in marks if mark.kind == "rest"} == {0, 1}
    assert len(samples.kept().parts) == 2


def test_a_cut_holds_the_sections_and_says_so(held):
    samples = kept(held)
    cut = samples.cut([(1.0, 2.0), (10.0, 10.5)])
    time = join(list(cut.chunks())).time - 50.0
    assert ((time >= 1.0) & (time <= 2.0) | (time >= 10.0) & (time <= 10.5)).all()
    assert len(time) == pytest.approx(152, abs=2)
    assert cut.metadata.remarks[-1] == "only from 1.000 to 2.000 s, 10.000 to 10.500 s"


def test_calibrated_lines_are_corrected_readings(held):
    triad = AccelerometerCalibration(M=np.diag([1.1, 0.9, 1.0]), b=np.array([0.1, 0.2, 0.3]))
    calibration = Calibration(name="unit", accelerometer=triad)
    samples = kept(held, calibration)
    chunk = join(list(held.chunks()))
    force, _ = calibration.correct(chunk.accelerometer, chunk.gyroscope, chunk.temperature)
    lines = {line.channel: line for line in samples.lines(0.0, 40.0, 10_000, ("calibrated",))}
    for axis, channel in enumerate(("ax", "ay", "az")):
        np.testing.assert_array_equal(lines[channel].value, force[:, axis])


def test_slower_magnetometer_is_held_until_its_next_reading():
    chunk = made_up_rests()
    # Ten readings a second, none for 3.1 s, of which one is held for 1 s.
    taken = chunk.time[::10] + 0.002
    taken = taken[(taken < 60.0) | (taken > 63.0)]
    track = MagneticTrack(taken, np.column_stack([taken, -taken, np.full(len(taken), 40.0)]))
    recording = Recording.from_arrays(
        "unit", chunk.time, chunk.accelerometer, chunk.gyroscope, chunk.temperature, magnetic=track
    )
    samples = kept(recording)
    shown = samples.values("raw", "mx", slice(None))
    known = np.isfinite(shown)
    assert np.count_nonzero(~known[1:]) == pytest.approx(210, abs=2)
    latest = np.searchsorted(taken, chunk.time[known], side="right") - 1
    np.testing.assert_array_equal(shown[known], taken[latest])
    plan = recording_plan([samples], ("raw",))
    assert [line.channel for line in plan.lines][6:] == ["mx", "my", "mz", "temperature"]
    assert plan.units[7:10] == ("µT",) * 3


def test_spectra_are_those_of_welch():
    random = np.random.default_rng(5)
    values = random.normal(size=20_000) + np.sin(np.arange(20_000) * 0.3)
    frequency, density = amplitude_density(values, 250.0)
    theirs = signal.welch(values, 250.0, "hann", nperseg=2 * len(frequency), detrend="constant")
    np.testing.assert_allclose(frequency, theirs[0][1:])
    np.testing.assert_allclose(density, np.sqrt(theirs[1][1:]), rtol=1e-9)


def test_a_section_has_the_deviations_of_the_core(held):
    samples = kept(held)
    found = deviations(samples, 0.0, 4.0)
    chunk = join(list(held.chunks()))
    rows = chunk.time - 50.0 <= 4.0
    record = _core.NoiseRecord(1, allan_only=True)
    record.push(np.ascontiguousarray(chunk.gyroscope[rows, 2:]))
    record.end_stretch()
    ours = next(each for each in found if each.channel == "gz")
    np.testing.assert_allclose(ours.deviation, record.conclude(0.01)[0]["allan"][:, 1])
    assert [each.channel for each in spectra(samples, 0.0, 4.0)] == ["ax", "ay", "az", "gx", "gy", "gz"]
