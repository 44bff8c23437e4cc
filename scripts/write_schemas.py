"""Write docs/schema/*.json from the models of all documents; with --check report whether they are stale."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from made_files import ROOT, write_or_check

from tumble.foundation.schemas import EVENTS, PRINTED, SCHEMAS, schema_text

FOLDER = ROOT / "docs" / "schema"


def made() -> Iterator[tuple[Path, str]]:
    """Returns every schema that is published."""
    for schema in (SCHEMAS | PRINTED | EVENTS).values():
        yield FOLDER / f"{schema.name}.schema.json", schema_text(schema)


if __name__ == "__main__":
    sys.exit(write_or_check(made(), __doc__, __file__))
