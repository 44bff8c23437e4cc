"""The command `tumble`: a mistake of the user is one line and exit code 2; a bug keeps its traceback.

Next to nothing is imported before `main` heeds Control-C.
"""

from __future__ import annotations

import sys

from tumble.cli.control_c import (
    DroppedTriedAgain,
    end_at_control_c,
    end_by_signal,
    heed_control_c_between_steps,
    restore,
    show_cursor,
)
from tumble.cli.exit_code import ExitCode

TYPE_CHECKING = False  # typing takes longer to import than all else that is needed to heed Control-C
if TYPE_CHECKING:
    from contextlib import AbstractContextManager


def main() -> None:
    """Runs `tumble` with the arguments of this process."""
    before = end_at_control_c()
    try:
        code = _run()
    except KeyboardInterrupt:
        code = ExitCode.INTERRUPTED
    except SystemExit as end:
        end_by_signal(getattr(end, "signal_number", 0))
        raise
    finally:
        restore(before)
    if code == ExitCode.INTERRUPTED:
        show_cursor()
    sys.exit(code)


def _run() -> int:
    from tumble.cli.commands import command_line_for, run_command_line
    from tumble.cli.debug_output import without_debug
    from tumble.cli.errors import print_notice, tell_error
    from tumble.cli.library_chatter import without_library_chatter
    from tumble.cli.standard_output import bound_width, checked_output, lasting_error, open_closed_streams
    from tumble.foundation.errors import ReaderGoneError, TumbleError
    from tumble.foundation.file_status import working_folder
    from tumble.foundation.files import files_of_command
    from tumble.foundation.translation import ENGLISH, language_of_environment, speak, speaking

    open_closed_streams()
    bound_width()
    words, is_debugged = without_debug(sys.argv[1:])
    command = command_line_for(words)
    heed_control_c_between_steps()
    # A language that the command chooses ends with it, for programs that call it.
    with speaking(ENGLISH), lasting_error(), DroppedTriedAgain():
        try:
            speak(language_of_environment())
            working_folder()
            with (
                files_of_command() as files,
                checked_output(),
                without_library_chatter(),
                _debugged(is_debugged, words),
            ):
                code = run_command_line(command, words)
                for remark in files.remarks():
                    print_notice(remark)
        except TumbleError as error:
            tell_error(error, words)
            code = ExitCode.USER_ERROR
        except ReaderGoneError:
            code = ExitCode.READER_GONE
    return code


def _debugged(wanted: bool, words: list[str]) -> AbstractContextManager[None]:
    """Show what the command does, where that is wanted; what that takes is imported then."""
    from contextlib import nullcontext

    from tumble.cli.debug_output import debugged

    return debugged(words) if wanted else nullcontext()
