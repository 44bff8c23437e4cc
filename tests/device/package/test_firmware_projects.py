"""Zephyr, ESP-IDF and PlatformIO find what they look for in the manifests, and link the library."""

from __future__ import annotations

import json
import os

import pytest
import yaml

from package.packages import (
    CRATE,
    HERE,
    MANY_UNITS,
    OF_A_SET,
    PARTS,
    TARGETS,
    WITHOUT_SETS,
    build,
    cargo_folder,
    configuring,
    run,
    try_to_run,
)
from repetitions import only_soak

# Keys that Zephyr's scripts/zephyr_module.py (commit 013c1350) allows in a module with its own
# CMakeLists.txt and Kconfig.
MODULE_KEYS = {"name", "build", "tests", "samples", "boards", "blobs"}
BUILD_KEYS = {"cmake", "kconfig", "depends", "settings"}

READ_KCONFIG = """
import json, sys, kconfiglib
kconfig = kconfiglib.Kconfig(sys.argv[1], warn_to_stderr=False)
for assignment in sys.argv[2:]:
    name, _, value = assignment.partition("=")
    assert kconfig.syms[name].set_value(value), assignment
symbols = {name: found.str_value for name, found in kconfig.syms.items()}
print(json.dumps({name: value for name, value in symbols.items() if name.startswith("TUMBLE")}))
"""

# Only the list of licences, which would be fetched, is left out.
READ_MANIFEST = """
import json, sys
from platformio.package.manifest.parser import ManifestParserFactory
from platformio.package.manifest.schema import ManifestSchema
manifest = ManifestParserFactory.new_from_file(sys.argv[1]).as_dict()
del manifest["license"]
ManifestSchema().load_manifest(manifest)
"""


def test_zephyr_finds_cmake_and_kconfig_where_the_module_says():
    module = yaml.safe_load((CRATE / "zephyr" / "module.yml").read_text())
    assert set(module) <= MODULE_KEYS
    assert set(module["build"]) <= BUILD_KEYS
    assert (CRATE / module["build"]["cmake"] / "CMakeLists.txt").is_file()
    assert (CRATE / module["build"]["kconfig"]).is_file()


# Symbols of a processor in Zephyr's Kconfig, and the target; it has no name for a Cortex-M35P.
SYMBOLS = [
    (["CPU_" + processor.upper().replace("-", "_")] + ["FP_HARDABI"] * hard, target)
    for processor, hard, target in TARGETS
    if processor != "cortex-m35p"
]
UNKNOWN = [([], ""), (["CPU_CORTEX_M23"], "")]


@pytest.mark.parametrize(("symbols", "target"), [*SYMBOLS, *UNKNOWN])
def test_kconfig_knows_the_target_of_a_processor(tmp_path, python, symbols, target):
    top = tmp_path / "Kconfig"
    zephyrs = "".join(f"config {symbol}\n\tdef_bool y\n" for symbol in symbols)
    top.write_text(f'{zephyrs}source "{CRATE}/zephyr/Kconfig"\n')
    configured = json.loads(run(python, "-c", READ_KCONFIG, top, "TUMBLE=y"))
    parts = dict.fromkeys((f"TUMBLE_{part}" for part in PARTS), "y")
    assert configured == {"TUMBLE": "y", "TUMBLE_UNITS": "3", "TUMBLE_RUST_TARGET": target, **parts}


def test_kconfig_keeps_units_in_their_range(python):
    configured = json.loads(
        run(python, "-c", READ_KCONFIG, CRATE / "zephyr" / "Kconfig", "TUMBLE=y", "TUMBLE_UNITS=9")
    )
    assert 2 <= int(configured["TUMBLE_UNITS"]) <= 8


