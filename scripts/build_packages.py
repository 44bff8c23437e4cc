"""Build what PyPI holds: the source distribution and, of nothing but it, a wheel.

    python scripts/build_packages.py OUT               for the machine this runs on
    python scripts/build_packages.py OUT --target aarch64-unknown-linux-gnu
    python scripts/build_packages.py OUT --as-built    of what `make build` compiled, for this machine only

Wheels for Linux are linked by zig (`pip install ziglang`) against the C library of manylinux2014, so that any
distribution since runs them. The contents of a wheel are compared with the sources.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = "python/"
NATIVE = re.compile(r"tumble/_core(\.abi3\.so|\.pyd)")
LARGEST = 6_000_000
"""Bytes of a wheel: debugging symbols, or data of ours, would go beyond."""
LINUX = ("--zig", "--compatibility", "manylinux2014")


def maturin(folder: Path, *words: str | Path) -> None:
    """Runs maturin, which belongs to this Python, on the sources in a folder."""
    # Whatever folder it is: what is compiled once serves the next build.
    variables = {"CARGO_TARGET_DIR": str(ROOT / "target"), **os.environ, "VIRTUAL_ENV": sys.prefix}
    # Zig is looked for as a module of the Python that is found first.
    variables["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    subprocess.run([sys.executable, "-m", "maturin", *map(str, words)], cwd=folder, env=variables, check=True)


def build(sources: Path, out: Path, *options: str) -> Path:
    """Builds a wheel of a folder of sources; its path."""
    with tempfile.TemporaryDirectory() as made:
        maturin(sources, "build", "--release", *options, "--out", made)
        (wheel,) = Path(made).glob("*.whl")
        return Path(shutil.move(wheel, out / wheel.name))


def build_from_distribution(out: Path, target: str) -> Path:
    """Writes the source distribution and builds a wheel of nothing but it; the wheel's path.

    An empty target is the machine this runs on.
    """
    options = ["--strip", *(LINUX if "linux" in (target or sys.platform) else ())]
    if target:
        options += ["--target", target]
    with tempfile.TemporaryDirectory() as folder:
        maturin(ROOT, "sdist", "--out", folder)
        (distribution,) = Path(folder).glob("*.tar.gz")
        with tarfile.open(distribution) as packed:
            packed.extractall(folder)
        shutil.copy(distribution, out)
        return build(Path(folder) / distribution.name.removesuffix(".tar.gz"), out, *options)


def sources() -> set[str]:
    """Files of the package, as git has them."""
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard", PACKAGE]
    told = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return {name.removeprefix(PACKAGE) for name in told.splitlines() if (ROOT / name).exists()}


def faults(wheel: Path) -> Iterator[str]:
    """Describes files that a wheel lacks, and files that it must not hold."""
    with zipfile.ZipFile(wheel) as packed:
        names = set(packed.namelist())
    native = {name for name in names if NATIVE.fullmatch(name)}
    about = {name for name in names if ".dist-info/" in name}
    if len(native) != 1:
        yield f"{len(native)} native modules"
    for licence in ("LICENSE-APACHE", "LICENSE-MIT"):
        if not any(name.endswith(f"/{licence}") for name in about):
            yield f"without {licence}"
    yield from (f"without {name}" for name in sorted(sources() - names))
    yield from (f"holds {name}" for name in sorted(names - sources() - native - about))
    if (size := wheel.stat().st_size) > LARGEST:
        yield f"{size} bytes, more than {LARGEST}"


def main() -> int:
    """Builds and compares; 1 if a wheel is not what it should be."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path, help="folder that the packages are put into")
    parser.add_argument("--target", default="", help="Rust's name of another machine to build for")
    parser.add_argument("--as-built", action="store_true", help="a wheel of what `make build` has compiled")
    asked = parser.parse_args()
    out = asked.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    if asked.as_built:
        wheel = build(ROOT, out, "--locked", "--compatibility", "off", "--interpreter", sys.executable)
    else:
        wheel = build_from_distribution(out, asked.target)
    found = list(faults(wheel))
    for fault in found:
        print(f"{wheel.name}: {fault}", file=sys.stderr)
    print(wheel)
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
