"""Topics of a domain of ROS 2 over DDS, with the rates of those of IMUs."""

from __future__ import annotations

from cyclonedds.core import Listener

from tumble.foundation import clock
from tumble.live.address import Address
from tumble.live.rate_watch import RateWatch
from tumble.live.ros2_domain import FOUND_WITHIN, MOST_WAITING, Domain, Sender
from tumble.live.ros2_names import IMU_TYPE, ros_name
from tumble.live.ros2_types import ImuMessage
from tumble.live.topics import HEARD_FOR, SentTopic


def list_topics(address: Address) -> list[SentTopic]:
    """Returns the topics of a domain; those of IMUs are received for `HEARD_FOR` s.

    Raises `LogError` where the domain cannot be joined.
    """
    address.refuse_other_settings("domain")
    domain = Domain.join(address)
    until = clock.now() + FOUND_WITHIN
    while clock.now() < until:
        domain.senders()
        clock.sleep(0.02)
    senders = domain.senders()
    rates = _rates(domain, [each for each in senders if each.type == IMU_TYPE])
    query = f"?domain={address.settings['domain']}" if "domain" in address.settings else ""
    return [
        SentTopic(
            each.name,
            ros_name(each.type),
            f"{each.reliability}, {each.durability}",
            f"ros2://{each.name}{query}" if each.type == IMU_TYPE else "",
            rates.get(each),
        )
        for each in senders
    ]


def _rates(domain: Domain, senders: list[Sender]) -> dict[Sender, float]:
    """Counts messages of each topic for `HEARD_FOR` s, from the first that comes."""
    readers = {each: domain.reader(each.name, each.reliability, Listener(), ImuMessage) for each in senders}  # type: ignore[no-untyped-call]
    watches = {each: RateWatch() for each in senders}
    until = clock.now() + HEARD_FOR
    while (now := clock.now()) < until:
        for each, reader in readers.items():
            watches[each].push(len(reader.take(N=MOST_WAITING)), now)
        clock.sleep(0.01)
    return {each: watch.rate(now) for each, watch in watches.items()}
