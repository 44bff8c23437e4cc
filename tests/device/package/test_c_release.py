"""Released C files compile and link from an empty folder, by pkg-config, without Rust."""

from __future__ import annotations

import os
import re
import subprocess
import tarfile

import pytest

from package.packages import CARGO_FOLDER, HERE, ROOT, run
from repetitions import SOAK

PROGRAM = HERE / "consumer" / "main.c"
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")
VERSION = re.search(r'^version = "(.*)"$', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]
HOST = re.search(r"^host: (.*)$", run("rustc", "-vV"), re.MULTILINE)[1]
ARM = ("arm-none-eabi-gcc", "--specs=nosys.specs", "-mthumb", "-Wl,--no-warnings")
COMPILERS = {
    HOST: ("cc",),
    "thumbv7em-none-eabihf": (*ARM, "-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"),
}
if SOAK:
    # All of the core is compiled once more.
    COMPILERS["thumbv6m-none-eabi"] = (*ARM, "-mcpu=cortex-m0plus")


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    return pack(tmp_path_factory.mktemp("packed"))


@pytest.fixture(scope="module")
def release(archive, tmp_path_factory):
    """The folder that a user has who unpacks it."""
    folder = tmp_path_factory.mktemp("unpacked here")
    with tarfile.open(archive) as packed:
        packed.extractall(folder, filter="data")
    return folder / f"tumble-{VERSION}-c"


def pack(folder):
    """Packs a release as its maker does; its path."""
    devices = [target for target in COMPILERS if target != HOST]
    said = run(ROOT / "scripts" / "package_c.sh", folder, CARGO_FOLDER, *devices)
    return folder / said.strip().rpartition("/")[2]


def flags(release, target, *wanted):
    """Flags that pkg-config prints, split as a shell would."""
    return subprocess.run(
        ["pkg-config", *wanted, "tumble"],
        env={**os.environ, "PKG_CONFIG_PATH": str(release / "lib" / target / "pkgconfig")},
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()


@pytest.mark.parametrize("target", COMPILERS)
def test_a_program_is_compiled_and_linked_with_what_pkg_config_says(release, tmp_path, target):
    program = tmp_path / "program"
    said = flags(release, target, "--cflags", "--libs")
    words = " ".join([*COMPILERS[target], *STRICT, str(PROGRAM), "-o", str(program)])
    run("sh", "-c", f"{words} {said}", folder=tmp_path)
    if target == HOST:
        assert run(program) == "3 units: it was done\n"
    else:
        assert "ARM" in run("arm-none-eabi-readelf", "-h", program)


def test_header_and_packages_say_the_version_of_the_workspace(release):
    assert f'#define TUMBLE_VERSION "{VERSION}"' in (release / "include" / "tumble.h").read_text()
    assert [flags(release, target, "--modversion") for target in COMPILERS] == [VERSION] * len(COMPILERS)


def test_it_holds_what_is_needed_and_nothing_else(release):
    cmake = ("tumbleConfig.cmake", "tumbleConfigVersion.cmake")
    expected = {"LICENSE-APACHE", "LICENSE-MIT", "include/tumble.h", "include/tumble.hpp"}
    for target in COMPILERS:
        files = ("libtumble.a", "pkgconfig/tumble.pc", *(f"cmake/tumble/{name}" for name in cmake))
        expected |= {f"lib/{target}/{file}" for file in files}
    found = {path.relative_to(release).as_posix() for path in release.rglob("*") if path.is_file()}
    assert found == expected


def test_nothing_in_it_tells_where_it_was_made(release):
    for path in release.rglob("*"):
        if path.is_file():
            assert str(ROOT).encode() not in path.read_bytes(), path


def test_packing_again_gives_the_same_bytes(archive, tmp_path):
    assert pack(tmp_path).read_bytes() == archive.read_bytes()
