"""Lines and sockets of browsers, byte by byte: nothing on them is read without end, whoever sends it."""

from __future__ import annotations

import asyncio
import base64
from types import SimpleNamespace

import pytest
from nicegui import core
from uvicorn import Config
from uvicorn.server import ServerState

from tumble.bench import messages
from tumble.bench.browser_socket import BrowserSocket
from tumble.bench.line import PATIENCE, PIECE, BrowserLine, Lines

MOST_READ = 1 << 20
"""Bytes after which an attack has shown that nobody ends it."""
CHUNK = 1 << 18
"""Bytes that a transport reads at once."""
HEAD = b"GET / HTTP/1.1\r\nHost: bench\r\n"
ENDLESS = {
    "headers": (HEAD, b"a:b\r\n"),
    "parts of a header": (HEAD + b"a:b\r\n", b" c\r\n"),
    "a value": (HEAD + b"a: ", b"x"),
    "blanks": (HEAD + b"a:", b" "),
    "a name": (HEAD, b"x"),
    "an address": (b"GET /", b"x"),
    "a method": (b"", b"X"),
    "empty lines": (b"", b"\r\n"),
    "parts of a body": (HEAD.replace(b"GET", b"POST") + b"Transfer-Encoding: chunked\r\n\r\n", b"1\r\na\r\n"),
    "requests": (b"", HEAD + b"\r\n"),
}


class Loop:
    """Loop of a line, whose time passes only by `wait`."""

    def __init__(self):
        self.now, self._calls = 0.0, []

    def time(self):
        return self.now

    def create_task(self, *given, **named):
        return asyncio.get_running_loop().create_task(*given, **named)

    def call_later(self, delay, call, *given):
        handle = SimpleNamespace(at=self.now + delay, call=lambda: call(*given), is_cancelled=False)
        handle.cancel = lambda: setattr(handle, "is_cancelled", True)
        self._calls.append(handle)
        return handle

    def wait(self, seconds):
        self.now += seconds
        due = [each for each in self._calls if each.at <= self.now]
        self._calls = [each for each in self._calls if each.at > self.now]
        for each in due:
            if not each.is_cancelled:
                each.call()


class Transport(asyncio.Transport):
    """End of a line in the server."""

    def __init__(self):
        super().__init__()
        self.sent, self.is_over, self.is_paused, self.protocol = b"", False, False, None

    def get_protocol(self):
        return self.protocol

    def set_protocol(self, protocol):
        self.protocol = protocol

    def write(self, data):
        self.sent += data

    def is_closing(self):
        return self.is_over

    def close(self):
        self.is_over = True

    abort = close

    def pause_reading(self):
        self.is_paused = True

    def resume_reading(self):
        self.is_paused = False


class Browser:
    """The other end of a line."""

    def __init__(self, application):
        self.loop, self.transport = Loop(), Transport()
        config = Config(application, ws=BrowserSocket, log_config=None, ws_per_message_deflate=False)
        config.load()
        lines = Lines((), lambda _key: False)
        line = BrowserLine(lines, config=config, server_state=ServerState(), app_state={}, _loop=self.loop)
        self.transport.protocol = line
        line.connection_made(self.transport)

    async def send(self, data):
        """Sends what the server reads at once, and lets it work."""
        if not self.transport.is_over:
            self.transport.protocol.data_received(data)
        for _ in range(20):
            await asyncio.sleep(0)

    async def send_without_end(self, first, more):
        """Sends until the line is closed, or no more is read; returns how many bytes were read."""
        read, chunk = len(first), more * (CHUNK // len(more))
        await self.send(first)
        while not self.transport.is_over and not self.transport.is_paused and read < MOST_READ:
            await self.send(chunk)
            read += len(chunk)
        return read


async def answer(_scope, _receive, send):
    """Answers at once, whatever is asked."""
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})


@pytest.mark.parametrize("is_first", [True, False])
@pytest.mark.parametrize("kind", ENDLESS)
def test_no_part_of_a_request_is_read_without_end(kind, is_first):
    async def attack():
        browser = Browser(answer)
        if not is_first:
            await browser.send(HEAD + b"\r\n")
            assert browser.transport.sent.endswith(b"ok")
        read = await browser.send_without_end(*ENDLESS[kind])
        assert browser.transport.is_over
        assert read < MOST_READ

    asyncio.run(attack())


@pytest.mark.parametrize("is_first", [True, False])
@pytest.mark.parametrize("kind", ["", *ENDLESS])
def test_each_head_has_to_come_soon(kind, is_first):
    async def attack():
        browser = Browser(answer)
        if not is_first:
            await browser.send(HEAD + b"\r\n")
        first, more = ENDLESS.get(kind, (b"", b""))
        await browser.send(first)
        for letter in more[:1] * int(2 * PATIENCE):
            browser.loop.wait(1.0)
            await browser.send(bytes([letter]))
        browser.loop.wait(0.0 if kind else PATIENCE)
        assert browser.transport.is_over

    asyncio.run(attack())


