"""Where live samples go: the option that commands share."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import typer

ToOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--to",
        metavar="TO",
        help="Where corrected samples go: stdout, udp://HOST:PORT, mavlink:udpout:HOST:PORT, or a file that "
        "ends in .csv, .parquet or .mcap.",
        rich_help_panel="With --live",
        show_default=False,
    ),
]