@pytest.mark.parametrize("part", PARTS)
def test_kconfig_may_leave_a_part_out(python, part):
    configured = json.loads(
        run(python, "-c", READ_KCONFIG, CRATE / "zephyr" / "Kconfig", "TUMBLE=y", f"TUMBLE_{part}=n")
    )
    left_out = {part, *(OF_A_SET if part == "REDUNDANCY" else ())}
    found = {name for name, value in configured.items() if value == "n"}
    assert found == {f"TUMBLE_{name}" for name in left_out}


NATIVE = {"CONFIG_ARCH_POSIX": "y", "CONFIG_64BIT": "y"}


def application_of_zephyr(**configuration):
    """Settings from Zephyr's Kconfig where it knows no target of the processor."""
    return {
        "MODULE": CRATE, "BOARD": "nowhere", "CONFIG_TUMBLE": "y", "CONFIG_TUMBLE_UNITS": "3",
        "CONFIG_TUMBLE_RUST_TARGET": "", **dict.fromkeys((f"CONFIG_TUMBLE_{part}" for part in PARTS), "y"),
        **configuration,
    }  # fmt: skip


def test_an_application_of_zephyr_links_the_module(tmp_path):
    build(HERE / "zephyr", tmp_path, **application_of_zephyr(**NATIVE))
    assert run(tmp_path / "consumer") == "3 units: it was done\n"


@only_soak("builds nearly all of it for more units, of which cargo is told by the test below")
def test_a_zephyr_application_links_a_module_of_many_units(tmp_path):
    build(HERE / "zephyr", tmp_path, **application_of_zephyr(**NATIVE, CONFIG_TUMBLE_UNITS=MANY_UNITS))
    assert run(tmp_path / "consumer") == f"{MANY_UNITS} units: it was done\n"


def test_zephyr_application_links_what_kconfig_left_of_the_module(tmp_path, noted_cargo):
    cargo = noted_cargo(MANY_UNITS)
    left_out = {"CONFIG_TUMBLE_SPIN": "", "CONFIG_TUMBLE_REDUNDANCY": "", "CONFIG_TUMBLE_UNITS": MANY_UNITS}
    left_out |= {"TUMBLE_CARGO": cargo.program, "TUMBLE_CARGO_FOLDER": cargo.folder}
    build(HERE / "zephyr", tmp_path, **application_of_zephyr(**NATIVE, **left_out))
    assert run(tmp_path / "consumer") == WITHOUT_SETS
    assert cargo.was_asked_for(MANY_UNITS, "spin", "redundancy")


@pytest.mark.parametrize("configuration", [{}, {"CONFIG_ARCH_POSIX": "y"}, {"CONFIG_64BIT": "y"}])
def test_unknown_processor_in_zephyr_is_refused_with_a_remedy(tmp_path, configuration):
    options = application_of_zephyr(**configuration)
    refused = try_to_run(*configuring(HERE / "zephyr", tmp_path, **options))
    assert refused.returncode != 0
    said = " ".join(refused.stderr.split())
    assert 'board "nowhere"; set CONFIG_TUMBLE_RUST_TARGET in prj.conf' in said


ESP_IDF = CRATE / "esp-idf" / "tumble"

# The chip's own symbol of ESP-IDF; those of Xtensa have no target.
CHIPS = [
    ("ESP32C3", "riscv32imc-unknown-none-elf"),
    ("ESP32C6", "riscv32imac-unknown-none-elf"),
    ("ESP32P4", "riscv32imafc-unknown-none-elf"),
    ("ESP32S3", ""),
]

READ_WITH_ESP_IDF = """
import json, sys
import esp_kconfiglib
from idf_component_tools.manager import ManifestManager
kconfig = esp_kconfiglib.Kconfig(sys.argv[1])
print(json.dumps(kconfig.syms["TUMBLE_RUST_TARGET"].str_value))
ManifestManager(sys.argv[2], "tumble").load()
"""


def project_for(chip, folder):
    """Kconfig of a project for a chip."""
    top = folder / "Kconfig"
    top.write_text(f'config IDF_TARGET_{chip}\n\tbool\n\tdefault y\n\nsource "{ESP_IDF}/Kconfig"\n')
    return top


