"""Rust sources out of templates."""

from __future__ import annotations

import re
import subprocess
import textwrap
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

ROOT = Path(__file__).parents[1]
LINE = 110


def rendered(template: str, **values: object) -> str:
    """Fills a template of this folder, and formats it as `cargo fmt` does."""
    # Not a page: nothing is to be escaped.
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), undefined=StrictUndefined, keep_trailing_newline=True
    )
    environment.globals["comment"] = _comment
    source = environment.get_template(template).render(**values)
    command = ["rustfmt", "--edition", "2024", "--config-path", str(ROOT / "rustfmt.toml")]
    return subprocess.run(command, input=source, capture_output=True, text=True, check=True).stdout


def _comment(text: str) -> str:
    # Digits in groups stay on one line.
    kept = re.sub(r"(?<=\d) (?=\d{3}\b)", "\0", text)
    lines = textwrap.wrap(kept, LINE - 8, break_on_hyphens=False)
    return "\n".join(f"/// {line}" for line in lines).replace("\0", " ")
