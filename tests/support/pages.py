"""Pages of the documentation, as tests read them."""

from __future__ import annotations

import re


def without_commands(text):
    """Omits the commands that scripts/check_commands.py runs, with options of other commands."""
    return re.sub(r"```sh\n.*?```", "", text, flags=re.DOTALL)
