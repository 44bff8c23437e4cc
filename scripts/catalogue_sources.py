"""Texts of the sources that a catalogue of translations may hold, and those that it must hold."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

from tumble.foundation.template import PLACE
from tumble.laboratory.certificate.catalogue import CONTEXT as CERTIFICATES
from tumble.report.translation import INLINE_TAGS

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "python" / "tumble"
PAGES = ("**/report/*.py", "report/*.py")
"""Modules whose sentences stand on pages."""
SCREENS = ("**/command*_screen.py", "cli/live_screen.py")
"""Modules whose sentences with places or capitals lead a user through a session."""
CERTIFICATE = PACKAGE / "laboratory" / "certificate" / "catalogue.py"
"""Module whose tables hold all words of certificates."""
DRAWING = {"canvas.py", "panel_svg.py", "svg.py", "matplotlib_figure.py", "notebook.py"}
"""Modules of pages that write no text, or for notebooks only."""
EXPLICIT = {"translated", "message", "words"}
"""Functions whose first argument is to be translated, wherever they are called."""

_WORD = re.compile(r"[A-Za-z]{2,}")
_SENTENCE = re.compile(r"[A-Za-z]{2,}[^A-Za-z]* .*?[A-Za-z]{2,}", re.DOTALL)
_RUST_TEXT = re.compile(r'"((?:[^"\\]|\\.)*)"', re.DOTALL)
_SAID = re.compile(r"\bsay\(\s*'([^']+)'")
"""First argument of the function that translates a text of the page in a browser."""
_JINJA = re.compile(r"\{%.*?%\}|\{#.*?#\}", re.DOTALL)
_SPLIT = "\0"
_TAGS = re.compile(rf"<(?!/?(?:{'|'.join(INLINE_TAGS)})>)[^>]*>|{_SPLIT}")


@dataclass(frozen=True, slots=True)
class SourceText:
    """A text with its place; values in it are places `{name}`."""

    text: str
    path: str
    context: str = ""
    plural: str = ""
    wanted: bool = False
    """True where it must be translated."""


def source_texts() -> Iterator[SourceText]:
    """Returns the texts of all sources."""
    pages = {path for pattern in PAGES for path in PACKAGE.glob(pattern) if path.name not in DRAWING}
    screens = {path for pattern in SCREENS for path in PACKAGE.glob(pattern)}
    for path in sorted(PACKAGE.rglob("*.py")):
        is_shown = _is_sentence if path in pages else _is_prompt if path in screens else _is_nothing
        name = path.relative_to(ROOT).as_posix()
        yield from python_texts(path.read_text(encoding="utf-8"), name, is_shown)
    yield from certificate_texts(
        CERTIFICATE.read_text(encoding="utf-8"), CERTIFICATE.relative_to(ROOT).as_posix()
    )
    for path in sorted(PACKAGE.rglob("*.html.j2")):
        yield from template_texts(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix())
    for path in sorted((ROOT / "web" / "src").rglob("*.ts")):
        yield from typescript_texts(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix())
    for path in sorted((ROOT / "crates").glob("tumble-*/src/**/*.rs")):
        yield from rust_texts(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix())


def _is_sentence(text: str) -> bool:
    return bool(_SENTENCE.search(PLACE.sub("0", text))) and not text.startswith("<")


def _is_prompt(text: str) -> bool:
    is_key = text.islower() and not PLACE.search(text) and not text.endswith(".")
    return _is_sentence(text) and not is_key and "[[" not in text


def _is_nothing(_: str) -> bool:
    return False


def python_texts(
    source: str, name: str, is_shown: Callable[[str], bool] = _is_nothing
) -> Iterator[SourceText]:
    """Returns every text of a module but its docstrings; those shown, and explicit ones, are wanted."""
    nodes = list(ast.walk(ast.parse(source)))
    inner = {id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in node.values}
    documents = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    explicit = {id(node.args[0]): node for node in nodes if _is_call_of(node, *EXPLICIT)}
    for node in nodes:
        text = None if id(node) in inner | documents else _text_of(node)
        if text and _WORD.search(PLACE.sub("", text)):
            call = explicit.get(id(node))
            yield SourceText(text, name, _context_of(call), wanted=call is not None or is_shown(text))
        if _is_call_of(node, "count_of") and isinstance(node.args[0], ast.Constant):
            one = f"{{count}} {node.args[0].value!s}"
            yield SourceText(one, name, plural=f"{one}s", wanted=is_shown("A sentence."))


def certificate_texts(source: str, name: str) -> Iterator[SourceText]:
    """Returns the values of the tables at the top of a module, in the context of certificates."""
    for node in ast.parse(source).body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.value, ast.Dict):
            for value in node.value.values:
                if text := _text_of(value):
                    yield SourceText(text, name, CERTIFICATES, wanted=True)


def template_texts(source: str, name: str) -> Iterator[SourceText]:
    """Returns the texts between the tags of a template, in its code, and those that screen readers speak."""
    for code in re.findall(r"\{[{%](.*?)[%}]\}", source, re.DOTALL):
        for literal in re.findall(r'"([^"]*)"', code):
            yield SourceText(literal, name, wanted=_is_sentence(literal) and "=" not in literal)
    source = re.sub(r"<style>.*?</style>", "", _JINJA.sub(_SPLIT, source), flags=re.DOTALL)
    spoken = re.findall(r'(?:aria-label|title|alt)="([^"{]+)"', source)
    for text in [*spoken, *_TAGS.split(source)]:
        plain = " ".join(_with_places(text).split())
        if _WORD.search(PLACE.sub("", re.sub("<[^>]*>", "", plain))):
            yield SourceText(plain, name, wanted=True)


def typescript_texts(source: str, name: str) -> Iterator[SourceText]:
    """Returns the texts that a module of the page in a browser has translated."""
    for text in _SAID.findall(source):
        yield SourceText(text, name, wanted=True)


def rust_texts(source: str, name: str) -> Iterator[SourceText]:
    """Returns the texts of a module of Rust, whose places bear names already."""
    for text in _RUST_TEXT.findall(source):
        joined = re.sub(r"\\\n\s*", "", text)
        if _WORD.search(joined):
            yield SourceText(_without_formats(joined), name)


def _without_formats(text: str) -> str:
    """Returns a text whose places are names alone, without the format of a value."""
    return re.sub(r"\{(\w+):[^}]*\}", r"{\1}", text)


def _is_call_of(node: ast.AST, *names: str) -> TypeGuard[ast.Call]:
    if not isinstance(node, ast.Call) or not node.args:
        return False
    return getattr(node.func, "id", getattr(node.func, "attr", "")) in names


def _context_of(call: Any) -> str:  # noqa: ANN401 - a call, or none
    stated = [each.value for each in call.keywords if each.arg == "context"] if call else []
    return str(stated[0].value) if stated and isinstance(stated[0], ast.Constant) else ""


def _text_of(node: ast.AST) -> str | None:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return _without_formats(node.value.strip())
    if not isinstance(node, ast.JoinedStr):
        return None
    expressions: dict[str, str] = {}
    parts = []
    for part in node.values:
        if isinstance(part, ast.FormattedValue):
            parts.append(f"{{{_unique(_name_of(part.value), ast.unparse(part.value), expressions)}}}")
        elif isinstance(part, ast.Constant):
            parts.append(str(part.value))
    return "".join(parts).strip()


def _name_of(node: ast.AST) -> str:
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name.strip("_").lower()
        case ast.Call(func=ast.Name(id="len" | "round" | "sum")):
            return "count"
        case ast.Call(func=ast.Name(id="count_of")):
            return "counted"
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)):
            return name.strip("_")
        case ast.Subscript(slice=ast.Constant(value=str(name))) if name.isidentifier():
            return name
        case ast.Subscript(value=inner) | ast.BinOp(right=inner) | ast.UnaryOp(operand=inner):
            return _name_of(inner)
    return "value"


def _unique(name: str, expression: str, expressions: dict[str, str]) -> str:
    """Returns the name of a place: the same for the same expression, another for every other."""
    number, candidate = 1, name
    while expressions.setdefault(candidate, expression) != expression:
        number += 1
        candidate = f"{name}_{number}"
    return candidate


def _with_places(text: str) -> str:
    expressions: dict[str, str] = {}

    def place(found: re.Match[str]) -> str:
        return f"{{{_unique(_place_of(found[1]), found[1], expressions)}}}"

    return re.sub(r"\{\{(.*?)\}\}", place, text, flags=re.DOTALL)


def _place_of(expression: str) -> str:
    words = re.findall(r"[A-Za-z_]\w*", re.sub(r'"[^"]*"|\|.*', "", expression))
    return "count" if "length" in expression else (words or ["value"])[-1]
