"""Folder of one run: its order, the recording, the results, and the decision on them.

All that a bench has to know after it was killed stands in these files.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from tumble.foundation.bounded_json import parse_json
from tumble.foundation.documents import LARGEST_DOCUMENT, well_typed
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_names import SESSION_FILE, SESSION_FOLDER
from tumble.foundation.file_reading import read_whole
from tumble.foundation.file_status import entries, exists, is_file, is_folder, status_of
from tumble.foundation.files import (
    FileKind,
    prepare_inner_folder,
    refuse_linked_folder,
    remove_empty,
    remove_made,
    write_text,
)
from tumble.foundation.message import Message
from tumble.foundation.plain import finite
from tumble.foundation.provenance import date_now
from tumble.logs.options import ReadOptions
from tumble.tools.guided.order import RunOrder, TableOrder
from tumble.tools.guided.outcome import FurthestParameter, RunOutcome, UnitOutcome

ORDER, OUTCOME = "order.json", "outcome.json"
ACCEPTED = "accepted"
"""Decision of an operator on an outcome; empty for none."""
LONGEST_MESSAGE = 1024
"""Letters of a message, and of what stands in each of its places; twice the longest of ours."""
_MOST_KEPT, _LARGEST_KEPT = 1024, 1 << 14
"""Orders that are kept once they were read, and bytes of the largest; that of a run takes a tenth."""
KIND = FileKind("a file of tumble bench", re.compile(rb'\A\{\s*"software": "tumble bench"'))
MARK = {"software": "tumble bench"}
"""Beginning of the files of a bench, by which they are known as ours."""


@dataclass(frozen=True, slots=True)
class RunFolder:
    """One run on disk."""

    path: Path
    word: str
    """Word of its procedure."""
    order: RunOrder

    @property
    def has_recording(self) -> bool:
        """Returns whether anything was recorded."""
        return is_file(self.path / SESSION_FOLDER / SESSION_FILE)

    @property
    def is_finished(self) -> bool:
        """Returns whether its results are written."""
        return is_file(self.path / OUTCOME)

    @classmethod
    def begin(cls, folder: Path, word: str, order: RunOrder) -> RunFolder:
        """Makes the folder of a new run below `folder`; raises `OutputError` where that cannot be done."""
        path = _free(folder, f"{date_now()[:10]}_{word}")
        made = cls(prepare_inner_folder(path), word, replace(order, folder=path))
        made._keep_order()
        return made

    @classmethod
    def load(cls, path: Path) -> RunFolder | None:
        """Reads the folder of a run; None where it is none, or is damaged.

        An order that was read is read again only where its file has changed.
        """
        try:
            status = status_of(path / ORDER)
        except TumbleError:
            return None
        if status is None:
            return None
        if status.st_size > _LARGEST_KEPT:
            return _read(path)
        return _kept(path, (status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns))

    def refuse_links(self) -> None:
        """Raises `OutputError` where a link stands in place of its folder, or of that of its recording."""
        refuse_linked_folder(self.path)
        refuse_linked_folder(self.path / SESSION_FOLDER)

    def keep_outcome(self, outcome: RunOutcome, decision: str = "") -> None:
        """Stores the outcome, and the operator's decision once there is one; raises `OutputError`."""
        self.refuse_links()
        content = MARK | {"decision": decision, "outcome": _plain(outcome, self.path)}
        write_text(self.path / OUTCOME, json.dumps(finite(content), indent=1), KIND, renews=True)

    def outcome(self) -> tuple[RunOutcome, str] | None:
        """Returns the outcome and the decision on it; None where there is none, or it is damaged."""
        try:
            content: dict[str, Any] = parse_json(read_whole(self.path / OUTCOME, LARGEST_DOCUMENT))
            return well_typed(_outcome(self.path, content["outcome"])), str(content["decision"])
        except (TumbleError, ValueError, KeyError, TypeError, AttributeError):
            return None

    def remove_if_empty(self) -> None:
        """Removes the folder of a run of which nothing was recorded; raises `OutputError`."""
        self.refuse_links()
        if not self.has_recording:
            remove_made(self.path / ORDER, kind=KIND)
            remove_empty([self.path])

    def _keep_order(self) -> None:
        self.refuse_links()
        content = asdict(replace(self.order, resume=False, table=_disarmed(self.order.table)))
        del content["folder"]
        text = json.dumps(finite(MARK | {"word": self.word, "order": content}), indent=1)
        write_text(self.path / ORDER, text, KIND, renews=True)