@pytest.mark.parametrize(("chip", "target"), CHIPS)
def test_kconfig_of_esp_idf_knows_the_target_of_a_chip(tmp_path, python, chip, target):
    configured = json.loads(run(python, "-c", READ_KCONFIG, project_for(chip, tmp_path)))
    parts = dict.fromkeys((f"TUMBLE_{part}" for part in PARTS), "y")
    assert configured == {"TUMBLE_UNITS": "3", "TUMBLE_RUST_TARGET": target, **parts}


@only_soak("installs packages of ESP-IDF")
def test_esp_idfs_own_tools_read_configuration_and_manifest(tmp_path, python_of_esp_idf):
    said = run(python_of_esp_idf, "-c", READ_WITH_ESP_IDF, project_for("ESP32C3", tmp_path), ESP_IDF)
    assert json.loads(said.splitlines()[-1]) == "riscv32imc-unknown-none-elf"


def test_component_of_esp_idf_has_the_version_of_the_workspace():
    manifest = yaml.safe_load((ESP_IDF / "idf_component.yml").read_text())
    workspace = (CRATE / ".." / ".." / "Cargo.toml").read_text()
    assert f'\nversion = "{manifest["version"]}"\n' in workspace


def esp_idf(folder, chip, **configuration):
    """Configures a project with a stand-in of ESP-IDF, whose folder IDF_PATH names."""
    options = {
        key: value
        for key, value in application_of_zephyr(IDF_TARGET=chip, **configuration).items()
        if key != "MODULE"
    }
    command = configuring(HERE / "esp_idf" / "project", folder, **options)
    return try_to_run(*command, IDF_PATH=str(HERE / "esp_idf" / "stand_in"))


def test_a_project_of_esp_idf_links_what_kconfig_left(tmp_path, noted_cargo):
    cargo = noted_cargo(3)
    left_out = {"CONFIG_TUMBLE_SPIN": "", "CONFIG_TUMBLE_REDUNDANCY": ""}
    left_out |= {"TUMBLE_CARGO": cargo.program, "TUMBLE_CARGO_FOLDER": cargo.folder}
    configured = esp_idf(tmp_path, "linux", **left_out)
    assert configured.returncode == 0, configured.stderr
    run("cmake", "--build", tmp_path)
    assert run(tmp_path / "main" / "main") == WITHOUT_SETS
    assert cargo.was_asked_for(3, "spin", "redundancy")


def test_esp_idf_chip_without_a_target_is_refused_with_a_remedy(tmp_path):
    refused = esp_idf(tmp_path, "esp32s3")
    assert refused.returncode != 0
    said = " ".join(refused.stderr.split())
    assert 'for "esp32s3"; set CONFIG_TUMBLE_RUST_TARGET in sdkconfig' in said


def test_platformio_takes_the_manifest_for_valid(python):
    run(python, "-c", READ_MANIFEST, CRATE / "library.json")
    manifest = json.loads((CRATE / "library.json").read_text())
    headers = manifest["headers"]
    assert all((CRATE / manifest["build"]["includeDir"] / header).is_file() for header in headers)
    assert "tumble.h" in headers
    workspace = (CRATE / ".." / ".." / "Cargo.toml").read_text()
    assert f'\nversion = "{manifest["version"]}"\n' in workspace


def scons(python, folder, options, platform="native", flags="", path=os.environ["PATH"]):
    """Builds the consumer as PlatformIO would."""
    return try_to_run(
        python, "-m", "SCons", "-f", HERE / "SConstruct", f"LIBRARY={CRATE}", f"FOLDER={folder}",
        f"SOURCE={HERE / 'consumer' / 'main.c'}", f"OPTIONS={json.dumps(options)}", f"PLATFORM={platform}",
        f"FLAGS={flags}", folder=folder, PATH=path,
    )  # fmt: skip


