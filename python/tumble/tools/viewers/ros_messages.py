"""Messages of ROS 2 for viewers: those of Foxglove's package `foxglove_msgs`, and segments of our own.

All are CDR with definitions of `ros2msg`, which Foxglove, PlotJuggler and rosbags read; they read messages in
protobuf or JSON not all alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, Final

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from tumble.foundation.recording import FloatArray

LOG: Final = "foxglove_msgs/msg/Log"
SCENE: Final = "foxglove_msgs/msg/SceneUpdate"
TRANSFORM: Final = "foxglove_msgs/msg/FrameTransform"
DIAGNOSTICS: Final = "diagnostic_msgs/msg/DiagnosticArray"
SEGMENT: Final = "tumble_msgs/msg/Segment"

STATES: Final = (
    *("none", "rest", "turn", "left out", "spin", "disturbance", "source", "unhealthy", "collecting"),
)
"""States of a segment by their number; `none` is between segments."""

_COLOUR = "foxglove_msgs/Color color\n"
_POSE = "geometry_msgs/Pose pose\n"
_POINTS = "geometry_msgs/Point[] points\n" + _COLOUR + "foxglove_msgs/Color[] colors\nuint32[] indices\n"
DEFINITIONS: Final[Mapping[str, str]] = {
    LOG: "builtin_interfaces/Time timestamp\nuint8 level\nstring message\nstring name\nstring file\n"
    "uint32 line\n",
    TRANSFORM: "builtin_interfaces/Time timestamp\nstring parent_frame_id\nstring child_frame_id\n"
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    SCENE: "foxglove_msgs/SceneEntityDeletion[] deletions\nfoxglove_msgs/SceneEntity[] entities\n",
    "foxglove_msgs/msg/SceneEntityDeletion": "builtin_interfaces/Time timestamp\nuint8 type\nstring id\n",
    "foxglove_msgs/msg/SceneEntity": "builtin_interfaces/Time timestamp\nstring frame_id\nstring id\n"
    "builtin_interfaces/Duration lifetime\nbool frame_locked\nfoxglove_msgs/KeyValuePair[] metadata\n"
    "foxglove_msgs/ArrowPrimitive[] arrows\nfoxglove_msgs/CubePrimitive[] cubes\n"
    "foxglove_msgs/SpherePrimitive[] spheres\nfoxglove_msgs/CylinderPrimitive[] cylinders\n"
    "foxglove_msgs/LinePrimitive[] lines\nfoxglove_msgs/TriangleListPrimitive[] triangles\n"
    "foxglove_msgs/TextPrimitive[] texts\nfoxglove_msgs/ModelPrimitive[] models\n",
    "foxglove_msgs/msg/KeyValuePair": "string key\nstring value\n",
    "foxglove_msgs/msg/Color": "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n",
    "foxglove_msgs/msg/ArrowPrimitive": _POSE + "float64 shaft_length\nfloat64 shaft_diameter\n"
    "float64 head_length\nfloat64 head_diameter\n" + _COLOUR,
    "foxglove_msgs/msg/CubePrimitive": _POSE + "geometry_msgs/Vector3 size\n" + _COLOUR,
    "foxglove_msgs/msg/SpherePrimitive": _POSE + "geometry_msgs/Vector3 size\n" + _COLOUR,
    "foxglove_msgs/msg/CylinderPrimitive": _POSE + "geometry_msgs/Vector3 size\nfloat64 bottom_scale\n"
    "float64 top_scale\n" + _COLOUR,
    "foxglove_msgs/msg/LinePrimitive": "uint8 type\n"
    + _POSE
    + "float64 thickness\nbool scale_invariant\n"
    + _POINTS,
    "foxglove_msgs/msg/TriangleListPrimitive": _POSE + _POINTS,
    "foxglove_msgs/msg/TextPrimitive": _POSE
    + "bool billboard\nfloat64 font_size\nbool scale_invariant\n"
    + _COLOUR
    + "string text\n",
    "foxglove_msgs/msg/ModelPrimitive": _POSE
    + "geometry_msgs/Vector3 scale\n"
    + _COLOUR
    + "bool override_color\nstring url\nstring media_type\nuint8[] data\n",
    SEGMENT: "std_msgs/Header header\n"
    + "".join(f"uint8 {name.upper().replace(' ', '_')}={number}\n" for number, name in enumerate(STATES))
    + "uint8 state\nstring label\nstring remark\n",
}
"""Fields of each message, in order, as Foxglove's documentation of its schemas has them; the last is ours."""


