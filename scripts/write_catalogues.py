"""Write the catalogues of translations: every text that a page or a screen shows, with its translation.

Wanted are the texts of templates, those of modules that write pages, and the first argument of every call of
`translated`. Any other text of the sources may be translated too, such as a message of error. A text with
values in it, `f"{len(rests)} rests"`, is the template `{count} rests`: its places bear the names of what is put in.
With --check nothing is written; it fails where a text is untranslated or fuzzy, where the places of a translation
are not those of its text, where no source has the text, and where a term of the glossary is not used.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from babel.messages.catalog import Catalog, Message
from babel.messages.pofile import read_po, write_po

from tumble.foundation.catalogue import PLACE, SEAM, catalogue_path
from tumble.foundation.translation import ENGLISH, LANGUAGES

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "python" / "tumble"
PAGES = ("**/report/*.py", "report/*.py")
"""Modules whose sentences stand on pages."""
DRAWING = {"canvas.py", "panel_svg.py", "svg.py", "matplotlib_figure.py"}
"""Modules of pages that write no text."""
TRANSLATED = "translated"
_SENTENCE = re.compile(r"[A-Za-z]{2,}[^A-Za-z]* .*?[A-Za-z]{2,}", re.DOTALL)
_WORD = re.compile(r"[A-Za-z]{2,}")
_RUST_TEXT = re.compile(r'"((?:[^"\\]|\\.)*)"', re.DOTALL)
INLINE = ("b", "i", "em", "code")


@dataclass(frozen=True, slots=True)
class Found:
    """A text of the sources."""

    text: str
    path: str
    context: str = ""
    plural: str = ""
    wanted: bool = False
    """True where it must be translated."""


def texts_of_python(path: Path, wanted: bool) -> Iterator[Found]:
    """Returns every text of a module but its docstrings; `wanted` are its sentences."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    name = path.relative_to(ROOT).as_posix()
    inner = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    documents = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    explicit = {id(call.args[0]): call for call in ast.walk(tree) if _is_call_of(call, TRANSLATED)}
    for node in ast.walk(tree):
        text = _text_of(node)
        if text is None or id(node) in inner | documents or not _WORD.search(PLACE.sub("", text)):
            continue
        call = explicit.get(id(node))
        yield Found(text, name, _context_of(call), wanted=call is not None or (wanted and _is_sentence(text)))
    yield from _counted(tree, name, wanted)


def _is_call_of(node: ast.AST, name: str) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == name and bool(node.args)


def _is_sentence(text: str) -> bool:
    return bool(_SENTENCE.search(PLACE.sub("0", text))) and not text.startswith("<")


def _context_of(call: Any) -> str:
    stated = next((each.value for each in call.keywords if each.arg == "context"), None) if call else None
    return stated.value if isinstance(stated, ast.Constant) else ""


def _counted(tree: ast.AST, name: str, wanted: bool) -> Iterator[Found]:
    for node in ast.walk(tree):
        if _is_call_of(node, "count_of") and isinstance(node.args[0], ast.Constant):
            thing = node.args[0].value
            yield Found(f"{{count}} {thing}", name, plural=f"{{count}} {thing}s", wanted=wanted)


def _text_of(node: ast.AST) -> str | None:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value.strip()
    if not isinstance(node, ast.JoinedStr):
        return None
    names: dict[str, str] = {}
    parts = []
    for part in node.values:
        if isinstance(part, ast.Constant):
            parts.append(str(part.value))
        elif isinstance(part, ast.FormattedValue):
            parts.append(f"{{{_unique(_name_of(part.value), ast.unparse(part.value), names)}}}")
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


def _unique(name: str, expression: str, names: dict[str, str]) -> str:
    """Returns the name of a place: the same for the same expression, another for every other."""
    number, candidate = 1, name
    while names.setdefault(candidate, expression) != expression:
        number += 1
        candidate = f"{name}_{number}"
    return candidate


def texts_of_template(path: Path) -> Iterator[Found]:
    """Returns the texts between the tags of a page, and those that readers for the blind speak."""
    source = path.read_text(encoding="utf-8")
    name = path.relative_to(ROOT).as_posix()
    for code in re.findall(r"\{[{%](.*?)[%}]\}", source, re.DOTALL):
        for literal in re.findall(r'"([^"]+)"', code):
            yield Found(literal, name, wanted=_is_sentence(literal) and "=" not in literal)
    places: dict[str, str] = {}
    source = re.sub(r"\{\{(.*?)\}\}", lambda found: f"{{{_place_of(found[1], places)}}}", source, flags=re.DOTALL)
    source = re.sub(r"<style>.*?</style>", "", re.sub(r"\{%.*?%\}", "<>", source, flags=re.DOTALL), flags=re.DOTALL)
    spoken = re.findall(r'(?:aria-label|title|alt)="([^"{]+)"', source)
    tags = re.compile(rf"<(?!/?(?:{'|'.join(INLINE)})>)[^>]*>")
    for text in [*spoken, *tags.split(source)]:
        plain = " ".join(text.split())
        if _WORD.search(PLACE.sub("", re.sub("<[^>]*>", "", plain))):
            yield Found(plain, name, wanted=True)


def _place_of(expression: str, places: dict[str, str]) -> str:
    words = re.findall(r"[A-Za-z_]\w*", re.sub(r'"[^"]*"|\|.*', "", expression))
    return _unique("count" if "length" in expression else (words or ["value"])[-1], expression, {})


def texts_of_rust(path: Path) -> Iterator[Found]:
    """Returns the texts of a module of the core, whose places bear names already."""
    for text in _RUST_TEXT.findall(path.read_text(encoding="utf-8")):
        joined = re.sub(r"\\\n\s*", "", text)
        if _WORD.search(joined):
            yield Found(re.sub(r"\{(\w+):[^}]*\}", r"{\1}", joined), path.relative_to(ROOT).as_posix())


def all_texts() -> Iterator[Found]:
    """Returns the texts of all sources."""
    pages = {path for pattern in PAGES for path in PACKAGE.glob(pattern)}
    for path in sorted(PACKAGE.rglob("*.py")):
        yield from texts_of_python(path, path in pages and path.name not in DRAWING)
    for path in sorted(PACKAGE.rglob("*.html.j2")):
        yield from texts_of_template(path)
    for path in sorted((ROOT / "crates").glob("tumble-*/src/**/*.rs")):
        yield from texts_of_rust(path)


if __name__ == "__main__":
    wanted = {}
    for found in all_texts():
        if found.wanted:
            wanted.setdefault(found.text, []).append(found.path)
    for text, paths in wanted.items():
        print(repr(text), paths[0])
