"""Bags of ROS by the library `rosbags`: topics with their types and definitions."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Hashable, Iterable, Iterator
from pathlib import Path
from typing import Any, ClassVar

from tumble.logs.bags import Topic, check_name, kind_of, remedy
from tumble.logs.damage import damage_said
from tumble.logs.message_form import Definition
from tumble.logs.rosmsg import Encoding

_REMARK = re.compile("#[^\n]*")


def definitions_of(connections: Iterable[Any]) -> Iterator[tuple[str, Hashable]]:
    """Returns, for each connection, its topic, and type and definition of its messages without remarks."""
    for each in connections:
        words = _REMARK.sub("", each.msgdef.data).split()
        yield each.topic, (each.msgtype, tuple(words))


class RosBag(ABC):
    """Topics of a bag, read from its head."""

    format: str
    remarks: tuple[str, ...] = ()
    encoding: ClassVar[Encoding]
    """Encoding of its messages."""
    encoding_name: ClassVar[str]
    """The same in definitions: `ros1` or `cdr`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with damage_said(path, remedy(path)), self._reader() as reader:
            self._types = {check_name(each.topic): check_name(each.msgtype) for each in reader.connections}
            self._definitions = {
                connection.topic: Definition(
                    self.encoding_name,
                    connection.msgtype,
                    connection.msgdef.data.encode("utf-8", "replace"),
                )
                for connection in reader.connections
            }

    @abstractmethod
    def _reader(self) -> Any:  # noqa: ANN401 - readers of both versions share no type
        """Reader of the library for this kind of bag."""

    def all_topics(self) -> dict[str, str]:
        """Type of every topic, by name."""
        return self._types

    def definitions(self) -> dict[str, Definition]:
        """Definitions of the messages of each topic."""
        return self._definitions

    def topics(self) -> list[Topic]:
        """Topics of the kinds we read."""
        kinds = {name: kind_of(message_type) for name, message_type in self._types.items()}
        return [Topic(name, kind, self.encoding) for name, kind in kinds.items() if kind is not None]

    def facts(self) -> dict[str, str]:
        """Tumble writes no such bags."""
        return {}
