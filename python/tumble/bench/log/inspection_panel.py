"""Findings of `tumble inspect` beside a chart, as text."""

from __future__ import annotations

from nicegui import ui

from tumble.foundation.translation import translated
from tumble.report.numbers import readable_unit
from tumble.tools.inspect.result import ChannelFacts, Inspection, head_lines, rest_lines, service_line


def show_inspection(inspection: Inspection) -> None:
    """Shows facts, channels, procedures and remarks; each text of the log is text."""
    with ui.element("section").classes("tumble-card"):
        _heading(translated("Recording"))
        for line in (*head_lines(inspection), *rest_lines(inspection)):
            ui.label(translated(line)).classes("tumble-fact")
        for line in inspection.remarks:
            ui.label(translated(line)).classes("tumble-remark")
    with ui.element("section").classes("tumble-card"):
        _heading(translated("Channels"))
        _channels(inspection)
    with ui.element("section").classes("tumble-card"):
        _heading(translated("Procedures that it suits"))
        for service in inspection.services:
            sign = "✓" if service.possible else "✗"
            ui.label(f"{sign} {service_line(service)}").classes(
                "tumble-fact" if service.possible else "tumble-fact tumble-soft"
            )


def _heading(text: str) -> None:
    with ui.element("h2").classes("tumble-heading"):
        ui.label(text)


def _channels(inspection: Inspection) -> None:
    heads = ("channel", "low", "mean", "high", "noise")
    with ui.element("table").classes("tumble-table"):
        with ui.element("tr"):
            for head in heads:
                _cell("th", translated(head)).props("scope=col")
        for triad in inspection.metadata.triads:
            of_triad = [each for each in inspection.channels if each.name.startswith(triad)]
            unit = readable_unit(of_triad[0].unit)
            with ui.element("tr"):
                _cell("th", f"{translated(triad)}, {unit}").props(f"scope=rowgroup colspan={len(heads)}")
            for channel in of_triad:
                _channel(channel)
    ui.label(translated("noise per √Hz")).classes("tumble-soft")


def _channel(channel: ChannelFacts) -> None:
    noise = f"{channel.noise_density:.3g}" if channel.noise_density > 0.0 else ""
    with ui.element("tr"):
        _cell("th", channel.name[-1]).props("scope=row")
        for value in (channel.low, channel.mean, channel.high):
            _cell("td", f"{value:.3g}")
        _cell("td", noise)


def _cell(kind: str, text: str) -> ui.element:
    with ui.element(kind) as cell:
        ui.label(text)
    return cell
