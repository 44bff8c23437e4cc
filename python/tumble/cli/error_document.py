"""JSON that every command prints with `--json` where nothing could be done."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tumble.cli.errors import ERROR
from tumble.foundation.printed import Printed


class Mistake(Printed):
    """What is wrong, where, why, and what to do."""

    kind: str
    """`LogError`, `ProcedureError` ...: which part of what was given is wrong."""
    about: str
    """The file or unit; empty where the message names it, or it is about none."""
    why: str
    """What is wrong with it, and what to do."""
    message: str
    """Both, as on standard error."""


class ErrorDocument(Printed):
    """A mistake of the user, or of what was given; the exit code is 2."""

    schema_: Literal["tumble-error/1"] = Field(ERROR, alias="schema")
    verdict: Literal["error"]
    event: Literal["failed"] = "failed"
    """Of a live session, where the document is its last event."""
    reason: str = ""
    """The message again, as other events have their reasons."""
    recorded: str = ""
    """Of a live session, the folder that holds what was received."""
    error: Mistake
