"""Mutants of the package: one file of a copy of the repository is altered at a time.

The copy has the native module with all mutants of Rust, so that its tests try these, too.
"""

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
from mutant_process import Ended, run
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
    """Yields the mutants of one file, but of what only mypy reads: annotations, options of data classes."""
    typing = list(_typing(ast.parse(text)))
    nodes = list(ast_nodes(get_ast(text)))
    for name, operator in known.items():
        places = (place for node in nodes for place in operator.mutation_positions(node))
        for occurrence, ((line, column), (end_line, end_column)) in enumerate(places):
            span = Span(line, column + 1, end_line, end_column + 1)
            if not any(each.contains(span) for each in typing):
                yield Mutant(part, file, span, f"{name} {occurrence}")


def mutated(text: str, mutant: Mutant) -> str:
    """Returns the text of a file with the mutant in it.

    Raises SyntaxError where there is none: cosmic-ray lists exceptions of a module, and cannot replace them.
    """
    name, occurrence = mutant.change.split()
    try:
        altered = str(mutate_code(text, get_operator(name)(), int(occurrence)))
    except AttributeError as error:
        raise SyntaxError(f"{mutant.name} cannot be made") from error
    ast.parse(altered)
    return altered


def _typing(tree: ast.AST) -> Iterator[Span]:
    """Spans of annotations, and of the options of data classes."""
    for node in ast.walk(tree):
        for decorator in getattr(node, "decorator_list", ()):
            if isinstance(decorator, ast.Call) and ast.unparse(decorator.func) == "dataclass":
                yield _span(decorator)
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

    def __init__(self, folder: Path, candidates: Sequence[Mutant], native: Path) -> None:
        self.candidates, self.native = candidates, native
        self.tree, self.notes = folder / "python", folder / "notes"
        self.environment = {
            "PYTHONPATH": f"{self.tree / 'python'}:{self.tree / 'scripts'}",
            "PYTHONDONTWRITEBYTECODE": "",
            "RAYON_NUM_THREADS": "1",
        }
        self.tests: dict[str, TestFile] = {}
        self._reached: dict[str, dict[int, set[str]]] = {}
        """Files of tests that reach a line of a file of the package."""
        self._reached_native: dict[int, set[str]] = defaultdict(set)
        """Files of tests that reach a mutant of Rust, by its number."""

    def prepare(self) -> None:
        """Copies the repository, and runs the tests once, which reports what each file of them reaches."""
        self._copy()
        for folder in sorted({*(Path(each).name for each in FOLDERS), *OTHERS}):
            if (ROOT / "tests" / folder).exists():
                self.measure(folder)

    def _copy(self) -> None:
        shutil.rmtree(self.tree, ignore_errors=True)
        out = subprocess.run(
            ["git", "ls-files", "-z"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True
        )
        for file in filter(None, out.stdout.split("\0")):
            (self.tree / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / file, self.tree / file)
        shutil.copy2(self.native, self.tree / PACKAGE)
        shared = self.tree.parent / "shared"
        if not shared.exists() and (ROOT.parent / "shared").exists():
            shared.symlink_to(ROOT.parent / "shared")

    def measure(self, folder: str) -> None:
        """Runs the tests of a folder without a fault."""
        settings, times = self.tree / ".coveragerc", self.tree / "times.xml"
        altered = sorted({mutant.file for mutant in self.candidates})
        settings.write_text("\n    ".join(["[run]\nrelative_files = true\ninclude =", *altered]))
        shutil.rmtree(self.notes, ignore_errors=True)
        self.notes.mkdir()
        options = ["--cov", f"--cov-config={settings}", "--cov-context=test", "--cov-report="]
        reports = ["-p", "mutant_reach", f"--junitxml={times}", "-o", "junit_family=xunit1"]
        environment = {**self.environment, "TUMBLE_MUTANTS_NOTES": str(self.notes)}
        ended = run([*self._pytest(), *options, *reports, f"tests/{folder}"], self.tree, environment)
        if ended.code not in (0, 1):
            sys.exit(ended.output)
        print(f"{folder}: {ended.output.splitlines()[-1]}, {ended.processor:.0f} s of processor", flush=True)
        self._take(times)

    def _take(self, times: Path) -> None:
        seconds: dict[str, float] = defaultdict(float)
        failing = set()
        for case in ET.parse(times).getroot().iter("testcase"):
            file = case.attrib["file"]
            seconds[file] += float(case.attrib["time"])
            if case.find("failure") is not None or case.find("error") is not None:
                failing.add(file)
        for file in failing:
            print(f"{file} fails without a fault, and finds none", flush=True)
        for file in seconds.keys() - failing:
            self.tests[file] = TestFile(file, Path(file).parts[1], seconds[file])
            note = self.notes / file.replace("/", "+")
            for number in note.read_text().split() if note.exists() else ():
                self._reached_native[int(number)].add(file)
        lines = coverage.CoverageData(str(self.tree / ".coverage"))
        lines.read()
        for measured in lines.measured_files():
            reached = self._reached.setdefault(measured, {})
            for line, contexts in lines.contexts_by_lineno(measured).items():
                files = {context.partition("::")[0] for context in contexts if context}
                reached.setdefault(line, set()).update(files)

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

    def _tests_of(self, mutant: Mutant) -> set[str]:
        """Files of tests that could find a mutant of Python.

        Those that run its function can; outside of functions those that use the file or are of its folder.
        """
        body = function_lines((ROOT / mutant.file).read_text(), mutant.span.line)
        lines = self._reached.get(mutant.file, {})
        reached = {file for line, files in lines.items() if body is None or line in body for file in files}
        if body is None:
            own = Path(mutant.part).name
            reached |= {test.path for test in self.tests.values() if test.folder == own}
        return reached

    def _rings(self, mutant: Mutant, files: Iterable[str]) -> list[list[TestFile]]:
        """Returns files of tests in rings, each several times as long; those of its own folder come first."""
        own = Path(mutant.file).with_suffix("").parts
        tests = sorted(
            (self.tests[file] for file in files if file in self.tests),
            key=lambda test: (test.folder not in own, test.seconds),
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
        """Returns how a mutant of Python ended, and the test that found it."""
        path = self.tree / mutant.file
        before = path.read_text()
        try:
            self._write(path, mutated(before, mutant))
            return self._found(self._rings(mutant, self._tests_of(mutant)), {})
        except SyntaxError:
            return "does not compile", ""
        finally:
            self._write(path, before)

    def try_native(self, mutant: Mutant, number: int) -> tuple[str, str]:
        """Returns how a mutant of Rust ended."""
        rings = self._rings(mutant, self._reached_native[number])
        return self._found(rings, {"TUMBLE_MUTANT": str(number)})

    def _found(self, rings: Iterable[Sequence[TestFile]], environment: Mapping[str, str]) -> tuple[str, str]:
        ring: Sequence[TestFile] = ()
        for ring in rings:
            ended = self._tested(ring, environment)
            if ended.is_over_limit:
                return "over limit", ring[0].path
            if ended.code:
                return "found", _failed(ended.output)
        return ("survived" if ring else "not reached"), ""

    def _tested(self, ring: Sequence[TestFile], environment: Mapping[str, str]) -> Ended:
        command = [*self._pytest(), "-x", "--no-header", "-rfE", "--tb=no", *(test.path for test in ring)]
        usual = sum(test.seconds for test in ring) + FIRST
        return run(command, self.tree, {**self.environment, **environment}, usual)

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
