"""The project file `tumble.toml`: settings that a laboratory would otherwise type with every command.

The nearest file upwards from the working folder is the project's, the other one the user's. A setting comes
from the option that is typed, else the environment, else the project, else the user.
"""

from __future__ import annotations

import difflib
import os
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tumble.foundation.errors import PlaceError, TumbleError
from tumble.foundation.file_reading import read_text_whole
from tumble.foundation.file_status import exists, expanded, home_folder, working_folder
from tumble.foundation.words import quoted

NAME = "tumble.toml"
LARGEST = 1 << 14
"""Bytes. The time to read a key grows with the square of its dots."""
LONGEST_VALUE = 1000
"""Letters."""

KEYS: Mapping[str, str] = {
    "laboratory": "name of the laboratory",
    "operator": "who calibrates",
    "station": "where that is done",
    "registry": "file or URL of the registry of calibrations",
    "reference_certificate": "certificate of the reference: YAML, or XML or PDF of tumble certificate",
    "reference_signer": "public file (.crt) of the laboratory that signs certificates of references",
    "reference_model": "model of the reference, which its certificate has to be of",
    "limits": "limits file against which targets are checked",
    "decision": "decision rule where the limits file states none: simple, guarded or guarded:GUARD",
    "manufacturer": "maker of the units",
    "model": "model of the units",
    "lot": "lot of the units",
    "language": "languages of certificates: en, or en,zh",
    "address": "address of the laboratory",
    "country": "country of the laboratory by ISO 3166-1, such as DE",
    "accreditation": "number of the laboratory's accreditation",
    "logo": "logo of the laboratory: SVG, PNG or JPEG",
    "customer": "name of the customer",
    "customer_address": "address of the customer",
    "authorised_by": "who authorises certificates",
    "certificate_number": "pattern of the numbers of certificates, such as IMU-{year}-{n:04}",
    "template": "layout of certificates, in typst",
    "signing_key": "key of the laboratory that signs certificates",
}
"""Settings and their meaning; `TUMBLE_` and the name in capitals is the variable of the environment."""
PLACES = (
    *("registry", "limits", "reference_certificate", "reference_signer", "logo", "template"),
    "signing_key",
)
"""Settings that name a file: relative to the folder of the file they stand in."""
LANGUAGES = ("en", "en,zh")


@dataclass(frozen=True, slots=True)
class ProjectSetting:
    """A setting that applies."""

    name: str
    value: str
    source: str
    """File, or variable of the environment, that states it."""


def project_settings(folder: Path | None = None, home: Path | None = None) -> dict[str, ProjectSetting]:
    """Return each setting that the environment, the project or the user states, by name.

    Raises `TumbleError`, in one line, where a file holds anything but settings.
    """
    found: dict[str, ProjectSetting] = {}
    for path in reversed(list(project_files(folder, home))):
        found |= {name: ProjectSetting(name, value, str(path)) for name, value in _read(path).items()}
    for name in KEYS:
        variable = f"TUMBLE_{name.upper()}"
        if value := os.environ.get(variable):
            found[name] = ProjectSetting(name, _checked(name, value, variable), variable)
    return found


def project_files(folder: Path | None = None, home: Path | None = None) -> Iterator[Path]:
    """Yield the project's file, then the user's, as far as they exist."""
    start, users = (folder or working_folder()).resolve(), user_file(home)
    project = next((path for each in (start, *start.parents) if _exists(path := each / NAME)), None)
    if project is not None:
        yield project
    if _exists(users) and users != project:
        yield users


def user_file(home: Path | None = None) -> Path:
    """Return the place of the user's file, whether it exists or not."""
    if home is None and os.name == "nt" and (roaming := os.environ.get("APPDATA")):
        return Path(roaming) / "tumble" / NAME
    if home is None and (configured := os.environ.get("XDG_CONFIG_HOME")):
        return Path(configured) / "tumble" / NAME
    return (home or home_folder()) / ".config" / "tumble" / NAME


def _exists(path: Path) -> bool:
    try:
        return exists(path)
    except PlaceError:  # a folder that this user may not look into
        return False


def _read(path: Path) -> dict[str, str]:
    return {name: _placed(path, name, value) for name, value in _stated(path).items()}


def _stated(path: Path) -> dict[str, str]:
    text = read_text_whole(path, LARGEST, "settings", remedy="keep lines of NAME = TEXT in it, or remove it")
    stated: dict[str, str] = {}
    for key, value in _parsed(path, text).items():
        line = _line_of(text, key)
        about = f"{path}: line {line}"
        if key not in KEYS:
            near = difflib.get_close_matches(key, KEYS, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(KEYS)}"
            raise TumbleError(f"{quoted(key)} is not a setting; {hint}", about=about)
        if not isinstance(value, str):
            raise TumbleError(f'{key} needs to be text, such as {key} = "..."', about=about)
        stated[key] = _checked(key, value, about)
    return stated


def _parsed(path: Path, text: str) -> dict[str, Any]:
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    found: dict[str, Any] = {}
    try:
        found |= tomllib.loads(text)
    except ValueError as error:  # of numbers that are too long as well
        raise TumbleError(f"{path}: is not TOML: {error}; correct it there") from error
    except RecursionError as error:
        raise TumbleError(f"{path}: is nested too deeply; settings are lines of NAME = TEXT") from error
    return found


def _line_of(text: str, key: str) -> int:
    """Return the line on which a key stands, 1 where it is written in another way."""
    pattern = re.compile(rf"\s*\[*\s*[\"']?{re.escape(key)}\b")
    return next((n for n, line in enumerate(text.splitlines(), start=1) if pattern.match(line)), 1)


def _checked(name: str, value: str, about: str) -> str:
    if not value.strip() or len(value) > LONGEST_VALUE or not value.isprintable():
        raise TumbleError(f"{name} needs to be a line of text; give one, or leave it out", about=about)
    if name == "language" and value not in LANGUAGES:
        raise TumbleError(f"{name} needs to be one of {' or '.join(LANGUAGES)}", about=about)
    return value


def _placed(path: Path, name: str, value: str) -> str:
    """Return a value whose relative path begins at the folder of its file; URLs stay as they are."""
    if name not in PLACES or "://" in value:
        return value
    try:
        return str(path.parent / expanded(value))
    except PlaceError as error:
        raise TumbleError(f"{name}: {error}", about=str(path)) from error
