"""Requirements of these tests beside Rust: tools for devices, and Python packages of their own."""

from __future__ import annotations

import subprocess
import sys

import pytest

from package.packages import CARGO_FOLDER, ROOT, try_to_run

# kconfiglib reads Kconfig in Zephyr's build, esp-idf-kconfig in that of ESP-IDF, whose component manager
# reads manifests; scons builds for PlatformIO, which also checks manifests.
PACKAGES = [
    "kconfiglib==14.1.0", "esp-idf-kconfig==3.14.0", "idf-component-manager==3.1.2",
    "scons==4.11.1", "platformio==6.2.0",
]  # fmt: skip


@pytest.fixture(scope="session", autouse=True)
def _device_tools():
    installed = try_to_run(ROOT / "scripts" / "install_test_tools.sh")
    if installed.returncode != 0:
        pytest.skip(installed.stderr.strip() or "tools for devices could not be installed")


@pytest.fixture(scope="session")
def cortex_m():
    """The cargo that can build for a Cortex-M4F, which fetches what it lacks."""
    return ROOT / "scripts" / "cargo_for_device.sh"


@pytest.fixture(scope="session")
def python():
    """A Python that has the packages above; kept, so that they are fetched once."""
    folder = CARGO_FOLDER / "package-tools"
    python = folder / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    installed = try_to_run(
        python, "-m", "pip", "--quiet", "--disable-pip-version-check", "install", *PACKAGES
    )
    if installed.returncode != 0:
        pytest.skip(f"{', '.join(PACKAGES)} could not be installed: {installed.stderr.strip()[-300:]}")
    return python
