"""Hold comments, docstrings, pages, test names and commit subjects against the rules of language.

The rules are those of CONTRIBUTING.md ("Language"); the words are those of docs/glossary.md ("Preferred and
banned words"). Findings are counted by folder: a file belongs to the longest folder of language_counts.json
that holds it; a folder without a count has none. Counts may only fall: more findings than counted fail, and
fewer fail too until `--lower` has written the lower count.
"""

from __future__ import annotations

import argparse
import ast
import io
import json
import re
import subprocess
import sys
import tokenize
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
GLOSSARY = "docs/glossary.md"
WORDS_HEADING = "## Preferred and banned words\n"
COUNTS = "scripts/language_counts.json"

LETTERS_OF_A_TEST = 60
LETTERS_OF_A_SUBJECT = 72
WORDS_OF_A_SENTENCE = 40
"""Largest number in pages; a cell of a table is a list, whose parts count each."""
WITHOUT_SENTENCES = "CHANGELOG.md"
"""Each of its items is a list of changes."""

OPENINGS = {"What", "How", "Of", "As", "Whether", "Who", "Whose"}
"""Words with which no sentence begins."""
SENTENCE_END = re.compile(r"(?<=[.!?])\s+(?=[A-Z`\[(])")
PARAGRAPH_END = re.compile(r"(?:\A|\n)\s*#+ [^\n]*(?:\n|\Z)|\n\s*\n|\n\s*(?=(?:[-*|>]|\d+\.)\s)")
PAGE_PARAGRAPH_END = re.compile(
    r"(?:\A|\n)#+ [^\n]*|\n\s*\n|\n(?=\s*(?:[-*|>]\s|\d+\.\s))|<!--.*?-->|\$\$.*?\$\$|\|", re.DOTALL
)
PAGE_SENTENCE_END = re.compile(r"(?:(?<=[.!?])|(?<=[.!?][)*]))\s+(?=[A-Z\[(\0*])")
INDENTED_CODE = re.compile(r"(?:\A|\n\s*\n)(?: {4}[^\n]*\n|\s*\n)+")
NO_PROSE = re.compile(r"```.*?(?:```|\Z)|`[^`]*`|\]\([^)]*\)|\$\$.*?\$\$|\$[^$]*\$|https?://\S+", re.DOTALL)

RUST_COMMENT = re.compile(r"^\s*(///|//!|//)(?!/)\s?(.*)$")
TRAILING_COMMENT = re.compile(r"""[;,{}()\w]\s+//\s+([^"']*)$""")
C_COMMENT = re.compile(r"/\*+(.*?)\*/|(?:^|(?<=\s))//(?!/)([^\n]*)", re.DOTALL)
RUST_TEST = re.compile(r"#\[test\]\s*(?:#\[[^\n]*\]\s*|///?[^\n]*\n\s*)*fn (\w+)")


@dataclass(frozen=True)
class Text:
    """Prose of a file: a comment, a docstring, or a page."""

    line: int
    text: str


@dataclass(frozen=True)
class Finding:
    """A breach of a rule, with its place."""

    path: str
    line: int
    message: str

    def __str__(self) -> str:
        """Format as compilers do."""
        return f"{self.path}:{self.line}: {self.message}"


class BannedWords:
    """Words that prose does not use, each with the word to use in its place."""

    def __init__(self, glossary: str) -> None:
        """Read the table of the section 'Preferred and banned words'."""
        section = glossary.partition(WORDS_HEADING)[2].partition("\n## ")[0]
        rows = [re.findall(r"[^|]+", line) for line in section.splitlines() if line.startswith("|")]
        self.preferred = {
            word.strip().lower(): row[1].strip() for row in rows[2:] for word in row[0].split(",")
        }
        if not self.preferred:
            raise ValueError(f"{GLOSSARY}: no table under '{WORDS_HEADING}'")
        words = sorted(self.preferred, key=len, reverse=True)
        self._patterns = [(word, re.compile(_pattern(word), re.IGNORECASE)) for word in words]

    def found_in(self, prose: str) -> Iterator[tuple[int, str, str]]:
        """Yield offset, text as found and preferred word of each banned word."""
        for word, pattern in self._patterns:
            for match in pattern.finditer(prose):
                yield match.start(), " ".join(match.group().split()), self.preferred[word]


def _pattern(word: str) -> str:
    ends_openly = word.endswith("*")
    spaced = r"\s+".join(re.escape(part) for part in word.rstrip("*").split())
    return rf"\b{spaced}" + (r"\w*" if ends_openly else r"\b")


