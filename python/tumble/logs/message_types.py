"""Definitions that files of messages carry, made forms: those of ROS, and those of protocol buffers."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import islice
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.msg import normalize_msgtype

from tumble.foundation.numbers import whole_number
from tumble.logs.message_bounds import check_text, check_types
from tumble.logs.message_form import AXES, DEEPEST, MOST_NAMES, Definition, MessageForm, ObjectForm, is_triad

IMU_TYPE = "sensor_msgs/msg/Imu"
_NO_NUMBERS = {"string", "wstring", "bool"}


def ros_form(definition: Definition) -> tuple[MessageForm, tuple[str, ...]]:
    """Returns the form of a message of ROS, and names of the fields that are a sensor_msgs/Imu.

    Raises `UnboundedDefinitionError` where it is larger than any, and what the library of the format raises
    where it is none.
    """
    found = _parsed(definition)
    if isinstance(found, Exception):
        raise found
    return found


@lru_cache(maxsize=256)
def _parsed(definition: Definition) -> tuple[MessageForm, tuple[str, ...]] | Exception:
    """Returns what `ros_form` returns or raises, once for all topics of a definition."""
    try:
        return _form_of(definition)
    except Exception as error:  # a library raises anything over a definition that is none
        return error


def _form_of(definition: Definition) -> tuple[MessageForm, tuple[str, ...]]:
    check_text(definition.text)
    store = get_typestore(Stores.EMPTY)
    name = normalize_msgtype(definition.type)
    text = definition.text.decode("utf-8", errors="replace")
    types = get_types_from_idl(text) if "module " in text else get_types_from_msg(text, name)
    check_types(types)
    store.register(types)
    read = store.deserialize_ros1 if definition.encoding == "ros1" else store.deserialize_cdr
    imus: list[str] = []
    texts: list[str] = []
    names = list(islice(_ros_names(store.fielddefs, name, "", 0, imus, texts), MOST_NAMES))
    return ObjectForm(names, lambda message: read(message, name), texts[:MOST_NAMES]), tuple(imus)


def _ros_names(
    types: Any,  # noqa: ANN401
    name: str,
    path: str,
    depth: int,
    imus: list[str],
    texts: list[str],
) -> Iterator[str]:
    if name == IMU_TYPE and path:
        imus.append(path)
    if depth > DEEPEST or name not in types:
        return
    for field, (kind, inner) in types[name][1]:
        place = f"{path}.{field}" if path else field
        if kind == Nodetype.NAME:
            yield from _ros_names(types, inner, place, depth + 1, imus, texts)
        elif kind == Nodetype.BASE and inner[0] not in _NO_NUMBERS:
            yield place
        elif kind == Nodetype.BASE and inner[0] == "string":
            texts.append(place)
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
    names = filter(_is_one_number, _protobuf_names(found, 0, {}))
    return ObjectForm(list(names), message_factory.GetMessageClass(found).FromString)


def _is_one_number(name: str) -> bool:
    """Returns whether a name is that of a number, or of one of the three of a triad."""
    place, _, last = name.rpartition(".")
    return whole_number(last) is None or is_triad(place)


def _protobuf_names(
    descriptor: Any,  # noqa: ANN401 - made at run time
    depth: int,
    known: dict[tuple[str, int], tuple[str, ...]],
) -> tuple[str, ...]:
    """Returns names of numbers; a type has the same ones wherever it stands, and may hold itself."""
    at = (descriptor.full_name, depth)
    if at not in known:
        known[at] = tuple(islice(_protobuf_fields(descriptor, depth, known), MOST_NAMES))
    return known[at]


def _protobuf_fields(
    descriptor: Any,  # noqa: ANN401 - made at run time
    depth: int,
    known: dict[tuple[str, int], tuple[str, ...]],
) -> Iterator[str]:
    if depth > DEEPEST:
        return
    for field in descriptor.fields:
        is_number = field.cpp_type in range(field.CPPTYPE_INT32, field.CPPTYPE_FLOAT + 1)
        if _is_repeated(field):
            if is_number:
                yield from (f"{field.name}.{number}" for number in range(AXES))
        elif field.cpp_type == field.CPPTYPE_MESSAGE:
            inside = _protobuf_names(field.message_type, depth + 1, known)
            yield from (f"{field.name}.{name}" for name in inside)
        elif is_number:
            yield field.name


def _is_repeated(field: Any) -> bool:  # noqa: ANN401
    # Older versions of the library know but the label.
    return bool(field.is_repeated if hasattr(field, "is_repeated") else field.label == field.LABEL_REPEATED)
