"""Put a fixed sample of faults into crates and procedures, one at a time; print how many the tests find.

The sample is drawn by a seed from all places that cargo-mutants finds in `tumble-core`, `tumble-store` and
`tumble-lab`, and cosmic-ray in the procedures and the calibration file, each part by its share of the
lines of code. `--first 100` tries the beginning of the order, which is a fair sample, too. Results are lines
of `target/mutants/results-42.jsonl`; a run that was stopped goes on, and `--again` tries those that survived.
"""

from __future__ import annotations

import argparse
import difflib
import functools
import hashlib
import json
import pickle
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar, cast

import mutants_python
import mutants_rust
from mutant_process import processor_seconds
from mutant_sample import Mutant, merged, shuffled, table, wilson

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "target" / "mutants"
SEED, SIZE = 42, 500
"""The fixed sample."""
SPARE = 1.3
"""Mutants that are drawn, over those that are tried: not all of Rust's compile."""

Row = dict[str, Any]
"""Result of a mutant, as it is stored."""
FOUND, SURVIVED, NOT_COMPILED = ("found", "over limit"), ("survived", "not reached"), "does not compile"
GOAL = 0.9
"""Share that the tests are to find."""
Kept = TypeVar("Kept", "Order", mutants_rust.Build, mutants_python.Copy)


class Order:
    """The mutants in the order in which they are drawn."""

    candidates: Sequence[Mutant] = ()

    def __init__(self, tool: Path, seed: int) -> None:
        self.tool, self.seed = tool, seed
        self.mutants: list[Mutant] = []
        self.shares: list[str] = []
        """Lines, places and share of each part."""

    def prepare(self) -> None:
        """Lists all mutants, and draws."""
        mutants = [*mutants_rust.listed(self.tool), *mutants_python.listed()]
        lines: dict[str, int] = {}
        for part, file in {(mutant.part, mutant.file) for mutant in mutants}:
            count = mutants_python.lines_of_code if file.endswith(".py") else mutants_rust.lines_of_code
            lines[part] = lines.get(part, 0) + count((ROOT / file).read_text())
        drawn = shuffled(mutants, self.seed)
        self.shares = [
            f"{part:<26}{lines[part]:>7} lines{len(drawn[part]):>7} places"
            f"{SIZE * lines[part] / sum(lines.values()):>7.1f} of {SIZE}"
            for part in sorted(lines)
        ]
        self.mutants = merged(drawn, lines)[: round(SPARE * SIZE)]


def is_rust(mutant: Mutant) -> bool:
    """True for a mutant of a crate."""
    return mutant.file.endswith(".rs")


def lines_changed(mutant: Mutant) -> tuple[str, str]:
    """The lines that a mutant replaces, and those it puts there."""
    text = (ROOT / mutant.file).read_text()
    mutated = (
        mutants_rust.Text(text).mutated(mutant) if is_rust(mutant) else mutants_python.mutated(text, mutant)
    )
    difference = list(difflib.ndiff(text.splitlines(), mutated.splitlines()))
    old, new = ("\n".join(line[2:].strip() for line in difference if line.startswith(sign)) for sign in "-+")
    return old, new


def read(path: Path) -> dict[str, Row]:
    """Returns the rows of a file of results by the name of their mutant, the last of each."""
    lines = path.read_text().splitlines() if path.exists() else []
    return {row["mutant"]: row for row in map(json.loads, lines)}


def report(rows: Sequence[Row]) -> str:
    """The share that the tests found, by part, and each mutant that they did not find."""
    out = table((row["part"], row["how"] in FOUND) for row in rows)
    limits = sum(row["how"] == "over limit" for row in rows)
    spent = sum(row["processor"] for row in rows) / max(len(rows), 1)
    out.append(f"{limits} of those found ran over their limit of time; one takes {spent:.1f} s of processor")
    for row in rows:
        if row["how"] not in FOUND:
            out += [f"\n{row['file']}:{row['line']} {row['how']}", f"  - {row['old']}", f"  + {row['new']}"]
    return "\n".join(out)


