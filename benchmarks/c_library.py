"""Figures of the library for C on a Cortex-M4F: flash of its parts, stack of its calls, bytes of its states."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

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
PARTS = ("spin", "redundancy", "records", "temperature", "calibration", "aiding", "settings_check")
"""Features of the crate that may be left out, as in its Cargo.toml."""

STACK_GOAL = 4096
"""Bytes, without what callbacks of the caller take."""
CALL = r"tumble_[a-z_]+"
BY_REGISTER = (
    # Listeners of events call the function of the caller.
    (r"Listener::tell$|\{\{closure\}\}|vtable.shim", r"^on_event$"),
    (r"^tumble_core::redundancy::fit::", r"PairMoments<T>>::"),
    (r"^tumble_core::redundancy::|^tumble_redundancy", r"PairMoments<T>>::|\{\{closure\}\}|vtable.shim"),
    # Flash is the caller's too.
    (r"^tumble_store", r"^on_event$"),
)
"""Patterns of the names of functions that call by a register, and of the functions that they may so call."""


def library(folder: Path, left_out: Sequence[str] = (), units: int = 3) -> Path:
    """Builds the static library, all of it or without some of its parts, and puts it into `folder`."""
    options = ["--locked", "--package", "tumble-capi", "--crate-type", "staticlib", "--profile", "device"]
    wanted = ["freestanding", *(part for part in PARTS if part not in left_out)]
    # To cargo all parts named are another library than all by default, as the packages build it.
    features = ["--no-default-features", "--features", ",".join(wanted)] if left_out else ["--features", wanted[0]]
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


def _said(*command: str) -> str:
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT).stdout
