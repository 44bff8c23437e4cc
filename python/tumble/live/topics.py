"""Topics that are sent somewhere: names, types, the quality of service that is offered, and rates."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias, cast

from tumble.foundation.errors import LogError
from tumble.live.address import Address, parse_address
from tumble.logs.optional import imported

HEARD_FOR: Final = 2.0
"""s for which topics are received to find their rates."""


@dataclass(frozen=True, slots=True)
class SentTopic:
    """A topic that somebody sends."""

    name: str
    """`/imu/data`."""
    type: str
    """`sensor_msgs/msg/Imu`."""
    quality: str
    """Offered quality of service, `reliable, volatile`; empty where the protocol has none."""
    source: str = ""
    """Address that reads it; empty where it is no IMU."""
    rate: float | None = None
    """Messages received a second, Hz; None where it was not received."""


Lister: TypeAlias = Callable[[Address], list[SentTopic]]

LISTERS: Final[Mapping[str, tuple[str, str, str]]] = {
    "ros2": ("tumble.live.ros2_listing", "list_topics", "ros2"),
    "ros2+zenoh": ("tumble.live.ros2_zenoh", "list_topics", "zenoh"),
    "foxglove": ("tumble.live.foxglove", "list_topics", "foxglove"),
}
"""Module, function and extra of each scheme whose topics can be listed."""


def list_topics(text: str) -> list[SentTopic]:
    """Returns the topics that are sent at an address, such as `ros2://`, by name; those of IMUs have rates.

    Raises `LogError` where such an address has no topics, or nobody answers there.
    """
    # An address without a topic names all of them.
    address = parse_address(re.sub(r"^([\w+]+:)//(?=\?|$)", r"\1///", text))
    if address.scheme not in LISTERS:
        raise LogError(f"{text}: has no topics; give one of {', '.join(f'{name}://' for name in LISTERS)}")
    module, function, extra = LISTERS[address.scheme]
    found = cast("Lister", getattr(imported(module, address.text, extra), function))(address)
    return sorted(found, key=lambda each: each.name)
