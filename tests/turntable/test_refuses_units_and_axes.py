"""Wrong units and axes are noticed in reference and target alike, and one option mends each."""

from __future__ import annotations

import re

import numpy as np
import pytest

import tumble
from tumble.foundation.errors import ProcedureError
from tumble.tools.simulate import Fault
from turntable_sessions import (
    FORCE,
    HEADER,
    RATE,
    Pair,
    calibrate,
    calibrated,
    contents,
    refusal,
    simulate,
)

G, DEGREES = 9.80665, np.degrees(1.0)
UNITS = ("reference", "target_1")
both = pytest.mark.parametrize("unit", UNITS)


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    session = simulate(101, grades=("industrial",), g_sensitivity=True)
    return Pair.make(session, tmp_path_factory.mktemp("pair"))


def times(columns, factor):
    def change(table):
        table[:, columns] *= factor

    return change


def as_is(table):
    return table


def with_units(force, rate):
    names = [f"{name} [{force}]" for name in ("ax", "ay", "az")]
    names += [f"{name} [{rate}]" for name in ("gx", "gy", "gz")]
    return ",".join(["time", *names])


STATED = {
    "g for m/s^2": (times(FORCE, 1 / G), with_units("m/s^2", "rad/s"), "would in g", "accelerometer-unit=g"),
    "m/s^2 for g": (as_is, with_units("g", "rad/s"), "would in m/s^2", "accelerometer-unit=m/s^2"),
    "deg/s for rad/s": (
        times(RATE, DEGREES),
        with_units("m/s^2", "rad/s"),
        "gyroscope turns gravity 57.3 times too far: deg/s were taken for rad/s",
        "gyroscope-unit=deg/s",
    ),
    "rad/s for deg/s": (
        as_is,
        with_units("m/s^2", "deg/s"),
        "rad/s were taken for deg/s|as it would in rad/s",
        "gyroscope-unit=rad/s",
    ),
}


@both
@pytest.mark.parametrize(("change", "header", "said", "remedy"), STATED.values(), ids=STATED.keys())
def test_log_with_a_wrong_unit_is_refused_and_its_option_helps(
    pair, tmp_path, unit, change, header, said, remedy
):
    command = pair.corrupt(tmp_path, unit, change, header)
    line = refusal(*command)
    assert "corrupt" in line
    assert any(each in line for each in said.split("|"))
    assert remedy.replace("=", " ") in line
    calibrated(*command, "--for", f"corrupt:{remedy}")


@both
def test_g_in_a_log_that_states_no_unit_is_recognised_at_rest(pair, tmp_path, unit):
    calibrated(*pair.corrupt(tmp_path, unit, times(FORCE, 1 / G)))


@both
def test_deg_per_s_without_a_unit_is_refused_with_one_option(tmp_path, unit):
    """At 20 deg/s nothing is too fast for rad/s: only gravity shows it."""
    slow = simulate(102, grades=("tactical",), turn_rate_dps=20.0, turn_acceleration_dps2=40.0)
    command = Pair.make(slow, tmp_path).corrupt(tmp_path, unit, times(RATE, DEGREES))
    line = refusal(*command)
    assert line.startswith("corrupt: gyroscope turns gravity 57.3 times too far: deg/s were taken for rad/s")
    remedy = re.search(r"--for (\S+)$", line).group(1)
    calibrated(*command, "--for", remedy)


@both
def test_a_stated_option_that_contradicts_the_log_is_refused(pair, tmp_path, unit):
    line = refusal(
        *pair.corrupt(tmp_path, unit, times(RATE, DEGREES)), "--for", "corrupt:gyroscope-unit=rad/s"
    )
    assert "deg/s were taken for rad/s" in line


@both
@pytest.mark.parametrize("triad", ["accelerometer", "gyroscope"])
def test_recordings_in_memory_are_held_to_si(unit, triad):
    session = simulate(103, grades=("industrial",), faults={unit: Fault("wrong-unit", triad=triad)})
    taken = "g were taken for m/s^2" if triad == "accelerometer" else "deg/s were taken for rad/s"
    with pytest.raises(ProcedureError, match=f"^{unit}: {triad}.*{re.escape(taken)}"):
        calibrate(session)


def test_a_gyroscope_in_the_wrong_unit_is_not_taken_for_slow_turns(pair, tmp_path):
    """The response of an industrial gyroscope to gravity is 57 times too large then."""
    line = refusal(*pair.corrupt(tmp_path, "target_1", times(RATE, DEGREES), with_units("m/s^2", "rad/s")))
    assert "slow turn" not in line


