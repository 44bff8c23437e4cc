"""A browser without a screen: it opens a page of a bench, and sends what its scripts would send."""

from __future__ import annotations

import http.client
import json
import re
import ssl
import threading
import uuid
from contextlib import ExitStack, contextmanager, suppress
from html import unescape
from urllib.parse import urlencode, urlsplit

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from patience import PATIENCE

_CLIENT = re.compile(r"'client_id': '([^']+)'")
_ELEMENTS = re.compile(r"parseElements\(String\.raw`(.*?)`\)", re.DOTALL)
BETWEEN_BEATS = 0.3
"""s between two signs of life."""


def unsafe_tls():
    """Returns how a client trusts any server."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    return context


class BenchClient:
    """One page of one browser; `address` is that of operators or viewers, with the token."""

    def __init__(self, address: str, path: str = "/", cookie: str = "") -> None:
        self._place = urlsplit(address)
        self.cookie = cookie or self._entered()
        html = self.get(path)[1]
        self.client_id = _CLIENT.search(html).group(1)
        raw = _ELEMENTS.search(html).group(1)
        self.elements = {int(key): value for key, value in json.loads(unescape(raw)).items()}
        self._line = self._changed = self._thread = None
        self._stack = ExitStack()

    def _entered(self):
        query = f"/?{self._place.query}" if self._place.query else "/"
        status, _, headers = self.asked(query)
        assert status == 200, status
        return headers["set-cookie"].partition(";")[0]

    def asked(self, path, method="GET", **headers):
        """Asks once; returns status, text and headers."""
        kind = http.client.HTTPSConnection if self._place.scheme == "https" else http.client.HTTPConnection
        options = {"context": unsafe_tls()} if self._place.scheme == "https" else {}
        line = kind(self._place.hostname, self._place.port, timeout=PATIENCE, **options)
        try:
            line.request(method, path, None, headers)
            answer = line.getresponse()
            return answer.status, answer.read().decode("utf-8", "replace"), dict(answer.getheaders())
        finally:
            line.close()

    def get(self, path):
        """Opens a path; returns status and text."""
        return self.asked(path, Cookie=self.cookie)[:2]

    @property
    def site(self):
        """Scheme, host and port."""
        return f"{self._place.scheme}://{self._place.netloc}"

    def beat(self):
        """Gives a sign of life."""
        assert self.asked("/beat", "POST", Cookie=self.cookie, Origin=self.site)[0] == 204

    @contextmanager
    def beating(self):
        """Gives signs of life while the block runs."""
        over = threading.Event()

        def beat():
            with suppress(OSError, http.client.HTTPException):  # until the server has ended
                while not over.is_set():
                    self.beat()
                    over.wait(BETWEEN_BEATS)

        thread = threading.Thread(target=beat, daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def __enter__(self):
        site = self.site
        named = {"client_id": self.client_id, "tab_id": str(uuid.uuid4()), "document_id": str(uuid.uuid4())}
        query = {
            "EIO": 4,
            "transport": "websocket",
            "implicit_handshake": "true",
            "next_message_id": 0,
        } | named
        line = connect(
            f"{site.replace('http', 'ws')}/_nicegui_ws/socket.io/?{urlencode(query)}",
            additional_headers={"Cookie": self.cookie},
            origin=site,
            ssl=unsafe_tls() if self._place.scheme == "https" else None,
            max_size=None,
        )
        self._line = self._stack.enter_context(line)
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._receive, daemon=True)
        self._stack.callback(self._thread.join)
        self._stack.callback(self._line.close)
        self._answer, self._number, self._ended, self._is_closed = "", 0, set(), False
        self._line.send("40")
        self._thread.start()
        self.wait(lambda: self._answer)
        assert self._answer.startswith("40"), self._answer
        return self

    def __exit__(self, *_):
        self._stack.close()

    def send(self, name, *given):
        """Sends a message of a page, and waits until its handler has ended."""
        self._number += 1
        number = self._number
        self._line.send(f"42{number}{json.dumps([name, *given])}")
        self.wait(lambda: number in self._ended or self._is_closed)

    def send_raw(self, text):
        """Sends any frame."""
        self._line.send(text)

    def emit(self, element, kind, *given):
        """Has an element emit an event of a kind."""
        events = {each["type"]: each["listener_id"] for each in self.elements[element].get("events", ())}
        arguments = [json.dumps(each) for each in given]
        told = {"id": element, "client_id": self.client_id, "listener_id": events[kind], "args": arguments}
        self.send("event", told)

    def click(self, text):
        """Clicks what shows a text, or is named so."""
        self.emit(self.wait(lambda: self.found(text, "click")), "click")

    def fill(self, label, content):
        """Types into the field of a label, and leaves it."""
        self.emit(self.wait(lambda: self.field(label)), "taken", content)

    def found(self, text, event):
        """Returns the number of the first element with a text inside, or a name, that takes an event."""
        for number, each in self.elements.items():
            takes = event in {listener["type"] for listener in each.get("events", ())}
            if takes and (text in self.texts(number) or each.get("props", {}).get("aria-label") == text):
                return number
        return None

    def field(self, label):
        """Returns the number of the field with a label."""
        for each in self.elements.values():
            target = each.get("props", {}).get("for")
            if target and each.get("text") == label:
                return int(target[1:])
        # The label of a field that is ticked stands around it.
        for number, each in self.elements.items():
            if each["tag"] == "label" and label in self.texts(number):
                return next(child for child in each["children"] if self.elements[child].get("events"))
        return None

    def texts(self, number):
        """Returns all texts within an element."""
        each = self.elements.get(number, {})
        own = [each["text"]] if each.get("text") else []
        return own + [text for child in each.get("children", ()) for text in self.texts(child)]

    def shows(self, text):
        """Returns whether an element shows a text."""
        return any(text in (each.get("text") or "") for each in tuple(self.elements.values()))

    def wait(self, condition):
        """Waits until a condition is true, which it looks at after each message; returns what it gave."""
        with self._changed:
            found = self._changed.wait_for(condition, PATIENCE)
        assert found, "not within the time"
        return found

    def _receive(self):
        try:
            for frame in self._line:
                if frame == "2":
                    self._line.send("3")
                elif isinstance(frame, str):
                    with self._changed:
                        self._take(frame)
                        self._changed.notify_all()
        except ConnectionClosed:
            pass
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()

    def _take(self, frame):
        if frame.startswith(("40", "44")):
            self._answer = frame
        elif frame.startswith("43"):
            self._ended.add(int(frame[2:].partition("[")[0]))
        elif frame.startswith("42"):
            name, told = json.loads(frame[2:])
            if name == "update":
                told.pop("_id", None)
                for key, element in told.items():
                    if element is None:
                        self.elements.pop(int(key), None)
                    else:
                        self.elements[int(key)] = element
