"""Prove that CI runs the commands that the README and the documentation give.

Their shell blocks may hold `git clone`, `cd`, `make TARGET` with a target that `make help` lists, and
`tumble ...`. With --run, the `tumble` commands and the Python blocks are run in the order they stand, those
of a page in one empty folder, as a reader would, and every line of a `text` block has to be what the command
before it prints, `...` standing for lines left out. A command that needs files of the reader is indented.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from tumble.foundation.procedures import PROCEDURES

ROOT = Path(__file__).parents[1]
HOW_TOS = (
    "install",
    *(procedure.word for procedure in PROCEDURES),
    "live",
    "export",
    "compare",
    "read-logs",
    "convert",
    "view",
    "python",
    "simulate",
    "tables",
    "registry",
    "certificate",
    "laboratory",
)
README = ROOT / "README.md"
GETTING_STARTED = sorted((ROOT / "docs" / "getting-started").glob("*.md"))
PAGES = (
    README,
    *GETTING_STARTED,
    ROOT / "docs" / "is-my-result-good.md",
    *(ROOT / "docs" / "how-to" / f"{name}.md" for name in HOW_TOS),
)

FAILED_LIMITS = 3
"""Exit code of `tumble` where a target is out of its limits, as one of the simulated ones is meant to be."""


EXPECTED = ("make demo", "make test")
"""The two commands a newcomer needs, shown by the README."""


@dataclass(frozen=True, slots=True)
class Snippet:
    """Something a page shows to be typed, or to be seen then."""

    line: int
    language: str
    """`sh`, one command each; `python` or `text`, a whole block."""
    text: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a snippet that was run."""

    wrong: str = ""
    """Error, empty if there was none."""
    printed: str = ""


def snippets(text: str) -> Iterator[Snippet]:
    """Returns shell commands (continued lines joined, comments and prompts left out) and the other blocks."""
    for block in re.finditer(
        r"^```(sh|shell|bash|console|python|text)\n(.*?)^```", text, re.MULTILINE | re.DOTALL
    ):
        first = text[: block.start(2)].count("\n") + 1
        if block[1] in ("python", "text"):
            yield Snippet(first, block[1], block[2])
            continue
        start, command = first, ""
        for number, line in enumerate(block[2].splitlines(), start=first):
            start = start if command else number
            command += re.sub(r"(^|\s)#.*", "", line).removeprefix("$ ").removesuffix("\\")
            if command and not line.endswith("\\"):
                yield Snippet(start, "sh", " ".join(command.split()))
                command = ""


def problem(snippet: Snippet) -> str:
    """Reason why CI does not prove this snippet; empty if it does."""
    if snippet.language != "sh":
        return ""
    program, *arguments = snippet.text.split()
    if program in ("git", "cd", "tumble"):
        return ""
    if program != "make":
        return f"`{snippet.text}` is run by nothing in CI"
    unknown = [target for target in arguments if target not in make_targets()]
    return f"make {unknown[0]} does not exist" if unknown else ""


def make_targets() -> set[str]:
    """Names of what `make help` lists."""
    return set(re.findall(r"^([a-z-]+):.*##", (ROOT / "Makefile").read_text(), re.MULTILINE))


def run(snippet: Snippet, folder: Path) -> Outcome:
    """Runs a `tumble` command or a Python block in `folder`."""
    if snippet.language == "python":
        command: list[str] = [sys.executable, "-c", snippet.text]
    elif snippet.text.startswith("tumble "):
        command = ["sh", "-c", snippet.text]
    else:
        return Outcome()
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, env={**os.environ, "PATH": path}
    )
    if done.returncode in (0, FAILED_LIMITS):
        return Outcome(printed=done.stdout + done.stderr)
    said = (done.stderr or done.stdout).strip().splitlines()[-1:]
    return Outcome(wrong=f"exit code {done.returncode}: {' '.join(said)}")


def run_all(found: list[Snippet], folder: Path) -> Iterator[tuple[Snippet, str]]:
    """Runs the snippets of a page one after the other, and holds what it shows against what they print.

    Python blocks without a command between them are one program, as a reader types them.
    """
    printed, program = "", ""
    for snippet in found:
        if snippet.language == "text":
            yield snippet, not_printed(snippet.text, printed)
            continue
        program = f"{program}{snippet.text}" if snippet.language == "python" else ""
        outcome = run(replace(snippet, text=program or snippet.text), folder)
        printed = outcome.printed
        yield snippet, outcome.wrong


def not_printed(shown: str, printed: str) -> str:
    """Returns a shown line that was not printed, in this order; widths of columns do not count."""
    lines = iter([" ".join(line.split()) for line in printed.splitlines()])
    for line in shown.splitlines():
        wanted = " ".join(line.split())
        if wanted not in ("", "...") and wanted not in lines:
            return f"`{wanted}` is not what the command before it prints there"
    return ""


def problems(page: Path, wanted_to_run: bool) -> list[str]:
    """Returns what is wrong with the snippets of a page, each with its place."""
    found = list(snippets(page.read_text(encoding="utf-8")))
    wrong = [(snippet, problem(snippet)) for snippet in found]
    if wanted_to_run:
        with tempfile.TemporaryDirectory() as folder:
            wrong += run_all(found, Path(folder))
    name = page.relative_to(ROOT)
    told = [f"{name}:{snippet.line}: {text}" for snippet, text in wrong if text]
    if page == README:
        shown = {snippet.text for snippet in found}
        told += [f"{name}: does not show `{command}`" for command in EXPECTED if command not in shown]
    return told


def main() -> int:
    """Checks, and with --run run; 1 if anything is wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--run", action="store_true", help="run the tumble commands and the Python blocks too"
    )
    wanted_to_run = parser.parse_args().run
    with ThreadPoolExecutor(os.cpu_count()) as workers:
        told = list(chain.from_iterable(workers.map(lambda page: problems(page, wanted_to_run), PAGES)))
    for line in told:
        print(line, file=sys.stderr)
    print(f"{len(PAGES)} pages with commands, {len(told)} problems")
    return bool(told)


if __name__ == "__main__":
    sys.exit(main())
