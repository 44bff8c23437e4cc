"""A port of which a test decides what waits there."""

from __future__ import annotations


class Backlog:
    """Datagrams that wait in a socket, each with its sender."""

    whole = True
    joined_midway = False
    reorder_window = 0.0
    unread = 0
    notices = ()
    sender = None

    def __init__(self):
        self.waiting = []

    def receive(self):
        if not self.waiting:
            return b""
        self.sender, datagram = self.waiting.pop(0)
        return datagram
