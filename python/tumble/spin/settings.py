"""How to spin and how to judge it, as the core takes it."""

from __future__ import annotations

import math

from pydantic import ValidationError

from tumble import _core
from tumble.documents import mistake_in
from tumble.errors import ProcedureError
from tumble.setting_models import SpinSettings

DEFAULT = SpinSettings()
"""As the core has it."""
DEFAULT_TURNS = DEFAULT.turn / math.tau


def core_settings(
    stated: dict[str, object],
    *,
    turns: float | None = None,
    latitude: float | None = None,
    bias_instability: tuple[float, float] | None = None,
) -> _core.SpinSettings:
    """Give settings to the core: `stated` by their names, in SI units, `turns`, and `latitude`, deg.

    Raises `ProcedureError`, in one line, where a setting cannot have its value.
    """
    if turns is not None:
        stated = {**stated, "turn": turns * math.tau}
    try:
        settings = SpinSettings.model_validate(stated)
    except ValidationError as error:
        raise ProcedureError(mistake_in(error, SpinSettings)) from error
    return _core.SpinSettings(
        {name: getattr(settings, name) for name in settings.model_fields_set},
        latitude=None if latitude is None else math.radians(latitude),
        bias_instability=bias_instability,
    )