def _read(path: Path) -> RunFolder | None:
    try:
        content: dict[str, Any] = parse_json(read_whole(path / ORDER, LARGEST_DOCUMENT))
        return RunFolder(path, str(content["word"]), well_typed(_order(path, content["order"])))
    except (TumbleError, ValueError, KeyError, TypeError, AttributeError):
        return None


@lru_cache(_MOST_KEPT)
def _kept(path: Path, _status: tuple[int, ...]) -> RunFolder | None:
    return _read(path)


def runs_in(folder: Path) -> list[RunFolder]:
    """Returns the runs below a folder, the latest first."""
    if not is_folder(folder):
        return []
    found = map(RunFolder.load, entries(folder))
    return sorted((run for run in found if run is not None), key=lambda run: _age(run.path), reverse=True)


def unfinished(folder: Path) -> RunFolder | None:
    """Returns the latest run below a folder that was recorded, if it has no results."""
    latest = next((run for run in runs_in(folder) if run.has_recording), None)
    return None if latest is None or latest.is_finished else latest


def _age(path: Path) -> tuple[float, str]:
    return (path / ORDER).stat().st_mtime, path.name


def _free(folder: Path, stem: str) -> Path:
    return next(path for n in range(1, 1 << 20) if not exists(path := folder / f"{stem}_{n}"))


def _disarmed(table: TableOrder | None) -> TableOrder | None:
    """Returns the table as it is stored: it never moves before it is armed again, by its documents then."""
    return None if table is None else replace(table, documents={}, armed=False)


def _order(path: Path, content: dict[str, Any]) -> RunOrder:
    table = content.pop("table")
    reading = {name: ReadOptions(**_tuples(each)) for name, each in content.pop("reading").items()}
    return RunOrder(
        folder=path, table=None if table is None else TableOrder(**table), reading=reading, **content
    )


def _tuples(content: Mapping[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in content.items()}


def _plain(outcome: RunOutcome, folder: Path) -> dict[str, Any]:
    def relative(path: Path | None) -> str | None:
        return (
            None if path is None else str(path.relative_to(folder)) if folder in path.parents else str(path)
        )

    content = asdict(outcome)
    content["files"] = {name: relative(path) for name, path in outcome.files.items()}
    for unit, plain in zip(outcome.units, content["units"], strict=True):
        plain["calibration"], plain["page"] = relative(unit.calibration), relative(unit.page)
    return content


def _outcome(folder: Path, content: dict[str, Any]) -> RunOutcome:
    units = tuple(_unit(folder, each) for each in content.pop("units"))
    files = {name: folder / path for name, path in content.pop("files").items()}
    return RunOutcome(**content | {"units": units, "files": files, "reasons": _messages(content["reasons"])})


def _unit(folder: Path, content: dict[str, Any]) -> UnitOutcome:
    def path(name: str) -> Path | None:
        return None if content[name] is None else folder / content[name]

    furthest = tuple(_parameter(each) for each in content["furthest"])
    changed = {"calibration": path("calibration"), "page": path("page"), "furthest": furthest}
    return UnitOutcome(**content | changed | {"reasons": _messages(content["reasons"])})


def _parameter(content: dict[str, Any]) -> FurthestParameter:
    shown = {name: math.nan if content[name] is None else content[name] for name in ("value", "sigma")}
    return FurthestParameter(**content | shown)


def _messages(content: list[dict[str, Any]]) -> tuple[Message, ...]:
    def one(each: dict[str, Any]) -> Message:
        values = {
            key: one(value) if isinstance(value, dict) else value for key, value in each["values"].items()
        }
        # From the innermost outwards, so that no text grows beyond its bound before it is held against it.
        if max(map(len, (each["text"], *map(str, values.values())))) > LONGEST_MESSAGE:
            raise ValueError(f"a message of more than {LONGEST_MESSAGE} letters")
        return Message(each["text"], values)

    return tuple(map(one, content))


def files_of(outcome: RunOutcome) -> Iterator[Path]:
    """Returns the calibration files of an outcome."""
    yield from (unit.calibration for unit in outcome.units if unit.calibration is not None)
