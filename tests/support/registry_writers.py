"""Programs that write into one registry at once, and are killed at any moment."""

from __future__ import annotations

import random
from pathlib import Path

from forked_stations import Station
from made_up_calibrations import made_up, save
from tumble.laboratory.registry import Registry


def write(report, address, folders):
    """Adds results one by one and reports each identity once it is in."""
    registry = Registry(address, patience=120.0)
    report("ready")
    for folder in folders:
        (added,) = registry.add(folder)
        report(added.identity)


def compete(address, folder: Path, *, writers: int, results: int, kills: int, seed: int) -> None:
    """Let writers add the same results in other orders, kill some and start them again.

    Raises `AssertionError` where a result is missing or there twice, or the chain is broken.
    """
    print("seed", seed)
    drawn = random.Random(seed)
    folders = [save(folder / f"{n}", made_up(serial=str(n), log=f"log {n}")) for n in range(results)]
    acknowledged: set[str] = set()
    running = [Station(write, str(address), drawn.sample(folders, results)) for _ in range(writers)]
    for _ in range(kills):
        victim = running.pop(drawn.randrange(len(running)))
        # It goes on while it is received, so that it is killed in the midst of something.
        first = [victim.receive() for _ in range(drawn.randint(0, results))]
        victim.kill()
        acknowledged |= identities(first) | identities(victim.receive_all())
        running.append(Station(write, str(address), drawn.sample(folders, results)))
    for each in running:
        acknowledged |= identities(each.receive_all())
        assert each.exit_code == 0
    registry = Registry(address)
    listed = [row["calibration"] for row in registry.list()]
    assert len(listed) == len(set(listed)) == results
    assert acknowledged == set(listed)
    assert len(registry.units()) == results
    found = registry.verify()
    assert found.intact, found.faults
    assert found.entries == results + 1


def identities(received) -> set[str]:
    """Identities among texts that a writer reported; one that was killed reported none at its end."""
    return {text for text in received if text is not None and len(text) == 64}
