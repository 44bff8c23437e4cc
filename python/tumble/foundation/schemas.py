"""The documents that people read and edit and that commands print, by the names of their schemas."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from tumble.foundation.procedures import PROCEDURES


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
REFERENCE_CERTIFICATE = DocumentSchema(
    "reference-certificate",
    "certificate of a reference",
    "tumble.calibration.reference_certificate",
    "ReferenceCertificate",
    is_stated=True,
)
LIMITS = DocumentSchema("limits", "limits file", "tumble.calibration.limits", "Limits")
REDUNDANCY = DocumentSchema(
    "redundancy", "redundancy settings file", "tumble.procedures.redundancy.settings", "RedundancySettings"
)
STORED_ERROR = DocumentSchema(
    "stored-error", "stored error", "tumble.procedures.redundancy.store", "StoredError", is_stated=True
)
TABLE_PROFILE = DocumentSchema("table-profile", "table profile", "tumble.tools.table.profile", "TableProfile")
SESSION = DocumentSchema("session", "recorded session", "tumble.logs.session", "Session", is_stated=True)
FLEET_JOB = DocumentSchema("fleet-job", "fleet job", "tumble.fleet.job", "FleetJob")

SCHEMAS = {
    schema.name: schema
    for schema in (
        *(CALIBRATION, POSES, LIMITS, REFERENCE_CERTIFICATE),
        *(REDUNDANCY, STORED_ERROR, TABLE_PROFILE, SESSION, FLEET_JOB),
    )
}


def _printed(name: str, tool: str, model: str, what: str) -> DocumentSchema:
    return DocumentSchema(name, what, f"tumble.tools.{tool}.summary_document", model)


_ERROR = DocumentSchema(
    "error", "what was wrong, printed with --json", "tumble.cli.error_document", "ErrorDocument"
)
_RESULTS = tuple(
    DocumentSchema(
        f"{each.word}-result",
        f"result of tumble {each.word} --json",
        f"{each.folder}.summary_document",
        f"{each.word.capitalize()}Document",
    )
    for each in PROCEDURES
)
_REGISTRY = tuple(
    DocumentSchema(
        f"registry-{word}",
        f"what tumble registry {command} --json prints",
        "tumble.laboratory.summary_document",
        f"{word.capitalize()}Document",
    )
    for word, command in (
        *((each, each) for each in ("add", "list", "show", "history")),
        ("lot", "history --lot"),
        *((each, each) for each in ("due", "equipment", "verify")),
    )
)
_CERTIFICATES = DocumentSchema(
    "certificates",
    "what tumble certificate --json prints",
    "tumble.laboratory.certificate.summary_document",
    "CertificatesDocument",
)
_FLEET = (
    DocumentSchema(
        "fleet-result",
        "what tumble fleet run and show print with --json",
        "tumble.fleet.summary_document",
        "FleetResultDocument",
    ),
    DocumentSchema(
        "fleet-status",
        "what tumble fleet status --json prints",
        "tumble.fleet.summary_document",
        "FleetStatusDocument",
    ),
)
_EVENTS = tuple(
    DocumentSchema(
        f"{folder.rpartition('.')[2]}-event",
        f"events of tumble {typed} --json, one a line",
        f"tumble.{folder}.summary_document",
        model,
    )
    for typed, folder, model in (
        ("turntable --live", "procedures.turntable", "TurntableEvent"),
        ("multipose --live", "procedures.multipose", "MultiposeEvent"),
        ("spin --live", "procedures.spin", "SpinEventLine"),
        ("redundancy --live", "procedures.redundancy", "RedundancyEventLine"),
        ("record", "tools.record", "RecordEvent"),
    )
)
_SETTINGS = DocumentSchema(
    "settings",
    "settings that tumble redundancy --explain --json lists",
    "tumble.procedures.redundancy.summary_document",
    "SettingsDocument",
)
PRINTED = {
    schema.name: schema
    for schema in (
        *_RESULTS,
        _printed("compare-result", "compare", "CompareDocument", "result of tumble compare --json"),
        _printed("plateaus-result", "plateaus", "PlateausDocument", "result of tumble plateaus --json"),
        _printed("inspection", "inspect", "InspectionDocument", "what tumble inspect --json found"),
        _printed("conversion", "convert", "ConversionDocument", "what tumble convert --json wrote"),
        _printed("export", "exchange", "ExportDocument", "what tumble export --json wrote"),
        _printed("export-all", "exchange", "ExportAllDocument", "what tumble export --all --json wrote"),
        _printed("import", "exchange", "ImportDocument", "what tumble import --json read"),
        _printed("simulation", "simulate", "SimulationDocument", "what tumble simulate --json made"),
        _printed("diagnosis", "doctor", "DiagnosisDocument", "what tumble doctor --json found"),
        _printed("formats", "exchange", "FormatsDocument", "formats that tumble formats --json lists"),
        _printed(
            "export-formats",
            "exchange",
            "TargetsDocument",
            "formats that tumble export --format list --json lists",
        ),
        _printed("tables", "table", "TablesDocument", "tables that tumble table list --json lists"),
        _printed("table-position", "table", "PositionDocument", "where tumble table --json says a table is"),
        *_REGISTRY,
        _CERTIFICATES,
        *_FLEET,
        _SETTINGS,
        _ERROR,
    )
}
"""Documents that commands print with `--json`, on standard output; nothing reads them."""
EVENTS = {schema.name: schema for schema in _EVENTS}
"""Lines that live sessions print with `--json` before their document; they state no schema."""


def schema_stated(content: object) -> DocumentSchema | None:
    """Returns the kind of document that `schema: tumble-NAME/VERSION` names, if it names one."""
    name, _, _ = str(content)[:40].removeprefix("tumble-").partition("/")
    return SCHEMAS.get(name)


def schema_in(head: bytes) -> DocumentSchema | None:
    """Returns the kind of document that begins like this, if it names one on a line of its own."""
    # A pattern that begins with a byte is found far sooner than one that begins with a line.
    line = re.search(rb"\nschema:\s*[\"']?(tumble-[\w-]+/)", b"\n" + head)
    return schema_stated(line[1].decode()) if line else None


def schema_text(schema: DocumentSchema) -> str:
    """Writes JSON Schema (draft 2020-12) of a document."""
    import json

    from pydantic.json_schema import GenerateJsonSchema

    from tumble.foundation.printed import Printed, PrintedSchema

    class WithoutTitles(GenerateJsonSchema):
        """The keys are titles enough."""

        def field_title_should_be_set(self, schema: object) -> bool:
            return False

    model = schema.load_model()
    states_schema = "schema_" in model.model_fields
    stated = model.model_fields["schema_"].default if states_schema else f"tumble-{schema.name}/1"
    urn = f"urn:{stated.replace('/', ':')}"
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": urn}
    is_printed = issubclass(model, Printed)
    body = model.model_json_schema(schema_generator=PrintedSchema if is_printed else WithoutTitles)
    if is_printed and states_schema:
        body["required"] = ["schema", *body["required"]]
    return json.dumps(head | body, indent=2, ensure_ascii=False) + "\n"
