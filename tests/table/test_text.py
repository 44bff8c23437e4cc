"""A table is commanded in the words of a profile, over a real socket and a serial line."""

from __future__ import annotations

import os
import pty
import socket
import tty
from contextlib import contextmanager, suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyvisa.rname import _SUBCLASSES

from table_fixtures import served
from tumble.foundation import clock
from tumble.foundation.errors import TableError
from tumble.tools.table import GuardedTable, open_table
from tumble.tools.table.profile import StateQuery, load_profile, pattern, shipped, written
from turntable_sessions import one_line, typed

pytestmark = pytest.mark.usefixtures("simulated_clock")


@contextmanager
def armed(address):
    with GuardedTable(open_table(address), armed=True) as table:
        yield table


def test_a_table_goes_to_angles_and_turns_at_rates_over_a_socket():
    with served("scpi") as (address, simulated), armed(address) as table:
        table.goto(np.radians([90.0, -45.0]))
        table.wait()
        assert np.allclose(np.degrees(table.position()), [90.0, -45.0], atol=1e-4)
        assert np.allclose(simulated.position(), table.position(), atol=1e-6)
        table.rate(np.radians([0.0, 36.0]))
        table.wait()
        before = simulated.position()[1]
        clock.sleep(0.05)
        assert simulated.position()[1] > before


def test_leaving_the_table_brings_it_to_rest():
    with served("scpi") as (address, simulated):
        with armed(address) as table:
            table.rate(np.radians([0.0, 36.0]))
        clock.sleep(1.0)
        before = simulated.position()
        clock.sleep(0.05)
        assert np.array_equal(before, simulated.position())


def test_a_table_that_ends_every_answer_with_a_prompt_turns_at_rates():
    with served("aerosmith-1270vs") as (address, simulated), armed(address) as table:
        assert np.isnan(table.position()).all()
        table.rate(np.radians([10.0]))
        table.wait()
        (_,), (rate,), _ = simulated.states(np.array([simulated._now()]))
        assert np.degrees(rate[0]) == pytest.approx(10.0)
        with pytest.raises(TableError, match="cannot say where it is"):
            table.goto(np.radians([10.0]))


def test_two_programs_at_one_table_are_refused_in_one_line():
    with served("scpi") as (address, _), armed(address):
        done = typed("table", "position", "--table", address)
    assert done.code == 2
    assert "no answer" in one_line(done.err.splitlines(keepends=True)[-1])


@contextmanager
def answering(*replies, profile):
    """Address of a table, and the lines it was sent; it answers by a function of the line, one a connection.

    It leaves at a line for which that gives None.
    """
    told = []

    def serve():
        for reply in replies:
            with accepted(server) as client, suppress(OSError):
                for line in lines_of(client):
                    told.append(line)
                    if (answer := reply(line)) is None:
                        break
                    client.sendall(answer.encode())

    with socket.create_server(("127.0.0.1", 0)) as server:
        server_thread = clock.thread(serve)
        server_thread.start()
        yield f"text:TCPIP::127.0.0.1::{server.getsockname()[1]}::SOCKET?profile={profile}", told
        clock.wait(server_thread)


def accepted(server):
    """A program that has connected."""
    clock.readable(server.fileno())
    return server.accept()[0]


def lines_of(client):
    """Lines that a program sends until it has left."""
    text = b""
    while clock.readable(client.fileno()) and (piece := client.recv(4096)):
        *lines, text = (text + piece).split(b"\n")
        yield from (line.decode().strip() for line in lines)


@pytest.mark.parametrize(
    ("reply", "problem"),
    [
        ("", "no answer to 'AXIS1:POS"),
        ("ERR 12\n", "refused 'AXIS1:POS"),
        ("north\n", "replied 'north' to 'AXIS1:POS?'"),
    ],
)
def test_silence_and_refusals_are_one_line_and_stop_the_table(reply, problem):
    def replies(line):
        return reply if "POS?" in line else "OK\n"

    with answering(replies, replies, profile="scpi") as (address, told):
        done = typed("table", "goto", "10,10", "--table", address, "--armed")
        typed("table", "stop", "--table", address)
    assert done.code == 2
    assert problem in one_line(done.err.splitlines(keepends=True)[-1])
    assert told[-4:] == 2 * ["AXIS1:STOP", "AXIS2:STOP"]


@pytest.mark.parametrize("answer", ["12.5\nOK\n", ""])
def test_all_axes_are_stopped_before_any_answer_is_awaited(answer):
    def replies(line):
        return "OK\n" if answer and line != "AXIS1:STOP" else answer

    with answering(replies, profile="scpi") as (address, told), open_table(address) as table:
        if answer:
            table.stop()
        else:
            with pytest.raises(TableError, match="no answer to 'AXIS1:STOP'"):
                table.stop()
        assert told == ["AXIS1:STOP", "AXIS2:STOP"]


