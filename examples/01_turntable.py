"""A turntable session from the command line: simulate, calibrate, compare the results with the truth.

    python examples/01_turntable.py [FOLDER]

A reference and five targets of different grades stand on one structure. One axis of target_5 reads 10 % too
much, so it fails its limits, and `tumble turntable` says so with exit code 3.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import yaml

from tumble import Calibration

LIMITS = Path(os.path.relpath(Path(__file__).with_name("limits.yaml")))
GRADES = ("consumer", "consumer", "industrial", "tactical", "industrial")
FAULTY = "target_5"
SOME_FAILED = 3

LARGEST_MATRIX_ERROR = 1e-3
"""Of a consumer-grade unit: five times what its noise explains."""


def main() -> None:
    """Simulate, calibrate, compare."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out/demo")
    session = folder / "session"
    recordings = [session / f"{name}.csv" for name in ("reference", *target_names())]
    fault = f"{FAULTY}:scale:axis=y:size=1.1"

    scene = ("--grades", ",".join(GRADES), "--fault", fault, "--clocks", "apart", "--seed", "7")
    tumble("simulate", "turntable", *scene, "-o", session)
    print()
    options = ("--poses", session / "poses.yaml", "--limits", LIMITS, "--g-sensitivity", "-o", folder)
    tumble("turntable", *recordings, *options, expected=SOME_FAILED)
    print()
    compare(folder, session)
    print(f"\nNow open {folder / 'turntable.html'}")


def target_names() -> list[str]:
    """Names that the simulator gives to targets."""
    return [f"target_{number}" for number in range(1, len(GRADES) + 1)]


def tumble(*arguments: str | Path, expected: int = 0) -> None:
    """Show a command, run it, and stop where its exit code is not the one expected."""
    words = [os.fspath(argument) for argument in arguments]
    print(f"$ tumble {shlex.join(words)}", flush=True)
    done = subprocess.run([Path(sys.executable).with_name("tumble"), *words], check=False)
    if done.returncode != expected:
        sys.exit(f"tumble {words[0]} ended with exit code {done.returncode}, not {expected}")


def compare(folder: Path, session: Path) -> None:
    """Compare every calibration with the truth of the simulator."""
    truth = yaml.safe_load((session / "truth.yaml").read_text(encoding="utf-8"))["units"]
    print("Largest difference from the truth, accelerometer and gyroscope:")
    for name in target_names():
        calibration = Calibration.load(folder / f"{name}.yaml")
        errors = []
        triads = (("accelerometer", calibration.accelerometer), ("gyroscope", calibration.gyroscope))
        for kind, found in triads:
            assert found is not None
            matrix = np.abs(found.M - truth[name][kind]["M"]).max()
            true_bias = np.add(truth[name][kind]["b"], truth[name][kind]["drift"])
            bias = np.abs(found.b - true_bias).max()
            assert matrix < LARGEST_MATRIX_ERROR, f"{name} {kind}: M is off by {matrix:.1e}"
            errors.append(f"M {matrix:.1e}, b {bias:.1e} {found.unit}")
        print(f"  {name} ({truth[name]['grade']}): " + "; ".join(errors))


if __name__ == "__main__":
    main()
