"""A working folder in which each module has a namesake: whoever imports from it ends at once."""

import sys
from importlib.metadata import packages_distributions
from pathlib import Path

TUMBLE = Path(sys.executable).with_name("tumble")
"""Script of the command, which has the folder of the script on its path, not the working folder."""


def crowd(folder):
    """Writes a namesake of each module that can be imported; returns the folder."""
    for name in {*sys.stdlib_module_names, *packages_distributions()}:
        (folder / f"{name}.py").write_text("raise SystemExit('imported from the working folder')\n")
    return folder
