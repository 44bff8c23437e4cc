"""The mission on emulated microcontrollers is the host's, bit for bit, and what it should be."""

from __future__ import annotations

import json
import re
import shutil
import struct

import numpy as np
import pytest
from benchmarks import footprint

from firmware_images import ROOT, VECTORS, compare, run
from repetitions import only_soak
from tumble import _core

FLOWN = json.loads((VECTORS / "redundancy.json").read_text())
SPUN = json.loads((VECTORS / "spin.json").read_text())


def numbers(line):
    """The numbers of single precision in a line."""
    return [struct.unpack(">f", bytes.fromhex(bits))[0] for bits in re.findall(r"#([0-9a-f]{8})", line)]


def after(said, *lines):
    """Lines after the first ones that contain each of these, one after the other."""
    rest = said
    for line in lines:
        assert line in rest, f"{line!r} was not said, or not in this order"
        rest = rest[rest.index(line) + len(line) :]
    return rest


def sigmas(found, sigma, vectors, quantity):
    """Distance of the estimate from the vectors, in sigmas."""
    return np.abs(found - vectors["cases"][quantity]) / sigma


@pytest.fixture
def elsewhere(tmp_path):
    """A folder of its own with the vectors, for a device to read."""
    shutil.copytree(VECTORS, tmp_path / "vectors")
    return tmp_path


def changed(folder, file, old, new):
    """Changes the first of some text in a file of vectors."""
    path = folder / "vectors" / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_the_device_says_what_the_host_says_bit_for_bit(said, tmp_path):
    log = tmp_path / "said.txt"
    log.write_text(said)
    compared = compare(VECTORS, log)
    assert compared.returncode == 0, compared.stdout[-2000:] + compared.stderr
    assert "bit for bit" in compared.stdout


@only_soak("compiles all of the core once more")
def test_processors_without_fpu_match_the_host_bit_for_bit(other_processor, tmp_path):
    target, image = other_processor
    ran = run(image, ROOT, target)
    assert ran.returncode == 0, ran.stdout[-2000:] + ran.stderr
    log = tmp_path / "said.txt"
    log.write_text(ran.stdout)
    compared = compare(VECTORS, log)
    assert compared.returncode == 0, compared.stdout[-2000:] + compared.stderr
    assert "bit for bit" in compared.stdout


@only_soak("compiles all of the core once more")
def test_missing_vectors_without_fpu_are_reported_as_a_failure(other_processor, tmp_path):
    target, image = other_processor
    ran = run(image, tmp_path, target)
    assert ran.returncode == 1
    assert "cannot go on: vectors/redundancy.json: there is no such file; start QEMU" in ran.stdout


@pytest.mark.parametrize("file", ["redundancy.json", "spin.json"])
def test_one_bit_of_one_reading_changed_on_the_device_is_found(image, elsewhere, file):
    name = "primary_counts" if file == "redundancy.json" else "counts"
    row = json.loads((VECTORS / file).read_text())["cases"][name][300]
    old = ", ".join(map(str, row))
    new = ", ".join(map(str, [row[0] ^ 1, *row[1:]]))
    changed(elsewhere, file, f"[{old}]", f"[{new}]")
    log = elsewhere / "said.txt"
    log.write_text(run(image, elsewhere).stdout)
    compared = compare(VECTORS, log)
    assert compared.returncode == 1
    assert "Device and host differ, first in line" in compared.stdout
    assert compare(elsewhere / "vectors", log).returncode == 0


def test_one_bit_of_one_result_is_found(said, tmp_path):
    log = tmp_path / "said.txt"
    bits = re.findall(r"#[0-9a-f]{8}", said)[-1]
    other = f"#{int(bits[1:], 16) ^ 1:08x}"
    log.write_text(other.join(said.rsplit(bits, 1)))
    assert compare(VECTORS, log).returncode == 1


def test_a_device_that_stops_early_is_found(said, tmp_path):
    log = tmp_path / "said.txt"
    log.write_text(said[: said.index("spin found")])
    compared = compare(VECTORS, log)
    assert compared.returncode == 1
    assert "says nothing more" in compared.stdout


def test_records_are_saved_before_the_reset_and_restored_after_it(said):
    after(
        said,
        "device: start 1",
        "secondary 1: triggered",
        "secondary 1: motion began",
        "record of accelerometer of 0x7002 saved",
        "record of gyroscope of 0x7002 saved",
        "secondary 2: triggered",
        "record of accelerometer of 0x7003 saved",
        "record of gyroscope of 0x7003 saved",
        "device: resets itself",
        "device: start 2",
        "secondary 1: accelerometer restored, sequence 1",
        "secondary 2: gyroscope restored, sequence 1",
    )
    starts = said.partition("interrupted flight")[0]
    flash = re.findall(r"flash: checksum (\w+), (\d+) pages erased and (\d+) bytes written", starts)
    (first, _, written), (second, *nothing) = flash
    assert first == second
    assert int(written) > 0
    assert nothing == ["0", "0"]


def test_the_record_adopted_is_that_of_the_vectors(said):
    record = after(said, "record of accelerometer of 0x7002")
    found, sigma = (
        np.array(numbers(re.search(rf"{name} (#.*)", record)[1])) for name in (" bias", "bias_sigma")
    )
    allowed = FLOWN["tolerance"]
    assert np.all(sigmas(found, sigma, FLOWN, "accelerometer_b") < allowed["accelerometer_b"]["f32"])
    arm, sigma = (
        np.array(numbers(re.search(rf"{name} (#.*)", record)[1]))
        for name in (" lever_arm", "lever_arm_sigma")
    )
    assert np.all(sigmas(arm, sigma, FLOWN, "lever_arm") < allowed["lever_arm"]["f32"])


