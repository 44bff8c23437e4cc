"""Which recordings are meant: logs, folders of them, patterns of the shell, lists; and what each is named."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from io import TextIOWrapper
from pathlib import Path
from typing import TypeAlias

from tumble.foundation.errors import LogError, ProcedureError, TumbleError
from tumble.foundation.file_names import SUMMARY
from tumble.foundation.file_status import entries, exists, is_file, is_folder, is_special, paths_like
from tumble.foundation.files import note_input
from tumble.foundation.log_formats import LOG_SUFFIXES, has_log_ending, stem_of
from tumble.foundation.numbers import whole_number
from tumble.foundation.regular_files import open_regular
from tumble.logs import open_recording, parse_spec
from tumble.logs.formats import FOLDER, find_format
from tumble.logs.options import ReadOptions

ReadOptionsOf: TypeAlias = Callable[[str], ReadOptions | None]
"""Options of reading a log."""

NAME_BY = ("file", "folder", "serial")
"""Sources of target names, besides a pattern."""
_WILD = re.compile(r"[*?\[]")
_DIGITS = re.compile(r"(\d+)")
_MANIFEST_HEAD = 65_536
_OWN_COLUMNS = ("file", "name", "serial", "operator", "station")


@dataclass(frozen=True, slots=True)
class TargetLog:
    """A recording of one target, and what is known of it besides."""

    source: str
    """LOG or LOG:NAME."""
    name: str = ""
    serial: str = ""
    operator: str = ""
    station: str = ""
    columns: dict[str, str] = field(default_factory=dict)
    """Further columns of its list, by name."""
    place: str = ""
    """Line of the list it stands in, for messages; empty for what was typed."""


@dataclass(frozen=True, slots=True)
class TargetsFound:
    """Targets in the order in which they are calibrated, none named twice."""

    targets: tuple[TargetLog, ...]
    remarks: tuple[str, ...] = ()
    """Remarks on what was left out."""


def find_targets(
    typed: Sequence[str],
    reference: str,
    *,
    name_by: str = "file",
    poses: Iterable[str] = (),
    output: Path | None = None,
    read: ReadOptionsOf = lambda _: None,
) -> TargetsFound:
    """Finds the recordings that arguments stand for, and names them.

    A folder is one target where the reference is one too, or its logs are named for `poses`; else every log
    in it is one, those in `output` left out. The reference itself is left out. Folders and patterns are taken
    in the order in which people count: target_9 before target_10. `name_by` is one of `NAME_BY` or a regular
    expression, of whose match the first group counts; `read` holds the options of reading a log that has to
    be asked for its serial.

    Raises `TumbleError` where nothing is found, and where a name or a serial is given twice.
    """
    unit = parse_spec(reference).path
    unit_folders = is_folder(unit) and find_format(unit) == FOLDER
    files = {pose.casefold() for pose in poses}
    found: list[TargetLog] = []
    for text in _counted(typed):
        found += _expanded(text, lambda folder: unit_folders or _has_poses(folder, files), output)
    remarks: list[str] = []
    others: dict[tuple[Path, str | None], TargetLog] = {}
    for target in found:
        if _place(target.source) == _place(reference):
            remarks.append(f"{target.source} is the reference, and left out of the targets")
        elif _place(target.source) in others:
            remarks.append(f"{target.source} is named twice, and calibrated once")
        else:
            others[_place(target.source)] = target
    if not others:
        raise ProcedureError(
            f"there is no target besides the reference {reference}; name at least one other recording"
        )
    _refuse_doubled_serials(list(others.values()))
    named = _named(list(others.values()), name_by, read)
    return TargetsFound(tuple(named), tuple(remarks))


def natural(text: str) -> list[tuple[bool, int, str]]:
    """Sorts as people count: target_9 before target_10."""
    parts = _DIGITS.split(text.casefold())
    numbers = map(whole_number, parts)
    return [(number is not None, number or 0, part) for number, part in zip(numbers, parts, strict=True)]


def _counted(typed: Sequence[str]) -> list[str]:
    """Sorts names that a shell sorted by letters by their numbers; others keep their order."""
    return sorted(typed, key=natural) if list(typed) == sorted(typed) else list(typed)


def _expanded(text: str, is_one: Callable[[Path], bool], output: Path | None) -> Iterator[TargetLog]:
    path = Path(text)
    if is_folder(path) and find_format(path) == FOLDER and not is_one(path):
        yield from map(TargetLog, _logs_below(path, output))
    elif is_file(path) and path.suffix.lower() == ".csv" and (columns := _manifest_columns(path)):
        yield from _listed(path, columns)
    elif not exists(path) and _WILD.search(text):
        yield from map(TargetLog, _matching(text))
    else:
        parse_spec(text)
        yield TargetLog(text)


def _has_poses(folder: Path, poses: set[str]) -> bool:
    logs = [stem_of(path).casefold() for path in entries(folder) if has_log_ending(path)]
    return bool(logs) and poses.issuperset(logs)


def _logs_below(folder: Path, output: Path | None) -> list[str]:
    found = [str(path) for path in _logs_in(folder, {output.resolve()} if output else set())]
    if not found:
        known = " ".join(sorted(LOG_SUFFIXES))
        raise LogError(
            f"{folder}: a folder without logs; expected one file per pose or target, named {known}"
        )
    return sorted(found, key=natural)


def _logs_in(folder: Path, known: set[Path]) -> Iterator[Path]:
    """Yields logs below a folder, but not in those that are known, each of which is looked into once."""
    known.add(folder.resolve())
    for path in entries(folder):
        if path.name.startswith(".") or path.resolve() in known:
            continue
        if is_folder(path):
            yield from [path] if find_format(path) != FOLDER else _logs_in(path, known)
        elif has_log_ending(path) and path.name != SUMMARY and not _manifest_columns(path):
            yield path


def _matching(pattern: str) -> list[str]:
    found = sorted(paths_like(pattern), key=natural)
    if found:
        return found
    before, colon, imu = pattern.rpartition(":")
    found = sorted(paths_like(before), key=natural) if colon else []
    if not found:
        raise LogError(f"{pattern}: no file matches; check the path")
    return [f"{path}:{imu}" for path in found]


def _manifest_columns(path: Path) -> list[str]:
    """Columns of a list of logs; none where the file is a log itself, which has no column `file`."""
    if is_special(path):
        return []
    with open_regular(path) as file:
        line = file.read(_MANIFEST_HEAD).partition(b"\n")[0]
    try:
        names = next(csv.reader([line.decode("utf-8-sig").rstrip("\r")], delimiter=_delimiter(line)), [])
    except (UnicodeDecodeError, csv.Error):
        return []
    columns = [name.strip() for name in names]
    return columns if "file" in [name.casefold() for name in columns] else []


def _delimiter(line: bytes) -> str:
    return max(",;\t", key=lambda mark: line.count(mark.encode()))


def _listed(path: Path, columns: Sequence[str]) -> Iterator[TargetLog]:
    note_input(path)
    names = [name.casefold() if name.casefold() in _OWN_COLUMNS else name for name in columns]
    try:
        with TextIOWrapper(open_regular(path), encoding="utf-8-sig", newline="") as file:
            rows = csv.reader(file, delimiter=_mark(path))
            next(rows)
            for row in rows:
                if any(cell.strip() for cell in row):
                    cells = dict(zip(names, map(str.strip, row), strict=False))
                    yield _listed_target(path, rows.line_num, cells)
    except (UnicodeDecodeError, csv.Error) as error:
        raise LogError(
            f"{path}: cannot be read as a list of logs: {error}; save it as CSV in UTF-8"
        ) from error


def _mark(path: Path) -> str:
    with open_regular(path) as file:
        return _delimiter(file.readline(_MANIFEST_HEAD))


def _listed_target(path: Path, line: int, cells: dict[str, str]) -> TargetLog:
    place = f"{path}: line {line}"
    if not cells.get("file"):
        raise LogError(f"{place}: names no file; fill in the column 'file', or remove the line")
    source = str(path.parent / cells["file"])
    try:
        parse_spec(source)
    except LogError as error:
        raise LogError(f"{place}: {error}") from error
    return TargetLog(
        source,
        **{name: cells.get(name, "") for name in _OWN_COLUMNS if name != "file"},
        columns={name: cell for name, cell in cells.items() if name not in _OWN_COLUMNS and name},
        place=place,
    )


def _place(source: str) -> tuple[Path, str | None]:
    """Returns the recording that is meant, however it is spelt."""
    spec = parse_spec(source)
    return spec.path.resolve(), spec.imu


def _refuse_doubled_serials(targets: Sequence[TargetLog]) -> None:
    first: dict[str, TargetLog] = {}
    for target in targets:
        if target.serial and target.serial in first:
            raise ProcedureError(
                f"{target.place or target.source}: serial {target.serial} is also that of "
                f"{first[target.serial].place or first[target.serial].source}; correct one of them"
            )
        first.setdefault(target.serial, target)


def _named(targets: Sequence[TargetLog], name_by: str, read: ReadOptionsOf) -> list[TargetLog]:
    if name_by == "file":
        return _numbered([replace(target, name=target.name or _file_name(target)) for target in targets])
    name_of = _naming(name_by, read)
    named = [replace(target, name=target.name or name_of(target)) for target in targets]
    first: dict[str, TargetLog] = {}
    for target in named:
        if target.name in first:
            what = "have serial" if name_by == "serial" else "would both be named"
            raise ProcedureError(
                f"{first[target.name].source} and {target.source} {what} {target.name}; "
                "correct that, or name targets by something else with --name-by"
            )
        first[target.name] = target
    return named


def _numbered(targets: Sequence[TargetLog]) -> list[TargetLog]:
    """Distinguishes targets of one name by a number."""
    counts = Counter(target.name for target in targets)
    seen: Counter[str] = Counter()
    numbered = []
    for target in targets:
        seen[target.name] += 1
        alone = counts[target.name] == 1
        numbered.append(target if alone else replace(target, name=f"{target.name}-{seen[target.name]}"))
    return numbered


def _file_name(target: TargetLog) -> str:
    spec = parse_spec(target.source)
    stem = stem_of(spec.path) if is_file(spec.path) else spec.path.name
    imu = (spec.imu or "").strip("/").replace("/", "_")
    if imu and find_format(spec.path) == "session":
        return imu
    return f"{stem}-{imu}" if imu else stem


def _naming(name_by: str, read: ReadOptionsOf) -> Callable[[TargetLog], str]:
    if name_by == "folder":
        return lambda target: parse_spec(target.source).path.resolve().parent.name
    if name_by == "serial":
        return lambda target: target.serial or _serial(target.source, read)
    try:
        pattern = re.compile(name_by)
    except re.error as error:
        raise ProcedureError(
            f"--name-by {name_by}: is neither {', '.join(NAME_BY)} nor a regular expression: {error}"
        ) from None
    return lambda target: _matched(pattern, target.source)


def _serial(source: str, read: ReadOptionsOf) -> str:
    try:
        serial = open_recording(source, read(source)).metadata.serial
    except TumbleError as error:
        raise ProcedureError(f"--name-by serial: {error}") from error
    if not serial:
        raise ProcedureError(
            f"--name-by serial: {source} states no serial number; list it in a file with columns file,serial"
        )
    return serial


def _matched(pattern: re.Pattern[str], source: str) -> str:
    found = pattern.search(source)
    name = next((group for group in found.groups() if group), found.group()) if found else ""
    if not name:
        raise ProcedureError(f"--name-by {pattern.pattern}: does not match {source}")
    return name
