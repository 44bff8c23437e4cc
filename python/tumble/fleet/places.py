"""Files by path or URL: listed, read and written where they are, without a password in any message."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tumble.foundation.errors import TumbleError, shown
from tumble.foundation.file_reading import read_whole
from tumble.foundation.file_status import paths_like
from tumble.foundation.files import FileKind, refuse_links_to, remove_made, write_shared
from tumble.foundation.stores import Store, StoreError, store_error
from tumble.foundation.words import quoted

_LARGEST = 16 << 20
"""Bytes of a file that is read whole."""


class FileStore(Store):
    """A folder, or a place in a store of objects, by URL: its files are listed, read, written and removed."""

    def __str__(self) -> str:
        return shown(self.url)

    def within(self, name: str) -> str:
        """Returns the path of a file within it; raises `StoreError` for one that would lie elsewhere."""
        if any(part in ("", ".", "..") for part in name.split("/")):
            raise StoreError(f"{self}: {quoted(name)} does not lie within; give another name")
        return f"{self.root.rstrip('/')}/{name}"

    def read(self, name: str) -> bytes | None:
        """Returns the content of a small file, such as the status of a job; None where there is none."""
        path = self.within(name)
        if self.is_local:
            try:
                return read_whole(path, _LARGEST, "part of a job", error=StoreError)
            except StoreError as error:
                # Another process may write or remove the file at any moment: the error itself decides.
                if isinstance(error.__cause__, FileNotFoundError | NotADirectoryError):
                    return None
                raise
        try:
            content: bytes = self.files.cat_file(path, start=0, end=_LARGEST + 1)
        except FileNotFoundError:
            return None
        except Exception as error:
            raise store_error(self.url, error) from error
        if len(content) > _LARGEST:
            raise StoreError(f"{self}: {name} is larger than {_LARGEST >> 20} MiB, and no part of a job")
        return content

    def write(self, name: str, content: bytes, kind: FileKind) -> None:
        """Writes a file whole or not at all; raises `StoreError`, or `OutputError` for another's file."""
        path = self.within(name)
        try:
            if not self.is_local:
                self.files.makedirs(path.rpartition("/")[0], exist_ok=True)
                self.files.pipe_file(path, content)
                return
            write_shared(Path(path), content, kind, Path(self.root))
        except OSError as error:
            if not self.is_local:
                raise store_error(self.url, error) from error
            reason = error.strerror or error
            raise StoreError(f"{path}: cannot be written: {reason}; give another folder") from error
        except TumbleError:
            raise
        except Exception as error:
            raise store_error(self.url, error) from error

    def remove(self, name: str, kind: FileKind) -> None:
        """Removes a file, if it is there; raises `StoreError`, or `OutputError` for another's file."""
        if self.is_local:
            path = Path(self.within(name))
            refuse_links_to(path, Path(self.root))
            return remove_made(path, kind=kind)
        try:
            self.files.rm_file(self.within(name))
        except FileNotFoundError:
            return None
        except Exception as error:
            raise store_error(self.url, error) from error

    def names(self, folder: str, ending: str) -> list[str]:
        """Returns the paths of the files below a folder, sorted."""
        self.files.invalidate_cache()
        try:
            found = self.files.find(self.within(folder))
        except FileNotFoundError:
            return []
        except Exception as error:
            raise store_error(self.url, error) from error
        return sorted(str(path) for path in found if str(path).endswith(ending))


def matching(pattern: str) -> Iterator[tuple[str, str]]:
    """Yields each path or URL that a pattern fits, sorted, with the version of its content.

    Raises `StoreError` where the store cannot be reached.
    """
    place = FileStore(pattern)
    try:
        if place.is_local:
            # Sorted names alone: the facts about 100,000 files would take ten times their room.
            # A folder in which one works may have a name that is a pattern; only what was typed is one.
            for path in paths_like(place.root if "://" in pattern else pattern):
                path = str(Path(path).absolute())
                yield path, version_of(place.files.info(path))
            return
        found: dict[str, dict[str, Any]] = place.files.glob(place.root, detail=True)
    except Exception as error:
        raise store_error(pattern, error) from error
    for path in sorted(found):
        yield place.files.unstrip_protocol(path), version_of(found[path])


def version_at(url: str) -> str | None:
    """Returns the version of the content of one file or folder; None where there is none."""
    place = FileStore(url)
    try:
        return version_of(place.files.info(place.root))
    except FileNotFoundError:
        return None
    except Exception as error:
        raise store_error(url, error) from error


def version_of(info: dict[str, Any]) -> str:
    """Returns what changes with the content of a file: its ETag, else its size and time of change."""
    stamp = info.get("ETag") or info.get("etag") or info.get("mtime") or info.get("LastModified") or ""
    return f"{info.get('size', '')}:{stamp}"


def fetched(url: str, folder: Path) -> Path:
    """Returns a local path of a file or folder: its own, or that of a copy in `folder`.

    Raises `StoreError` as `Store.copy` does, and what the store's library raises, after which another try may
    succeed.
    """
    place = FileStore(url)
    return Path(place.root) if place.is_local else place.copy(folder)
