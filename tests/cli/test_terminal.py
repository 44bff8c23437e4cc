"""Text of others on a terminal: names of columns, units and topics hold whatever someone put there."""

from __future__ import annotations

import io
import json
import re
import socket
import subprocess
import sys
import threading

import pytest
from rich.table import Table
from rich.text import Text

from log_fixtures import made_up, write_text
from ports import free_port
from tumble.cli.escaping_console import EscapingConsole
from tumble.foundation import clock
from turntable_sessions import typed

TITLE = "\x1b]0;owned\x07"
"""Sets the title of a terminal."""
OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
COMMAND = [sys.executable, "-c", "from tumble.cli.main import main; main()"]


def is_safe(text):
    return OBEYED.search(text) is None


@pytest.mark.parametrize("letters", [TITLE, "\x9d0;owned\x9c", "\u202egnp.exe", "\x1b[2J"])
def test_a_column_name_is_shown_and_not_obeyed(tmp_path, letters):
    path = write_text(tmp_path / "log.csv", made_up(500))
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([f"{head},odd{letters}name", *(f"{row},1" for row in rows)]) + "\n", newline="")
    for words in (("inspect",), ("inspect", "--json"), ("inspect", "--columns", f"ax=odd{letters}")):
        done = typed(*words, path)
        assert is_safe(done.out)
        assert is_safe(done.err)
    assert "odd\\" in done.err


def test_an_error_names_a_file_without_obeying_it(tmp_path):
    done = typed("inspect", tmp_path / f"no{TITLE}thing.csv")
    assert done.code == 2
    assert "no\\x1b]0;owned\\x07thing.csv" in done.err


def test_a_unit_of_a_live_stream_is_shown_and_not_obeyed(tmp_path, simulated_clock):
    port = free_port()
    over = threading.Event()

    def send():
        reading = {"ax": 0.0, "ay": 0.0, "az": 9.8, "gx": 0.0, "gy": 0.0, "gz": 0.0}
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for k in range(2000):
                if over.is_set():
                    return
                for unit in (f"imu{TITLE}", "other"):
                    line = json.dumps({"time": 0.01 * k, "unit": unit} | reading) + "\n"
                    sender.sendto(line.encode(), ("127.0.0.1", port))
                clock.sleep(0.01)

    sending = clock.thread(send)
    sending.start()
    done = typed("record", f"a=udp://127.0.0.1:{port}", "--duration", "1s", "-o", tmp_path / "session")
    over.set()
    clock.wait(sending)
    assert "\\x1b]0;owned" in done.out + done.err
    assert is_safe(done.out)
    assert is_safe(done.err)


def test_drawings_keep_their_colours_and_escape_their_text():
    drawn = io.StringIO()
    console = EscapingConsole(drawn, width=60)
    console._force_terminal, console._color_system = True, None
    table = Table("[bold]unit", "x")
    table.add_row(Text(f"a{TITLE}", "red"), "[link=http://x]y[/link]")
    console.print(table)
    assert is_safe(drawn.getvalue())
    assert "a\\x1b]0;" in drawn.getvalue()
    assert "[link=http://x]y" in drawn.getvalue()


def test_help_on_a_terminal_is_drawn_in_colour(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    commands = ("", "turntable", "simulate", "simulate spin")
    # typer reads FORCE_COLOR as it is imported.
    code = (
        "import contextlib, sys\nfrom tumble.cli.main import main\n"
        f"for words in {commands!r}:\n"
        "    sys.argv = ['tumble', *words.split(), '--help']\n"
        "    with contextlib.suppress(SystemExit): main()\n"
        "    print('END OF HELP')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    shown = done.stdout.split("END OF HELP\n")[:-1]
    assert len(shown) == len(commands)
    assert all("\x1b[" in each and "\\x1b" not in each for each in shown)
