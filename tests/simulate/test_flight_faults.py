"""Each fault has its described effect on its unit, and none on others."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flight_units import GRAVITY, fly
from tumble.tools.simulate import FAULTS, Fault, FlightUnit

START, END = 12.0, 14.0
CHANNELS = ("specific_force", "angular_rate")
TRIADS = {"accelerometer": "specific_force", "gyroscope": "angular_rate"}


def pair(*faults, **changes):
    """The first of two consumer units without the faults, then with them."""
    flights = [
        fly(units=(FlightUnit(faults=each), FlightUnit()), vibration=None, **changes) for each in ((), faults)
    ]
    for channel in (*CHANNELS, "time", "arrival"):
        others = [getattr(flight["secondary_1"], channel) for flight in flights]
        assert np.array_equal(*others), f"the fault of another unit changed {channel}"
    return [flight["primary"] for flight in flights]


def same_but(clean, faulty, channels, rows=None):
    """Asserts that all but these channels, in these rows, equal those without the fault."""
    for channel in (*CHANNELS, "time", "arrival"):
        before, after = getattr(clean, channel), getattr(faulty, channel)
        changed = np.zeros(len(before), bool) if channel not in channels else rows
        assert np.array_equal(before[~changed], after[~changed]), channel


def span(unit, start=START, end=END):
    return (unit.arrival >= start) & (unit.arrival < end)


@pytest.mark.parametrize("kind", FAULTS)
def test_every_kind_can_be_flown_and_leaves_the_other_unit_alone(kind):
    _, faulty = pair(Fault(kind, start=START))
    assert [fault.kind for fault in faulty.faults] == [kind]


def test_a_frozen_unit_repeats_all_its_readings_for_a_while():
    clean, faulty = pair(Fault("frozen", start=START, end=END))
    rows = span(clean)
    same_but(clean, faulty, CHANNELS, rows)
    first = int(np.argmax(rows))
    for channel in CHANNELS:
        readings = getattr(faulty, channel)
        assert np.all(readings[rows] == readings[first - 1])


@given(start=st.floats(2.0, 20.0), lasting=st.floats(0.1, 5.0), late=st.floats(0.05, 3.0))
@settings(max_examples=15)
def test_late_samples_keep_their_times_and_arrive_in_order(start, lasting, late):
    clean, faulty = pair(Fault("late", start=start, end=start + lasting, size=late))
    delay = faulty.arrival - clean.arrival
    rows = span(clean, start, start + lasting)
    waiting = span(clean, start, start + lasting + late)
    same_but(clean, faulty, ("arrival",), waiting)
    assert delay[rows] == pytest.approx(late)
    assert np.all(np.diff(faulty.arrival) >= 0.0)


@pytest.mark.parametrize("triad", TRIADS)
def test_a_bias_jumps_at_its_time_by_its_size_on_one_axis(triad):
    clean, faulty = pair(
        Fault("bias-jump", triad=triad, axis="z", start=START, size=0.25), quantisation=False
    )
    same_but(clean, faulty, (TRIADS[triad],), span(clean, START, np.inf))
    moved = getattr(faulty, TRIADS[triad]) - getattr(clean, TRIADS[triad])
    assert moved[:, :2].max() == 0.0
    assert moved[span(clean, START, np.inf), 2] == pytest.approx(0.25)


def test_a_bias_drifts_evenly_and_stays():
    clean, faulty = pair(Fault("bias-drift", axis="x", start=START, end=END, size=0.5), quantisation=False)
    moved = (faulty.specific_force - clean.specific_force)[:, 0]
    expected = np.interp(clean.time, [START, END], [0.0, 0.5])
    np.testing.assert_allclose(moved, expected, rtol=0.0, atol=1e-9)


def test_noise_grows_and_stays():
    clean, faulty = pair(
        Fault("noise", triad="gyroscope", start=START, end=END, size=0.2), quantisation=False
    )
    same_but(clean, faulty, ("angular_rate",), span(clean, START, np.inf))
    added = faulty.angular_rate - clean.angular_rate
    assert added[span(clean, END, np.inf)].std(axis=0) == pytest.approx(0.2, rel=0.06)
    assert added[span(clean, START, START + 0.5)].std() < 0.1


def test_spikes_strike_now_and_then_by_their_size():
    clean, faulty = pair(
        Fault("spikes", axis="y", start=START, end=START + 10.0, size=60.0), quantisation=False
    )
    rows = span(clean, START, START + 10.0)
    same_but(clean, faulty, ("specific_force",), rows)
    struck = np.abs(faulty.specific_force - clean.specific_force)[rows]
    assert struck[0, 1] == pytest.approx(60.0)
    assert set(np.round(struck[:, 1], 9)) == {0.0, 60.0}
    assert 0.02 < np.mean(struck[:, 1] > 0.0) < 0.09


@given(share=st.floats(0.2, 0.9), start=st.floats(2.0, 15.0), lasting=st.floats(0.5, 10.0))
@settings(max_examples=15)
def test_a_range_that_shrinks_ends_readings_there_for_a_while(share, start, lasting):
    clean, faulty = pair(Fault("saturated", start=start, end=start + lasting, size=share))
    rows = span(clean, start, start + lasting)
    same_but(clean, faulty, ("specific_force",), rows)
    limit = share * GRAVITY
    assert np.array_equal(faulty.specific_force[rows], np.clip(clean.specific_force[rows], -limit, limit))


def test_a_range_is_small_throughout_where_no_time_is_given():
    _, faulty = pair(Fault("saturated", size=0.5))
    assert np.abs(faulty.specific_force).max() == pytest.approx(0.5 * GRAVITY)


def test_readings_are_not_numbers_for_a_while_on_one_axis():
    clean, faulty = pair(Fault("nan", triad="gyroscope", axis="z", start=START, end=END))
    rows = span(clean)
    same_but(clean, faulty, ("angular_rate",), rows)
    assert np.all(np.isnan(faulty.angular_rate[rows, 2]))
    assert np.array_equal(faulty.angular_rate[rows, :2], clean.angular_rate[rows, :2])


@pytest.mark.parametrize(
    ("fault", "kept"),
    [
        (Fault("dead", start=START), lambda time: time < START),
        (Fault("absent", end=START), lambda time: time >= START),
        (Fault("absent"), lambda time: time < 0.0),
        (Fault("gap", start=START, end=END), lambda time: (time < START) | (time >= END)),
    ],
)
def test_missing_samples_are_gone_and_the_others_are_as_they_were(fault, kept):
    clean, faulty = pair(fault)
    rows = kept(clean.arrival)
    for channel in (*CHANNELS, "time", "arrival"):
        assert np.array_equal(getattr(clean, channel)[rows], getattr(faulty, channel))


@pytest.mark.parametrize(
    ("kind", "size", "jump"),
    [
        ("clock-jump", 0.7, 0.7),
        ("time-backwards", 0.7, -0.7),
        ("time-backwards", 2**32 / 1e6, -4294.967296),
    ],
)
def test_clock_jumps_once_and_readings_and_arrivals_stay(kind, size, jump):
    clean, faulty = pair(Fault(kind, start=START, size=size))
    after = span(clean, START, np.inf)
    same_but(clean, faulty, ("time",), after)
    assert (faulty.time - clean.time)[after] == pytest.approx(jump)


def test_faults_meet_a_unit_on_its_own_clock():
    unit = FlightUnit(clock_offset_seconds=100.0, faults=[Fault("nan", start=START, end=END)])
    primary = fly(units=(unit,))["primary"]
    missing = np.isnan(primary.specific_force[:, 1])
    assert np.array_equal(missing, span(primary))
    assert primary.time[missing].min() == pytest.approx(100.0 + START, abs=0.01)


def test_several_faults_add_up():
    faults = (Fault("bias-jump", axis="x", start=START, size=0.5), Fault("dead", start=END))
    clean, faulty = pair(*faults, quantisation=False)
    moved = faulty.specific_force - clean.specific_force[: len(faulty.time)]
    assert faulty.time[-1] < END
    assert moved[-1] == pytest.approx([0.5, 0.0, 0.0])


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"start": float("nan")}, "start needs to be a finite number, found nan"),
        ({"end": float("inf")}, "end needs to be a finite number, found inf"),
        ({"size": float("inf")}, "size needs to be a finite number, found inf"),
        ({"size": -0.5}, "size needs to be positive, found -0.5"),
        ({"axis": "w"}, "axis needs to be x, y or z, found 'w'"),
    ],
)
def test_a_fault_that_makes_no_sense_is_refused_in_one_line(stated, words):
    with pytest.raises(ValueError, match=words) as caught:
        Fault("late", **stated)
    assert "\n" not in str(caught.value)
