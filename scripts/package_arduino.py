"""Pack Tumble as a library for Arduino: headers, libraries built for its processors, an example, licences.

`package_arduino.py OUT` writes OUT/Tumble-VERSION.zip, which the Arduino IDE adds as a library without Rust.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import zipfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
CRATE = ROOT / "crates" / "tumble-capi"
LIBRARY = CRATE / "arduino"
HEADERS = ("tumble.h", "tumble.hpp")

# Rust's name of a processor, and the folders in which Arduino looks for it:
# build.mcu, then build.fpu-build.float-abi.
FOLDERS = {
    "thumbv6m-none-eabi": ("cortex-m0plus",),
    "thumbv7em-none-eabi": ("cortex-m4/fpv4-sp-d16-softfp", "cortex-m7/fpv5-d16-softfp"),
    "thumbv7em-none-eabihf": ("cortex-m4/fpv4-sp-d16-hard", "cortex-m7/fpv5-d16-hard"),
    "riscv32imc-unknown-none-elf": ("esp32c3",),
}


def build(target: str, cargo_folder: Path) -> Path:
    """Path of the static library for a processor, for a redundant set of three units."""
    command = [
        ROOT / "scripts" / "cargo_for_device.sh", "rustc", "--quiet", "--locked",
        "--manifest-path", CRATE / "Cargo.toml", "--crate-type", "staticlib", "--profile", "device",
        "--features", "freestanding", "--target-dir", cargo_folder, "--target", target,
    ]  # fmt: skip
    environment = {**os.environ, "TUMBLE_DEVICE_TARGET": target, "TUMBLE_UNITS": "3"}
    subprocess.run([str(word) for word in command], check=True, env=environment)
    return cargo_folder / target / "device" / "libtumble_capi.a"


def contents(targets: list[str], cargo_folder: Path) -> Iterator[tuple[str, Path]]:
    """Yields the path of each file in the library, and the file."""
    for path in LIBRARY.rglob("*"):
        if path.is_file():
            yield path.relative_to(LIBRARY).as_posix(), path
    for name in ("LICENSE-APACHE", "LICENSE-MIT"):
        yield name, ROOT / name
    for name in HEADERS:
        yield f"src/{name}", CRATE / "include" / name
    for target in targets:
        library = build(target, cargo_folder)
        for folder in FOLDERS[target]:
            yield f"src/{folder}/libtumble.a", library


def pack(out: Path, targets: list[str], cargo_folder: Path) -> Path:
    """Writes the library; the same sources give the same bytes."""
    properties = (LIBRARY / "library.properties").read_text()
    (version,) = re.findall(r"^version=(.*)$", properties, re.MULTILINE)
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"Tumble-{version}.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, file in sorted(contents(targets, cargo_folder)):
            packed.writestr(zipfile.ZipInfo(f"Tumble/{name}"), file.read_bytes(), zipfile.ZIP_DEFLATED)
    return path


def main() -> None:
    """Pack what the command line asks for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--cargo-folder", type=Path, default=ROOT / "target")
    parser.add_argument("--target", choices=FOLDERS, action="append", help="a processor; all by default")
    given = parser.parse_args()
    print(pack(given.out, given.target or list(FOLDERS), given.cargo_folder))


if __name__ == "__main__":
    main()
