"""`tumble redundancy --live`: the monitor beside running sensors, its events and output at once."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from tumble.cli.live_screen import print_listening
from tumble.cli.output import folder_named_after
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.screen import print_json_line
from tumble.foundation.errors import ProcedureError

if TYPE_CHECKING:
    from tumble.cli.read_options import ReadingOptionsOfSeveral
    from tumble.cli.shared_options import LongVoiceOptions
    from tumble.live import LiveSet
    from tumble.logs.session import SessionClock
    from tumble.procedures.redundancy.aiding_live import LiveAiding
    from tumble.procedures.redundancy.command_options import (
        AidingOptions,
        RedundancyLiveOptions,
        SetOptions,
        SettingsOptions,
    )
    from tumble.procedures.redundancy.live import LiveRedundancy, RedundancyStep
    from tumble.procedures.redundancy.monitor import RedundancyMonitor
    from tumble.procedures.redundancy.result import RedundancyResult
    from tumble.tools.record.writer import SessionWriter

ShowRedundancy: TypeAlias = "Callable[[RedundancyStep], None]"
"""Receives every step."""
REPLAY = "replay"
"""Scheme of logs that are replayed."""
PRIMARY = "primary"
"""Name of the unit that is the primary, unless another is named."""


def watch_sources(
    words: Sequence[str],
    primary: str | None,
    output: Path | None,
    stated: SettingsOptions,
    known: SetOptions,
    aiding: AidingOptions,
    asked: RedundancyLiveOptions,
    voice: LongVoiceOptions,
    reading: ReadingOptionsOfSeveral,
) -> RedundancyResult:
    """Watch units, `NAME=SOURCE`, until they end, for a duration, or until a signal; write the results.

    Raises `TumbleError`, in one line, where nothing can be watched; nothing is written then. Ends with
    `NOT_ALL_WELL`, once all is written, where many samples are missing.
    """
    from tumble.foundation.ending import stopped_by_signals
    from tumble.foundation.file_names import EVENTS, REDUNDANCY_PAGE
    from tumble.foundation.files import PAGE, check_output, no_empty_folder, prepare_folder
    from tumble.live import open_set
    from tumble.live.naming import parse_named_sources
    from tumble.live.outputs import OF_A_SET, STDOUT, parse_output
    from tumble.logs.writer import Facts
    from tumble.procedures.redundancy.aiding_log import AidingLog
    from tumble.procedures.redundancy.command_files import EVENTS_KIND
    from tumble.procedures.redundancy.live import LiveRedundancy
    from tumble.procedures.redundancy.monitor import RedundancyMonitor
    from tumble.tools.record.command_screen import is_whole

    typed = {name: address.text for name, address in parse_named_sources(words).items()}
    read_options = reading.read_each(list(typed))
    settings, seconds = stated.stated(), asked.seconds()
    names = _primary_first(list(typed), primary)
    if asked.to == STDOUT and voice.as_json:
        raise ProcedureError("--to stdout and --json both want standard output; send the output elsewhere")
    going_to = None if asked.to is None else parse_output(asked.to)
    units = open_set(
        [f"{name}={typed[name]}" for name in names], read_options, sender=asked.sender, keep_going=True
    )
    serial_of = {name: options.serial for name, options in read_options.items()}
    serials = {
        name: serial_of.get(name, "") or getattr(source, "serial", "")
        for name, source in units.sources.items()
    }
    monitor = RedundancyMonitor(names[0], names[1:], serials=serials, **settings, **known.stated())
    measurements = _measurements(
        aiding.aiding or (), typed.values(), monitor, units, aiding.aiding_sigma, asked.sender
    )
    folder = output or folder_named_after("redundancy")
    with no_empty_folder(folder), ExitStack() as opened:
        prepare_folder(folder)
        check_output(folder / EVENTS, EVENTS_KIND)
        check_output(folder / REDUNDANCY_PAGE, PAGE)
        writer = None if going_to is None else opened.enter_context(going_to.open(Facts(further=OF_A_SET)))
        session = _session(opened, units, asked.record, typed, serials)
        heard = asked.record is not None and aiding.aiding
        live = LiveRedundancy(
            units,
            monitor,
            output=writer,
            session=session,
            measurements=measurements,
            aiding_log=AidingLog(asked.record, monitor.units) if asked.record and heard else None,
        )
        with stopped_by_signals(live.stop), _shown(names, asked, voice) as show:
            for step in live.steps(seconds):
                show(step)
    result = live.result("as published" if stated.as_published else "")
    _tell(live, result, folder, voice, to_stdout=asked.to == STDOUT)
    end_unless(is_whole(units.losses))
    return result


def _tell(
    live: LiveRedundancy, result: RedundancyResult, folder: Path, voice: LongVoiceOptions, *, to_stdout: bool
) -> None:
    """Write and show the result; where samples go to standard output, nothing else does."""
    from tumble.procedures.redundancy import summary

    files = write_results(result, folder)
    draw = summary.long_summary if voice.verbose else summary.screen_summary
    with redirect_stdout(sys.stderr if to_stdout else sys.stdout):
        show_results(summary, result, files, voice, well=result.all_well, live=True, draw=draw)
        if not (voice.as_json or voice.quiet):
            _print_delays(live)


def _measurements(
    words: Sequence[str],
    typed: Iterable[str],
    monitor: RedundancyMonitor,
    units: LiveSet,
    sigma: float | None,
    sender: str | None,
) -> list[LiveAiding]:
    """Opens live aiding measurements; a log of one goes to the monitor at once.

    Raises `LogError` where a source does not exist, `ProcedureError` where units are replayed and it is not.
    """
    from tumble.live import parse_address
    from tumble.logs.aiding import Aiding
    from tumble.procedures.redundancy.aiding_live import LiveAiding

    found = []
    lines = {parse_address(source).line for source in typed}
    for word in words:
        address = parse_address(word)
        if units.is_replay != (address.scheme == REPLAY):
            wanted = "replay:FILE, of the clock of the logs" if units.is_replay else "udp://:9200 or the like"
            heard = "replayed" if units.is_replay else "heard as they are now"
            raise ProcedureError(f"--aiding {word}: units are {heard}; give {wanted}")
        if address.line in lines:
            raise ProcedureError(f"--aiding {word}: is the source of a unit; give it a line of its own")
        if units.is_replay:
            for each in Aiding.load(address.place, sigma):
                monitor.aiding(each)
        else:
            names = monitor.units
            found.append(LiveAiding(word, names, sigma=sigma, sender=sender, clock_rate=units.clock_rate))
    return found


def _session(
    opened: ExitStack,
    units: LiveSet,
    folder: Path | None,
    typed: Mapping[str, str],
    serials: Mapping[str, str],
) -> SessionWriter | None:
    """Begins to record into a folder, if there is one."""
    if folder is None:
        return None
    from tumble.tools.record.writer import RecordedUnit, SessionWriter

    described = {
        name: RecordedUnit(source, typed[name], serials[name]) for name, source in units.sources.items()
    }
    clock: SessionClock = "log" if units.is_replay else "host"
    return opened.enter_context(SessionWriter(folder, described, clock, clock_rate=units.clock_rate))


def _primary_first(names: list[str], primary: str | None) -> list[str]:
    wanted = primary or PRIMARY
    if wanted not in names:
        raise ProcedureError(
            f"{wanted}: is none of {', '.join(names)}; name the primary, as {PRIMARY}=SOURCE "
            "or with --primary NAME"
        )
    return [wanted, *(name for name in names if name != wanted)]


@contextmanager
def _shown(
    names: Sequence[str], asked: RedundancyLiveOptions, voice: LongVoiceOptions
) -> Iterator[ShowRedundancy]:
    """Give what shows each step while the block runs: JSON on standard output, else on standard error."""
    if voice.as_json:
        yield _with_listening(_print_json, lambda: print_listening(names))
    elif voice.quiet:
        yield lambda _: None
    elif asked.dashboard:
        with _dashboard(names) as show:
            yield show
    else:
        from tumble.procedures.redundancy.command_dashboard import event_line
        from tumble.procedures.redundancy.result import RedundancyEvent

        def show_line(step: RedundancyStep) -> None:
            if isinstance(step, RedundancyEvent):
                print(event_line(step), file=sys.stderr, flush=True)

        def say_listening() -> None:
            print(f"Watching {', '.join(names)}. Ctrl-C ends.", file=sys.stderr, flush=True)

        yield _with_listening(show_line, say_listening)


def _with_listening(show: ShowRedundancy, say_listening: Callable[[], None]) -> ShowRedundancy:
    """Returns a function that shows steps, and reports before the first that all lines are open."""
    is_said = False

    def shown(step: RedundancyStep) -> None:
        nonlocal is_said
        if not is_said:
            is_said = True
            say_listening()
        show(step)

    return shown


@contextmanager
def _dashboard(names: Sequence[str]) -> Iterator[ShowRedundancy]:
    from rich.live import Live

    from tumble.cli.screen import message_console
    from tumble.procedures.redundancy.command_dashboard import Dashboard

    board = Dashboard(names)
    with Live(board.rendered(), console=message_console(), auto_refresh=False) as screen:

        def show(step: RedundancyStep) -> None:
            board.take(step)
            screen.update(board.rendered(), refresh=True)

        yield show


def _print_json(step: RedundancyStep) -> None:
    from tumble.procedures.redundancy.command_files import event_content
    from tumble.procedures.redundancy.result import RedundancyEvent

    if isinstance(step, RedundancyEvent):
        print_json_line(event_content(step))


def _print_delays(live: LiveRedundancy) -> None:
    if live.delays.largest:
        half, most = (f"{1e3 * live.delays.quantile(share):.2g} ms" for share in (0.5, 0.99))
        print(f"Output {half} after samples came (99 % within {most})")
