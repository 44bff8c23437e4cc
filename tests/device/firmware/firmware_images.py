"""Images of the movable platform, built once, and the emulated device that runs them."""

from __future__ import annotations

import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "target" / "firmware"
VECTORS = ROOT / "vectors"


def build(feature: str = "") -> subprocess.CompletedProcess[str]:
    """Builds the platform and the host's replay, or the platform alone with one of its features."""
    command = [str(ROOT / "scripts" / "build_firmware.sh"), *([feature] if feature else [])]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def run(image: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Runs an image on the emulated device, which reads `vectors/` in a folder."""
    command = [str(ROOT / "scripts" / "run_in_qemu.sh"), str(image)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def compare(vectors: Path, said: Path) -> subprocess.CompletedProcess[str]:
    """Compares what a device said with the host's replay of vectors."""
    command = [str(FOLDER / "mission"), "compare", str(vectors), str(said)]
    return subprocess.run(command, capture_output=True, text=True, check=False)
