"""Long options by as much of their names as tells them apart: `--gyroscope-u` does for `--gyroscope-unit`."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand


class AbbreviatingCommand(TyperCommand):
    """A command whose long options may be cut short; what is cut too short stays unknown, and is refused."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer keeps its type to itself
        """Put full names in place of those that are cut short, up to `--`."""
        known = [
            option for parameter in self.params for option in (*parameter.opts, *parameter.secondary_opts)
        ]
        end = args.index("--") if "--" in args else len(args)
        return super().parse_args(ctx, [*(_full(word, known) for word in args[:end]), *args[end:]])


def _full(word: str, known: list[str]) -> str:
    name, sign, value = word.partition("=")
    if not name.startswith("--") or name in known:
        return word
    meant = [option for option in known if option.startswith(name)]
    return f"{meant[0]}{sign}{value}" if len(meant) == 1 else word
