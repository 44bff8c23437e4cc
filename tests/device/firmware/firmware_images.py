"""Images of the movable platform, built once, and the emulated devices that run them."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "target" / "firmware"
VECTORS = ROOT / "vectors"
CORTEX_M4F = "thumbv7em-none-eabihf"
EMULATORS: Mapping[str, str] = {
    CORTEX_M4F: "qemu-system-arm",
    "thumbv6m-none-eabi": "qemu-system-arm",
    "riscv32imc-unknown-none-elf": "qemu-system-riscv32",
}
"""Rust's names of the processors, and what emulates each."""


def built_image(feature: str = "", target: str = CORTEX_M4F) -> Path:
    """Path of the platform image for a processor, with one of its features."""
    return FOLDER / target / f"platform{feature and '-'}{feature}"


def build(feature: str = "", target: str = CORTEX_M4F) -> subprocess.CompletedProcess[str]:
    """Builds the platform and the host's replay, or the platform alone with one of its features."""
    command = [str(ROOT / "scripts" / "build_firmware.sh"), *([feature] if feature else [])]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=_environment(target))


def build_optimised(level: str, folder: Path) -> Path:
    """Builds the platform for a Cortex-M4F at a level of optimisation, into a folder."""
    options = ["--quiet", "--locked", "--profile", "device", "--package", "platform"]
    options += ["--manifest-path", "firmware/Cargo.toml", "--target-dir", "target"]
    environment = {**_environment(CORTEX_M4F), "CARGO_PROFILE_DEVICE_OPT_LEVEL": level}
    command = [str(ROOT / "scripts" / "cargo_for_device.sh"), "build", *options]
    subprocess.run(command, cwd=ROOT, check=True, env=environment)
    return Path(shutil.copy(ROOT / "target" / CORTEX_M4F / "device" / "platform", folder))


def run(image: Path, folder: Path, target: str = CORTEX_M4F) -> subprocess.CompletedProcess[str]:
    """Runs an image on an emulated device, which reads `vectors/` in a folder."""
    command = [str(ROOT / "scripts" / "run_in_qemu.sh"), str(image)]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, env=_environment(target)
    )


def compare(vectors: Path, said: Path) -> subprocess.CompletedProcess[str]:
    """Compares the output of a device with the host's replay of vectors."""
    command = [str(FOLDER / "mission"), "compare", str(vectors), str(said)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def _environment(target: str) -> dict[str, str]:
    return {**os.environ, "TUMBLE_DEVICE_TARGET": target}
