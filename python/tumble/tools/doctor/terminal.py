"""Capabilities of the terminal, and of its shell to complete what is typed."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from tumble.foundation.file_status import exists
from tumble.tools.doctor.result import Diagnosed, State

COMPLETIONS = {
    "bash": ".bash_completions/tumble.sh",
    "zsh": ".zfunc/_tumble",
    "fish": ".config/fish/completions/tumble.fish",
}
"""Place of the file that `tumble --install-completion` writes, below the home folder, for each shell."""
SHOWN = "±°²"
"""Signs that tables of results hold."""


def terminal(home: Path) -> Iterator[Diagnosed]:
    """Inspects the screen, the command and, with the files in `home`, its completion."""
    yield _screen()
    yield _command()
    yield _completion(home)


def _screen() -> Diagnosed:
    """Describes the width of the terminal, and whether it can show the signs of results."""
    encoding = getattr(sys.stdout, "encoding", None) or "ascii"
    width = shutil.get_terminal_size().columns
    kind = f"terminal of {width} columns" if sys.stdout.isatty() else "no terminal, but a file or a pipe"
    try:
        SHOWN.encode(encoding)
    except UnicodeEncodeError:
        remedy = "set PYTHONUTF8=1, or a locale with UTF-8"
        return Diagnosed("screen", State.BROKEN, f"{kind}; {encoding} cannot show {SHOWN!a}", remedy)
    return Diagnosed("screen", State.WORKS, f"{kind}, {encoding}")


def _command() -> Diagnosed:
    """Returns the `tumble` that a shell would start."""
    found = shutil.which("tumble")
    if found is None:
        remedy = f"add {Path(sys.executable).parent} to it"
        return Diagnosed("command", State.MISSING, "tumble is not on the PATH", remedy)
    return Diagnosed("command", State.WORKS, found)


def _completion(home: Path) -> Diagnosed:
    """Returns whether the shell of this user completes commands and options."""
    shell = Path(os.environ.get("SHELL", "")).name
    if shell not in COMPLETIONS:
        known = ", ".join(COMPLETIONS)
        return Diagnosed(
            "completion", State.MISSING, f"shell {shell or 'not known'}; there is one for {known}"
        )
    if exists(home / COMPLETIONS[shell]):
        return Diagnosed("completion", State.WORKS, f"installed for {shell}")
    return Diagnosed("completion", State.MISSING, f"not installed for {shell}", "tumble --install-completion")
