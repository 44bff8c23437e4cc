"""The command `tumble`: a mistake of the user is one line and exit code 2; a bug keeps its traceback."""

from __future__ import annotations

import sys

from tumble.errors import TumbleError
from tumble.files import files_of_command

USER_MISTAKE = 2
INTERRUPTED = 130


def main() -> None:
    """Run `tumble` with the arguments of this process."""
    try:
        code = _run()
    except TumbleError as error:
        for line in str(error).splitlines():
            print(f"tumble: error: {line}", file=sys.stderr)
        code = USER_MISTAKE
    except KeyboardInterrupt:
        code = INTERRUPTED
    sys.exit(code)


def _run() -> int:
    # Imported late, so that Control-C while libraries are imported ends like any other.
    from tumble.cli.commands import run_command
    from tumble.cli.standard_output import checked_standard_output

    with files_of_command() as files, checked_standard_output():
        code = run_command(sys.argv[1:])
        for remark in files.remarks():
            print(f"tumble: {remark}", file=sys.stderr)
    return code
