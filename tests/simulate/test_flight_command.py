"""`tumble simulate flight` as it is typed."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from flight_units import GRAVITY
from tumble import list_imus, open_recording, simulate_flight
from tumble.tools.simulate import Fault, FlightUnit, write_flight
from turntable_sessions import typed

QUICK = ("--rest", "2", "--duration", "6")
BRIEF = {"rest_seconds": 2.0, "motion_seconds": 6.0}


def samples(source):
    chunks = list(open_recording(source).chunks())
    return {
        name: np.concatenate([getattr(chunk, name) for chunk in chunks])
        for name in ("time", "accelerometer", "gyroscope")
    }


@pytest.mark.parametrize("log_format", ["csv", "parquet", "mcap"])
@pytest.mark.parametrize("motion", ["quadrotor", "vehicle"])
def test_the_logs_written_are_read_back_as_they_were_flown(tmp_path, log_format, motion):
    done = typed(
        "simulate",
        "flight",
        *QUICK,
        "--motion",
        motion,
        "--seed",
        "5",
        "--format",
        log_format,
        "-o",
        tmp_path,
    )
    assert done.code == 0, done.err
    flight = simulate_flight(seed=5, motion=motion, **BRIEF)
    for unit in flight.units:
        log = f"{tmp_path}/flight.mcap:{unit.name}"
        read = samples(log if log_format == "mcap" else tmp_path / f"{unit.name}.{log_format}")
        assert np.array_equal(read["accelerometer"], unit.specific_force)
        assert np.array_equal(read["gyroscope"], unit.angular_rate)
        # MCAP counts nanoseconds.
        assert np.abs(read["time"] - unit.time).max() <= (1e-9 if log_format == "mcap" else 0.0)


def test_one_mcap_holds_all_units_each_with_its_temperature(tmp_path):
    assert typed("simulate", "flight", *QUICK, "--format", "mcap", "-o", tmp_path).code == 0
    log = tmp_path / "flight.mcap"
    assert list_imus(log) == ("/ideal", "/primary", "/secondary_1", "/secondary_2")
    temperatures = [next(open_recording(f"{log}:{name}").chunks()).temperature for name in list_imus(log)]
    assert [temperature is None for temperature in temperatures] == [True, False, False, False]


def test_the_ideal_log_is_the_truth_at_the_primarys_place(tmp_path):
    flight = simulate_flight(**BRIEF, units=(FlightUnit(faults=[Fault("dead", start=3.0)]), FlightUnit()))
    write_flight(flight, tmp_path)
    read = samples(tmp_path / "ideal.csv")
    truth = flight.truth(read["time"])
    assert np.array_equal(read["accelerometer"], truth.specific_force)
    assert np.array_equal(read["gyroscope"], truth.angular_rate)
    assert read["time"][-1] > flight.duration - 0.01


def test_the_truth_beside_the_logs_is_exact_and_complete(tmp_path):
    words = [
        "--unit",
        "tactical",
        "--unit",
        "consumer:lever-arm=0.03,0,0.01:mounting=180,0,0:rate=100:latency=0.01",
    ]
    fault = ["--fault", "secondary_1:spikes:start=4:triad=gyroscope:size=3"]
    done = typed("simulate", "flight", *QUICK, *words, *fault, "--seed", "6", "-o", tmp_path)
    assert done.code == 0, done.err
    truth = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    units = (
        FlightUnit(grade="tactical", ageing=0.0),
        FlightUnit(
            lever_arm_m=(0.03, 0.0, 0.01),
            mounting_deg=(180.0, 0.0, 0.0),
            rate_hz=100.0,
            latency_seconds=0.01,
            faults=[Fault("spikes", triad="gyroscope", start=4.0, size=3.0)],
        ),
    )
    flight = simulate_flight(seed=6, units=units, **BRIEF)
    assert truth["motion"] == "quadrotor"
    assert np.array_equal(truth["rests"], flight.rests)
    assert np.array_equal(truth["manoeuvres"], flight.manoeuvres)
    assert truth["temperature"] == {"start": 25.0, "rise": 10.0, "time_constant": 120.0}
    for unit in flight.units:
        written = truth["units"][unit.name]
        assert np.array_equal(written["lever_arm"], unit.lever_arm)
        assert np.array_equal(written["nominal_mounting"], unit.nominal_mounting)
        assert written["samples"] == len(unit.time)
        assert written["latency"] == unit.latency
        for triad, aged in (
            ("accelerometer", unit.accelerometer_ageing),
            ("gyroscope", unit.gyroscope_ageing),
        ):
            assert np.array_equal(written[triad]["M"], getattr(unit, triad).M)
            assert np.array_equal(written[triad]["b"], getattr(unit, triad).b)
            assert np.array_equal(written[triad]["ageing"], aged)
    assert truth["units"]["secondary_1"]["faults"] == [
        {"kind": "spikes", "triad": "gyroscope", "axis": "y", "start": 4.0, "size": 3.0}
    ]


def test_log_minus_bias_rotated_back_reads_gravity_at_rest(tmp_path):
    done = typed("simulate", "flight", *QUICK, "--warm-up", "0", "--ground-tilt", "0", "-o", tmp_path)
    assert done.code == 0, done.err
    truth = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    for name in ("primary", "secondary_1", "secondary_2"):
        read = samples(tmp_path / f"{name}.csv")
        resting = read["time"] < truth["rests"][0][1]
        triad = truth["units"][name]["accelerometer"]
        force = np.linalg.solve(triad["M"], read["accelerometer"][resting].mean(axis=0) - triad["b"])
        assert force == pytest.approx([0.0, 0.0, GRAVITY], abs=0.01)


def test_silent_unit_has_no_log_and_is_in_the_truth(tmp_path):
    for log_format in ("csv", "mcap"):
        folder = tmp_path / log_format
        done = typed(
            *("simulate", "flight", *QUICK, "--fault", "secondary_1:absent", "--format", log_format),
            *("-o", folder),
        )
        assert done.code == 0, done.err
        assert "secondary_1: consumer, 0 samples, fault: absent" in done.out
        truth = yaml.safe_load((folder / "truth.yaml").read_text())
        assert truth["units"]["secondary_1"]["samples"] == 0
    assert not (tmp_path / "csv" / "secondary_1.csv").exists()
    assert "/secondary_1" not in list_imus(tmp_path / "mcap" / "flight.mcap")


@pytest.mark.parametrize("log_format", ["csv", "mcap"])
def test_next_command_calibrates_the_secondaries_and_hands_over(tmp_path, monkeypatch, log_format):
    monkeypatch.chdir(tmp_path)
    words = ["--duration", "90", "--fault", "primary:dead:start=95", "--seed", "3", "--format", log_format]
    done = typed("simulate", "flight", *words, "-o", "flight")
    assert done.code == 0, done.err
    (following,) = [line for line in done.out.splitlines() if line.startswith("Next: tumble ")]
    replayed = typed(*following.removeprefix("Next: tumble ").split(), "--json")
    assert replayed.code == 0, replayed.err
    events = [json.loads(line) for line in (tmp_path / "results" / "events.jsonl").read_text().splitlines()]
    adopted = {(event["unit"], event["figures"]["sensor"]) for event in events if event["event"] == "adopted"}
    sensors = ("accelerometer", "gyroscope")
    assert adopted == {(f"secondary_{number}", sensor) for number in (1, 2) for sensor in sensors}
    selected = [event for event in events if event["event"] == "selected"]
    assert selected[0]["unit"] == "primary"
    assert selected[-1]["unit"].startswith("secondary_")
    assert selected[-1]["time"] == pytest.approx(95.0, abs=0.3)


@pytest.mark.parametrize(
    "words",
    [
        ["--unit", "consumer"],
        ["--fault", "primary:absent"],
        [word for unit in ("secondary_1", "secondary_2") for word in ("--fault", f"{unit}:absent")],
    ],
)
def test_next_command_inspects_a_flight_without_comparable_units(tmp_path, words):
    done = typed("simulate", "flight", *QUICK, *words, "-o", tmp_path)
    assert done.code == 0, done.err
    assert f"Next: tumble inspect {tmp_path / 'ideal.csv'}" in done.out


def test_samples_of_an_mcap_are_logged_when_they_arrived(tmp_path):
    from mcap.reader import make_reader

    done = typed(
        *("simulate", "flight", *QUICK, "--fault", "primary:late:start=3:end=4:size=0.5"),
        *("--format", "mcap", "-o", tmp_path),
    )
    assert done.code == 0, done.err
    flight = simulate_flight(
        **BRIEF, units=(FlightUnit(grade="industrial", faults=[Fault("late", start=3.0, end=4.0, size=0.5)]),)
    )
    with (tmp_path / "flight.mcap").open("rb") as file:
        messages = make_reader(file).iter_messages(topics=["/primary"], log_time_order=False)
        logged = np.array([[message.log_time, message.publish_time] for _, _, message in messages]) / 1e9
    assert logged[:, 0] == pytest.approx(flight["primary"].arrival, abs=1e-8)
    assert logged[:, 1] == pytest.approx(flight["primary"].time, abs=1e-8)


def test_vibration_and_sway_typed_are_those_flown(tmp_path):
    words = [
        "--vibration",
        "0",
        "--angular-vibration",
        "0",
        "--sway",
        "0,0,0",
        "--turning",
        "0",
        "--intensity",
        "1",
    ]
    done = typed("simulate", "flight", *QUICK, *words, "--ground-tilt", "0", "-o", tmp_path)
    assert done.code == 0, done.err
    truth = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    read = samples(tmp_path / "ideal.csv")
    start, end = truth["manoeuvres"][0]
    hovering = (read["time"] > start) & (read["time"] < end)
    assert np.abs(read["gyroscope"]).max() < 1e-12
    assert read["accelerometer"][hovering] == pytest.approx(
        np.tile([0.0, 0.0, GRAVITY], (hovering.sum(), 1)), abs=1e-9
    )


def test_times_beyond_mcap_are_refused_in_one_line_and_leave_no_log(tmp_path):
    words = ["--unit", "consumer:clock-offset=-50", "--format", "mcap"]
    done = typed("simulate", "flight", *QUICK, *words, "-o", tmp_path)
    assert done.code == 2
    assert "flight.mcap: its stamps hold 0 s to 2^31 s" in done.err
    assert list(tmp_path.iterdir()) == []
