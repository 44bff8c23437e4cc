"""Options of live streams that commands share: whom to listen to, and where samples go."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

import typer

from tumble.foundation.words import LIVE_OUTPUTS

LIVE = "With --live"
"""Heading of options that mean something with `--live` only."""


def _sender(panel: str | None) -> Any:  # noqa: ANN401 - what typer makes of an option
    return typer.Option(
        "--from",
        metavar="ADDRESS",
        help="The one host whose datagrams count; the first that sends to each port if not given.",
        rich_help_panel=panel,
        show_default=False,
    )


SenderOption: TypeAlias = Annotated[str | None, _sender(LIVE)]
AlwaysLiveSenderOption: TypeAlias = Annotated[str | None, _sender(None)]
"""The same, of a command that knows nothing but live streams."""

UntilOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--until",
        metavar="'GROUP SIGMA, ...'",
        help="Go on until every sigma is as small: 'bias 0.001, non-orthogonality 0.01', in the units of the "
        "report.",
        rich_help_panel=LIVE,
        show_default=False,
    ),
]


LiveDurationOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--duration",
        metavar="TIME",
        help="How long at most, such as 90s, 10min or 2h.",
        rich_help_panel=LIVE,
        show_default=False,
    ),
]


def pose_seconds(usual: str) -> Any:  # noqa: ANN401 - what typer makes of an option
    """Returns the option of the time to rest at a pose; `usual` if it is not given."""
    return typer.Option(
        "--pose-seconds",
        metavar="TIME",
        help=f"Time at rest at each pose, {usual} if not given.",
        rich_help_panel=LIVE,
        show_default=False,
    )


ToOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--to",
        metavar="TO",
        help=f"Where corrected samples go: {LIVE_OUTPUTS}, or a file that ends in .csv, .parquet or .mcap.",
        rich_help_panel=LIVE,
        show_default=False,
    ),
]
