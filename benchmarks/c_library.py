"""Figures of the library for C on a Cortex-M4F: flash of its parts, stack of its calls, bytes of its states.

`python -m benchmarks.c_library [--no-save]`
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.table import Table

from benchmarks.results import Content, save
from benchmarks.stack_bound import StackBounds, functions

ROOT = Path(__file__).parent.parent
TARGET = "thumbv7em-none-eabihf"
CAPI = ROOT / "crates" / "tumble-capi"
BARE = ROOT / "examples" / "c"
EVERY_CALL = CAPI / "tests" / "device" / "every_call.c"
STACK = CAPI / "tests" / "device" / "stack.c"
CORTEX_M4F = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
COMPILER = ("arm-none-eabi-gcc", "-std=c99", *CORTEX_M4F, f"-I{CAPI / 'include'}", f"-I{BARE}", "-Os")
LINK = ("-Wl,--gc-sections", "-nostartfiles", "-Wl,-z,noexecstack")
PARTS = (
    "spin",
    "redundancy",
    "records",
    "temperature",
    "magnetometer",
    "calibration",
    "aiding",
    "settings_check",
)
"""Features of the crate that may be left out, as in its Cargo.toml."""

STACK_GOAL = 4096
"""Bytes, without what callbacks of the caller take."""
CALL = r"tumble_[a-z_]+"
COMBINATIONS: dict[str, tuple[str, ...]] = {
    "watch and fail over": ("redundancy",),
    "the same, settings checked on the device": ("redundancy", "settings_check"),
    "the same, aiding measurements received": ("redundancy", "aiding"),
    "watch, fail over, calibrate in flight": ("redundancy", "calibration"),
    "all of a redundant set": ("redundancy", "calibration", "aiding", "settings_check"),
    "spin": ("spin",),
    "records": ("records",),
    "records, temperature": ("records", "temperature"),
    "records, magnetometer": ("records", "magnetometer"),
    "watch, fail over, calibrate in flight, records": ("redundancy", "calibration", "records"),
    "all": PARTS,
}
"""Parts of libraries that are measured, by a name."""

FLASH_GOALS = {
    "watch and fail over": 40 * 1024,
    "watch, fail over, calibrate in flight": 62 * 1024,
    "all": 92 * 1024,
}
STATE_GOALS = {"3": 4710, "2": 3686}
"""Bytes at rest of a set that watches, by its units."""

BY_REGISTER = (
    # Listeners of events call the function of the caller.
    (r"Listener::tell$|\{\{closure\}\}|vtable.shim", r"^on_event$"),
    (r"^<?tumble_core::redundancy::fit::", r"joint_moments::.*PairMoments<T>>::"),
    (
        r"^tumble_core::redundancy::|^tumble_redundancy",
        r"joint_moments::.*PairMoments<T>>::|\{\{closure\}\}|vtable.shim",
    ),
    # Flash is the caller's too.
    (r"^tumble_store", r"^on_event$"),
)
"""Patterns of the names of functions that call by a register, and of the functions that they may so call."""


def library(folder: Path, left_out: Sequence[str] = (), units: int = 3) -> Path:
    """Builds the static library, all of it or without some of its parts, and puts it into `folder`."""
    options = ["--locked", "--package", "tumble-capi", "--crate-type", "staticlib", "--profile", "device"]
    wanted = ["freestanding", *(part for part in PARTS if part not in left_out)]
    # To cargo all parts named are another library than all by default, as the packages build it.
    features = (
        ["--no-default-features", "--features", ",".join(wanted)] if left_out else ["--features", wanted[0]]
    )
    command = ["scripts/cargo_for_device.sh", "rustc", "--quiet", *options, *features]
    subprocess.run(command, check=True, cwd=ROOT, env={**os.environ, "TUMBLE_UNITS": str(units)})
    built = ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / TARGET / "device" / "libtumble_capi.a"
    return Path(shutil.copy(built, folder))


def every_call(archive: Path, left_out: Sequence[str] = ()) -> Path:
    """Links a program that makes every call of a library, beside it."""
    image = archive.parent / "every_call.elf"
    without = (f"-DTUMBLE_WITHOUT_{part.upper()}" for part in left_out)
    target = ("--specs=nosys.specs", "-Wl,-e,main")
    subprocess.run((*COMPILER, *LINK, *target, *without, EVERY_CALL, archive, "-o", image), check=True)
    return image


def flash(image: Path) -> int:
    """Bytes of code, constants and initial values of a program."""
    text, data = _said("arm-none-eabi-size", str(image)).splitlines()[1].split()[:2]
    return int(text) + int(data)


def stack_bounds(image: Path) -> dict[str, int]:
    """Most bytes of stack that each call in a program can take, by its instructions."""
    found = functions(image)
    bounds = StackBounds(found, BY_REGISTER)
    calls = {function.name: at for at, function in found.items() if re.fullmatch(CALL, function.name)}
    return {call: bounds.of(at).bytes for call, at in sorted(calls.items())}


def stack_painted(archive: Path) -> tuple[dict[str, int], str]:
    """Bytes of stack that calls took in an emulated flight, and the last line that it printed."""
    image = archive.parent / "stack.elf"
    target = ("--specs=rdimon.specs", f"-T{BARE / 'mps2-an386.ld'}")
    sources = (BARE / "startup.c", BARE / "flash.c", STACK)
    subprocess.run((*COMPILER, *LINK, *target, *sources, archive, "-lm", "-o", image), check=True)
    said = _said("scripts/run_in_qemu.sh", str(image))
    painted = {call: int(size) for size, call in re.findall(rf"^stack (\d+) bytes: ({CALL})$", said, re.M)}
    return painted, said.splitlines()[-1]


def state(units: int, left_out: Sequence[str]) -> int:
    """Bytes of the storage of a monitor, settings and units included."""
    without = (f"-DTUMBLE_WITHOUT_{part.upper()}" for part in left_out)
    source = '#include "tumble.h"\nchar monitor[sizeof(tumble_redundancy)];\n'
    with TemporaryDirectory() as folder:
        path = Path(folder) / "state.c"
        path.write_text(source)
        compiled = path.with_suffix(".o")
        command = (*COMPILER, f"-DTUMBLE_UNITS={units}", *without, "-c", str(path), "-o", str(compiled))
        subprocess.run(command, check=True)
        (line,) = _said("arm-none-eabi-nm", "--print-size", str(compiled)).splitlines()
    return int(line.split()[1], 16)


def measure() -> Content:
    """Builds a library of each combination of parts, and measures it."""
    with TemporaryDirectory() as folder:
        place = Path(folder)
        empty = flash(every_call(library(place, PARTS), PARTS))
        taken = {}
        for name, wanted in COMBINATIONS.items():
            left_out = [part for part in PARTS if part not in wanted]
            archive = library(place, left_out)
            taken[name] = flash(every_call(archive, left_out)) - empty
        # That of all parts was built last.
        bounds = stack_bounds(every_call(archive))
        painted, _ = stack_painted(archive)
    watch = ("calibration", "aiding")
    return {
        "flash_bytes": taken,
        "empty_bytes": empty,
        "state_bytes": {
            "all": {str(units): state(units, ()) for units in (2, 3)},
            "watch": {str(units): state(units, watch) for units in (2, 3)},
        },
        "stack_bound_bytes": bounds,
        "stack_bytes": painted,
    }


def rows(content: Content) -> Iterator[tuple[str, str, str]]:
    """Names, size and goal of each row, as text."""
    for name, size in content["flash_bytes"].items():
        goal = FLASH_GOALS.get(name)
        yield f"flash: {name}", f"{size / 1024:.1f} KiB", f"{goal // 1024} KiB" if goal else ""
    for units, size in content["state_bytes"]["watch"].items():
        yield (
            f"state: a set of {units} that watches and fails over",
            f"{size} bytes",
            f"{STATE_GOALS[units]:,} bytes",
        )
    for units, size in content["state_bytes"]["all"].items():
        yield f"state: a set of {units} with all parts", f"{size} bytes", ""
    largest = sorted(content["stack_bound_bytes"].items(), key=lambda call: -call[1])
    for call, bound in largest[:FEW]:
        painted = content["stack_bytes"].get(call)
        used = f"{painted} bytes, {bound} at most" if painted else f"{bound} bytes at most"
        yield f"stack: `{call}`", used, f"{STACK_GOAL:,} bytes"


FEW = 10
"""Calls of which the stack is listed, those that take most."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    content = measure()
    table = Table("", "", "goal", title="library for C, Cortex-M4F")
    for cells in rows(content):
        table.add_row(*cells)
    console = Console()
    console.print(table)
    if not options.no_save:
        console.print(f"written to {save('c_library', content)}")


def _said(*command: str) -> str:
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT).stdout


if __name__ == "__main__":
    main()
