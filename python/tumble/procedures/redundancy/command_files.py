"""Files that `tumble redundancy` writes: events, a calibration file for each secondary, and the report."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from tumble.foundation.errors import OutputError
from tumble.foundation.file_names import EVENTS, REDUNDANCY_PAGE, STORE, unit_stem
from tumble.foundation.file_status import exists
from tumble.foundation.files import FileKind, prepare_folder, refuse_linked_folder, replacing
from tumble.foundation.plain import finite
from tumble.foundation.words import defused
from tumble.logs.track import SI
from tumble.logs.writers import FORMATS
from tumble.procedures.redundancy.store import ErrorStore, keep_adopted

if TYPE_CHECKING:
    from tumble.procedures.redundancy.result import RedundancyEvent, RedundancyResult, SetOutput

EVENTS_KIND = FileKind(
    "events of tumble redundancy",
    re.compile(rb'\A\{"time": [^,]+, "unit": [^\n]+, "event": [^\n]+, "figures": \{'),
)

OUTPUT_CSV = FileKind(
    "an output of tumble redundancy",
    re.compile(rb'\A"time","ax","ay","az","gx","gy","gz","source","flags"\n'),
)


def save(result: RedundancyResult, folder: Path | str) -> dict[str, Path]:
    """Write everything into `folder`; give the path of each file by what it is."""
    from tumble.procedures.redundancy.report.page import REDUNDANCY_REPORT

    folder = prepare_folder(folder)
    calibrated = {error.unit for error in result.errors}
    events, page = folder / EVENTS, folder / REDUNDANCY_PAGE
    write_events(result, events)
    files = {"events": events}
    for unit, path in _calibration_files(result, folder):
        if unit in calibrated:
            result.calibration_of(unit).save(path)
            files[unit] = path
    REDUNDANCY_REPORT.write(result, page)
    return files | {"report": page, "store": _stored(result, folder)}


def stale_files(result: RedundancyResult, folder: Path) -> list[Path]:
    """Calibration files that stand in the folder for secondaries that have no calibration this time."""
    calibrated = {error.unit for error in result.errors}
    paths = [path for unit, path in _calibration_files(result, folder) if unit not in calibrated]
    return [path for path in paths if exists(path)]


def _calibration_files(result: RedundancyResult, folder: Path) -> list[tuple[str, Path]]:
    return [(unit, folder / f"{unit_stem(unit, 'redundancy')}.yaml") for unit in result.secondaries]


def _stored(result: RedundancyResult, folder: Path) -> Path:
    """Stores what was adopted, unless the replay did; returns the folder where it is."""
    if result.store is not None:
        return result.store
    store = folder / STORE
    refuse_linked_folder(store)
    keep_adopted(ErrorStore(store, result.identities[0], fresh=True), result.errors, result.identities)
    return store


def write_output(output: SetOutput, path: Path | str) -> Path:
    """Writes the output as CSV or Parquet, by the extension; raises `OutputError` where it cannot."""
    import pyarrow as pa  # type: ignore[import-untyped]
    import pyarrow.csv  # type: ignore[import-untyped]
    import pyarrow.parquet  # type: ignore[import-untyped]

    path = Path(path)
    kind = output_format(path)
    axes = {f"a{axis}": output.specific_force[:, i] for i, axis in enumerate("xyz")}
    axes |= {f"g{axis}": output.angular_rate[:, i] for i, axis in enumerate("xyz")}
    units = [defused(unit) for unit in output.units]
    source = pa.DictionaryArray.from_arrays(pa.array(output.source), pa.array(units))
    named = {"source": source.cast(pa.string()), "flags": output.flags}
    table = pa.table({"time": output.time} | axes | named).replace_schema_metadata({"tumble.units": SI})
    with replacing(path, OUTPUT_CSV if kind == "csv" else FORMATS[kind]) as file:
        if kind == "csv":
            pa.csv.write_csv(table, file, pa.csv.WriteOptions(quoting_style="needed"))
        else:
            pa.parquet.write_table(table, file, compression="zstd", write_page_checksum=True)
    return path


def output_format(path: Path) -> str:
    """Returns the format of a file of the output; raises `OutputError` where it is none that holds it."""
    kind = path.suffix.removeprefix(".").lower()
    if kind not in ("csv", "parquet"):
        raise OutputError(f"{path}: the output of a set is written as .csv or .parquet; give such a name")
    return kind


def write_events(result: RedundancyResult, path: Path) -> None:
    """Writes one JSON object a line: time, unit, event, figures; `null` for what is not finite."""
    with replacing(path, EVENTS_KIND) as file:
        for line in event_lines(result):
            file.write(f"{line}\n".encode())


def event_lines(result: RedundancyResult) -> Iterator[str]:
    """Returns each event as JSON."""
    for event in result.events:
        yield json.dumps(finite(event_content(event)), allow_nan=False)


def event_content(event: RedundancyEvent) -> dict[str, object]:
    """Returns an event as it stands in the file of events."""
    return {"time": event.time, "unit": event.unit, "event": event.event, "figures": dict(event.figures)}