def test_a_unit_that_fits_nothing_is_refused_with_what_to_give(pair, tmp_path):
    command = pair.corrupt(tmp_path, "target_1", times(FORCE, 417.7))
    line = refusal(*command)
    assert "corrupt.csv: accelerometer reads 4" in line
    assert "--accelerometer-scale" in line
    calibrated(
        *command,
        "--for",
        "corrupt:accelerometer-scale=417.7",
        "--for",
        "corrupt:accelerometer-unit=m/s^2",
    )


def renamed(names):
    """The header with columns exchanged: their contents belong to other axes than named."""
    return ",".join(names.get(name, name) for name in HEADER.split(","))


def exchanged(one, other):
    return {one: other, other: one}


@both
def test_exchanged_columns_of_one_triad_are_named(pair, tmp_path, unit):
    command = pair.corrupt(tmp_path, unit, as_is, renamed(exchanged("gy", "gz")))
    line = refusal(*command)
    assert line.startswith("corrupt: axes of gyroscope and accelerometer are swapped")
    assert "fits as x,z,y" in line
    assert "--columns" in line
    calibrated(*command, "--for", "corrupt:columns=gy=gz,gz=gy")


@both
def test_exchanged_columns_of_the_accelerometer_are_named(pair, tmp_path, unit):
    command = pair.corrupt(tmp_path, unit, as_is, renamed(exchanged("ax", "ay")))
    line = refusal(*command)
    assert line.startswith("corrupt: axes of gyroscope and accelerometer are swapped")
    calibrated(*command, "--for", "corrupt:columns=ax=ay,ay=ax")


def turned(*columns):
    def change(table):
        table[:, list(columns)] *= -1.0

    return change


@both
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_left_handed_log_is_named_and_axes_mend_it(pair, tmp_path, unit, axis):
    command = pair.corrupt(tmp_path, unit, turned(1 + axis, 4 + axis))
    line = refusal(*command)
    assert line.startswith("corrupt: gyroscope turns the wrong way about every axis")
    assert "left-handed" in line
    # Any one axis turned makes it right-handed; which one is a mounting angle of 180 deg.
    calibrated(*command, "--for", "corrupt:axes=x,y,-z", "--poses", "none")


@both
def test_two_axes_exchanged_in_both_triads_are_left_handed_too(pair, tmp_path, unit):
    header = renamed(exchanged("ax", "ay") | exchanged("gx", "gy"))
    command = pair.corrupt(tmp_path, unit, as_is, header)
    assert "left-handed (two are exchanged" in refusal(*command)
    calibrated(*command, "--for", "corrupt:axes=y,x,z")


@both
def test_an_accelerometer_that_reads_minus_g_up_is_noticed(pair, tmp_path, unit):
    command = pair.corrupt(tmp_path, unit, turned(1, 2, 3))
    line = refusal(*command)
    assert line.startswith("target_1: " if unit == "reference" else "corrupt: ")
    assert "accelerometer mirrors that of the reference" in line
    assert "--accelerometer-sign -1" in line
    calibrated(*command, "--for", "corrupt:accelerometer-sign=-1")


@both
def test_a_gyroscope_with_one_sign_turned_is_noticed(tmp_path, unit):
    """Turns about every axis, so that each sign shows more than once."""
    order = ["X up", "Y up", "Z up", "X down", "Y down", "Z down", "X up"]
    session = simulate(104, grades=("industrial",), visits=order)
    command = Pair.make(session, tmp_path).corrupt(tmp_path, unit, turned(6))
    line = refusal(*command)
    assert line.startswith("corrupt: gyroscope and accelerometer have opposite signs")
    remedy = re.search(r"--for (\S+)$", line).group(1)
    assert remedy == "corrupt:gyroscope-scale=1,1,-1"
    calibrated(*command, "--for", remedy)


def test_a_refusal_leaves_the_output_folder_as_it_was(pair, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out/mine.txt").write_text("mine")
    refusal(*pair.corrupt(tmp_path, "reference", turned(3, 6)))
    assert contents(tmp_path / "out") == {"mine.txt": b"mine"}


def test_a_target_in_the_wrong_unit_does_not_stop_a_good_one(pair, tmp_path):
    command = pair.corrupt(tmp_path, "target_1", times(RATE, DEGREES), with_units("m/s^2", "rad/s"))
    command.insert(1, pair.folder / "target_1.csv")
    done = calibrated(*command, code=3)
    assert "corrupt: not calibrated: gyroscope turns gravity 57.3 times too far" in done.text
    assert tumble.Calibration.load(tmp_path / "out/target_1.yaml").name == "target_1"
