"""The documents that people read and edit, by the names of their schemas, and the schemas themselves."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import import_module
from typing import Any


@dataclass(frozen=True, slots=True)
class DocumentSchema:
    """A kind of document, and the model that reads it, imported when it is asked for."""

    name: str
    """`calibration`: documents of this kind begin with `schema: tumble-calibration/VERSION`."""
    what: str
    """Name of such a document in messages."""
    module: str
    model: str
    is_stated: bool = False
    """Indicates whether a document must state its `schema`."""

    def load_model(self) -> Any:  # noqa: ANN401 - a model of pydantic, which is imported late
        """Imports the model."""
        return getattr(import_module(self.module), self.model)


CALIBRATION = DocumentSchema(
    "calibration", "calibration file", "tumble.calibration.document", "Calibration", is_stated=True
)
POSES = DocumentSchema("poses", "pose list", "tumble.poses.pose_list", "PoseFile")
LIMITS = DocumentSchema("limits", "limits file", "tumble.calibration.limits", "Limits")
REDUNDANCY = DocumentSchema(
    "redundancy", "redundancy settings file", "tumble.procedures.redundancy.settings", "RedundancySettings"
)
STORED_ERROR = DocumentSchema(
    "stored-error", "stored error", "tumble.procedures.redundancy.store", "StoredError", is_stated=True
)
TABLE_PROFILE = DocumentSchema("table-profile", "table profile", "tumble.tools.table.profile", "TableProfile")
SESSION = DocumentSchema("session", "recorded session", "tumble.logs.session", "Session", is_stated=True)

SCHEMAS = {
    schema.name: schema
    for schema in (CALIBRATION, POSES, LIMITS, REDUNDANCY, STORED_ERROR, TABLE_PROFILE, SESSION)
}


def schema_stated(content: object) -> DocumentSchema | None:
    """Returns the kind of document that `schema: tumble-NAME/VERSION` says, if it says one."""
    name, _, _ = str(content)[:40].removeprefix("tumble-").partition("/")
    return SCHEMAS.get(name)


def schema_in(head: bytes) -> DocumentSchema | None:
    """Returns the kind of document that begins like this, if it says one on a line of its own."""
    line = re.search(rb"^schema:\s*[\"']?(tumble-[\w-]+/)", head, re.MULTILINE)
    return schema_stated(line[1].decode()) if line else None


def schema_text(schema: DocumentSchema) -> str:
    """Writes JSON Schema (draft 2020-12) of a document."""
    import json

    from pydantic.json_schema import GenerateJsonSchema

    class WithoutTitles(GenerateJsonSchema):
        """The keys are titles enough."""

        def field_title_should_be_set(self, schema: object) -> bool:
            return False

    model = schema.load_model()
    urn = f"urn:{model.model_fields['schema_'].default.replace('/', ':')}"
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": urn}
    body = model.model_json_schema(schema_generator=WithoutTitles)
    return json.dumps(head | body, indent=2, ensure_ascii=False) + "\n"
