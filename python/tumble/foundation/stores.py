"""The one place that opens stores: a folder of this computer, or a place in a store of objects, by URL.

Registries and manifests that others write name such places. Some protocols of fsspec read any file, unpack
without end, or wait for a server that sends without end, and one can be chained to another. So only stores
are known whose servers the settings and credentials of the user choose, and none is chained.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any, Final

from tumble.foundation.bounded_answer import ANSWERING, LARGEST_ANSWER, awaited_within
from tumble.foundation.errors import TumbleError, shown
from tumble.foundation.file_reading import opened
from tumble.foundation.files import make_folder
from tumble.foundation.temporary_folders import refuse_large_copy
from tumble.foundation.words import count_of, quoted

_FOLDERS: Final = frozenset(("file", "local"))
STORES: Final = frozenset(("s3", "s3a", "gs", "gcs", "abfs", "abfss", "az"))
"""Protocols of stores of objects."""
_COPYING: Final = frozenset(("get_file",))
"""Operations whose answer goes to the disk."""
_MOST_FILES: Final = 10_000
"""Files of a folder that is copied: a session has one for each unit."""


class StoreError(TumbleError):
    """A folder or URL cannot be read or written."""


class _BoundedFiles:
    """Files of a store of objects, whose server has so long and so much memory for each answer.

    Copies of files are bounded by the sizes that were listed.
    """

    def __init__(self, files: Any) -> None:  # noqa: ANN401 - the store's library has no types
        self._files = files

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        from inspect import iscoroutinefunction

        work = getattr(self._files, f"_{name}", None)
        if not iscoroutinefunction(work) or name in _COPYING:
            return getattr(self._files, name)

        def bounded(*given: object, **named: object) -> object:
            from fsspec.asyn import sync
            from fsspec.exceptions import FSTimeoutError

            asked = partial(work, *given, **named)
            try:
                return sync(self._files.loop, awaited_within, asked, ANSWERING, LARGEST_ANSWER)
            except FSTimeoutError as error:
                # The library drops the words of an error of time.
                raise TimeoutError(str(error.__cause__)) from error

        return bounded


class Store:
    """A folder, or a place in a store of objects, by URL.

    Raises `StoreError` for any other protocol, for one that is chained to another, and where the library of
    the store is missing or refuses.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        protocol, is_url, _ = url.partition("://")
        self.is_local = not is_url or protocol in _FOLDERS
        """Indicates whether it is a folder of this computer, given as a path or by `file://`."""
        if is_url and ("::" in url or not (self.is_local or protocol in STORES)):
            raise StoreError(
                f"{shown(url)}: {quoted(protocol)} is no protocol of a store, or is chained to another one; "
                "give a folder or an s3:// URL"
            )
        self.files, self.root = _opened(url) if is_url else _folder(url)

    def opened(self, what: str) -> AbstractContextManager[Any]:
        """Opens the file at the place, which should be `what`, to be read piece by piece.

        Raises `StoreError` for a device or a pipe, and what the store's library raises.
        """
        if self.is_local:
            return opened(self.root, what, error=StoreError)
        stream: AbstractContextManager[Any] = self.files.open(self.root, "rb")
        return stream

    def opened_within(self, path: str) -> AbstractContextManager[Any]:
        """Opens a file that was listed, by its path, as `opened` does."""
        if self.is_local:
            return opened(path, "part of results", remedy="remove it", error=StoreError)
        stream: AbstractContextManager[Any] = self.files.open(path, "rb")
        return stream

    def copy(self, folder: Path) -> Path:
        """Copies the file, or the folder with all in it, into a folder of ours; returns its path.

        Raises `StoreError` for names that lead elsewhere, more files than a session has, and more bytes than
        half of what is free there; else what the store's library raises.
        """
        target = folder / self._plain_name(self.root.rstrip("/").rpartition("/")[2])
        sizes = dict(self._sizes())
        refuse_large_copy(shown(self.url), sum(sizes.values()), folder, StoreError)
        for path, size in sizes.items():
            within = path.removeprefix(self.root).strip("/")
            place = target.joinpath(*map(self._plain_name, within.split("/") if within else ()))
            make_folder(place.parent)
            self._copy_file(path, size, place)
        return target

    def _copy_file(self, path: str, size: int, place: Path) -> None:
        """Copies a file listed with a size, bytes; raises `StoreError` where the store gives another."""
        from fsspec import Callback

        def bound(_size: int | None, copied: int, **_named: object) -> None:
            if copied > size:
                raise self._other_size(path, size)

        self.files.get_file(path, str(place), callback=Callback(hooks={"bound": bound}))
        if place.stat().st_size != size:
            raise self._other_size(path, size)

    def _other_size(self, path: str, size: int) -> StoreError:
        return StoreError(
            f"{shown(self.url)}: {quoted(path)} was listed with {count_of('byte', size)}, and is not "
            "as long: it changes, or the store is at fault; copy it yourself and check it"
        )

    def _sizes(self) -> Iterator[tuple[str, int]]:
        """Yields each file at the place with its size, bytes."""
        if not self.files.isdir(self.root):
            yield self.root, int(self.files.size(self.root))
            return
        count = 0
        for _, _, found in self.files.walk(self.root, detail=True):
            count += len(found)
            if count > _MOST_FILES:
                raise StoreError(
                    f"{shown(self.url)}: has more than {_MOST_FILES} files; give the folder of one session"
                )
            yield from ((str(each["name"]), int(each["size"])) for each in found.values())

    def _plain_name(self, name: str) -> str:
        """Returns a name that is one part of a path; raises `StoreError` for any other."""
        if name in ("", ".", "..") or set(name) & set("/\\\0"):
            raise StoreError(f"{shown(self.url)}: {quoted(name)} is no name of a file; give another place")
        return name


def _folder(path: str) -> tuple[Any, str]:
    import fsspec

    # A path is never taken apart: `::` and `://` may be in names of folders.
    return fsspec.filesystem("file"), Path(path).absolute().as_posix()


def _opened(url: str) -> tuple[Any, str]:
    import fsspec

    try:
        files, root = fsspec.core.url_to_fs(url)
    except (ImportError, ValueError) as error:
        raise StoreError(f"{shown(url)}: {shown(str(error))}; give a folder or an s3:// URL") from error
    except Exception as error:  # libraries of stores raise errors of their own
        raise store_error(url, error) from error
    return files if url.partition("://")[0] in _FOLDERS else _BoundedFiles(files), str(root)


def store_error(url: str, error: Exception) -> StoreError:
    """Describes in one line why a store failed."""
    reason = shown(" ".join(str(error).split())) or type(error).__name__
    return StoreError(
        f"{shown(url)}: cannot be reached: {reason}; check the address, network and credentials"
    )
