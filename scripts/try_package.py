"""Install a package into a fresh environment without Rust, and use it as a newcomer would.

python scripts/try_package.py FOLDER [--extra all]
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

NEWCOMER = Path(__file__).with_name("newcomer.py")
RUST = ("cargo", "rustc", "rustup")


def path_without_rust(first: Path) -> str:
    """Returns a PATH that begins with `first` and leads to no compiler of Rust."""
    folders = [Path(each) for each in os.environ["PATH"].split(os.pathsep) if each]
    kept = [each for each in folders if not any(shutil.which(name, path=str(each)) for name in RUST)]
    return os.pathsep.join(str(each) for each in (first, *kept))


def wheel_for_here(folder: Path) -> Path:
    """Finds the wheel that this machine takes; there is to be one."""
    machine = platform.machine().lower()
    fitting = [each for each in folder.resolve().glob("*.whl") if each.stem.lower().endswith(machine)]
    if len(fitting) != 1:
        sys.exit(f"try_package: {folder} holds {len(fitting)} wheels for {machine}; build one into it first")
    return fitting[0]


def main() -> int:
    """Installs, uses, and reports the outcome."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="with the wheel for this machine")
    parser.add_argument("--extra", default="", help="to install with it, such as `all`")
    asked = parser.parse_args()
    wheel = wheel_for_here(asked.folder)
    with tempfile.TemporaryDirectory() as folder:
        environment = Path(folder) / "environment"
        venv.create(environment, with_pip=True)
        programs = environment / ("Scripts" if os.name == "nt" else "bin")
        python = programs / ("python.exe" if os.name == "nt" else "python")
        # Nothing of this repository may be found but what the package brings.
        kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        variables = {**kept, "PATH": path_without_rust(programs), "PYTHONUTF8": "1"}
        wanted = f"{wheel}[{asked.extra}]" if asked.extra else str(wheel)
        install = [str(python), "-m", "pip", "--disable-pip-version-check", "install", "--quiet", wanted]
        subprocess.run(install, env=variables, cwd=folder, check=True)
        shutil.copy(NEWCOMER, folder)
        return subprocess.run([python, NEWCOMER.name], env=variables, cwd=folder, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
