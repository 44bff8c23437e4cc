"""From a recording to the rests and turns of one unit: the first step of most procedures."""
