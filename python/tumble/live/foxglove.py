"""Topics of Foxglove's WebSocket protocol, as foxglove_bridge and Foxglove's SDK serve them.

`foxglove://HOST:PORT/TOPIC`. Subprotocols `foxglove.sdk.v1` and `foxglove.websocket.v1`
(github.com/foxglove/ws-protocol, docs/spec.md), which agree in what is used here.
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from threading import Thread
from typing import Any, Final

from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from tumble.foundation import clock
from tumble.foundation.bounded_json import JsonError, parse_json
from tumble.foundation.errors import LogError
from tumble.live.address import Address, host_and_port
from tumble.live.mailbox import Mailbox
from tumble.live.message_source import MessageSource
from tumble.live.rate_watch import RateWatch
from tumble.live.topics import HEARD_FOR, SentTopic
from tumble.logs.message_decoder import READ, decoder_of, may_be_imu
from tumble.logs.message_form import Definition
from tumble.logs.message_imu import ImuDecoder
from tumble.logs.options import ReadOptions

SUBPROTOCOLS: Final = (Subprotocol("foxglove.sdk.v1"), Subprotocol("foxglove.websocket.v1"))
ADVERTISED_WITHIN: Final = 2.0
"""s for which a server may take until it advertises a topic."""
LARGEST_MESSAGE: Final = 1 << 24
"""Bytes of a message beyond which a server is not listened to."""
MOST_QUEUED: Final = 16
"""Messages that the library receives ahead of the mailbox; the server waits meanwhile."""
MOST_TOPICS: Final = 4096
"""Topics that a server advertises, beyond which it is not listened to."""
_DATA: Final = struct.Struct("<BIQ")
"""Opcode, subscription and receive time, ns, before the payload."""
_OPCODE: Final = 1
_TIMEOUT: Final = 5.0
"""s to connect."""


@dataclass(frozen=True, slots=True)
class _Channel:
    """A topic as a server advertises it."""

    number: int
    topic: str
    definition: Definition


def open_foxglove(address: Address, options: ReadOptions) -> FoxgloveSource:
    """Opens `foxglove://HOST:PORT/TOPIC`; raises `LogError` where the address is none."""
    address.refuse_other_settings()
    host, _, topic = address.place.partition("/")
    host_and_port(address, host)
    if not topic:
        raise LogError(
            f"{address.text}: names no topic; give foxglove://{host}/TOPIC, one of those that "
            f"tumble record --list foxglove://{host} prints"
        )
    return FoxgloveSource(address, f"/{topic}", options)


class FoxgloveSource(MessageSource):
    """Reads one topic of a server."""

    def __init__(self, address: Address, topic: str, options: ReadOptions) -> None:
        super().__init__(address, topic, options)
        self._channel: _Channel | None = None

    @property
    def _about(self) -> str:
        return "" if self._channel is None else f"as {self._channel.definition.encoding}"

    def _decoder_for(self, first: bytes) -> ImuDecoder:
        assert self._channel is not None, "messages come from a channel"
        return decoder_of(f"{self._address.text}", self._channel.definition, first)

    def _receive(self, mailbox: Mailbox, opened: ExitStack) -> None:
        connection = opened.enter_context(_connected(self._address))
        found: dict[str, _Channel] = {}
        for channel in _advertised(connection, self._address):
            found[channel.topic] = channel
            # Topics of ROS begin with a slash, those of others may not.
            if channel.topic.strip("/") == self.topic.strip("/"):
                self._channel = channel
                break
        if self._channel is None:
            topics = (
                ", ".join(f"{each.topic} ({each.definition.type})" for _, each in sorted(found.items()))
                or "none"
            )
            raise LogError(f"{self._address.text}: nobody sends {self.topic} there; topics: {topics}")
        if self._channel.definition.encoding not in READ:
            raise LogError(
                f"{self._address.text}: messages are {self._channel.definition.encoding}; those in "
                f"{', '.join(READ)} are read"
            )
        if self._channel.definition.encoding != "json":
            # Only messages of JSON need to be seen first.
            decoder_of(self._address.text, self._channel.definition, b"")
        _subscribe(connection, {0: self._channel})
        # It ends with the connection.
        Thread(target=self._pass_on, args=(connection, mailbox), daemon=True).start()

    def _pass_on(self, connection: ClientConnection, mailbox: Mailbox) -> None:
        try:
            for message in connection:
                if isinstance(message, bytes) and (found := _payload(message)) is not None:
                    mailbox.put(found[1])
        except (WebSocketException, OSError):
            pass  # as at its end
        mailbox.fail(LogError(f"{self._address.text}: the server has closed the connection; is it running?"))


def list_topics(address: Address) -> list[SentTopic]:
    """Returns the topics that a server advertises; those of IMUs are received for `HEARD_FOR` s.

    Raises `LogError` where no server answers.
    """
    address.refuse_other_settings()
    host = address.place.partition("/")[0]
    with _connected(address) as connection:
        channels = list(_advertised(connection, address))
        imus = {number: each for number, each in enumerate(channels) if may_be_imu(each.definition)}
        _subscribe(connection, imus)
        watches = {number: RateWatch() for number in imus}
        until = clock.now() + (HEARD_FOR if imus else 0.0)
        while (left := until - clock.now()) > 0.0:
            for message in _messages(connection, left, address):
                found = _payload(message) if isinstance(message, bytes) else None
                if found is not None and found[0] in watches:
                    watches[found[0]].push(1, clock.now())
    return [
        SentTopic(
            each.topic,
            f"{each.definition.type or '?'} ({each.definition.encoding})",
            "",
            f"foxglove://{host}/{each.topic.strip('/')}" if number in imus else "",
            watches[number].rate(until) if number in imus else None,
        )
        for number, each in enumerate(channels)
    ]


@contextmanager
def _connected(address: Address) -> Iterator[ClientConnection]:
    host, port = host_and_port(address, address.place.partition("/")[0])
    shown = f"[{host}]" if ":" in host else host
    with ExitStack() as stack:
        try:
            connection = stack.enter_context(
                connect(
                    f"ws://{shown}:{port}",
                    subprotocols=SUBPROTOCOLS,
                    compression=None,
                    open_timeout=_TIMEOUT,
                    close_timeout=1.0,
                    max_size=LARGEST_MESSAGE,
                    max_queue=MOST_QUEUED,
                )
            )
        except (WebSocketException, OSError) as error:
            raise LogError(
                f"{address.text}: no server of Foxglove's protocol answers: {error}; is it running, at this "
                "port?"
            ) from error
        yield connection


def _advertised(connection: ClientConnection, address: Address) -> Iterator[_Channel]:
    """Returns channels as they are advertised, for `ADVERTISED_WITHIN` s.

    Raises `LogError` where there are more than `MOST_TOPICS`, or the line is lost.
    """
    until, count = clock.now() + ADVERTISED_WITHIN, 0
    while (left := until - clock.now()) > 0.0:
        for message in _messages(connection, left, address):
            content = _json(message) if isinstance(message, str) else {}
            channels = content.get("channels")
            if content.get("op") == "advertise" and isinstance(channels, list):
                count += len(channels)
                if count > MOST_TOPICS:
                    raise LogError(
                        f"{address.text}: the server advertises more than {MOST_TOPICS} topics; have it send "
                        "fewer"
                    )
                yield from filter(None, map(_channel, channels))


def _messages(connection: ClientConnection, longest: float, address: Address) -> Iterator[str | bytes]:
    """Returns the next message, none where none comes within so many s; `LogError` where the line is lost."""
    try:
        yield connection.recv(longest)
    except TimeoutError:
        return
    except (WebSocketException, OSError) as error:
        raise LogError(f"{address.text}: the server has closed the connection: {error}") from error


def _json(text: str) -> Mapping[str, Any]:
    try:
        content = parse_json(text)
    except JsonError:
        return {}
    return content if isinstance(content, dict) else {}


def _channel(stated: Any) -> _Channel | None:  # noqa: ANN401 - whatever JSON holds
    """Reads an advertisement; None where it is none."""
    try:
        number, topic, encoding = stated["id"], stated["topic"], stated["encoding"]
        kind, schema = stated.get("schemaName", ""), stated.get("schema", "")
        # Schemas of these are binary, in base64.
        is_binary = (stated.get("schemaEncoding") or encoding) in ("protobuf", "flatbuffer")
        text = base64.b64decode(schema, validate=True) if is_binary else schema.encode()
        return _Channel(int(number), str(topic), Definition(str(encoding), str(kind), text))
    except (TypeError, KeyError, AttributeError, ValueError, OverflowError, binascii.Error):
        return None


def _subscribe(connection: ClientConnection, channels: Mapping[int, _Channel]) -> None:
    wanted = [{"id": number, "channelId": each.number} for number, each in channels.items()]
    if wanted:
        connection.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


def _payload(message: bytes) -> tuple[int, bytes] | None:
    """Returns subscription and payload of message data; None of anything else."""
    if len(message) < _DATA.size or message[0] != _OPCODE:
        return None
    return _DATA.unpack_from(message)[1], message[_DATA.size :]
