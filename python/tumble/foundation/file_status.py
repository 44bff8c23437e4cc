"""The one place that asks what stands at a path: an answer, or an error in one line that names the path.

`Path.exists` and its like raise `OSError` or `ValueError` for a folder that nobody may look into, links that
lead around and names that no file system has.
"""

from __future__ import annotations

import errno
import os
import stat
from glob import has_magic
from os import PathLike, fspath
from pathlib import Path

from tumble.foundation.errors import PlaceError, TumbleError
from tumble.foundation.words import short

_SHOWN = 60
"""Characters shown of a path that is too long."""


def path_of(given: object, what: str, error: type[TumbleError] = PlaceError) -> Path:
    """Returns the path that a caller gives; raises `error`, in one line, where it is none."""
    if not isinstance(given, str | PathLike):
        kind = type(given).__name__
        raise error(f"{short(given)}: is no path but {kind}; give the path of {what}")
    text = fspath(given)
    if not isinstance(text, str) or "\0" in text:
        raise error(f"{short(text)}: is no path; give the path of {what}")
    return Path(text)


def exists(path: Path | str) -> bool:
    """Returns whether anything stands there; raises `PlaceError` where that cannot be seen."""
    return status_of(path) is not None


def stands_there(path: Path | str) -> bool:
    """Returns whether the name is taken, be it by a link that leads nowhere; raises `PlaceError`."""
    return status_of(path, follow=False) is not None


def is_file(path: Path | str) -> bool:
    """Returns whether a regular file, or a link to one, stands there; raises `PlaceError`."""
    status = status_of(path)
    return status is not None and stat.S_ISREG(status.st_mode)


def is_folder(path: Path | str) -> bool:
    """Returns whether a folder, or a link to one, stands there; raises `PlaceError`."""
    status = status_of(path)
    return status is not None and stat.S_ISDIR(status.st_mode)


def is_special(path: Path | str) -> bool:
    """Returns whether it is a device, a pipe or a socket, from which reading may never end."""
    status = status_of(path)
    return status is not None and not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode))


def is_link(path: Path | str) -> bool:
    """Returns whether a symbolic link stands there; raises `PlaceError`."""
    status = status_of(path, follow=False)
    return status is not None and stat.S_ISLNK(status.st_mode)


def entries(folder: Path | str) -> list[Path]:
    """Returns all that stands in a folder, sorted; raises `PlaceError` where it cannot be listed."""
    try:
        return sorted(Path(folder).iterdir())
    except (OSError, ValueError) as error:
        raise PlaceError(unusable(folder, error)) from error


def paths_like(pattern: str) -> list[str]:
    """Returns the paths that a pattern of a shell fits, `**` for folders in folders; raises `PlaceError`.

    Below `**` no link to a folder is followed, as two that lead around have more paths than can be counted.
    Names that begin with a point fit a pattern that has one there alone, as in a shell.
    """
    parts = Path(pattern).parts
    first = next((number for number, part in enumerate(parts) if has_magic(part)), len(parts))
    root, wild = (
        Path(*parts[:first]),
        [part if part == "**" else part.replace("**", "*") for part in parts[first:]],
    )
    if not wild:
        return [pattern] if exists(pattern) else []
    root, with_hidden = Path(*parts[:first]), any(part.startswith(".") for part in wild)
    try:
        found = root.glob("/".join([*wild, "*"] if wild[-1] == "**" else wild))
        return sorted(
            str(path)
            for path in found
            if with_hidden or not any(part.startswith(".") for part in path.relative_to(root).parts)
        )
    except (OSError, ValueError) as error:
        raise PlaceError(unusable(pattern, error)) from error


def status_of(path: Path | str, *, follow: bool = True) -> os.stat_result | None:
    """Returns the status of what stands there; None for nothing, raises `PlaceError` where it is hidden."""
    try:
        return Path(path).stat(follow_symlinks=follow)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError) as error:
        raise PlaceError(unusable(path, error)) from error


def expanded(path: Path | str) -> Path:
    """Returns a path with the home folder in place of `~`; raises `PlaceError` for a user that has none."""
    try:
        return Path(path).expanduser()
    except RuntimeError as error:
        user = Path(path).parts[0]
        raise PlaceError(f"{path}: {user} is no user with a home folder; write a path") from error


def working_folder() -> Path:
    """Returns the working folder; raises `PlaceError` where it was removed: no relative path is any then."""
    try:
        return Path.cwd()
    except OSError as error:
        raise PlaceError(
            f"the working folder cannot be used: {error.strerror}; change to another one, such as cd ~"
        ) from error


def home_folder() -> Path:
    """Returns the home folder of this user; the root, as in containers, of one that has none."""
    try:
        return Path.home()
    except RuntimeError:
        return Path(os.sep)


def unusable(path: Path | str, error: OSError | ValueError) -> str:
    """Describes in one line why nothing can be done at a path."""
    text = str(path)
    if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
        return f"{text[:_SHOWN]}...: no file has so long a name; check the path"
    if not isinstance(error, OSError):  # of the interpreter: a null, or letters that no encoding has
        return f"{text[:_SHOWN]}: is no path: {error}; check it"
    reason = error.strerror or error
    return f"{text}: cannot be opened: {reason}; check the path and the permissions of its folders"
