"""Messages as `ros2 topic echo` and `rostopic echo` print them: YAML over many lines, `---` after each."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence

import yaml

from tumble.foundation.bounded_yaml import parse

BEGIN, END = b"header:", b"---"
_SECOND = re.compile(rb"\s+\w+:(\s|$)")
"""A field of the header, which no other stream has behind a line that reads `header:`."""
_FURTHER = re.compile(rb"\s*(\w+:|-)(\s|$)")
"""A field at any depth, or an item of a list."""
MOST_LINES = 400
"""Lines of a message; `sensor_msgs/Imu` has 52."""


class EchoedMessages:
    """Gathers the lines of a message into one line of JSON; other lines pass.

    A line that cannot belong to the open message shows that it is none: all its lines pass.
    """

    def __init__(self) -> None:
        self._lines: list[bytes] = []
        self._has_begun = False
        """Indicates whether a message was seen: from then on `---` belongs to one."""

    def gather(self, lines: Sequence[bytes]) -> Iterator[bytes]:
        """Returns lines, each message that is whole by now as one of them."""
        for line in lines:
            text = line.rstrip()
            if text == BEGIN:
                # An open message without its end passes on as a line, and its reader counts it.
                yield from self._lines[:1]
                self._lines, self._has_begun = [line], True
            elif self._lines and text == END:
                yield self._object()
                self._lines = []
            elif self._lines and self._goes_on_with(line):
                self._lines.append(line)
            elif not (self._has_begun and text == END):
                yield from (*self._lines, line)
                self._lines = []

    def _goes_on_with(self, line: bytes) -> bool:
        """Returns whether a line can be the next one of the open message."""
        part = _SECOND if len(self._lines) == 1 else _FURTHER
        return len(self._lines) < MOST_LINES and part.match(line) is not None

    def _object(self) -> bytes:
        """Returns the message as JSON, or its first line where it cannot be read."""
        try:
            _, content = parse(b"\n".join(self._lines).decode("utf-8", "replace"))
            return json.dumps(content, default=str).encode()
        except (yaml.YAMLError, RecursionError):
            return self._lines[0]
