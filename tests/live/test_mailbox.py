"""Messages wait in bounded memory, and are taken in pieces between which others have their turn."""

from __future__ import annotations

import pytest

from tumble.foundation import clock
from tumble.live.mailbox import AT_ONCE, MOST_BYTES, MOST_KEPT, Mailbox


@pytest.fixture
def mailbox():
    found = Mailbox()
    yield found
    found.close()


def is_ready(mailbox):
    return clock.readable(mailbox.fileno(), 0.0)


def taken(mailbox):
    """Takes all that waits; returns its pieces."""
    pieces = []
    while is_ready(mailbox):
        pieces.append(mailbox.take())
    return pieces


def test_messages_wait_in_bounded_memory(mailbox):
    message = bytes(MOST_BYTES // 8)
    for number in range(20):
        mailbox.put(message + bytes([number]))
    kept = [each for piece in taken(mailbox) for each in piece]
    assert sum(map(len, kept)) <= MOST_BYTES
    assert [each[-1] for each in kept] == list(range(13, 20))
    assert mailbox.lost == 13


def test_number_of_messages_is_bounded(mailbox):
    for number in range(MOST_KEPT + 5):
        mailbox.put(b"%d" % number)
    kept = [each for piece in taken(mailbox) for each in piece]
    assert (len(kept), kept[0], mailbox.lost) == (MOST_KEPT, b"5", 5)


def test_messages_are_taken_in_pieces_of_bounded_length(mailbox):
    messages = [bytes(AT_ONCE // 3), *3 * [bytes(AT_ONCE // 2)], bytes(3 * AT_ONCE), b"last"]
    for each in messages:
        mailbox.put(each)
    pieces = taken(mailbox)
    assert [each for piece in pieces for each in piece] == messages
    assert [len(piece) for piece in pieces] == [2, 2, 1, 1]
    assert mailbox.take() == []


def test_failure_comes_after_all_messages(mailbox):
    for _ in range(2):
        mailbox.put(bytes(AT_ONCE))
    mailbox.fail(ValueError("over"))
    assert [len(mailbox.take()) for _ in range(2)] == [1, 1]
    with pytest.raises(ValueError, match="over"):
        mailbox.take()
