"""Enters the results of a fleet into a registry."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from tumble.fleet.parts import tables
from tumble.fleet.places import FileStore
from tumble.foundation.files import make_new_file
from tumble.laboratory.registry import Registry, UnitFacts

_ENDING = ".yaml"
_COLUMNS = ("model", "lot", "failure", "documents")


def enter_results(address: str, results: FileStore) -> int:
    """Adds all calibrations that the registry does not hold yet; returns their number.

    Raises `TumbleError` where the registry or the results cannot be reached; what was added before stays.
    """
    registry = Registry(address)
    added = 0
    for model, lot, texts in _calibrations(results):
        with TemporaryDirectory(prefix="tumble-fleet-") as folder:
            paths = [Path(folder) / f"{number}{_ENDING}" for number in range(len(texts))]
            for path, text in zip(paths, texts, strict=True):
                make_new_file(path, text.encode())
            added += sum(each.is_new for each in registry.add(*paths, facts=UnitFacts(model=model, lot=lot)))
    return added


def _calibrations(results: FileStore) -> Iterator[tuple[str, str, list[str]]]:
    """Yields the calibration files of each model and lot, a part of the results at a time."""
    for table in tables(results, _COLUMNS):
        found: dict[tuple[str, str], list[str]] = {}
        for row in table.to_pylist():
            texts = [each["text"] for each in row["documents"] or () if each["name"].endswith(_ENDING)]
            found.setdefault((row["model"] or "", row["lot"] or ""), []).extend(
                text for text in texts if "\nschema: tumble-calibration/" in f"\n{text}"
            )
        for (model, lot), texts in found.items():
            if texts:
                yield model, lot, texts
