"""Mutants of the crates: nearly all are built at once, and each process of the tests runs one of them.

A function with mutants holds its body once for each, and once as it is; a variable of the environment
chooses. So one build serves hundreds of mutants, and the tests can report which mutants they reach:
a test that never enters the function cannot find its mutant, and is not run. A mutant of what the compiler
evaluates, or of a function that returns `impl Trait`, is built alone.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path
from typing import Any

from mutant_process import Ended, run
from mutant_sample import Mutant, Span

ROOT = Path(__file__).parents[1]
CRATES = ("tumble-core", "tumble-store", "tumble-lab")
PACKAGES = tuple(word for crate in CRATES for word in ("--package", crate))
TESTS = ("test", "--no-run", *PACKAGES)
SWITCH = Path(__file__).with_name("mutant_switch.rs")
CHOSEN, REACHED = "TUMBLE_MUTANT", "TUMBLE_MUTANTS_REACHED"

_ENTRY = b"(module: &Bound<'_, PyModule>) -> PyResult<()> {"
_ADDED_TO_ENTRY = b"module.add_function(wrap_pyfunction!(forget_mutants, module)?)?;"
_ADDED_TO_MODULE = b"""
#[pyfunction]
fn forget_mutants() {
    tumble_core::mutant_switch::forget();
}
"""

Message = dict[str, Any]
"""Line of JSON that cargo writes."""

# Comments, strings and characters hold braces that are none.
_TEXT = re.compile(
    r"""//[^\n]*|/\*.*?\*/|b?r(#*)".*?"\1|b?"(?:\\.|[^"\\])*"|b?'(?:\\[^']+|[^'\\])'""", re.DOTALL
)


def listed(tool: Path) -> list[Mutant]:
    """Returns all mutants that cargo-mutants finds in the crates."""
    command = [str(tool), "mutants", "--no-config", "--list", "--json", *PACKAGES]
    out = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    return parsed(out)


def parsed(text: str) -> list[Mutant]:
    """Returns the mutants of a list that cargo-mutants has written as JSON."""

    def span(place: Mapping[str, Mapping[str, int]]) -> Span:
        start, end = place["start"], place["end"]
        return Span(start["line"], start["column"], end["line"], end["column"])

    return [
        Mutant(
            part=each["package"],
            file=each["file"],
            span=span(each["span"]),
            change=each["replacement"],
            function=span(each["function"]["span"]) if each["function"] else None,
        )
        for each in json.loads(text)
    ]


def lines_of_code(text: str) -> int:
    """Number of lines of a file that are neither blank, nor a comment, nor its tests, which are its end."""
    lines = text.partition("\n#[cfg(test)]")[0].splitlines()
    return sum(bool(line.strip()) and not line.lstrip().startswith("//") for line in lines)


