"""Mutants of the package: one file of a copy of the repository is altered at a time."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import coverage
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator
from cosmic_ray.plugins import get_operator, operator_names
from mutant_process import run
from mutant_sample import Mutant, Span

ROOT = Path(__file__).parents[1]
PACKAGE = Path("python/tumble")
FOLDERS = (
    "calibration",
    *(
        f"procedures/{path.name}"
        for path in sorted((ROOT / PACKAGE / "procedures").iterdir())
        if (path / "__init__.py").exists()
    ),
)
"""Folders of the package whose files are altered; each is a part of the sample."""
OTHERS = (
    "acquisition",
    "apply",
    "cli",
    "compare",
    "convert",
    "demo",
    "exchange",
    "inspect",
    "laboratory",
    "plateaus",
    "report",
    "results",
    "simulate",
    "translation",
    "view",
    "viewers",
)
"""Folders of tests that use the procedures, besides those of the procedures."""
RING = 5.0
"""Ratio of the seconds that one ring of tests takes to those of the ring before."""
FIRST = 4.0
"""Seconds of the first ring: Python takes as long to start."""


def operators() -> dict[str, Operator]:
    """All operators of cosmic-ray that need no arguments, by name."""
    classes = {name: get_operator(name) for name in operator_names()}
    return {name: each() for name, each in classes.items() if not each.arguments()}


def files(folder: str) -> list[Path]:
    """Files of a folder of the package, with those of its folders."""
    return sorted(path.relative_to(ROOT) for path in (ROOT / PACKAGE / folder).rglob("*.py"))


def listed() -> list[Mutant]:
    """Returns all mutants that cosmic-ray finds in the folders."""
    known = operators()
    return [
        mutant
        for folder in FOLDERS
        for path in files(folder)
        for mutant in mutants_of(folder, str(path), (ROOT / path).read_text(), known)
    ]


def mutants_of(part: str, file: str, text: str, known: Mapping[str, Operator]) -> Iterator[Mutant]:
    """Yields the mutants of one file. Annotations have none: mypy reads them, and no program does."""
    annotations = list(_annotations(ast.parse(text)))
    nodes = list(ast_nodes(get_ast(text)))
    for name, operator in known.items():
        places = (place for node in nodes for place in operator.mutation_positions(node))
        for occurrence, ((line, column), (end_line, end_column)) in enumerate(places):
            span = Span(line, column + 1, end_line, end_column + 1)
            if not any(each.contains(span) for each in annotations):
                yield Mutant(part, file, span, f"{name} {occurrence}")


def mutated(text: str, mutant: Mutant) -> str:
    """Returns the text of a file with the mutant in it."""
    name, occurrence = mutant.change.split()
    altered: str | None = mutate_code(text, get_operator(name)(), int(occurrence))
    if altered is None:
        raise ValueError(f"{mutant.name} alters nothing")
    return altered


def _annotations(tree: ast.AST) -> Iterator[Span]:
    for node in ast.walk(tree):
        for name in ("annotation", "returns"):
            if (each := getattr(node, name, None)) is not None:
                yield _span(each)


def _span(node: ast.expr | ast.stmt) -> Span:
    end_line, end_column = node.end_lineno or node.lineno, node.end_col_offset or node.col_offset
    return Span(node.lineno, node.col_offset + 1, end_line, end_column + 1)


def lines_of_code(text: str) -> int:
    """Number of lines of a file that hold statements: no blank ones, comments and docstrings."""
    tree = ast.parse(text)
    statements = [node for node in ast.walk(tree) if isinstance(node, ast.stmt)]
    texts = [
        node for node in statements if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    ]
    in_texts = {line for node in texts for line in range(node.lineno, (node.end_lineno or 0) + 1)}
    lines = text.splitlines()
    held = {
        line
        for node in statements
        for line in range(node.lineno, (node.end_lineno or 0) + 1)
        if (word := lines[line - 1].strip()) and not word.startswith("#")
    }
    return len(held - in_texts)


def function_lines(text: str, line: int) -> range | None:
    """Lines of the body of the innermost function that holds a line; None outside of functions."""
    found = None
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            last = node.end_lineno or 0
            if node.body[0].lineno <= line <= last and (found is None or node.body[0].lineno > found.start):
                found = range(node.body[0].lineno, last + 1)
    return found


@dataclass(frozen=True, slots=True)
class TestFile:
    """A file of tests."""

    path: str
    folder: str
    seconds: float
    """Time that it takes without a fault."""


class Copy:
    """A copy of the repository, whose package is altered, and its tests."""

    def __init__(self, folder: Path, candidates: Sequence[Mutant]) -> None:
        self.candidates = candidates
        self.tree = folder / "python"
        self.environment = {
            "PYTHONPATH": str(self.tree / "python"),
            "PYTHONDONTWRITEBYTECODE": "",
            "RAYON_NUM_THREADS": "1",
        }
        self.tests: dict[str, TestFile] = {}
        self._reached: dict[str, dict[int, set[str]]] = {}

    def prepare(self) -> None:
        """Copies the repository, and runs the tests once, which reports the lines that each file reaches."""
        self._copy()
        folders = {each.part.removeprefix("procedures/") for each in self.candidates}
        tests = sorted(f"tests/{each}" for each in {*folders, *OTHERS} if (ROOT / "tests" / each).exists())
        if tests:
            self._measure(tests, {mutant.file for mutant in self.candidates})

    def _copy(self) -> None:
        shutil.rmtree(self.tree, ignore_errors=True)
        out = subprocess.run(
            ["git", "ls-files", "-z"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True
        )
        for file in filter(None, out.stdout.split("\0")):
            (self.tree / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / file, self.tree / file)
        for native in (ROOT / PACKAGE).glob("_core*"):
            shutil.copy2(native, self.tree / PACKAGE)
        shared = self.tree.parent / "shared"
        if not shared.exists() and (ROOT.parent / "shared").exists():
            shared.symlink_to(ROOT.parent / "shared")

    def _measure(self, tests: Sequence[str], altered: Iterable[str]) -> None:
        settings, data = self.tree / ".coveragerc", self.tree / ".coverage"
        included = "".join(f"\n    {file}" for file in sorted(altered))
        settings.write_text(f"[run]\nrelative_files = true\ninclude ={included}\n")
        times = self.tree / "times.xml"
        options = ["--cov", f"--cov-config={settings}", "--cov-context=test", "--cov-report="]
        report = [f"--junitxml={times}", "-o", "junit_family=xunit1"]
        ended = run([*self._pytest(), *options, *report, *tests], self.tree, self.environment)
        print(ended.output.splitlines()[-1], flush=True)
        self._take(times, data)

    def _take(self, times: Path, data: Path) -> None:
        seconds: dict[str, float] = defaultdict(float)
        failing = set()
        for case in ET.parse(times).getroot().iter("testcase"):
            file = case.attrib["file"]
            seconds[file] += float(case.attrib["time"])
            if case.find("failure") is not None or case.find("error") is not None:
                failing.add(file)
        for file in failing:
            print(f"{file} fails without a fault, and finds none", flush=True)
        self.tests = {
            file: TestFile(file, Path(file).parts[1], time)
            for file, time in seconds.items()
            if file not in failing
        }
        lines = coverage.CoverageData(str(data))
        lines.read()
        for measured in lines.measured_files():
            self._reached[measured] = {
                line: {context.partition("::")[0] for context in contexts if context}
                for line, contexts in lines.contexts_by_lineno(measured).items()
            }

    def _pytest(self) -> list[str]:
        return [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-n",
            "0",
            "-p",
            "no:cacheprovider",
            "-p",
            "no:randomly",
        ]

    def rings(self, mutant: Mutant) -> list[list[TestFile]]:
        """Returns the files of tests that could find a mutant, in rings, each several times as long.

        The tests of its own folder come first. Outside of functions all are taken that import the file.
        """
        text = (ROOT / mutant.file).read_text()
        body = function_lines(text, mutant.span.line)
        lines = self._reached.get(mutant.file, {})
        reached = {file for line, files in lines.items() if body is None or line in body for file in files}
        own = Path(mutant.part).name
        if body is None:
            reached |= {test.path for test in self.tests.values() if test.folder == own}
        tests = sorted(
            (self.tests[file] for file in reached & self.tests.keys()),
            key=lambda test: (test.folder != own, test.seconds),
        )
        rings: list[list[TestFile]] = []
        room = 0.0
        for test in tests:
            if room <= 0.0:
                rings.append([])
                room = FIRST * RING ** (len(rings) - 1)
            rings[-1].append(test)
            room -= test.seconds
        return rings

    def try_mutant(self, mutant: Mutant) -> tuple[str, str]:
        """Returns how a mutant ended, and the test that found it."""
        path = self.tree / mutant.file
        before = path.read_text()
        rings = self.rings(mutant)
        try:
            self._write(path, mutated(before, mutant))
            for ring in rings:
                usual = sum(test.seconds for test in ring) + FIRST
                command = [
                    *self._pytest(),
                    "-x",
                    "--no-header",
                    "-rfE",
                    "--tb=no",
                    *(test.path for test in ring),
                ]
                ended = run(command, self.tree, self.environment, usual)
                if ended.is_over_limit:
                    return "over limit", ring[0].path
                if ended.code:
                    return "found", _failed(ended.output)
        finally:
            self._write(path, before)
        return ("survived" if rings else "not reached"), ""

    def _write(self, path: Path, text: str) -> None:
        """Writes a file, and deletes what was compiled of it: Python compares dates by the second."""
        path.write_text(text)
        for compiled in path.parent.glob(f"__pycache__/{path.stem}.*"):
            compiled.unlink()


def _failed(output: str) -> str:
    """The first line of pytest that names a test that failed."""
    lines = output.splitlines()
    named = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    return (named or lines[-1:] or [""])[0][:200]
