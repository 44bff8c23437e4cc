"""Write docs/schema/*.json from the models that read the files, or with --check say if they are stale."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from tumble.calibration import document
from tumble.redundancy import settings, store
from tumble.turntable import limits, poses

FOLDER = Path(__file__).parents[1] / "docs" / "schema"
MODELS: dict[str, tuple[type[BaseModel], str]] = {
    document.SCHEMA_FILE: (document.Calibration, document.SCHEMA),
    poses.SCHEMA_FILE: (poses.PoseFile, poses.SCHEMA),
    limits.SCHEMA_FILE: (limits.Limits, limits.SCHEMA),
    settings.SCHEMA_FILE: (settings.RedundancySettings, settings.SCHEMA),
    store.SCHEMA_FILE: (store.StoredError, store.SCHEMA),
}


class _WithoutTitles(GenerateJsonSchema):
    """The keys are titles enough."""

    def field_title_should_be_set(self, schema: object) -> bool:
        return False


def schema_text(model: type[BaseModel], version: str) -> str:
    """JSON Schema (draft 2020-12) of a model, as the file holds it."""
    urn = f"urn:{version.replace('/', ':')}"
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": urn}
    body = model.model_json_schema(schema_generator=_WithoutTitles)
    return json.dumps(head | body, indent=2, ensure_ascii=False) + "\n"


def main() -> int:
    """Write or check; the exit code is 1 where a checked file is out of date."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing, fail where a file is stale")
    check = parser.parse_args().check
    stale = []
    for name, (model, version) in MODELS.items():
        path, text = FOLDER / name, schema_text(model, version)
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
