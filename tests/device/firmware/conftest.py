"""One build and one run for all tests here."""

from __future__ import annotations

import shutil

import pytest

from firmware_images import FOLDER, ROOT, build, run


@pytest.fixture(scope="session")
def image():
    """The platform as it is flown."""
    if shutil.which("qemu-system-arm") is None:
        pytest.skip("there is no qemu-system-arm; scripts/install_device_tools.sh installs it")
    built = build()
    assert built.returncode == 0, built.stderr
    return FOLDER / "platform"


@pytest.fixture(scope="session")
def said(image):
    """All that the device said of its mission over the vectors of the repository."""
    ran = run(image, ROOT)
    assert ran.returncode == 0, ran.stdout[-2000:] + ran.stderr
    return ran.stdout
