"""Access to the bench: tokens, origins, floods, markup in names, viewers, and one operator at a time."""

from __future__ import annotations

import asyncio
import http.client
import itertools
import selectors
import socket
from contextlib import suppress
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from bench_pages import chromium, opened, serving, waited
from patience import PATIENCE
from repetitions import SOAK
from tumble.bench.access import HOLDS_FOR, Access
from tumble.bench.gate import MOST_SOCKETS_OF_ONE
from tumble.bench.line import MOST_LINES_OF_ONE
from tumble.foundation import clock

CLOSING = 8
"""Opcode of a frame that ends a socket."""
MARKUP = "<img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A bench at an address that needs a token; it is this computer all the same."""
    with serving(tmp_path_factory.mktemp("bench"), "--host", "127.0.0.2") as found:
        yield found


def asked(bench, path="/", method="GET", body=None, **headers):
    """Asks once; returns status, headers and text."""
    place = urlsplit(bench.site)
    line = http.client.HTTPConnection(place.hostname, place.port, timeout=PATIENCE)
    try:
        line.request(method, path, body, {name.replace("_", "-"): text for name, text in headers.items()})
        answer = line.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read().decode("utf-8", "replace")
    finally:
        line.close()


def cookie_of(bench, which="operator"):
    """Enters, and returns the cookie."""
    path = bench.served[which].removeprefix(bench.site)
    status, headers, _ = asked(bench, path)
    assert status == 200
    assert "HttpOnly" in headers["set-cookie"]
    assert "SameSite=Strict" in headers["set-cookie"]
    return headers["set-cookie"].partition(";")[0]


def handshake(host, cookie="", origin=None):
    """Writes the request for a socket."""
    words = [
        "GET /_nicegui_ws/socket.io/?EIO=4&transport=websocket HTTP/1.1",
        f"Host: {host}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Version: 13",
        *([f"Cookie: {cookie}"] if cookie else []),
        *([f"Origin: {origin}"] if origin else []),
    ]
    return ("\r\n".join(words) + "\r\n\r\n").encode()


def socket_status(bench, cookie="", origin=None, host=None):
    """Asks for a socket; returns the status of the answer, 101 where it is opened, and the socket."""
    place = urlsplit(bench.site)
    line = socket.create_connection((place.hostname, place.port), timeout=PATIENCE)
    line.sendall(handshake(host or place.netloc, cookie, origin))
    return int(line.recv(1024).split()[1]), line


async def read_frame(reader):
    """Reads a frame of a server (RFC 6455, section 5.2); returns its opcode."""
    first, length = await reader.readexactly(2)
    if length >= 126:
        length = int.from_bytes(await reader.readexactly(2 if length == 126 else 8), "big")
    await reader.readexactly(length)
    return first & 15


def serves(bench, cookie):
    return asked(bench, "/", Cookie=cookie)[0] == 200


def test_nobody_enters_without_the_token(bench):
    for path in (
        "/",
        "/run",
        "/bench/bench.js",
        "/?token=wrong",
        "/runs/x/y.html",
        "/?token=",
        "/_nicegui/x",
    ):
        status, headers, text = asked(bench, path)
        assert (status, "set-cookie" in headers) == (403, False), path
        assert "token" in text
    assert asked(bench, "/", Cookie="tumble_bench=wrong")[0] == 403
    assert socket_status(bench, "", bench.site)[0] != 101
    cookie = cookie_of(bench)
    assert asked(bench, "/", Cookie=cookie)[0] == 200
    assert asked(bench, "/bench/bench.js", Cookie=cookie)[0] == 200


def test_foreign_pages_reach_nothing(bench):
    cookie = cookie_of(bench)
    for origin in ("http://evil.example", "null", bench.site.replace("http:", "https:"), f"{bench.site}1"):
        assert asked(bench, "/", "POST", Cookie=cookie, Origin=origin)[0] == 403
        assert asked(bench, "/", Cookie=cookie, Origin=origin)[0] == 403
        assert socket_status(bench, cookie, origin)[0] != 101
    assert socket_status(bench, cookie)[0] != 101
    status, headers, _ = asked(bench, "/", Cookie=cookie)
    assert status == 200
    assert not [name for name in headers if name.lower().startswith("access-control")]
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "'unsafe-inline'" not in policy.partition("script-src")[2].partition(";")[0]


