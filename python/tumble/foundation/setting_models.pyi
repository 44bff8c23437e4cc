"""Made by scripts/write_settings.py from the tables of settings; edit those instead."""

from typing import Literal

from tumble.foundation.documents import Document

class MonitorSettings(Document):
    """All settings of the monitor."""

    rest_specific_force_scatter: float = 0.1
    """Scatter of specific force, and change of its mean, below which a unit is at rest. In m/s^2."""
    rest_angular_rate_scatter: float = 0.02
    """Scatter of angular rate, and change of its mean, below which a unit is at rest. In rad/s."""
    rest_settle: float = 0.5
    """Rest that is let pass before readings count. In s."""
    rest_duration: float = 2.0
    """Rest over which readings are averaged before units are evaluated. In s."""
    window: float = 0.05
    """Length of the windows over which all units are averaged, whatever their rates; a whole part of 1 s. In
    s."""
    gravity: float = 9.80665
    """Local gravity. In m/s^2."""
    uncalibrated_specific_force: float = 0.8
    """Deviation at rest of a primary without a calibration of its own up to which secondaries are calibrated
    relative to it, where they deviate as well. In m/s^2."""
    uncalibrated_angular_rate: float = 0.1
    """Deviation at rest of a primary without a calibration of its own up to which secondaries are calibrated
    relative to it, where they deviate as well. In rad/s."""
    evaluate_after_start: bool = True
    """Evaluate the first rest after the start."""
    evaluate_every: float | None = 600.0
    """Calibrate what deviates at a rest once so much time has passed; `none`: on command only. In s."""
    data: Literal["compensated", "raw"] = "compensated"
    """Take deviations from compensated data or from raw data, with thresholds to match."""
    vector_check: bool = True
    """Compare a secondary also with a valid primary, axis by axis: the norm is blind across gravity."""
    secondary_accelerometer_threshold: str = "0.1"
    """Deviation of a secondary's accelerometer above which its calibration is triggered. In m/s^2."""
    secondary_gyroscope_threshold: str = "0.01"
    """Deviation of a secondary's gyroscope above which its calibration is triggered. In rad/s."""
    primary_accelerometer_threshold: str = "0.1"
    """Deviation of the primary's accelerometer above which it is invalid. In m/s^2."""
    primary_gyroscope_threshold: str = "0.01"
    """Deviation of the primary's gyroscope above which it is invalid. In rad/s."""
    gate: Literal["secondary alone", "whole primary", "sensor by sensor"] = "whole primary"
    """Trigger on the secondary alone, with both sensors of the primary valid, or each with its own kind."""
    scope: Literal["all sensors", "triggering sensor"] = "all sensors"
    """Calibrate both sensors of a secondary, or only the one that deviates."""
    motion_specific_force: float = 0.5
    """Change of the primary's mean specific force since the rest that counts as motion. In m/s^2."""
    motion_angular_rate: float = 0.2
    """Change of the primary's mean angular rate since the rest that counts as motion. In rad/s."""
    motion_timeout: float = 300.0
    """Longest wait for motion; then the calibration is abandoned. In s."""
    collect: float = 30.0
    """Motion to be collected. In s."""
    collect_timeout: float = 300.0
    """Longest time for collecting; then what there is has to do, or the calibration is abandoned. In s."""
    fewest_pairs: int = 200
    """Fewest pairs with which a fit is tried when time is up."""
    largest_fit_model: Literal["offset", "gain", "affine", "affine and lever arm"] = "affine and lever arm"
    """Largest model that may be fitted: the largest up to it that the motion shows is used."""
    fit_rests: bool = True
    """Fit to means at rests at which the primary is valid as well as to pairs in motion."""
    excitation_specific_force: float = 0.5
    """Standard deviation of specific force along a direction from which on the matrix is fitted along it. In
    m/s^2."""
    excitation_angular_rate: float = 0.2
    """Standard deviation of angular rate along a direction from which on the matrix is fitted along it. In
    rad/s."""
    excitation_lever_arm: float = 2.0
    """Specific force for each metre of lever arm, root mean square, from which on the lever arm is fitted. In
    1/s^2."""
    adoption: Literal["if better", "always"] = "if better"
    """Replace what is stored where the fit is plausible and better, or by each calibration."""
    improvement: float = 0.02
    """Share by which its residual on held-out pairs has to be smaller than the stored one's."""
    largest_specific_force_bias: float = 3.0
    """Largest bias of an accelerometer. In m/s^2."""
    largest_angular_rate_bias: float = 1.0
    """Largest bias of a gyroscope. In rad/s."""
    largest_scale_error: float = 0.1
    """Largest deviation of a scale factor from one."""
    largest_misalignment: float = 0.1
    """Largest misalignment beside the nominal mounting. In rad."""
    largest_lever_arm: float = 1.0
    """Longest lever arm. In m."""
    largest_specific_force_drift: float = 0.1
    """Largest drift of an accelerometer while pairs were collected. In m/s^2."""
    largest_angular_rate_drift: float = 0.01
    """Largest drift of a gyroscope while pairs were collected. In rad/s."""
    largest_specific_force_residual: float = 0.5
    """Largest residual of an accelerometer on held-out pairs, root mean square. In m/s^2."""
    largest_angular_rate_residual: float = 0.05
    """Largest residual of a gyroscope on held-out pairs, root mean square. In rad/s."""
    largest_followed_specific_force: float = 0.15
    """Largest shift by which calibrations of an accelerometer may follow the primary where no rest proves it
    right. In m/s^2."""
    largest_followed_angular_rate: float = 0.015
    """Largest shift by which calibrations of a gyroscope may follow the primary where no rest proves it
    right. In rad/s."""
    late: float = 0.1
    """Time without a sample after which a unit is late. In s."""
    frozen: float = 0.1
    """Time in which all axes of a sensor repeat their readings, and 16 readings at least, until it is frozen;
    three times that for a sensor of one axis. In s."""
    saturated: float = 0.05
    """Time at the end of its range, or without finite numbers, that a sensor may spend; forgiven slowly. In
    s."""
    spike_specific_force: float = 40.0
    """Specific force that leaves by more, and is back with the next sample, is a spike. In m/s^2."""
    spike_angular_rate: float = 10.0
    """Angular rate that leaves by more, and is back with the next sample, is a spike. In rad/s."""
    tolerated_specific_force: float = 0.05
    """Drift of specific force that is within specification: a difference of two units that is none. In
    m/s^2."""
    tolerated_angular_rate: float = 0.0075
    """Drift of angular rate that is within specification: a difference of two units that is none. In
    rad/s."""
    drift_per_kelvin_specific_force: float = 0.00196
    """Drift of specific force of an axis with temperature, of units whose logs or samples state one. In
    m/s^2/K."""
    drift_per_kelvin_angular_rate: float = 0.00026
    """Drift of angular rate of an axis with temperature, of units whose logs or samples state one. In
    rad/s/K."""
    noise_ratio: float = 9.0
    """Scatter of a unit, as a multiple of that expected from the others, beyond which it is noisy."""
    rest_specific_force: float = 1.5
    """Deviation of specific force from gravity at rest that no error of a working unit explains. In m/s^2."""
    rest_angular_rate: float = 0.2
    """Angular rate at rest that no error of a working unit explains. In rad/s."""
    recovery: float = 0.5
    """Time in which nothing may have been wrong until a unit is healthy again. In s."""
    hold: float = 0.02
    """Time a source has to be unhealthy before another takes over. In s."""
    return_after: float | None = None
    """Health to be proven by the primary before it takes over again; `none`: on command only. In s."""
    calibrated_only: bool = False
    """Select only secondaries that have a stored error."""

