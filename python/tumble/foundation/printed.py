"""JSON documents that commands print, as models of which their published schemas are made.

Numbers that are not finite are null in them. Nothing is read with these models.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, create_model
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from tumble.foundation.field_docstrings import field_docstrings


class Printed(BaseModel):
    """A document, or a part of one: every key is known."""

    model_config = ConfigDict(extra="forbid", arbitrary_types_allowed=True, use_attribute_docstrings=True)


class PrintedResult(Printed):
    """Result of a procedure."""

    event: Literal["result"] = "result"
    """Present in a live session, whose last event the document is."""
    software: str
    warnings: list[str]
    """Remarks to read before the result is used."""
    files: dict[str, Path]
    """Path of each file that was written, by what it is."""


class PrintedParameter(Printed):
    """One estimated number with its uncertainty."""

    name: str
    unit: str
    value: float
    sigma: float
    """1-sigma; null where it is not observable."""
    low: float
    high: float
    """Ends of the 95 % interval."""
    observable: bool
    reason: str
    """Why it could not be observed."""


class PrintedGravity(Printed):
    """Local gravity."""

    value: float
    """m/s^2."""
    source: str
    sigma: float | None
    """m/s^2; null where it is not stated."""


class PrintedSchema(GenerateJsonSchema):
    """Makes schemas of what is printed: the keys are titles enough, arrays are nested lists."""

    def field_title_should_be_set(self, schema: object) -> bool:
        """Leave titles out."""
        return False

    def float_schema(self, schema: core_schema.FloatSchema) -> JsonSchemaValue:
        """Allow null for what is not finite."""
        return super().float_schema(schema) | {"type": ["number", "null"]}

    def is_instance_schema(self, schema: core_schema.IsInstanceSchema) -> JsonSchemaValue:
        """Take an array as the nested list that it is printed as."""
        kind: Any = schema["cls"]
        return {"type": "array"} if issubclass(kind, np.ndarray) else super().is_instance_schema(schema)


class PrintedGoal(Printed):
    """Progress of one term of what was asked for."""

    name: str
    unit: str
    sigma: float
    """1-sigma; null while it is not shown."""
    wanted: float
    """Largest sigma that is good enough."""
    target: str
    """Unit that is furthest from it."""


def event_model(step: type) -> type[Printed]:
    """Creates the model of the events of a live session from the data class of its steps.

    Its `kind` is the key `event`, and goals are printed by their name.
    """
    meanings = field_docstrings(step)
    fields: dict[str, Any] = {
        "event" if name == "kind" else name: (
            list[PrintedGoal] if name == "goals" else kind,
            Field(description=meanings.get(name)),
        )
        for name, kind in get_type_hints(step).items()
    }
    return create_model(f"{step.__name__}Event", __base__=Printed, __doc__=step.__doc__, **fields)
