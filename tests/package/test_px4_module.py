"""The module for PX4 calibrates a secondary in flight, and puts it in use when the others die."""

from __future__ import annotations

import pytest
import yaml

from package.packages import CRATE, HERE, ROOT, build, run

EXAMPLE = ROOT / "examples" / "px4"


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """The module with stand-ins of PX4 and a made flight."""
    folder = tmp_path_factory.mktemp("px4")
    build(HERE / "px4", folder, EXAMPLE=EXAMPLE, TUMBLE_SOURCE=CRATE, TUMBLE_UNITS="3")
    return folder / "flight"


def assert_the_vehicle_feels_the_truth(said):
    outcome = said.splitlines()[-1]
    assert outcome.startswith("outputs 400 of device 101, error ")
    errors = [abs(float(word)) for word in outcome.partition("error ")[2].split()]
    # The secondary is off by 0.1 to 0.3 m/s^2 and 0.02 to 0.05 rad/s before it is calibrated.
    assert max(errors[0::2]) < 0.005
    assert max(errors[1::2]) < 0.0005


def test_a_calibrated_secondary_takes_over_when_the_primary_dies(flight, tmp_path):
    said = run(flight, folder=tmp_path)
    assert said.count("INFO IMU 1: calibrated") == 2
    assert "WARN IMU 0: unhealthy" in said
    assert_the_vehicle_feels_the_truth(said)


def test_what_was_found_in_one_flight_is_known_in_the_next(flight, tmp_path):
    run(flight, folder=tmp_path)
    assert len(list(tmp_path.iterdir())) == 2
    said = run(flight, folder=tmp_path)
    assert "calibrated" not in said
    assert_the_vehicle_feels_the_truth(said)


def test_a_record_that_was_damaged_is_said_and_passed_over(flight, tmp_path):
    run(flight, folder=tmp_path)
    for record in tmp_path.iterdir():
        damaged = bytearray(record.read_bytes())
        damaged[20] ^= 1
        record.write_bytes(damaged)
    said = run(flight, folder=tmp_path)
    assert said.count("WARN ./tumble_") == 2
    assert said.count("INFO IMU 1: calibrated") == 2


def test_every_parameter_of_the_module_is_declared():
    declared = yaml.safe_load((EXAMPLE / "module.yaml").read_text())["parameters"][0]["definitions"]
    header = (EXAMPLE / "TumbleImu.hpp").read_text()
    assert {name for name in declared if f"px4::params::{name}>" in header} == set(declared)
    assert header.count("px4::params::") == len(declared)
    assert all(len(name) <= 16 for name in declared)
