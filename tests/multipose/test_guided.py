"""A page leads a hand from orientation to orientation, and gives what the command gives on the session."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from live_benches import simulated_bench
from tumble.tools.guided.figures import SphereFigure
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.run import run_kind


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Views and outcome of a session whose hand follows the body that is wanted, and its folder."""
    folder = tmp_path_factory.mktemp("hand")
    with simulated_bench(motion="hand", told=True, grades=("tactical",)) as bench:
        order = RunOrder(
            folder=folder,
            sources=bench.addresses,
            serials={"imu": "0815"},
            options={"orientations": 14, "held": 3.0},
        )
        guided = run_kind("multipose").begin(order)
        views = []
        for view in guided.views():
            views.append(view)
            if view.kind == "wanted":
                bench.hand.go_to(np.array(view.bodies[0].up_wanted))
        yield views, guided.outcome(), folder


def sphere_of(view):
    (sphere,) = view.figures
    assert isinstance(sphere, SphereFigure)
    return sphere


def test_sphere_gains_an_orientation_with_each_rest(run):
    views, _, _ = run
    held = [len(sphere_of(view).held) for view in views if view.kind == "held"]
    assert held == list(range(1, len(held) + 1))
    assert len(held) >= 10
    last = views[-1]
    assert last.kind == "done"
    assert all(item.done for item in last.checks[0].items)


def test_body_arrives_at_the_orientation_that_was_wanted(run):
    views, _, _ = run
    wanted = [view.bodies[0].up_wanted for view in views if view.kind == "wanted"]
    held = sphere_of(views[-1]).held
    # The first rest is as the unit lies; each other one is the orientation asked for before it.
    for asked, shown in zip(wanted, held[1:], strict=False):
        assert np.dot(asked, shown) > np.cos(np.radians(35.0))


def test_instruction_names_the_orientation_until_the_unit_is_still(run):
    views, _, _ = run
    texts = {str(view.instruction) for view in views if view.kind == "progress"}
    assert "Hold it still." in texts
    assert any(text.startswith("Turn it to ") for text in texts)
    still = [view.remaining for view in views if str(view.instruction) == "Hold it still."]
    assert all(0.0 < left < 3.0 for left in still)


def test_outcome_is_the_result_of_the_command_on_the_session(run):
    _, outcome, folder = run
    again = tumble.multipose(folder / "session")
    (unit,) = outcome.units
    assert tumble.Calibration.load(unit.calibration).hash() == again.calibration.hash()
    assert (unit.word, unit.serial) == (again.verdict, "0815")
    assert outcome.verdict == "passed"
    assert outcome.complete
    assert unit.page.exists()
    assert len(unit.furthest) == 5