def open_profile(name):
    from importlib import resources

    return (resources.files("tumble.tools.table") / "profiles" / f"{name}.yaml").read_text()


def test_a_lost_line_is_opened_again_to_send_the_stop():
    """The table closes the connection at the first question; over the next one it takes commands."""
    questions = iter(range(3))

    def leaving(line):
        return None if next(questions) == 2 else obedient(line)

    def obedient(line):
        return "0.0\n" if line.endswith("POS?") else "1\n" if "DONE" in line else "OK\n"

    with answering(leaving, obedient, profile="scpi") as (address, told):
        done = typed("table", "goto", "10,10", "--table", address, "--armed")
    assert done.code == 2
    problem = one_line(done.err.splitlines(keepends=True)[-1])
    assert "lost" in problem or "no answer" in problem
    assert "EMERGENCY" not in problem
    assert told[-2:] == ["AXIS1:STOP", "AXIS2:STOP"]


DIALECT = {
    'goto: "AXIS{axis}:POS {angle:5}"': 'goto: "AXIS{axis}:MOVE {angle:5} AT {rate:3} RAMP {acceleration:2}"',
    '  speed: "AXIS{axis}:VEL {rate}"\n': "",
    '  acceleration: "AXIS{axis}:ACC {acceleration}"\n': "",
    'settled: {send: "AXIS{axis}:DONE?", reply: "1"}': (
        'settled: {send: "AXIS{axis}:STATUS?", reply: "S {status}", '
        "bits_set: 0x06, bits_clear: 0x81, base: 16}"
    ),
}


def test_rates_within_goto_and_a_bit_mask_drive_a_table(tmp_path):
    text = open_profile("scpi")
    for ours, theirs in DIALECT.items():
        assert ours in text
        text = text.replace(ours, theirs)
    (tmp_path / "dialect.yaml").write_text(text)
    with served(str(tmp_path / "dialect.yaml")) as (address, simulated), armed(address) as table:
        before = simulated._now()
        took = table.goto(np.radians([90.0, -45.0]), np.radians([20.0, 30.0]), np.radians([50.0, 50.0]))
        rates = simulated.states(np.linspace(before, simulated._now() + took, 400))[1]
        table.wait()
        assert np.degrees(np.abs(rates).max(axis=0)) == pytest.approx([20.0, 30.0], rel=1e-6)
        assert np.allclose(np.degrees(table.position()), [90.0, -45.0], atol=1e-4)


@pytest.mark.parametrize(
    ("reply", "settled"),
    [
        ("S 06", True),
        ("S 7E", True),
        ("S 0x16", True),
        ("S #H46", True),
        ("S 02", False),
        ("S 86", False),
        ("S 07", False),
    ],
)
def test_bits_of_a_status_tell_whether_an_axis_has_settled(reply, settled):
    query = StateQuery(send="?", reply="S {status}", bits_set=0x06, bits_clear=0x81, base=16)
    assert query.is_settled(reply) is settled


def test_a_status_that_is_no_number_is_refused():
    query = StateQuery(send="?", reply="S {status}", bits_set=4)
    with pytest.raises(ValueError, match=r"expected 'S \{status\}'"):
        query.is_settled("busy")


def test_table_on_a_serial_line_excludes_other_programs():
    device, line = pty.openpty()
    tty.setraw(line)
    said = []

    def serve():
        while True:
            try:
                clock.readable(device)
                said.append(os.read(device, 64).decode())
                os.write(device, said[-1].strip().encode() + b"\r\n>\r\n")
            except OSError:
                return

    thread = clock.thread(serve)
    thread.start()
    address = f"text:ASRL{os.ttyname(line)}::INSTR?profile=aerosmith-1270vs"
    with armed(address) as table:
        table.rate(np.radians([-30.0]))
        with pytest.raises(TableError, match="cannot be opened"), armed(address):
            pass
    os.close(line)
    clock.wait(thread)
    os.close(device)
    assert [each.strip() for each in said] == ["SRV1", "ACL100.0", "JOG-30", "STO"]


@pytest.mark.parametrize("name", shipped())
def test_a_profile_that_nobody_tried_says_so_wherever_it_is_used(name):
    assert load_profile(name).tried is None
    assert "untested on hardware" in " ".join(open_table(f"text:TCPIP::x::1::SOCKET?profile={name}").remarks)
    done = typed("table", "list")
    assert done.code == 0
    assert "untested on hardware" in next(
        line for line in done.out.splitlines() if f"profile {name}:" in line
    )


