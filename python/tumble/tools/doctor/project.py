"""Settings of the project file and the environment: each with its value and the place that states it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from tumble.foundation.errors import TumbleError
from tumble.foundation.project_file import KEYS, NAME, project_settings, user_file
from tumble.tools.doctor.result import Diagnosed, State

_CREDENTIALS = re.compile(r"(?<=://).*@")
_QUERY = re.compile(r"(?<=://).*\?.*")


def project(home: Path | None = None) -> Iterator[Diagnosed]:
    """Look at what applies in the working folder."""
    try:
        found = project_settings(home=home)
    except TumbleError as error:
        yield Diagnosed(NAME, State.BROKEN, str(error))
        return
    for name in KEYS:
        if name in found:
            setting = found[name]
            yield Diagnosed(name, State.WORKS, f"{without_password(setting.value)}, from {setting.source}")
    if not found:
        yield Diagnosed(NAME, State.MISSING, f"none in this folder or above, nor {user_file(home)}")


def without_password(value: str) -> str:
    """Return a value without what stands before the host, or behind the name, of a URL."""
    shown = _CREDENTIALS.sub("***@", value)
    return _QUERY.sub(lambda found: found[0].partition("?")[0] + "?***", shown)
