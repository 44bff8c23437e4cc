"""The state machine of a spin as a program drives it."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from repetitions import drawn_seed
from tumble import Chunk, SpinMachine
from tumble.foundation.errors import ProcedureError
from tumble.procedures.spin.machine import LiveSpinOptions


@pytest.fixture(scope="module")
def drive():
    return tumble.simulate_spin(seed=3)


def pushed(samples, cuts, **options):
    """A machine that was given samples in the pieces between these places."""
    machine, events = SpinMachine(**options), []
    for first, last in zip([0, *cuts], [*cuts, len(samples)], strict=True):
        part = slice(first, last)
        events += machine.push((samples.time[part], samples.accelerometer[part], samples.gyroscope[part]))
    return machine, events


def test_result_does_not_depend_on_the_chunks_of_samples(drive):
    cuts = np.sort(np.random.default_rng(drawn_seed()).integers(0, len(drive.samples), 60)).tolist()
    whole, whole_events = pushed(drive.samples, [])
    pieces, piece_events = pushed(drive.samples, cuts)
    assert piece_events == whole_events
    assert [event.kind for event in whole_events] == ["still began", "still done", "spin began", "done"]
    one, other = whole.result(), pieces.result()
    assert (one.start, one.end) == (other.start, other.end)
    assert np.array_equal(one.level_free.value, other.level_free.value)
    assert np.array_equal(one.gyroscope_bias.sigma, other.gyroscope_bias.sigma)


def test_the_biases_found_are_the_true_ones_within_their_sigmas(drive):
    machine, _ = pushed(drive.samples, [])
    bias = machine.result().level_free
    assert bias.observable
    assert (np.abs(bias.value - drive.accelerometer_bias) < 5.0 * bias.sigma).all()


def test_there_is_no_result_before_the_spin_is_done(drive):
    machine = SpinMachine()
    with pytest.raises(ProcedureError, match="not done"):
        machine.result()
    machine.push(
        Chunk(drive.samples.time[:10], drive.samples.accelerometer[:10], drive.samples.gyroscope[:10])
    )
    assert (machine.state, machine.is_over, machine.failure) == ("still", False, None)


def test_a_stream_that_stops_fails_the_spin_with_words(drive):
    machine, _ = pushed(drive.samples, [], options=LiveSpinOptions(turns=50.0))
    (event,) = machine.tick(float(drive.samples.time[-1]) + 60.0)
    assert event.kind == "failed"
    with pytest.raises(ProcedureError) as refused:
        machine.result()
    assert "\n" not in str(refused.value)