def rust_texts(source: str) -> Iterator[Text]:
    """Yield doc comments and comments of Rust; lines that follow each other with one marker are one text."""
    marker_before, start, lines = "", 0, list[str]()
    for number, line in enumerate([*source.splitlines(), ""], start=1):
        match = RUST_COMMENT.match(line)
        marker = match.group(1) if match else ""
        if marker != marker_before and lines:
            yield Text(start, "\n".join(lines))
            lines = []
        if match:
            start = start if lines else number
            lines.append(match.group(2))
        elif trailing := TRAILING_COMMENT.search(line):
            yield Text(number, trailing.group(1))
        marker_before = marker


def c_texts(source: str) -> Iterator[Text]:
    """Yield comments of C and C++."""
    for match in C_COMMENT.finditer(source):
        text = re.sub(r"(?m)^[ \t]*\*[ ]?", "", match.group(1) or match.group(2) or "")
        yield Text(source.count("\n", 0, match.start()) + 1, text)


@lru_cache(maxsize=1)
def _statements(source: str) -> tuple[ast.AST, ...]:
    """Return all statements of Python, those in others included; most nodes are parts of expressions."""
    found = list[ast.AST]([ast.parse(source)])
    for node in found:
        for block in ("body", "orelse", "finalbody", "handlers", "cases"):
            inner = getattr(node, block, ())
            # The body of a lambda and the parts of a condition are expressions.
            found += inner if isinstance(inner, list) else ()
    return tuple(found)


def python_texts(source: str) -> Iterator[Text]:
    """Yield docstrings, those of attributes included, and comments of Python."""
    for node in _statements(source):
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                yield Text(node.lineno, text)
    block, after = list[str](), 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT or token.string.startswith("#!"):
            continue
        if block and token.start[0] != after:
            yield Text(after - len(block), "\n".join(block))
            block = []
        block.append(token.string.lstrip("# "))
        after = token.start[0] + 1
    if block:
        yield Text(after - len(block), "\n".join(block))


def markdown_texts(source: str) -> Iterator[Text]:
    """Yield a page, without the table of banned words."""
    before, heading, section = source.partition(WORDS_HEADING)
    table, _, _ = section.partition("\n## ")
    yield Text(1, before + re.sub(r"[^\n]", "", heading + table) + section[len(table) :])


def rust_tests(source: str) -> Iterator[tuple[int, str]]:
    """Yield line and name of each test of Rust."""
    for match in RUST_TEST.finditer(source):
        yield source.count("\n", 0, match.start(1)) + 1, match.group(1)


def python_tests(source: str) -> Iterator[tuple[int, str]]:
    """Yield line and name of each test of Python, without `test_`."""
    for node in _statements(source):
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            yield node.lineno, node.name.removeprefix("test_")


TEXTS = {".rs": rust_texts, ".py": python_texts, ".md": markdown_texts} | dict.fromkeys(
    (".h", ".hpp", ".c", ".cpp"), c_texts
)
TESTS = {".rs": rust_tests, ".py": python_tests}


def prose(text: str) -> str:
    """Blank out code, formulas and links; offsets stay."""
    return NO_PROSE.sub(lambda match: re.sub(r"[^\n]", "\0", match.group()), text)


def sentences(text: str) -> Iterator[tuple[int, str]]:
    """Yield offset and text of each sentence."""
    for begin, paragraph in _split(PARAGRAPH_END, text, 0):
        for offset, sentence in _split(SENTENCE_END, paragraph, begin):
            stripped = sentence.lstrip(" \n-*#>|")
            yield offset + len(sentence) - len(stripped), stripped


def long_sentences(page: str) -> Iterator[tuple[int, int]]:
    """Yield offset and number of words of each sentence of a page that has too many."""
    text = prose(INDENTED_CODE.sub(lambda match: re.sub(r"[^\n]", " ", match.group()), page))
    for begin, paragraph in _split(PAGE_PARAGRAPH_END, text, 0):
        is_cell = "|" in text[begin - 1 : begin] + text[begin + len(paragraph) :][:1]
        end = re.compile(r";\s") if is_cell else PAGE_SENTENCE_END
        for offset, sentence in _split(end, paragraph, begin):
            count = sum(1 for word in sentence.split() if re.search(r"[\w\0]", word))
            if count > WORDS_OF_A_SENTENCE:
                yield offset + len(sentence) - len(sentence.lstrip()), count


def _split(separator: re.Pattern[str], text: str, offset: int) -> Iterator[tuple[int, str]]:
    begin = 0
    for match in separator.finditer(text):
        yield offset + begin, text[begin : match.start()]
        begin = match.end()
    yield offset + begin, text[begin:]


