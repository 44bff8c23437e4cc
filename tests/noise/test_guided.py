"""A still log that a page watches: the curve grows, and its outcome is that of the command on the session."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from simulated_clock import SimulatedClock
from tumble import _core
from tumble.foundation.recording import Chunk
from tumble.foundation.units import TRIADS
from tumble.procedures.noise.samples import StillSamples
from tumble.tools.guided.figures import AllanFigure
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.run import run_kind
from tumble.tools.record import live_procedure

RATE = 100.0
DENSITY = 1e-3
SEED = 627


def still_log(path, seconds, seed=SEED):
    """Writes a log of white noise; returns its address, replayed twenty times as fast."""
    print(f"seed {seed}")
    samples = round(seconds * RATE)
    noise = _core.StillNoise(seed, np.array([[0.0, DENSITY, 0.0, 0.0, 0.0]] * 6), RATE, samples).draw(samples)
    values = noise + np.array([0.0, 0.0, 9.8, 0.0, 0.0, 0.0])
    table = np.column_stack([np.arange(samples) / RATE, values])
    np.savetxt(path, table, delimiter=",", header="time,ax,ay,az,gx,gy,gz", comments="", fmt="%.9g")
    return f"replay:{path}?speed=20"


@pytest.fixture(scope="module", autouse=True)
def reports_are_few():
    """A curve grows as well in a view for each ten seconds of a log."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(live_procedure, "BETWEEN_REPORTS", 0.5)
        yield


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Views and outcome of a still log of two units, and its folder."""
    folder = tmp_path_factory.mktemp("still")
    sources = {name: still_log(folder / f"{name}.csv", 150.0, seed) for name, seed in (("a", 1), ("b", 2))}
    order = RunOrder(
        folder=folder / "results", sources=sources, serials={"a": "0815"}, options={"duration": 2.0}
    )
    with SimulatedClock():
        guided = run_kind("noise").begin(order)
        return list(guided.views()), guided.outcome(), order.folder


def figures_of(view):
    return [each for each in view.figures if isinstance(each, AllanFigure)]


def test_allan_curve_grows_while_it_records(run):
    views, _, _ = run
    lengths = [len(figures_of(view)[0].curves[0].tau) for view in views if view.figures]
    assert lengths == sorted(lengths)
    assert len(set(lengths)) >= 2
    assert views[-1].kind == "done"


def test_curve_so_far_is_that_of_all_samples_and_ends_no_stretch():
    print(f"seed {SEED}")
    values = np.random.default_rng(SEED).normal(size=(4000, 6))
    whole = Chunk(np.arange(4000) / RATE, values[:, :3].copy(), values[:, 3:].copy())
    pieces = [slice(first, first + 37) for first in range(0, 4000, 37)]
    growing, at_once = StillSamples(TRIADS), StillSamples(TRIADS)
    for number, piece in enumerate(pieces):
        part = Chunk(whole.time[piece], whole.accelerometer[piece], whole.gyroscope[piece])
        growing.take(part, np.zeros(len(part), dtype=np.int64))
        if number == 50:
            growing.so_far()()
    at_once.take(whole, np.zeros(4000, dtype=np.int64))
    at_once.end_part()
    for so_far, found in zip(growing.so_far()(), at_once.finish()[0], strict=True):
        assert np.allclose(so_far["allan"], found["allan"], rtol=1e-12)


def test_outcome_is_the_result_of_the_command_on_the_session(run):
    _, outcome, folder = run
    assert [unit.name for unit in outcome.units] == ["a", "b"]
    for unit in outcome.units:
        again = tumble.noise(f"{folder / 'session'}:{unit.name}")
        assert tumble.Calibration.load(unit.calibration).hash() == again.calibration.hash()
        assert unit.word == again.verdict
        assert unit.page.exists()
    assert outcome.units[0].serial == "0815"
    assert outcome.complete


def test_goal_counts_time_at_rest_only(run):
    views, _, _ = run
    assert views[-1].remaining == 0.0
    assert all(item.done for item in views[-1].checks[0].items)