class Trial:
    """Both languages, each prepared when its first mutant is tried."""

    def __init__(self, order: Sequence[Mutant], seed: int) -> None:
        self.seed = seed
        self.rust = [mutant for mutant in order if is_rust(mutant)]
        self.python = [mutant for mutant in order if not is_rust(mutant)]

    @functools.cached_property
    def build(self) -> mutants_rust.Build:
        """The crates with all mutants."""
        return kept(
            "rust", ("crates", "vectors", "Cargo.lock"), mutants_rust.Build(FOLDER, self.seed, self.rust)
        )

    @functools.cached_property
    def copy(self) -> mutants_python.Copy:
        """The package, and the lines that each file of tests reaches."""
        copy = mutants_python.Copy(FOLDER, self.python, self.build.native)
        return kept("python", ("crates", "python", "tests"), copy)

    def kind(self, mutant: Mutant) -> str:
        """Language of a mutant, and `alone` where it takes a build of its own."""
        if not is_rust(mutant):
            return "python"
        return "rust" if mutant in self.build.numbers else "alone"

    def row(self, mutant: Mutant) -> Row:
        """Tries one; returns what is stored of it."""
        side = self.build if is_rust(mutant) else self.copy
        before = processor_seconds()
        how, test = side.try_mutant(mutant)
        if how in SURVIVED and mutant in self.build.numbers:
            wider, test = self.copy.try_native(mutant, self.build.numbers[mutant])
            how = how if wider == "not reached" else wider
        old, new = ("", "") if how == NOT_COMPILED else lines_changed(mutant)
        return {
            "mutant": mutant.name,
            "part": mutant.part,
            "file": mutant.file,
            "line": mutant.span.line,
            "old": old,
            "new": new,
            "how": how,
            "test": test,
            "processor": round(processor_seconds() - before, 2),
        }


def kept(name: str, folders: Sequence[str], side: Kept) -> Kept:
    """Returns what was prepared of the same files for the same mutants before, or prepares it."""
    command = ["git", "ls-files", "-z", "--", *folders]
    names = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
    digest = hashlib.sha256(names)
    for file in filter(None, names.decode().split("\0")):
        digest.update((ROOT / file).read_bytes())
    for mutant in side.candidates:
        digest.update(mutant.name.encode())
    path = FOLDER / f"{name}.pickle"
    if path.exists():
        before, prepared = pickle.loads(path.read_bytes())
        if before == digest.digest():
            return cast(Kept, prepared)
    side.prepare()
    path.write_bytes(pickle.dumps((digest.digest(), side)))
    return side


def main(words: list[str]) -> int:
    """Tries those that have no result yet; 1 where they show fewer than 90 % found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tool", type=Path, default=FOLDER / "cargo/bin/cargo-mutants", help="cargo-mutants")
    parser.add_argument("--seed", type=int, default=SEED, help="sample to draw")
    parser.add_argument("--first", type=int, default=SIZE, help="mutants to try, of the drawn order")
    kinds = ("rust", "alone", "python")
    parser.add_argument("--only", choices=kinds, help="kind to try now: of Rust, built alone, of Python")
    parser.add_argument("--again", action="store_true", help="try those again that survived")
    parser.add_argument("--report", action="store_true", help="print what was found so far, and try none")
    given = parser.parse_args(words)
    FOLDER.mkdir(parents=True, exist_ok=True)
    drawn = kept(f"order-{given.seed}", ("crates", "python"), Order(given.tool, given.seed))
    print(f"seed {given.seed}", *drawn.shares, sep="\n", flush=True)
    path = FOLDER / f"results-{given.seed}.jsonl"
    rows, trial = read(path), Trial(drawn.mutants, given.seed)
    counted: list[Row] = []
    for mutant in drawn.mutants:
        if len(counted) == given.first:
            break
        row = rows.get(mutant.name)
        is_due = row is None or (given.again and row["how"] in SURVIVED)
        if is_due and not given.report and given.only in (None, trial.kind(mutant)):
            row = trial.row(mutant)
            with path.open("a") as file:
                file.write(json.dumps(row) + "\n")
            print(f"{row['how']:<16}{row['processor']:>8.1f} s  {mutant.name}  {row['test']}", flush=True)
        if row and row["how"] != NOT_COMPILED:
            counted.append(row)
    print(report(counted))
    return int(wilson(sum(row["how"] in FOUND for row in counted), len(counted))[1] < GOAL)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