def test_ways_that_other_sites_began_leave_the_cookie(bench):
    for which in ("operator", "viewer"):
        path = bench.served[which].removeprefix(bench.site)
        status, headers, text = asked(bench, path, Sec_Fetch_Site="cross-site")
        assert (status, "set-cookie" in headers) == (200, False)
        assert f'content="0;url={path}"' in text
        assert "frame-ancestors 'none'" in headers["content-security-policy"]
    operator = cookie_of(bench)
    led = asked(bench, bench.served["viewer"].removeprefix(bench.site), Cookie=operator)
    assert "set-cookie" not in led[1]


def test_a_viewer_rises_by_the_link_of_operators(bench):
    path = bench.served["operator"].removeprefix(bench.site)
    status, headers, _ = asked(bench, path, Cookie=cookie_of(bench, "viewer"))
    assert (status, "set-cookie" in headers) == (200, True)


def test_names_of_hosts_that_lead_here_are_refused(tmp_path):
    with serving(tmp_path) as local:
        assert asked(local, "/")[0] == 200
        assert asked(local, "/", Host="evil.example")[0] == 403
        assert socket_status(local, origin="http://evil.example", host="evil.example")[0] != 101


def test_large_messages_and_bodies_are_refused(bench):
    cookie = cookie_of(bench)
    assert asked(bench, "/", "POST", b"x" * 10_000_000, Cookie=cookie, Origin=bench.site)[0] == 413
    assert asked(bench, "/", "PUT", b"", Cookie=cookie)[0] == 403
    address = bench.site.replace("http", "ws") + "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    with connect(address, additional_headers={"Cookie": cookie}, origin=bench.site) as line:
        line.recv()
        with pytest.raises((ConnectionClosed, OSError)):  # noqa: PT012 - sent in parts, closed at any of them
            line.send("4" + "x" * 10_000_000)
            while True:
                line.recv(timeout=PATIENCE)
    assert serves(bench, cookie)


def test_many_sockets_are_refused_and_the_bench_goes_on(bench):
    cookie = cookie_of(bench)

    async def flood(count):
        """Returns the most sockets that were open at once: the server drops those that stay silent."""
        gate = asyncio.Semaphore(100)
        place = urlsplit(bench.site)
        open_now, most = set(), 0

        async def until_closed(reader, writer):
            with suppress(OSError, asyncio.IncompleteReadError):
                await reader.readuntil(b"\r\n\r\n")
                while (await read_frame(reader)) != CLOSING:
                    pass
            open_now.discard(writer)
            writer.close()

        async def one():
            nonlocal most
            async with gate:
                try:
                    reader, writer = await asyncio.open_connection(place.hostname, place.port)
                    writer.write(handshake(place.netloc, cookie, bench.site))
                    answer = await asyncio.wait_for(reader.readline(), PATIENCE)
                except (OSError, asyncio.TimeoutError):
                    return
                if b" 101 " not in answer:
                    writer.close()
                    return
                open_now.add(writer)
                most = max(most, len(open_now))
                kept.append(asyncio.ensure_future(until_closed(reader, writer)))

        kept = []
        await asyncio.gather(*(one() for _ in range(count)))
        for writer in tuple(open_now):
            writer.close()
        await asyncio.gather(*kept, return_exceptions=True)
        return most

    assert 0 < asyncio.run(flood(10_000 if SOAK else 300)) <= MOST_SOCKETS_OF_ONE
    assert serves(bench, cookie)


def test_idle_lines_leave_room_for_browsers(bench):
    cookie = cookie_of(bench)
    place = urlsplit(bench.site)
    lines = [
        socket.create_connection((place.hostname, place.port)) for _ in range(2 * MOST_LINES_OF_ONE + 40)
    ]
    for line in lines[::2]:
        with suppress(OSError):
            line.sendall(b"GET / HTTP/1.1\r\n")
    with selectors.DefaultSelector() as held:
        for line in lines:
            held.register(line, selectors.EVENT_READ)
        while not served(bench, cookie):
            # The bench lets go of lines on which nobody asks for anything.
            for key, _ in held.select():
                held.unregister(key.fileobj)
    for line in lines:
        line.close()


def served(bench, cookie):
    try:
        return serves(bench, cookie)
    except (OSError, http.client.HTTPException):
        return False


