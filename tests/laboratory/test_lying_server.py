"""A server that is no registry's, or is stuck: whatever it answers ends in one line, and in time."""

from __future__ import annotations

import random
import socket
import struct
import threading
from contextlib import contextmanager, suppress
from itertools import chain, repeat

import pytest

from repetitions import drawn_seed, repetitions
from tumble.laboratory import database
from turntable_sessions import one_line, typed

NO_TLS, READY = b"N", b"I"
TLS_CODES = (80877103, 80877104)
"""Codes with which a client asks for a line with TLS, and with GSS."""
INTEGER, TEXT = 23, 25
"""Numbers of types."""


def message(kind, content=b""):
    """Returns a message of PostgreSQL's protocol, version 3."""
    return kind + struct.pack("!I", len(content) + 4) + content


def row(kind, value):
    """Returns the answer to a query: one column of a type, one row, whatever its value."""
    column = struct.pack("!H", 1) + b"a\0" + struct.pack("!IHIhih", 0, 0, kind, -1, -1, 0)
    return (
        message(b"T", column)
        + message(b"D", struct.pack("!Hi", 1, len(value)) + value)
        + message(b"C", b"SELECT 1\0")
        + message(b"Z", READY)
    )


def drawn_answer(chance):
    """Draws what the server answers to each statement; empty for nothing."""
    value = chance.choice([b"", b"abc", b"9" * 5000, chance.randbytes(20), b"\x1b[31m"])
    refusal = message(b"E", b"SERROR\0CXX000\0M" + value.replace(b"\0", b"") + b"\0\0") + message(b"Z", READY)
    lost = message(b"N", b"SNOTICE\0C00000\0Mx\0\0")
    return chance.choice([b"", row(INTEGER, value), row(TEXT, value), refusal, lost, chance.randbytes(40)])


def received(line):
    """Returns the kind of the next message of a client."""
    kind = line.recv(1)
    if kind:
        line.recv(struct.unpack("!I", line.recv(4, socket.MSG_WAITALL))[0] - 4, socket.MSG_WAITALL)
    return kind


def serve(line, answer):
    """Lets a client in, whoever it is, and answers each statement the same, piece by piece."""
    with line, suppress(OSError, struct.error):
        while True:
            content = line.recv(struct.unpack("!I", line.recv(4, socket.MSG_WAITALL))[0] - 4)
            if struct.unpack("!I", content[:4])[0] not in TLS_CODES:
                break
            line.sendall(NO_TLS)
        line.sendall(message(b"R", bytes(4)))
        line.sendall(
            message(b"S", b"client_encoding\0UTF8\0") + message(b"S", b"server_version\0" + b"15.0\0")
        )
        line.sendall(message(b"K", bytes(8)) + message(b"Z", READY))
        while kind := received(line):
            if kind == b"P":
                line.sendall(message(b"1"))
            elif kind in (b"Q", b"S"):
                line.sendall(message(b"2") if kind == b"S" else b"")
                for piece in answer:
                    line.sendall(piece)


@contextmanager
def serving(answer):
    """Serves at a port, which it gives, until the block ends."""
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def accept():
            with suppress(OSError):
                while True:
                    threading.Thread(target=serve, args=(listening.accept()[0], answer), daemon=True).start()

        threading.Thread(target=accept, daemon=True).start()
        yield listening.getsockname()[1]
        listening.shutdown(socket.SHUT_RDWR)


def test_any_answer_of_a_server_is_one_line_in_time(monkeypatch):
    monkeypatch.setattr(database, "ANSWERING", 0.2)
    chance = random.Random(drawn_seed())
    for _ in range(repetitions(80)):
        answer = drawn_answer(chance)
        with serving([answer]) as port:
            done = typed("registry", "list", "--registry", f"postgresql://u:SECRET@127.0.0.1:{port}/lab")
        line = one_line(done.err)
        assert done.code == 2, answer
        assert "SECRET" not in line
        assert line.isprintable() or line.rstrip("\n").isprintable(), answer


@pytest.mark.parametrize("answer", [b"", row(INTEGER, b"abc")])
def test_a_silent_and_a_lying_server_are_told_apart(monkeypatch, answer):
    monkeypatch.setattr(database, "ANSWERING", 0.2)
    with serving([answer]) as port:
        done = typed("registry", "list", "--registry", f"postgresql://u@127.0.0.1:{port}/lab")
    assert ("sent what is no answer" in done.err) is bool(answer), done.err
    assert ("sends no whole answer within 0.2 s" in done.err) is not bool(answer), done.err


def test_rows_without_end_are_given_up(monkeypatch):
    monkeypatch.setattr(database, "LARGEST_ANSWER", 64 << 20)
    column = struct.pack("!H", 1) + b"a\0" + struct.pack("!IHIhih", 0, 0, TEXT, -1, -1, 0)
    field = message(b"D", struct.pack("!Hi", 1, 1 << 16) + bytes(b"x" * (1 << 16)))
    with serving(chain([message(b"T", column)], repeat(field))) as port:
        done = typed("registry", "list", "--registry", f"postgresql://u@127.0.0.1:{port}/lab")
    assert done.code == 2
    assert "sends an answer of more than 64 MiB" in one_line(done.err)
