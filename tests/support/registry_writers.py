"""Programs that write into one registry at once, and are killed at any moment."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
from pathlib import Path

from made_up_calibrations import made_up, save
from patience import PATIENCE
from tumble.laboratory.registry import Registry

WRITER = """
import sys
from tumble.laboratory.registry import Registry
address, *folders = sys.argv[1:]
registry = Registry(address, patience=120.0)
print("ready", flush=True)
for folder in folders:
    (added,) = registry.add(folder)
    print(added.identity, flush=True)
"""


def start(address, folders) -> subprocess.Popen[str]:
    """Start a program that adds results one by one and prints each identity once it is in."""
    words = [sys.executable, "-c", WRITER, str(address), *map(str, folders)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, text=True)


def compete(address, folder: Path, *, writers: int, results: int, kills: int, seed: int) -> None:
    """Let writers add the same results in other orders, kill some and start them again.

    Raises `AssertionError` where a result is missing or there twice, or the chain is broken.
    """
    print("seed", seed)
    drawn = random.Random(seed)
    folders = [save(folder / f"{n}", made_up(serial=str(n), log=f"log {n}")) for n in range(results)]
    acknowledged: set[str] = set()
    running = [start(address, drawn.sample(folders, results)) for _ in range(writers)]
    for _ in range(kills):
        victim = running.pop(drawn.randrange(len(running)))
        # It goes on while its lines are read, so that it is killed in the midst of something.
        first = [victim.stdout.readline().strip() for _ in range(drawn.randint(0, results))]
        victim.send_signal(signal.SIGKILL)
        acknowledged |= {*filter(is_identity, first), *said(victim)}
        running.append(start(address, drawn.sample(folders, results)))
    for each in running:
        acknowledged |= said(each)
        assert each.returncode == 0
    registry = Registry(address)
    listed = [row["calibration"] for row in registry.list()]
    assert len(listed) == len(set(listed)) == results
    assert acknowledged == set(listed)
    assert len(registry.units()) == results
    found = registry.verify()
    assert found.intact, found.faults
    assert found.entries == results + 1


def said(writer: subprocess.Popen[str]) -> set[str]:
    """Identities that a program printed in whole before its end."""
    out, _ = writer.communicate(timeout=PATIENCE)
    return set(filter(is_identity, out.splitlines()))


def is_identity(line: str) -> bool:
    """Return whether a line is the identity of a result, in whole."""
    return len(line) == 64
