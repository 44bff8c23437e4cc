"""The interface for C: its library as C and C++ programs find it, on this machine and on a Cortex-M4F."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from benchmarks import c_library

from exchange_units import calibration, samples
from package.packages import MANY_UNITS, cargo_folder
from repetitions import only_soak
from tumble.calibration.document import Calibration, TriadCalibration
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.parameters import all_powers, c_float
from turntable_sessions import typed

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

SLOW = only_soak("builds nearly all of it once more")

LANGUAGES = {"c": ["gcc", "-std=c99"], "cpp": ["g++", "-std=c++17"]}


def run(command: Sequence[str | Path], **environment: str) -> subprocess.CompletedProcess[str]:
    """Runs a command from the root of the repository; it may fail."""
    words = [str(word) for word in command]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, env={**os.environ, **environment})


def done(command: Sequence[str | Path], **environment: str) -> str:
    """Runs a command that has to succeed; gives what it printed."""
    answer = run(command, **environment)
    assert answer.returncode == 0, f"{' '.join(map(str, command))}\n{answer.stdout}{answer.stderr}"
    return answer.stdout


@pytest.fixture(scope="module", autouse=True)
def tools() -> None:
    """Installs the compilers and checkers that are missing."""
    done(["scripts/install_test_tools.sh"])


PARTS = ("spin", "redundancy", "records", "temperature", "magnetometer")
OF_A_SET = ("calibration", "aiding", "settings_check")
"""Parts of a redundant set."""


def library(
    folder: Path, *features: str, device: bool = False, units: int = 3, left_out: Sequence[str] = ()
) -> Path:
    """Builds the static library, all of it or without some of its parts, and puts it into `folder`."""
    cargo = ["scripts/cargo_for_device.sh"] if device else ["cargo"]
    options = ["--locked", "--package", "tumble-capi", "--crate-type", "staticlib", "--profile", "device"]
    # Given even where it is the default, as packages do: to cargo given and not given are two libraries.
    named = {"TUMBLE_UNITS": str(units), "CARGO_TARGET_DIR": str(cargo_folder(units))}
    wanted = [part for part in (*PARTS, *OF_A_SET) if part not in left_out]
    # To cargo all parts named are another library than all by default, as the packages build it.
    parts = ["--no-default-features", "--features", ",".join(wanted)] if left_out else []
    done([*cargo, "rustc", *options, *parts, "--features", ",".join(["freestanding", *features])], **named)
    built = cargo_folder(units) / (DEVICE if device else "") / "device" / "libtumble_capi.a"
    return Path(shutil.copy(built, folder))


@pytest.fixture(scope="module")
def host_library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return library(tmp_path_factory.mktemp("host"))


@pytest.fixture(scope="module")
def device_library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return library(tmp_path_factory.mktemp("device"), device=True)


def laws(language: str, archive: Path, *options: str) -> Path:
    """Builds the test program of a language beside the library."""
    sources = sorted((CAPI / "tests" / language).glob(f"*.{language}"))
    program = archive.parent / f"laws_{language}{len(options)}"
    if program.is_file():
        return program
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


@SLOW
def test_a_library_for_another_number_of_units_keeps_the_same_laws(tmp_path: Path) -> None:
    archive = library(tmp_path, units=MANY_UNITS)
    done([laws("c", archive, *SANITIZED, f"-DTUMBLE_UNITS={MANY_UNITS}"), "vectors"])


PAGE = ROOT / "docs/how-to/c.md"
QUICK_START = ROOT / "docs/getting-started/firmware-in-c.md"
BARE = ROOT / "examples" / "c"


def example_under(heading: str, page: Path = PAGE) -> str:
    """The one piece of C under a heading of a page."""
    section = page.read_text().split(f"## {heading}")[1].split("\n## ")[0]
    (example,) = re.findall(r"^```c\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
    return str(example)


@pytest.mark.parametrize("heading", ["A spin", "A redundant set"])
@pytest.mark.parametrize("language", LANGUAGES)
def test_an_example_of_the_how_to_compiles(heading: str, language: str, tmp_path: Path) -> None:
    source = tmp_path / f"example.{language}"
    source.write_text(example_under(heading))
    done([*LANGUAGES[language], *STRICT, "-c", source, "-o", tmp_path / "example.o"])


Exported = tuple[Path, Calibration, FloatArray]
"""Folder, calibration, and rows of specific force, m/s^2, angular rate, rad/s, and temperature, degC."""


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Exported:
    """A folder with a calibration as `tumble export` writes it for firmware, that, and readings."""
    folder = tmp_path_factory.mktemp("exported")
    drawn = calibration(4, parts=("scale", "non-orthogonality", "mounting"), over_temperature=True)
    content = drawn.content()
    for triad in TRIADS:
        content[triad]["temperature_drift"]["scale"] = [[3e-4, -2e-4, 1e-4], [2e-6, 1e-6, -3e-6]]
    unit = Calibration.model_validate(content)
    unit.save(folder / "target.yaml")
    exports = {"unit.h": ("c", "name=unit"), "records.h": ("record-c", "name=record"), "records": ("record",)}
    for name, (to, *settings) in exports.items():
        given = [*settings, *(["identity=77"] if "record" in to else [])]
        options = [word for setting in given for word in ("--set", setting)]
        answer = typed("export", folder / "target.yaml", "--format", to, *options, "-o", folder / name)
        assert answer.code == 0, answer.err
    force, rate = samples(4)
    readings = np.float32(np.column_stack([force, rate, np.linspace(-30.0, 80.0, len(force))]))
    rows = ",\n".join(f"    {{{', '.join(map(c_float, row))}}}" for row in readings)
    (folder / "readings.h").write_text(f"static const float readings[][7] = {{\n{rows}\n}};\n")
    return folder, unit, readings


def corrected_in_single(
    section: TriadCalibration, reading: FloatArray, temperature: FloatArray
) -> FloatArray:
    """Readings freed of the errors of a triad (docs/theory: model, eq. 1; thermal, eq. 1 and 2), in f32."""
    drift = section.temperature_drift
    assert drift is not None
    M, b = np.float32(section.M), np.float32(section.b)
    low, high = np.float32(drift.range)
    t = (np.clip(temperature, low, high) - np.float32(drift.reference))[:, np.newaxis]
    change, scale = (
        polynomial(np.float32(rows), t) for rows in (all_powers(drift.bias), all_powers(drift.scale))
    )
    y = (reading - b - change) / (np.float32(1.0) + scale) + b
    x = (y - b).T
    C = inverse(M)
    return np.column_stack([C[i, 0] * x[0] + C[i, 1] * x[1] + C[i, 2] * x[2] for i in range(3)])


def polynomial(coefficients: FloatArray, t: FloatArray) -> FloatArray:
    first, second, third = coefficients
    return ((third * t + second) * t + first) * t


def inverse(m: FloatArray) -> FloatArray:
    """Inverse of a matrix of three rows, by its minors: each row of the adjugate over the determinant."""
    adjugate = np.empty_like(m)
    for i, j in np.ndindex(3, 3):
        ((a, b), (c, d)) = np.delete(np.delete(m, j, axis=0), i, axis=1)
        minor = a * d - c * b
        adjugate[i, j] = minor if (i + j) % 2 == 0 else -minor
    return adjugate / (m[0, 0] * adjugate[0, 0] + m[0, 1] * adjugate[1, 0] + m[0, 2] * adjugate[2, 0])


def flown(folder: Path, archive: Path, *words: str | Path) -> str:
    """Output of a program on a bare Cortex-M4F, built from sources and options."""
    link = ["-Os", "-nostartfiles", "--specs=rdimon.specs", f"-T{BARE / 'mps2-an386.ld'}"]
    options = ["-std=c99", *CORTEX_M4F, *STRICT, *link]
    sources = [BARE / "startup.c", *words, archive]
    done(["arm-none-eabi-gcc", *options, *sources, "-lm", "-o", folder / "image.elf"])
    return done(["scripts/run_in_qemu.sh", folder / "image.elf"])


@pytest.fixture
def quick_start(tmp_path: Path) -> list[str | Path]:
    """Sources and options of the program of the quick start, those of the page."""
    source = tmp_path / "quick.c"
    source.write_text(example_under("1. The program", QUICK_START))
    return [source, BARE / "robot.c", BARE / "flash.c", f"-I{BARE}"]


PROMISED = re.findall(r"^    (gyroscope bias.*\n)", QUICK_START.read_text(), re.MULTILINE)


def test_the_quick_start_prints_on_this_machine_what_its_page_says(
    host_library: Path, tmp_path: Path, quick_start: list[str | Path]
) -> None:
    program = tmp_path / "quick"
    done([*LANGUAGES["c"], *STRICT, *SANITIZED, *quick_start, host_library, "-lm", "-o", program])
    assert [done([program])] == PROMISED


def test_quick_start_on_a_bare_cortex_m4f_prints_what_its_page_shows(
    device_library: Path, tmp_path: Path, quick_start: list[str | Path]
) -> None:
    assert [flown(tmp_path, device_library, *quick_start)] == PROMISED


EXPORTED = ROOT / "tests" / "device" / "export" / "correct.c"


def expect_corrected(printed: str, exported: Exported) -> None:
    """Asserts that the output of the program, by the constant and by the records, equals Python's
    correction.
    """
    _, unit, readings = exported
    force, rate, temperature = readings[:, :3], readings[:, 3:6], readings[:, 6]
    words = np.array([int(word, 16) for word in printed.split()], dtype=np.uint32)
    by_constant, by_records = words.view(np.float32).reshape(2, -1, 6)
    pairs = ((unit.accelerometer, force), (unit.gyroscope, rate))
    ours = np.column_stack([corrected_in_single(section, reading, temperature) for section, reading in pairs])
    assert ours.dtype == np.float32
    assert np.array_equal(by_constant, ours)
    assert np.array_equal(by_records, ours)
    # Single precision of readings of 30 m/s^2.
    in_double = np.column_stack(unit.correct(force, rate, temperature))
    assert np.abs(ours - in_double).max() < 2e-5


def test_program_with_exported_calibration_matches_python_bitwise(
    host_library: Path, tmp_path: Path, exported: Exported
) -> None:
    program = tmp_path / "program"
    options = [*STRICT, *SANITIZED, f"-I{exported[0]}"]
    done([*LANGUAGES["c"], *options, EXPORTED, host_library, "-lm", "-o", program])
    expect_corrected(done([program]), exported)


def test_image_with_exported_calibration_matches_python_bitwise(
    device_library: Path, tmp_path: Path, exported: Exported
) -> None:
    expect_corrected(flown(tmp_path, device_library, EXPORTED, f"-I{exported[0]}"), exported)


def test_exported_records_are_the_same_bytes_as_file_and_as_c_arrays(
    exported: Exported,
) -> None:
    folder, _, _ = exported
    arrays = re.findall(r"0x([0-9A-F]{2})\b", (folder / "records.h").read_text())
    assert bytes.fromhex("".join(arrays)) == (folder / "records").read_bytes()


def test_a_program_with_a_wrong_expectation_fails(host_library: Path, tmp_path: Path) -> None:
    """The laws themselves are tried: vectors with other values break them."""
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
    """Links a C program that makes every call for a Cortex-M4F."""
    source = CAPI / "tests" / "device" / "every_call.c"
    link = ["-Os", "-nostartfiles", "--specs=nosys.specs", "-Wl,-e,main", "-Wl,-z,noexecstack"]
    compile_ = ["arm-none-eabi-gcc", "-std=c99", *CORTEX_M4F, *STRICT, *link, *options]
    return run([*compile_, source, archive, "-o", archive.parent / "image.elf"])


def flash(program: Path) -> int:
    """Bytes of code, constants and initial values."""
    text, data = done(["arm-none-eabi-size", program]).splitlines()[1].split()[:2]
    return int(text) + int(data)


def symbols(program: Path) -> list[str]:
    return [line.split(maxsplit=2)[-1] for line in done(["arm-none-eabi-nm", "-C", program]).splitlines()]


def declared_calls() -> set[str]:
    """Names of the calls of the header."""
    found = re.findall(r"^(?:tumble_status|const char \*) ?(tumble_\w+)\(", HEADER.read_text(), re.MULTILINE)
    assert len(found) > 30
    return set(found)


def test_a_cortex_m_image_reaches_neither_panic_nor_heap(device_library: Path) -> None:
    linked = image(device_library)
    assert linked.returncode == 0, linked.stderr
    found = symbols(device_library.parent / "image.elf")
    assert [name for name in found if FORBIDDEN.search(name)] == []
    declared = declared_calls()
    assert declared <= set(found), declared - set(found)


SETS = [
    *(parts for n in (0, 1, 2, 4) for parts in combinations(PARTS, n)),
    *(("redundancy", "records", *parts) for n in range(3) for parts in combinations(OF_A_SET, n)),
]
"""Each part alone, each pair, and all but one."""


@only_soak("checks all that the library is made of once more")
@pytest.mark.parametrize("wanted", SETS, ids="+".join)
def test_the_library_compiles_with_every_set_of_its_parts(wanted: Sequence[str]) -> None:
    options = ["--quiet", "--locked", "--package", "tumble-capi", "--lib", "--no-default-features"]
    done(["cargo", "clippy", *options, "--features", ",".join(wanted), "--", "--deny", "warnings"])


SINGLE = [(part,) for part in (*PARTS, *OF_A_SET) if part != "redundancy"]
"""A part left out alone takes as long to build as all together."""


@pytest.mark.parametrize(
    "left_out",
    [PARTS, *(pytest.param(parts, marks=SLOW) for parts in (("redundancy",), OF_A_SET, *SINGLE))],
    ids="+".join,
)
def test_an_image_without_some_parts_is_smaller(
    device_library: Path, tmp_path: Path, left_out: Sequence[str]
) -> None:
    archive = library(tmp_path, device=True, left_out=left_out)
    linked = image(archive, *(f"-DTUMBLE_WITHOUT_{part.upper()}" for part in left_out))
    assert linked.returncode == 0, linked.stderr
    assert archive.stat().st_size < device_library.stat().st_size
    assert image(device_library).returncode == 0
    smaller, all_ = (flash(folder / "image.elf") for folder in (tmp_path, device_library.parent))
    print(f"{all_} bytes of flash, {smaller} without {', '.join(left_out)}")
    assert smaller < all_ - 500 * len(left_out)


def test_a_call_of_a_part_that_was_left_out_does_not_link(tmp_path: Path) -> None:
    linked = image(library(tmp_path, device=True, left_out=PARTS))
    assert linked.returncode != 0
    for call in ("tumble_spin_init", "tumble_redundancy_push", "tumble_magnetometer_decode"):
        assert f"undefined reference to `{call}'" in linked.stderr


@SLOW
def test_an_image_that_reaches_a_panic_does_not_link(tmp_path: Path) -> None:
    linked = image(library(tmp_path, "reach-a-panic", device=True))
    assert linked.returncode != 0
    assert "tumble_panic_is_reachable" in linked.stderr


def test_an_image_that_reaches_the_heap_is_found_out(device_library: Path) -> None:
    linked = image(device_library, "-DREACH_THE_HEAP")
    assert linked.returncode == 0, linked.stderr
    assert any(FORBIDDEN.search(name) for name in symbols(device_library.parent / "image.elf"))


def test_no_call_takes_more_than_4_kib_of_stack(device_library: Path) -> None:
    bounds = c_library.stack_bounds(c_library.every_call(device_library))
    assert set(bounds) >= declared_calls()
    assert {call: bound for call, bound in bounds.items() if bound > c_library.STACK_GOAL} == {}


def test_stack_painted_in_a_flight_is_close_below_its_bound(device_library: Path) -> None:
    bounds = c_library.stack_bounds(c_library.every_call(device_library))
    painted, last = c_library.stack_painted(device_library)
    assert last == "2 adopted, 0 refused"
    assert {"tumble_redundancy_push", "tumble_redundancy_init", "tumble_spin_solve"} < set(painted)
    for call, used in painted.items():
        assert used <= bounds[call] < 4096, call
        # Only a flash with faults takes the branches of a save that repair entries and pass over dead words.
        if call != "tumble_store_save":
            assert bounds[call] <= used + max(256, used / 20), call


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
