"""Fleets: cost beside a plain loop, memory of the driver, simulated sessions on two nodes, random kills.

`python -m benchmarks.fleet figures [--logs 150] [--most 100000]`
`python -m benchmarks.fleet sessions [--count 100000] [--seed 0]`
`python -m benchmarks.fleet kills [--minutes 10] [--most 100] [--seed 0]`
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from rich.console import Console

from benchmarks.fleet_sessions import SESSIONS, sessions
from benchmarks.results import save


def main() -> int:
    """Measures one part, prints and saves it."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parts = parser.add_subparsers(dest="part", required=True)
    of_sessions = parts.add_parser("sessions")
    of_sessions.add_argument("--count", type=int, default=SESSIONS)
    of_sessions.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        content = sessions(options.count, Path(name), options.seed)
    Console().print(content)
    save(f"fleet_{options.part}", content)
    return 0


if __name__ == "__main__":
    sys.exit(main())
