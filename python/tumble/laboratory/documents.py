"""Documents of a registry by the hash of their content: in a folder, or in a store of objects, by URL."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from pathlib import Path

from tumble.foundation.errors import OutputError, TumbleError
from tumble.foundation.file_reading import read_whole
from tumble.foundation.file_status import exists
from tumble.foundation.files import FileKind, make_folder, replacing
from tumble.foundation.stores import Store, StoreError
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
        try:
            store = Store(place if "://" in place else str((beside or Path()) / place))
        except StoreError as error:
            raise RegistryError(f"documents at {error}") from error
        self._files, self._root, self._is_folder = store.files, store.root, store.is_local

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
        if self._is_folder:
            if not exists(path):
                raise _missing(path)
            return read_whole(path, _LARGEST, "document", remedy="restore it", error=RegistryError)
        try:
            found: bytes = self._files.cat_file(path, start=0, end=_LARGEST + 1)
        except FileNotFoundError:
            raise _missing(path) from None
        except Exception as error:  # libraries of stores raise errors of their own
            raise _unreadable(self._path(digest), error) from error
        if len(found) > _LARGEST:
            raise RegistryError(f"{path}: is larger than {_LARGEST >> 20} MiB, and no document; restore it")
        return found

    def size(self, digest: str) -> int | None:
        """Return the size of a document, bytes; None where it is not there, or cannot be asked for."""
        try:
            return int(self._files.size(self._path(digest)))
        except Exception:  # libraries of stores raise errors of their own; what is written next states them
            return None

    def hashes(self) -> Iterator[str]:
        """Yield the hash of each document that lies there; raises `RegistryError`.

        Only the folders that hashes begin with are listed, whatever else lies at the place.
        """
        for number in range(256):
            folder = f"{self._root}/{number:02x}"
            try:
                names = [str(path).rpartition("/")[2] for path in self._files.ls(folder, detail=False)]
            except (FileNotFoundError, NotADirectoryError):
                continue
            except Exception as error:  # libraries of stores raise errors of their own
                raise _unreadable(folder, error) from error
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


def _missing(place: str) -> RegistryError:
    return RegistryError(f"{place}: document is missing; restore it from a backup")


def _unreadable(place: str, error: Exception) -> RegistryError:
    return RegistryError(f"{place}: cannot be read: {_words_of(error)}")


def _words_of(error: Exception) -> str:
    return getattr(error, "strerror", None) or " ".join(str(error).split()) or type(error).__name__
