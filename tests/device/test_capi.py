"""The interface for C: its library as C and C++ programs find it, on this machine and on a Cortex-M4F."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from exchange_units import calibration, samples
from tumble.exchange.procedure import export

ROOT = Path(__file__).parents[2]
CAPI = ROOT / "crates" / "tumble-capi"
HEADER = CAPI / "include" / "tumble.h"
DEVICE = "thumbv7em-none-eabihf"
STRICT = ["-Wall", "-Wextra", "-Werror", "-pedantic", f"-I{HEADER.parent}", "-Wl,--gc-sections"]
SANITIZED = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=undefined"]
CORTEX_M4F = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]
FORBIDDEN = re.compile(
    r"panic|unwind|\b_?(m|c|re)alloc|\b_?free(_r)?\b|sbrk|__rust_|__rg_|handle_alloc", re.IGNORECASE
)
"""Symbols of what no firmware may reach: a panic, or a heap."""

DOUBLE = re.compile(r"\b(__aeabi_(c?d\w+|\w+2d)|__\w*df\w*)\b")
"""Symbols of the emulation of double precision, as Arm and as compilers call them: __aeabi_dmul, __muldf3."""

LANGUAGES = {"c": ["gcc", "-std=c99"], "cpp": ["g++", "-std=c++17"]}


def run(command: Sequence[str | Path], **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a command from the root of the repository; it may fail."""
    words = [str(word) for word in command]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, env={**os.environ, **environment})


def done(command: Sequence[str | Path], **environment: str) -> str:
    """Run a command that has to succeed; gives what it printed."""
    answer = run(command, **environment)
    assert answer.returncode == 0, f"{' '.join(map(str, command))}\n{answer.stdout}{answer.stderr}"
    return answer.stdout


@pytest.fixture(scope="module", autouse=True)
def tools() -> None:
    """Install the compilers and checkers that are missing."""
    done(["scripts/install_device_tools.sh"])


def library(folder: Path, *features: str, device: bool = False, units: int = 3) -> Path:
    """Build the static library, and put it into `folder`."""
    cargo = ["scripts/cargo_for_device.sh"] if device else ["cargo"]
    options = ["--locked", "--package", "tumble-capi", "--crate-type", "staticlib", "--profile", "device"]
    # Said even where it is the default, as packages do: to cargo said and not said are two libraries.
    named = {"TUMBLE_UNITS": str(units)}
    done([*cargo, "rustc", *options, "--features", ",".join(["freestanding", *features])], **named)
    target = ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / (DEVICE if device else "") / "device"
    return Path(shutil.copy(target / "libtumble_capi.a", folder))


@pytest.fixture(scope="module")
def host_library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return library(tmp_path_factory.mktemp("host"))


@pytest.fixture(scope="module")
def device_library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return library(tmp_path_factory.mktemp("device"), device=True)


def laws(language: str, archive: Path, *options: str) -> Path:
    """Build the test program of a language beside the library."""
    sources = sorted((CAPI / "tests" / language).glob(f"*.{language}"))
    program = archive.parent / f"laws_{language}{len(options)}"
    done([*LANGUAGES[language], *STRICT, *options, *sources, archive, "-lcjson", "-lm", "-o", program])
    return program


@pytest.mark.parametrize("language", LANGUAGES)
def test_programs_agree_with_the_vectors_under_the_address_sanitizer(
    language: str, host_library: Path
) -> None:
    printed = done([laws(language, host_library, *SANITIZED), "vectors"])
    assert "holds:" in printed
    assert "BROKEN" not in printed


@pytest.mark.parametrize("language", LANGUAGES)
def test_programs_touch_no_memory_but_their_own(language: str, host_library: Path) -> None:
    program = laws(language, host_library, "-g")
    done(["valgrind", "--quiet", "--leak-check=full", "--error-exitcode=9", program, "vectors"])


def test_a_library_for_another_number_of_units_keeps_the_same_laws(tmp_path: Path, many_units: int) -> None:
    archive = library(tmp_path, units=many_units)
    done([laws("c", archive, *SANITIZED, f"-DTUMBLE_UNITS={many_units}"), "vectors"])


PAGE = ROOT / "docs/how-to/c.md"


