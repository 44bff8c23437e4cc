"""One build and one run for all tests here."""

from __future__ import annotations

import shutil

import pytest

from firmware_images import CORTEX_M4F, EMULATORS, ROOT, build, built_image, run

WITHOUT_FPU = [target for target in EMULATORS if target != CORTEX_M4F]
"""Processors without floating point unit."""


def flyable(target):
    """The platform as it is flown on a processor."""
    if shutil.which(EMULATORS[target]) is None:
        pytest.skip(f"there is no {EMULATORS[target]}; scripts/install_test_tools.sh installs it")
    built = build(target=target)
    if f"no Rust for {target}" in built.stderr:
        pytest.skip(built.stderr.strip().splitlines()[-1])
    assert built.returncode == 0, built.stderr
    return built_image(target=target)


@pytest.fixture(scope="session")
def image():
    """The platform for a Cortex-M4F."""
    return flyable(CORTEX_M4F)


@pytest.fixture(scope="session")
def said(image):
    """Output of the Cortex-M4F for its mission over the vectors of the repository."""
    ran = run(image, ROOT)
    assert ran.returncode == 0, ran.stdout[-2000:] + ran.stderr
    return ran.stdout


@pytest.fixture(scope="session", params=WITHOUT_FPU)
def other_processor(request):
    """A processor without floating point unit, and its platform: all of the core is compiled for it."""
    return request.param, flyable(request.param)
