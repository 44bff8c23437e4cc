"""Builds projects that take Tumble in, as their authors would."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from repetitions import SOAK

ROOT = Path(__file__).parents[3]
CRATE = ROOT / "crates" / "tumble-capi"
HERE = Path(__file__).parent
# One folder for all builds of the library, so that it is compiled once for each machine.
CARGO_FOLDER = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))

MANY_UNITS = 8
"""Largest number of units for which a library can be built, instead of the default three."""


def cargo_folder(units: object = 3) -> Path:
    """Makes the folder in which libraries for a number of units are built: cargo keeps one number in each.

    A new one begins with what was built for three units on this machine: cargo then builds the interface
    for C alone, and not what it needs.
    """
    folder = CARGO_FOLDER if str(units) == "3" else CARGO_FOLDER / f"units-{units}"
    begun = CARGO_FOLDER / "device"
    if not folder.is_dir() and begun.is_dir():
        # Dates of files stay, by which cargo sees that they are up to date.
        shutil.copytree(begun, folder / "device")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


# Rust's names of the processors that all packages know, without the part on floats.
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


# Each processor with each way to pass floats, hard ones or not, and its target.
TARGETS = [
    (processor, hard, target + ("-eabihf" if hard else "-eabi"))
    for processor, target in PROCESSORS.items()
    for hard in (False, True)
    if not (hard and target in ("thumbv6m-none", "thumbv7m-none"))
]

# Parts of the library that may be left out, as options of CMake and of Kconfig end.
OF_A_SET = ("CALIBRATION", "AIDING", "SETTINGS_CHECK")
"""Those of a redundant set, which are left out with it."""
PARTS = ("SPIN", "REDUNDANCY", *OF_A_SET, "RECORDS", "TEMPERATURE", "MAGNETOMETER")

WITHOUT_SETS = "no redundant sets: it was done\n"
"""Output of the consumer where it is built without redundant sets."""


def run(*command: str | Path, folder: Path = ROOT) -> str:
    """Output of a command; fails with it if the command does."""
    ran = try_to_run(*command, folder=folder)
    assert ran.returncode == 0, f"{command}\n{ran.stdout[-4000:]}\n{ran.stderr[-4000:]}"
    return ran.stdout


def try_to_run(
    *command: str | Path, folder: Path = ROOT, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Runs a command that may fail."""
    words = [str(word) for word in command]
    changed = {**os.environ, **environment}
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False, env=changed)


def build(source: Path, folder: Path, **options: str | Path | int) -> None:
    """Configures and builds a CMake project."""
    run(*configuring(source, folder, **options))
    run("cmake", "--build", folder)


class NotedCargo:
    """A cargo that notes what a project asks of it, for tests of what reaches it; `make soak` lets it build.

    A library for another number of units, or of fewer parts, takes half a minute to build. Otherwise it hands
    over the library for three units with all parts, which links as well.
    """

    def __init__(self, folder: Path, library: Path, units: object) -> None:
        """Writes the program into `folder`, where builds for `units` find it."""
        self.folder = cargo_folder(units) if SOAK else folder / "built"
        """Folder in which cargo builds."""
        self.program = folder / "bin" / "cargo"
        self._asked = folder / "asked"
        built = f"mkdir -p {self.folder}/device && cp {library} {self.folder}/device/libtumble_capi.a"
        build = f'exec {shutil.which("cargo")} "$@"' if SOAK else built
        self.program.parent.mkdir()
        self.program.write_text(f'#!/bin/sh\necho "$TUMBLE_UNITS units, $*" >>{self._asked}\n{build}\n')
        self.program.chmod(0o755)

    def was_asked_for(self, units: int, *left_out: str) -> bool:
        """Indicates whether each library was to be for `units`, without the parts named and no others."""
        wanted = ["freestanding", *(part.lower() for part in PARTS if part.lower() not in left_out)]
        calls = self._asked.read_text().splitlines()
        features = [call.partition("--no-default-features --features ")[2].split(" ")[0] for call in calls]
        same = [sorted(found.split(",")) == sorted(wanted) for found in features]
        return bool(calls) and all(same) and all(call.startswith(f"{units} units, ") for call in calls)


def configuring(source: Path, folder: Path, **options: str | Path | int) -> list[str | Path]:
    """The command that configures a CMake project."""
    units = options.get("CONFIG_TUMBLE_UNITS", options.get("TUMBLE_UNITS", 3))
    settings = {"TUMBLE_CARGO_FOLDER": cargo_folder(units), **options}
    given = [f"-D{name}={value}" for name, value in settings.items()]
    return ["cmake", "-S", source, "-B", folder, "--no-warn-unused-cli", *given]