def test_only_files_of_runs_are_given(bench):
    cookie = cookie_of(bench)
    run = bench.folder / "2026-11-26_turntable_1"
    (run / "session").mkdir(parents=True)
    (run / "order.json").write_text(
        '{"word": "turntable", "order": {"sources": {}, "reading": {}, "table": null}}'
    )
    (run / "page.html").write_text("<!doctype html><script>1</script>")
    (run / "secret.txt").write_text("x")
    (bench.folder / "outside.yaml").write_text("x")
    (run / "linked.yaml").symlink_to(bench.folder / "outside.yaml")
    status, headers, _ = asked(bench, f"/runs/{run.name}/page.html", Cookie=cookie)
    assert status == 200
    assert "sandbox" in headers["content-security-policy"]
    for path in ("secret.txt", "session", "linked.yaml", "../outside.yaml", "..%2foutside.yaml", "none.html"):
        assert asked(bench, f"/runs/{run.name}/{path}", Cookie=cookie)[0] in (404, 200), path
        assert asked(bench, f"/runs/{run.name}/{path}", Cookie=cookie)[2] != "x", path


def opening_slowly(browser, address):
    """Opens a page whose socket is not connected yet; returns it, and that socket."""
    lines = []
    context = browser.new_context(viewport={"width": 1400, "height": 900})
    page = context.new_page()
    page.script_errors = []
    page.on("pageerror", lambda error: page.script_errors.append(str(error)))
    page.route_web_socket("**", lambda line: lines.append(line))
    page.goto(address)
    page.locator(".head").wait_for()
    waited(page, lambda: lines)
    return page, lines


def test_markup_in_names_is_text_and_viewers_only_look(bench):
    with chromium() as browser:
        operator, lines = opening_slowly(browser, bench.served["operator"])
        operator.get_by_text("Connecting …").wait_for()
        assert operator.locator("#app").evaluate("element => element.inert")
        other = operator.locator(".kind[aria-pressed=false]").first
        box = other.bounding_box()
        operator.mouse.click(box["x"] + 20.0, box["y"] + 20.0)
        lines.pop().connect_to_server()
        operator.locator("body.connected").wait_for()
        assert operator.get_by_text("Connecting …").is_hidden()
        waited(operator, lambda: operator.locator(".holder.mine").count())
        assert other.is_visible()
        assert operator.locator(".kind[aria-pressed=true]").inner_text().startswith("Turntable")
        operator.get_by_label("Name", exact=True).fill("unit")
        operator.get_by_label("Address", exact=True).fill("udp://:29171")
        operator.get_by_role("button", name="Add", exact=True).click()
        operator.locator(".source").wait_for()
        operator.get_by_label("Serial of unit").fill(MARKUP)
        operator.keyboard.press("Tab")
        operator.get_by_role("link", name="Run").click()
        operator.locator(".unit-serial", has_text=MARKUP).wait_for()
        assert operator.locator("#screen img").count() == 0

        viewer = opened(browser, bench.served["viewer"])
        assert viewer.get_by_role("button", name="Ask for the bench").count() == 0
        viewer.get_by_label("Serial of unit").fill("taken")
        viewer.keyboard.press("Tab")
        viewer.locator(".notice").wait_for()
        assert operator.locator(".unit-serial").inner_text() == MARKUP

        other = opened(browser, bench.served["operator"])
        other.get_by_role("button", name="Ask for the bench").click()
        operator.get_by_role("button", name="Hand over").click()
        waited(other, lambda: other.locator(".holder.mine").count())
        waited(operator, lambda: not operator.locator(".holder.mine").count())
        assert [*operator.script_errors, *viewer.script_errors, *other.script_errors] == []


def test_a_bench_whose_operator_is_gone_may_be_taken(simulated_clock):
    access = Access(needs_token=True)
    assert access.enter("wrong", "") is None
    one, other = (access.enter(access.token, "") for _ in range(2))
    viewer = access.enter(access.viewer_token, "")
    for each in (one, other, viewer):
        access.beat(each.key)
    assert access.operates(one.key)
    assert not access.ask(other.key)
    assert not access.ask(viewer.key)
    access.keep(other.key)
    assert access.asking is other
    access.keep(one.key)
    assert access.asking is None
    clock.sleep(HOLDS_FOR + 1.0)
    assert access.silent > HOLDS_FOR
    assert access.ask(other.key)
    assert access.operates(other.key)


def test_a_viewers_link_replaces_no_cookie_of_an_operator(bench):
    operator, viewer = cookie_of(bench), cookie_of(bench, "viewer")
    assert operator.partition("=")[0] != viewer.partition("=")[0]
    access = Access(needs_token=True)
    held, other, guest = (
        access.enter(token, "") for token in (access.token, access.token, access.viewer_token)
    )
    access.beat(held.key)
    keys = [held.key, other.key, guest.key, "stale"]
    for order in itertools.permutations(keys):
        assert access.known(order) is held
    assert access.known([guest.key, other.key]) is other
    assert access.known([guest.key]) is guest
    assert access.known(["stale"]) is None
