"""JSON that `tumble noise` prints."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tumble.foundation.printed import PrintedResult
from tumble.procedures.noise.result import ChannelNoise, StillPart
from tumble.procedures.noise.summary import SCHEMA


class NoiseDocument(PrintedResult):
    """Noise of all channels of one sensor."""

    schema_: Literal["tumble-noise-result/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["measured", "partly measured"]
    name: str
    sources: list[str]
    serial: str
    still: StillPart
    temperature: tuple[float, float, float] | None
    """Lowest, mean and highest, degC."""
    start: str
    """sha256 of the calibration that it is added to; empty if there was none."""
    channels: list[ChannelNoise]
    kalibr: dict[str, float]
    """Keys of Kalibr and OpenVINS."""
    vins: dict[str, float]
    """Keys of VINS."""