@given(st.floats(-1e4, 1e4), st.integers(0, 6), st.sampled_from(["rate", "acceleration"]))
def test_a_rate_is_never_written_larger_than_it_is(value, digits, what):
    text = written(f"X {{{what}:{digits}}}", "1", **{what: value})
    found = float(pattern(f"X {{{what}}}").fullmatch(text)[what])
    assert abs(found) <= abs(value) * (1.0 + 1e-11)
    assert abs(found - value) <= 10.0**-digits * (1.0 + 1e-9) + 1e-11 * abs(value)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (("stop:", "halt:"), "commands.halt is not a known key"),
        (("  stop: ", "  # "), "commands.stop is missing"),
        (("{angle: deg,", "{angle: gon,"), "units.angle"),
        (("POS {angle:5}", "POS {rate}"), "has no {angle}"),
        (("STOP", "STOP {angle}"), "holds a field that is none of its own"),
        (("rate: 60.0", "rate: -60.0"), "axes.0.rate"),
        (('reply: "1"}', 'reply: "1", bits_set: 4}'), "need {status} in reply"),
        (('reply: "1"}', 'reply: "{status}"}'), "need {status} in reply"),
        (('reply: "1"}', 'reply: "{status}", bits_set: 4, bits_clear: 5}'), "both set and clear"),
        (('number: "2"', 'number: "2"\n  spin: 3'), "axes.1.spin"),
        (("  position: {send", "  where: {send"), "queries.where"),
        (("about: [0.0, 0.0, 1.0]", "about: [0.0, 0.0, 0.0]"), "no direction"),
        (("[-185.0, 185.0]", "[185.0, -185.0]"), "the lowest, then a higher"),
        (("name: inner", "name: outer"), "two axes are called"),
        (("table-profile/1", "poses/1"), "is a pose list"),
        (('"AXIS{axis}:STOP"', '" "'), "commands.stop is empty, which commands nothing"),
        (('"AXIS{axis}:STOP"', '"AXIS{axis}:HÄLT"'), "cannot be sent, as it is not ASCII"),
        (('number: "2"', 'number: "²"'), "cannot be sent, as it is not ASCII"),
        (('"AXIS{axis}:STOP"', '"AXIS{axis:1}:STOP"'), "states digits of an axis"),
        (("AXIS{axis}:POS {", "AXIS1:POS {"), "moves one of 2 axes"),
    ],
)
def test_a_mistake_in_a_profile_is_one_line(tmp_path, change, problem):
    before = open_profile("scpi")
    text = before.replace(*change)
    assert text != before
    (tmp_path / "ours.yaml").write_text(text)
    done = typed("table", "position", "--table", f"text:TCPIP::x::1::SOCKET?profile={tmp_path / 'ours.yaml'}")
    assert done.code == 2
    assert problem in one_line(done.err)
    assert "ours.yaml" in done.err


@pytest.mark.parametrize(
    ("address", "problem"),
    [
        ("clay:1", "no driver 'clay'"),
        ("simulated:four-axis", "no such table"),
        ("simulated?pace=2", "no setting 'pace'"),
        ("simulated?speed=0", "number above zero"),
        ("text:TCPIP::x::1::SOCKET", "in which words"),
        ("text:TCPIP::x::1::SOCKET?profile=nobodys", "no such profile"),
        ("text:TCPIP::127.0.0.1::1::SOCKET?profile=scpi", "line was lost"),
        ("text:NONSENSE?profile=scpi", "in which words"),
        ("text:ASRL/dev/no-such-line::INSTR?profile=aerosmith-1270vs", "cannot be opened"),
    ],
)
def test_an_address_of_no_table_is_one_line(address, problem):
    done = typed("table", "position", "--table", address)
    assert done.code == 2
    assert problem in one_line(done.err.splitlines(keepends=True)[-1])
    assert "Traceback" not in done.err


@pytest.mark.parametrize("kind", sorted(set(_SUBCLASSES) - {("TCPIP", "SOCKET"), ("ASRL", "INSTR")}))
def test_lines_that_are_no_plain_text_are_refused(kind):
    for parts in ("", "::x", "::127.0.0.1::hislip0,4880", "::0x1::0x2::x"):
        with pytest.raises(TableError, match="in which words"):
            open_table(f"text:{kind[0]}0{parts}::{kind[1]}?profile=scpi")


@pytest.mark.parametrize(
    "place", ["ASRLspy://x::INSTR", "ASRLhwgrep://.*::INSTR", "TCPIP::x::SOCKET", "ASRL::INSTR"]
)
def test_a_place_that_is_no_port_is_refused_before_it_is_opened(place):
    with pytest.raises(TableError, match="in which words"):
        open_table(f"text:{place}?profile=scpi")
