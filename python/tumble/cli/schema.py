"""`tumble schema`: the schemas of documents, which editors and other programs check them with."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.foundation.errors import TumbleError
from tumble.foundation.schemas import EVENTS, PRINTED, SCHEMAS, schema_text

KNOWN = SCHEMAS | PRINTED | EVENTS


def schema_command(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help=f"One of {', '.join(KNOWN)}.", show_default=False)
    ] = None,
) -> None:
    """Print the JSON Schema of a document; without a name, list the documents.

    Example: tumble schema calibration > calibration.schema.json

    An editor that knows YAML checks documents with it as they are typed.
    """
    if name is None:
        for schema in KNOWN.values():
            print(f"{schema.name}: {schema.what}")
        return
    if name not in KNOWN:
        raise TumbleError(f"schema {name}: there is none of that name; there are {', '.join(KNOWN)}")
    print(schema_text(KNOWN[name]), end="")
