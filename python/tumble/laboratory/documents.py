"""Documents of a registry by the hash of their content: a folder, or any place that fsspec knows by URL."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tumble.foundation.errors import OutputError, TumbleError
from tumble.foundation.file_reading import read_whole
from tumble.foundation.file_status import exists
from tumble.foundation.files import FileKind, make_folder, replacing
from tumble.laboratory.database import RegistryError

_ANYTHING = FileKind("a document", re.compile(b""))
_HASH = re.compile(r"[0-9a-f]{64}")

_LARGEST = 1 << 28
"""Bytes of a document: pages and certificates take a hundredth of it."""


def documents_beside(path: Path) -> Path:
    """Return the folder beside the file of a registry that its documents are in unless it states another."""
    return path.with_name(f"{path.stem}-documents")


class Documents:
    """A store of documents; what is in it is never changed."""

    def __init__(self, place: str, beside: Path | None = None) -> None:
        """Open a store; a path is relative to the folder `beside`. Raises `RegistryError`."""
        self.place = place
        self._is_folder = "://" not in place
        self._files, self._root = _opened(str((beside or Path()) / place) if self._is_folder else place)

    def keep(self, content: bytes) -> str:
        """Store a document, unless it is there, and return its hash; raises `OutputError`."""
        digest = hashlib.sha256(content).hexdigest()
        if self.size(digest) != len(content):
            self._write(digest, content)
        return digest

    def read(self, digest: str) -> bytes:
        """Return a document; raises `RegistryError` where it is missing, cannot be read or was changed."""
        content = self.raw(digest)
        if hashlib.sha256(content).hexdigest() != digest:
            raise RegistryError(
                f"{self._path(digest)}: was changed since it was stored; restore it from a backup"
            )
        return content

    def raw(self, digest: str) -> bytes:
        """Return a document as it lies there; raises `RegistryError` where it cannot be read."""
        path = self._path(digest)
        if self._is_folder and exists(path):
            return read_whole(path, _LARGEST, "document", remedy="restore it", error=RegistryError)
        try:
            found: bytes = self._files.cat_file(path, start=0, end=_LARGEST)
        except FileNotFoundError:
            raise RegistryError(
                f"{self._path(digest)}: document is missing; restore it from a backup"
            ) from None
        except Exception as error:  # libraries of stores raise errors of their own
            raise _unreadable(self._path(digest), error) from error
        return found

    def size(self, digest: str) -> int | None:
        """Return the size of a document, bytes; None where it is not there, or cannot be asked for."""
        try:
            return int(self._files.size(self._path(digest)))
        except Exception:  # libraries of stores raise errors of their own; what is written next states them
            return None

    def hashes(self) -> Iterator[str]:
        """Yield the hash of each document that lies there; raises `RegistryError`."""
        try:
            paths = list(self._files.find(self._root))
        except Exception as error:  # libraries of stores raise errors of their own
            raise _unreadable(self._root, error) from error
        names = (str(path).rpartition("/")[2] for path in paths)
        yield from (name for name in names if _HASH.fullmatch(name))

    def _path(self, digest: str) -> str:
        return f"{self._root}/{digest[:2]}/{digest}"

    def _write(self, digest: str, content: bytes) -> None:
        path = self._path(digest)
        try:
            if self._is_folder:
                make_folder(Path(path).parent)
                with replacing(path, _ANYTHING, renews=True, durable=True) as file:
                    file.write(content)
                return
            self._files.makedirs(path.rpartition("/")[0], exist_ok=True)
            self._files.pipe_file(path, content)
        except TumbleError:
            raise
        except Exception as error:  # libraries of stores raise errors of their own
            remedy = "give room for it" if self._is_folder else "check the address, network and credentials"
            raise OutputError(f"{path}: cannot be written: {_words_of(error)}; {remedy}") from error


def _unreadable(place: str, error: Exception) -> RegistryError:
    return RegistryError(f"{place}: cannot be read: {_words_of(error)}")


def _words_of(error: Exception) -> str:
    return getattr(error, "strerror", None) or " ".join(str(error).split()) or type(error).__name__


def _opened(place: str) -> tuple[Any, str]:
    """Open the file system of a path or URL, with the path there; raises `RegistryError` for unknown ones."""
    import fsspec

    try:
        files, root = fsspec.core.url_to_fs(place)
    except (ImportError, ValueError) as error:
        scheme = place.partition("://")[0]
        raise RegistryError(f"documents at {scheme}://: {' '.join(str(error).split())}") from error
    except Exception as error:  # a store in a store is opened, by libraries that raise errors of their own
        raise RegistryError(f"documents at {place}: {' '.join(str(error).split())}") from error
    return files, str(root)
