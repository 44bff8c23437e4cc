"""Browsers take over from each other, and are gone: a table moves only for the holder who armed it."""

from __future__ import annotations

import random
import threading
from contextlib import suppress
from functools import partial

import pytest

from ports import free_port
from repetitions import SOAK, drawn_seed
from tumble.bench import engine as engine_module
from tumble.bench.access import BROWSER_GONE, HOLDS_FOR
from tumble.bench.authority import acting, as_bench
from tumble.bench.bench import BETWEEN_LOOKS, Bench
from tumble.bench.server import BETWEEN_PULSES
from tumble.bench.settings import BenchSettings
from tumble.bench.sources import BenchSource, BenchSources
from tumble.foundation import clock
from tumble.foundation.errors import TumbleError
from tumble.foundation.message import message
from tumble.tools.guided.view import RunView

SEQUENCES = 400 if SOAK else 4
STEPS = 60
"""Steps of one sequence."""
BETWEEN_BEATS = 0.4
"""s between two signs of life of a page, as in heartbeat.js."""
STOPPED_WITHIN = 2.0 * BETWEEN_LOOKS + BETWEEN_BEATS
"""s that a motion may outlast the reason for which it ends."""


class Table:
    """Stands in for a run on a table: it is planned, then moves until it is stopped."""

    def __init__(self, planning):
        self._planning = planning
        self.order = None
        """Order of the motion under way; None at rest."""
        self.orders = []
        """Orders of all motions."""

    def begin(self, order):
        clock.sleep(self._planning())
        return _Motion(self, order)


class _Motion:
    def __init__(self, table, order):
        self._table, self._order, self._stops = table, order, False

    def views(self):
        (self._order.folder / "session").mkdir(exist_ok=True)
        (self._order.folder / "session" / "session.yaml").write_text("")
        if self._order.table is not None and self._order.table.armed:
            self._table.order = self._order
            self._table.orders.append(self._order)
        while not self._stops:
            yield RunView(kind="progress", elapsed=0.0, instruction=message("Hold."))
            clock.sleep(BETWEEN_LOOKS / 2.0)
        self._table.order = None

    def stop(self):
        self._stops = True


class Page:
    """One page of one browser: it shows what it was shown last, and sends what its user does."""

    def __init__(self, bench, rank):
        token = bench.access.token if rank == "operator" else bench.access.viewer_token
        self.bench, self.browser, self.is_here = bench, bench.access.enter(token, ""), True
        self.load()

    def load(self):
        """Shows what the bench shows now, as a page does that is loaded, or has a connection."""
        self.motion, self.shows_armed = self.bench.motion, self.bench.is_armed
        self.paused = self.bench.paused_motion

    def beat(self):
        if self.is_here:
            self.bench.access.beat(self.browser.key)
            self.load()

    def does(self, act):
        """Acts as a page does; a refusal is shown."""
        self.bench.access.beat(self.browser.key)
        with suppress(TumbleError), acting(partial(self.bench.access.operates, self.browser.key)):
            act()

    def arm(self):
        self.does(self.bench.disarm if self.shows_armed else partial(self.bench.arm, self.motion))

    def go_on(self):
        self.does(partial(self.bench.resume, armed=self.paused))


class Law:
    """Holds for whom the table may move: who armed it, for that motion, and was there since."""

    def __init__(self, bench, table, pages):
        self.bench, self.table, self.pages = bench, table, pages
        self.armed_by, self.armed_for = None, None
        self.moves_for, self.broken_since = None, None

    def motion(self):
        choice = self.bench.choice
        return choice.word, choice.table.address, choice.table.limits, dict(choice.options)

    def note_click(self, page, was_armed):
        """Looks at what a click at the button that arms has done."""
        if was_armed != self.bench.is_armed:
            self.armed_by, self.armed_for = (None if was_armed else page), self.motion()

    def note_begun(self, page):
        """Looks at what a start has begun."""
        table = self.bench.engine.folder.order.table
        if table is not None and table.armed:
            assert self.armed_by is page
            assert self.armed_for == self.motion()
            self.moves_for = page
        self.armed_by = None

    def look(self):
        """Looks whether the table moves for nobody, or for somebody who is gone."""
        access = self.bench.access
        holders = [each for each in self.pages if access.operates(each.browser.key)]
        assert len(holders) <= 1
        for name in ("armed_by", "moves_for"):
            page = getattr(self, name)
            gone = page is not None and clock.now() - page.browser.seen > BROWSER_GONE + STOPPED_WITHIN
            if gone or page not in holders:
                setattr(self, name, None)
        if self.armed_by is None:
            assert not self.bench.is_armed
        is_moved = self.table.order is not None and self.moves_for is None
        self.broken_since = (self.broken_since or clock.now()) if is_moved else None
        assert self.broken_since is None or clock.now() - self.broken_since < STOPPED_WITHIN


