"""Files that `tumble noise` writes: the page, the calibration file, and files for other programs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from tumble.foundation.files import BY_TUMBLE, FileKind, check_output, write_text

if TYPE_CHECKING:
    from tumble.procedures.noise.result import NoiseResult

KEYS_KIND = FileKind("noise for Kalibr, as Tumble writes it", re.compile(rb"\A# Noise of "), BY_TUMBLE)


def prepare(folder: Path | str, name: str) -> Path:
    """Proves that page, calibration and keys can be written into `folder`, and returns that of the keys."""
    from tumble.calibration.unit_files import prepare_unit_files

    _, calibration = prepare_unit_files(folder, name, "noise")
    keys = calibration.with_suffix(".kalibr.yaml")
    check_output(keys, KEYS_KIND)
    return keys


def save(result: NoiseResult, folder: Path | str) -> dict[str, Path]:
    """Write everything into `folder`, named after the unit; give the path of each file by what it is."""
    from tumble.calibration.unit_files import write_unit_files
    from tumble.procedures.noise.keys import keys_text
    from tumble.procedures.noise.report.page import NOISE_REPORT

    keys = prepare(folder, result.name)
    files = write_unit_files(result, NOISE_REPORT.write, folder, "noise")
    write_text(keys, keys_text(result), KEYS_KIND)
    return {"calibration": files["calibration"], "kalibr": keys, "report": files["report"]}
