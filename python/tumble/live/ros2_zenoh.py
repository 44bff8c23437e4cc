"""Topics of ROS 2 over Zenoh, as rmw_zenoh sends them, without ROS: `ros2+zenoh:///imu/data`.

Keys are `DOMAIN/TOPIC/TYPE/HASH`, messages CDR; each sender has a liveliness token
`@ros2_lv/DOMAIN/SESSION/NODE/ENTITY/MP/ENCLAVE/NAMESPACE/NAME/TOPIC/TYPE/HASH/QOS` in which `%` stands for
a slash, and quality of service that is the default is left out (github.com/ros2/rmw_zenoh, docs/design.md and
liveliness_utils.cpp).
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Collection
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Final

import zenoh

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.live.address import Address
from tumble.live.field_pairing import FieldPairing
from tumble.live.mailbox import Mailbox
from tumble.live.message_source import MessageSource
from tumble.live.rate_watch import RateWatch
from tumble.live.ros2_names import FIELD_TYPE, IMU_TYPE, ros_domain, ros_name
from tumble.live.topics import HEARD_FOR, SentTopic
from tumble.logs.message_imu import ImuDecoder, PlainImu
from tumble.logs.options import ReadOptions
from tumble.logs.rosmsg import CDR, MalformedMessageError, decode, seconds
from tumble.logs.track import RawSamples, StatedUnit

ROUTER: Final = "tcp/localhost:7447"
"""Router that nodes of rmw_zenoh look for."""
CONFIG: Final = "ZENOH_SESSION_CONFIG_URI"
"""Environment variable with a configuration file, as for nodes of rmw_zenoh."""
FOUND_WITHIN: Final = 3.0
"""s to look for who sends a topic, where others are found."""
ANYBODY_WITHIN: Final = 10.0
"""s to look for anybody: on a busy computer a session takes seconds to learn of the others."""
_TOKENS: Final = "@ros2_lv"
_PARTS: Final = 13
_KIND, _TOPIC, _TYPE, _QUALITY = 5, 9, 10, 12
_PUBLISHER: Final = "MP"
_RELIABILITIES: Final = {"": "reliable", "1": "reliable", "2": "best-effort"}
_DURABILITIES: Final = {"": "volatile", "1": "transient local", "2": "volatile"}


@dataclass(frozen=True, slots=True)
class ZenohSender:
    """A topic as one of its senders announces it."""

    topic: str
    type: str
    quality: str


def open_zenoh(address: Address, options: ReadOptions) -> ZenohSource:
    """Opens `ros2+zenoh:///imu/data`; `domain=` is its number, `router=` the end point to connect to.

    `magnetometer=` is a topic of `sensor_msgs/MagneticField` to be read beside it. Raises `LogError` where
    these are none.
    """
    address.refuse_other_settings("domain", "router", "magnetometer")
    ros_domain(address)
    return ZenohSource(address, "/" + address.place.strip("/"), options)


class ZenohSource(MessageSource):
    """Reads one topic of `sensor_msgs/Imu`, and the magnetometer that is named beside it."""

    magnetometer_unit = StatedUnit("T", "sensor_msgs/MagneticField")

    def __init__(self, address: Address, topic: str, options: ReadOptions) -> None:
        super().__init__(address, topic, options)
        self._field_topic = address.settings.get("magnetometer", "")
        self._fields: Mailbox | None = None
        self._pairing = FieldPairing()

    @property
    def _about(self) -> str:
        return "over Zenoh"

    def _fields_beside(self, samples: RawSamples) -> FloatArray | None:
        if self._fields is None:
            return None
        assert samples.time is not None, "messages of ROS are stamped"
        if messages := self._fields.take():
            try:
                found = decode(messages, "magnetometer", CDR)
            except MalformedMessageError as error:
                raise LogError(
                    f"{self._address.text}: a message of {self._field_topic} {error}: not "
                    "sensor_msgs/MagneticField; check what sends it"
                ) from error
            self._pairing.add(seconds(found.stamp), found.magnetic_field)
        return self._pairing.beside(samples.time)

    def _decoder_for(self, first: bytes) -> ImuDecoder:
        return PlainImu(CDR)

    def _receive(self, mailbox: Mailbox, opened: ExitStack) -> None:
        session = _session(self._address)
        opened.callback(session.close)
        domain, come = ros_domain(self._address), threading.Event()

        def take(sample: zenoh.Sample) -> None:
            mailbox.put(bytes(sample.payload))
            come.set()

        if self._field_topic:
            fields: Mailbox = Mailbox()
            opened.callback(fields.close)
            self._fields = fields
            key = imu_key(domain, self._field_topic, FIELD_TYPE)
            session.declare_subscriber(key, lambda sample: fields.put(bytes(sample.payload)))
        session.declare_subscriber(imu_key(domain, self.topic), take)
        began = clock.now()
        # An answer may come too late to one look, and in time to another.
        senders: dict[ZenohSender, None] = {}
        # Senders that are no nodes of ROS, such as bridges, announce nothing, but their messages come.
        while not clock.wait(come, 0.05) and _goes_on(began, senders):
            senders |= dict.fromkeys(_senders(session, domain))
            if any(each.topic == self.topic and each.type == IMU_TYPE for each in senders):
                return
        if not come.is_set():
            raise LogError(_nobody(self._address, domain, self.topic, list(senders)))


def list_topics(address: Address) -> list[SentTopic]:
    """Returns the topics that nodes of a domain announce; those of IMUs are received for `HEARD_FOR` s.

    Raises `LogError` where no session can be opened.
    """
    address.refuse_other_settings("domain", "router")
    domain = ros_domain(address)
    session = _session(address)
    try:
        began = clock.now()
        while not (senders := _senders(session, domain)) and _goes_on(began, senders):
            clock.sleep(0.05)
        imus = {each.topic for each in senders if each.type == IMU_TYPE}
        watches = {topic: RateWatch() for topic in imus}

        def watching(topic: str) -> Any:  # noqa: ANN401 - a callback
            return lambda _sample: watches[topic].push(1, clock.now())

        for topic in imus:
            session.declare_subscriber(imu_key(domain, topic), watching(topic))
        if imus:
            clock.sleep(HEARD_FOR)
        now = clock.now()
    finally:
        session.close()  # type: ignore[no-untyped-call]
    query = "&".join(f"{key}={value}" for key, value in address.settings.items())
    return [
        SentTopic(
            each.topic,
            ros_name(each.type),
            each.quality,
            f"ros2+zenoh://{each.topic}{'?' if query else ''}{query}" if each.topic in imus else "",
            watches[each.topic].rate(now) if each.topic in imus else None,
        )
        for each in senders
    ]


def imu_key(domain: int, topic: str, kind: str = IMU_TYPE) -> str:
    """Returns the key expression of the messages of a topic, whatever the hash of their type."""
    return f"{domain}/{topic.strip('/')}/{kind}/*"


def sender_of(token: str) -> ZenohSender | None:
    """Reads the token of a sender; None where it is of something else."""
    parts = token.split("/")
    if len(parts) != _PARTS or parts[0] != _TOKENS or parts[_KIND] != _PUBLISHER:
        return None
    reliability, durability, *_ = [*parts[_QUALITY].split(":"), "", ""]
    quality = f"{_RELIABILITIES.get(reliability, '?')}, {_DURABILITIES.get(durability, '?')}"
    return ZenohSender(parts[_TOPIC].replace("%", "/"), parts[_TYPE].replace("%", "/"), quality)


def _goes_on(began: float, senders: Collection[ZenohSender]) -> bool:
    """Returns whether the search that began at a time goes on."""
    return clock.now() - began < (FOUND_WITHIN if senders else ANYBODY_WITHIN)


def _senders(session: zenoh.Session, domain: int) -> list[ZenohSender]:
    """Asks for the senders that are there now; several of one kind count once."""
    found = []
    for reply in session.liveliness().get(f"{_TOKENS}/{domain}/**", timeout=1.0):
        if reply.ok is not None and (sender := sender_of(str(reply.ok.key_expr))) is not None:
            found.append(sender)
    return list(dict.fromkeys(found))


def _session(address: Address) -> zenoh.Session:
    """Opens a session as a node of rmw_zenoh does: a peer of the router, without multicast.

    Raises `LogError` where that fails; a router that is not there is waited for by Zenoh itself.
    """
    try:
        if (path := os.environ.get(CONFIG)) and "router" not in address.settings:
            return zenoh.open(zenoh.Config.from_file(path))
        config = zenoh.Config()
        config.insert_json5("mode", '"peer"')
        end_point = json.dumps([address.settings.get("router", ROUTER)])
        config.insert_json5("connect/endpoints", end_point)
        config.insert_json5("connect/timeout_ms", "0")
        config.insert_json5("connect/exit_on_failure", "false")
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("listen/endpoints", '["tcp/localhost:0"]')
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise LogError(
            f"{address.text}: no session of Zenoh: {' '.join(str(error).split())}; check router= and {CONFIG}"
        ) from error


def _nobody(address: Address, domain: int, topic: str, senders: list[ZenohSender]) -> str:
    """Returns the error for a topic that nobody sends, with those of IMUs that somebody does."""
    sent = ", ".join(f"{each.topic} ({each.quality})" for each in senders if each.type == IMU_TYPE)
    where = f"domain {domain} over Zenoh"
    if sent:
        return f"{address.text}: nobody sends {topic} in {where}; topics of sensor_msgs/Imu there: {sent}"
    return (
        f"{address.text}: nobody sends a sensor_msgs/Imu in {where}; is the router running "
        "(ros2 run rmw_zenoh_cpp rmw_zenohd), is router= where it is, and is ?domain= or ROS_DOMAIN_ID right?"
    )
