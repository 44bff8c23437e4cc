"""Settings of a spin and of its judgement, in the form of the core."""

from __future__ import annotations

import math

from pydantic import ValidationError

from tumble import _core
from tumble.foundation.documents import mistake_in
from tumble.foundation.errors import ProcedureError
from tumble.foundation.setting_models import SpinSettings

DEFAULT = SpinSettings()
"""Default settings of the core."""
DEFAULT_TURNS = DEFAULT.turn / math.tau
SLOWEST = 2.0
"""Times as long as asked for that a turn may take."""


def core_settings(
    stated: dict[str, object],
    *,
    turns: float | None = None,
    latitude: float | None = None,
    bias_instability: tuple[float, float] | None = None,
) -> _core.SpinSettings:
    """Returns settings to the core: `stated` by their names, in SI units, `turns`, and `latitude`, deg.

    Raises `ProcedureError`, in one line, where a setting cannot have its value.
    """
    if turns is not None:
        stated = {**stated, "turn": turns * math.tau}
    try:
        settings = _with_time_enough(SpinSettings.model_validate(stated))
    except ValidationError as error:
        raise ProcedureError(mistake_in(error, SpinSettings)) from error
    return _core.SpinSettings(
        {name: getattr(settings, name) for name in settings.model_fields_set},
        latitude=None if latitude is None else math.radians(latitude),
        bias_instability=bias_instability,
    )


def _with_time_enough(settings: SpinSettings) -> SpinSettings:
    """Extends the time limit where standing and turning take longer than usual."""
    stated = settings.model_fields_set
    later = {
        "still_timeout": DEFAULT.still_timeout - DEFAULT.still + settings.still,
        "spin_timeout": DEFAULT.spin_timeout + SLOWEST * (_turning(settings) - _turning(DEFAULT)),
    }
    longer = {
        name: value for name, value in later.items() if name not in stated and value > getattr(DEFAULT, name)
    }
    return settings.model_copy(update=longer)


def _turning(settings: SpinSettings) -> float:
    return float(settings.turn / settings.rate)
