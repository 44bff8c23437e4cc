"""Entry point of the installed command, which heeds Control-C from its first line on.

Scripts that pip writes do more between this import and the call of `main`. Importing it ends the process at
Control-C: programs that call commands themselves import `tumble.cli.main`.
"""

from __future__ import annotations

from tumble.cli.control_c import end_at_control_c

end_at_control_c()

from tumble.cli.main import main  # noqa: E402 - Control-C is heeded before anything else is imported

__all__ = ["main"]