def test_a_project_of_platformio_links_what_the_script_builds(tmp_path, python):
    (tmp_path / "cargo").symlink_to(cargo_folder())
    built = scons(python, tmp_path, {})
    assert built.returncode == 0, built.stdout + built.stderr
    assert run(tmp_path / "consumer") == "3 units: it was done\n"


@only_soak("builds nearly all of it for more units, of which cargo is told by the test below")
def test_a_project_of_platformio_links_a_library_of_many_units(tmp_path, python):
    (tmp_path / "cargo").symlink_to(cargo_folder(MANY_UNITS))
    built = scons(python, tmp_path, {"custom_tumble_units": str(MANY_UNITS)})
    assert built.returncode == 0, built.stdout + built.stderr
    assert run(tmp_path / "consumer") == f"{MANY_UNITS} units: it was done\n"


def test_a_project_of_platformio_links_the_parts_that_it_wants(tmp_path, python, noted_cargo):
    cargo = noted_cargo(MANY_UNITS)
    (tmp_path / "cargo").symlink_to(cargo.folder)
    options = {"custom_tumble_without": "spin redundancy", "custom_tumble_units": str(MANY_UNITS)}
    path = f"{cargo.program.parent}{os.pathsep}{os.environ['PATH']}"
    built = scons(python, tmp_path, options, path=path)
    assert built.returncode == 0, built.stdout + built.stderr
    assert run(tmp_path / "consumer") == WITHOUT_SETS
    assert cargo.was_asked_for(MANY_UNITS, "spin", "redundancy")


def test_platformio_project_that_excludes_an_unknown_part_is_warned(tmp_path, python):
    refused = scons(python, tmp_path, {"custom_tumble_without": "spinning"})
    assert refused.returncode != 0
    assert "tumble: custom_tumble_without names spinning; parts are spin, redundancy," in refused.stdout


def test_a_project_of_platformio_may_bring_a_prebuilt_library(tmp_path, python, host_library):
    built = scons(python, tmp_path, {"custom_tumble_library": str(host_library)})
    assert built.returncode == 0, built.stdout + built.stderr
    assert not (tmp_path / "cargo").exists()
    assert run(tmp_path / "consumer") == "3 units: it was done\n"


def test_platformio_project_with_too_many_units_is_refused(tmp_path, python):
    refused = scons(python, tmp_path, {"custom_tumble_units": "9"})
    assert refused.returncode != 0
    assert "tumble: custom_tumble_units is 9; it is 2 to 8" in refused.stdout


@pytest.mark.parametrize("flags", ["", "-march=rv32imc", "-mcpu=cortex-m23"])
def test_unknown_platformio_board_is_refused_with_a_remedy(tmp_path, python, flags):
    refused = scons(python, tmp_path, {"board": "a-board"}, platform="a-platform", flags=flags)
    assert refused.returncode != 0
    assert "tumble: no Rust target is known for a-board; set custom_tumble_target" in refused.stdout
    assert not (tmp_path / "cargo").exists()


@pytest.mark.parametrize(("processor", "hard", "target"), TARGETS)
def test_platformio_builds_for_the_processor_of_the_flags(tmp_path, python, processor, hard, target):
    """Cargo is one that only prints its arguments."""
    cargo = tmp_path / "bin" / "cargo"
    cargo.parent.mkdir()
    cargo.write_text('#!/bin/sh\necho "cargo $*"\nexit 1\n')
    cargo.chmod(0o755)
    flags = f"-mcpu={processor} -mthumb" + " -mfloat-abi=hard" * hard
    path = f"{cargo.parent}{os.pathsep}{os.environ['PATH']}"
    said = scons(python, tmp_path, {}, platform="a-platform", flags=flags, path=path).stdout
    assert said.count("cargo rustc ") == 1
    assert f" --target {target}\n" in said
    assert "tumble: cargo could not build the library" in said
