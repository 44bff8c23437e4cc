"""The module for PX4 calibrates a secondary in flight, and puts it in use when the others die."""

from __future__ import annotations

import re
import shutil

import pytest
import yaml

from package.packages import CRATE, HERE, ROOT, build, run

EXAMPLE = ROOT / "examples" / "px4"


def built(folder, example):
    """The module with stand-ins of PX4 and a made flight."""
    build(HERE / "px4", folder, EXAMPLE=example, TUMBLE_SOURCE=CRATE, TUMBLE_UNITS="3")
    return folder / "flight"


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    return built(tmp_path_factory.mktemp("px4"), EXAMPLE)


def assert_the_vehicle_feels_the_truth(said):
    outcome = said.splitlines()[-1]
    assert outcome.startswith("outputs 400 of device 101, error ")
    errors = [abs(float(word)) for word in outcome.partition("error ")[2].split()]
    # The secondary has errors of 0.1 to 0.3 m/s^2 and 0.02 to 0.05 rad/s before it is calibrated.
    assert max(errors[0::2]) < 0.005
    assert max(errors[1::2]) < 0.0005


def test_a_calibrated_secondary_takes_over_when_the_primary_dies(flight, tmp_path):
    said = run(flight, folder=tmp_path)
    assert said.count("INFO IMU 1: calibrated") == 2
    assert "WARN IMU 0: unhealthy" in said
    assert_the_vehicle_feels_the_truth(said)


def test_errors_found_in_one_flight_are_known_in_the_next(flight, tmp_path):
    run(flight, folder=tmp_path)
    assert len(list(tmp_path.iterdir())) == 2
    said = run(flight, folder=tmp_path)
    assert "calibrated" not in said
    assert_the_vehicle_feels_the_truth(said)


def test_damaged_record_is_reported_and_skipped(flight, tmp_path):
    run(flight, folder=tmp_path)
    for record in tmp_path.iterdir():
        damaged = bytearray(record.read_bytes())
        damaged[20] ^= 1
        record.write_bytes(damaged)
    said = run(flight, folder=tmp_path)
    assert said.count("WARN ./tumble_") == 2
    assert said.count("INFO IMU 1: calibrated") == 2


def files_touched(said):
    """Numbers of accesses: in all, in a push, and in flight."""
    (line,) = re.findall(r"^files touched (\d+), in a push (\d+), while armed (\d+)$", said, re.MULTILINE)
    return [int(times) for times in line]


def test_no_file_is_touched_in_a_push_or_in_flight(flight, tmp_path):
    touched, in_a_push, while_armed = files_touched(run(flight, folder=tmp_path))
    # To read: three units, two sensors each. To write, twice: opened, written, closed, renamed.
    assert touched == 6 + 2 * 4
    assert (in_a_push, while_armed) == (0, 0)


def test_a_module_that_saves_at_once_is_found_out(tmp_path):
    """The control of the test above."""
    hasty = tmp_path / "hasty"
    shutil.copytree(EXAMPLE, hasty)
    source = hasty / "TumbleImu.cpp"
    text = source.read_text()
    assert text.count("*event.record, true, 0};") == 1
    source.write_text(text.replace("*event.record, true, 0};", "*event.record, true, 0}; save_one();"))
    folder = tmp_path / "flown"
    folder.mkdir()
    touched, in_a_push, while_armed = files_touched(run(built(tmp_path / "px4", hasty), folder=folder))
    assert touched == 6 + 2 * 4
    assert (in_a_push, while_armed) == (8, 8)


def test_silent_unit_is_reported_once_and_not_waited_for(flight, tmp_path):
    said = run(flight, "2", "1000", folder=tmp_path)
    assert said.count("WARN IMU 2: says nothing") == said.count("says nothing") == 1
    assert said.count("INFO IMU 1: calibrated") == 2
    assert_the_vehicle_feels_the_truth(said)


def test_a_unit_that_comes_late_is_known_again_by_its_records(flight, tmp_path):
    run(flight, folder=tmp_path)
    said = run(flight, "1", "3", folder=tmp_path)
    assert said.count("WARN IMU 1: says nothing") == 1
    assert "INFO IMU 1: healthy" in said
    assert "calibrated" not in said
    assert_the_vehicle_feels_the_truth(said)


def test_unwritable_file_is_reported_once_and_blocks_no_other(flight, tmp_path):
    # A folder lies in the way of the accelerometer's.
    (tmp_path / "tumble_00000065000000c9_0.new").mkdir()
    said = run(flight, folder=tmp_path)
    assert said.count("ERROR ./tumble_00000065000000c9_0 could not be written") == 1
    assert (tmp_path / "tumble_00000065000000c9_1").is_file()


def test_every_parameter_of_the_module_is_declared():
    declared = yaml.safe_load((EXAMPLE / "module.yaml").read_text())["parameters"][0]["definitions"]
    header = (EXAMPLE / "TumbleImu.hpp").read_text()
    assert {name for name in declared if f"px4::params::{name}>" in header} == set(declared)
    assert header.count("px4::params::") == len(declared)
    assert all(len(name) <= 16 for name in declared)


def test_messages_of_the_stand_ins_are_those_of_px4_release_1_17():
    messages = yaml.safe_load((HERE / "px4" / "messages.yaml").read_text())
    declared = (HERE / "px4" / "stand_ins.hpp").read_text()
    for topic, fields in messages.items():
        (body,) = re.findall(rf"^struct {topic}_s {{\n(.*?)^}};", declared, re.MULTILINE | re.DOTALL)
        found = {}
        for kind, names in re.findall(r"^\t(u?\w+) ([^;=]+);", body, re.MULTILINE):
            for name, count in re.findall(r"(\w+)(\[\d+\])?", names):
                found[name] = kind.removesuffix("_t").replace("float", "float32") + count
        assert found == fields, topic
