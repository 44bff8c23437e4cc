"""Fleets: cost beside a plain loop, memory of the driver, simulated sessions on two nodes, random kills.

`python -m benchmarks.fleet figures [--logs 500] [--most 100000]`
`python -m benchmarks.fleet sessions [--count 100000] [--seed 0]`
`python -m benchmarks.fleet kills [--minutes 10] [--most 100] [--seed 0]`
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from rich.console import Console

from benchmarks.fleet_figures import LOGS, MOST, drive, figures
from benchmarks.fleet_kills import KILLS, MINUTES, kills
from benchmarks.fleet_sessions import SESSIONS, sessions
from benchmarks.results import Content, save


def main() -> int:
    """Measures one part, prints and saves it."""
    options = _parser().parse_args()
    if options.part == "drive":
        print(drive(options.inputs))
        return 0
    with tempfile.TemporaryDirectory() as name:
        content = _measured(options, Path(name))
    Console().print(content)
    save("fleet" if options.part == "figures" else f"fleet_{options.part}", content)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parts = parser.add_subparsers(dest="part", required=True)
    of_figures = parts.add_parser("figures", help="beside a plain loop and one worker; memory; model of cost")
    of_figures.add_argument("--logs", type=int, default=LOGS)
    of_figures.add_argument("--most", type=int, default=MOST)
    of_sessions = parts.add_parser("sessions", help="simulated sessions on two nodes, one of them killed")
    of_sessions.add_argument("--count", type=int, default=SESSIONS)
    of_sessions.add_argument("--seed", type=int, default=0)
    of_kills = parts.add_parser("kills", help="workers, nodes and drivers killed at random")
    of_kills.add_argument("--minutes", type=float, default=MINUTES)
    of_kills.add_argument("--most", type=int, default=KILLS)
    of_kills.add_argument("--seed", type=int, default=0)
    of_drive = parts.add_parser("drive", help="a driver of empty inputs, whose memory is printed")
    of_drive.add_argument("inputs", type=int)
    return parser


def _measured(options: argparse.Namespace, folder: Path) -> Content:
    if options.part == "figures":
        return figures(options.logs, options.most)
    if options.part == "sessions":
        return sessions(options.count, folder, options.seed)
    return kills(options.minutes, options.most, folder, options.seed)


if __name__ == "__main__":
    sys.exit(main())
