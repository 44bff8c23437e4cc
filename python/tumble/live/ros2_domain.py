"""A domain of ROS 2 on this network, without ROS: its topics of IMUs, readers and writers of them."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock
from typing import ClassVar, TypeVar
from weakref import WeakValueDictionary

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.core import DDSException, InstanceState, Listener, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.live.address import Address
from tumble.live.ros2_names import IMU_TYPE, ros_domain
from tumble.live.ros2_types import FieldMessage, ImuMessage

Message = TypeVar("Message", ImuMessage, FieldMessage)
BELOW = "rt"
"""Front of the names that topics of ROS 2 have on DDS."""
MOST_WAITING = 4096
"""Messages that wait for their reader before the oldest is lost."""
FOUND_WITHIN = 2.0
"""s to look for who sends a topic: participants announce themselves at once, and again every few seconds."""
RELIABLE, BEST_EFFORT = "reliable", "best-effort"
QOS = (RELIABLE, BEST_EFFORT)


@dataclass(frozen=True, slots=True)
class Sender:
    """A topic as one of its senders offers it."""

    name: str
    """`/imu/data`."""
    type: str
    """Type as DDS names it."""
    reliability: str
    """One of `QOS`."""
    durability: str
    """`volatile`, or `transient local` where the last messages are kept for who comes late."""

    def __str__(self) -> str:
        return f"{self.name} ({self.reliability})"


class Domain:
    """A participant in a domain, one for all topics of a process; `join` makes it.

    Raises `LogError`, in one line, where DDS refuses, as it does without a network.
    """

    _joined: ClassVar[WeakValueDictionary[int, Domain]] = WeakValueDictionary()
    _joining: ClassVar[Lock] = Lock()

    def __init__(self, number: int, typed: str) -> None:
        self.number = number
        try:
            self._participant = DomainParticipant(number)
            self._publications = BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication)
        except DDSException as error:
            raise LogError(
                f"{typed}: domain {number} of ROS 2 cannot be joined: {error.msg}; check the "
                "network, and CYCLONEDDS_URI if it is set"
            ) from error
        self._senders: dict[int, Sender] = {}
        """By handle of their writers."""
        self._taking = Lock()

    @classmethod
    def join(cls, address: Address) -> Domain:
        """Returns the participant of this process in a domain; it leaves once nobody holds it."""
        number = ros_domain(address)
        with cls._joining:
            domain = cls._joined.get(number)
            if domain is None:
                domain = cls._joined[number] = Domain(number, address.text)
            return domain

    def senders(self) -> list[Sender]:
        """Returns what is sent, as far as it is known by now; several senders of one kind count once."""
        with self._taking:
            for endpoint in self._publications.take(N=MOST_WAITING):
                writer = endpoint.sample_info.instance_handle
                if endpoint.sample_info.instance_state != InstanceState.Alive:
                    self._senders.pop(writer, None)
                elif endpoint.topic_name.startswith(f"{BELOW}/") and endpoint.qos is not None:
                    self._senders[writer] = Sender(
                        endpoint.topic_name.removeprefix(BELOW),
                        endpoint.type_name,
                        _reliability(endpoint.qos),
                        _durability(endpoint.qos),
                    )
            return list(dict.fromkeys(self._senders.values()))

    def sent(self) -> list[Sender]:
        """Returns topics of IMUs that are sent, as far as they are known by now."""
        return [each for each in self.senders() if each.type == IMU_TYPE]

    def find(self, topic: str, kind: str = IMU_TYPE) -> Sender | None:
        """Waits `FOUND_WITHIN` s at most for somebody who sends the topic, messages of a type."""
        until = clock.now() + FOUND_WITHIN
        while clock.now() < until:
            if found := [each for each in self.senders() if (each.name, each.type) == (topic, kind)]:
                # A reader that asks for more than a sender offers receives nothing of it.
                return min(found, key=lambda each: each.reliability == RELIABLE)
            clock.sleep(0.02)
        return None

    def reader(
        self, topic: str, reliability: str, listener: Listener, kind: type[Message]
    ) -> DataReader[Message]:
        """Creates a reader of a topic of messages of a type."""
        return DataReader(
            self._participant, self._topic(topic, kind), qos=_qos(reliability), listener=listener
        )

    def writer(self, topic: str, kind: type[Message]) -> DataWriter[Message]:
        """Creates a reliable writer of a topic, for readers of either kind."""
        return DataWriter(self._participant, self._topic(topic, kind), qos=_qos(RELIABLE))

    def _topic(self, topic: str, kind: type[Message]) -> Topic[Message]:
        return Topic(self._participant, BELOW + topic, kind)


def _qos(reliability: str) -> Qos:
    # A writer waits so long for a slow reader, and then goes on without it.
    reliable = Policy.Reliability.Reliable(duration(milliseconds=100))
    return Qos(
        reliable if reliability == RELIABLE else Policy.Reliability.BestEffort,
        Policy.History.KeepLast(MOST_WAITING),
    )


def _durability(qos: Qos) -> str:
    return "volatile" if Policy.Durability.Volatile in qos else "transient local"


def _reliability(qos: Qos) -> str:
    return BEST_EFFORT if Policy.Reliability.BestEffort in qos else RELIABLE
