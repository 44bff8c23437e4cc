"""JSON that every command prints with `--json` where nothing could be done."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tumble.cli.errors import ERROR
from tumble.foundation.printed import Printed


class Mistake(Printed):
    """The mistake, its place, its cause and the remedy."""

    kind: str
    """`LogError`, `ProcedureError` ...: which part of what was given is wrong."""
    about: str
    """The file or unit; empty where the message names it, or it is about none."""
    why: str
    """Cause and remedy."""
    message: str
    """Both, as on standard error."""


class ErrorDocument(Printed):
    """A mistake of the user, or of what was given; the exit code is 2."""

    schema_: Literal["tumble-error/1"] = Field(ERROR, alias="schema")
    verdict: Literal["error"]
    event: Literal["failed"] = "failed"
    """Present in a live session, whose last event the document is."""
    reason: str = ""
    """The message again, as other events have their reasons."""
    recorded: str = ""
    """Folder that holds the samples received in a live session."""
    error: Mistake
