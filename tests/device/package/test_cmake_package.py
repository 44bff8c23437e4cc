"""A CMake project takes Tumble in installed or from sources, for this machine and for a Cortex-M4F."""

from __future__ import annotations

import re

import pytest

from package.packages import (
    CRATE,
    HERE,
    MANY_UNITS,
    ROOT,
    TARGETS,
    WITHOUT_SETS,
    build,
    configuring,
    run,
    try_to_run,
)
from repetitions import only_soak

EXAMPLE = ROOT / "examples" / "c"


def test_an_installed_package_is_found_and_linked(tmp_path):
    build(CRATE, tmp_path / "tumble")
    run("cmake", "--install", tmp_path / "tumble", "--prefix", tmp_path / "installed")
    build(HERE / "consumer", tmp_path / "consumer", CMAKE_PREFIX_PATH=tmp_path / "installed")
    assert run(tmp_path / "consumer" / "consumer") == "3 units: it was done\n"


def test_an_installed_package_may_be_moved(tmp_path):
    build(CRATE, tmp_path / "tumble")
    run("cmake", "--install", tmp_path / "tumble", "--prefix", tmp_path / "installed")
    (tmp_path / "installed").rename(tmp_path / "moved")
    build(HERE / "consumer", tmp_path / "consumer", CMAKE_PREFIX_PATH=tmp_path / "moved")
    assert run(tmp_path / "consumer" / "consumer") == "3 units: it was done\n"


@only_soak("builds nearly all of it once more")
def test_a_folder_of_sources_is_built_for_as_many_units_as_asked(tmp_path):
    build(HERE / "consumer", tmp_path, TUMBLE_SOURCE=CRATE, TUMBLE_UNITS=MANY_UNITS)
    assert run(tmp_path / "consumer") == f"{MANY_UNITS} units: it was done\n"


def test_parts_are_left_out_of_an_installed_package_and_of_sources(tmp_path, noted_cargo):
    cargo = noted_cargo(3)
    left_out = {"TUMBLE_SPIN": "OFF", "TUMBLE_REDUNDANCY": "OFF"}
    left_out |= {"TUMBLE_CARGO": cargo.program, "TUMBLE_CARGO_FOLDER": cargo.folder}
    build(CRATE, tmp_path / "tumble", **left_out)
    run("cmake", "--install", tmp_path / "tumble", "--prefix", tmp_path / "installed")
    build(HERE / "consumer", tmp_path / "consumer", CMAKE_PREFIX_PATH=tmp_path / "installed")
    assert run(tmp_path / "consumer" / "consumer") == WITHOUT_SETS
    said = (tmp_path / "installed" / "lib" / "pkgconfig" / "tumble.pc").read_text()
    assert "-DTUMBLE_UNITS=3 -DTUMBLE_WITHOUT_SPIN -DTUMBLE_WITHOUT_REDUNDANCY\n" in said
    build(HERE / "consumer", tmp_path / "sources", TUMBLE_SOURCE=CRATE, **left_out)
    assert run(tmp_path / "sources" / "consumer") == WITHOUT_SETS
    assert cargo.was_asked_for(3, "spin", "redundancy")


@pytest.mark.parametrize("units", ["1", "9", "many"])
def test_a_number_of_units_that_cannot_be_is_refused_in_one_line(tmp_path, units):
    refused = try_to_run(*configuring(CRATE, tmp_path, TUMBLE_UNITS=units))
    assert refused.returncode != 0
    assert f"TUMBLE_UNITS is {units}; it is 2 to 8" in refused.stderr


@pytest.mark.parametrize(("processor", "hard", "target"), TARGETS)
def test_the_target_follows_from_processor_and_floats(tmp_path, processor, hard, target):
    # Not every compiler knows every processor; it is the system's that is asked for.
    flags = f"-mcpu=cortex-m7 -mthumb -mfloat-abi={'hard' if hard else 'softfp'}"
    run(*configuring(CRATE, tmp_path, **for_processor(processor), CMAKE_C_FLAGS=flags))
    cache = (tmp_path / "CMakeCache.txt").read_text()
    assert f"TUMBLE_RUST_TARGET:STRING={target}\n" in cache


def test_floats_are_found_where_a_project_sets_flags_for_all_folders(tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.21)\nproject(firmware LANGUAGES C)\n"
        f"add_compile_options(-mcpu=cortex-m7 -mfloat-abi=hard)\nadd_subdirectory({CRATE} tumble)\n"
    )
    run(*configuring(tmp_path, tmp_path / "build", **for_processor("cortex-m7")))
    cache = (tmp_path / "build" / "CMakeCache.txt").read_text()
    assert "TUMBLE_RUST_TARGET:STRING=thumbv7em-none-eabihf\n" in cache


def test_an_unknown_processor_is_refused_with_a_remedy(tmp_path):
    refused = try_to_run(*configuring(CRATE, tmp_path, **for_processor("arm")))
    assert refused.returncode != 0
    assert "TUMBLE_RUST_TARGET" in refused.stderr


def for_processor(processor):
    """Options in place of a toolchain file."""
    return {
        "CMAKE_SYSTEM_NAME": "Generic",
        "CMAKE_SYSTEM_PROCESSOR": processor,
        "CMAKE_C_COMPILER": "arm-none-eabi-gcc",
        "CMAKE_TRY_COMPILE_TARGET_TYPE": "STATIC_LIBRARY",
    }


def test_spin_on_a_bare_cortex_m4f_finds_the_bias_and_flash_keeps_it(tmp_path, cortex_m):
    build(EXAMPLE, tmp_path, CMAKE_TOOLCHAIN_FILE=EXAMPLE / "cortex-m4.cmake", TUMBLE_CARGO=cortex_m)
    said = run(ROOT / "scripts" / "run_in_qemu.sh", tmp_path / "spin.elf")
    thousandths = [[int(word) for word in re.findall(r" (-?\d+)", line)] for line in said.splitlines()]
    force, true_force, rate, true_rate, reading, corrected = (line[-3:] for line in thousandths[1:])
    assert true_force == [150, -80, 200]
    assert true_rate == [10, -20, 5]
    # Six times the noise of 0.02 m/s^2 or 0.001 rad/s, over the root of 500 samples at rest.
    assert force == pytest.approx(true_force, abs=6)
    assert rate == pytest.approx(true_rate, abs=1)
    assert [said - bias for said, bias in zip(reading, force, strict=True)] == pytest.approx(corrected, abs=1)
