"""Simulated turntable sessions, the command as it is typed, and what both are held against."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import chi2

import tumble
from tumble.foundation.recording import Chunk
from tumble.tools.simulate import simulate_turntable, write_turntable
from typed_commands import Done, typed

__all__ = ["Done", "typed"]

QUICK = {
    "rate_hz": 100.0,
    "rest_seconds": 4.0,
    "turn_rate_dps": 90.0,
    "turn_acceleration_dps2": 180.0,
    "bias_instability": False,
    "g_sensitivity": False,
    "perfect_reference": True,
}
"""Forty seconds at six faces, with white noise alone and a reference whose only errors are bias and noise."""

PARAMETERS = 12
UNLIKELY = 1e-5
"""Chance of a chi-square beyond its gate, were the sigmas right."""


def simulate(seed, **changes):
    """A short session; the seed is printed for whoever has to look at a failure."""
    print(f"seed {seed}")
    return simulate_turntable(seed=seed, **{**QUICK, **changes})


def calibrate(session, **options):
    return tumble.turntable(session.reference, session.targets, **options)


def refusal(*arguments):
    """The one line with which `tumble turntable` ends when nothing can be done."""
    done = typed("turntable", *arguments)
    assert done.code == 2, f"exit code {done.code}: {done.out}{done.err}"
    assert done.out == ""
    return one_line(done.err)


def one_line(text):
    assert text.startswith("tumble: error: ")
    assert text.count("\n") == 1, f"more than one line: {text}"
    assert "Traceback" not in text
    return text.removeprefix("tumble: error: ").rstrip("\n")


def calibrated(*arguments, code=0):
    """Runs `tumble turntable` where it is to end well, or with exit code 3."""
    done = typed("turntable", *arguments)
    assert done.code == code, f"exit code {done.code}: {done.out}{done.err}"
    return done


def rows(folder):
    """`summary.csv` by target."""
    with (folder / "summary.csv").open(newline="", encoding="utf-8") as file:
        return {row["target"]: row for row in csv.DictReader(file)}


def contents(folder):
    """Every file below a folder, byte for byte."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(Path(folder).rglob("*"))
        if path.is_file()
    }


def write(session, folder, log_format="csv"):
    """Logs, poses and truth of a session; the paths of the logs, the reference first."""
    paths = write_turntable(session, folder, log_format)
    return [paths[unit.name] for unit in session.units]


def errors(unit, found, triad):
    """(12,) estimated less true [M row by row, b]; the bias is its mean over the recording."""
    true, result = getattr(unit, triad), getattr(found, triad)
    return np.concatenate([(result.M - true.M).ravel(), result.b - true.b - true.drift])


def chi_square(unit, found, triad):
    """Errors of the 12 parameters against their covariance."""
    off = errors(unit, found, triad)
    return float(off @ np.linalg.solve(getattr(found, triad).covariance, off))


def assert_within_sigmas(squares, freedom, what):
    """A sum of chi-squares is neither larger nor, by much, smaller than its degrees of freedom allow."""
    largest = chi2.isf(UNLIKELY, freedom)
    assert squares < largest, f"{what}: chi-square {squares:.1f} for {freedom}, allowed {largest:.1f}"
    assert squares > 0.4 * freedom, f"{what}: chi-square {squares:.1f} for {freedom}: the sigmas are too wide"


def assert_recovered(session, result):
    """Every target of a session is calibrated to the truth within the sigmas stated."""
    squares = 0.0
    for unit in session.target_units:
        found = result[unit.name]
        assert found.failure == ""
        for triad in ("accelerometer", "gyroscope"):
            here = chi_square(unit, found, triad)
            largest = chi2.isf(UNLIKELY, PARAMETERS)
            assert here < largest, f"{unit.name} {triad}: chi-square {here:.1f} for 12, allowed {largest:.1f}"
            squares += here
    return squares


NAMES = ("x_up", "x_down", "y_up", "y_down", "z_up", "z_down")
"""Files of the six faces, in the order in which a session takes them."""


def columns(chunk):
    """(n, 7) time, specific force, angular rate."""
    return np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope])


def write_table(path, table, header="time,ax,ay,az,gx,gy,gz"):
    """Writes rows of numbers as CSV, as any logger does."""
    lines = [",".join(map(repr, row)) for row in table.tolist()]
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def write_poses(session, unit, folder, names=NAMES, seconds=3.0, log_format="csv"):
    """One file a pose, each on a clock of its own that starts at zero."""
    folder.mkdir()
    samples = session[unit].samples
    lengths = np.broadcast_to(seconds, len(names))
    for name, rest, length in zip(names, session.rests, lengths, strict=False):
        start = rest.start + 0.3
        kept = (samples.time >= start) & (samples.time < start + length)
        with tumble.open_writer(folder / f"{name}.{log_format}") as writer:
            writer.write(
                Chunk(samples.time[kept] - start, samples.accelerometer[kept], samples.gyroscope[kept])
            )
    return folder


TIME, FORCE, RATE = 0, slice(1, 4), slice(4, 7)
"""Columns of a table."""
HEADER = "time,ax,ay,az,gx,gy,gz"


@dataclass(frozen=True)
class Pair:
    """Logs of a reference and a target, and a folder for what is made of them."""

    session: object
    folder: Path

    @classmethod
    def make(cls, session, folder):
        for unit in session.units:
            write_table(folder / f"{unit.name}.csv", columns(unit.samples))
        return cls(session, folder)

    def table(self, unit):
        """(n, 7) samples of a unit, to be changed."""
        return columns(self.session[unit].samples)

    def with_log(self, unit, path):
        """Arguments of the command with another log in the place of a unit's."""
        logs = {name: self.folder / f"{name}.csv" for name in ("reference", "target_1")}
        logs[unit] = path
        return [*logs.values(), "-o", path.parent / "out"]

    def corrupt(self, folder, unit, change, header=HEADER):
        """Arguments of the command with the log of a unit changed: `change` alters or returns a table."""
        table = self.table(unit)
        changed = change(table)
        return self.with_log(
            unit, write_table(folder / "corrupt.csv", table if changed is None else changed, header)
        )
