"""Builds libtumble.a with cargo, or takes a prebuilt one, for a project of PlatformIO.

PlatformIO runs it with SCons where a project includes tumble.h. Options of the project's environment:
custom_tumble_units (3), custom_tumble_without (parts that are left out, such as "spin temperature"; none),
custom_tumble_target (found from the compiler's flags; this machine on the platform native),
custom_tumble_library (none: it is built).
"""

# SCons brings `env` and `projenv` in, which a checker cannot see.
# ruff: noqa: F821

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path
from typing import NoReturn

from SCons.Script import DefaultEnvironment, Import

Import("env", "projenv")

# Rust's names of the processors that -mcpu names, no floats. The same table is in cmake/TumbleRust.cmake.
PROCESSORS = {
    "cortex-m0": "thumbv6m-none",
    "cortex-m0plus": "thumbv6m-none",
    "cortex-m3": "thumbv7m-none",
    "cortex-m4": "thumbv7em-none",
    "cortex-m7": "thumbv7em-none",
    "cortex-m33": "thumbv8m.main-none",
    "cortex-m35p": "thumbv8m.main-none",
    "cortex-m55": "thumbv8m.main-none",
    "cortex-m85": "thumbv8m.main-none",
}


# Those that no floating point unit was ever made for.
WITHOUT_FLOATS = ("cortex-m0", "cortex-m0plus", "cortex-m3")

CRATE = Path(env.Dir(".").srcnode().abspath).parent


def parts() -> list[str]:
    """Parts of the library: the default features of Cargo.toml."""
    (listed,) = re.findall(r"^default = \[(.*)\]$", (CRATE / "Cargo.toml").read_text(), re.MULTILINE)
    return re.findall(r'"(\w+)"', listed)


def fail(message: str) -> NoReturn:
    """End the build with one line."""
    print(f"tumble: {message}")
    raise SystemExit(1)


def find_target(flags: list[str]) -> str | None:
    """Rust's name of the machine that the compiler's flags are for; none for this machine."""
    if env["PIOPLATFORM"] == "native":
        return None
    named = [flag.removeprefix("-mcpu=") for flag in flags if flag.startswith("-mcpu=")]
    processor = named[-1].partition("+")[0] if named else None
    if processor not in PROCESSORS:
        board = env.GetProjectOption("board", env["PIOPLATFORM"])
        fail(f"no Rust target is known for {board}; set custom_tumble_target in platformio.ini")
    hard = "-mfloat-abi=hard" in flags and processor not in WITHOUT_FLOATS
    return PROCESSORS[processor] + ("-eabihf" if hard else "-eabi")


def features(left_out: list[str]) -> list[str]:
    """Cargo's options for all parts but these."""
    if not left_out:
        return ["--features", "freestanding"]
    wanted = ["freestanding", *(part for part in parts() if part not in left_out)]
    return ["--no-default-features", "--features", ",".join(wanted)]


def build(folder: Path, target: str | None, units: str, left_out: list[str]) -> Path:
    """Path of the library that cargo builds."""
    command = ["cargo", "rustc", "--quiet", "--locked", "--manifest-path", str(CRATE / "Cargo.toml")]
    command += ["--crate-type", "staticlib", "--profile", "device", *features(left_out)]
    command += ["--target-dir", str(folder)] + (["--target", target] if target else [])
    try:
        subprocess.run(command, env={**os.environ, "TUMBLE_UNITS": units}, check=True)
    except FileNotFoundError:
        fail("there is no cargo; install Rust, or set custom_tumble_library to a prebuilt libtumble.a")
    except subprocess.CalledProcessError:
        fail("cargo could not build the library; it says why above")
    return folder / (target or "") / "device" / "libtumble_capi.a"


units = env.GetProjectOption("custom_tumble_units", "3")
if units not in {"2", "3", "4", "5", "6", "7", "8"}:
    fail(f"custom_tumble_units is {units}; it is 2 to 8, the primary included")
left_out = env.GetProjectOption("custom_tumble_without", "").split()
for part in left_out:
    if part not in parts():
        fail(f"custom_tumble_without names {part}; parts are {', '.join(parts())}")
flags = env.Flatten(env.subst_list("$CCFLAGS $CFLAGS $ASFLAGS"))
library = env.GetProjectOption("custom_tumble_library", "")
if not library:
    target = env.GetProjectOption("custom_tumble_target", "") or find_target([str(flag) for flag in flags])
    library = build(Path(env.subst("$BUILD_DIR")) / "cargo", target, units, left_out)

# PlatformIO hands on what libraries are linked, but no definitions: those go to whom they concern.
env.Append(LIBS=[env.File(str(library))])
for whom in (DefaultEnvironment(), projenv):
    whom.Append(
        CPPDEFINES=[("TUMBLE_UNITS", units), *(f"TUMBLE_WITHOUT_{part.upper()}" for part in left_out)]
    )
