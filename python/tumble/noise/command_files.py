"""What `tumble noise` writes: the page, the calibration file, and what other programs read."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from tumble.files import FileKind, check_output, write_text

if TYPE_CHECKING:
    from tumble.noise.result import NoiseResult

KEYS_KIND = FileKind("noise for Kalibr, as Tumble writes it", re.compile(rb"\A# Noise of "))


def prepare(folder: Path | str, name: str) -> tuple[Path, Path, Path]:
    """Prove that page, calibration and keys can be written into `folder`, and give the path of each."""
    from tumble.calibration.document import SCHEMA
    from tumble.documents import document_kind
    from tumble.file_names import unit_stem
    from tumble.files import PAGE, prepare_folder

    folder, stem = prepare_folder(folder), unit_stem(name, "noise")
    page, calibration, keys = (folder / f"{stem}{end}" for end in (".html", ".yaml", ".kalibr.yaml"))
    check_output(page, PAGE)
    check_output(calibration, document_kind(SCHEMA))
    check_output(keys, KEYS_KIND)
    return page, calibration, keys


def write_results(result: NoiseResult, folder: Path | str) -> dict[str, Path]:
    """Write everything into `folder`, named after the unit; give the path of each file by what it is."""
    from tumble.calibration.document import Calibration
    from tumble.noise.keys import keys_text
    from tumble.noise.report.page import NOISE_REPORT

    page, calibration, keys = prepare(folder, result.name)
    NOISE_REPORT.write(result, page)
    Calibration.from_noise(result).save(calibration)
    write_text(keys, keys_text(result), KEYS_KIND)
    return {"calibration": calibration, "kalibr": keys, "report": page}
