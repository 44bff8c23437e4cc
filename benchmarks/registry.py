"""The registry: cost of entering, and of questions about one unit as it grows.

`python -m benchmarks.registry [--most 1000000] [--enter 500]`

Large registries are filled with rows straight into their tables, ten calibrations a unit; a question is held
against a bare query of the driver for the same rows.
"""

from __future__ import annotations

import argparse
import hashlib
import sqlite3
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

from rich.console import Console
from rich.table import Table

import tumble
from tumble.laboratory.registry import Registry

LARGEST_GROWTH = 1.5
"""Time of a question at the largest size over that at the smallest."""
FEWEST, OF_A_UNIT, PARAMETERS, REPEATS = 1000, 10, 24, 15
_UNIT = 7
"""The unit that is asked about."""
_BARE = """
SELECT p.name, p.value, p.u, p.common, p.measured FROM calibration c JOIN parameter p
ON p.calibration = c.calibration WHERE c.unit = ? ORDER BY p.measured
"""


def digest(*words: object) -> str:
    """Give a hash that stands for an identity."""
    return hashlib.sha256(repr(words).encode()).hexdigest()


def fill(path: Path, calibrations: int) -> None:
    """Make a registry of so many calibrations, every ten of one unit, a thousand units of a model."""
    Registry.create(path)
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA synchronous = OFF")
        connection.execute("INSERT INTO document VALUES (?, 1, 'calibration', 1)", (digest(),))
        connection.executemany(
            "INSERT INTO unit (unit, entry, name, serial, manufacturer, model, lot, identities, owner, "
            "state) VALUES (?, 1, ?, ?, '', ?, '', '[]', '', 'in service')",
            (
                (digest(n)[:32], f"u{n}", f"{n:07d}", f"M{n // 1000}")
                for n in range(calibrations // OF_A_UNIT)
            ),
        )
        connection.executemany(
            "INSERT INTO session (session, entry, procedure, station, operator, software, options, began) "
            "VALUES (?, 1, 'turntable', '', '', '', '{}', '')",
            ((digest("s", n),) for n in range(calibrations // OF_A_UNIT)),
        )
        connection.executemany(
            "INSERT INTO calibration (calibration, entry, unit, session, date, verdict, condition, document) "
            "VALUES (?, 1, ?, ?, ?, 'pass', '', ?)",
            (
                (digest("c", n, k), digest(n)[:32], digest("s", n), date(k), digest())
                for n in range(calibrations // OF_A_UNIT)
                for k in range(OF_A_UNIT)
            ),
        )
        connection.executemany(
            "INSERT INTO parameter (calibration, name, entry, value, u, common, unit, origin, measured) "
            "VALUES (?, ?, 1, ?, 0.001, 0.0, 'm/s^2', ?, ?)",
            parameters(calibrations),
        )
        connection.commit()


def parameters(calibrations: int) -> Iterator[tuple[object, ...]]:
    """Give rows of parameters; those of all but the first thousand units are short, which saves an hour."""
    for n in range(calibrations // OF_A_UNIT):
        for k in range(OF_A_UNIT):
            for j in range(PARAMETERS if n < 1000 else 1):
                yield (
                    digest("c", n, k),
                    f"accelerometer bias {j}",
                    (n * k * j) % 17 * 1e-3,
                    f"{n}-{k}",
                    date(k),
                )


def date(k: int) -> str:
    """Give the date of the k-th calibration of a unit."""
    return f"20{10 + k}-03-01T00:00:00Z"


def seconds(ask: Callable[[], object]) -> float:
    """Give the shortest of some times, s."""
    found = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        ask()
        found.append(time.perf_counter() - begin)
    return min(found)


def questions(path: Path) -> dict[str, float]:
    """Time each question, and the bare query, s."""
    registry, serial, key = Registry(path), f"{_UNIT:07d}", digest(_UNIT)[:32]

    def bare() -> object:
        with closing(sqlite3.connect(path)) as connection:
            return connection.execute(_BARE, (key,)).fetchall()

    return {
        "show": seconds(lambda: registry.show(serial)),
        "list": seconds(lambda: registry.list(serial=serial)),
        "history": seconds(lambda: registry.history(serial)),
        "bare": seconds(bare),
    }


def results(count: int, folder: Path, operator: str = "") -> Path:
    """Write results as a production line does, each with its page: one calibration under other serials."""
    session = tumble.simulate_turntable(seed=5)
    found = tumble.turntable(session.reference, session.targets)
    found.save(folder)
    made = folder / "target_1.yaml"
    calibration, page = tumble.Calibration.load(made), made.with_suffix(".html").read_bytes()
    for each in folder.glob("target_*.yaml"):
        each.unlink()
    for n in range(count):
        log = {**calibration.content()["log"], "sha256": digest(n)}
        changed = calibration.content() | {"serial": str(n), "log": log, "operator": operator}
        tumble.Calibration.model_validate(changed).save(folder / f"unit_{n}.yaml")
        (folder / f"unit_{n}.html").write_bytes(page + b"<!-- %d -->" % n)
    return folder


def entering(count: int, folder: Path) -> tuple[float, float]:
    """Time the entering of results: s each, by the clock and of the processor."""
    made = results(count, folder / "results")
    registry = Registry.create(folder / "enter.db")
    begin = time.perf_counter(), time.process_time()
    registry.add(made)
    return (time.perf_counter() - begin[0]) / count, (time.process_time() - begin[1]) / count


def main() -> int:
    """Measure and print; 1 if a question takes too much longer of a large registry."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--most", type=int, default=1_000_000)
    parser.add_argument("--enter", type=int, default=500)
    stated = parser.parse_args()
    table = Table("calibrations", "show, ms", "list, ms", "history, ms", "bare query, ms")
    found: list[dict[str, float]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        clock, processor = entering(stated.enter, folder)
        for size in (FEWEST, stated.most):
            path = folder / f"{size}.db"
            fill(path, size)
            found.append(questions(path))
            table.add_row(str(size), *(f"{1e3 * each:.2f}" for each in found[-1].values()))
    Console().print(table)
    print(f"entering: {1e3 * clock:.1f} ms a result, {1e3 * processor:.1f} ms of processor")
    return int(any(found[1][name] > LARGEST_GROWTH * found[0][name] for name in ("show", "list", "history")))


if __name__ == "__main__":
    sys.exit(main())
