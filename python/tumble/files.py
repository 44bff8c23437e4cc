"""Writing results so that a failed run leaves what was there untouched."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tumble.errors import OutputError


@contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Give a temporary name beside `path`; it takes the place of `path` once the block ends without an error.

    Raises `OutputError` where the folder is missing or cannot be written to. After any error the temporary
    file is gone and `path` is as it was.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        _check_place(path)
        try:
            yield temporary
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(_cannot_write(path, error)) from error


def write_text(path: Path | str, text: str) -> None:
    """Write UTF-8 text with `replacing`."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def prepare_folder(folder: Path | str) -> Path:
    """Make `folder` where it is missing and prove, before any long work, that files can be written in it."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".{secrets.token_hex(8)}.tmp"
        probe.touch(exist_ok=False)
        probe.unlink()
    except OSError as error:
        raise OutputError(
            f"{folder}: cannot write in this output folder: {error.strerror}; choose another one"
        ) from error
    return folder


def _check_place(path: Path) -> None:
    if path.is_dir():
        raise OutputError(f"{path}: is a folder, not a file to write to; give a file name")
    if path.parent.is_file():
        raise OutputError(f"{path}: {path.parent} is a file, not a folder to write in; give another folder")
    if not path.parent.is_dir():
        raise OutputError(f"{path}: folder {path.parent} does not exist; create it first")


def _cannot_write(path: Path, error: OSError) -> str:
    return f"{path}: cannot be written: {error.strerror or error}; what was there before is untouched"
