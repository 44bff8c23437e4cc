"""Every procedure as it is typed, on logs whose stamps are dates: what its pages and its screen show."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from decimal import Decimal

from tumble.foundation.procedures import PROCEDURES
from turntable_sessions import typed

EPOCH = 1777900930
"""s since 1970 of `START`, at which all logs begin."""
START = "2026-05-04 13:22:10 UTC"
QUICK = {
    "turntable": ("--grades", "consumer,industrial"),
    "static": ("--duration", "600", "--rate", "50"),
    "thermal": ("--rate", "20"),
}
"""Options of some recordings, so that none is long."""


JSON_IS_READ = ("spin", "redundancy", "multipose")
"""Procedures that are run once more with `--json`."""


@dataclass(frozen=True)
class Shown:
    """Output of one command: its pages by name, what it printed, and its JSON where a test reads it."""

    pages: dict[str, str]
    screen: str
    json: str


def shown_by_all(folder):
    """Runs every procedure on dated logs, and returns what it shows, by the word it is called by."""
    for kind in dict.fromkeys(row.simulated for row in PROCEDURES):
        done = typed("simulate", kind, "--seed", "7", *QUICK.get(kind, ()), "-o", folder / kind)
        assert done.code == 0, done.err
    for log in sorted(folder.glob("*/*.csv")):
        give_date(log)
    shown = {row.word: _shown(row.word, words_of(row, folder), folder) for row in PROCEDURES}
    both = (folder / "out/turntable/target_1.yaml", folder / "out/turntable/target_2.yaml")
    log, calibration = folder / "turntable/target_1.csv", folder / "out/turntable/target_1.yaml"
    applied = typed("apply", calibration, log, "-o", folder / "corrected.csv")
    inspected = typed("inspect", *sorted(folder.glob("*/*.csv")))
    return shown | {
        "compare": _shown("compare", both, folder),
        "apply": Shown({}, applied.out + applied.err, ""),
        "inspect": Shown({}, inspected.out + inspected.err, ""),
    }


def words_of(row, folder):
    """Give what the command of a procedure is given of the recordings in a folder."""
    return shlex.split(row.typed.format(folder / row.simulated))


def give_date(log):
    """Moves the stamps of a log, the first column, to `START`."""
    lines = log.read_text().splitlines()
    comments = [line for line in lines if line.startswith("#")]
    head, *rows = lines[len(comments) :]
    moved = (f"{Decimal(time) + EPOCH},{rest}" for time, _, rest in (row.partition(",") for row in rows))
    log.write_text("\n".join([*comments, head, *moved]) + "\n")


def _shown(procedure, given, folder):
    out = folder / "out" / procedure
    done = typed(procedure, *given, "-o", out)
    assert done.code in (0, 3), done.err
    pages = {path.name: path.read_text() for path in out.glob("*.html")}
    told = ""
    if procedure in JSON_IS_READ:
        told = typed(procedure, *given, "-o", folder / "json" / procedure, "--json").out
    return Shown(pages, done.out + done.err, told)
