"""Messages on what acquisition finds, for the command and for the page in a browser."""

from __future__ import annotations

REST_REJECTIONS = {
    "vibrating": "vibration",
    "drifting": "gravity drifts: a slow turn",
    "turning": "angular rate differs from the rests beside it: a slow turn",
}
"""Why something quiet was no rest, by the code that `Acquired.rejected_rests` gives."""

STUCK = "{channel} is stuck at {value:.6g} {unit} from {span} s; check the sensor and its column"
SATURATED_AT_REST = (
    "{channel} is saturated at {value:.6g} {unit}, first at {first}, while the unit stood still; choose a "
    "larger range"
)
TAKE_TURNS = (
    "samples of {units} units take turns: the median of {place} sample differs from that of the others "
    "by far more than noise; log each unit by itself, or by a label"
)
PLACES = {2: "every second", 3: "every third", 4: "every fourth"}
"""Place of a sample of the same unit, by the number of units."""
STOOD_STILL = (
    "all readings stood still from {span} s, as those of no sensor with noise do: that time is left out"
)
NOT_RECORDED = "no {triad} readings were recorded: nothing is said of the {triad}"
CORRECTED = "the log was already corrected: {what} on top of that correction{remedy}"
HOLDS = "this calibration holds"
"""Subject of `CORRECTED`."""
NO_REST = "{span} s is not a rest: {why}"
AT_RANGE_END = "{channel} is at the end of its range in {samples} of {all}, in {touched} of {turns}"
FIRST_AT = "{seen}, first at {first}"
TURNS_USED = "{seen}: gravity is read at the rests, so the turns are used"
TURNS_LEFT_OUT = "{seen}, which are not used: {spans}"
AND_MORE = "{spans} and {count} more"
MOST_NAMED = 3
"""Turns of which a notice gives the time; the others it counts."""
COARSE = (
    "{triad} {axes}: a resolution of {step:.2g} {unit} is coarser than the noise; rounding leaves "
    "{sigma:.2g} {unit} on a mean, which the sigmas include; log more digits, or choose a smaller range"
)
DEAD_BAND = (
    "{triad} {axes}: {zeros:.0f} % of the samples at rest read exactly zero, and no other is below "
    "{width:.2g} {unit}: a dead band hides the bias, and the sigmas include that; switch it off in the sensor"
)
GAP = "samples are missing from {span} s: what the gyroscope read then is not used"
MISSING = (
    "{counted} missing ({share:.2g} %): integrals over turns run straight across the pauses, and the sigmas "
    "include what that leaves"
)
