"""Run the tests of Python repeatedly, in random order and beside busy loops; print how often they passed.

`repeat_tests.py --times 20 --busy 16` is the proof that no test needs a quiet computer. Arguments after
`--` go to pytest: folders, or `--numprocesses 1`.
"""

from __future__ import annotations

import argparse
import multiprocessing
import random
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[1]


def loop() -> None:
    """Keeps a core busy until it is ended."""
    while True:
        pass


@contextmanager
def busy(loops: int) -> Iterator[None]:
    """Loops run beside the block."""
    running = [multiprocessing.Process(target=loop, daemon=True) for _ in range(loops)]
    for process in running:
        process.start()
    try:
        yield
    finally:
        for process in running:
            process.kill()


def run(seed: int | None, words: list[str]) -> tuple[bool, str]:
    """Runs the tests once; returns whether they passed, and the last line of pytest."""
    order = [] if seed is None else ["--random-order", f"--random-order-seed={seed}"]
    given = (
        words if any(word.startswith(("-n", "--numprocesses")) for word in words) else [*words, "-n", "auto"]
    )
    command = [sys.executable, "-m", "pytest", "-q", *order, *given]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    lines = done.stdout.strip().splitlines() or [done.stderr.strip()]
    failed = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    return done.returncode == 0, "\n    ".join([lines[-1], *failed])


def main() -> int:
    """Runs them so many times; 1 if they failed once."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=20, help="runs")
    parser.add_argument("--busy", type=int, default=0, help="busy loops beside them")
    parser.add_argument("--ordered", action="store_true", help="keep the usual order")
    parser.add_argument("words", nargs="*", help="arguments of pytest, after --")
    given = parser.parse_args()
    passed = 0
    with busy(given.busy):
        for number in range(given.times):
            seed = None if given.ordered else random.SystemRandom().randrange(1 << 31)
            is_passed, line = run(seed, given.words)
            passed += is_passed
            print(f"run {number + 1}, seed {seed}: {line}", flush=True)
    print(f"{passed} of {given.times} runs passed beside {given.busy} busy loops")
    return int(passed < given.times)


if __name__ == "__main__":
    sys.exit(main())
