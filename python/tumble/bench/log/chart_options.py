"""Charts as ECharts takes them, without samples: axes, lines, segments. Plain data, no NiceGUI.

Source of the keys: https://echarts.apache.org/en/option.html. Those that begin with `tumble` are read by
`recording_chart.js`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np

from tumble.bench.log.palette import DARK, LIGHT, Palette
from tumble.calibration.document import Calibration
from tumble.foundation.magnetic import MAGNETIC_CHANNELS, MICROTESLA
from tumble.foundation.recording import FloatArray
from tumble.foundation.translation import translated
from tumble.foundation.units import CHANNELS, UNITS, Triad, channels_of, triad_of
from tumble.report.numbers import readable_unit
from tumble.tools.view.deviation import Deviation
from tumble.tools.view.levels import shown
from tumble.tools.view.result_file import Residuals
from tumble.tools.view.samples import TEMPERATURE, KeptSamples
from tumble.tools.view.spectrum import Spectrum
from tumble.tools.viewers.content import Form

Option: TypeAlias = dict[str, Any]

LEFT: Final = 74
RIGHT: Final = 18
LANE: Final = 22
"""px of the lane of segments."""
LEGEND: Final = 26
GAP: Final = 34
HEIGHTS: Final = {1: 480, 2: 290, 3: 190, 4: 160}
"""px of the chart of one quantity, by their number."""
FOOT: Final = 76
POINTS: Final = 500
"""Bins of a spectrum that is drawn."""
DASHES: Final = ("solid", "dashed", "dotted", [10, 3, 2, 3])
"""Dashes of lines by unit; from the fifth on they begin again."""


@dataclass(frozen=True, slots=True)
class SeriesFacts:
    """A line of a chart of recordings."""

    unit: str
    form: Form
    channel: str
    series: int
    """Place among the series of ECharts."""


@dataclass(frozen=True, slots=True)
class ChartPlan:
    """A chart, complete but for its samples."""

    light: Option
    dark: Option
    height: int
    """px."""
    lines: tuple[SeriesFacts, ...] = ()
    quantities: tuple[str, ...] = ()
    """(series,) quantity of each, in words."""
    units: tuple[str, ...] = ()
    """(series,) unit of each."""

    @property
    def options(self) -> Option:
        """Both options, as the element takes them."""
        return {"light": self.light, "dark": self.dark}


def recording_plan(units: Sequence[KeptSamples], forms: Sequence[Form], date: str = "") -> ChartPlan:
    """Plans the charts of recordings: a lane of segments, then a chart for each quantity, on one time."""
    quantities = _quantities(units)
    light, dark = (_recording(units, forms, quantities, palette, date) for palette in (LIGHT, DARK))
    lines = tuple(_series_facts(units, forms, quantities))
    return ChartPlan(
        light,
        dark,
        height=LEGEND + LANE + 8 + len(quantities) * (HEIGHTS[len(quantities)] + GAP) + FOOT - GAP,
        lines=tuple(
            SeriesFacts(each.unit, each.form, each.channel, 1 + number) for number, each in enumerate(lines)
        ),
        quantities=("", *(_quantity_of(each.channel) for each in lines)),
        units=("", *(_unit_of(each.channel) for each in lines)),
    )


def _quantities(units: Sequence[KeptSamples]) -> list[tuple[str, ...]]:
    """Returns the channels of each chart, top down."""
    recorded = {channel for unit in units for channel in unit.channels}
    of_triads = [*(channels_of(triad) for triad in UNITS), MAGNETIC_CHANNELS, (TEMPERATURE,)]
    charts = [tuple(each for each in channels if each in recorded) for channels in of_triads]
    return [chart for chart in charts if chart]


def _series_facts(
    units: Sequence[KeptSamples], forms: Sequence[Form], quantities: Sequence[tuple[str, ...]]
) -> list[SeriesFacts]:
    return [
        SeriesFacts(unit.name, form, channel, 0)
        for channels in quantities
        for unit in units
        for form in forms
        for channel in channels
        if channel in unit.channels and (form == "raw" or _is_corrected(channel, unit.calibration))
    ]


def _is_corrected(channel: str, calibration: Calibration | None) -> bool:
    """Returns whether readings of a channel are shown corrected too."""
    if calibration is None or channel == TEMPERATURE:
        return False
    return channel not in MAGNETIC_CHANNELS or calibration.magnetometer is not None


def _quantity_of(channel: str) -> str:
    """Names the quantity of an axis; empty for temperature, whose lines bear that name."""
    if channel in MAGNETIC_CHANNELS:
        return translated("magnetic field")
    if channel not in CHANNELS:
        return ""
    return translated({"accelerometer": "specific force", "gyroscope": "angular rate"}[_triad(channel)])


def _triad(channel: str) -> Triad:
    return triad_of(channel)  # type: ignore[arg-type]


def _unit_of(channel: str) -> str:
    if channel in MAGNETIC_CHANNELS:
        return readable_unit(MICROTESLA)
    return readable_unit(UNITS[_triad(channel)] if channel in CHANNELS else "degC")


def _name_of(line: SeriesFacts, several: bool, forms: Sequence[Form]) -> str:
    unit = line.unit if several else ""
    if line.channel == TEMPERATURE:
        return f"{unit} {translated('temperature')}".strip()
    form = translated(line.form) if len(forms) > 1 else ""
    return " ".join(filter(None, (unit, line.channel[-1], form)))


def _recording(
    units: Sequence[KeptSamples],
    forms: Sequence[Form],
    quantities: Sequence[tuple[str, ...]],
    palette: Palette,
    date: str,
) -> Option:
    top, height = LEGEND + LANE + 8, HEIGHTS[len(quantities)]
    tops = [LEGEND, *(top + number * (height + GAP) for number in range(len(quantities)))]
    heights = [LANE, *(height for _ in quantities)]
    grids = [
        {"left": LEFT, "right": RIGHT, "top": at, "height": height}
        for at, height in zip(tops, heights, strict=True)
    ]
    last = len(quantities)
    time = translated("time, s") + (translated(", from {date}", date=date) if date else "")
    x_axes = [
        {
            "type": "value",
            "gridIndex": number,
            "min": 0,
            "name": time if number == last else "",
            "nameLocation": "middle",
            "nameGap": 26,
            "nameTextStyle": {"color": palette.soft},
            "axisLabel": {"show": number == last, "color": palette.soft},
            "axisTick": {"show": number == last},
            "axisLine": {"show": number > 0, "onZero": False, "lineStyle": {"color": palette.soft}},
            "splitLine": {"show": number > 0, "lineStyle": {"color": palette.grid}},
            "axisPointer": {"label": {"show": False}},
        }
        for number in range(last + 1)
    ]
    y_axes = [
        {"type": "value", "gridIndex": 0, "min": 0, "max": 1, "show": False},
        *(
            _value_axis(
                f"{_quantity_of(channels[0]) or translated('temperature')}, {_unit_of(channels[0])}",
                number,
                palette,
            )
            for number, channels in enumerate(quantities, start=1)
        ),
    ]
    every = list(range(last + 1))
    return {
        "animation": False,
        "textStyle": {"fontFamily": "system-ui, 'Noto Sans', 'DejaVu Sans', sans-serif"},
        "grid": grids,
        "xAxis": x_axes,
        "yAxis": y_axes,
        "legend": {
            "type": "scroll",
            "top": 0,
            "left": LEFT,
            "right": RIGHT,
            "itemWidth": 26,
            "itemStyle": {"opacity": 0},
            "textStyle": {"color": palette.ink},
            "data": _legend(units, forms, quantities),
        },
        "axisPointer": {"link": [{"xAxisIndex": "all"}], "lineStyle": {"color": palette.soft}},
        "tooltip": _tooltip("axis", palette),
        "dataZoom": [
            {"type": "inside", "xAxisIndex": every, "filterMode": "none", "moveOnMouseMove": False},
            {
                "type": "slider",
                "xAxisIndex": every,
                "filterMode": "none",
                "bottom": 6,
                "height": 20,
                "left": LEFT,
                "right": RIGHT,
                "showDataShadow": False,
                "showDetail": False,
                "borderColor": palette.soft,
                "fillerColor": f"{palette.axes[0]}33",
                "handleStyle": {"color": palette.paper, "borderColor": palette.ink},
                "moveHandleStyle": {"color": palette.soft},
            },
        ],
        "series": _series(units, forms, quantities, palette),
        **_styles(palette),
    }


def _legend(
    units: Sequence[KeptSamples], forms: Sequence[Form], quantities: Sequence[tuple[str, ...]]
) -> list[str]:
    """Names lines once: those of one name are shown and hidden together."""
    names = [_name_of(each, len(units) > 1, forms) for each in _series_facts(units, forms, quantities)]
    return list(dict.fromkeys(names))


def _series(
    units: Sequence[KeptSamples],
    forms: Sequence[Form],
    quantities: Sequence[tuple[str, ...]],
    palette: Palette,
) -> list[Option]:
    segments: Option = {
        "type": "custom",
        "tumble": "segments",
        "xAxisIndex": 0,
        "yAxisIndex": 0,
        "encode": {"x": [0, 1], "y": -1},
        "clip": True,
        "tooltip": {"trigger": "item"},
    }
    found = [segments]
    names = [unit.name for unit in units]
    marked: set[int] = set()
    for line in _series_facts(units, forms, quantities):
        chart = next(number for number, each in enumerate(quantities, start=1) if line.channel in each)
        faint = line.form == "raw" and len(forms) > 1
        series: Option = {
            "type": "line",
            "name": _name_of(line, len(units) > 1, forms),
            "xAxisIndex": chart,
            "yAxisIndex": chart,
            "showSymbol": False,
            "symbolSize": 5,
            "lineStyle": {
                "width": 1.1,
                "opacity": 0.45 if faint else 1.0,
                "type": DASHES[names.index(line.unit) % len(DASHES)],
            },
            "color": _colour(line.channel, palette),
            "dimensions": ["time", "value"],
        }
        if chart not in marked:
            marked.add(chart)
            series["markArea"] = {"silent": True, "itemStyle": {"color": palette.rest, "opacity": 0.45}}
        found.append(series)
    return found


def _colour(channel: str, palette: Palette) -> str:
    return palette.axes["xyz".index(channel[-1])] if channel != TEMPERATURE else palette.other


def _value_axis(name: str, grid: int, palette: Palette) -> Option:
    return {
        "type": "value",
        "gridIndex": grid,
        "name": name,
        "nameLocation": "middle",
        "nameGap": 54,
        "nameTextStyle": {"color": palette.soft},
        "scale": True,
        "axisLabel": {"color": palette.soft, "hideOverlap": True},
        "axisLine": {"show": False},
        "splitLine": {"lineStyle": {"color": palette.grid}},
        "axisPointer": {"show": False},
    }


def _tooltip(trigger: str, palette: Palette) -> Option:
    return {
        "trigger": trigger,
        "confine": True,
        "transitionDuration": 0,
        "backgroundColor": palette.paper,
        "borderColor": palette.soft,
        "textStyle": {"color": palette.ink, "fontSize": 12},
        "axisPointer": {"type": "line"},
    }


def _styles(palette: Palette) -> Option:
    return {
        "tumble": {
            "paper": palette.paper,
            "ink": palette.ink,
            "soft": palette.soft,
            "rest": {"fill": palette.rest, "stroke": palette.rest_edge, "ink": palette.ink},
            "turn": {"fill": palette.turn, "stroke": palette.turn_edge, "ink": palette.ink, "dash": [2, 2]},
            "no rest": {"fill": "transparent", "stroke": palette.soft, "ink": palette.soft, "dash": [4, 3]},
        }
    }


def curves_plan(
    x_name: str, charts: Sequence[tuple[str, str, Sequence[tuple[str, FloatArray, FloatArray]]]]
) -> ChartPlan:
    """Plans curves on logarithmic axes, a chart for each quantity beside one another.

    `charts` are names, units and the curves (name, x (n,), values (n, 1) or (n, 3) with the ends of an
    interval), of which those above zero are shown.
    """
    light, dark = (_curves(x_name, charts, palette) for palette in (LIGHT, DARK))
    flat = [(quantity, unit) for quantity, unit, curves in charts for _ in _drawn_series(curves)]
    return ChartPlan(
        light,
        dark,
        height=LEGEND + 290 + 56,
        quantities=tuple(quantity for quantity, _ in flat),
        units=tuple(unit for _, unit in flat),
    )


def _drawn_series(curves: Sequence[tuple[str, FloatArray, FloatArray]]) -> list[str]:
    return [f"{name}{part}" for name, _, values in curves for part in ("", "|")[: 1 + (values.shape[1] > 1)]]


def _curves(
    x_name: str,
    charts: Sequence[tuple[str, str, Sequence[tuple[str, FloatArray, FloatArray]]]],
    palette: Palette,
) -> Option:
    share = 100.0 / len(charts)
    option: Option = {
        "animation": False,
        "textStyle": {"fontFamily": "system-ui, 'Noto Sans', 'DejaVu Sans', sans-serif"},
        "legend": {"top": 0, "left": LEFT, "itemWidth": 18, "textStyle": {"color": palette.ink}},
        "tooltip": _tooltip("axis", palette),
        "grid": [],
        "xAxis": [],
        "yAxis": [],
        "series": [],
        **_styles(palette),
    }
    for place, (quantity, unit, curves) in enumerate(charts):
        left = f"{place * share + 9:g}%" if place else LEFT
        option["grid"].append({"left": left, "width": f"{share - 11:g}%", "top": LEGEND + 8, "height": 290})
        option["xAxis"].append(_log_axis(x_name, place, palette, vertical=False))
        option["yAxis"].append(_log_axis(f"{quantity}, {unit}", place, palette, vertical=True))
        for name, x, values in curves:
            option["series"] += _curve(name, x, values, place, palette)
    return option


def _log_axis(name: str, grid: int, palette: Palette, *, vertical: bool) -> Option:
    return {
        "type": "log",
        "gridIndex": grid,
        "name": name,
        "nameLocation": "middle",
        "nameGap": 56 if vertical else 26,
        "nameTextStyle": {"color": palette.soft},
        "axisLabel": {"color": palette.soft, "hideOverlap": True},
        "axisLine": {"show": not vertical, "onZero": False, "lineStyle": {"color": palette.soft}},
        "splitLine": {"lineStyle": {"color": palette.grid}},
        "scale": True,
        "axisPointer": {"show": not vertical, "label": {"show": False}},
    }


def _curve(name: str, x: FloatArray, values: FloatArray, grid: int, palette: Palette) -> list[Option]:
    known = (x > 0.0) & (values[:, 0] > 0.0)
    x, values = x[known], values[known]
    colour = palette.axes["xyz".index(name[-1])]
    line: Option = {
        "type": "line",
        "name": name,
        "xAxisIndex": grid,
        "yAxisIndex": grid,
        "showSymbol": values.shape[1] > 1,
        "symbol": ("circle", "rect", "triangle")["xyz".index(name[-1])],
        "symbolSize": 5,
        "lineStyle": {"width": 1.1},
        "color": colour,
        "data": np.stack([x, values[:, 0]], axis=1).tolist(),
    }
    if values.shape[1] == 1:
        return [line]
    ends = np.stack([x, values[:, 1], values[:, 2]], axis=1)
    bars: Option = {
        "type": "custom",
        "tumble": "intervals",
        "name": name,
        "xAxisIndex": grid,
        "yAxisIndex": grid,
        "color": colour,
        "encode": {"x": 0, "y": [1, 2]},
        "tooltip": {"show": False},
        "data": ends[np.isfinite(ends).all(axis=1) & (ends > 0.0).all(axis=1)].tolist(),
    }
    return [line, bars]


def spectrum_plan(spectra: Sequence[Spectrum]) -> ChartPlan:
    """Plans the amplitude spectral densities of a section; peaks stay, whatever is left out."""
    charts = []
    for triad, unit in UNITS.items():
        curves = []
        for each in spectra:
            if _triad(each.channel) == triad:
                # Bins are equal on the axis that is drawn, which is logarithmic.
                rows = _logarithmic(each.frequency, each.density)
                curves.append((each.channel[-1], each.frequency[rows], each.density[rows, None]))
        if curves:
            charts.append((_quantity_of(channels_of(triad)[0]), readable_unit(f"{unit}/sqrt(Hz)"), curves))
    return curves_plan(translated("frequency, Hz"), charts)


def _logarithmic(frequency: FloatArray, density: FloatArray) -> FloatArray:
    """Returns the rows that show a density over the logarithm of frequency."""
    decades = np.log10(frequency / frequency[0])
    edges = np.searchsorted(decades, np.linspace(0.0, decades[-1], POINTS // 4 + 1)[1:-1])
    parts = np.split(np.arange(len(frequency)), np.unique(edges))
    return np.concatenate([part[shown(density[part], 4)] for part in parts if len(part)])


def deviation_plan(deviations: Sequence[Deviation]) -> ChartPlan:
    """Plans the Allan deviations of a section, with 95 % intervals."""
    charts = []
    for triad, unit in UNITS.items():
        curves = [
            (each.channel[-1], each.tau, np.stack([each.deviation, each.low, each.high], axis=1))
            for each in deviations
            if _triad(each.channel) == triad
        ]
        if curves:
            charts.append((_quantity_of(channels_of(triad)[0]), readable_unit(unit), curves))
    return curves_plan(translated("averaging time, s"), charts)


def residual_plan(residuals: Sequence[Residuals]) -> ChartPlan:
    """Plans the residuals of a result, each with its 1-sigma, over the rests and turns that they are of."""
    light, dark = (_residuals(residuals, palette) for palette in (LIGHT, DARK))
    flat = [each for each in residuals for _ in "xyz" for _ in range(2)]
    return ChartPlan(
        light,
        dark,
        height=LEGEND + len(residuals) * (150 + 66) - 20,
        quantities=tuple(translated(each.triad) for each in flat),
        units=tuple(readable_unit(each.unit) for each in flat),
    )


def _residuals(residuals: Sequence[Residuals], palette: Palette) -> Option:
    option: Option = {
        "animation": False,
        "textStyle": {"fontFamily": "system-ui, 'Noto Sans', 'DejaVu Sans', sans-serif"},
        "legend": {"top": 0, "left": LEFT, "textStyle": {"color": palette.ink}},
        "tooltip": _tooltip("axis", palette),
        "grid": [],
        "xAxis": [],
        "yAxis": [],
        "series": [],
        **_styles(palette),
    }
    for place, each in enumerate(residuals):
        top = LEGEND + 8 + place * (150 + 66)
        option["grid"].append({"left": LEFT + 10, "right": RIGHT, "top": top, "height": 150})
        option["xAxis"].append(
            {
                "type": "category",
                "gridIndex": place,
                "data": list(each.labels),
                "axisLabel": {"color": palette.soft, "hideOverlap": True},
                "axisLine": {"onZero": False, "lineStyle": {"color": palette.soft}},
                "axisPointer": {"label": {"show": False}, "type": "shadow"},
            }
        )
        name = translated(
            "{triad} residual, {unit}", triad=translated(each.triad), unit=readable_unit(each.unit)
        )
        option["yAxis"].append(_value_axis(name, place, palette) | {"nameGap": 64, "scale": False})
        for axis, letter in enumerate("xyz"):
            option["series"] += _residual_axis(each, axis, letter, place, palette)
    return option


def _residual_axis(each: Residuals, axis: int, letter: str, grid: int, palette: Palette) -> list[Option]:
    value, sigma = each.value[:, axis], np.nan_to_num(each.sigma[:, axis])
    places = np.arange(len(value))
    common: Option = {"name": letter, "xAxisIndex": grid, "yAxisIndex": grid, "color": palette.axes[axis]}
    points = common | {
        "type": "scatter",
        "symbol": ("circle", "rect", "triangle")[axis],
        "symbolSize": 7,
        "symbolOffset": [7 * (axis - 1), 0],
        "data": np.stack([places, value], axis=1).tolist(),
    }
    bars = common | {
        "type": "custom",
        "tumble": "intervals",
        "tumbleOffset": 7 * (axis - 1),
        "encode": {"x": 0, "y": [1, 2]},
        "tooltip": {"show": False},
        "data": np.stack([places, value - sigma, value + sigma], axis=1).tolist(),
    }
    return [points, bars]
