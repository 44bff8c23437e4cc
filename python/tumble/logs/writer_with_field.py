"""Writers of samples with the readings of a magnetometer beside them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk
from tumble.logs.magnetic_rows import MagneticRows
from tumble.logs.writer import Facts
from tumble.logs.writers import format_for, open_mcap_writer, open_writer


@contextmanager
def open_writer_with_field(
    output: Path,
    format_name: str | None,
    facts: Facts,
    track: MagneticTrack | None,
    *,
    inputs: Iterable[Path] = (),
) -> Iterator[Callable[[Chunk], None]]:
    """Opens what writes samples, with the readings of a magnetometer in rows or messages of their own.

    Arguments as of `open_writer`; `track` is None where there is no magnetometer.
    """
    if track is None:
        with open_writer(output, format_name, facts, inputs=inputs) as writer:
            yield writer.write
    elif format_for(output, format_name) == "mcap":
        with open_mcap_writer(output, facts, inputs=inputs) as topics:
            topics.write_magnetic(track)
            yield topics.write
    else:
        rows = MagneticRows(track)
        facts = replace(facts, further=rows.columns)
        with open_writer(output, format_name, facts, inputs=inputs) as writer:
            yield lambda chunk: writer.write(rows.beside(chunk))
