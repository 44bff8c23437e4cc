"""Made by scripts/write_settings.py from the tables of settings; edit those instead."""

from tumble.documents import Document

class SpinSettings(Document):
    """How to spin and how to judge it."""

    still: float = 5.0
    """How long to stand still. In s."""
    still_timeout: float = 60.0
    """How long to wait until the robot has stood still. In s."""
    spin_timeout: float = 120.0
    """How long to wait for the turn to be made. In s."""
    longest_gap: float = 0.25
    """Longest pause in the samples. In s."""
    block: float = 0.2
    """Length of the blocks over which samples are averaged. In s."""
    shortest_stop: float = 1.0
    """Shortest stop after the first rest that is counted as a rest. In s."""
    gravity: float = 9.80665
    """Local gravity. In m/s^2."""
    turn: float = 12.566370614359172
    """How far to turn, both directions together. In rad."""
    rate: float = 1.0
    """Speed to turn at. It is not judged: it is what a robot may be told. In rad/s."""
    largest_floor_tilt: float = 0.17453292519943295
    """Largest floor tilt. In rad."""
    scale_sigma: float = 0.01
    """1-sigma of the gyroscope's scale error about the turning axis, before anything is known of it."""
    specific_force_instability: float = 0.0
    """Bias instability of the accelerometer; 0 where it is not known or does not matter. In m/s^2."""
    angular_rate_instability: float = 0.0
    """Bias instability of the gyroscope; 0 where it is not known or does not matter. In rad/s."""
    specific_force_range: float | None = None
    """End of the accelerometer's range; `none`: not known. In m/s^2."""
    angular_rate_range: float | None = None
    """End of the gyroscope's range; `none`: not known. In rad/s."""
    earth_rate_up: float = 0.0
    """Upward part of the Earth's rotation; 0 where the latitude is not known. In rad/s."""
    largest_lift: float = 0.5
    """Largest change of the force along the turning axis. In m/s^2."""
    largest_rate_across: float = 0.1
    """Largest rate across the turning axis. In rad/s."""
    largest_share_across: float = 0.05
    """Largest rate across the turning axis as a share of the rate about it."""
    largest_rate_bias: float = 0.5
    """Largest plausible bias of the gyroscope. A robot that seems to turn faster does not stand still. In
    rad/s."""
    largest_step: float = 0.25
    """Largest turn from one sample to the next. In rad."""
    largest_specific_force_scatter: float = 2.0
    """Largest scatter of specific force at which a robot may stand still. In m/s^2."""
    largest_angular_rate_scatter: float = 0.2
    """Largest scatter of angular rate at which a robot may stand still. In rad/s."""
    variance_ratio: float = 4.0
    """How much larger than the noise floor the variance of a quiet block may be."""
    smallest_specific_force_scatter: float = 0.005
    """Scatter of specific force below which a block is quiet whatever the floor. In m/s^2."""
    smallest_angular_rate_scatter: float = 0.0003
    """Scatter of angular rate below which a block is quiet whatever the floor. In rad/s."""
    specific_force_drift: float = 0.005
    """How far the specific force of a block may stray from its rest besides noise. In m/s^2."""
    angular_rate_drift: float = 0.0005
    """How far the angular rate of a block may stray from its rest besides noise. In rad/s."""
    sigmas: float = 6.0
    """How many sigma of the mean a block may stray besides."""
    level_floor: bool = False
    """Take the floor for level, as the published estimator does."""
