"""A domain of ROS 2 on this network, without ROS: its topics of IMUs, readers and writers of them."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.core import DDSException, InstanceState, Listener, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from tumble.foundation.errors import LogError
from tumble.live.address import Address
from tumble.live.ros2_types import IMU_TYPE, ImuMessage

BELOW = "rt"
"""Front of the names that topics of ROS 2 have on DDS."""
MOST_WAITING = 4096
"""Messages that wait for their reader before the oldest is lost."""
FOUND_WITHIN = 2.0
"""s to look for who sends a topic: participants announce themselves at once, and again every few seconds."""
MOST_DOMAIN = 232
"""Largest number of a domain whose ports exist."""
RELIABLE, BEST_EFFORT = "reliable", "best-effort"
QOS = (RELIABLE, BEST_EFFORT)


@dataclass(frozen=True, slots=True)
class SentTopic:
    """A topic of `sensor_msgs/Imu` that somebody sends."""

    name: str
    """`/imu/data`."""
    reliability: str
    """One of `QOS`."""

    def __str__(self) -> str:
        return f"{self.name} ({self.reliability})"


class Domain:
    """A participant in a domain.

    Raises `LogError`, in one line, where DDS refuses, as it does without a network.
    """

    def __init__(self, address: Address) -> None:
        self._address = address
        self.number = _number(address)
        try:
            self._participant = DomainParticipant(self.number)
            self._publications = BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication)
        except DDSException as error:
            raise LogError(
                f"{address.text}: domain {self.number} of ROS 2 cannot be joined: {error.msg}; check the "
                "network, and CYCLONEDDS_URI if it is set"
            ) from error
        self._sent: dict[int, SentTopic] = {}
        """By handle of its writer."""

    def sent(self) -> list[SentTopic]:
        """Returns topics of IMUs that are sent, as far as they are known by now."""
        for endpoint in self._publications.take(N=MOST_WAITING):
            writer = endpoint.sample_info.instance_handle
            if endpoint.sample_info.instance_state != InstanceState.Alive:
                self._sent.pop(writer, None)
            elif endpoint.type_name == IMU_TYPE and endpoint.qos is not None:
                name = endpoint.topic_name.removeprefix(BELOW)
                self._sent[writer] = SentTopic(name, _reliability(endpoint.qos))
        return list(dict.fromkeys(self._sent.values()))

    def find(self, topic: str) -> SentTopic | None:
        """Waits `FOUND_WITHIN` s at most for somebody who sends the topic."""
        until = time.monotonic() + FOUND_WITHIN
        while time.monotonic() < until:
            if found := [each for each in self.sent() if each.name == topic]:
                # A reader that asks for more than a sender offers receives nothing of it.
                return min(found, key=lambda each: each.reliability == RELIABLE)
            time.sleep(0.02)
        return None

    def reader(self, topic: str, reliability: str, listener: Listener) -> DataReader[ImuMessage]:
        """Creates a reader of a topic."""
        return DataReader(self._participant, self._topic(topic), qos=_qos(reliability), listener=listener)

    def writer(self, topic: str) -> DataWriter[ImuMessage]:
        """Creates a reliable writer of a topic, for readers of either kind."""
        return DataWriter(self._participant, self._topic(topic), qos=_qos(RELIABLE))

    def _topic(self, topic: str) -> Topic[ImuMessage]:
        return Topic(self._participant, BELOW + topic, ImuMessage)


def _number(address: Address) -> int:
    """Returns the domain of an address, else that of ROS_DOMAIN_ID, else 0."""
    text = address.settings.get("domain", os.environ.get("ROS_DOMAIN_ID", "") or "0")
    if not (text.isascii() and text.isdigit() and int(text) <= MOST_DOMAIN):
        raise LogError(f"{address.text}: domain {text!r}: give a number from 0 to {MOST_DOMAIN}")
    return int(text)


def _qos(reliability: str) -> Qos:
    # A writer waits so long for a slow reader, and then goes on without it.
    reliable = Policy.Reliability.Reliable(duration(milliseconds=100))
    return Qos(
        reliable if reliability == RELIABLE else Policy.Reliability.BestEffort,
        Policy.History.KeepLast(MOST_WAITING),
    )


def _reliability(qos: Qos) -> str:
    return BEST_EFFORT if Policy.Reliability.BestEffort in qos else RELIABLE