def step(chance, law, page):
    """Does one drawn thing that a user may do at a page."""
    what = chance.choice(DEEDS)
    if what == "begin":
        for each in ("leave", "reload", "arm", "start"):
            do(each, chance, law, page)
    else:
        do(what, chance, law, page)


def do(what, chance, law, page):
    """Does one thing, and notes what it has armed or begun."""
    bench, access, key = law.bench, law.bench.access, page.browser.key
    if what == "arm":
        was_armed = bench.is_armed
        page.arm()
        law.note_click(page, was_armed)
    elif what == "start":
        before = bench.engine.folder
        page.does(bench.start)
        if bench.engine.folder is not before:
            law.note_begun(page)
    elif what == "go on":
        before, shown, moves = bench.engine.state, page.paused, bench.paused_motion
        page.go_on()
        if before in ("paused", "error") and bench.engine.state == "running":
            assert access.operates(key)
            assert shown == moves
            law.moves_for = page
    elif what == "change":
        before = law.motion()
        page.does(partial(bench.change_table, limits=f"rate={chance.randrange(3)}"))
        if law.motion() != before:
            law.armed_by = None
    elif what == "hand over":
        asking = access.asking
        access.hand_over(key, chance.randrange(5) if asking is None else asking.number)
    else:
        {
            "ask": lambda: access.ask(key),
            "keep": lambda: access.keep(key),
            "reload": page.load,
            "stop": lambda: bench.stop(page.browser),
            "pause": lambda: page.does(bench.engine.pause),
            "leave": lambda: page.does(bench.engine.leave),
            "come or go": lambda: setattr(page, "is_here", not page.is_here),
        }[what]()


DEEDS = (
    *("begin", "arm", "start", "go on") * 3,
    *("hand over", "ask") * 2,
    *("change", "keep", "reload", "stop", "pause", "leave", "come or go"),
)


@pytest.fixture
def table(monkeypatch):
    """A table in the place of the kinds of runs; no samples are listened for."""
    found = Table(lambda: 0.0)
    monkeypatch.setattr(engine_module, "run_kind", lambda _word: found)
    monkeypatch.setattr(BenchSources, "watch", lambda _self, _on: None)
    return found


@pytest.fixture
def bench(tmp_path, table, simulated_clock):
    found = Bench(BenchSettings(folder=tmp_path, host="127.0.0.2"))
    found.add_source(BenchSource("reference", f"udp://127.0.0.1:{free_port()}"))
    found.add_source(BenchSource("one", f"udp://127.0.0.1:{free_port()}"))
    found.change_table(address="simulated:two-axis", limits="rate=0")
    ends = threading.Event()
    pulse = clock.thread(as_bench(partial(keep_pulse, found, ends)), name="pulse")
    pulse.start()
    yield found
    ends.set()
    clock.wait(pulse)
    found.close()


def keep_pulse(bench, ends):
    """Has time for pages, as a server does."""
    while not clock.wait(ends, BETWEEN_PULSES):
        bench.pulse = clock.now()


def let_pass(law, seconds):
    """Lets time pass, in which pages give their signs of life."""
    until = clock.now() + seconds
    while clock.now() < until:
        clock.sleep(min(BETWEEN_BEATS, max(until - clock.now(), 0.01)))
        for page in law.pages:
            page.beat()
        law.look()


