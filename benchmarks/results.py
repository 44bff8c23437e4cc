"""Figures on disk: one JSON file a benchmark under `results`, from which docs/benchmarks is printed."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Iterable
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parent / "results"
Content = dict[str, Any]


def save(name: str, content: Content, folder: Path = RESULTS) -> Path:
    """Writes the figures of a benchmark, in full or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.json"
    unfinished = path.with_suffix(".json.part")
    unfinished.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    unfinished.replace(path)
    return path


def load(name: str, folder: Path = RESULTS) -> Content:
    """Reads the figures of a benchmark."""
    content: Content = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    return content


def measured(names: Iterable[str]) -> dict[str, Content]:
    """Reads the figures of those benchmarks that were run."""
    folder: Path = (load.__defaults__ or (RESULTS,))[0]
    return {name: load(name) for name in names if (folder / f"{name}.json").is_file()}


def machine() -> Content:
    """Machine on which the figures were measured."""
    import numpy as np
    import pyarrow as pa  # type: ignore[import-untyped]

    import tumble

    return {
        "cores": os.cpu_count(),
        "machine": platform.machine(),
        "system": platform.system(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "pyarrow": pa.__version__,
        "tumble": tumble.__version__,
    }
