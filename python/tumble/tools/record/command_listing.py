"""Topics that can be recorded, as `tumble record --list` prints them."""

from __future__ import annotations

from dataclasses import asdict

from tumble.cli.screen import print_event, print_summary


def show_topics(address: str, *, as_json: bool) -> None:
    """Print the topics that are sent at an address, with the source that reads each IMU."""
    from tumble.live.topics import list_topics

    topics = list_topics(address)
    if as_json:
        print_event("topics", {"topics": [asdict(each) for each in topics]})
        return
    if not topics:
        print(f"nobody sends a topic at {address}")
        return
    from rich.table import Table

    table = Table("topic", "type", "quality of service", "rate", "source", box=None)
    for each in topics:
        rate = "" if each.rate is None else f"{each.rate:.0f} Hz"
        table.add_row(each.name, each.type, each.quality, rate, each.source)
    print_summary(table)