def test_no_takeover_moves_a_table_for_anybody_else(bench, table):
    chance = random.Random(drawn_seed())
    table._planning = lambda: chance.choice((*4 * [0.0], 1.0, 5.0, HOLDS_FOR + 5.0))
    moved = 0
    for _ in range(SEQUENCES):
        law = Law(bench, table, [Page(bench, "operator") for _ in range(3)] + [Page(bench, "viewer")])
        for _ in range(STEPS):
            holds = [page for page in law.pages if bench.access.operates(page.browser.key)]
            step(chance, law, chance.choice(3 * holds + law.pages))
            law.look()
            moved += table.order is not None
            if chance.random() < 0.5:
                let_pass(law, chance.choice((0.05, 0.3, 1.0, BROWSER_GONE + 0.5, HOLDS_FOR + 1.0)))
        bench.engine.close()
        bench.engine.leave()
        bench.disarm()
    assert moved > SEQUENCES


@pytest.fixture
def operators(bench):
    """Two pages of operators; the first holds the bench."""
    found = [Page(bench, "operator") for _ in range(2)]
    for each in found:
        each.beat()
    return found


def beating(seconds, *pages):
    """Lets time pass, in which pages give signs of life."""
    for _ in range(round(seconds / BETWEEN_BEATS)):
        clock.sleep(BETWEEN_BEATS)
        for page in pages:
            page.beat()


def test_arming_ends_while_its_operator_is_gone(bench, operators):
    first, _ = operators
    first.arm()
    beating(2.0 * HOLDS_FOR, first)
    assert bench.is_armed
    beating(BROWSER_GONE + 1.0)
    assert not bench.is_armed
    with pytest.raises(TumbleError, match="arm the table again"):
        bench.start()
    bench.start()
    assert bench.engine.folder.order.table is None


def test_what_was_sent_before_a_takeover_arms_nothing(bench, operators):
    first, other = operators
    first.does(partial(bench.change_table, limits="rate=1"))
    first.arm()  # as it showed another limit when it was clicked
    assert not bench.is_armed
    with pytest.raises(TumbleError, match="arm the table again"):
        bench.arm(first.motion)
    bench.access.ask(other.browser.key)
    bench.access.hand_over(first.browser.key, other.browser.number)
    other.arm()
    assert not bench.is_armed
    other.load()
    other.arm()
    assert bench.is_armed
    first.arm()
    assert bench.is_armed
    # A second click that was sent before the first was shown disarms nothing, nor does it arm again.
    other.arm()
    assert bench.is_armed
    other.load()
    other.arm()
    assert not bench.is_armed
    other.arm()
    assert not bench.is_armed


def test_a_table_stops_where_the_bench_is_handed_over(bench, table, operators):
    first, other = operators
    first.arm()
    first.does(bench.start)
    beating(1.0, first, other)
    assert table.order.table.armed
    bench.access.ask(other.browser.key)
    bench.access.hand_over(first.browser.key, other.browser.number)
    beating(1.0, first, other)
    assert table.order is None
    assert "changed hands" in str(bench.engine.trouble)
    first.go_on()
    assert bench.engine.state == "paused"
    other.go_on()
    beating(1.0, first, other)
    assert table.order.table.armed


@pytest.mark.parametrize("away", [BROWSER_GONE + 1.0, HOLDS_FOR + 1.0])
def test_a_table_moves_not_if_its_operator_left_as_it_was_planned(bench, table, operators, away):
    first, other = operators
    table._planning = lambda: 2.0 * HOLDS_FOR
    first.arm()
    first.does(bench.start)
    beating(away, other)
    beating(3.0 * HOLDS_FOR, first, other)
    assert bench.engine.state == "paused"
    assert table.orders == []


def test_a_page_of_a_former_tenure_goes_on_with_no_table(bench, table, operators):
    first, _ = operators
    first.arm()
    first.does(bench.start)
    beating(1.0, first)
    first.does(bench.engine.pause)
    beating(1.0, first)
    beating(BROWSER_GONE + 1.0)
    first.go_on()
    assert bench.engine.state == "paused"
    assert table.order is None
    first.load()
    first.go_on()
    beating(1.0, first)
    assert table.order.table.armed
