"""Finding a live source for what was typed; lines that cannot be opened or are lost; sources of others."""

from __future__ import annotations

import importlib
import json
import socket
import sys

import numpy as np
import pytest

from live_fixtures import first_samples, resting, samples_of, serial_device, text_lines
from ports import free_port
from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.foundation.secrets import without_secrets
from tumble.live import HEARTBEAT, open_source, parse_address, schemes
from tumble.live.address import host_and_port
from tumble.logs import ReadOptions

TABLE = resting(120)
pytestmark = pytest.mark.usefixtures("simulated_clock")


def refusal(text, options=None):
    """The line with which an address is refused, on opening or reading."""
    with pytest.raises(LogError) as caught, open_source(text, options) as source:
        next(iter(source))
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(without_secrets(text, is_message=True))
    return message


def test_an_address_is_taken_apart():
    address = parse_address("serial:/dev/ttyUSB0?baud=921600")
    assert (address.scheme, address.place, address.settings) == (
        "serial",
        "/dev/ttyUSB0",
        {"baud": "921600"},
    )
    assert parse_address("UDP://0.0.0.0:9000").scheme == "udp"
    assert parse_address("udp://0.0.0.0:9000").place == "0.0.0.0:9000"
    assert parse_address("replay:/data/drive.bag:/imu/data?speed=max").place == "/data/drive.bag:/imu/data"
    assert parse_address("replay:///data/drive.bag").place == "/data/drive.bag"


@pytest.mark.parametrize("text", ["", "serial", "serial:", "/dev/ttyUSB0", "serial:/dev/x?baud"])
def test_invalid_address_is_refused_with_an_example(text):
    with pytest.raises(LogError, match=r"serial:/dev/ttyUSB0\?baud=115200|KEY=VALUE"):
        open_source(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "canbus:0",
            "nothing reads live from 'canbus'; known: serial, udp, tcp, stdin, file, mavlink, iio, replay",
        ),
        ("serial:/dev/x?boud=9600", "no setting 'boud' for serial; known: baud"),
        ("serial:/dev/x?baud=fast", "baud=fast: give a number above zero"),
        ("udp://0.0.0.0", "expected HOST:PORT"),
        ("udp://0.0.0.0:99999", "expected HOST:PORT"),
        ("mavlink:udpin:0.0.0.0", "expected HOST:PORT"),
        ("mavlink:udpin:0.0.0.0:1?message=ATTITUDE", "message=ATTITUDE: give one of HIGHRES_IMU"),
        ("replay:/dev/null?speed=-1", "speed=-1: give a number above zero"),
    ],
)
def test_error_of_an_address_is_reported(text, words):
    assert words in refusal(text)


def test_a_log_that_does_not_exist_cannot_be_replayed():
    with pytest.raises(LogError, match="no such file"):
        open_source("replay:/no/such/log.csv")


def test_missing_port_is_reported():
    message = refusal("serial:/dev/no_such_port")
    assert "/dev/no_such_port cannot be opened: there is no such device; is it plugged in?" in message
    assert "is it a serial port?" in refusal("serial:/dev/null")


def test_port_in_use_is_reported():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        message = refusal(f"udp://127.0.0.1:{other.getsockname()[1]}")
    assert "cannot listen there" in message


def test_samples_come_over_a_serial_line():
    with serial_device() as device, open_source(f"serial:{device.path}?baud=921600") as source:
        device.write(text_lines(TABLE))
        assert np.array_equal(first_samples(source, len(TABLE)), TABLE)


def test_waiting_bytes_are_read_at_once_if_the_descriptor_is_ready():
    with serial_device() as device, open_source(f"serial:{device.path}") as source:
        assert len(source.read()) == 0
        assert not clock.readable(source.fileno(), 0.0)
        began = clock.now()
        device.write(text_lines(TABLE))
        found = np.empty(0)
        while len(found) < len(TABLE):
            assert clock.readable(source.fileno(), 5.0)
            chunk = source.read()
            assert not len(chunk) or began <= chunk.arrival <= clock.now()
            found = np.append(found, chunk.time)
    assert np.array_equal(found, TABLE[:, 0])


def test_a_silent_line_says_so_with_empty_chunks():
    with serial_device() as device, open_source(f"serial:{device.path}") as source:
        assert len(next(iter(source))) == 0
    assert HEARTBEAT < 1.0


def test_a_line_that_another_program_reads_is_refused():
    with serial_device() as device, open_source(f"serial:{device.path}"):
        assert "another program uses it" in refusal(f"serial:{device.path}")


def test_unplugged_device_is_reported_as_gone():
    with serial_device() as device, open_source(f"serial:{device.path}") as source:
        device.write(text_lines(TABLE))
        assert len(first_samples(source, 50)) == 50
        device.unplug()
        with pytest.raises(LogError, match="connection was lost: was the device unplugged"):
            first_samples(source, 1000)


def test_a_line_is_let_go_of_after_an_error():
    port = free_port()
    for _ in range(2):
        with pytest.raises(RuntimeError), open_source(f"udp://127.0.0.1:{port}"):
            raise RuntimeError


def datagrams(source, port, pieces, host="127.0.0.1", own_port=0):
    """Sends datagrams one by one, each read before the next is sent, so that none is lost."""
    chunks = iter(source)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.bind((host, own_port))
        for piece in pieces:
            sender.sendto(piece, ("127.0.0.1", port))
            chunk = next(chunks)
            yield np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope])


