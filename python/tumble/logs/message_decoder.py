"""Decoder for the messages of one topic that hold an IMU, by their definition."""

from __future__ import annotations

from collections.abc import Mapping

from tumble.foundation.errors import LogError
from tumble.logs.bags import kind_of
from tumble.logs.message_form import Definition, JsonForm
from tumble.logs.message_imu import ImuDecoder, PlainImu, embedded_imus, imus_by_names
from tumble.logs.optional import not_installed
from tumble.logs.rosmsg import CDR, ROS1, Encoding

ENCODINGS: Mapping[str, Encoding] = {"cdr": CDR, "ros1": ROS1}
READ = (*ENCODINGS, "json", "protobuf")
"""Encodings of messages that are read."""


def may_be_imu(definition: Definition) -> bool:
    """Returns whether messages may hold an IMU: by their type, or by the fields that they define."""
    if kind_of(definition.type) == "imu" and definition.encoding in ENCODINGS:
        return True
    try:
        return bool(_decoders(definition, b"{}"))
    except (LogError, ModuleNotFoundError):
        return False


def decoder_of(topic: str, definition: Definition, first: bytes) -> ImuDecoder:
    """Finds the decoder of a topic; `first` is a message of it, which shows the fields of JSON.

    Raises `LogError` where messages hold no IMU, hold several, or need a library that is not installed.
    """
    if kind_of(definition.type) == "imu" and definition.encoding in ENCODINGS:
        return PlainImu(ENCODINGS[definition.encoding])
    try:
        found = _decoders(definition, first)
    except ModuleNotFoundError as error:
        raise not_installed(topic, "protobuf", "formats") from error
    if len(found) != 1:
        fields = ", ".join(filter(None, found)) or "none"
        raise LogError(
            f"{topic}: {definition.type or definition.encoding} is read where it holds one IMU, as "
            f"sensor_msgs/Imu does; found: {fields}"
        )
    return next(iter(found.values()))


def _decoders(definition: Definition, first: bytes) -> Mapping[str, ImuDecoder]:
    from tumble.logs.message_types import protobuf_form, ros_form

    try:
        if definition.encoding in ENCODINGS:
            form, embedded = ros_form(definition)
            found = embedded_imus(form, embedded, definition.type)
            return found or imus_by_names(form, definition.type)
        if definition.encoding == "protobuf":
            return imus_by_names(protobuf_form(definition), definition.type)
        if definition.encoding == "json":
            return imus_by_names(JsonForm(first), definition.type or "JSON")
    except (LogError, ModuleNotFoundError):
        raise
    except Exception:  # a library raises anything over a definition that is none
        return {}
    return {}
