"""Findings of `tumble inspect` beside a chart, as text."""

from __future__ import annotations

from nicegui import ui

from tumble.bench.log.words import translated
from tumble.report.numbers import readable_unit
from tumble.tools.inspect.result import Inspection, head_lines, rest_lines, service_line


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
                with ui.element("th").props("scope=col"):
                    ui.label(translated(head))
        for channel in inspection.channels:
            noise = channel.noise_density
            unit = readable_unit(channel.unit)
            cells = (
                f"{channel.low:.4g}",
                f"{channel.mean:.4g}",
                f"{channel.high:.4g}",
                f"{noise:.3g}" if noise > 0.0 else "",
            )
            with ui.element("tr"):
                with ui.element("th").props("scope=row"):
                    ui.label(f"{translated(channel.name)}, {unit}")
                for cell in cells:
                    with ui.element("td"):
                        ui.label(cell)
    ui.label(translated("noise per √Hz")).classes("tumble-soft")
