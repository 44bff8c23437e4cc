"""Prove that CI runs the commands that the README and the documentation give.

Their shell blocks may hold `git clone`, `cd`, `make TARGET` with a target that `make help` lists, and
`tumble ...`. With --run, the `tumble` commands and the Python blocks are run in the order they stand, those
of a page in one empty folder, as a reader would, and every line of a `text` block has to be what the command
before it prints, `...` standing for lines left out. A command that needs files of the reader is indented.

A translated page is not run: it has to show the same blocks as the page it translates, in the same order, so
that a run of that page proves both. Figures of benchmarks in it have to be the same, too.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Lock

from forked_commands import Done, ForkingProcess

from tumble.foundation.procedures import PROCEDURES

ROOT = Path(__file__).parents[1]
HOW_TOS = (
    "install",
    *(procedure.word for procedure in PROCEDURES),
    "live",
    "export",
    "five-dollar-imu",
    "compare",
    "read-logs",
    "convert",
    "view",
    "viewers",
    "python",
    "simulate",
    "tables",
    "registry",
    "certificate",
    "laboratory",
    "fleet",
)
README = ROOT / "README.md"
GETTING_STARTED = sorted((ROOT / "docs" / "getting-started").glob("*.md"))
PAGES = (
    README,
    *GETTING_STARTED,
    ROOT / "docs" / "is-my-result-good.md",
    *(ROOT / "docs" / "how-to" / f"{name}.md" for name in HOW_TOS),
)

TRANSLATIONS = {
    ROOT / "README.zh-CN.md": README,
    **{ROOT / "docs" / "zh-CN" / page.name: page for page in GETTING_STARTED if page.stem != "firmware-in-c"},
}
"""Translated pages, each with the page that it translates."""

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


class Simulations:
    """Recordings that pages simulate: those of the same command are made once, and copied."""

    def __init__(self, kept: Path) -> None:
        """Keeps recordings in the folder `kept`."""
        self._kept = kept
        self._outcomes: dict[str, Outcome] = {}
        self._locks = {text: Lock() for text in repeated_simulations()}

    def run(self, snippet: Snippet, folder: Path) -> Outcome:
        """Runs a snippet in `folder`; a simulation that another page has run is copied."""
        if (lock := self._locks.get(snippet.text)) is None:
            return run(snippet, folder)
        made = folder / snippet.text.rpartition(" -o ")[2]
        with lock:
            kept = self._kept / str(sorted(self._locks).index(snippet.text))
            if (known := self._outcomes.get(snippet.text)) is not None:
                shutil.copytree(kept, made, dirs_exist_ok=True)
                return known
            is_new = not made.exists()
            done = run(snippet, folder)
            if is_new and not done.wrong:
                shutil.copytree(made, kept)
                self._outcomes[snippet.text] = done
            return done


def repeated_simulations() -> set[str]:
    """Simulations into a folder of their own that more than one page shows."""
    shown = [{each.text for each in snippets(page.read_text(encoding="utf-8"))} for page in PAGES]
    texts = {text for text in set().union(*shown) if re.fullmatch(r"tumble simulate [^|<>]* -o \w+", text)}
    return {text for text in texts if sum(text in page for page in shown) > 1}


SHELL = re.compile(r"[|<>;&$*?~`\"'\\\\]")
"""Letters that a shell takes for more than themselves."""


class Programs:
    """Processes that run the commands of pages, one for each page that is looked at at a time."""

    def __init__(self) -> None:
        """Starts none; there are as many as ever were in use together."""
        self._idle: SimpleQueue[ForkingProcess] = SimpleQueue()
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        self.environment = {**os.environ, "PATH": path, "TUMBLE_LANG": "en"}

    def run(self, folder: Path, *, words: list[str] | None = None, program: str = "") -> Done:
        """Runs `tumble` with words, or a program of Python, in a folder."""
        try:
            process = self._idle.get_nowait()
        except Empty:
            process = ForkingProcess(self.environment)
        done = process.run(folder, words=words, program=program)
        self._idle.put(process)
        return done

    def close(self) -> None:
        """Ends all processes; none may be in use."""
        while not self._idle.empty():
            self._idle.get().close()


PROGRAMS = Programs()


def run(snippet: Snippet, folder: Path) -> Outcome:
    """Runs a `tumble` command or a Python block in `folder`."""
    if snippet.language == "python":
        done = PROGRAMS.run(folder, program=snippet.text)
    elif not snippet.text.startswith("tumble "):
        return Outcome()
    elif SHELL.search(snippet.text):
        command = ["sh", "-c", snippet.text]
        by_shell = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, check=False, env=PROGRAMS.environment
        )
        done = Done(by_shell.returncode, by_shell.stdout, by_shell.stderr)
    else:
        done = PROGRAMS.run(folder, words=snippet.text.split()[1:])
    if done.code in (0, FAILED_LIMITS):
        return Outcome(printed=done.out + done.err)
    said = (done.err or done.out).strip().splitlines()[-1:]
    return Outcome(wrong=f"exit code {done.code}: {' '.join(said)}")


def run_all(found: list[Snippet], folder: Path, simulations: Simulations) -> Iterator[tuple[Snippet, str]]:
    """Runs the snippets of a page one after the other, and holds what it shows against what they print.

    Python blocks without a command between them are one program, as a reader types them.
    """
    printed, program = "", ""
    for snippet in found:
        if snippet.language == "text":
            yield snippet, not_printed(snippet.text, printed)
            continue
        program = f"{program}{snippet.text}" if snippet.language == "python" else ""
        outcome = simulations.run(replace(snippet, text=program or snippet.text), folder)
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


def problems(page: Path, simulations: Simulations | None) -> list[str]:
    """Returns what is wrong with the snippets of a page, each with its place; runs them with simulations."""
    found = list(snippets(page.read_text(encoding="utf-8")))
    wrong = [(snippet, problem(snippet)) for snippet in found]
    if simulations is not None:
        with tempfile.TemporaryDirectory() as folder:
            wrong += run_all(found, Path(folder), simulations)
    name = page.relative_to(ROOT)
    told = [f"{name}:{snippet.line}: {text}" for snippet, text in wrong if text]
    if page == README:
        shown = {snippet.text for snippet in found}
        told += [f"{name}: does not show `{command}`" for command in EXPECTED if command not in shown]
    return told


def untranslated(page: Path, original: Path) -> list[str]:
    """Returns in what a translated page differs from the page it translates, each with its place."""
    name = page.relative_to(ROOT)
    if not page.is_file():
        return [f"{name}: is missing; translate {original.relative_to(ROOT)}"]
    text, translated = (path.read_text(encoding="utf-8") for path in (original, page))
    told = [
        f"{name}:{own.line}: `{own.text.strip()}` is not what {original.name} shows there"
        for own, wanted in zip(snippets(translated), snippets(text), strict=False)
        if (own.language, own.text) != (wanted.language, wanted.text)
    ]
    if len(list(snippets(translated))) != len(list(snippets(text))):
        told.append(f"{name}: shows more or fewer blocks than {original.name}")
    if figures(translated) != figures(text):
        told.append(f"{name}: its figures of benchmarks are not those of {original.name}")
    return told


def figures(text: str) -> list[str]:
    """Returns the numbers of the table of benchmarks, in no order, as sentences turn round in a language."""
    table = text.partition("<!-- benchmark:figures -->")[2].partition("<!-- /benchmark:figures -->")[0]
    return sorted(re.findall(r"\d+(?:\.\d+)?", table))


def main() -> int:
    """Checks, and with --run run; 1 if anything is wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--run", action="store_true", help="run the tumble commands and the Python blocks too"
    )
    wanted_to_run = parser.parse_args().run
    with tempfile.TemporaryDirectory() as kept, ThreadPoolExecutor(os.cpu_count()) as workers:
        simulations = Simulations(Path(kept)) if wanted_to_run else None
        told = list(chain.from_iterable(workers.map(lambda page: problems(page, simulations), PAGES)))
    PROGRAMS.close()
    told += chain.from_iterable(untranslated(page, original) for page, original in TRANSLATIONS.items())
    for line in told:
        print(line, file=sys.stderr)
    print(f"{len(PAGES) + len(TRANSLATIONS)} pages with commands, {len(told)} problems")
    return bool(told)


if __name__ == "__main__":
    sys.exit(main())
