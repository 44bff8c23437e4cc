"""Long options by an unambiguous part of their names: `--gyroscope-u` does for `--gyroscope-unit`."""

from __future__ import annotations

import re
from itertools import compress, pairwise
from typing import Any

from typer.core import TyperCommand

NEGATIVE = re.compile(r"-\.?\d")


class AbbreviatingCommand(TyperCommand):
    """A command whose long options may be cut short; what is cut too short stays unknown, and is refused."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer keeps its type to itself
        """Puts full names in place of those that are cut short, up to `--`."""
        known = [
            option for parameter in self.params for option in (*parameter.opts, *parameter.secondary_opts)
        ]
        end = args.index("--") if "--" in args else len(args)
        return super().parse_args(ctx, [*(_full(word, known) for word in args[:end]), *args[end:]])


class NumbersCommand(AbbreviatingCommand):
    """A command whose arguments are numbers, which may begin with a minus: `goto -90,0`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer keeps its type to itself
        """Puts arguments that begin with a minus and a digit behind `--`, where they are no options."""
        end = args.index("--") if "--" in args else len(args)
        before = ["", *args[:end]]
        with_value = {
            option
            for parameter in self.params
            if parameter.param_type_name == "option" and not getattr(parameter, "is_flag", False)
            for option in parameter.opts
        }
        negative = [
            NEGATIVE.match(word) is not None and last not in with_value for last, word in pairwise(before)
        ]
        options = list(compress(args[:end], (not each for each in negative)))
        return super().parse_args(ctx, [*options, "--", *compress(args[:end], negative), *args[end + 1 :]])


def _full(word: str, known: list[str]) -> str:
    name, sign, value = word.partition("=")
    if not name.startswith("--") or name in known:
        return word
    meant = [option for option in known if option.startswith(name)]
    return f"{meant[0]}{sign}{value}" if len(meant) == 1 else word
