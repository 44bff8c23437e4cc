"""Lines and sockets of the bench: whoever opens many, or sends nonsense, takes nothing from the operator."""

from __future__ import annotations

import asyncio
import datetime
import random
import resource
import socket
import threading
from collections import Counter
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import urlsplit

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from websockets.exceptions import InvalidMessage

from bench_client import BenchClient, unsafe_tls
from bench_pages import BenchProcess
from repetitions import SOAK, drawn_seed
from tumble.bench import backlog, guest_work
from tumble.bench.access import MOST_BROWSERS, Access
from tumble.bench.authority import acting, is_allowed
from tumble.bench.beside import MOST_AT_ONCE, Beside
from tumble.bench.browser_socket import ABORT
from tumble.bench.cookies import cookie_values, only_cookies
from tumble.bench.gate import BROWSER, MOST_SOCKETS, MOST_SOCKETS_OF_ONE, Gate
from tumble.bench.line import MOST_LINES
from tumble.bench.log import open_logs
from tumble.bench.settings import BenchSettings
from tumble.foundation.errors import TumbleError
from tumble.tools.view.viewing import Viewing
from turntable_sessions import one_line, typed

SILENT = 1500
"""Lines that once ended a run."""


def write_pem(folder: Path, name: str, password: bytes | None = None) -> tuple[Path, Path]:
    """Writes a certificate and its key; returns their paths."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    now = datetime.datetime(2026, 1, 1, tzinfo=datetime.timezone.utc)
    made = x509.CertificateBuilder(subject, subject, key.public_key(), 1, now, now.replace(year=2036))
    certificate, key_file = folder / f"{name}.crt", folder / f"{name}.key"
    certificate.write_bytes(made.sign(key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM))
    hidden = serialization.BestAvailableEncryption(password) if password else serialization.NoEncryption()
    form = serialization.PrivateFormat.PKCS8
    key_file.write_bytes(key.private_bytes(serialization.Encoding.PEM, form, hidden))
    return certificate, key_file


@contextmanager
def serving(folder, *options):
    """Serves a bench at an address that needs a token, and asserts in the end that it left no traceback."""
    bench = BenchProcess(folder, "--port", "0", "--host", "127.0.0.2", *map(str, options))
    try:
        yield bench
    finally:
        printed = bench.end()
        assert "Traceback" not in printed, printed
        assert bench.process.returncode == 130


class OpenBench:
    """A bench in a process, and the cookie of the operator who entered first, whom it serves throughout."""

    def __init__(self, bench):
        self.site, self.served, self.process = bench.site, bench.served, bench.process
        self._cookie = BenchClient(bench.served["operator"]).cookie

    def operator(self, path="/"):
        """Opens a page of the operator, who holds the bench."""
        page = BenchClient(self.served["operator"], path, self._cookie)
        page.beat()
        return page


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("plain")) as bench:
        yield OpenBench(bench)


@pytest.fixture(scope="module")
def secured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("secured")
    pair = write_pem(folder, "server")
    with serving(folder / "bench", "--certificate", pair[0], "--key", pair[1]) as bench:
        yield OpenBench(bench)


def silent_line(place, number):
    """Opens a line from one of many computers, and sends nothing."""
    line = socket.socket()
    line.bind((f"127.1.{number % 250 + 1}.1", 0))
    line.connect((place.hostname, place.port))
    return line


def test_silent_lines_leave_room_before_and_after_tls(secured):
    with ExitStack() as lines:
        place = urlsplit(secured.site)
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 2 * SILENT), hard))
        lines.callback(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        with secured.operator() as operator:
            operator.wait(lambda: operator.shows("You hold the bench"))
            for number in range(SILENT):
                lines.callback(silent_line(place, number).close)
            operator.beat()
            assert operator.get("/run")[0] == 200
            open_files = len(list(Path(f"/proc/{secured.process.pid}/fd").iterdir()))
            assert open_files < MOST_LINES + 100
            operator.click("Run")
            operator.wait(lambda: operator.shows("This run"))


def test_lines_that_do_not_speak_tls_are_closed(secured):
    place = urlsplit(secured.site)
    with socket.create_connection((place.hostname, place.port)) as line:
        line.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
        with suppress(ConnectionError):
            assert b"HTTP" not in line.recv(1 << 12)
    with socket.create_connection((place.hostname, place.port)) as line:
        wrapped = unsafe_tls().wrap_socket(line)
        assert wrapped.version() in ("TLSv1.2", "TLSv1.3")
    assert BenchClient(secured.served["viewer"]).get("/units")[0] == 200


def operator_and_viewers(number, *, addresses):
    """Returns the access of a bench, its operator, and this number of viewers from so many addresses."""
    access = Access(needs_token=True)
    operator = access.enter(access.token, "10.0.0.1")
    access.beat(operator.key)
    viewers = [access.enter(access.viewer_token, f"10.0.1.{each % addresses}") for each in range(number)]
    return access, operator, viewers


def connection(gate, browser, kind, receive, send=None):
    """Returns a request of a browser, or its socket, on its way through the gate."""
    key = f"{gate._access.cookie_of(browser.rank)}={browser.key}".encode()
    headers = [(b"host", b"bench"), (b"origin", b"http://bench"), (b"cookie", key)]
    asked = {"method": "GET", "path": "/log", "query_string": b""}
    return gate({"type": kind, "headers": headers, "client": ("", 0), **asked}, receive, send)


def sockets_of(access, browsers):
    """Returns the sockets that each browser has once all ask for one more than one may have."""
    opened, over = Counter(), asyncio.Event()

    async def application(scope, _receive, _send):
        opened[scope[BROWSER].key] += 1
        await over.wait()

    async def receive():
        return {"type": "websocket.connect"}

    async def send(message):
        assert message == {"type": "websocket.close", "code": 1008}

    async def asked():
        gate = Gate(application, access, BenchSettings(folder=Path(), host="10.0.0.9"))
        wanted = [each for each in browsers for _ in range(MOST_SOCKETS_OF_ONE + 1)]
        tasks = [asyncio.create_task(connection(gate, each, "websocket", receive, send)) for each in wanted]
        await asyncio.sleep(0)
        over.set()
        await asyncio.gather(*tasks)

    asyncio.run(asked())
    return [opened[each.key] for each in browsers]


def test_viewers_of_one_computer_leave_sockets_for_the_operator(plain):
    access, operator, viewers = operator_and_viewers(MOST_SOCKETS, addresses=1)
    *taken, of_operator = sockets_of(access, [*viewers, operator])
    assert (sum(taken), of_operator) == (MOST_SOCKETS_OF_ONE, MOST_SOCKETS_OF_ONE)
    with ExitStack() as taken:
        cookie = BenchClient(plain.served["viewer"]).cookie
        for _ in range(MOST_SOCKETS_OF_ONE + 1):
            with suppress(Exception):
                taken.enter_context(BenchClient(plain.served["viewer"], "/", cookie))
        with plain.operator() as operator, BenchClient(plain.served["operator"]) as other:
            operator.wait(lambda: operator.shows("You hold the bench"))
            other.wait(lambda: other.shows("Browser 1 holds the bench"))


def test_whoever_holds_the_bench_always_has_a_socket():
    access, operator, viewers = operator_and_viewers(MOST_SOCKETS, addresses=MOST_SOCKETS)
    *taken, of_operator = sockets_of(access, [*viewers, operator])
    assert (sum(taken), of_operator) == (MOST_SOCKETS - MOST_SOCKETS_OF_ONE, MOST_SOCKETS_OF_ONE)


def test_whoever_enters_again_and_again_crowds_nobody_out():
    access = Access(needs_token=True)
    operator, other = (access.enter(access.token, "") for _ in range(2))
    viewer = access.enter(access.viewer_token, "")
    for each in (operator, other, viewer):
        access.beat(each.key)
    for _ in range(2 * MOST_BROWSERS):
        access.enter(access.viewer_token, "")
    assert all(access.known([each.key]) is each for each in (operator, other, viewer))


def test_viewers_that_live_leave_room_for_operators():
    access = Access(needs_token=True)
    operator = access.enter(access.token, "")
    for _ in range(2 * MOST_BROWSERS):
        access.beat(access.enter(access.viewer_token, "").key)
    late = access.enter(access.token, "")
    viewer = access.enter(access.viewer_token, "")
    assert all(access.known([each.key]) is each for each in (operator, late, viewer))
    access.beat(late.key)
    assert access.operates(late.key)


def test_lines_of_viewers_leave_lines_for_operators(plain):
    with ExitStack() as lines:
        place = urlsplit(plain.site)
        operator, viewer = plain.operator(), BenchClient(plain.served["viewer"])
        head = f"Host: {place.netloc}\r\nCookie: {viewer.cookie}\r\n\r\n"
        for number in range(2 * MOST_LINES):
            line = lines.enter_context(silent_line(place, number % 4))
            line.sendall(f"GET /bench/favicon.svg HTTP/1.1\r\n{head}".encode())
            assert line.recv(1 << 16)
            line.sendall(b"GET / HTTP/1.1\r\nHo")  # a request that never ends
            if number % 64 == 0:
                operator.beat()
        operator.beat()
        with operator, BenchClient(plain.served["operator"]) as other:
            operator.wait(lambda: operator.shows("You hold the bench"))
            other.wait(lambda: other.shows("Browser 1 holds the bench"))


def test_viewers_have_few_recordings_read_at_once(monkeypatch):
    ends, readers, closed = threading.Event(), [], []

    def gather():
        readers.append(threading.current_thread())
        ends.wait()

    def opened(sources):
        return SimpleNamespace(gather=gather, enter=lambda: None, close=lambda: closed.append(*sources))

    monkeypatch.setattr(open_logs, "open_viewing", opened)
    logs, refused = open_logs.OpenLogs(), 0
    for number in range(3 * open_logs.MOST):
        try:
            logs.open(str(number))
        except TumbleError:
            refused += 1
    ends.set()
    for each in logs._readers:
        each.join()
    assert (len(readers), refused) == (open_logs.MOST, 2 * open_logs.MOST)
    logs.open("next")
    assert closed == ["0"]
    logs.close()
    assert len(closed) == open_logs.MOST + 1


def test_a_recording_is_closed_once_no_page_shows_it(monkeypatch):
    closed = []
    samples = SimpleNamespace(close=lambda: closed.append(True))
    monkeypatch.setattr(
        open_logs, "open_viewing", lambda sources: Viewing(*sources, [SimpleNamespace(samples=samples)])
    )
    monkeypatch.setattr(Viewing, "_gather", lambda _: None)
    logs = open_logs.OpenLogs()
    first = logs.open("first")
    for number in range(open_logs.MOST):
        logs.open(str(number)).leave()
    assert not closed
    shown = logs.samples.serve(first, ())
    first.leave()
    assert not closed
    logs.samples.end(shown)
    logs.samples.end(shown)
    assert closed == [True]


FOREIGN = (
    b"",
    b'a="b',
    b"[]{}=1",
    b"x=\xff\x00; a,b=c",
    b"tumble_bench_1=stale",
    b"big=" + b"x" * 20_000,
    b"; ".join(b"c%d=%s" % (number, b"y" * 200) for number in range(100)),
)


@pytest.mark.parametrize("foreign", FOREIGN)
def test_cookies_of_other_programs_are_passed_over(foreign):
    for header in (foreign + b"; tumble_bench_1=own", b"tumble_bench_1=own; " + foreign):
        assert "own" in list(cookie_values(header, "tumble_bench_1"))
        assert b"tumble_bench_1=own" in only_cookies(header, ["tumble_bench_1"]).split(b"; ")
        assert len(only_cookies(header, ["tumble_bench_1"])) < 100


def test_a_browser_with_cookies_of_other_programs_has_its_page(plain):
    own = plain.operator().cookie
    name = own.partition("=")[0]
    assert name == f"tumble_bench_{urlsplit(plain.site).port}"
    cookie = f'a="b; [x]=1; {name}=stale; big={"x" * 20_000}; {own}'
    with BenchClient(plain.served["operator"], "/run", cookie) as page:
        page.beat()
        page.wait(lambda: page.shows("You hold the bench"))


def test_bad_pem_files_are_one_line(tmp_path):
    good, other = write_pem(tmp_path, "good"), write_pem(tmp_path, "other")
    hidden = write_pem(tmp_path, "hidden", b"password")
    nonsense, empty = tmp_path / "nonsense.pem", tmp_path / "empty.pem"
    nonsense.write_bytes(random.Random(1).randbytes(5000))
    empty.write_bytes(b"")
    unreadable = tmp_path / "missing.pem"
    for certificate, key in (
        (good[0], other[1]),
        (good[0], nonsense),
        (good[0], empty),
        (nonsense, good[1]),
        (empty, good[1]),
        (good[1], good[0]),
        (good[0], hidden[1]),
        (good[0], unreadable),
        (tmp_path, good[1]),
    ):
        done = typed(
            "bench", "--folder", tmp_path / "b", "--port", "0", "--certificate", certificate, "--key", key
        )
        assert done.code == 2
        assert "PEM" in one_line(done.err)


def nonsense(chance):
    """Returns bytes that are no request, or nearly one."""
    kind = chance.choice(["noise", "request", "headers", "upgrade", "tls"])
    noise = chance.randbytes(chance.randint(1, 400))
    if kind == "request":
        return b"GET /" + noise + b" HTTP/1.1\r\nHost: 127.0.0.2\r\n\r\n"
    if kind == "headers":
        return b"GET / HTTP/1.1\r\nHost: 127.0.0.2\r\n" + noise.replace(b"\n", b":") * 300 + b"\r\n\r\n"
    if kind == "upgrade":
        head = b"GET /_nicegui_ws/socket.io/?EIO=4&transport=websocket HTTP/1.1\r\nHost: 127.0.0.2\r\n"
        return (
            head + b"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: " + noise + b"\r\n\r\n"
        )
    return (b"\x16\x03\x01" if kind == "tls" else b"") + noise


@contextmanager
def operating(bench, tries=100):
    """Enters the page of the operator; a line that is closed meanwhile is tried again, as browsers do."""
    with ExitStack() as stack:
        for left in reversed(range(tries)):
            try:
                page = stack.enter_context(bench.operator())
                break
            except InvalidMessage:
                if not left:
                    raise
        yield page


def test_nonsense_on_a_line_leaves_the_bench_as_it_is(plain, secured):
    chance = random.Random(drawn_seed())
    for bench in (plain, secured):
        place = urlsplit(bench.site)
        for _ in range(3000 if SOAK else 60):
            with suppress(OSError), socket.create_connection((place.hostname, place.port), 30.0) as line:
                is_secured = bench is secured and chance.random() < 0.5
                with unsafe_tls().wrap_socket(line) if is_secured else line as end:
                    end.sendall(nonsense(chance))
                    end.shutdown(socket.SHUT_WR)
                    end.recv(1 << 12)
        with operating(bench) as page:
            page.wait(lambda page=page: page.shows("You hold the bench"))


def test_work_beside_holds_up_neither_pages_nor_the_operator():
    beside, answers, done = Beside(), threading.Event(), []

    async def ask(work, holds_bench):
        with acting(lambda: holds_bench):
            done.append(await beside.done(work))

    async def served():
        silent = [asyncio.create_task(ask(answers.wait, False)) for _ in range(2 * MOST_AT_ONCE)]
        await asyncio.sleep(0)
        # The loop goes on, and whoever holds the bench has threads of their own.
        await ask(is_allowed, True)
        assert done == [True]
        silent[-1].cancel()
        answers.set()
        await asyncio.gather(*silent, return_exceptions=True)

    asyncio.run(served())
    assert len(done) == 2 * MOST_AT_ONCE
    beside.close()


def test_guests_get_their_work_done_in_turn(monkeypatch):
    now, others_run = 0.0, asyncio.sleep

    async def sleep(seconds):
        nonlocal now
        now += seconds + 1e-6
        await others_run(0)

    monkeypatch.setattr(guest_work.asyncio, "sleep", sleep)
    monkeypatch.setattr(guest_work.clock, "now", lambda: now)
    work, done = guest_work.GuestWork(), []

    async def ask(group):
        await work.begin(group, guest_work.WORK_OF_A_PAGE)
        done.append((group, now))

    async def flood():
        await asyncio.gather(*(ask("flood") for _ in range(500)), *(ask("other") for _ in range(3)))

    asyncio.run(flood())
    assert len(done) == 503
    pages_at_once = guest_work.MOST_WORK // guest_work.WORK_OF_A_PAGE
    pages_a_second = guest_work.WORK_A_SECOND / guest_work.WORK_OF_A_PAGE
    assert done[-1][1] == pytest.approx((503 - pages_at_once) / pages_a_second, rel=0.01)
    # Others wait for one page of the flood for each of their own.
    others = [at for group, at in done if group == "other"]
    assert others[-1] <= (2.0 * len(others) + 1.0) / pages_a_second + 0.01
    assert not work._lines


def test_work_of_guests_is_charged_by_time_and_never_in_bursts(monkeypatch):
    now, others_run, seconds, takes, turns = 0.0, asyncio.sleep, 20.0, 0.3, 6

    async def sleep(wanted):
        nonlocal now
        now += 5e-5 if wanted else 0.0
        await others_run(0)

    monkeypatch.setattr(guest_work.asyncio, "sleep", sleep)
    monkeypatch.setattr(guest_work.clock, "now", lambda: now)
    access, operator, viewers = operator_and_viewers(15, addresses=5)
    waits, handled = [], Counter()

    async def turned():
        for _ in range(turns):
            await others_run(0)

    async def application(scope, receive, _send):
        nonlocal now
        while now < seconds:
            if scope["type"] == "websocket":
                await receive()
            came = now
            await turned()
            if scope["tumble.browser"] is operator:
                waits.append(now - came)
                now += 0.01
                continue
            guest_work.charge_step()
            now += takes
            handled[scope["type"]] += 1
            if scope["type"] == "http":
                return

    gate = Gate(application, access, BenchSettings(folder=Path(), host="10.0.0.9"))

    async def receive():
        return {"type": "websocket.receive", "text": "a click"}

    async def pages(browser):
        while now < seconds:
            await connection(gate, browser, "http", receive)

    async def flood():
        sockets = (connection(gate, each, "websocket", receive) for each in (operator, *viewers))
        await asyncio.gather(*sockets, *map(pages, viewers))

    asyncio.run(flood())
    # A stop waits for a message and a page at most, and guests have a fifth of the time for each kind.
    assert max(waits) <= 2.0 * takes + 1e-3
    share = guest_work.WORK_A_SECOND / guest_work.WORK_OF_A_PROCESSOR
    for kind, at_once in (("websocket", guest_work.MOST_WORK_OF_MESSAGES), ("http", guest_work.MOST_WORK)):
        most = seconds * share + at_once / guest_work.WORK_OF_A_PROCESSOR
        assert 0.5 * most < handled[kind] * takes < most + len(viewers) * takes, kind


def test_sockets_of_guests_that_take_too_little_are_closed(monkeypatch):
    access, closed = Access(needs_token=True), []
    operator = access.enter(access.token, "10.0.0.1")
    access.beat(operator.key)
    viewer = access.enter(access.viewer_token, "10.0.1.1")
    sockets, environ = {}, {}

    def add(name, browser, waiting):
        sockets[name] = SimpleNamespace(queue=asyncio.Queue())
        for each in waiting:
            sockets[name].queue.put_nowait(None if each is None else SimpleNamespace(data=each))
        scope = {BROWSER: browser, ABORT: lambda: closed.append(name)}
        environ[name] = {backlog.SCOPE: scope}

    piece = "x" * (1 << 20)
    many = [piece] * (backlog.MOST_WAITING // len(piece) + 1)
    add("operator", operator, many)
    add("viewer", viewer, many)
    add("viewer that reads", viewer, [*many[1:], None, {"sid": "no text"}])
    server = SimpleNamespace(eio=SimpleNamespace(sockets=sockets), environ=environ)
    monkeypatch.setattr(backlog.core, "sio", server)
    backlog.close_slow_sockets(access.operates)
    assert closed == ["viewer"]


@pytest.mark.parametrize("wanted", ["40", 0, "nonsense", None, "100"])
def test_a_page_that_is_sent_again_what_it_missed_is_charged(monkeypatch, wanted):
    outbox = SimpleNamespace(next_message_id=100, message_history=range(80))
    monkeypatch.setitem(backlog.Client.instances, "page", SimpleNamespace(outbox=outbox))
    work = guest_work.GuestWork()
    before = work._left
    with acting(lambda: False), guest_work.charged_to(work):
        backlog.charge_what_is_sent_again("page", wanted)
    sent = {"40": 60, 0: 80}.get(wanted, 0)
    charged = sent * backlog.TIME_OF_A_MESSAGE * guest_work.WORK_OF_A_PROCESSOR
    assert before - work._left == pytest.approx(charged)
    with acting(lambda: True), guest_work.charged_to(work):
        backlog.charge_what_is_sent_again("page", 0)
    assert before - work._left == pytest.approx(charged)


def test_messages_of_guests_leave_time_for_the_operator(monkeypatch):
    now, others_run, seconds = 0.0, asyncio.sleep, 20.0

    async def sleep(wanted):
        nonlocal now
        now += wanted + 1e-6
        await others_run(0)

    monkeypatch.setattr(guest_work.asyncio, "sleep", sleep)
    monkeypatch.setattr(guest_work.clock, "now", lambda: now)
    access, operator, viewers = operator_and_viewers(16, addresses=2)
    waits = {each.key: [] for each in (operator, *viewers)}

    async def application(scope, receive, _send):
        while now < seconds:
            waits[scope["tumble.browser"].key].append(-(await receive())["came"] + now)

    gate = Gate(application, access, BenchSettings(folder=Path(), host="10.0.0.9"))

    def connected(browser, text):
        async def receive():
            await others_run(0)
            return {"type": "websocket.receive", "text": text, "came": now}

        return connection(gate, browser, "websocket", receive)

    async def flood():
        large = "x" * guest_work.WORK_OF_A_MESSAGE * 9
        await asyncio.gather(connected(operator, large), *(connected(each, large) for each in viewers))

    asyncio.run(flood())
    most = guest_work.MOST_WORK_OF_MESSAGES + seconds * guest_work.WORK_A_SECOND
    guests = sum(len(waits[each.key]) for each in viewers)
    assert 0.9 * most / 10 < guests < most / 10 + len(viewers) + 1
    assert max(waits[operator.key]) == 0.0
