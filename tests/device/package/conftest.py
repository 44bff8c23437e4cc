"""Requirements of these tests beside Rust: tools for devices, and Python packages of their own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from package.packages import CARGO_FOLDER, ROOT, try_to_run

# kconfiglib reads Kconfig in Zephyr's build; scons builds for PlatformIO, which also checks manifests.
PACKAGES = ["kconfiglib==14.1.0", "scons==4.11.1", "platformio==6.2.0"]
# ESP-IDF's parser of Kconfig, whose module has the name of Zephyr's, and its component manager.
OF_ESP_IDF = ["esp-idf-kconfig==3.14.0", "idf-component-manager==3.1.2"]


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
    return with_packages(CARGO_FOLDER / "package-tools", PACKAGES)


@pytest.fixture(scope="session")
def python_of_esp_idf():
    """A Python that has ESP-IDF's packages."""
    return with_packages(CARGO_FOLDER / "esp-idf-tools", OF_ESP_IDF)


def with_packages(folder: Path, packages: list[str]) -> Path:
    """Path of a Python in a folder, in which these packages are installed."""
    python = folder / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    installed = try_to_run(
        python, "-m", "pip", "--quiet", "--disable-pip-version-check", "install", *packages
    )
    if installed.returncode != 0:
        pytest.skip(f"{', '.join(packages)} could not be installed: {installed.stderr.strip()[-300:]}")
    return python