def test_samples_come_over_udp_as_lines_or_json():
    rows = [dict(zip(["t", "ax", "ay", "az", "gx", "gy", "gz"], row, strict=True)) for row in TABLE.tolist()]
    as_json = [json.dumps(row).encode() for row in rows]
    as_lines = text_lines(TABLE).splitlines()
    for pieces in (as_json, as_lines):
        port = free_port()
        with open_source(f"udp://127.0.0.1:{port}") as source:
            found = np.concatenate(list(datagrams(source, port, pieces)))
        assert np.array_equal(found, TABLE)


def test_first_of_two_senders_is_read_and_the_other_counted():
    port, own_port = free_port(), free_port()
    pieces = text_lines(TABLE).splitlines()
    with open_source(f"udp://127.0.0.1:{port}") as source:
        first = list(datagrams(source, port, pieces[:60], own_port=own_port))
        assert not len(np.concatenate(list(datagrams(source, port, pieces[:5], host="127.0.0.2"))))
        rest = list(datagrams(source, port, pieces[60:], own_port=own_port))
        assert np.array_equal(np.concatenate(first + rest), TABLE)
        assert "left out 5 datagrams not from 127.0.0.1" in source.remarks


@pytest.mark.parametrize(
    ("package", "text"), [("serial", "serial:/dev/null"), ("pymavlink", "mavlink:udpin:127.0.0.1:14999")]
)
def test_a_package_that_is_missing_is_named_with_how_to_get_it(monkeypatch, package, text):
    real = importlib.import_module

    def without(name, *rest):
        if name.split(".")[0] == package:
            raise ModuleNotFoundError(name=package)
        return real(name, *rest)

    monkeypatch.setattr("tumble.logs.optional.import_module", without)
    message = refusal(text)
    assert f"needs the Python package {package}, which is not installed" in message
    assert "python -m pip install 'tumble-imu[live]'" in message


def test_reading_lines_needs_no_package_of_another_source(monkeypatch):
    for name in ("serial", "pymavlink"):
        monkeypatch.setitem(sys.modules, name, None)
    with open_source(f"udp://127.0.0.1:{free_port()}") as source:
        assert len(next(iter(source))) == 0


BOARD = """
import numpy as np
from tumble.live import LiveChunk

class Board:
    name = "board"
    remarks = ("a board of the test",)
    gyroscope_unit_is_assumed = False

    def __init__(self, place, serial):
        self.place, self.serial = place, serial

    def __enter__(self):
        return self

    def __exit__(self, *error): ...

    def __iter__(self):
        force = np.array([[0.0, 0.0, 9.8]])
        yield LiveChunk(np.array([0.0]), force, np.zeros((1, 3)), moving=np.array([0.0]))

def open_board(address, options):
    return Board(address.place, options.serial)
"""


def test_another_package_brings_a_source_of_its_own(tmp_path, monkeypatch):
    (tmp_path / "board_of_the_test.py").write_text(BOARD)
    information = tmp_path / "board_of_the_test-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: board-of-the-test\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[tumble.live]\nboard = board_of_the_test:open_board\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert "board" in schemes()
    source = open_source("board:7", ReadOptions(serial="0815"))
    assert (source.place, source.serial) == ("7", "0815")
    assert np.array_equal(samples_of(source), [[0.0, 0.0, 0.0, 9.8, 0.0, 0.0, 0.0]])


@pytest.mark.parametrize("text", ["udp://:9000", "mavlink:udpin::14550"])
def test_without_an_address_only_this_machine_is_listened_to(text):
    assert host_and_port(parse_address(text), f":{text[-4:]}")[0] == "127.0.0.1"
    assert host_and_port(parse_address("udp://0.0.0.0:9000"), "0.0.0.0:9000")[0] == "0.0.0.0"


@pytest.mark.parametrize("kind", ["tcp://", "udp://", "foxglove://", "mavlink:tcp:"])
@pytest.mark.parametrize("host", ["u:hunter2@127.0.0.1", "host:1", "a b", "[::1", "fe80::x", "a@b"])
def test_a_host_that_is_none_is_one_line_without_a_secret(kind, host):
    with pytest.raises(LogError) as caught:
        host_and_port(parse_address(f"{kind}{host}:9000/imu"), f"{host}:9000")
    assert "expected HOST:PORT" in str(caught.value)
    assert "hunter2" not in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("host", ["::1", "[::1]", "fe80::1%eth0", "localhost", "192.168.1.7", "bank-2.local"])
def test_a_host_is_a_name_or_an_address(host):
    found = host_and_port(parse_address(f"tcp://{host}:9000"), f"{host}:9000")
    assert found == (host.strip("[]"), 9000)


def test_selected_sender_is_read_and_the_others_are_counted():
    port = free_port()
    pieces = text_lines(TABLE).splitlines()
    with open_source(f"udp://:{port}", sender="127.0.0.2") as source:
        assert not len(np.concatenate(list(datagrams(source, port, pieces[:5]))))
        found = np.concatenate(list(datagrams(source, port, pieces, host="127.0.0.2")))
        assert np.array_equal(found, TABLE)
        assert "left out 5 datagrams not from 127.0.0.2" in source.remarks


def test_a_sender_that_is_no_host_or_of_no_network_is_refused():
    with (
        pytest.raises(LogError, match=r"no host 'nobody\.invalid' to listen to"),
        open_source(f"udp://:{free_port()}", sender="nobody.invalid"),
    ):
        pass
    with pytest.raises(LogError, match="no setting 'from' for serial"):
        open_source("serial:/dev/ttyUSB0", sender="127.0.0.1")