class SpinSettings(Document):
    """Course of a spin, and limits of the result."""

    still: float = 5.0
    """Time to stand still. In s."""
    still_timeout: float = 60.0
    """Longest wait until the robot has stood still. In s."""
    spin_timeout: float = 120.0
    """Longest wait for the turn. In s."""
    longest_gap: float = 0.25
    """Longest pause in the samples. In s."""
    block: float = 0.2
    """Length of the blocks over which samples are averaged. In s."""
    shortest_stop: float = 1.0
    """Shortest stop after the first rest that is counted as a rest. In s."""
    gravity: float = 9.80665
    """Local gravity. In m/s^2."""
    turn: float = 12.566370614359172
    """Angle to turn, both directions together. In rad."""
    rate: float = 1.0
    """Speed to turn at, which a robot may be asked for; no limit depends on it. In rad/s."""
    largest_floor_tilt: float = 0.17453292519943295
    """Largest floor tilt. In rad."""
    scale_sigma: float = 0.01
    """1-sigma of the gyroscope's scale error about the turning axis, before anything is known of it."""
    specific_force_instability: float = 0.0005314597566568179
    """Bias instability of the accelerometer; that of a consumer grade where none is stated. In m/s^2."""
    angular_rate_instability: float = 3.3572208103041835e-05
    """Bias instability of the gyroscope; that of a consumer grade where none is stated. In rad/s."""
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
    """Largest ratio of the variance of a quiet block to the noise floor."""
    smallest_specific_force_scatter: float = 0.005
    """Scatter of specific force below which a block is quiet whatever the floor. In m/s^2."""
    smallest_angular_rate_scatter: float = 0.0003
    """Scatter of angular rate below which a block is quiet whatever the floor. In rad/s."""
    specific_force_drift: float = 0.005
    """Largest deviation of the specific force of a block from its rest besides noise. In m/s^2."""
    angular_rate_drift: float = 0.0005
    """Largest deviation of the angular rate of a block from its rest besides noise. In rad/s."""
    sigmas: float = 6.0
    """Further deviation of the mean of a block, in sigmas."""
    level_floor: bool = False
    """Take the floor for level, as the published estimator does."""
