"""A bench in this process, and browsers that only look, which send it all that a browser can.

Handlers, messages and routes are those that NiceGUI has; what each changes is printed as JSON.
"""

from __future__ import annotations

import asyncio
import gc
import hashlib
import json
import os
import random
import re
import sys
import threading
from contextlib import suppress
from dataclasses import asdict
from functools import cache, wraps
from inspect import isfunction
from pathlib import Path

from nicegui import app, background_tasks, core
from nicegui.client import Client
from websockets.exceptions import ConnectionClosed

from bench_client import BenchClient
from patience import PATIENCE
from ports import free_port
from repetitions import repetitions
from tumble.bench import guest_work
from tumble.bench.address import entrances
from tumble.bench.authority import acting
from tumble.bench.bench import Bench
from tumble.bench.fleet_view import FleetView
from tumble.bench.log import open_logs
from tumble.bench.page.frame import FOLLOWERS, MOST_UNOPENED, SCREENS
from tumble.bench.registry_view import RegistryView
from tumble.bench.run_folder import runs_in
from tumble.bench.server import BenchServer
from tumble.bench.settings import BenchSettings
from tumble.bench.sources import BenchSource

STAGES = ("idle", "paused", "result")
"""States of the engine in which pages show different handlers."""
WELL_FORMED = (
    [],
    ["text:TCPIP::203.0.113.9::5025::SOCKET?profile=scpi"],
    ["rate=1000"],
    ["true"],
    [""],
    ["3"],
    [True],
    [{"value": True}],
    [[0.0, 1.0]],
)
MALFORMED = (None, [None], "text", 7, [["a"], {"b": []}], [{"args": {}}], [1e308], ["\x00\n\u202e"], {"0": 1})
FRAMES = (
    '42["event",{"args":[Infinity]}]',
    "",
    "x",
    "9",
    "42",
    "42[",
    '42["event"]',
    "42[]",
    '42["event",null]',
    '421["handshake"]',
    "40{",
    "451-[]",
    "44",
)
"""Frames that are no message."""


def as_bench():
    return acting(lambda: True)


