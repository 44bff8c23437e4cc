"""Layout with which Foxglove shows an MCAP file of ours: states, readings, directions, parameters, events.

Names of panels and of their settings are those of Foxglove's documentation, "Panels", and of the classes of
`foxglove.layouts`; a path is a topic and a field.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any, Final

from tumble.foundation.units import UNITS, Triad
from tumble.tools.viewers.content import ShownUnit, ViewerContent, topic_names

FIELDS: Final[dict[Triad, str]] = {"accelerometer": "linear_acceleration", "gyroscope": "angular_velocity"}
"""Fields of sensor_msgs/Imu."""
COLOURS: Final = ("#d64541", "#3f994f", "#3465c4")
NEVER: Final = 1_000_000_000
"""s after which parameters, which are stated once, would be shown as out of date."""
STATES, FORCES, RATES, FIELD, LOG, UNITS_TAB = (
    *("StateTransitions!tumble", "Plot!force", "Plot!rate", "Plot!field", "RosOut!tumble", "Tab!units"),
)
"""Names of panels: what kind each is, and which."""


def layout_of(content: ViewerContent) -> dict[str, Any]:
    """Returns the layout as Foxglove imports it from a file."""
    names = topic_names(content.units)
    panels: dict[str, Any] = {
        STATES: {"isSynced": True, "paths": list(_states(content.units, names))},
        FORCES: _plot("accelerometer", content.units, names),
        RATES: _plot("gyroscope", content.units, names),
        LOG: {"topicToRender": "/events", "minLogLevel": 1, "searchTerms": []},
        UNITS_TAB: {"activeTabIdx": 0, "tabs": [_tab(unit, names[unit.name]) for unit in content.units]},
    }
    plots: Any = _split("column", FORCES, RATES, 50)
    if fields := list(_field_paths(content.units, names)):
        panels[FIELD] = _plot_of(fields, "T")
        plots = _split("column", plots, FIELD, 67)
    for unit in content.units:
        panels |= _panels_of(unit, names[unit.name])
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _split(
            "column",
            _split("row", _split("column", STATES, plots, 25), UNITS_TAB, 70),
            LOG,
            85,
        ),
    }


def _split(direction: str, first: Any, second: Any, percentage: int) -> dict[str, Any]:  # noqa: ANN401
    return {"direction": direction, "first": first, "second": second, "splitPercentage": percentage}


def _states(units: Sequence[ShownUnit], names: dict[str, str]) -> Iterator[dict[str, Any]]:
    for unit in units:
        for lane in unit.shown_lanes:
            topic = f"/{names[unit.name]}/{lane_topic(lane)}"
            yield {
                "value": f"{topic}.state",
                "label": f"{unit.name}: {lane}",
                "timestampMethod": "headerStamp",
            }


def _plot(triad: Triad, units: Sequence[ShownUnit], names: dict[str, str]) -> dict[str, Any]:
    paths = [
        path
        for unit in units
        if triad in unit.recording.metadata.triads
        for form, style, enabled in _forms(unit)
        for path in _axes(f"/{names[unit.name]}/{form}.{FIELDS[triad]}", unit.name, form, style, enabled)
    ]
    return _plot_of(paths, UNITS[triad])


def _field_paths(units: Sequence[ShownUnit], names: dict[str, str]) -> Iterator[dict[str, Any]]:
    for unit in units:
        for form in unit.field_forms:
            is_last = form == unit.field_forms[-1]
            style = "solid" if is_last else "dotted"
            place = f"/{names[unit.name]}/{form}/mag.magnetic_field"
            yield from _axes(place, unit.name, form, style, is_last)


def _axes(place: str, unit: str, form: str, style: str, enabled: bool) -> Iterator[dict[str, Any]]:
    for axis, colour in zip("xyz", COLOURS, strict=True):
        yield {
            "value": f"{place}.{axis}",
            "label": f"{unit} {axis}, {form}",
            "color": colour,
            "lineStyle": style,
            "enabled": enabled,
            "timestampMethod": "headerStamp",
        }


def _plot_of(paths: list[dict[str, Any]], unit: str) -> dict[str, Any]:
    return {
        "paths": paths,
        "yAxisLabel": unit,
        "xAxisVal": "timestamp",
        "isSynced": True,
        "showLegend": True,
        "legendDisplay": "floating",
    }


def _forms(unit: ShownUnit) -> tuple[tuple[str, str, bool], ...]:
    """Returns form, line style and whether it is shown at first; raw readings would hide calibrated ones."""
    if unit.calibration is None:
        return (("raw", "solid", True),)
    return (("calibrated", "solid", True), ("raw", "dotted", False))


def _tab(unit: ShownUnit, name: str) -> dict[str, Any]:
    return {"title": unit.name, "layout": _split("column", f"3D!{name}", f"DiagnosticStatusPanel!{name}", 50)}


def _panels_of(unit: ShownUnit, name: str) -> dict[str, Any]:
    return {
        f"3D!{name}": {
            "followTf": name,
            "followMode": "follow-pose",
            "topics": {f"/{name}/up": {"visible": True}},
            "cameraState": {"distance": 4.0, "phi": 60.0, "thetaOffset": 45.0, "target": [0, 0, 0]},
        },
        f"DiagnosticStatusPanel!{name}": {
            "topicToRender": "/calibration",
            "selectedHardwareId": unit.recording.metadata.serial,
            "selectedName": name,
            "secondsUntilStale": NEVER,
        },
    }


def lane_topic(lane: str) -> str:
    """Returns the last part of the topic of a lane."""
    return re.sub(r"\W+", "_", lane, flags=re.ASCII)