def findings_in(path: str, source: str, banned: BannedWords) -> Iterator[Finding]:
    """Yield every breach of the rules in a source file."""
    suffix = Path(path).suffix
    for text in TEXTS[suffix](source):
        plain = prose(text.text)

        def finding(offset: int, message: str, text: Text = text) -> Finding:
            return Finding(path, text.line + text.text.count("\n", 0, offset), message)

        for offset, sentence in sentences(plain):
            opening = re.match(r"\w+", sentence)
            if opening and opening.group() in OPENINGS:
                yield finding(offset, f"sentence begins with '{opening.group()}'")
        for offset, found, preferred in banned.found_in(plain):
            yield finding(offset, f"'{found}' is banned; write: {preferred}")
    if suffix == ".md" and path != WITHOUT_SENTENCES:
        for offset, count in long_sentences(source):
            line = source.count("\n", 0, offset) + 1
            yield Finding(path, line, f"sentence has {count} words, more than {WORDS_OF_A_SENTENCE}")
    for line, name in TESTS.get(suffix, lambda _: iter(()))(source):
        if len(name) > LETTERS_OF_A_TEST:
            yield Finding(path, line, f"test name {_too_long(name, LETTERS_OF_A_TEST)}")


def subject_findings(subjects: Iterable[str]) -> Iterator[str]:
    """Yield a message for every commit subject that is too long; each begins with the commit."""
    for line in subjects:
        commit, _, subject = line.partition(" ")
        if len(subject) > LETTERS_OF_A_SUBJECT:
            yield f"{commit}: commit subject {_too_long(subject, LETTERS_OF_A_SUBJECT)}"


def _too_long(text: str, limit: int) -> str:
    return f"has {len(text)} letters, more than {limit}: {text}"


def folder_of(path: str, folders: Iterable[str]) -> str:
    """Return the longest folder that holds the file; the file's own where none does."""
    holding = [folder for folder in folders if path.startswith(f"{folder}/")]
    return max(holding, key=len, default=Path(path).parent.as_posix())


def ratchet_errors(found: dict[str, int], counted: dict[str, int]) -> Iterator[str]:
    """Yield a message for every folder whose findings differ from its count."""
    for folder in sorted(found.keys() | counted.keys()):
        now, limit = found.get(folder, 0), counted.get(folder, 0)
        text = f"{folder}: {now} findings, {limit} counted in {COUNTS}"
        if now > limit:
            yield f"{text}; correct the new ones, listed by check_language.py --show {folder}"
        elif now < limit:
            yield f"{text}; run scripts/check_language.py --lower"


def lowered(found: dict[str, int], counted: dict[str, int]) -> dict[str, int]:
    """Return counts that are never above the old ones."""
    return {folder: min(limit, found.get(folder, 0)) for folder, limit in counted.items()}


def all_findings() -> list[Finding]:
    """Return the findings of all source files that git knows."""
    banned = BannedWords((ROOT / GLOSSARY).read_text(encoding="utf-8"))
    files = [name for name in _git("ls-files").splitlines() if Path(name).suffix in TEXTS]
    existing = [name for name in files if (ROOT / name).is_file()]
    return [
        finding
        for name in existing
        for finding in findings_in(name, (ROOT / name).read_text(encoding="utf-8"), banned)
    ]


def new_subjects(since: str) -> list[str] | None:
    """Return short hash and subject of each commit after `since`; None where history does not reach it."""
    command = ["git", "merge-base", "--is-ancestor", since, "HEAD"]
    if subprocess.run(command, cwd=ROOT, capture_output=True).returncode:
        return None
    return _git("log", "--no-merges", "--format=%h %s", f"{since}..HEAD").splitlines()


def _git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout


def main() -> int:
    """Print every folder whose count is wrong and every subject that is too long; 1 if there was any."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--show", metavar="FOLDER", help="print the findings of a folder or file")
    parser.add_argument("--lower", action="store_true", help="write counts that have fallen")
    arguments = parser.parse_args()
    counts = json.loads((ROOT / COUNTS).read_text(encoding="utf-8"))
    findings = all_findings()
    if arguments.show:
        shown = Path(arguments.show)
        for finding in findings:
            if shown in (path := Path(finding.path), *path.parents):
                print(finding)
        return 0
    found = Counter(folder_of(finding.path, counts["findings"]) for finding in findings)
    if arguments.lower:
        counts["findings"] = lowered(found, counts["findings"])
        (ROOT / COUNTS).write_text(json.dumps(counts, indent=2) + "\n", encoding="utf-8")
    subjects = new_subjects(counts["subjects_since"])
    errors = [*ratchet_errors(found, counts["findings"]), *subject_findings(subjects or [])]
    for error in errors:
        print(error, file=sys.stderr)
    if subjects is None:
        print("language: commit subjects not checked, history does not reach " + counts["subjects_since"])
    left = sum(found.values())
    print(f"language: {len(errors)} errors" if errors else f"language: {left} findings, as counted")
    return int(bool(errors))


if __name__ == "__main__":
    sys.exit(main())
