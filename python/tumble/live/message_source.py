"""A source whose messages another thread receives: topics of Foxglove's protocol and of Zenoh."""

from __future__ import annotations

from abc import abstractmethod
from contextlib import ExitStack
from types import TracebackType
from typing import TypeVar

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of
from tumble.live.address import Address
from tumble.live.conditioning import EMPTY, ConditionedSource
from tumble.live.mailbox import Mailbox
from tumble.live.readings import Readings, StreamFacts
from tumble.live.source import LiveChunk
from tumble.logs.message_imu import ImuDecoder
from tumble.logs.options import ReadOptions
from tumble.logs.rosmsg import MalformedMessageError
from tumble.logs.track import RawSamples, StatedUnit

Opened = TypeVar("Opened", bound="MessageSource")


class MessageSource(ConditionedSource):
    """Decodes messages of one topic as they come; a `Source`."""

    magnetometer_unit: StatedUnit | None = None
    """Unit of the readings that `_fields_beside` gives."""

    def __init__(self, address: Address, topic: str, options: ReadOptions) -> None:
        super().__init__(options)
        self._address = address
        self.topic = topic
        self.name = topic.strip("/").replace("/", "-")
        self._mailbox: Mailbox | None = None
        self._decoder: ImuDecoder | None = None
        self._open = ExitStack()

    @abstractmethod
    def _receive(self, mailbox: Mailbox, opened: ExitStack) -> None:
        """Has messages put into the mailbox until `opened` is closed.

        Raises `LogError` where there is no such topic.
        """

    @abstractmethod
    def _decoder_for(self, first: bytes) -> ImuDecoder:
        """Returns the decoder of the topic, of which a message is given."""

    def _fields_beside(self, samples: RawSamples) -> FloatArray | None:
        """Returns readings of a magnetometer beside samples, (n, 3); None where none is received.

        Raises `LogError` where a message of it is none.
        """
        return None

    @property
    @abstractmethod
    def _about(self) -> str:
        """Describes how the topic is received."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """See `Source`."""
        lost = 0 if self._mailbox is None else self._mailbox.lost
        unread = (f"lost {count_of('message', lost)} that were not read in time",) if lost else ()
        return (*self._conditioner.notices, f"topic {self.topic} is received {self._about}", *unread)

    def __enter__(self: Opened) -> Opened:
        with ExitStack() as opened:
            mailbox: Mailbox = Mailbox()
            opened.callback(mailbox.close)
            self._receive(mailbox, opened)
            self._mailbox, self._open = mailbox, opened.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.close()

    def fileno(self) -> int | None:
        """See `Source`."""
        return None if self._mailbox is None else self._mailbox.fileno()

    def read(self) -> LiveChunk:
        """See `Source`."""
        messages = [] if self._mailbox is None else self._mailbox.take()
        if not messages:
            return EMPTY
        if self._decoder is None:
            self._decoder = self._decoder_for(messages[0])
        try:
            samples = self._decoder.decode(messages)
        except MalformedMessageError as error:
            raise LogError(
                f"{self._address.text}: a message of {self.topic} {error}: not {self._decoder.what}; "
                "check what sends it"
            ) from error
        units = self._decoder.units
        facts = StreamFacts(
            self._address.text,
            samples.time is not None,
            units.accelerometer,
            units.gyroscope,
            units.time,
            units.temperature,
            self.magnetometer_unit,
        )
        readings = Readings(samples, magnetic=self._fields_beside(samples))
        return self._conditioner.take(readings, facts, clock.now())
