"""Run targets of make, print the time and the processor seconds of each, hold these against a budget.

`timed_make.py test-rust+test-tools test-python` makes the first two side by side, then the third. With
CI=true it fails where they take more than the tolerated multiple of their budget. Processor seconds depend
little on what else the computer does. They depend on its speed, so the budget counts in units of a fixed
task that is run here.
"""

from __future__ import annotations

import bz2
import os
import subprocess
import sys
import time
from dataclasses import dataclass

BUDGET = {
    "test-rust": 2000.0,
    "test-tools": 600.0,
    "build": 1150.0,
    "core-of-page": 320.0,
    "test-python": 8900.0,
    "test-commands": 800.0,
}
"""Units that each target takes on a fresh clone, measured on a quiet virtual machine of two cores.

Tools take theirs where none was installed.
"""

TOLERANCE = 1.5
"""Multiple of its budget at which a target fails, above what computers differ by in units."""


@dataclass(frozen=True, slots=True)
class Made:
    """A target of make that has ended."""

    target: str
    code: int
    wall: float
    """s from its start to its end."""
    processor: float
    """s of processor of all programs that it ran."""


def unit() -> float:
    """Processor seconds of the fixed task: bzip2 compresses a megabyte, which sorts, counts and compares."""
    text = bytes((i * i >> 3) % 251 for i in range(1 << 20))
    return min(_processor_seconds(text) for _ in range(3))


def _processor_seconds(text: bytes) -> float:
    began = time.process_time()
    bz2.compress(text)
    return time.process_time() - began


def make(targets: list[str]) -> list[Made]:
    """Makes targets side by side; returns them in the order in which they end."""
    command = [os.environ.get("MAKE", "make"), "--no-print-directory"]
    began = time.monotonic()
    # A process that nothing refers to is awaited by the next one that begins.
    begun = [subprocess.Popen([*command, target]) for target in targets]
    running = {process.pid: target for process, target in zip(begun, targets, strict=True)}
    made = []
    while running:
        pid, status, usage = os.wait4(-1, 0)
        if (target := running.pop(pid, None)) is not None:
            code = os.waitstatus_to_exitcode(status)
            processor = usage.ru_utime + usage.ru_stime
            made.append(Made(target, code, time.monotonic() - began, processor))
    return made


def over_budget(made: list[Made], speed: float) -> list[str]:
    """Returns a line for each target over its budget, where a unit takes `speed` processor seconds."""
    return [
        f"{each.target} took {each.processor / speed:.0f} units of processor time, more than {TOLERANCE:g} "
        f"times the {BUDGET[each.target]:.0f} of its budget; shorten it, or give the new figure in "
        "scripts/timed_make.py"
        for each in made
        if each.processor / speed > TOLERANCE * BUDGET[each.target]
    ]


def main(steps: list[str]) -> int:
    """Makes one step after the other until one fails; 1 for a target that failed or is over its budget."""
    speed, made = unit(), list[Made]()
    for step in steps:
        made += make(step.split("+"))
        if any(each.code for each in made):
            break
    print(f"\n{'target':<16}{'wall s':>9}{'processor s':>13}{'units':>8}{'budget':>8}")
    for each in made:
        units, budget = each.processor / speed, BUDGET[each.target]
        print(f"{each.target:<16}{each.wall:>9.0f}{each.processor:>13.0f}{units:>8.0f}{budget:>8.0f}")
    print(f"{'together':<16}{'':>9}{sum(each.processor for each in made):>13.0f}; one unit is {speed:.3f} s")
    if any(each.code for each in made):
        return 1
    late = over_budget(made, speed)
    for line in late:
        print(line, file=sys.stderr)
    return int(bool(late) and os.environ.get("CI") == "true")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
