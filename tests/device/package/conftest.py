"""Requirements of these tests beside Rust: tools for devices, and Python packages of their own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from package.packages import CARGO_FOLDER, CRATE, ROOT, NotedCargo, build, try_to_run

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
def host_library(tmp_path_factory):
    """The library of all parts and three units, for this machine."""
    folder = tmp_path_factory.mktemp("library")
    build(CRATE, folder)
    return folder / "libtumble.a"


@pytest.fixture
def noted_cargo(tmp_path_factory, host_library):
    """A function that makes the cargo whose calls are noted, for a number of units."""
    return lambda units: NotedCargo(tmp_path_factory.mktemp("noted"), host_library, units)


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
    listed = folder / "packages.txt"
    if listed.is_file() and listed.read_text().split() == packages:
        return python
    # A pip of its own would take longer to unpack than these packages; uv is the one that installs ours.
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    installer = (sys.executable, "-m", "uv", "pip", "install", "--quiet", "--python", python)
    installed = try_to_run(*installer, *packages)
    if installed.returncode != 0:
        pytest.skip(f"{', '.join(packages)} could not be installed: {installed.stderr.strip()[-300:]}")
    listed.write_text("\n".join(packages))
    return python