def test_requests_that_are_served_have_time():
    async def ask():
        ends = asyncio.Event()

        async def slow(scope, receive, send):
            await ends.wait()
            await answer(scope, receive, send)

        browser = Browser(slow)
        await browser.send(HEAD + b"Cookie: " + b"x" * 40_000 + b"\r\n\r\n")
        browser.loop.wait(10.0 * PATIENCE)
        assert not browser.transport.is_over
        await browser.send(HEAD + b"\r\n")  # the next one, at the last byte of an answer
        ends.set()
        await browser.send(b"")
        assert browser.transport.sent.count(b"ok") == 2
        for _ in range(20):
            browser.loop.wait(0.5 * PATIENCE)
            await browser.send(HEAD.replace(b"GET", b"POST") + b"Content-Length: 9000\r\n\r\n")
            await browser.send(b"x" * 9000)
        assert browser.transport.sent.count(b"ok") == 22
        assert not browser.transport.is_over

    asyncio.run(ask())


def frame(kind, content, *, is_last=True):
    """Returns a frame as browsers send it (RFC 6455, section 5.2), masked with zeros."""
    return bytes([(is_last << 7) | kind, 0x80 | len(content)]) + bytes(4) + content


TEXT, BYTES, PING, PONG = 1, 2, 9, 10
BESIDE = {
    "pings": (b"", frame(PING, b"a" * 125)),
    "pongs": (b"", frame(PONG, b"")),
    "empty parts": (frame(TEXT, b"4", is_last=False), frame(0, b"", is_last=False)),
    "short parts": (frame(TEXT, b"4", is_last=False), frame(0, b"x", is_last=False)),
    "parts of bytes": (frame(BYTES, b"4", is_last=False), frame(0, b"", is_last=False)),
    "pings between parts": (
        frame(TEXT, b"4", is_last=False),
        frame(PING, b"") + frame(0, b"", is_last=False),
    ),
}


async def connected(application):
    """Opens a socket."""
    browser = Browser(application)
    key = base64.b64encode(bytes(16))
    upgrade = b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
    await browser.send(HEAD + upgrade + key + b"\r\n\r\n")
    assert browser.transport.sent.startswith(b"HTTP/1.1 101")
    return browser


@pytest.mark.parametrize("kind", BESIDE)
def test_frames_that_are_no_message_end_their_socket(kind):
    async def looking(_scope, receive, send):
        await receive()
        await send({"type": "websocket.accept"})
        while (await receive())["type"] != "websocket.disconnect":
            """Takes all that comes."""

    async def attack():
        browser = await connected(looking)
        assert await browser.send_without_end(*BESIDE[kind]) < MOST_READ
        assert browser.transport.is_over

    asyncio.run(attack())


def test_messages_wait_unread_until_they_are_taken():
    texts, turn = [], asyncio.Event

    async def slow(_scope, receive, send):
        await receive()
        await send({"type": "websocket.accept"})
        while (message := await receive())["type"] != "websocket.disconnect":
            texts.append(message["text"])
            await turn.wait()

    async def attack():
        nonlocal turn
        turn = asyncio.Event()
        browser = await connected(slow)
        sent = [f"3{number}" for number in range(20_000)]
        frames = b"".join(frame(TEXT, each.encode()) + frame(PONG, b"") for each in sent)
        await browser.send(frames)
        assert browser.transport.protocol.queue.qsize() < PIECE
        assert texts == sent[:1]
        turn.set()
        while len(texts) < len(sent):
            await asyncio.sleep(0)
        assert texts == sent
        assert not browser.transport.is_paused
        large = "x" * 120
        await browser.send(
            frame(TEXT, b"", is_last=False)
            + frame(0, large.encode(), is_last=False) * 20
            + frame(0, large.encode())
        )
        assert texts[-1] == large * 21
        assert not browser.transport.is_over

    asyncio.run(attack())


@pytest.mark.parametrize(
    "packets",
    [('59999999-["event",{"client_id":"a"}]', b"a"), ("69999999-1[]", b"a"), ("51-[]", b"2[]"), ("5[]",)],
)
def test_messages_with_attachments_are_refused(monkeypatch, packets):
    monkeypatch.setattr(core.sio, "handlers", {"/": {}})
    monkeypatch.setattr(core.sio, "packet_class", core.sio.packet_class)
    monkeypatch.setattr(core.sio.manager, "sid_from_eio_sid", lambda *_: "sid")
    monkeypatch.setattr(messages, "_LOGGERS", ())
    messages.guard_messages(messages.Dropped())
    for each in packets:
        with pytest.raises(ValueError, match="attachment"):
            asyncio.run(core.sio._handle_eio_message("line", each))
        assert "line" not in core.sio._binary_packet
    plain = core.sio.packet_class(encoded_packet='217["event",{"a":"1-2"}]')
    assert (plain.packet_type, plain.id, plain.data) == (2, 17, ["event", {"a": "1-2"}])