def example_under(heading: str) -> str:
    """The one piece of C under a heading of the how-to."""
    section = PAGE.read_text().split(f"## {heading}")[1].split("\n## ")[0]
    (example,) = re.findall(r"^```c\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
    return str(example)


@pytest.mark.parametrize("heading", ["A spin", "A redundant set"])
@pytest.mark.parametrize("language", LANGUAGES)
def test_an_example_of_the_how_to_compiles(heading: str, language: str, tmp_path: Path) -> None:
    source = tmp_path / f"example.{language}"
    source.write_text(example_under(heading))
    done([*LANGUAGES[language], *STRICT, "-c", source, "-o", tmp_path / "example.o"])


CORRECTING = """
#include <stdio.h>
#include "unit.h"

int main(void) {
    tumble_correction correction;
    tumble_sample reading = {0}, truth;
    float temperature;
    if (tumble_correction_init(&correction, &unit) != TUMBLE_OK) return 1;
    float *f = reading.specific_force, *w = reading.angular_rate;
    while (scanf("%f %f %f %f %f %f %f", &f[0], &f[1], &f[2], &w[0], &w[1], &w[2], &temperature) == 7) {
        if (tumble_temperature_drift_remove(&unit_accelerometer_drift, unit.accelerometer.bias,
                                            temperature, f, f)) return 2;
        if (tumble_temperature_drift_remove(&unit_gyroscope_drift, unit.gyroscope.bias,
                                            temperature, w, w)) return 3;
        if (tumble_correction_apply(&correction, &reading, &truth) != TUMBLE_OK) return 4;
        for (int i = 0; i < 6; i++)
            printf("%.9g ", (double)(i < 3 ? truth.specific_force[i] : truth.angular_rate[i - 3]));
    }
    return 0;
}
"""


def test_a_program_with_an_exported_calibration_corrects_as_python_does(
    host_library: Path, tmp_path: Path
) -> None:
    unit = calibration(4, parts=("scale", "non-orthogonality", "mounting"), over_temperature=True)
    (tmp_path / "unit.h").write_bytes(export(unit, "c", {"name": "unit"}).content)
    (tmp_path / "program.c").write_text(CORRECTING)
    program = tmp_path / "program"
    done([*LANGUAGES["c"], *STRICT, *SANITIZED, tmp_path / "program.c", host_library, "-lm", "-o", program])
    force, rate = samples(4)
    temperature = np.linspace(-30.0, 80.0, len(force))
    lines = [" ".join(map(str, row)) for row in np.column_stack([force, rate, temperature])]
    answer = subprocess.run([program], input="\n".join(lines), capture_output=True, text=True, check=True)
    theirs = np.array(answer.stdout.split(), dtype=float).reshape(-1, 6)
    ours = np.column_stack(unit.correct(force, rate, temperature))
    # Single precision of readings of 30 m/s^2.
    assert np.abs(theirs - ours).max() < 2e-5


RECORDS = """
#include <stdio.h>
#include "tumble.h"
#include "records.h"

static int say(const uint8_t *bytes, size_t length) {
    tumble_record record;
    if (tumble_record_decode(bytes, length, &record) != TUMBLE_OK) return 1;
    printf("%llu %d", (unsigned long long)record.identity, (int)record.sensor);
    for (int i = 0; i < 9; i++) printf(" %.9g", (double)record.matrix[i / 3][i % 3]);
    for (int i = 0; i < 3; i++) printf(" %.9g", (double)record.bias[i]);
    putchar(10);
    return 0;
}

int main(void) {
    return say(unit_accelerometer, sizeof unit_accelerometer) || say(unit_gyroscope, sizeof unit_gyroscope);
}
"""


def test_a_program_reads_exported_records_as_python_wrote_them(host_library: Path, tmp_path: Path) -> None:
    unit = calibration(5, parts=("scale", "non-orthogonality", "mounting"))
    exported = export(unit, "record-c", {"name": "unit", "identity": "77"})
    (tmp_path / "records.h").write_bytes(exported.content)
    (tmp_path / "program.c").write_text(RECORDS)
    program = tmp_path / "program"
    done([*LANGUAGES["c"], *STRICT, *SANITIZED, tmp_path / "program.c", host_library, "-lm", "-o", program])
    found = np.array(done([program]).split(), dtype=float).reshape(2, -1)
    assert found[:, :2].tolist() == [[77.0, 0.0], [77.0, 1.0]]
    for row, section in zip(found[:, 2:], (unit.accelerometer, unit.gyroscope), strict=True):
        assert np.array_equal(np.float32(row), np.float32([*section.M.ravel(), *section.b]))


def test_a_program_with_a_wrong_expectation_fails(host_library: Path, tmp_path: Path) -> None:
    """The laws themselves are tried: vectors that say otherwise break them."""
    for vectors in (ROOT / "vectors").glob("*.json"):
        (tmp_path / vectors.name).write_text(vectors.read_text())
    path = tmp_path / "model.json"
    path.write_text(re.sub(r'"corrected": \[\s*(-?)\d', r'"corrected": [\g<1>77', path.read_text()))
    answer = run([laws("c", host_library, *SANITIZED), tmp_path])
    assert answer.returncode == 1
    assert "BROKEN: the error model agrees with its vectors" in answer.stdout


def test_the_example_of_the_page_keeps_what_it_found_over_a_reset(host_library: Path, tmp_path: Path) -> None:
    """It is flown, and its flash fails at first."""
    (tmp_path / "example.c").write_text(example_under("A redundant set"))
    tests = CAPI / "tests"
    sources = [tests / "example" / "flight.c", tests / "c" / "ram_flash.c", tmp_path / "example.c"]
    options = [*STRICT, *SANITIZED, f"-I{tests / 'c'}"]
    program = tmp_path / "flight"
    done([*LANGUAGES["c"], *options, *sources, host_library, "-lm", "-o", program])
    assert done([program]) == "0 checks failed\n"


def image(archive: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Link a C program that makes every call for a Cortex-M4F."""
    source = CAPI / "tests" / "device" / "every_call.c"
    link = ["-Os", "-nostartfiles", "--specs=nosys.specs", "-Wl,-e,main", "-Wl,-z,noexecstack"]
    compile_ = ["arm-none-eabi-gcc", "-std=c99", *CORTEX_M4F, *STRICT, *link, *options]
    return run([*compile_, source, archive, "-o", archive.parent / "image.elf"])


def symbols(program: Path) -> list[str]:
    return [line.split(maxsplit=2)[-1] for line in done(["arm-none-eabi-nm", "-C", program]).splitlines()]


def test_a_cortex_m_image_reaches_neither_panic_nor_heap(device_library: Path) -> None:
    linked = image(device_library)
    assert linked.returncode == 0, linked.stderr
    found = symbols(device_library.parent / "image.elf")
    assert [name for name in found if FORBIDDEN.search(name)] == []
    declared = set(
        re.findall(r"^(?:tumble_status|const char \*) ?(tumble_\w+)\(", HEADER.read_text(), re.MULTILINE)
    )
    assert len(declared) > 30
    assert declared <= set(found), declared - set(found)


def test_an_image_that_reaches_a_panic_does_not_link(tmp_path: Path) -> None:
    linked = image(library(tmp_path, "reach-a-panic", device=True))
    assert linked.returncode != 0
    assert "tumble_panic_is_reachable" in linked.stderr


def test_an_image_that_reaches_the_heap_is_found_out(device_library: Path) -> None:
    linked = image(device_library, "-DREACH_THE_HEAP")
    assert linked.returncode == 0, linked.stderr
    assert any(FORBIDDEN.search(name) for name in symbols(device_library.parent / "image.elf"))


def test_a_cortex_m_image_emulates_no_double_precision(device_library: Path) -> None:
    linked = image(device_library)
    assert linked.returncode == 0, linked.stderr
    found = symbols(device_library.parent / "image.elf")
    assert "tumble_redundancy_push" in found
    assert [name for name in found if DOUBLE.search(name)] == []


def test_an_image_that_emulates_double_precision_is_found_out(device_library: Path) -> None:
    linked = image(device_library, "-DREACH_DOUBLE_PRECISION")
    assert linked.returncode == 0, linked.stderr
    found = symbols(device_library.parent / "image.elf")
    assert any(name == "__aeabi_dmul" and DOUBLE.search(name) for name in found)
