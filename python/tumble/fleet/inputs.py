"""Inputs of a fleet: which recordings, of which unit, in which version of their content."""

from __future__ import annotations

import hashlib
import json
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import PurePosixPath
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tumble.fleet.input_options import options_of_inputs, unfit_value
from tumble.fleet.job import FleetJob
from tumble.fleet.path_pattern import PathPattern
from tumble.fleet.places import matching, version_at
from tumble.foundation.bounded_json import parse_json
from tumble.foundation.days import day_of, mistake_in_date
from tumble.foundation.errors import TumbleError, shown
from tumble.foundation.executors import unjoined_executor
from tumble.foundation.names import normal_name
from tumble.foundation.words import quoted

COLUMNS = ("unit", "serial", "model", "lot", "operator", "station", "day")
"""Facts about a recording that a manifest or its path may state; `day` is its date, YYYY-MM-DD."""
_READERS = 32
"""Files of a manifest that are looked up at a time."""
_ROWS = 4096
"""Rows of a manifest whose files are looked up at a time."""
_ROWS_AT_ONCE = 256
"""Rows of a manifest that are read at a time: one text may stand for all of them in few bytes."""
_LONGEST_TEXT = 1 << 16
"""Letters of a place, and of options."""


class InputsError(TumbleError):
    """A manifest or pattern that gives no usable inputs."""


@dataclass(frozen=True, slots=True)
class FleetInput:
    """One recording, or a folder of those that belong together."""

    place: str
    """Path or URL; a seed of what is simulated."""
    version: str = ""
    """Changes with the content."""
    facts: Mapping[str, str] = field(default_factory=dict)
    """Keys are those of `COLUMNS`."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the command for this input, on top of those of the job."""

    def key(self, work: str) -> bytes:
        """Returns 16 bytes that are the same wherever the same is computed of the same content."""
        content = json.dumps(
            [work, self.place, self.version, dict(self.facts), dict(self.options)], sort_keys=True
        )
        return hashlib.sha256(content.encode("utf-8", "surrogateescape")).digest()[:16]


class InputList:
    """The inputs of a job, looked up once and kept in a temporary file: memory hardly grows with them.

    Raises `InputsError` and `StoreError` as `inputs_of` does, and where an input is given twice.
    """

    def __init__(self, job: FleetJob) -> None:
        marks = array("Q")
        try:
            self._file = TemporaryFile("w+", encoding="utf-8", errors="surrogateescape")  # noqa: SIM115 - `close`
            for each in inputs_of(job):
                content = [each.place, each.version, dict(each.facts), dict(each.options)]
                self._file.write(json.dumps(content) + "\n")
                marks.append(_mark(each))
            self._file.flush()
        except OSError as error:
            raise InputsError(
                f"the inputs cannot be listed: {error.strerror or error}; name a folder with room by TMPDIR"
            ) from error
        self._count = len(marks)
        self._refuse_doubled(np.sort(np.frombuffer(marks, np.uint64)))

    def _refuse_doubled(self, marks: NDArray[np.uint64]) -> None:
        """Refuses an input that is given twice; 8 bytes are kept of each, and more only of those in doubt."""
        in_doubt = set(marks[1:][marks[1:] == marks[:-1]].tolist())
        known: set[str] = set()
        for each in self if in_doubt else ():
            if _mark(each) not in in_doubt:
                continue
            if (told := _told_apart(each)) in known:
                raise InputsError(
                    f"{shown(each.place)}: is given twice; remove one, or give them different options"
                )
            known.add(told)

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[FleetInput]:
        """Yields all inputs; one pass at a time."""
        self._file.seek(0)
        for line in self._file:
            yield FleetInput(*parse_json(line))

    def close(self) -> None:
        """Removes the file."""
        self._file.close()


def inputs_of(job: FleetJob) -> Iterator[FleetInput]:
    """Yields the inputs of a job in an order that stays the same.

    Raises `InputsError` where a pattern fits nothing, a manifest lacks its columns, or an input is missing;
    `StoreError` where a store cannot be reached.
    """
    if seeds := job.all_seeds:
        yield from (FleetInput(str(seed)) for seed in seeds)
        return
    for pattern in job.patterns:
        yield from _listed(pattern, job.procedure) if pattern.endswith(".parquet") else _found(pattern)


def _told_apart(given: FleetInput) -> str:
    """Returns text that is the same for an input that is given twice."""
    return json.dumps([given.place, dict(given.options)], sort_keys=True)


def _mark(given: FleetInput) -> int:
    """Returns 64 bits that are the same for an input that is given twice."""
    content = _told_apart(given).encode("utf-8", "surrogateescape")
    return int.from_bytes(hashlib.sha256(content).digest()[:8], "little")


def _found(text: str) -> Iterator[FleetInput]:
    pattern = _pattern(text)
    found = False
    for place, version in matching(pattern.wildcards):
        stated = pattern.facts_in(place)
        if stated is None:
            continue
        found = True
        yield FleetInput(place, version, {"unit": _unit(place), **_facts(shown(place), stated)})
    if not found:
        raise InputsError(f"{shown(text)}: fits no file; check the pattern")


