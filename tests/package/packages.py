"""Builds projects that take Tumble in, as their authors would."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
CRATE = ROOT / "crates" / "tumble-capi"
HERE = Path(__file__).parent
# One folder for all builds of the library, so that it is compiled once for each machine.
CARGO_FOLDER = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))


def run(*command: str | Path, folder: Path = ROOT) -> str:
    """What a command prints; fails with it if the command does."""
    ran = try_to_run(*command, folder=folder)
    assert ran.returncode == 0, f"{command}\n{ran.stdout[-4000:]}\n{ran.stderr[-4000:]}"
    return ran.stdout


def try_to_run(*command: str | Path, folder: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Runs a command that may fail."""
    return subprocess.run(
        [str(word) for word in command], cwd=folder, capture_output=True, text=True, check=False
    )


def build(source: Path, folder: Path, **options: str | Path) -> None:
    """Configures and builds a CMake project."""
    run(*configuring(source, folder, **options))
    run("cmake", "--build", folder)


def configuring(source: Path, folder: Path, **options: str | Path) -> list[str | Path]:
    """The command that configures a CMake project."""
    given = [f"-D{name}={value}" for name, value in {"TUMBLE_CARGO_FOLDER": CARGO_FOLDER, **options}.items()]
    return ["cmake", "-S", source, "-B", folder, "--no-warn-unused-cli", *given]
