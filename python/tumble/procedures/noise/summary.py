"""Noise as a table on screen, and as JSON for machines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite
from pathlib import Path
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.plain import finite
from tumble.procedures.noise.keys import kalibr_keys, vins_keys
from tumble.procedures.noise.report.text import printed_terms, unidentified, used_sentence
from tumble.procedures.noise.result import ASKED_FOR, NoiseResult

SCHEMA: Final = "tumble-noise-result/1"


def screen_summary(result: NoiseResult) -> RenderableType:
    """Describes the result at a glance: estimates for each channel, and warnings."""
    notes = [Text(f"Not identifiable: {line}", "yellow") for line in unidentified(result)]
    notes += [Text(f"Warning: {line}", "yellow") for line in result.warnings]
    notes += [Text(f"Also seen: {line}") for line in _others_seen(result)]
    keys = [
        Text(f"{key.name}: {key.value:.3e} {key.unit}") for key in kalibr_keys(result) if isfinite(key.value)
    ]
    return Group(Text(used_sentence(result.still)), "", _table(result), "", *notes, "", *keys)


def json_content(result: NoiseResult, files: Mapping[str, Path]) -> dict[str, Any]:
    """Give everything that was found, and the files it was written to."""
    content = {
        "name": result.name,
        "sources": result.sources,
        "serial": result.serial,
        "software": result.software,
        "verdict": result.verdict,
        "still": result.still,
        "temperature": result.temperature,
        "start": result.start_hash,
        "channels": result.channels,
        "kalibr": {key.name: key.value for key in kalibr_keys(result)},
        "vins": {key.name: key.value for key in vins_keys(result)},
        "warnings": (*unidentified(result), *result.warnings),
        "files": files,
    }
    return {key: finite(value) for key, value in content.items()}


def _table(result: NoiseResult) -> Table:
    table = Table(
        box=SIMPLE_HEAD, padding=(0, 1), show_edge=False, caption="95 % intervals", caption_justify="left"
    )
    for name in ("", *ASKED_FOR):
        table.add_column(name, no_wrap=True)
    columns = [[channel.term(name) for channel in result.channels] for name in ASKED_FOR]
    for triad in result.triads:
        places = [k for k, channel in enumerate(result.channels) if channel.triad == triad]
        printed = [printed_terms([column[k] for k in places]) for column in columns]
        for place, cells in zip(places, zip(*printed, strict=True), strict=True):
            seen = [column[place].observable for column in columns]
            texts = (Text(cell, "" if known else "dim") for cell, known in zip(cells, seen, strict=True))
            table.add_row(result.channels[place].name, *texts)
    return table


def _others_seen(result: NoiseResult) -> Iterator[str]:
    """Describes terms that a channel shows without a request for them."""
    for channel in result.channels:
        for term in channel.terms:
            if term.observable and term.name not in ASKED_FOR:
                yield f"{channel.name} {term.name} {printed_terms([term])[0]}"
