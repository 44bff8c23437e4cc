"""Hold the procedures to the law of honesty over drawn sessions with imperfections of a catalogue.

`python -m benchmarks.honesty [--procedure P] [--draws N] [--seed S] [--pair] [--jobs J] [--replay SEED]`

Every stated interval holds, within five sigmas, or the exit code is not that of success. Draws are made by a
simulator that shares no code with the estimators, and judged by the files that a command writes. `--replay`
prints one draw again. The table stands in docs/benchmarks/honesty.md.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rich.console import Console

from benchmarks.honesty.draw import draw
from benchmarks.honesty.law import Judgement
from benchmarks.honesty.sessions import SESSIONS
from benchmarks.honesty.summary import summary
from benchmarks.results import Content, machine, save
from benchmarks.seeds import computed, digest_of

JUDGE = "benchmarks.honesty.draw:judge"
ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "out" / "honesty"


def campaign(procedure: str, seeds: range, pair: bool, jobs: int, console: Console) -> list[Judgement]:
    """Judges the draws of a procedure; those of the same code are not drawn again."""
    package = ROOT / "python" / "tumble"
    files = [*Path(__file__).parent.glob("*.py"), *package.rglob("*.py"), *package.glob("_core*")]
    place = FOLDER / f"{procedure}{'-pairs' if pair else ''}-{digest_of(*sorted(files))}"
    options = {"procedure": procedure, "pair": pair}
    found = computed(JUDGE, seeds, place, console, options=options, jobs=jobs)
    return [Judgement.of(each) for each in found]


def main(words: list[str]) -> int:
    """Runs a campaign, prints and saves its table; 1 where a number is wrong and no word states it."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.honesty", description=str(__doc__).splitlines()[0]
    )
    parser.add_argument("--procedure", choices=SESSIONS, action="append", help="all, if none is named")
    parser.add_argument("--draws", type=int, default=2000, help="draws of each procedure")
    parser.add_argument("--seed", type=int, default=0, help="first seed")
    parser.add_argument("--pair", action="store_true", help="two imperfections in each session")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--replay", type=int, help="print the draw of one seed of a procedure")
    given = parser.parse_args(words)
    console, names = Console(), given.procedure or list(SESSIONS)
    if given.replay is not None:
        for name in names:
            console.print(draw(name, given.replay, given.pair))
        return 0
    seeds = range(given.seed, given.seed + given.draws)
    content: Content = {"machine": machine(), "draws": given.draws, "seed": given.seed, "procedures": {}}
    for name in names:
        content["procedures"][name] = summary(campaign(name, seeds, given.pair, given.jobs, console))
    console.print_json(data=content)
    if set(names) == set(SESSIONS):
        save("honesty_pairs" if given.pair else "honesty", content)
    return int(any(each["silent"] for each in content["procedures"].values()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