def _pattern(text: str) -> PathPattern:
    """Returns a pattern of paths; raises `InputsError` for a name that is unknown, or given twice."""
    pattern = PathPattern(text)
    for number, name in enumerate(pattern.names):
        if name not in COLUMNS:
            raise InputsError(f"{shown(text)}: {{{name}}} is unknown; use {', '.join(COLUMNS)}, or *")
        if name in pattern.names[:number]:
            raise InputsError(f"{shown(text)}: {{{name}}} is given twice; give it once, and * elsewhere")
    return pattern


def _facts(about: str, stated: Mapping[str, Any]) -> dict[str, str]:
    """Returns the facts about a recording.

    Raises `InputsError` for a name that is too long, and a day that is none or in the future.
    """
    facts: dict[str, str] = {}
    for name in COLUMNS:
        if stated.get(name):
            try:
                facts[name] = normal_name(str(stated[name]))
            except ValueError as error:
                raise InputsError(f"{about}: {name}: {error}; correct it") from error
    if day := facts.get("day"):
        mistake = mistake_in_date(day) if day_of(day) else "is none; give one such as 2026-11-22"
        if mistake:
            raise InputsError(f"{about}: day {quoted(day)} {mistake}")
    return facts


def _unit(place: str) -> str:
    return PurePosixPath(place.replace("\\", "/")).name.partition(".")[0]


def _listed(manifest: str, procedure: str) -> Iterator[FleetInput]:
    rows = _manifest_rows(manifest)
    with unjoined_executor(_READERS) as readers:
        while some := list(islice(rows, _ROWS)):
            versions = readers.map(version_at, (row["place"] for _, row in some))
            for (number, row), version in zip(some, versions, strict=True):
                if version is None:
                    raise InputsError(
                        f"{shown(manifest)}: row {number}: {shown(row['place'])} does not exist; correct it"
                    )
                facts = _facts(f"{shown(manifest)}: row {number}", row)
                yield FleetInput(
                    row["place"],
                    version,
                    {"unit": _unit(row["place"]), **facts},
                    _options(f"{shown(manifest)}: row {number}", row, procedure),
                )


def _manifest_rows(manifest: str) -> Iterator[tuple[int, dict[str, Any]]]:
    import pyarrow as pa  # type: ignore[import-untyped]
    import pyarrow.parquet as pq  # type: ignore[import-untyped]

    from tumble.fleet.parts import packed_file, unpacked
    from tumble.fleet.places import FileStore
    from tumble.foundation.stores import store_error

    place = FileStore(manifest)
    number = 0
    try:
        with place.opened("manifest") as file:
            schema = pq.ParquetFile(file).schema_arrow
            known = _columns_of(manifest, schema)
            for some in packed_file(file, manifest, known).iter_batches(_ROWS_AT_ONCE, columns=known):
                for row in unpacked(pa.Table.from_batches([some]), schema, manifest).to_pylist():
                    number += 1
                    _refuse_unfit(f"{shown(manifest)}: row {number}", row)
                    yield number, row
    except TumbleError:
        raise
    except Exception as error:  # of the store's library, or of pyarrow in a file of others
        raise store_error(manifest, error) from error
    if not number:
        raise InputsError(f"{shown(manifest)}: lists no inputs; give a row for each")


def _columns_of(manifest: str, schema: Any) -> list[str]:  # noqa: ANN401 - pyarrow
    import pyarrow as pa

    if "place" not in schema.names:
        raise InputsError(f"{shown(manifest)}: has no column place; give each input's path or URL in it")
    known = [name for name in ("place", "options", *COLUMNS) if name in schema.names]
    for name in known:
        kind = schema.field(name).type
        if pa.types.is_nested(kind) or pa.types.is_fixed_size_binary(kind):
            raise InputsError(f"{shown(manifest)}: column {name} holds no texts but {kind}; write it as text")
    return known


def _refuse_unfit(about: str, row: Mapping[str, Any]) -> None:
    if not isinstance(row["place"], str) or not row["place"]:
        raise InputsError(f"{about}: place is empty; give a path or URL")
    for name, value in row.items():
        if isinstance(value, str) and len(value) > _LONGEST_TEXT:
            raise InputsError(f"{about}: {name} has {len(value)} letters; {_LONGEST_TEXT} at most")


def _options(about: str, row: Mapping[str, Any], procedure: str) -> dict[str, Any]:
    text = row.get("options")
    if not text:
        return {}
    try:
        options = parse_json(text)
    except (TypeError, ValueError):
        options = None
    if not isinstance(options, dict):
        raise InputsError(
            f'{about}: options {quoted(str(text))} are no JSON object; give one such as {{"still": "5s"}}'
        )
    known = options_of_inputs(procedure)
    for name, value in options.items():
        if name not in known:
            raise InputsError(
                f"{about}: option {quoted(name)} is none of {procedure}, or none that a manifest may state; "
                "write whole names, and places to write into the job"
            )
        if wanted := unfit_value(value, is_flag=known[name]):
            raise InputsError(f"{about}: option {quoted(name)} takes {wanted}; correct it")
    return options
