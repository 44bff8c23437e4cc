"""No file is taken for one of Tumble because its text names Tumble."""

from __future__ import annotations

import ast
import gc
import importlib
from pathlib import Path

import tumble
from tumble.foundation.files import FileKind
from tumble.tools.exchange.registry import TARGETS

FOLDER = Path(tumble.__file__).parent
NOTES = (
    "notes of the tumble dryer, mine alone", "/home/me/tumble/drawing.svg", "Tumble", "tumble", "TUMBLE 2",
    "the tumble fleet of our launderette", "tumble bench: buy one", "see tumble export",
    '{"tumble": 1}', '{"notes": "tumble fleet"}',
)  # fmt: skip
"""Texts of users that name Tumble, and begin as some of its files do."""
OF_ANY_CONTENT = {"a document", "a batch of tumble turntable"}
"""Kinds that are replaced by what holds all of the old content, or has its name by its hash."""


def kinds():
    """All kinds of files that the package writes."""
    for path in FOLDER.rglob("*.py"):
        calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
        if any(isinstance(node.func, ast.Name) and node.func.id == "FileKind" for node in calls):
            importlib.import_module(".".join(("tumble", *path.relative_to(FOLDER).with_suffix("").parts)))
    for target in TARGETS.values():
        yield target.output_kind
    targets = {id(target.kind) for target in TARGETS.values()}
    # Objects that the collector leaves alone are not among those that it lists.
    gc.unfreeze()
    found = [each for each in gc.get_objects() if isinstance(each, FileKind) and id(each) not in targets]
    gc.freeze()
    yield from found


def test_a_file_that_names_tumble_bears_no_mark():
    found = {kind for kind in kinds() if kind.name not in OF_ANY_CONTENT}
    assert len(found) > 30
    for kind in found:
        for note in NOTES:
            for text in (note, f"%PDF-1.4 {note}", f"PAR1{note}", f"# {note}\n"):
                assert not (kind.mark or kind.start).search(text.encode()), (kind.name, text)
