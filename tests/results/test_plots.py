"""Figures that `plot()` returns are those of the page: same panels, same numbers."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import tumble
from tumble import TumbleError
from tumble.procedures.multipose.report.page import MULTIPOSE_REPORT
from tumble.procedures.noise.report.page import NOISE_REPORT
from tumble.report.canvas import LineMark
from tumble.report.matplotlib_figure import drawings_of
from turntable_sessions import calibrate, simulate


@pytest.fixture(scope="module")
def multipose():
    return tumble.multipose(tumble.simulate_multipose(seed=7).recording)


@pytest.fixture(scope="module")
def noise():
    return tumble.noise(tumble.simulate_static(duration=360.0, seed=3).recording)


def lines_drawn(axes):
    return [line for line in axes.lines if line.get_linestyle() != "None"]


def test_a_plot_has_the_panels_of_the_page(multipose):
    drawings = list(drawings_of(MULTIPOSE_REPORT.gather(multipose)))
    figure = multipose.plot()
    assert len(figure.subfigs) == len(drawings)
    for part, drawing in zip(figure.subfigs, drawings, strict=True):
        assert len(part.axes) == len(drawing.figure.panels)


def test_lines_of_a_plot_hold_the_numbers_of_the_page(multipose):
    (drawing,) = [each for each in drawings_of(MULTIPOSE_REPORT.gather(multipose)) if each.name == "rec"]
    (part,) = multipose.plot("rec").subfigs
    for axes, panel in zip(part.axes, drawing.figure.panels, strict=True):
        drawn = [mark for mark in panel.inside if isinstance(mark, LineMark)]
        held = [line for line in lines_drawn(axes) if len(line.get_xdata()) > 2]
        assert len(held) == len(drawn) == 3
        for line, mark in zip(held, drawn, strict=True):
            np.testing.assert_array_equal(line.get_ydata(), mark.y)
        assert axes.get_title(loc="left") == panel.scales["y"].title


def test_logarithmic_panels_show_the_quantity_itself(noise):
    (part,) = noise.plot("allan-gyroscope").subfigs
    (axes,) = part.axes
    assert axes.get_xscale() == axes.get_yscale() == "log"
    assert axes.get_xlabel() == "averaging time, s"
    tau = noise.channels[3].allan.tau
    np.testing.assert_allclose(axes.lines[-1].get_xdata(), tau, rtol=1e-12)
    assert len(list(drawings_of(NOISE_REPORT.gather(noise)))) == 2


def test_every_figure_of_a_target_can_be_drawn():
    batch = calibrate(simulate(21, grades=("consumer",)))
    figure = batch.plot(target="target_1")
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert batch.plot("rec").subfigs
    with pytest.raises(KeyError):
        batch.plot(target="target_9")


def test_an_unknown_figure_is_refused_with_the_names(multipose):
    with pytest.raises(TumbleError, match="no figure 'sphre'; its figures are sphere, influence, norm"):
        multipose.plot("sphre")


def test_without_matplotlib_one_line_says_what_to_install(multipose, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(TumbleError, match=r"needs matplotlib.*pip install 'tumble-imu\[plot\]'"):
        multipose.plot()
