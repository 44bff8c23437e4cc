"""`tumble export --all`: a calibration in the files of all programs at once."""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path
from typing import Final

from rich.table import Table

from tumble.calibration.document import Calibration
from tumble.cli.output import folder_named_after
from tumble.cli.screen import print_document, print_summary
from tumble.foundation.errors import ProcedureError
from tumble.foundation.file_names import file_stem
from tumble.foundation.files import check_output, prepare_folder, replacing
from tumble.foundation.words import count_of, join
from tumble.tools.exchange.axes import STATEMENT
from tumble.tools.exchange.command_export import printed
from tumble.tools.exchange.export_all import export_all
from tumble.tools.exchange.registry import TARGETS
from tumble.tools.exchange.target import Exported

EXPORT_ALL: Final = "tumble-export-all/1"


def write_all_formats(
    paths: list[Path], typed: dict[str, str], output: Path | None, *, strict: bool, as_json: bool
) -> None:
    """Writes the files of all formats that the calibrations and the settings suffice for into one folder."""
    units = [Calibration.load(path) for path in paths]
    exported, refused = export_all(units, typed, strict=strict)
    if not exported:
        raise ProcedureError("; ".join(dict.fromkeys(refused.values())))
    stem = file_stem(units[0].name)
    folder = prepare_folder(output or folder_named_after(stem))
    files = {word: folder / f"{stem}-{word}{TARGETS[word].ending}" for word in exported}
    for word, path in files.items():
        check_output(path, TARGETS[word].output_kind, inputs=paths)
    for word, each in exported.items():
        with replacing(files[word], TARGETS[word].output_kind, inputs=paths) as file:
            file.write(each.content)
    if as_json:
        written = {word: printed(each, files[word]) for word, each in exported.items()}
        content = {"folder": str(folder), "written": written, "refused": refused}
        print_document(EXPORT_ALL, "some refused" if refused else "all written", content)
        return
    _print_all(exported, files, refused)
    print(f"{count_of('file', len(files))} written: {folder}")


def _print_all(exported: dict[str, Exported], files: dict[str, Path], refused: dict[str, str]) -> None:
    for warning in dict.fromkeys(warning for each in exported.values() for warning in each.warnings):
        print(f"tumble: warning: {warning}", file=sys.stderr)
    table = Table("--format", "file", "lost, or what is missing")
    for word, each in exported.items():
        lost = dict.fromkeys(str(loss).removeprefix(f"{loss.unit}: ") for loss in each.losses)
        table.add_row(word, files[word].name, "; ".join(lost))
    for word, reason in refused.items():
        table.add_row(word, "", reason)
    print_summary(table)
    about: dict[str, list[str]] = defaultdict(list)
    for word, each in exported.items():
        for remark in each.remarks:
            about[remark].append(word)
    for remark, words in about.items():
        # Those about axes stand in the files, one for each.
        if not remark.startswith(STATEMENT):
            print(f"Note on {join(words)}: {remark}")