def test_secondaries_take_over_in_turn_and_stay_close_to_the_primary(said):
    flown = after(
        said,
        "device: start 2",
        "primary: unhealthy, late: #",
        "secondary 1: is the source: primary failed",
        "secondary 1: unhealthy, late: #",
        "secondary 2: is the source: source failed",
    )
    for unit in (1, 2):
        _, force, rate = after(flown, f"secondary {unit} was the source").split("\n")[:3]
        for said_apart in (force, rate):
            compensated, as_read = numbers(said_apart)
            assert compensated < as_read / 5


def test_a_stall_of_all_and_clocks_that_go_back_name_no_unit(said):
    flown = after(said, "interrupted flight").split("\nspin")[0]
    events = [line for line in flown.splitlines() if "time jumped" in line]
    assert [line.split(" by ")[0].split(": ")[-1] for line in events] == [
        "time jumped on",
        "time jumped back",
    ]
    assert "unhealthy" not in flown
    outputs = int(re.search(r"outputs: (\d+)", after(flown, "time jumped back"))[1])
    assert outputs > 400


def test_the_spin_shows_the_biases_of_the_vectors(said):
    spun = after(said, "spin found")
    for name, quantity in (
        ("gyroscope bias", "gyroscope_bias"),
        ("accelerometer bias", "accelerometer_bias"),
    ):
        found = numbers(re.search(rf"    {name} (#.*)", spun)[1])
        # The vectors' tolerance is for an estimate that includes the rest after the spin.
        assert np.all(sigmas(np.array(found[:3]), np.array(found[3:]), SPUN, quantity) < 2.0), name


def test_the_device_takes_readings_to_the_reference_as_python_does(said):
    lines = after(said, "\ntemperature\n").split("device:")[0].splitlines()
    found = {numbers(at)[0]: numbers(read) for at, read in zip(lines[::2], lines[1::2], strict=True)}
    assert min(found) == -60.0
    assert found[-60.0] == found[-20.0] != found[-15.0]
    assert found[95.0] == found[70.0] != found[65.0]
    drift = {
        "reference": 25.0,
        "range": [-20.0, 70.0],
        "bias": [[1.1e-3, -0.7e-3, 2.3e-3], [-1.3e-5, 0.9e-5, 0.3e-5], [1.7e-7, 0.1e-7, -2.9e-7]],
        "scale": [[1.9e-5, -3.1e-5, 0.7e-5], [2.1e-7, 0.3e-7, -1.1e-7], [-1.3e-9, 2.7e-9, 0.9e-9]],
    }
    reading = np.tile([0.31, -4.7, 8.3], (len(found), 1))
    expected = _core.at_reference(reading, np.array([0.013, -0.021, 0.034]), np.array(list(found)), drift)
    np.testing.assert_allclose(list(found.values()), expected, rtol=0.0, atol=3e-6)


def test_a_device_without_vectors_says_so_and_fails(image, tmp_path):
    ran = run(image, tmp_path)
    assert ran.returncode != 0
    assert "cannot go on: vectors/redundancy.json: there is no such file; start QEMU" in ran.stdout


def test_vectors_that_are_too_long_are_refused(image, elsewhere):
    with (elsewhere / "vectors" / "spin.json").open("a") as file:
        file.write(" " * 256 * 1024)
    ran = run(image, elsewhere)
    assert ran.returncode != 0
    assert "cannot go on: vectors/spin.json: longer than 262144 bytes" in ran.stdout


@pytest.mark.parametrize(
    ("file", "old", "new", "name"),
    [
        ("redundancy.json", '"collect_s"', '"collected"', "collect_s"),
        ("spin.json", '"counts": [', '"counts": [[1, 2], ', "counts"),
    ],
)
def test_broken_vectors_are_refused_by_the_name_of_what_is_broken(image, elsewhere, file, old, new, name):
    changed(elsewhere, file, old, new)
    wrong = f'vectors/{file}: there is no "{name}" as it should be; restore the file'
    ran = run(image, elsewhere)
    assert ran.returncode != 0
    assert f"cannot go on: {wrong}" in ran.stdout
    log = elsewhere / "said.txt"
    log.write_text(ran.stdout)
    replayed = compare(elsewhere / "vectors", log)
    assert replayed.returncode == 2
    assert wrong in replayed.stderr


def test_the_stack_is_measured_in_every_phase(said):
    stack = {
        phase: int(size)
        for size, phase in re.findall(r"device: stack (?:at least )?(\d+) bytes: (\w+)", said)
    }
    for phase in ("Restore", "Push", "Fit", "Save", "SpinPush", "SpinSlice", "SpinSolve"):
        assert 100 < stack[phase] < stack["all"] < 64 * 1024, phase
    assert stack["Push"] < stack["Fit"]


def test_measured_stack_is_the_image_bound_minus_unused_branches(image):
    _, painted, bounds = footprint.memory()
    assert set(bounds) == {"Restore", "Fit", "Save", "SpinPush", "SpinSolve"}
    for phase, bound in bounds.items():
        assert painted[phase] <= bound, phase
        # Only a flash with faults takes the branches of a save that repair entries and pass over dead words.
        if phase != "Save":
            assert bound <= painted[phase] + max(256, painted[phase] / 20), phase
