"""Certificates: time from a result in the registry to signed PDF and XML, by the command.

`python -m benchmarks.certificates [--units 100]`

The first certificate of a process loads fonts and libraries; the time of each further one is that of
a run of many less one of one, over their number.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.registry import results
from tumble.laboratory.certificate.signing_key import make_key
from tumble.laboratory.registry import Registry

GOAL = 0.5
"""s for a certificate."""
SETTINGS = """\
laboratory = "Inertial laboratory"
address = "1 Gyro Street, 12345 Town"
country = "DE"
authorised_by = "Dr. Bob"
customer = "Acme Robotics"
customer_address = "2 Wheel Road, 54321 City"
registry = "lab.db"
"""


def issued(folder: Path, *words: str) -> float:
    """Run `tumble certificate` in a folder and return the time that it took, s."""
    begin = time.perf_counter()
    command = [sys.executable, "-m", "tumble", "certificate", *words]
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin


def measured(units: int, folder: Path, *words: str) -> tuple[float, float]:
    """Return the time of a command for one unit, and of each further certificate, s."""
    folder.mkdir()
    (folder / "tumble.toml").write_text(SETTINGS)
    made = results(units + 1, folder / "results", operator="Ann")
    registry = Registry.create(folder / "lab.db")
    registry.add(made)
    one = issued(folder, "0", *words)
    return one, (issued(folder, "results", *words) - one) / units


def main() -> int:
    """Measure and print; 1 if a certificate takes longer than its goal."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=100, help="certificates")
    units = parser.parse_args().units
    table = Table("certificate", "one, with the start of the command, s", f"each of {units} more, s")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        make_key(folder / "key.pem", "Inertial laboratory")
        found = {
            "PDF/A-3 and XML": measured(units, folder / "plain"),
            "signed": measured(units, folder / "signed", "--signing-key", str(folder / "key.pem")),
        }
    for name, (one, each) in found.items():
        table.add_row(name, f"{one:.2f}", f"{each:.3f}")
    Console(width=100).print(table)
    return any(each > GOAL for _, each in found.values())


if __name__ == "__main__":
    sys.exit(main())
