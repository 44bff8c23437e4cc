"""Results that Tumble wrote, as far as a chart of their recording shows them: calibration files and JSON."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from tumble.calibration.document import Calibration
from tumble.foundation.bounded_json import JsonError, parse_json
from tumble.foundation.documents import LARGEST_DOCUMENT, mistake_in
from tumble.foundation.errors import CalibrationFileError, TumbleError
from tumble.foundation.file_reading import read_text_whole
from tumble.foundation.file_status import entries, is_file, is_folder, working_folder
from tumble.foundation.recording import FloatArray
from tumble.foundation.regular_files import open_regular
from tumble.foundation.schemas import CALIBRATION, schema_in
from tumble.foundation.units import TRIADS, Triad
from tumble.logs import LogSpec, parse_spec

_ENDINGS: Final = (".yaml", ".yml", ".json")
_HEAD: Final = 4096
_LARGEST_JSON: Final = 64 * LARGEST_DOCUMENT
_RESULT: Final = re.compile(r"tumble-[\w-]+-result/\d+")
_REST: Final = re.compile(r"rest (\d+)")


@dataclass(frozen=True, slots=True)
class Residuals:
    """Residuals of one triad, each measured minus modelled."""

    triad: Triad
    unit: str
    labels: tuple[str, ...]
    """(k,) `rest 3: Y up`, `turn 3-4`."""
    value: FloatArray
    """(k, 3) in `unit`."""
    sigma: FloatArray
    """(k, 3) 1-sigma of what was measured."""


@dataclass(frozen=True, slots=True)
class RestUsed:
    """A rest as a result has it."""

    start: float
    end: float
    """s of the clock of the log."""
    used: bool
    remark: str


@dataclass(frozen=True, slots=True)
class ResultFile:
    """A result of one unit."""

    path: Path
    name: str
    log: str
    """Log that it was found from, without folders: LOG or LOG:NAME; empty where it names none."""
    sha256: str
    """Digest of the log; empty where it is not known."""
    verdict: str
    calibration: Calibration | None
    rests: tuple[RestUsed, ...] = ()
    """Rests with their times; none where the file has only their numbers."""

    @property
    def residuals(self) -> tuple[Residuals, ...]:
        """Residuals of both triads; none of a triad that was not calibrated."""
        found = []
        for triad in TRIADS:
            of = getattr(self.calibration, triad, None)
            if of is None or not of.residuals:
                continue
            labels = tuple(each.label for each in of.residuals)
            value = np.array([each.value for each in of.residuals])
            sigma = np.array([each.sigma for each in of.residuals])
            found.append(Residuals(triad, of.unit, labels, value, sigma))
        return tuple(found)

    @property
    def numbers(self) -> frozenset[int]:
        """Numbers, from 1, of the rests that have residuals."""
        labels = (label for each in self.residuals for label in each.labels)
        return frozenset(int(found[1]) for label in labels if (found := _REST.match(label)))

    def find_log(self) -> LogSpec:
        """Looks for its log beside it, one and two folders up, and in the current folder.

        Raises `CalibrationFileError` where it is in none of them, or the file names none.
        """
        if not self.log:
            raise CalibrationFileError(f"{self.path}: names no log that it was found from; give that log")
        folder = self.path.resolve().parent
        for place in dict.fromkeys((folder, folder.parent, folder.parent.parent, working_folder())):
            try:
                return parse_spec(place / self.log)
            except TumbleError:
                continue
        raise CalibrationFileError(
            f"{self.path}: its log {self.log} is not beside it, nor one or two folders up, nor in the "
            "current folder; give it with --log"
        )


def is_result(path: Path) -> bool:
    """Returns whether a file is a calibration file or the JSON of a result, by its head."""
    if path.suffix.lower() not in _ENDINGS or not is_file(path):
        return False
    with open_regular(path) as file:
        head = file.read(_HEAD)
    if schema_in(head) is CALIBRATION:
        return True
    stated = re.search(rb'"schema"\s*:\s*"(tumble-[\w-]+/\d+)"', head)
    return stated is not None and _RESULT.fullmatch(stated[1].decode()) is not None


def results_in(path: Path) -> tuple[ResultFile, ...]:
    """Reads a calibration file, the JSON of a result, or all calibration files of a folder.

    Raises `CalibrationFileError` where one of them is wrong, or there is none.
    """
    if is_folder(path):
        files = [each for each in entries(path) if each.suffix == ".yaml" and is_result(each)]
        return tuple(_of_calibration(each, Calibration.load(each)) for each in files)
    if path.suffix.lower() != ".json":
        return (_of_calibration(path, Calibration.load(path)),)
    found = tuple(_of_json(path, _content(path)))
    if not found:
        raise CalibrationFileError(f"{path}: names no log of one unit; give that log, or a calibration file")
    return found


def _of_calibration(path: Path, calibration: Calibration, **more: Any) -> ResultFile:  # noqa: ANN401
    logs = [calibration.log, *(log for each in calibration.contributions or () for log in each.logs)]
    log = next((each for each in logs if each is not None), None)
    facts: dict[str, Any] = {
        "name": calibration.name,
        "log": log.file if log else "",
        "sha256": log.sha256 if log else "",
        "verdict": calibration.verdict,
    }
    return ResultFile(path, calibration=calibration, **(facts | more))


def _content(path: Path) -> Any:  # noqa: ANN401 - whatever JSON holds
    text = read_text_whole(path, _LARGEST_JSON, "result", error=CalibrationFileError)
    try:
        return parse_json(text)
    except JsonError as error:
        raise CalibrationFileError(f"{path}: cannot be read as JSON ({error}); give another file") from error


def _of_json(path: Path, content: object) -> Iterator[ResultFile]:
    """Finds the units of a printed result: mappings that name a log as their source."""
    if isinstance(content, list):
        for each in content:
            yield from _of_json(path, each)
    if not isinstance(content, Mapping):
        return
    sources = content.get("sources")
    source = content.get("source") or (sources[0] if isinstance(sources, list) and sources else None)
    if isinstance(source, str) and isinstance(content.get("name"), str):
        yield _unit_of(path, content, source)
        return
    for each in content.values():
        yield from _of_json(path, each)


def _unit_of(path: Path, content: Mapping[str, Any], source: str) -> ResultFile:
    rests = tuple(_rests(content))
    facts = {"name": content["name"], "log": source, "verdict": str(content.get("verdict", ""))}
    sha256 = content.get("sha256")
    stated = {"sha256": sha256} if isinstance(sha256, str) else {}
    if not isinstance(content.get("calibration"), Mapping):
        return ResultFile(path, **({"sha256": ""} | facts | stated), calibration=None, rests=rests)
    try:
        calibration = Calibration.model_validate(content["calibration"])
    except ValidationError as error:
        raise CalibrationFileError(f"{path}: calibration: {mistake_in(error, Calibration)}") from error
    return _of_calibration(path, calibration, **facts, **stated, rests=rests)


def _rests(content: object) -> Iterator[RestUsed]:
    """Finds what stands under `rests` in a printed result."""
    if isinstance(content, list):
        for each in content:
            yield from _rests(each)
    if not isinstance(content, Mapping):
        return
    for key, value in content.items():
        if key != "rests" or not isinstance(value, list):
            yield from _rests(value)
            continue
        for rest in value:
            if isinstance(rest, Mapping) and all(_is_number(rest.get(end)) for end in ("start", "end")):
                used, remark = rest.get("used", True), rest.get("remark", "")
                yield RestUsed(float(rest["start"]), float(rest["end"]), bool(used), str(remark))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