@cache
def type_store() -> Typestore:
    """Returns the types of ROS 2 with those above."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    types: dict[str, Any] = {}
    for name, text in DEFINITIONS.items():
        types.update(get_types_from_msg(text, name))
    store.register(types)
    return store


@cache
def definition_of(message_type: str) -> str:
    """Returns the definition of a message with those of all that it consists of."""
    definition, _ = type_store().generate_msgdef(message_type, ros_version=2)
    return definition


def cdr(message: Any) -> bytes:  # noqa: ANN401 - classes of messages are made at run time
    """Returns a message in CDR."""
    return bytes(type_store().serialize_cdr(message, message.__msgtype__))


def _made(name: str, *values: Any) -> Any:  # noqa: ANN401
    """Makes a message of its fields, in order; `name` is that of its type."""
    return type_store().types[name](*values)


def time_of(stamp: int) -> Any:  # noqa: ANN401
    """Returns ns as `builtin_interfaces/Time`."""
    return _made("builtin_interfaces/msg/Time", *divmod(stamp, 1_000_000_000))


def log(stamp: int, level: int, text: str, name: str) -> Any:  # noqa: ANN401
    """Returns a line for the log; levels are those of `foxglove.Log`, 2 information to 4 error."""
    return _made(LOG, time_of(stamp), level, text, name, "", 0)


def segment(stamp: int, frame: str, state: str, label: str, remark: str) -> Any:  # noqa: ANN401
    """Returns what begins at a stamp, ns: a segment in a state, or `none`."""
    header = _made("std_msgs/msg/Header", time_of(stamp), frame)
    return _made(SEGMENT, header, STATES.index(state), label, remark)


def transform(stamp: int, parent: str, child: str, translation: FloatArray, rotation: FloatArray) -> Any:  # noqa: ANN401
    """Returns the pose of a child in its parent's frame: (3,) m and (4,) x, y, z, w."""
    place = _made("geometry_msgs/msg/Vector3", *translation.tolist())
    turn = _made("geometry_msgs/msg/Quaternion", *rotation.tolist())
    return _made(TRANSFORM, time_of(stamp), parent, child, place, turn)


def arrow(stamp: int, frame: str, name: str, direction: FloatArray, colour: tuple[float, ...]) -> Any:  # noqa: ANN401
    """Returns a scene with an arrow from the origin along a unit vector (3,), and its name at the tip."""
    empty = _made("foxglove_msgs/msg/Color", *colour, 1.0)
    pose = _pose(np.zeros(3), rotation_onto(direction))
    shaft = _made("foxglove_msgs/msg/ArrowPrimitive", pose, 0.85, 0.02, 0.15, 0.06, empty)
    tip = _pose(1.1 * direction, np.array([0.0, 0.0, 0.0, 1.0]))
    text = _made("foxglove_msgs/msg/TextPrimitive", tip, True, 12.0, True, empty, name)
    forever = _made("builtin_interfaces/msg/Duration", 0, 0)
    entity = _made(
        *("foxglove_msgs/msg/SceneEntity", time_of(stamp), frame, name, forever, False, []),
        *([shaft], [], [], [], [], [], [text], []),
    )
    return _made(SCENE, [], [entity])


def diagnostics(stamp: int, statuses: list[Any]) -> Any:  # noqa: ANN401
    """Returns verdicts and parameters of units, each made by `status`."""
    return _made(DIAGNOSTICS, _made("std_msgs/msg/Header", time_of(stamp), ""), statuses)


def status(level: int, name: str, text: str, serial: str, values: Mapping[str, str]) -> Any:  # noqa: ANN401
    """Returns the status of a unit; levels are those of ROS, 0 good to 2 error."""
    pairs = [_made("diagnostic_msgs/msg/KeyValue", key, value) for key, value in values.items()]
    return _made("diagnostic_msgs/msg/DiagnosticStatus", level, name, text, serial, pairs)


def rotation_onto(direction: FloatArray) -> FloatArray:
    """Returns the quaternion (4,) x, y, z, w that turns x onto a unit vector (3,) by the shortest way."""
    x, y, z = direction.tolist()
    if x < -1.0 + 1e-9:
        return np.array([0.0, 0.0, 1.0, 0.0])
    found = np.array([0.0, -z, y, 1.0 + x])
    return found / float(np.linalg.norm(found))


def _pose(place: FloatArray, turn: FloatArray) -> Any:  # noqa: ANN401
    point = _made("geometry_msgs/msg/Point", *place.tolist())
    return _made("geometry_msgs/msg/Pose", point, _made("geometry_msgs/msg/Quaternion", *turn.tolist()))
