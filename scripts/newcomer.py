"""First steps of a newcomer with an installed Tumble, each checked; runs in an empty folder.

It needs nothing but the installed package: the repository need not be there.
"""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import resources
from pathlib import Path

import numpy as np
import yaml

import tumble

MOST_SIGMAS = 6.0
"""That a bias may be from the truth."""


def typed(*words: str) -> str:
    """Types a command; what it prints."""
    print(f"$ tumble {' '.join(words)}", flush=True)
    command = [str(Path(sys.executable).with_name("tumble")), *words]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0, f"exit code {done.returncode}: {done.stdout}{done.stderr}"
    return done.stdout


def look() -> None:
    """Checks that the package is that of this environment, with types, and in order."""
    diagnosis = json.loads(typed("doctor", "--json"))
    assert diagnosis["works"], diagnosis
    assert Path(tumble.__file__).is_relative_to(sys.prefix), tumble.__file__
    assert (resources.files("tumble") / "py.typed").is_file()
    assert typed("--version").split()[-1] == tumble.__version__
    assert json.loads(typed("schema", "calibration"))["$id"].startswith("urn:tumble-calibration")


def demonstrate() -> None:
    """Runs the demo, which calibrates and writes its page."""
    said = typed("demo", "-o", "demo")
    assert "4 pass, 1 fail" in said, said
    assert "</html>" in Path("demo/turntable.html").read_text(encoding="utf-8")


def calibrate() -> None:
    """Finds the biases that a simulated robot was made with, and hands them to another program."""
    typed("simulate", "spin", "--floor-tilt", "2", "--seed", "7", "-o", "robot")
    typed("spin", "robot/spin.csv", "-o", "results")
    found = yaml.safe_load(Path("results/spin.yaml").read_text(encoding="utf-8"))
    truth = yaml.safe_load(Path("robot/truth.yaml").read_text(encoding="utf-8"))
    for triad in ("accelerometer", "gyroscope"):
        error = np.subtract(found[triad]["b"], truth[f"{triad}_bias"])
        assert np.all(np.abs(error) < MOST_SIGMAS * np.array(found[triad]["sigma"]["bias"])), (triad, error)
    typed("export", "results/spin.yaml", "--format", "ardupilot", "-o", "robot.param")
    assert "INS_" in Path("robot.param").read_text(encoding="utf-8")


def main() -> None:
    """Runs all steps."""
    for step in (look, demonstrate, calibrate):
        step()
    print(f"tumble {tumble.__version__} on Python {sys.version.split()[0]}: works")


if __name__ == "__main__":
    main()
