"""Run targets of make, print the time and the processor seconds of each, hold these against a budget.

`timed_make.py test-rust+test-tools test-python` makes the first two side by side, then the third. With
CI=true it fails where they take more than the tolerated multiple of their budget. Processor seconds depend
little on what else the computer does. They depend on its speed, and that of a virtual machine changes within
minutes, so the budget counts in units of a fixed task that is run here before and after each step.
"""

from __future__ import annotations

import bz2
import os
import resource
import subprocess
import sys
import time
from dataclasses import dataclass, replace

BUDGET = {
    "test-rust": 1100.0,
    "test-tools": 330.0,
    "build": 640.0,
    "core-of-page": 180.0,
    "test-python": 4900.0,
    "test-commands": 600.0,
}
"""Units that each target takes on a fresh clone, the most of quiet virtual machines of two cores. The same
commit took a third to two thirds of these on another one.

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
    speed: float = 1.0
    """s of processor that a unit took beside it: the mean of before and after its step."""

    @property
    def units(self) -> float:
        """Units of processor time that it took."""
        return self.processor / self.speed


def unit() -> float:
    """Processor seconds of the fixed task, the least of three.

    bzip2 compresses a megabyte, which computes, and an interpreter starts, which reads files and maps
    memory, as most of what tests run.
    """
    text = bytes((i * i >> 3) % 251 for i in range(1 << 20))
    return min(_processor_seconds(text) for _ in range(3))


def _processor_seconds(text: bytes) -> float:
    began = _spent()
    bz2.compress(text)
    subprocess.run([sys.executable, "-c", "import asyncio, sqlite3, numpy"], check=True)
    return _spent() - began


def _spent() -> float:
    """Processor seconds of this process and of those that it awaited."""
    each = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in each)


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


def over_budget(made: list[Made]) -> list[str]:
    """Returns a line for each target over its budget."""
    return [
        f"{each.target} took {each.units:.0f} units of processor time, more than {TOLERANCE:g} "
        f"times the {BUDGET[each.target]:.0f} of its budget; shorten it, or give the new figure in "
        "scripts/timed_make.py"
        for each in made
        if each.units > TOLERANCE * BUDGET[each.target]
    ]


def main(steps: list[str]) -> int:
    """Makes one step after the other until one fails; 1 for a target that failed or is over its budget."""
    before, made = unit(), list[Made]()
    for step in steps:
        of_step = make(step.split("+"))
        after = unit()
        made += [replace(each, speed=0.5 * (before + after)) for each in of_step]
        before = after
        if any(each.code for each in made):
            break
    print(f"\n{'target':<16}{'wall s':>9}{'processor s':>13}{'s a unit':>10}{'units':>8}{'budget':>8}")
    for each in made:
        print(
            f"{each.target:<16}{each.wall:>9.0f}{each.processor:>13.0f}"
            f"{each.speed:>10.3f}{each.units:>8.0f}{BUDGET[each.target]:>8.0f}"
        )
    print(f"{'together':<16}{'':>9}{sum(each.processor for each in made):>13.0f}")
    if any(each.code for each in made):
        return 1
    late = over_budget(made)
    for line in late:
        print(line, file=sys.stderr)
    return int(bool(late) and os.environ.get("CI") == "true")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