class Text:
    """The text of a file, cut by spans."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._starts = [0, *(match.end() for match in re.finditer("\n", text))]

    def offsets(self, span: Span) -> tuple[int, int]:
        """Offsets of both ends of a span."""
        return (
            self._starts[span.line - 1] + span.column - 1,
            self._starts[span.end_line - 1] + span.end_column - 1,
        )

    def cut(self, span: Span) -> str:
        """The letters of a span."""
        start, end = self.offsets(span)
        return self.text[start:end]

    def mutated(self, mutant: Mutant) -> str:
        """The text with a mutant in it."""
        start, end = self.offsets(mutant.span)
        return f"{self.text[:start]}{mutant.change}{self.text[end:]}"

    def body(self, function: Span) -> tuple[int, int]:
        """Offsets of what is between the braces of a function, whose span ends with its closing brace."""
        start, end = self.offsets(function)
        code = _TEXT.sub(lambda text: " " * len(text[0]), self.text[start:end])
        depth, opened = 0, list[int]()
        for place, letter in enumerate(code):
            if letter in "([":
                depth += 1
            elif letter in ")]":
                depth -= 1
            elif letter == "{":
                opened.append(place if depth == 0 else -1)
            elif letter == "}" and (begins := opened.pop()) >= 0 and place == len(code) - 1 and not opened:
                return start + begins + 1, start + place
        raise ValueError(f"no body in the function at line {function.line}")

    def signature(self, function: Span) -> str:
        """All of a function that is before its body, without comments and attributes."""
        start, (begins, _) = self.offsets(function)[0], self.body(function)
        code = _TEXT.sub("", self.text[start : begins - 1])
        return re.sub(r"^(\s*#\[[^\]]*\])*", "", code).strip()


def is_switchable(text: Text, mutant: Mutant) -> bool:
    """True where the mutant is in code that runs, and the type of the result does not depend on the body."""
    if mutant.function is None:
        return False
    (begins, ends), (start, end) = text.body(mutant.function), text.offsets(mutant.span)
    if not begins <= start <= end <= ends:
        return False
    signature = text.signature(mutant.function)
    before, _, result = signature.rpartition("->")
    return not re.search(r"\bconst\b[^(]*\bfn\b", signature) and not (before and "impl " in result)


def switched(
    text: Text, mutants: Mapping[int, Mutant], module: str
) -> tuple[str, dict[int, tuple[int, int]]]:
    """Returns a file whose functions choose among mutants by number, and the first and last line of each.

    A function in another one with a mutant is repeated with it, so that each mutant is in one place.
    """
    functions = {mutant.function for mutant in mutants.values() if mutant.function}
    outermost = [
        each for each in functions if not any(other != each and other.contains(each) for other in functions)
    ]
    out, done, lines = "", 0, {}
    for function in sorted(outermost):
        begins, ends = text.body(function)
        out += text.text[done:begins] + "\n"
        for number, mutant in mutants.items():
            if mutant.function and function.contains(mutant.function):
                start, end = text.offsets(mutant.span)
                body = f"{text.text[begins:start]}{mutant.change}{text.text[end:ends]}"
                out += f"if {module}::is_active({number}) {{\n"
                first = out.count("\n")
                out += f"{body}\n}} else "
                lines[number] = first + 1, out.count("\n")
        out += f"{{\n{text.text[begins:ends]}\n}}\n"
        done = ends
    return out + text.text[done:], lines


@dataclass(frozen=True, slots=True)
class Program:
    """A program of tests."""

    crate: str
    target: str
    """Name that cargo gives it."""
    path: Path
    folder: Path
    """Folder that cargo runs it in."""

    def tests(self) -> list[str]:
        """Names of its tests that are not left out."""
        return sorted(self._names() - self._names("--ignored"))

    def _names(self, *words: str) -> set[str]:
        out = run([self.path, "--list", "--format", "terse", *words], self.folder).output
        return {line.removesuffix(": test") for line in out.splitlines() if line.endswith(": test")}

    def run(self, test: str, environment: Mapping[str, str], usual: float) -> Ended:
        """Runs one test."""
        return run([self.path, "--exact", test], self.folder, environment, usual)


@dataclass(frozen=True, slots=True)
class Test:
    """A test, and how it ran without a fault."""

    program: Program
    name: str
    processor: float
    reached: frozenset[int]
    """Numbers of the mutants whose function it entered."""


class Build:
    """A copy of the repository in which all mutants of a sample are built that can be."""

    def __init__(self, folder: Path, seed: int, candidates: Sequence[Mutant]) -> None:
        self.candidates = candidates
        self.tree, self.target, self.kept = folder / "rust", folder / "build", folder / "programs"
        self.environment = {
            "CARGO_TARGET_DIR": str(self.target),
            "CARGO_INCREMENTAL": "0",
            # A mutant leaves variables unused.
            "RUSTFLAGS": "--cap-lints warn",
            "RAYON_NUM_THREADS": "1",
            # The laws draw the same cases each time; to shrink and to keep a failed one finds no more.
            "PROPTEST_RNG_SEED": str(seed),
            "PROPTEST_MAX_SHRINK_ITERS": "0",
            "PROPTEST_DISABLE_FAILURE_PERSISTENCE": "1",
        }
        self.texts: dict[str, Text] = {}
        self.numbers: dict[Mutant, int] = {}
        self.uncompilable: set[Mutant] = set()
        self.tests: list[Test] = []
        self.native = self.kept / "_core.abi3.so"
        """The module for Python with all mutants."""

    def prepare(self) -> None:
        """Builds all candidates that compile together, and runs each test once."""
        for mutant in self.candidates:
            self.texts.setdefault(mutant.file, Text((ROOT / mutant.file).read_text()))
        self._copy()
        together = [each for each in self.candidates if is_switchable(self.texts[each.file], each)]
        self.numbers = {mutant: number for number, mutant in enumerate(together)}
        while failed := self._uncompiled():
            self.uncompilable |= failed
            print(f"{len(failed)} mutants do not compile", flush=True)
        self.tests = list(self._measured(self._programs()))
        self.build_native()

    def _copy(self) -> None:
        """Copies the files that git tracks but those with mutants, and adds what chooses among these."""
        command = ["git", "ls-files", "-z"]
        files = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
        contents = {
            file: (ROOT / file).read_bytes() for file in files.split("\0") if file and file not in self.texts
        }
        contents["crates/tumble-core/src/mutant_switch.rs"] = SWITCH.read_bytes()
        contents["crates/tumble-core/src/lib.rs"] += b"\nextern crate std;\npub mod mutant_switch;\n"
        module = "crates/tumble-py/src/lib.rs"
        contents[module] = contents[module].replace(_ENTRY, _ENTRY + _ADDED_TO_ENTRY) + _ADDED_TO_MODULE
        for file, content in contents.items():
            _write(self.tree / file, content)

    def _uncompiled(self) -> set[Mutant]:
        """Builds all but those that did not compile; returns those that do not now."""
        lines = self._switch()
        messages = self._cargo()
        spans = list(_errors(messages))
        failed = {
            mutant
            for mutant, number in self.numbers.items()
            for file, first, last in spans
            if file == mutant.file
            and number in lines
            and lines[number][0] <= first
            and last <= lines[number][1]
        }
        if spans and not failed:
            sys.exit("\n".join(str(each["message"]["rendered"]) for each in messages if "message" in each))
        return failed

    def _switch(self) -> dict[int, tuple[int, int]]:
        """Writes the files with all that compiles; returns the lines of each."""
        files: dict[str, dict[int, Mutant]] = {file: {} for file in self.texts}
        for mutant, number in self.numbers.items():
            if mutant not in self.uncompilable:
                files[mutant.file][number] = mutant
        lines: dict[int, tuple[int, int]] = {}
        for file, mutants in files.items():
            crate = "crate" if file.startswith("crates/tumble-core/") else "tumble_core"
            text, where = switched(self.texts[file], mutants, f"{crate}::mutant_switch")
            _write(self.tree / file, text.encode())
            lines |= where
        return lines

    def _cargo(self, words: Sequence[str] = TESTS) -> list[Message]:
        """Builds the tests, or what else is given; returns the messages of the compiler."""
        command = ["cargo", *words, "--locked", "--message-format", "json"]
        done = subprocess.run(
            command,
            cwd=self.tree,
            env={**os.environ, **self.environment},
            capture_output=True,
            text=True,
        )
        messages = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
        if done.returncode and not any(_errors(messages)):
            sys.exit(done.stderr)
        return messages

    def build_native(self) -> None:
        """Builds the module for Python, as fast as the tests are."""
        messages = self._cargo(["build", "--package", "tumble-py", "--profile", "test"])
        [built] = [each for each in messages if each.get("target", {}).get("name") == "_core"]
        shutil.copy(built["filenames"][0], self.native)

    def _programs(self) -> list[Program]:
        """Keeps the programs of the tests, which a mutant that is built alone would replace."""
        programs = list(self._built(self._cargo()))
        shutil.rmtree(self.kept, ignore_errors=True)
        self.kept.mkdir(parents=True)
        return [replace(each, path=Path(shutil.copy(each.path, self.kept))) for each in programs]

    def _built(self, messages: Iterable[Message]) -> Iterator[Program]:
        for message in messages:
            is_program = message["reason"] == "compiler-artifact" and message["executable"]
            # Examples are built beside the tests.
            if is_program and message["profile"]["test"]:
                folder = Path(message["manifest_path"]).parent
                yield Program(folder.name, message["target"]["name"], Path(message["executable"]), folder)

    def _measured(self, programs: Iterable[Program]) -> Iterator[Test]:
        """Runs each test once without a fault."""
        notes = self.kept / "reached"
        for program in programs:
            for name in program.tests():
                notes.write_text("")
                ended = program.run(name, {**self.environment, REACHED: str(notes)}, 600.0)
                if ended.code:
                    sys.exit(f"{name} fails without a fault:\n{ended.output}")
                reached = frozenset(map(int, notes.read_text().split()))
                yield Test(program, name, ended.processor, reached)

    def try_mutant(self, mutant: Mutant) -> tuple[str, str]:
        """Returns how a mutant ended, and the test that found it."""
        if mutant in self.uncompilable:
            return "does not compile", ""
        if mutant in self.numbers:
            number = self.numbers[mutant]
            tests = [test for test in self.tests if number in test.reached]
            return self._found(mutant, tests, {CHOSEN: str(number)})
        return self._alone(mutant)

    def _found(
        self, mutant: Mutant, tests: Iterable[Test], environment: Mapping[str, str]
    ) -> tuple[str, str]:
        """Runs the tests of the crate first, the shortest first of all."""
        environment = {**self.environment, **environment}
        tests = sorted(tests, key=lambda test: (test.program.crate != mutant.part, test.processor))
        for test in tests:
            ended = test.program.run(test.name, environment, test.processor)
            if ended.is_over_limit:
                return "over limit", test.name
            if ended.code:
                return "found", test.name
        return ("survived" if tests else "not reached"), ""

    def _alone(self, mutant: Mutant) -> tuple[str, str]:
        """Builds one mutant, and runs all tests."""
        path = self.tree / mutant.file
        before = path.read_bytes()
        try:
            _write(path, self.texts[mutant.file].mutated(mutant).encode())
            messages = self._cargo()
            if any(_errors(messages)):
                return "does not compile", ""
            alone = {(program.crate, program.target): program for program in self._built(messages)}
            tests = [
                replace(test, program=alone[test.program.crate, test.program.target]) for test in self.tests
            ]
            return self._found(mutant, tests, {})
        finally:
            _write(path, before)


def _write(path: Path, content: bytes) -> None:
    """Writes what is new: cargo builds anew what has a later date."""
    if not path.exists() or path.read_bytes() != content:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def _errors(messages: Iterable[Message]) -> Iterator[tuple[str, int, int]]:
    """File, first and last line of each error, in the file that holds it rather than in a macro."""
    for message in messages:
        told = message.get("message")
        if message["reason"] == "compiler-message" and isinstance(told, dict) and told["level"] == "error":
            for span in filter(itemgetter("is_primary"), told["spans"]):
                while span["expansion"]:
                    span = span["expansion"]["span"]
                yield span["file_name"], span["line_start"], span["line_end"]
