"""Addresses of registries: a file of SQLite, or a URL of PostgreSQL. Passwords are never shown."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from tumble.foundation.errors import PlaceError, TumbleError
from tumble.foundation.file_status import expanded
from tumble.foundation.secrets import HARMLESS, HIDDEN
from tumble.foundation.words import plain

if TYPE_CHECKING:
    from sqlalchemy import URL

_SQLITE = re.compile(r"sqlite:///?(?P<path>.+)")
_SERVER = re.compile(r"postgres(ql)?(\+psycopg)?://")
_KINDS = "give a file such as lab.db, or postgresql://USER@HOST/DATABASE"


@dataclass(frozen=True, slots=True)
class RegistryAddress:
    """Place of a registry."""

    path: Path | None
    """File of SQLite; None for a server."""
    url: URL | None = field(repr=False, default=None)
    """URL of a server; None for a file."""

    def __str__(self) -> str:
        """Name the place without any password."""
        if self.url is None:
            return str(self.path)
        query = {name: value if name in HARMLESS else HIDDEN for name, value in self.url.query.items()}
        shown = self.url.set(drivername="postgresql", query=query)
        return plain(shown.render_as_string(hide_password=True))

    @property
    def secrets(self) -> tuple[str, ...]:
        """Passwords that the address holds, as they are and as they are written in a URL."""
        if self.url is None:
            return ()
        hidden = [value for name, value in self.url.query.items() if name not in HARMLESS]
        values = [[value] if isinstance(value, str) else value for value in hidden]
        words = [str(each) for each in (self.url.password, *chain(*values)) if each]
        written = self.url.render_as_string(hide_password=False)
        quoted = re.search(r"://[^@/]*:(?P<password>[^@/]*)@", written)
        found = {*words, *((quoted["password"],) if quoted else ())}
        return tuple(sorted((each for each in found if each), key=len, reverse=True))

    def without_secrets(self, text: str) -> str:
        """Return text of a driver on one line, with its passwords hidden."""
        line = " ".join(text.split())
        for secret in self.secrets:
            line = line.replace(secret, HIDDEN)
        return plain(line)


def parse_address(text: str | Path) -> RegistryAddress:
    """Read an address; raises `TumbleError` where it is none."""
    stated = str(text).strip()
    if isinstance(text, str) and _SERVER.match(stated):
        return RegistryAddress(None, _server(stated))
    if isinstance(text, str) and (found := _SQLITE.fullmatch(stated)):
        return RegistryAddress(_file(unquote(found["path"])))
    if not stated or (isinstance(text, str) and "://" in stated):
        raise TumbleError(f"registry {shown(stated)}: is not an address of a registry; {_KINDS}")
    return RegistryAddress(_file(stated))


def shown(text: str) -> str:
    """Return an address as it was typed, without what may be a password."""
    scheme, mark, rest = text.partition("://")
    if not mark:
        return plain(text)
    _, at, place = rest.rpartition("@")
    visible = place.partition("?")[0] if at else ""
    return plain(f"{scheme}{mark}{HIDDEN}{at}{visible}")


def _file(text: str) -> Path:
    try:
        return expanded(text).absolute()
    except (PlaceError, ValueError, OSError) as error:
        raise TumbleError(f"registry {plain(text)}: is not a file name; {_KINDS}") from error


def _server(text: str) -> URL:
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError

    try:
        url = make_url(text).set(drivername="postgresql+psycopg")
    except (ArgumentError, ValueError):
        # The parser's message may hold the password, which may be what is not quoted in the URL.
        raise TumbleError(
            f"registry {shown(text)}: is not the URL of a database; give "
            "postgresql://USER@HOST:PORT/DATABASE, signs such as @ or / in a password as %40 or %2F"
        ) from None
    if not url.database:
        raise TumbleError(f"registry {shown(text)}: names no database; give postgresql://USER@HOST/DATABASE")
    return url