@cache
def digest(path, *_status):
    """Reads a file anew only where its inode, size or time of change differ."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def state_of(bench):
    """Returns all that pages share, and what is on the disk, as text."""
    engine, access = bench.engine, bench.access
    files = {
        path: digest(path, (status := Path(path).stat()).st_ino, status.st_size, status.st_mtime_ns)
        for folder, _, names in os.walk(bench.folder)
        for path in (f"{folder}/{name}" for name in names)
        if not path.endswith(("-wal", "-shm", ".lock"))
    }
    shared = {
        "choice": repr(bench.choice),
        "armed": bench.is_armed,
        "sources": [asdict(each) for each in bench.sources],
        "offered": repr(bench.offered),
        "engine": repr((engine.state, engine.folder, engine.view, engine.outcome, engine.decision)),
        "asked": repr((engine.trouble, len(engine.notes), engine.views)),
        "operator": access.operator and access.operator.number,
        "asking": access.asking and access.asking.number,
        "files": files,
    }
    return json.dumps(shared, sort_keys=True)


class Attack:
    """Sends messages from a page, and looks after each whether anything changed."""

    def __init__(self, bench, server, chance):
        self.bench, self.chance = bench, chance
        self.entrances = entrances(bench.settings, bench.access, server.port)
        self.sent = 0
        self.changes = []

    def opened(self, who, path, cookie=""):
        return BenchClient(self.entrances[who], path, cookie)

    def look(self, before, what):
        after = state_of(self.bench)
        if after != before:
            parts = json.loads(before), json.loads(after)
            self.changes.append([what, [key for key in parts[0] if parts[0][key] != parts[1][key]]])
        return after

    def handlers(self, page, rounds, only=None):
        """Has each element emit each of its events, with and without sense."""
        state = state_of(self.bench)
        seen = set()
        while True:
            client = Client.instances.get(page.client_id)
            # The newest first, as those of the frame lead to another screen.
            found = [
                (each, listener)
                for each in reversed(list(client.elements.values()))
                for listener in list(each._event_listeners.values())
                if listener.id not in seen and only in (None, listener.type)
            ]
            if not found or len(seen) > 400:
                return
            for each, listener in found:
                seen.add(listener.id)
                for given in [*WELL_FORMED[:2], *self.chance.sample(WELL_FORMED[2:] + MALFORMED, rounds)]:
                    arguments = [json.dumps(one) for one in given] if isinstance(given, list) else given
                    told = {"id": each.id, "client_id": page.client_id, "listener_id": listener.id}
                    page.send("event", {**told, "args": arguments})
                    self.sent += 1
                    drain()
                    words = " ".join(page.texts(each.id)) or str(each.props.get("aria-label", ""))
                    state = self.look(state, f"{listener.type} of {each.tag} {words}")

    def messages(self, page, other, rounds):
        """Sends messages of every name, about the page of another browser, or about none."""
        state = state_of(self.bench)
        stop = next(iter(Client.instances[other].elements[0]._event_listeners.values()))
        event = {"id": 0, "client_id": other, "listener_id": stop.id, "args": []}
        shapes = [None, 7, "x", [], {}, event, {**event, "client_id": page.client_id, "id": "x"}]
        shapes += [
            {"client_id": other, key: "x"} for key in ("request_id", "next_message_id", "level", "tab_id")
        ]
        page.send_raw(f"42{json.dumps(['no such message', event])}")
        for name in core.sio.handlers["/"]:
            for given in [
                *shapes,
                *({"client_id": page.client_id, "args": each} for each in MALFORMED[:rounds]),
            ]:
                if name not in ("connect", "disconnect"):
                    page.send(name, given)
                    self.sent += 1
            state = self.look(state, f"message {name}")

    def frames(self, who, rounds):
        """Sends what is no message; each may end the socket."""
        state = state_of(self.bench)
        for frame in [
            *FRAMES,
            *("".join(self.chance.choices('0123456789[]{}",:a\x00', k=30)) for _ in range(rounds)),
        ]:
            with suppress(ConnectionClosed), self.opened(who, "/") as page:
                page.send_raw(frame)
                page.send_raw(frame.encode())
                page.send("ack", {"client_id": page.client_id, "next_message_id": 0})
            self.sent += 1
            state = self.look(state, f"frame {frame!r}")

    def flood(self, page):
        """Asks for more pages than may wait for their browsers; returns the most that did."""
        most = 0
        for _ in range(MOST_UNOPENED + 8):
            assert page.get("/run")[0] == 200
            most = max(most, sum(not each.has_socket_connection for each in Client.instances.values()))
        return most

    def routes(self, page):
        """Asks every route for everything."""
        state = state_of(self.bench)
        for route in app.routes:
            path = re.sub(r"\{[^}]*\}", "1", getattr(route, "path", "") or "/")
            for method in ("GET", "HEAD", "POST", "PUT", "DELETE", "PATCH", "OPTIONS"):
                page.asked(path, method, Cookie=page.cookie, Origin=page.site)
                self.sent += 1
            state = self.look(state, f"route {path}")


def watch_loop(*watched):
    """Notes which functions run, and whether in an event loop; they may wait for a server, or take long."""
    found = {False: set(), True: set()}

    def watching(function, name):
        @wraps(function)
        def act(*arguments, **named):
            found[asyncio._get_running_loop() is not None].add(name)
            return function(*arguments, **named)

        return act

    for owner, names in watched:
        for name in names:
            setattr(owner, name, watching(getattr(owner, name), name))
    return found


def methods(kind):
    return [name for name, each in vars(kind).items() if isfunction(each) and not name.startswith("_")]


def drain():
    """Waits until handlers that take their time have ended."""

    async def ended():
        tasks = [each for each in background_tasks.running_tasks if is_handler(each)]
        if tasks:
            await asyncio.wait(tasks, timeout=PATIENCE)

    def is_handler(task):
        is_loop = task.get_coro().__qualname__.endswith("._run_in_loop")
        return task.get_name().startswith("<") and not is_loop

    asyncio.run_coroutine_threadsafe(ended(), core.loop).result(PATIENCE)


def prepare(bench, stage):
    """Brings the bench into a state."""
    with as_bench():
        if stage == "idle":
            bench.add_source(BenchSource("reference", f"udp://127.0.0.1:{free_port()}", "R-1"))
            bench.add_source(BenchSource("target_1", f"udp://127.0.0.1:{free_port()}"))
            bench.choose("turntable")
            bench.change_table(address="simulated:two-axis", limits="rate=10")
        elif stage == "paused":
            bench.adopt_offer()
        else:
            bench.engine.leave()
            bench.engine.show(next(run for run in runs_in(bench.folder) if run.is_finished))


def main(folder, seed, rounds):
    """Attacks a bench in a folder; prints how much was sent, and what it changed."""
    chance = random.Random(seed)
    guest_work.MOST_WORK = sys.maxsize  # its messages, not its haste, are tried
    asked = watch_loop(
        (RegistryView, ["__init__", *methods(RegistryView)]),
        (FleetView, methods(FleetView)),
        (open_logs, ["open_viewing"]),
    )
    bench = Bench(BenchSettings(folder=folder, host="127.0.0.2", port=0, registry=str(folder / "lab.db")))
    server, ready = BenchServer(bench), threading.Event()

    def serve():
        try:
            server.serve_until_ended(ready.set)
        finally:
            ready.set()

    thread = threading.Thread(target=serve)
    thread.start()
    ready.wait()
    paths = [path for path, *_ in SCREENS] + [f"/{kind.word}" for kind in bench.kinds if kind.has_screen]
    attack, control = Attack(bench, server, chance), Attack(bench, server, chance)
    try:
        operator = attack.opened("operator", "/run")
        operator.beat()
        # A table is disarmed where its operator is gone, which a busy computer makes of silence.
        with operator, operator.beating():
            for stage in STAGES:
                prepare(bench, stage)
                # Screens of runs differ between stages, the others hardly: some of them are drawn.
                others = [path for path in paths if path not in FOLLOWERS]
                drawn = others if stage == "idle" else chance.sample(others, repetitions(len(others)))
                for path in [path for path in paths if path in FOLLOWERS or path in drawn]:
                    with attack.opened("viewer", path) as viewer:
                        if stage == "idle" and path == "/run":
                            operator.click("Arm the table")
                        attack.handlers(viewer, rounds)
                        if stage == "idle":
                            attack.messages(viewer, operator.client_id, rounds)
            unopened = attack.flood(attack.opened("viewer", "/"))
            attack.routes(attack.opened("viewer", "/"))
            attack.frames("viewer", rounds)
            with as_bench():
                bench.engine.leave()
            with attack.opened("operator", "/run", operator.cookie) as other:
                before = state_of(bench)
                other.fill("Table", "simulated:two-axis")
                other.click("Arm the table")
                control.look(before, "arm")
                control.handlers(other, 0, "taken")
            with attack.opened("operator", "/", operator.cookie) as other:
                control.handlers(other, 0, "taken")
    finally:
        server.should_exit = True
        thread.join()
        bench.close()
    kinds = dict(server.dropped.kinds)
    print(
        json.dumps(
            {
                "sent": attack.sent,
                "changes": attack.changes,
                "control": control.changes,
                "dropped": kinds,
                "unopened": unopened,
                "kept": gc.get_freeze_count(),
                "beside": sorted(asked[False]),
                "in_loop": sorted(asked[True]),
            }
        )
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
