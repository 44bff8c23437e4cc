"""`tumble demo`: the commands of a turntable session, shown and run, and what they found beside the truth."""

from __future__ import annotations

import shlex
from pathlib import Path

from tumble.cli.commands import run_command
from tumble.cli.exit_code import ExitCode
from tumble.cli.output import OutputFolder, folder_named_after

DEMO = "demo"


def demo_command(output: OutputFolder = None) -> None:
    """Calibrate a simulated turntable session, one target of it faulty, and compare with the truth.

    Example: tumble demo -o demo

    Shows each command before it is run. The report is turntable.html.
    """
    from tumble.tools.demo.comparison import differences
    from tumble.tools.demo.scene import calibrating, simulating, write_limits

    folder = output or folder_named_after(DEMO)
    write_limits(folder)
    _run(simulating(folder))
    print()
    _run(calibrating(folder), expected=ExitCode.NOT_ALL_WELL)
    print("\nLargest difference from the truth, accelerometer and gyroscope:")
    for each in differences(folder):
        print(f"  {each.line()}")
    print(f"\nNow open {Path(folder) / 'turntable.html'}")


def _run(words: list[str], expected: int = 0) -> None:
    print(f"$ tumble {shlex.join(words)}", flush=True)
    code = run_command(words)
    if code != expected:
        raise AssertionError(f"tumble {words[0]} ended with exit code {code}, not {expected}")
