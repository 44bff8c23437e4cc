"""Samples of the visible range, as bytes for the chart."""

from __future__ import annotations

import json
import secrets
import struct
from collections.abc import Sequence

import numpy as np
from fastapi import APIRouter, HTTPException, Response

from tumble.bench.log.bounds import Turn
from tumble.bench.log.chart_options import SeriesFacts
from tumble.tools.view.samples import SampleLine
from tumble.tools.view.viewing import Viewing

MOST_BINS = 8192
ROUTE = "/tumble-log"


class SamplesRoute:
    """Serves the samples of recordings that pages show, each under an address of its own."""

    def __init__(self) -> None:
        self.router = APIRouter()
        self.turn = Turn()
        """Turn of the pages to have something computed of what they show."""
        self._shown: dict[str, tuple[Viewing, Sequence[SeriesFacts]]] = {}
        self.router.add_api_route(f"{ROUTE}/{{key}}/samples", self._samples)

    def serve(self, viewing: Viewing, lines: Sequence[SeriesFacts]) -> str:
        """Serves lines of what is shown; returns the address below which they are."""
        key = secrets.token_urlsafe(12)
        viewing.enter()
        self._shown[key] = viewing, lines
        return f"{ROUTE}/{key}"

    def change(self, address: str, lines: Sequence[SeriesFacts]) -> None:
        """Serves other lines under an address."""
        key = address.rpartition("/")[2]
        self._shown[key] = self._shown[key][0], lines

    def end(self, address: str) -> None:
        """Serves nothing there any more."""
        viewing, _ = self._shown.pop(address.rpartition("/")[2], (None, ()))
        if viewing is not None:
            viewing.leave()

    def _samples(self, key: str, start: float, end: float, bins: int) -> Response:
        """Answers in a thread of its own, as a function without `async` does."""
        if key not in self._shown:
            raise HTTPException(404, "nothing is shown here")
        if not (np.isfinite([start, end]).all() and end > start and 1 <= bins <= MOST_BINS):
            raise HTTPException(422, "give start before end, and a number of bins")
        viewing, lines = self._shown[key]
        with viewing.in_use():
            content = window_bytes(viewing, lines, start, end, bins)
        return Response(content, media_type="application/octet-stream")


def window_bytes(
    viewing: Viewing, lines: Sequence[SeriesFacts], start: float, end: float, bins: int
) -> bytes:
    """Packs the samples that show a window: a length, JSON, then time and value, in doubles, of each line."""
    forms = tuple(dict.fromkeys(line.form for line in lines))
    found: dict[tuple[str, str, str], SampleLine] = {}
    for unit in viewing.units:
        for line in unit.samples.lines(start, end, bins, forms):
            found[unit.name, line.form, line.channel] = line
    heads, bodies = [], []
    for each in lines:
        samples = found.get((each.unit, each.form, each.channel))
        count = 0 if samples is None else len(samples.time)
        heads.append({"series": each.series, "count": count})
        if samples is not None:
            bodies.append(np.stack([samples.time, samples.value], axis=1).astype("<f8").tobytes())
    head = json.dumps({"start": start, "end": end, "lines": heads}).encode()
    # Doubles begin at a multiple of eight.
    head += b" " * (-(len(head) + 4) % 8)
    return struct.pack("<I", len(head)) + head + b"".join(bodies)
