"""Section lists: which samples of a log show what, as a user labelled them or other tools wrote them."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import acquire
from tumble.acquisition.imu import pose_files
from tumble.foundation.bounded_json import parse_json
from tumble.foundation.documents import LARGEST_DOCUMENT
from tumble.foundation.errors import ProcedureError
from tumble.foundation.file_reading import read_text_whole
from tumble.foundation.recording import FloatArray, Recording

REST = "rest"
"""Label of a stretch at rest in an orientation that nobody states."""
LABELS = _core.VOCABULARY["section"]
"""`x_p` is a rest with axis x up, `x_a` with it down, `x_rot` a full turn about it while it is vertical."""
FULL_TURNS = tuple(label for label in LABELS if label.endswith("_rot"))
_UP = ("p", "up", "plus", "pos", "positive", "+")
_DOWN = ("a", "down", "minus", "neg", "negative", "-")
_WAYS = "|".join(re.escape(way) for way in (*_UP, *_DOWN))
_FACE = re.compile(f"(?P<axis>[xyz])_?(?P<way>{_WAYS})")
_SIGNED = re.compile("(?P<way>[+-])(?P<axis>[xyz])")
"""Names of the six faces, as people write them: the axis, and which way it points."""
SHORTEST = 10
"""Samples that a section has at least."""


@dataclass(frozen=True, slots=True)
class Section:
    """A stretch of a log, by the numbers of its samples from 0."""

    label: str
    start: int
    end: int
    """The first sample after it."""


CLOSE = 1e-6
"""s, to which the times of rests are known."""

Sections: TypeAlias = str | Path | Sequence[Section]
"""A file, or what it would hold."""


def sections_of(given: Sections) -> tuple[Section, ...]:
    """Reads a section list: CSV with the columns label, start and end, or JSON {label: {start, end}}.

    Raises `ProcedureError`, in one line, for what is not such a list, a label that nobody knows, and sections
    that are too short or overlap.
    """
    if not isinstance(given, str | Path):
        return _checked(given, "sections")
    path = Path(given)
    text = read_text_whole(path, LARGEST_DOCUMENT, "section list", error=ProcedureError)
    rows = _json_rows(text, path) if path.suffix.lower() == ".json" else _csv_rows(text, path)
    return _checked([_section(row, path) for row in rows], str(path))


def sections_of_folder(recording: Recording) -> tuple[Section, ...]:
    """Returns the stretches that the files of a folder are named after, else all rests that its parts show.

    A log that was split into files without such names has no sections: it shows its rests by itself.

    Raises `ProcedureError` where a part shows no rest, or two files have one name.
    """
    files = recording.files or recording.parts
    labels = [label_of(name) for name in pose_files(replace(recording, parts=files))]
    if set(labels) == {REST}:
        files, labels = recording.parts, [REST] * len(recording.parts)
    found: list[Section] = []
    before = 0
    for label, file in zip(labels, files, strict=True):
        times = np.concatenate([chunk.time for chunk in file.chunks()])
        found += [Section(label, before + a, before + b) for a, b in _stretches(label, file, times)]
        before += len(times)
    return _checked(found, recording.name) if found else ()


def label_of(name: str) -> str:
    """Returns the label that the name of a pose states: `x_up`, `+x` and `x_p` are axis x up; else a rest."""
    if name in LABELS:
        return name
    plain = name.casefold().replace(" ", "_")
    for pattern in (_FACE, _SIGNED):
        if found := pattern.fullmatch(plain):
            return f"{found['axis']}_{'p' if found['way'] in _UP else 'a'}"
    return REST


def _stretches(label: str, file: Recording, times: FloatArray) -> list[tuple[int, int]]:
    """Returns the first sample of each stretch that a label names, and the first after it."""
    if label in FULL_TURNS:
        return [(0, len(times))]
    rests = acquire(file).acquired.rest_times
    if not len(rests):
        raise ProcedureError("shows no rest of 1 s or longer; record this pose again", about=file.name)
    spans = [(int(first), int(end)) for first, end in np.searchsorted(times, rests - CLOSE)]
    long = [span for span in spans if span[1] - span[0] >= SHORTEST]
    return long if label == REST and long else [max(spans, key=lambda span: span[1] - span[0])]


def _json_rows(text: str, path: Path) -> Iterable[tuple[str, object, object]]:
    try:
        content = parse_json(text)
        return [(label, span["start"], span["end"]) for label, span in content.items()]
    except (ValueError, AttributeError, KeyError, TypeError):
        raise ProcedureError(
            'is no section list; expected {"x_p": {"start": 540, "end": 1271}, ...}, in samples',
            about=str(path),
        ) from None


def _csv_rows(text: str, path: Path) -> Iterable[tuple[str, object, object]]:
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    reader = csv.DictReader(lines)
    columns = [name.strip() for name in reader.fieldnames or ()]
    if columns[1:3] != ["start", "end"]:
        found = ",".join(columns) or "nothing"
        raise ProcedureError(f"expected the columns label,start,end, found {found}", about=str(path))
    rows = csv.reader(lines[1:])
    return [(row[0].strip(), row[1], row[2]) for row in rows if len(row) >= 3]


def _section(row: tuple[str, object, object], path: Path) -> Section:
    label, start, end = row
    try:
        return Section(label, int(str(start)), int(str(end)))
    except ValueError:
        raise ProcedureError(
            f"{label}: {start} to {end} are no numbers of samples", about=str(path)
        ) from None


def _checked(sections: Sequence[Section], about: str) -> tuple[Section, ...]:
    if not sections:
        raise ProcedureError("holds no sections", about=about)
    for each in sections:
        if each.label not in LABELS:
            known = ", ".join(LABELS)
            raise ProcedureError(f"{each.label!r} is no label; known are {known}", about=about)
        if each.start < 0 or each.end - each.start < SHORTEST:
            span = f"{each.label}, samples {each.start} to {each.end}"
            raise ProcedureError(f"{span}: a section has {SHORTEST} samples or more", about=about)
    in_order = tuple(sorted(sections, key=lambda each: each.start))
    for each, following in pairwise(in_order):
        if following.start < each.end:
            raise ProcedureError(
                f"{each.label} and {following.label} overlap at sample {following.start}", about=about
            )
    if (REST in {each.label for each in sections}) and any(each.label != REST for each in sections):
        raise ProcedureError(
            f"holds {REST} beside labelled faces; six faces are a session of their own, so label all or none",
            about=about,
        )
    return in_order


def are_faces(sections: Sequence[Section]) -> bool:
    """Returns whether the sections are those of six faces, not rests in any orientation."""
    return any(each.label != REST for each in sections)
