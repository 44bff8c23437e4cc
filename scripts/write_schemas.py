"""Write docs/schema/*.json from the models that read the files, or with --check say if they are stale."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tumble.schemas import SCHEMAS, schema_text

FOLDER = Path(__file__).parents[1] / "docs" / "schema"


def main() -> int:
    """Write or check; the exit code is 1 where a checked file is out of date."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing, fail where a file is stale")
    check = parser.parse_args().check
    stale = []
    for schema in SCHEMAS.values():
        name = f"{schema.name}.schema.json"
        path, text = FOLDER / name, schema_text(schema)
        if path.is_file() and path.read_text(encoding="utf-8") == text:
            continue
        stale.append(name)
        if not check:
            path.write_text(text, encoding="utf-8")
    if check and stale:
        print(f"out of date: {', '.join(stale)}; run python scripts/write_schemas.py", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
