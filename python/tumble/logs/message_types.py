"""Definitions that files of messages carry, made forms: those of ROS, and those of protocol buffers."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.msg import normalize_msgtype

from tumble.logs.message_form import AXES, DEEPEST, MOST_NAMES, Definition, MessageForm, ObjectForm, is_triad

IMU_TYPE = "sensor_msgs/msg/Imu"
_NO_NUMBERS = {"string", "wstring", "bool"}


def ros_form(definition: Definition) -> tuple[MessageForm, tuple[str, ...]]:
    """Returns the form of a message of ROS, and names of the fields that are a sensor_msgs/Imu.

    Raises what the library of the format raises where the definition is none.
    """
    store = get_typestore(Stores.EMPTY)
    name = normalize_msgtype(definition.type)
    text = definition.text.decode("utf-8", errors="replace")
    store.register(get_types_from_idl(text) if "module " in text else get_types_from_msg(text, name))
    read = store.deserialize_ros1 if definition.encoding == "ros1" else store.deserialize_cdr
    imus: list[str] = []
    names = list(islice(_ros_names(store.fielddefs, name, "", 0, imus), MOST_NAMES))
    return ObjectForm(names, lambda message: read(message, name)), tuple(imus)


def _ros_names(types: Any, name: str, path: str, depth: int, imus: list[str]) -> Iterator[str]:  # noqa: ANN401
    if name == IMU_TYPE and path:
        imus.append(path)
    if depth > DEEPEST or name not in types:
        return
    for field, (kind, inner) in types[name][1]:
        place = f"{path}.{field}" if path else field
        if kind == Nodetype.NAME:
            yield from _ros_names(types, inner, place, depth + 1, imus)
        elif kind == Nodetype.BASE and inner[0] not in _NO_NUMBERS:
            yield place
        elif kind == Nodetype.ARRAY and inner[1] == AXES and inner[0][0] == Nodetype.BASE and is_triad(place):
            yield from (f"{place}.{number}" for number in range(AXES))


def protobuf_form(definition: Definition) -> MessageForm:
    """Returns the form of a message of protocol buffers.

    Raises `ModuleNotFoundError` where their library is not installed, and what that raises where the
    descriptors are none.
    """
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory  # type: ignore[import-untyped]

    pool = descriptor_pool.DescriptorPool()
    waiting = list(descriptor_pb2.FileDescriptorSet.FromString(definition.text).file)
    known: set[str] = set()
    while ready := [file for file in waiting if known.issuperset(file.dependency)]:
        for file in ready:
            pool.Add(file)
            known.add(file.name)
        waiting = [file for file in waiting if file.name not in known]
    found = pool.FindMessageTypeByName(definition.type)
    names = list(islice(_protobuf_names(found, "", 0), MOST_NAMES))
    return ObjectForm(names, message_factory.GetMessageClass(found).FromString)


def _protobuf_names(descriptor: Any, path: str, depth: int) -> Iterator[str]:  # noqa: ANN401 - made at run time
    if depth > DEEPEST:
        return
    for field in descriptor.fields:
        place = f"{path}.{field.name}" if path else field.name
        is_number = field.cpp_type in range(field.CPPTYPE_INT32, field.CPPTYPE_FLOAT + 1)
        if _is_repeated(field):
            if is_number and is_triad(place):
                yield from (f"{place}.{number}" for number in range(AXES))
        elif field.cpp_type == field.CPPTYPE_MESSAGE:
            yield from _protobuf_names(field.message_type, place, depth + 1)
        elif is_number:
            yield place


def _is_repeated(field: Any) -> bool:  # noqa: ANN401
    # Older versions of the library know but the label.
    return bool(field.is_repeated if hasattr(field, "is_repeated") else field.label == field.LABEL_REPEATED)
