"""A unit that rests while it warms and cools, with a drift over temperature that is known."""
