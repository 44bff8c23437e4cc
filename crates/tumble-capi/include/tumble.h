/**
 * Tumble for firmware: calibration of inertial measurement units, without heap or operating system. C99, or C++17.
 * docs/how-to/c.md describes its integration; tumble.hpp has classes for C++.
 *
 * Units are SI, m/s^2 and rad/s; time is whole microseconds. Frames are right-handed; matrices are written row by row. All
 * numbers are single precision, and nothing is computed by way of double.
 *
 * The caller owns all memory. A pointer that is handed in may be null where that is stated; else it leads to a value of
 * its type, or room for one, that nobody else changes until the call returns. No pointer is kept, but for the context of
 * a tumble_flash. Null and unaligned pointers, storage that was not initialised, and impossible numbers are refused;
 * ::TUMBLE_ERROR_UNALIGNED is not named again at each call.
 *
 * State lives in storage: tumble_spin, tumble_redundancy, tumble_store. Storage may be static, on a stack or in a pool, and
 * may be moved as a whole while no call is under way. Calls with different storage do not know of each other; calls with
 * the same storage have to come one after the other, which is for the caller to see to among threads and interrupts.
 *
 * While a call that changes storage is under way, others with the same storage are answered by ::TUMBLE_ERROR_BUSY, but for
 * those that initialise: they overwrite whatever was there, so none may be made from a callback or an interrupt while
 * another call is under way. A call that takes storage as const does not mark it: nothing may change it until that
 * call returns.
 */

#ifndef TUMBLE_H
#define TUMBLE_H

/* Written by `cargo test --package tumble-capi --test header`; edit the Rust sources instead. */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Version of this header and its library: of the release, after https://semver.org. */
#define TUMBLE_VERSION "0.1.0"

#ifndef TUMBLE_UNITS
/** Units of a redundant set, the primary included, 2 to 8: the one the library was built for. */
#define TUMBLE_UNITS 3
#endif

/* Parts that the library was built without are named by macros: TUMBLE_WITHOUT_SPIN, TUMBLE_WITHOUT_REDUNDANCY,
 * TUMBLE_WITHOUT_CALIBRATION, TUMBLE_WITHOUT_AIDING, TUMBLE_WITHOUT_SETTINGS_CHECK, TUMBLE_WITHOUT_RECORDS,
 * TUMBLE_WITHOUT_TEMPERATURE, TUMBLE_WITHOUT_MAGNETOMETER. Their calls are declared all the same; they do not link. */

/* Words in the storage of a monitor for the model of a set, where the library was built with it
 * (TUMBLE_WITH_MAJORITY), for a calibration under way, and for aiding measurements. */
#ifdef TUMBLE_WITH_MAJORITY
#define TUMBLE_MAJORITY_WORDS (60 + 255 * TUMBLE_UNITS + 121 * TUMBLE_UNITS * TUMBLE_UNITS / 2)
#else
#define TUMBLE_MAJORITY_WORDS 0
#endif
#ifdef TUMBLE_WITHOUT_CALIBRATION
#define TUMBLE_CALIBRATION_WORDS 0
#else
#define TUMBLE_CALIBRATION_WORDS 305
#endif
#ifdef TUMBLE_WITHOUT_AIDING
#define TUMBLE_AIDING_WORDS 0
#else
#define TUMBLE_AIDING_WORDS (8 + 111 * TUMBLE_UNITS)
#endif

#if TUMBLE_UNITS < 2 || TUMBLE_UNITS > 8
#error "TUMBLE_UNITS is 2 to 8"
#endif

/**
 * Bytes of the encoded error of a magnetometer.
 */
#define TUMBLE_MAGNETOMETER_BYTES 125

/**
 * Most bytes of an encoded record.
 */
#define TUMBLE_RECORD_BYTES 171

/**
 * Words of 8 bytes in the storage of a monitor.
 */
#define TUMBLE_REDUNDANCY_WORDS (((((118 + (171 * TUMBLE_UNITS)) + ((4 * TUMBLE_UNITS) * TUMBLE_UNITS)) + TUMBLE_MAJORITY_WORDS) + TUMBLE_CALIBRATION_WORDS) + TUMBLE_AIDING_WORDS)

/**
 * Value of `output.source` and result of `tumble_redundancy_get_source()` where there is no source.
 */
#define TUMBLE_NO_SOURCE UINT32_MAX

/**
 * Flag of an output: its source is known to be wrong, or does not measure an axis of the primary, and no other unit
 * can replace it.
 */
#define TUMBLE_OUTPUT_DEGRADED 1

/**
 * All six axes of a unit: bits 0 to 2 accelerometer, 3 to 5 gyroscope, x y z each.
 */
#define TUMBLE_AXES_ALL 63

/**
 * Words of 8 bytes in the storage of a spin.
 */
#define TUMBLE_SPIN_WORDS 640

/**
 * Words of 8 bytes in the storage of a store.
 */
#define TUMBLE_STORE_WORDS 14

/**
 * Bytes of an encoded drift.
 */
#define TUMBLE_DRIFT_BYTES 100

/**
 * Version of the layout of all types here, and of the meaning of their fields. A library of another is refused: by all
 * calls that are given a size, with ::TUMBLE_ERROR_SIZE.
 */
#define TUMBLE_ABI 1

/**
 * Outcome of a call: ::TUMBLE_OK, or the reason why nothing was done. Unless a function states otherwise, its outputs
 * were not written then, and no state has changed.
 *
 */
enum tumble_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * It was done.
     */
    TUMBLE_OK = 0,
    /**
     * A pointer is null.
     */
    TUMBLE_ERROR_NULL,
    /**
     * A pointer is not aligned as its type asks. Any call that is given pointers may answer it.
     */
    TUMBLE_ERROR_UNALIGNED,
    /**
     * The storage, settings or a unit have another size or version than this library was built for: header and library do
     * not belong together. Or settings or a unit were not filled with their defaults.
     */
    TUMBLE_ERROR_SIZE,
    /**
     * The storage was not initialised, or was overwritten since.
     */
    TUMBLE_ERROR_NOT_INITIALISED,
    /**
     * A call that changes the same storage is under way, so this one comes from a callback, an interrupt or another thread.
     */
    TUMBLE_ERROR_BUSY,
    /**
     * The library was built for another number of units than were given; see #TUMBLE_UNITS.
     */
    TUMBLE_ERROR_UNITS,
    /**
     * There is no unit of this number.
     */
    TUMBLE_ERROR_NO_SUCH_UNIT,
    /**
     * An enumerated value is none of its kind.
     */
    TUMBLE_ERROR_CODE,
    /**
     * A number is not finite.
     */
    TUMBLE_ERROR_NOT_FINITE,
    /**
     * A setting is not positive or out of its range.
     */
    TUMBLE_ERROR_SETTING,
    /**
     * Settings contradict each other; tumble_redundancy_check() names them.
     */
    TUMBLE_ERROR_CONTRADICTION,
    /**
     * A matrix has no inverse: two axes coincide, or one is zero.
     */
    TUMBLE_ERROR_SINGULAR,
    /**
     * The axes of a triad form a left-handed set, which no mounting explains.
     */
    TUMBLE_ERROR_LEFT_HANDED,
    /**
     * The primary has to have an axis, and its rotation has to be the identity.
     */
    TUMBLE_ERROR_PRIMARY,
    /**
     * The matrix of a unit's mounting is no rotation.
     */
    TUMBLE_ERROR_MOUNTING,
    /**
     * Two units have the same identity.
     */
    TUMBLE_ERROR_SAME_IDENTITY,
    /**
     * The primary's own calibration is taken before the first sample only.
     */
    TUMBLE_ERROR_BEGUN,
    /**
     * The spin shows nothing that could be solved for; the failure gives the reason.
     */
    TUMBLE_ERROR_SPIN,
    /**
     * The buffer is too small; #TUMBLE_RECORD_BYTES are always enough.
     */
    TUMBLE_ERROR_NO_ROOM,
    /**
     * Fewer bytes than any record has.
     */
    TUMBLE_ERROR_TOO_SHORT,
    /**
     * The bytes do not begin as records do.
     */
    TUMBLE_ERROR_NOT_A_RECORD,
    /**
     * The bytes are not as they were written.
     */
    TUMBLE_ERROR_CORRUPT,
    /**
     * The record was written by a newer version of this library.
     */
    TUMBLE_ERROR_VERSION,
    /**
     * The range of flash does not begin at a page, or has not an even number of pages; or a page is no multiple of 32 bytes.
     */
    TUMBLE_ERROR_PAGES,
    /**
     * The range of flash is empty, or goes beyond 32 bits.
     */
    TUMBLE_ERROR_BOUNDS,
    /**
     * Half of the range of flash has no room for the records of one sensor: 832 bytes.
     */
    TUMBLE_ERROR_TOO_SMALL,
    /**
     * A callback of the flash is missing.
     */
    TUMBLE_ERROR_NO_DRIVER,
    /**
     * The driver of the flash reported errors for all of it, or could not erase.
     */
    TUMBLE_ERROR_FLASH,
    /**
     * Eight places in a row hold something else than was written to them: the flash is worn.
     */
    TUMBLE_ERROR_NOT_AS_WRITTEN,
    /**
     * Flash would wear out; the call returns the time to wait.
     */
    TUMBLE_ERROR_TOO_SOON,
    /**
     * There are too many units for the range of flash, even without the previous records, which are dropped first.
     */
    TUMBLE_ERROR_FULL,
    /**
     * There is no such record.
     */
    TUMBLE_ERROR_NOTHING_STORED,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_status tumble_status;
#else
typedef uint32_t tumble_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Three axes of one kind.
 */
enum tumble_sensor
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Specific force, m/s^2.
     */
    TUMBLE_SENSOR_ACCELEROMETER,
    /**
     * Angular rate, rad/s.
     */
    TUMBLE_SENSOR_GYROSCOPE,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_sensor tumble_sensor;
#else
typedef uint32_t tumble_sensor;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Models that a fit may estimate; each includes those before.
 */
enum tumble_fit_model
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Three offsets.
     */
    TUMBLE_FIT_MODEL_OFFSET,
    /**
     * An offset and a gain for each axis.
     */
    TUMBLE_FIT_MODEL_GAIN,
    /**
     * Offset and matrix.
     */
    TUMBLE_FIT_MODEL_AFFINE,
    /**
     * Offset, matrix and lever arm.
     */
    TUMBLE_FIT_MODEL_AFFINE_AND_LEVER_ARM,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_fit_model tumble_fit_model;
#else
typedef uint32_t tumble_fit_model;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Ways to set a threshold.
 */
enum tumble_threshold_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Always the same; the number is m/s^2 or rad/s, above 0.
     */
    TUMBLE_THRESHOLD_KIND_FIXED,
    /**
     * The error at the last calibration and a margin upon it; the number is m/s^2 or rad/s, above 0.
     */
    TUMBLE_THRESHOLD_KIND_BY_MARGIN,
    /**
     * The error at the last calibration times a ratio; the number is above 1.
     */
    TUMBLE_THRESHOLD_KIND_BY_RATIO,
    /**
     * The error from the factory and a margin upon it; the number is m/s^2 or rad/s, above 0.
     */
    TUMBLE_THRESHOLD_KIND_FACTORY_BY_MARGIN,
    /**
     * Threshold of a unit that follows the settings; the number does not count. Not for settings.
     */
    TUMBLE_THRESHOLD_KIND_OF_SETTINGS,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_threshold_kind tumble_threshold_kind;
#else
typedef uint32_t tumble_threshold_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Which data deviations at rest are taken from.
 */
enum tumble_data
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Raw readings: thresholds have to allow for the error that is known.
     */
    TUMBLE_DATA_RAW,
    /**
     * After the stored error, and the primary's own calibration, were taken off.
     */
    TUMBLE_DATA_COMPENSATED,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_data tumble_data;
#else
typedef uint32_t tumble_data;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Sensors whose deviations let a calibration be triggered.
 */
enum tumble_gate
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * The secondary's alone.
     */
    TUMBLE_GATE_SECONDARY_ALONE,
    /**
     * The secondary's, with both sensors of the primary valid.
     */
    TUMBLE_GATE_WHOLE_PRIMARY,
    /**
     * The secondary's, sensor by sensor, each with the primary's sensor of its kind valid.
     */
    TUMBLE_GATE_SENSOR_BY_SENSOR,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_gate tumble_gate;
#else
typedef uint32_t tumble_gate;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Sensors that a trigger has calibrated.
 */
enum tumble_scope
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Accelerometer and gyroscope of the secondary.
     */
    TUMBLE_SCOPE_ALL_SENSORS,
    /**
     * Only the sensor that deviates.
     */
    TUMBLE_SCOPE_TRIGGERING_SENSOR,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_scope tumble_scope;
#else
typedef uint32_t tumble_scope;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Which fits replace what is stored.
 */
enum tumble_adoption
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * One that is plausible and explains held-out pairs better than what is stored.
     */
    TUMBLE_ADOPTION_IF_BETTER,
    /**
     * Each, as in the literature: what is stored is that of the last calibration.
     */
    TUMBLE_ADOPTION_ALWAYS,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_adoption tumble_adoption;
#else
typedef uint32_t tumble_adoption;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Kinds of events.
 */
enum tumble_event_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * The platform came to rest.
     */
    TUMBLE_EVENT_KIND_REST_BEGAN,
    /**
     * It moves again.
     */
    TUMBLE_EVENT_KIND_REST_ENDED,
    /**
     * A deviation of a sensor at rest was compared with its threshold: `check`; `value` and `limit`, m/s^2 or rad/s.
     */
    TUMBLE_EVENT_KIND_EVALUATED,
    /**
     * A sensor deviates but is not calibrated: `reason`.
     */
    TUMBLE_EVENT_KIND_WITHHELD,
    /**
     * Calibration mode of these sensors: waiting for motion.
     */
    TUMBLE_EVENT_KIND_TRIGGERED,
    /**
     * Pairs are collected from now on.
     */
    TUMBLE_EVENT_KIND_MOTION_BEGAN,
    /**
     * A fit was made: `fit_model`, `directions`, `pairs`; `value`: residual on held-out pairs, root mean square, `limit`: the
     * same with what is stored, m/s^2 or rad/s.
     */
    TUMBLE_EVENT_KIND_FITTED,
    /**
     * It replaces what was stored: `record`, to be kept by whoever keeps records.
     */
    TUMBLE_EVENT_KIND_ADOPTED,
    /**
     * A calibration was refused: `reason`; `value` and `limit` in the unit of the reason, or `pairs` and `limit`.
     */
    TUMBLE_EVENT_KIND_REFUSED,
    /**
     * Calibration mode ended without a fit: `reason`.
     */
    TUMBLE_EVENT_KIND_ABANDONED,
    /**
     * A unit failed: `reason`; `channel`, `value` and `limit` with the meaning given by the reason.
     */
    TUMBLE_EVENT_KIND_UNHEALTHY,
    /**
     * A unit is in health again.
     */
    TUMBLE_EVENT_KIND_HEALTHY,
    /**
     * It contradicts another unit, `units`, and nobody knows yet which is wrong: they are `value` apart over `scale` s, and may
     * be `limit`, m/s^2 or rad/s.
     */
    TUMBLE_EVENT_KIND_DISAGREE,
    /**
     * It agrees with that unit again: `units`.
     */
    TUMBLE_EVENT_KIND_AGREE,
    /**
     * An aiding measurement was left out: `reason`; reported once for each.
     */
    TUMBLE_EVENT_KIND_AIDING_LEFT_OUT,
    /**
     * An aiding measurement contradicts all units, and decides nothing until it fits again: mean square misfit `value`
     * with the unit that fits best, in sigmas, above `limit`.
     */
    TUMBLE_EVENT_KIND_AIDING_DISTRUSTED,
    /**
     * It fits again.
     */
    TUMBLE_EVENT_KIND_AIDING_TRUSTED,
    /**
     * The source of the output is this unit now: `reason`.
     */
    TUMBLE_EVENT_KIND_SELECTED,
    /**
     * There is no source any more: no unit is fit.
     */
    TUMBLE_EVENT_KIND_NONE_SELECTED,
    /**
     * A stored record was taken: `sequence`.
     */
    TUMBLE_EVENT_KIND_RESTORED,
    /**
     * A stored record was not taken: `reason`.
     */
    TUMBLE_EVENT_KIND_RECORD_REJECTED,
    /**
     * The common clock jumped: `by`. Windows begin anew.
     */
    TUMBLE_EVENT_KIND_TIME_JUMPED,
    /**
     * All units are at the ends of their ranges, and none of them is the cause: sensor.
     */
    TUMBLE_EVENT_KIND_ALL_SATURATED,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_event_kind tumble_event_kind;
#else
typedef uint32_t tumble_event_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Why it happened.
 */
enum tumble_reason
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * No reason is given.
     */
    TUMBLE_REASON_NONE,
    /**
     * Withheld, abandoned: the primary deviates itself.
     */
    TUMBLE_REASON_PRIMARY_INVALID,
    /**
     * Withheld, abandoned: the primary is not in health.
     */
    TUMBLE_REASON_PRIMARY_UNHEALTHY,
    /**
     * Withheld, abandoned: the secondary is not in health.
     */
    TUMBLE_REASON_SECONDARY_UNHEALTHY,
    /**
     * Withheld, abandoned: units contradict each other, and nobody knows which is wrong.
     */
    TUMBLE_REASON_DISPUTED,
    /**
     * Withheld: a calibration is under way already.
     */
    TUMBLE_REASON_ALREADY_CALIBRATING,
    /**
     * Abandoned: nothing moved in time.
     */
    TUMBLE_REASON_NO_MOTION,
    /**
     * Abandoned: too little moved in time.
     */
    TUMBLE_REASON_TIMED_OUT,
    /**
     * Abandoned: the common clock jumped.
     */
    TUMBLE_REASON_TIME_JUMPED,
    /**
     * Abandoned: what was stored of the secondary was replaced from outside.
     */
    TUMBLE_REASON_RECORD_REPLACED,
    /**
     * Record rejected: no secondary has its identity, or the secondary has no such sensor.
     */
    TUMBLE_REASON_OF_ANOTHER_UNIT,
    /**
     * Record rejected, aiding measurement left out: not all of it are numbers. Unhealthy: nor are too many readings,
     * the last on `channel`.
     */
    TUMBLE_REASON_NOT_FINITE,
    /**
     * Record rejected: it lies outside what the settings allow a calibration to be.
     */
    TUMBLE_REASON_IMPLAUSIBLE,
    /**
     * Refused: numbers failed.
     */
    TUMBLE_REASON_UNSOLVABLE,
    /**
     * Refused: fewer `pairs` than `limit`.
     */
    TUMBLE_REASON_TOO_FEW_PAIRS,
    /**
     * Refused: the residual on held-out pairs is too large, m/s^2 or rad/s.
     */
    TUMBLE_REASON_RESIDUAL_TOO_LARGE,
    /**
     * Refused: the bias is too large, m/s^2 or rad/s.
     */
    TUMBLE_REASON_IMPLAUSIBLE_BIAS,
    /**
     * Refused: a scale factor is too far from one.
     */
    TUMBLE_REASON_IMPLAUSIBLE_SCALE,
    /**
     * Refused: axes are too far from where they are nominally, rad.
     */
    TUMBLE_REASON_IMPLAUSIBLE_MISALIGNMENT,
    /**
     * Refused: the lever arm is too long, m.
     */
    TUMBLE_REASON_IMPLAUSIBLE_LEVER_ARM,
    /**
     * Refused: one of the two changed while pairs were collected, m/s^2 or rad/s.
     */
    TUMBLE_REASON_DRIFTING,
    /**
     * Refused: at the rest before, the two related otherwise, m/s^2 or rad/s.
     */
    TUMBLE_REASON_DISAGREES_WITH_REST,
    /**
     * Refused: the stored calibration explains the held-out pairs as well, or better, m/s^2 or rad/s.
     */
    TUMBLE_REASON_NOT_BETTER,
    /**
     * Aiding measurement left out: a sigma is not above zero, or no axis is measured.
     */
    TUMBLE_REASON_NO_SIGMA,
    /**
     * Aiding measurement left out: a score below zero.
     */
    TUMBLE_REASON_NEGATIVE_SCORE,
    /**
     * Aiding measurement left out: there is no unit of that number.
     */
    TUMBLE_REASON_NO_SUCH_UNIT,
    /**
     * Aiding measurement left out: its time is yet to come.
     */
    TUMBLE_REASON_EARLY,
    /**
     * Unhealthy: no sample came for `value` s. Aiding measurement left out: its time is not kept any more.
     */
    TUMBLE_REASON_LATE,
    /**
     * Unhealthy: all axes of a sensor repeated their readings for `value` s.
     */
    TUMBLE_REASON_FROZEN,
    /**
     * Unhealthy: `channel` repeats its reading `value`, m/s^2 or rad/s, while the others of its sensor move.
     */
    TUMBLE_REASON_STUCK,
    /**
     * Unhealthy: `channel` is at the end of its range too often; `value`: its last reading, m/s^2 or rad/s.
     */
    TUMBLE_REASON_SATURATED,
    /**
     * Unhealthy: readings of `channel` leave and come back too often, the last by `value`, m/s^2 or rad/s.
     */
    TUMBLE_REASON_SPIKES,
    /**
     * Unhealthy: `units` agree with each other without it; a sensor is `value` from one of them, m/s^2 or rad/s.
     */
    TUMBLE_REASON_OUT_OF_FAMILY,
    /**
     * Unhealthy: a sensor scatters by `value`, m/s^2 or rad/s, more than the others make one expect.
     */
    TUMBLE_REASON_NOISY,
    /**
     * Unhealthy: of two units that disagree, a sensor of this one stepped from one sample to the next; `value`: by this share of
     * what they are apart.
     */
    TUMBLE_REASON_OWN_STEP,
    /**
     * Unhealthy: two units disagree, and the readings of this one at rest differ from those in health by `value`,
     * m/s^2 or rad/s.
     */
    TUMBLE_REASON_REST,
    /**
     * Unhealthy: of two units that disagree, gravity as its own gyroscope carries it is not where its accelerometer finds it;
     * `value`: logarithm of the ratio of likelihoods.
     */
    TUMBLE_REASON_OWN_GYROSCOPE,
    /**
     * Unhealthy: an aiding measurement contradicts it; `value`: logarithm of the ratio of likelihoods.
     */
    TUMBLE_REASON_AIDING,
    /**
     * Unhealthy: it is `value` from a valid primary at rest, more than any error that calibration can find, m/s^2 or rad/s.
     */
    TUMBLE_REASON_REFUTED,
    /**
     * Unhealthy: at rest a sensor deviates from physics by `value`, m/s^2 or rad/s.
     */
    TUMBLE_REASON_IMPLAUSIBLE_AT_REST,
    /**
     * Unhealthy: its clock left that of the other units.
     */
    TUMBLE_REASON_CLOCK_JUMPED,
    /**
     * Selected: there was no source, and the primary is fit.
     */
    TUMBLE_REASON_START,
    /**
     * Selected: the primary failed.
     */
    TUMBLE_REASON_PRIMARY_FAILED,
    /**
     * Selected: a secondary that was the source failed.
     */
    TUMBLE_REASON_SOURCE_FAILED,
    /**
     * Selected: the primary has been healthy for long enough.
     */
    TUMBLE_REASON_PRIMARY_PROVEN,
    /**
     * Selected: the primary was asked for.
     */
    TUMBLE_REASON_COMMAND,
    /**
     * None selected: the source failed, and nobody else is fit.
     */
    TUMBLE_REASON_NONE_FIT,
    /**
     * Withheld: nobody asked, and the settings have it calibrated on command only.
     */
    TUMBLE_REASON_ON_COMMAND_ONLY,
    /**
     * Refused: other secondaries are from the primary as this one is, by `value`, m/s^2 or rad/s; it is the primary that changed.
     */
    TUMBLE_REASON_SHARED_BY_SIBLINGS,
    /**
     * Refused: with the calibrations before, it would follow the primary by `value`, m/s^2 or rad/s, farther than anything
     * supports.
     */
    TUMBLE_REASON_BEYOND_SUPPORT,
    /**
     * Unhealthy: it gives each reading twice, and did not do so before.
     */
    TUMBLE_REASON_DUPLICATED,
    /**
     * Unhealthy: its readings are those of another unit, in `units`.
     */
    TUMBLE_REASON_COPY,
    /**
     * Unhealthy: by `value` s its samples come later, or earlier, than they did beside those of the others.
     */
    TUMBLE_REASON_CLOCK,
    /**
     * Unhealthy: `value` of its time lacks samples, a share of 1.
     */
    TUMBLE_REASON_LOSSY,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_reason tumble_reason;
#else
typedef uint32_t tumble_reason;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Ways in which a deviation is taken.
 */
enum tumble_check
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * None was.
     */
    TUMBLE_CHECK_NONE,
    /**
     * Magnitude of specific force against gravity, or of angular rate against zero.
     */
    TUMBLE_CHECK_NORM,
    /**
     * Difference to a valid primary.
     */
    TUMBLE_CHECK_VECTOR,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_check tumble_check;
#else
typedef uint32_t tumble_check;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Quantities that an aiding measurement gives.
 */
enum tumble_aiding_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Velocity of the primary's place in a level frame whose heading does not change and need not be known: x and y
     * horizontal, z up. Its origin is a receiver, an estimator without these units, or, with `sigma` of x and y
     * infinite, a climb rate.
     */
    TUMBLE_AIDING_KIND_VELOCITY,
    /**
     * Velocity of the primary's place in the primary's axes, as of wheels.
     */
    TUMBLE_AIDING_KIND_BODY_VELOCITY,
    /**
     * Heading of the primary, as of a magnetometer: `heading`, of which the first of `sigma` is the standard deviation.
     */
    TUMBLE_AIDING_KIND_HEADING,
    /**
     * Misfit of an estimator that runs on `unit` with its other sensors: `score`.
     */
    TUMBLE_AIDING_KIND_SCORE,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_aiding_kind tumble_aiding_kind;
#else
typedef uint32_t tumble_aiding_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Commands to a monitor.
 */
enum tumble_command
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Evaluate at the next rest, or at this one.
     */
    TUMBLE_COMMAND_EVALUATE,
    /**
     * Take the primary for the source again, if it is in health.
     */
    TUMBLE_COMMAND_RETURN_TO_PRIMARY,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_command tumble_command;
#else
typedef uint32_t tumble_command;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * State of the wheels.
 */
enum tumble_wheels
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * The state is not known.
     */
    TUMBLE_WHEELS_UNKNOWN,
    /**
     * They stand still, and so does the robot.
     */
    TUMBLE_WHEELS_STOPPED,
    /**
     * At least one turns.
     */
    TUMBLE_WHEELS_TURNING,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_wheels tumble_wheels;
#else
typedef uint32_t tumble_wheels;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Events of a spin.
 */
enum tumble_spin_event
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Nothing to report.
     */
    TUMBLE_SPIN_EVENT_NONE,
    /**
     * The robot has come to stand.
     */
    TUMBLE_SPIN_EVENT_STILL_BEGAN,
    /**
     * It moved before it had stood long enough; waiting begins anew.
     */
    TUMBLE_SPIN_EVENT_STILL_BROKEN,
    /**
     * It stood long enough: turn it now.
     */
    TUMBLE_SPIN_EVENT_STILL_DONE,
    /**
     * It has begun to turn.
     */
    TUMBLE_SPIN_EVENT_TURN_BEGAN,
    /**
     * It turned far enough and the result is there.
     */
    TUMBLE_SPIN_EVENT_DONE,
    /**
     * The spin failed; its state gives the reason.
     */
    TUMBLE_SPIN_EVENT_FAILED,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_spin_event tumble_spin_event;
#else
typedef uint32_t tumble_spin_event;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Where a spin is.
 */
enum tumble_spin_phase
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Not started.
     */
    TUMBLE_SPIN_PHASE_IDLE,
    /**
     * Waits for the robot to stand still, and gathers while it does.
     */
    TUMBLE_SPIN_PHASE_STILL,
    /**
     * Waits for the robot to turn on the spot, and gathers.
     */
    TUMBLE_SPIN_PHASE_TURN,
    /**
     * It turned far enough, and is solved slice by slice: with each sample, or each call of tumble_spin_work().
     */
    TUMBLE_SPIN_PHASE_SOLVING,
    /**
     * tumble_spin_solve() gives the result.
     */
    TUMBLE_SPIN_PHASE_DONE,
    /**
     * There is no result; a calibration from before stays.
     */
    TUMBLE_SPIN_PHASE_FAILED,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_spin_phase tumble_spin_phase;
#else
typedef uint32_t tumble_spin_phase;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Why a spin cannot be used.
 */
enum tumble_spin_fault
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * It can, or nothing is known yet.
     */
    TUMBLE_SPIN_FAULT_NONE,
    /**
     * The robot never stood still long enough; `value`: how long was waited, s.
     */
    TUMBLE_SPIN_FAULT_NEVER_STILL,
    /**
     * There is no rest to take the bias from.
     */
    TUMBLE_SPIN_FAULT_NO_REST,
    /**
     * The robot did not turn; `value`: how far it turned all the same, rad.
     */
    TUMBLE_SPIN_FAULT_NO_TURN,
    /**
     * It turned less than asked before time ran out; `value`: how far, `limit`: how far was asked, rad.
     */
    TUMBLE_SPIN_FAULT_TURNED_TOO_LITTLE,
    /**
     * It rotated about other axes too; `value`: rate across the turning axis, `limit`: largest allowed, rad/s.
     */
    TUMBLE_SPIN_FAULT_NOT_ONE_AXIS,
    /**
     * It was lifted or dropped; `value`: change of the force along the axis, `limit`: largest allowed, m/s^2.
     */
    TUMBLE_SPIN_FAULT_LIFTED,
    /**
     * A sensor was at the end of its range; `channel`, and `value`: its reading, m/s^2 or rad/s.
     */
    TUMBLE_SPIN_FAULT_SATURATED,
    /**
     * The floor tilts too much; `value`: its tilt, `limit`: largest allowed, rad.
     */
    TUMBLE_SPIN_FAULT_FLOOR_TOO_STEEP,
    /**
     * The robot turned too far from one sample to the next; `value`: samples a second, `limit`: fewest needed, Hz.
     */
    TUMBLE_SPIN_FAULT_SAMPLE_RATE_TOO_LOW,
    /**
     * Samples are missing while the robot turned; `value`: for how long, s.
     */
    TUMBLE_SPIN_FAULT_SAMPLES_MISSING,
    /**
     * No more samples came; `value`: for how long, s.
     */
    TUMBLE_SPIN_FAULT_STREAM_STOPPED,
    /**
     * The equations have no solution.
     */
    TUMBLE_SPIN_FAULT_UNSOLVABLE,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_spin_fault tumble_spin_fault;
#else
typedef uint32_t tumble_spin_fault;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Grades of inertial measurement units, best last.
 */
enum tumble_grade
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * A chip for phones and hobby drones, as InvenSense MPU-6050: bias instability of 0.53 mm/s^2 and 34 urad/s.
     */
    TUMBLE_GRADE_CONSUMER,
    /**
     * A factory-calibrated module, as Analog Devices ADIS16470: 0.19 mm/s^2 and 58 urad/s.
     */
    TUMBLE_GRADE_INDUSTRIAL,
    /**
     * A unit for guidance, as Analog Devices ADIS16495-1: 0.047 mm/s^2 and 5.8 urad/s.
     */
    TUMBLE_GRADE_TACTICAL,
    /**
     * Navigation class, as Honeywell HG9900 and QA-2000: 0.015 mm/s^2 and 0.026 urad/s.
     */
    TUMBLE_GRADE_REFERENCE,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_grade tumble_grade;
#else
typedef uint32_t tumble_grade;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Which of the records of a sensor.
 */
enum tumble_which
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * The one in force: the last that was adopted, else the one from the factory.
     */
    TUMBLE_WHICH_IN_FORCE,
    /**
     * The last that was adopted.
     */
    TUMBLE_WHICH_LAST,
    /**
     * The one adopted before.
     */
    TUMBLE_WHICH_PREVIOUS,
    /**
     * The one from the factory.
     */
    TUMBLE_WHICH_FACTORY,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tumble_which tumble_which;
#else
typedef uint32_t tumble_which;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Correction that inverts the errors of a magnetometer, `u = C (y - b - c I)` with `C = M^-1`. It is plain data: it may be
 * copied, and lie in read-only memory.
 */
typedef struct tumble_magnetometer_correction {
    /**
     * C, row by row: from the sensing axes to the case frame.
     */
    float matrix[3][3];
    /**
     * b, uT.
     */
    float bias[3];
    /**
     * c, uT per A, or uT at full throttle.
     */
    float current[3];
} tumble_magnetometer_correction;

/**
 * Error model of one triad, `y = M u + b`: `y` is the reading of the sensor where the truth is `u`.
 */
typedef struct tumble_error_model {
    /**
     * M, row by row: scale, non-orthogonality and mounting together, from the case frame to the sensing axes; no unit.
     */
    float matrix[3][3];
    /**
     * b, m/s^2 or rad/s.
     */
    float bias[3];
} tumble_error_model;

/**
 * Errors of a magnetometer, `y = M u + b + c I`: `u` is the field in the case frame of the unit, uT, and I the current
 * through the motors, or the throttle that it follows.
 */
typedef struct tumble_magnetometer {
    /**
     * M, which holds soft iron too, and b, hard iron, uT.
     */
    struct tumble_error_model error;
    /**
     * c, uT per A, or uT at full throttle; zero where it is not known.
     */
    float current[3];
} tumble_magnetometer;

/**
 * Error of the magnetometer of one unit, in its stored form.
 */
typedef struct tumble_magnetometer_record {
    /**
     * Identity of the unit.
     */
    uint64_t identity;
    /**
     * Its errors.
     */
    struct tumble_magnetometer magnetometer;
    /**
     * 1-sigma of M, row by row; infinite where it is not known.
     */
    float matrix_sigma[3][3];
    /**
     * 1-sigma of b, uT; infinite where it is not known.
     */
    float bias_sigma[3];
    /**
     * True where `current` is that of a throttle from 0 to 1, false where it is per A.
     */
    bool of_throttle;
} tumble_magnetometer_record;

/**
 * Correction that inverts an error model, `u = C (y - b)` with `C = M^-1`.
 */
typedef struct tumble_triad_correction {
    /**
     * C, row by row: from the sensing axes to the case frame.
     */
    float matrix[3][3];
    /**
     * b, m/s^2 or rad/s.
     */
    float bias[3];
} tumble_triad_correction;

/**
 * Correction of the errors of one unit. It is plain data: it may be copied, and lie in read-only memory.
 */
typedef struct tumble_correction {
    /**
     * Correction of the accelerometer; bias in m/s^2.
     */
    struct tumble_triad_correction accelerometer;
    /**
     * Correction of the gyroscope; bias in rad/s.
     */
    struct tumble_triad_correction gyroscope;
} tumble_correction;

/**
 * Calibration of one unit.
 */
typedef struct tumble_calibration {
    /**
     * Errors of the accelerometer; bias in m/s^2.
     */
    struct tumble_error_model accelerometer;
    /**
     * Errors of the gyroscope; bias in rad/s.
     */
    struct tumble_error_model gyroscope;
} tumble_calibration;

/**
 * Readings of a unit at one instant, in its case frame, or the truth behind them.
 */
typedef struct tumble_sample {
    /**
     * Microseconds of the unit's own clock, which does not have to begin at zero but must not fold over.
     */
    uint64_t time;
    /**
     * m/s^2; at rest and upright it reads +g up.
     */
    float specific_force[3];
    /**
     * rad/s; positive counter-clockwise, seen from the tip of the axis.
     */
    float angular_rate[3];
} tumble_sample;

/**
 * An error model taken apart, `M = K L Q`.
 */
typedef struct tumble_decomposition {
    /**
     * Diagonal of K: scale factor of each axis.
     */
    float scale[3];
    /**
     * L, row by row: lower triangular, rows of length one.
     */
    float triangle[3][3];
    /**
     * Q, row by row: rotation from the case frame to the sensing axes.
     */
    float rotation[3][3];
    /**
     * By how much the angles between axes xy, yz, zx fall short of 90 degrees, rad.
     */
    float non_orthogonality[3];
    /**
     * Rotation vector of Q, rad.
     */
    float mounting[3];
} tumble_decomposition;

/**
 * Error of one sensor of a secondary against the primary, `y_secondary = M y_primary + b`, where specific force of the
 * primary is taken to the place of the secondary first.
 */
typedef struct tumble_record {
    /**
     * Identity of the unit.
     */
    uint64_t identity;
    /**
     * Which sensor of it.
     */
    tumble_sensor sensor;
    /**
     * Model that was fitted.
     */
    tumble_fit_model fit_model;
    /**
     * M, row by row: from the primary's case frame to the axes of the secondary, mounting included; no unit.
     */
    float matrix[3][3];
    /**
     * b, m/s^2 or rad/s.
     */
    float bias[3];
    /**
     * 1-sigma of M, row by row; infinite where motion did not show it.
     */
    float matrix_sigma[3][3];
    /**
     * 1-sigma of b, m/s^2 or rad/s.
     */
    float bias_sigma[3];
    /**
     * From primary to secondary, m, primary's case frame; zero for gyroscopes, and where unknown.
     */
    float lever_arm[3];
    /**
     * 1-sigma of it, m; zero where it was given, infinite where motion did not show it.
     */
    float lever_arm_sigma[3];
    /**
     * Root mean square residual of a channel on held-out pairs, m/s^2 or rad/s.
     */
    float residual;
    /**
     * The same with the error stored before.
     */
    float residual_before;
    /**
     * Shift by which its calibrations together have followed the primary without proof that it was right: the change
     * they made to a mean reading, m/s^2 or rad/s, in the axes of the secondary. Zeros: it may follow as far as the
     * settings allow.
     */
    float followed[3];
    /**
     * Temperature of the unit while it was calibrated, degC; NaN where it is not known.
     */
    float temperature;
    /**
     * Pairs it was fitted to.
     */
    uint32_t pairs;
    /**
     * Counts the calibrations of this sensor.
     */
    uint32_t sequence;
    /**
     * Directions of motion along which M was fitted.
     */
    uint8_t directions;
} tumble_record;

/**
 * Storage of a monitor. The caller owns it and may put it anywhere; what is in it is the library's.
 */
typedef struct tumble_redundancy {
    /**
     * Not to be touched.
     */
    uint64_t words[TUMBLE_REDUNDANCY_WORDS];
} tumble_redundancy;

/**
 * A threshold.
 */
typedef struct tumble_threshold {
    /**
     * Way in which it is set.
     */
    tumble_threshold_kind kind;
    /**
     * Number with the meaning given by the kind.
     */
    float number;
} tumble_threshold;

/**
 * Settings of the monitor of a redundant set. Fill it with tumble_redundancy_defaults(), then change
 * what is to be different; names are those of the settings file that `tumble redundancy` reads on a
 * workstation.
 */
typedef struct tumble_redundancy_settings {
    /**
     * Bytes of this struct, by which the library finds settings that were not filled with defaults; not to be changed.
     */
    uint32_t size;
    /**
     * #TUMBLE_ABI; not to be changed.
     */
    uint32_t version;
    /**
     * Length of the windows over which all units are averaged, whatever their rates; a whole part of 1 s.
     * Default: 50 000 microseconds.
     */
    uint64_t window;
    /**
     * Rest that is let pass before readings count. Default: 500 000 microseconds.
     */
    uint64_t rest_settle;
    /**
     * Rest over which readings are averaged before units are evaluated. Longer than `window`. Default:
     * 2 000 000 microseconds.
     */
    uint64_t rest_duration;
    /**
     * Calibrate what deviates at a rest once so much time has passed. Longer than `rest_duration`. Default:
     * 600 000 000 microseconds; 0: on command only.
     */
    uint64_t evaluate_every;
    /**
     * Longest wait for motion; then the calibration is abandoned. Longer than `window`. Default: 300 000 000
     * microseconds.
     */
    uint64_t motion_timeout;
    /**
     * Motion to be collected. Longer than `window`. Default: 30 000 000 microseconds.
     */
    uint64_t collect;
    /**
     * Longest time for collecting; then what there is has to do, or the calibration is abandoned. Longer
     * than `collect`. Default: 300 000 000 microseconds.
     */
    uint64_t collect_timeout;
    /**
     * Time without a sample after which a unit is late. Default: 100 000 microseconds.
     */
    uint64_t late;
    /**
     * Time in which all axes of a sensor repeat their readings, and 16 readings at least, until it is
     * frozen; three times that for a sensor of one axis. Default: 100 000 microseconds.
     */
    uint64_t frozen;
    /**
     * Time at the end of its range, or without finite numbers, that a sensor may spend; forgiven slowly.
     * Default: 50 000 microseconds.
     */
    uint64_t saturated;
    /**
     * Time in which nothing may have been wrong until a unit is healthy again. Default: 500 000
     * microseconds.
     */
    uint64_t recovery;
    /**
     * Time a source has to be unhealthy before another takes over. Default: 20 000 microseconds.
     */
    uint64_t hold;
    /**
     * Health to be proven by the primary before it takes over again. Longer than `hold`. Default: 0
     * microseconds, on command only.
     */
    uint64_t return_after;
    /**
     * Scatter of specific force, and change of its mean, below which a unit is at rest. Default: 0.1 m/s^2.
     */
    float rest_specific_force_scatter;
    /**
     * Scatter of angular rate, and change of its mean, below which a unit is at rest. Default: 0.02 rad/s.
     */
    float rest_angular_rate_scatter;
    /**
     * Deviation at rest of a primary without a calibration of its own up to which secondaries are calibrated
     * relative to it, where they deviate as well. Default: 0.8 m/s^2.
     */
    float uncalibrated_specific_force;
    /**
     * Deviation at rest of a primary without a calibration of its own up to which secondaries are calibrated
     * relative to it, where they deviate as well. Default: 0.1 rad/s.
     */
    float uncalibrated_angular_rate;
    /**
     * Deviation of a secondary's accelerometer above which its calibration is triggered. Default: fixed, 0.1
     * m/s^2.
     */
    struct tumble_threshold secondary_accelerometer_threshold;
    /**
     * Deviation of a secondary's gyroscope above which its calibration is triggered. Default: fixed, 0.01
     * rad/s.
     */
    struct tumble_threshold secondary_gyroscope_threshold;
    /**
     * Deviation of the primary's accelerometer above which it is invalid. Default: fixed, 0.1 m/s^2.
     */
    struct tumble_threshold primary_accelerometer_threshold;
    /**
     * Deviation of the primary's gyroscope above which it is invalid. Default: fixed, 0.01 rad/s.
     */
    struct tumble_threshold primary_gyroscope_threshold;
    /**
     * Local gravity. Default: 9.80665 m/s^2.
     */
    float gravity;
    /**
     * Change of the primary's mean specific force since the rest that counts as motion. Larger than
     * `rest_specific_force_scatter`. Default: 0.5 m/s^2.
     */
    float motion_specific_force;
    /**
     * Change of the primary's mean angular rate since the rest that counts as motion. Larger than
     * `rest_angular_rate_scatter`. Default: 0.2 rad/s.
     */
    float motion_angular_rate;
    /**
     * Standard deviation of specific force along a direction from which on the matrix is fitted along it.
     * Default: 0.5 m/s^2.
     */
    float excitation_specific_force;
    /**
     * Standard deviation of angular rate along a direction from which on the matrix is fitted along it.
     * Default: 0.2 rad/s.
     */
    float excitation_angular_rate;
    /**
     * Specific force for each metre of lever arm, root mean square, from which on the lever arm is fitted.
     * Default: 2 1/s^2.
     */
    float excitation_lever_arm;
    /**
     * Share by which its residual on held-out pairs has to be smaller than the stored one's. Default: 0.02.
     */
    float improvement;
    /**
     * Largest bias of an accelerometer. Larger than `tolerated_specific_force`. Default: 3 m/s^2.
     */
    float largest_specific_force_bias;
    /**
     * Largest bias of a gyroscope. Larger than `tolerated_angular_rate`. Default: 1 rad/s.
     */
    float largest_angular_rate_bias;
    /**
     * Largest deviation of a scale factor from one. Default: 0.1.
     */
    float largest_scale_error;
    /**
     * Largest misalignment beside the nominal mounting. Default: 0.1 rad.
     */
    float largest_misalignment;
    /**
     * Longest lever arm. Default: 1 m.
     */
    float largest_lever_arm;
    /**
     * Largest drift of an accelerometer while pairs were collected. Default: 0.1 m/s^2.
     */
    float largest_specific_force_drift;
    /**
     * Largest drift of a gyroscope while pairs were collected. Default: 0.01 rad/s.
     */
    float largest_angular_rate_drift;
    /**
     * Largest residual of an accelerometer on held-out pairs, root mean square. Default: 0.5 m/s^2.
     */
    float largest_specific_force_residual;
    /**
     * Largest residual of a gyroscope on held-out pairs, root mean square. Default: 0.05 rad/s.
     */
    float largest_angular_rate_residual;
    /**
     * Largest shift by which calibrations of an accelerometer may follow the primary where no rest proves it
     * right. Default: 0.15 m/s^2.
     */
    float largest_followed_specific_force;
    /**
     * Largest shift by which calibrations of a gyroscope may follow the primary where no rest proves it
     * right. Default: 0.015 rad/s.
     */
    float largest_followed_angular_rate;
    /**
     * Specific force that leaves by more, and is back with the next sample, is a spike. Default: 40 m/s^2.
     */
    float spike_specific_force;
    /**
     * Angular rate that leaves by more, and is back with the next sample, is a spike. Default: 10 rad/s.
     */
    float spike_angular_rate;
    /**
     * Drift of specific force that is within specification: a difference of two units that is none. Default:
     * 0.05 m/s^2.
     */
    float tolerated_specific_force;
    /**
     * Drift of angular rate that is within specification: a difference of two units that is none. Default:
     * 0.0075 rad/s.
     */
    float tolerated_angular_rate;
    /**
     * Drift of specific force of an axis with temperature, of units whose logs or samples state one.
     * Default: 0.00196 m/s^2/K.
     */
    float drift_per_kelvin_specific_force;
    /**
     * Drift of angular rate of an axis with temperature, of units whose logs or samples state one. Default:
     * 0.00026 rad/s/K.
     */
    float drift_per_kelvin_angular_rate;
    /**
     * Scatter of a unit, as a multiple of that expected from the others, beyond which it is noisy. Default:
     * 9.
     */
    float noise_ratio;
    /**
     * Deviation of specific force from gravity at rest that no error of a working unit explains. Default:
     * 1.5 m/s^2.
     */
    float rest_specific_force;
    /**
     * Angular rate at rest that no error of a working unit explains. Default: 0.2 rad/s.
     */
    float rest_angular_rate;
    /**
     * Fewest pairs with which a fit is tried when time is up. Default: 200.
     */
    uint32_t fewest_pairs;
    /**
     * Take deviations from compensated data or from raw data, with thresholds to match. Default:
     * ::TUMBLE_DATA_COMPENSATED.
     */
    tumble_data data;
    /**
     * Trigger on the secondary alone, with both sensors of the primary valid, or each with its own kind.
     * Default: ::TUMBLE_GATE_WHOLE_PRIMARY.
     */
    tumble_gate gate;
    /**
     * Calibrate both sensors of a secondary, or only the one that deviates. Default:
     * ::TUMBLE_SCOPE_ALL_SENSORS.
     */
    tumble_scope scope;
    /**
     * Largest model that may be fitted: the largest up to it that the motion shows is used. Default:
     * ::TUMBLE_FIT_MODEL_AFFINE_AND_LEVER_ARM.
     */
    tumble_fit_model largest_fit_model;
    /**
     * Replace what is stored where the fit is plausible and better, or by each calibration. Default:
     * ::TUMBLE_ADOPTION_IF_BETTER.
     */
    tumble_adoption adoption;
    /**
     * Evaluate the first rest after the start. Default: true.
     */
    bool evaluate_after_start;
    /**
     * Compare a secondary also with a valid primary, axis by axis: the norm is blind across gravity.
     * Default: true.
     */
    bool vector_check;
    /**
     * Fit to means at rests at which the primary is valid as well as to pairs in motion. Default: true.
     */
    bool fit_rests;
    /**
     * Select only secondaries that have a stored error. Default: false.
     */
    bool calibrated_only;
} tumble_redundancy_settings;

/**
 * A unit as it is built in. Fill it with tumble_unit_defaults(), then change what is to be different.
 */
typedef struct tumble_unit {
    /**
     * Bytes of this struct, by which the library finds units that were not filled with defaults; not to be changed.
     */
    uint32_t size;
    /**
     * #TUMBLE_ABI; not to be changed.
     */
    uint32_t version;
    /**
     * Serial number, or another number that distinguishes it from other units for life: records carry it.
     */
    uint64_t identity;
    /**
     * Added to the time of its samples, which makes it that of the common clock, microseconds; 0.
     */
    int64_t time_offset;
    /**
     * Nominal rotation from the primary's case frame to its axes, row by row; identity.
     */
    float sensor_from_primary[3][3];
    /**
     * From the primary to it, m, primary's case frame; where `lever_arm_known`.
     */
    float lever_arm[3];
    /**
     * End of the accelerometer's range, m/s^2; 0 where nobody knows, the default.
     */
    float specific_force_range;
    /**
     * End of the gyroscope's range, rad/s; 0 where nobody knows, the default.
     */
    float angular_rate_range;
    /**
     * Its own threshold of the accelerometer's deviation, m/s^2; ::TUMBLE_THRESHOLD_KIND_OF_SETTINGS, the default.
     */
    struct tumble_threshold accelerometer_threshold;
    /**
     * Its own threshold of the gyroscope's deviation, rad/s; ::TUMBLE_THRESHOLD_KIND_OF_SETTINGS, the default.
     */
    struct tumble_threshold gyroscope_threshold;
    /**
     * True if the lever arm is given; else it is estimated, the default.
     */
    bool lever_arm_known;
    /**
     * Which axes it has, a bit each; #TUMBLE_AXES_ALL. Readings of other axes in a sample are ignored.
     */
    uint8_t axes;
} tumble_unit;

/**
 * One event. Fields that do not belong to its kind are zero, false or null.
 */
typedef struct tumble_event {
    /**
     * Microseconds of the common clock.
     */
    uint64_t time;
    /**
     * Jump of the clock, microseconds.
     */
    int64_t by;
    /**
     * The record adopted. It is the library's, and there until the callback returns. Its temperature is NaN, since the
     * monitor does not know it: fill it in before it is saved, if it is known.
     */
    const struct tumble_record *record;
    /**
     * Kind of the event.
     */
    tumble_event_kind kind;
    /**
     * Why.
     */
    tumble_reason reason;
    /**
     * The unit it concerns; 0, the primary, also where it concerns all.
     */
    uint32_t unit;
    /**
     * Way in which a deviation was taken.
     */
    tumble_check check;
    /**
     * Model that was fitted.
     */
    tumble_fit_model fit_model;
    /**
     * Pairs fitted to and held out together.
     */
    uint32_t pairs;
    /**
     * Count of the calibrations of the sensor.
     */
    uint32_t sequence;
    /**
     * A figure.
     */
    float value;
    /**
     * Limit for the value.
     */
    float limit;
    /**
     * Time over which a contradiction between units shows, s.
     */
    float scale;
    /**
     * 0 to 2 accelerometer, 3 to 5 gyroscope, x y z each.
     */
    uint8_t channel;
    /**
     * Directions of motion along which the matrix was fitted.
     */
    uint8_t directions;
    /**
     * Other units, a bit each, the primary's the lowest: of ::TUMBLE_REASON_OUT_OF_FAMILY those that agree with each other,
     * of ::TUMBLE_EVENT_KIND_DISAGREE and ::TUMBLE_EVENT_KIND_AGREE the other one.
     */
    uint8_t units;
    /**
     * True if the event concerns the accelerometer.
     */
    bool accelerometer;
    /**
     * True if the event concerns the gyroscope.
     */
    bool gyroscope;
} tumble_event;

/**
 * Receives an event, from within the call that made it happen, with the `context` given there. It may use other
 * storage, but none that this call works with, which is answered by ::TUMBLE_ERROR_BUSY: not the monitor, nor, of
 * tumble_redundancy_restore_from(), the store. It has to return, neither by `longjmp` nor by an exception.
 */
typedef void (*tumble_on_event)(void *context, const struct tumble_event *event);

/**
 * Output of the set, from whichever source: at the primary's place, in its case frame, with its own calibration
 * applied.
 */
typedef struct tumble_output {
    /**
     * Microseconds of the common clock.
     */
    uint64_t time;
    /**
     * Specific force, m/s^2; not a number along axes that the source does not measure.
     */
    float specific_force[3];
    /**
     * Angular rate, rad/s; not a number about axes that the source does not measure.
     */
    float angular_rate[3];
    /**
     * The unit it comes from, 0 the primary; #TUMBLE_NO_SOURCE if this sample makes no output, and nothing else counts.
     */
    uint32_t source;
    /**
     * Flags of the output: 0, or #TUMBLE_OUTPUT_DEGRADED.
     */
    uint32_t flags;
} tumble_output;

/**
 * Aiding measurement.
 */
typedef struct tumble_aiding {
    /**
     * Quantity that is measured; only its own fields count.
     */
    tumble_aiding_kind kind;
    /**
     * The unit of a score.
     */
    uint32_t unit;
    /**
     * Velocity, m/s.
     */
    float velocity[3];
    /**
     * Standard deviation of each axis, m/s, above 0; infinite where an axis is not measured. The first is that of a heading, rad.
     */
    float sigma[3];
    /**
     * Innovation squared over its variance, a degree of freedom: 1 in health.
     */
    float score;
    /**
     * Angle about the vertical of the primary's x axis, rad, counter-clockwise seen from above, from any direction that stays.
     */
    float heading;
} tumble_aiding;

/**
 * Stored error of one sensor of a unit. For the primary it is its own calibration, against the truth.
 */
typedef struct tumble_knowledge {
    /**
     * M, row by row, in the sensor's own axes beside its nominal mounting: close to identity. For the primary it is as
     * given.
     */
    float matrix[3][3];
    /**
     * b, m/s^2 or rad/s.
     */
    float bias[3];
    /**
     * From the primary, m, primary's case frame.
     */
    float lever_arm[3];
    /**
     * Root mean square residual of a channel on held-out pairs, m/s^2 or rad/s; zero before the first calibration.
     */
    float residual;
    /**
     * Error of the first calibration, or of the record from the factory, from which thresholds of the kind
     * ::TUMBLE_THRESHOLD_KIND_FACTORY_BY_MARGIN are counted, m/s^2 or rad/s; zero before.
     */
    float factory;
    /**
     * Its difference to a valid primary at the last rest, m/s^2 or rad/s; infinite before.
     */
    float apart;
    /**
     * Counts the calibrations; zero before the first, and of the primary.
     */
    uint32_t sequence;
    /**
     * True if a calibration is stored.
     */
    bool calibrated;
    /**
     * True if that difference was within the threshold.
     */
    bool agrees;
} tumble_knowledge;

/**
 * Storage of a store. The caller owns it and may put it anywhere; what is in it is the library's.
 */
typedef struct tumble_store {
    /**
     * Not to be touched.
     */
    uint64_t words[TUMBLE_STORE_WORDS];
} tumble_store;

/**
 * Storage of a spin. The caller owns it and may put it anywhere; what is in it is the library's.
 */
typedef struct tumble_spin {
    /**
     * Not to be touched.
     */
    uint64_t words[TUMBLE_SPIN_WORDS];
} tumble_spin;

/**
 * Settings of a spin. Fill it with tumble_spin_defaults(), or with tumble_spin_defaults_for_grade() for
 * a unit of another grade than consumer, then change what is to be different.
 */
typedef struct tumble_spin_settings {
    /**
     * Bytes of this struct, by which the library finds settings that were not filled with defaults; not to be changed.
     */
    uint32_t size;
    /**
     * #TUMBLE_ABI; not to be changed.
     */
    uint32_t version;
    /**
     * Time to stand still. Default: 5 000 000 microseconds.
     */
    uint64_t still;
    /**
     * Longest wait until the robot has stood still. Longer than `still`. Default: 60 000 000 microseconds.
     */
    uint64_t still_timeout;
    /**
     * Longest wait for the turn. Default: 120 000 000 microseconds.
     */
    uint64_t spin_timeout;
    /**
     * Longest pause in the samples. Default: 250 000 microseconds.
     */
    uint64_t longest_gap;
    /**
     * Length of the blocks over which samples are averaged. Default: 200 000 microseconds.
     */
    uint64_t block;
    /**
     * Shortest stop after the first rest that is counted as a rest. Default: 1 000 000 microseconds.
     */
    uint64_t shortest_stop;
    /**
     * Local gravity. Default: 9.80665 m/s^2.
     */
    float gravity;
    /**
     * Angle to turn, both directions together. Default: 12.56637 rad.
     */
    float turn;
    /**
     * Speed to turn at, which a robot may be asked for; no limit depends on it. Default: 1 rad/s.
     */
    float rate;
    /**
     * Largest floor tilt. Default: 0.1745329 rad.
     */
    float largest_floor_tilt;
    /**
     * 1-sigma of the gyroscope's scale error about the turning axis, before anything is known of it.
     * Default: 0.01.
     */
    float scale_sigma;
    /**
     * Bias instability of the accelerometer; that of a consumer grade where none is stated. Default:
     * 0.0005314598 m/s^2.
     */
    float specific_force_instability;
    /**
     * Bias instability of the gyroscope; that of a consumer grade where none is stated. Default:
     * 3.357221e-05 rad/s.
     */
    float angular_rate_instability;
    /**
     * End of the accelerometer's range. Default: 0 m/s^2, not known.
     */
    float specific_force_range;
    /**
     * End of the gyroscope's range. Default: 0 rad/s, not known.
     */
    float angular_rate_range;
    /**
     * Upward part of the Earth's rotation; 0 where the latitude is not known. Default: 0 rad/s.
     */
    float earth_rate_up;
    /**
     * Largest change of the force along the turning axis. Default: 0.5 m/s^2.
     */
    float largest_lift;
    /**
     * Largest rate across the turning axis. Default: 0.1 rad/s.
     */
    float largest_rate_across;
    /**
     * Largest rate across the turning axis as a share of the rate about it. Default: 0.05.
     */
    float largest_share_across;
    /**
     * Largest plausible bias of the gyroscope. A robot that seems to turn faster does not stand still.
     * Default: 0.5 rad/s.
     */
    float largest_rate_bias;
    /**
     * Largest turn from one sample to the next. Default: 0.25 rad.
     */
    float largest_step;
    /**
     * Largest scatter of specific force at which a robot may stand still. Default: 2 m/s^2.
     */
    float largest_specific_force_scatter;
    /**
     * Largest scatter of angular rate at which a robot may stand still. Default: 0.2 rad/s.
     */
    float largest_angular_rate_scatter;
    /**
     * Largest ratio of the variance of a quiet block to the noise floor. Default: 4.
     */
    float variance_ratio;
    /**
     * Scatter of specific force below which a block is quiet whatever the floor. Default: 0.005 m/s^2.
     */
    float smallest_specific_force_scatter;
    /**
     * Scatter of angular rate below which a block is quiet whatever the floor. Default: 0.0003 rad/s.
     */
    float smallest_angular_rate_scatter;
    /**
     * Largest deviation of the specific force of a block from its rest besides noise. Default: 0.005 m/s^2.
     */
    float specific_force_drift;
    /**
     * Largest deviation of the angular rate of a block from its rest besides noise. Default: 0.0005 rad/s.
     */
    float angular_rate_drift;
    /**
     * Further deviation of the mean of a block, in sigmas. Default: 6.
     */
    float sigmas;
    /**
     * Take the floor for level, as the published estimator does. Default: false.
     */
    bool level_floor;
} tumble_spin_settings;

/**
 * Why a spin cannot be used, with the figures.
 */
typedef struct tumble_spin_failure {
    /**
     * Why.
     */
    tumble_spin_fault fault;
    /**
     * 0 to 2 accelerometer, 3 to 5 gyroscope, x y z each; 0 where no channel is concerned.
     */
    uint32_t channel;
    /**
     * When, microseconds; 0 where that is not known.
     */
    uint64_t time;
    /**
     * Value with the meaning given by ::tumble_spin_fault; else 0.
     */
    float value;
    /**
     * Limit with the meaning given by ::tumble_spin_fault; else 0.
     */
    float limit;
} tumble_spin_failure;

/**
 * Where a spin is.
 */
typedef struct tumble_spin_state {
    /**
     * Where.
     */
    tumble_spin_phase phase;
    /**
     * Why it failed, if it did.
     */
    struct tumble_spin_failure failure;
} tumble_spin_state;

/**
 * Progress of a spin.
 */
typedef struct tumble_spin_progress {
    /**
     * Time stood still, s.
     */
    float still;
    /**
     * Angle turned, both directions together, rad.
     */
    float turned;
    /**
     * Rate about the vertical over the block before, rad/s, counter-clockwise.
     */
    float rate;
    /**
     * True if the robot stood still over the block before.
     */
    bool at_rest;
} tumble_spin_progress;

/**
 * Angles truly turned, from dock to dock or from wheel odometry.
 */
typedef struct tumble_spin_true_angle {
    /**
     * Clockwise, rad, positive; 0 where it is not known.
     */
    float clockwise;
    /**
     * Counter-clockwise, rad, positive; 0 where it is not known.
     */
    float counter_clockwise;
    /**
     * 1-sigma of each, rad.
     */
    float sigma;
} tumble_spin_true_angle;

/**
 * Three numbers with their 1-sigma.
 */
typedef struct tumble_spin_vector {
    /**
     * The numbers, x y z.
     */
    float value[3];
    /**
     * 1-sigma of each.
     */
    float sigma[3];
    /**
     * True if the spin shows them; if not, the numbers mean nothing.
     */
    bool observed;
} tumble_spin_vector;

/**
 * A number with its 1-sigma.
 */
typedef struct tumble_spin_value {
    /**
     * The number.
     */
    float value;
    /**
     * 1-sigma of it.
     */
    float sigma;
    /**
     * True if the spin shows it; if not, the numbers mean nothing.
     */
    bool observed;
} tumble_spin_value;

/**
 * Everything a spin shows. Vectors are in the case frame.
 */
typedef struct tumble_spin_estimate {
    /**
     * Accelerometer bias by the method of choice, m/s^2.
     */
    struct tumble_spin_vector accelerometer_bias;
    /**
     * Gyroscope bias, rad/s.
     */
    struct tumble_spin_vector gyroscope_bias;
    /**
     * Covariance of both, accelerometer first: (m/s^2)^2, (rad/s)^2, and their product.
     */
    float covariance[6][6];
    /**
     * Accelerometer bias whatever the floor, m/s^2.
     */
    struct tumble_spin_vector level_free;
    /**
     * Accelerometer bias if the floor is level, m/s^2.
     */
    struct tumble_spin_vector published;
    /**
     * True if the level-free bias is the one to use.
     */
    bool level_free_is_default;
    /**
     * Turning axis, upwards, unit length.
     */
    float up[3];
    /**
     * Roll of the IMU against the floor, rad, positive with the left side up.
     */
    struct tumble_spin_value roll;
    /**
     * Pitch of the IMU against the floor, rad, positive with the front down.
     */
    struct tumble_spin_value pitch;
    /**
     * Tilt of the floor, rad.
     */
    struct tumble_spin_value floor_tilt;
    /**
     * Uphill, rad counter-clockwise from forward, at the heading of the first rest.
     */
    struct tumble_spin_value uphill_bearing;
    /**
     * From the turning axis to the IMU, across the axis, m.
     */
    struct tumble_spin_vector lever_arm;
    /**
     * Scale error of the gyroscope about the axis, no unit.
     */
    struct tumble_spin_value scale;
    /**
     * Rate about the axis while the robot seemed to stand still, rad/s.
     */
    struct tumble_spin_value slow_turn;
    /**
     * That rate is significant, and was subtracted from the gyroscope bias.
     */
    bool turned_while_still;
    /**
     * Angle turned clockwise, rad, positive.
     */
    float clockwise;
    /**
     * Angle turned counter-clockwise, rad, positive.
     */
    float counter_clockwise;
    /**
     * Time at rest, s.
     */
    float resting_time;
    /**
     * Samples at rest and turning.
     */
    uint32_t samples;
    /**
     * Sum of squared normalised residuals of the model against free harmonics.
     */
    float chi_square;
    /**
     * Its degrees of freedom.
     */
    uint32_t degrees_of_freedom;
} tumble_spin_estimate;

/**
 * NOR flash, reached by callbacks: each returns 0 on success, and anything else on failure. Addresses are whatever the
 * driver takes them for; the library adds nothing to them. Callbacks may not use the store that calls them, which is
 * answered by ::TUMBLE_ERROR_BUSY.
 */
typedef struct tumble_flash {
    /**
     * Handed to each callback. It is the caller's, and has to be there as long as the store.
     */
    void *context;
    /**
     * Reads `length` bytes at `address`, 32 at a time or a multiple of it, at addresses that are multiples of 32. `bytes`
     * is aligned to 4. Words that flash with an error-correcting code cannot read are a failure; they are passed over.
     */
    int (*read)(void *context, uint32_t address, uint8_t *bytes, uint32_t length);
    /**
     * Writes `length` bytes at `address`, both multiples of 32, to flash that is erased. `bytes` is aligned to 4.
     * Written bytes have to be in flash when it returns.
     */
    int (*write)(void *context, uint32_t address, const uint8_t *bytes, uint32_t length);
    /**
     * Erases the page that begins at `address`, after which all its bytes are FF.
     */
    int (*erase)(void *context, uint32_t address);
    /**
     * Bytes that are erased at once: of a page, or sector. A multiple of 32.
     */
    uint32_t page;
} tumble_flash;

/**
 * Limit on the wear of flash.
 */
typedef struct tumble_write_limit {
    /**
     * Time between two writes in the long run, microseconds; 0 sets no limit. 600 000 000 where none is given.
     */
    uint64_t shortest_between;
    /**
     * Writes that may follow each other at once; 0 counts as 1. 16 where none is given.
     */
    uint32_t at_once;
} tumble_write_limit;

/**
 * Effect of temperature T on a sensor: `y = (1 + s) M u + b + d`, where d and s are polynomials in T minus the
 * reference. M and b hold at the reference; beyond the range the value at its edge is held.
 */
typedef struct tumble_temperature_drift {
    /**
     * Temperature at which nothing changes, degC.
     */
    float reference;
    /**
     * Lowest and highest temperature at which it was seen, degC.
     */
    float range[2];
    /**
     * d: a row of the three axes for the first, second and third power, m/s^2 or rad/s per K, K^2, K^3.
     */
    float bias[3][3];
    /**
     * s: the same of the scale factors, 1/K, 1/K^2, 1/K^3.
     */
    float scale[3][3];
} tumble_temperature_drift;

/**
 * Temperature drift of one sensor of one unit, in its stored form.
 */
typedef struct tumble_drift_record {
    /**
     * Identity of the unit.
     */
    uint64_t identity;
    /**
     * Which sensor of it.
     */
    tumble_sensor sensor;
    /**
     * In the axes and the unit of the sensor.
     */
    struct tumble_temperature_drift drift;
} tumble_drift_record;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Computes what undoes the errors of a magnetometer.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SINGULAR.
 */
tumble_status tumble_magnetometer_correction_init(struct tumble_magnetometer_correction *correction,
                                                  const struct tumble_magnetometer *magnetometer);

/**
 * Corrects a reading of the magnetometer, uT, at a current, A, or a throttle from 0 to 1; its effect stays where it is NaN.
 * `reading` and `field` may be the same.
 *
 * Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NOT_FINITE if the reading or what the correction makes of it is not.
 *
 */
tumble_status tumble_magnetometer_correction_apply(const struct tumble_magnetometer_correction *correction,
                                                   const float reading[3],
                                                   float current,
                                                   float field[3]);

/**
 * Writes the error of a magnetometer at the start of the `size` bytes at `bytes`, ::TUMBLE_MAGNETOMETER_BYTES of them.
 *
 * Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NO_ROOM; ::TUMBLE_ERROR_NOT_FINITE of the numbers, and NaN of sigmas.
 */
tumble_status tumble_magnetometer_encode(const struct tumble_magnetometer_record *record,
                                         uint8_t *bytes,
                                         size_t size);

/**
 * Reads the error of a magnetometer from the `length` bytes that are it, neither more nor fewer.
 *
 * Errors: as of tumble_record_decode(); ::TUMBLE_ERROR_NOT_A_RECORD if they are a record of another kind.
 */
tumble_status tumble_magnetometer_decode(const uint8_t *bytes,
                                         size_t length,
                                         struct tumble_magnetometer_record *record);

/**
 * Computes what undoes a calibration.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SINGULAR.
 */
tumble_status tumble_correction_init(struct tumble_correction *correction,
                                     const struct tumble_calibration *calibration);

/**
 * Corrects both triads of a sample. `reading` and `truth` may be the same sample.
 *
 * Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NOT_FINITE if the reading or the correction is not.
 */
tumble_status tumble_correction_apply(const struct tumble_correction *correction,
                                      const struct tumble_sample *reading,
                                      struct tumble_sample *truth);

/**
 * Computes the reading of the sensor where the truth is `truth`: `reading = M truth + b`.
 *
 * Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NOT_FINITE.
 *
 */
tumble_status tumble_error_model_measure(const struct tumble_error_model *model,
                                         const float truth[3],
                                         float reading[3]);

/**
 * Takes an error model apart into scale, non-orthogonality and mounting.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SINGULAR, ::TUMBLE_ERROR_LEFT_HANDED.
 */
tumble_status tumble_error_model_decompose(const struct tumble_error_model *model,
                                           struct tumble_decomposition *decomposition);

/**
 * Writes a record as bytes. The first `length` of the `size` bytes at `buffer`, which the caller owns, then hold the
 * record.
 *
 * Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_CODE, ::TUMBLE_ERROR_NOT_FINITE of the record; ::TUMBLE_ERROR_NO_ROOM.
 */
tumble_status tumble_record_encode(const struct tumble_record *record,
                                   uint8_t *buffer,
                                   size_t size,
                                   size_t *length);

/**
 * Reads a record from the `length` bytes that are it, neither more nor fewer.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_TOO_SHORT, ::TUMBLE_ERROR_NOT_A_RECORD, ::TUMBLE_ERROR_CORRUPT,
 * ::TUMBLE_ERROR_VERSION; ::TUMBLE_ERROR_CODE, ::TUMBLE_ERROR_NOT_FINITE of what was written.
 */
tumble_status tumble_record_decode(const uint8_t *bytes, size_t length, struct tumble_record *record);

/**
 * Computes the correction of the errors in two records of one unit, like tumble_correction_init() of a calibration.
 *
 * Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_CODE if they are not of an accelerometer and a gyroscope, in this order;
 * ::TUMBLE_ERROR_NO_SUCH_UNIT if they are of different units; ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SINGULAR.
 */
tumble_status tumble_correction_from_records(struct tumble_correction *correction,
                                             const struct tumble_record *accelerometer,
                                             const struct tumble_record *gyroscope);

/**
 * Makes storage a monitor of `count` units, the primary first. `size` is `sizeof(tumble_redundancy)`; `count` is
 * #TUMBLE_UNITS. `calibration` is the primary's own, with which the output is calibrated whoever is its source; null:
 * its readings are taken for the truth. All that is given is copied.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE, ::TUMBLE_ERROR_UNITS, ::TUMBLE_ERROR_CODE,
 * ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SETTING, ::TUMBLE_ERROR_CONTRADICTION, ::TUMBLE_ERROR_SINGULAR,
 * ::TUMBLE_ERROR_PRIMARY, ::TUMBLE_ERROR_MOUNTING, ::TUMBLE_ERROR_SAME_IDENTITY.
 *
 */
tumble_status tumble_redundancy_init(struct tumble_redundancy *redundancy,
                                     size_t size,
                                     const struct tumble_redundancy_settings *settings,
                                     const struct tumble_calibration *calibration,
                                     const struct tumble_unit units[],
                                     size_t count);

/**
 * Takes in the next sample of a unit, in its own frame and clock. Samples of different units may come in any order as
 * long as none is more than a window behind the others. Hand readings that are no numbers in as they
 * are: the monitor detects them. `on_event` and `output` may be null. A calibration whose pairs are complete is fitted in steps, one
 * with each of about 14 samples.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_NO_SUCH_UNIT.
 */
tumble_status tumble_redundancy_push(struct tumble_redundancy *redundancy,
                                     uint32_t unit,
                                     const struct tumble_sample *sample,
                                     tumble_on_event on_event,
                                     void *context,
                                     struct tumble_output *output);

/**
 * Takes in an aiding measurement of the motion of the set at `time`, microseconds of the common clock: the time at
 * which it was measured, up to a second ago, not that at which it came. It settles which of two units is wrong that
 * disagree. A measurement that cannot be used is left out, and ::TUMBLE_EVENT_KIND_AIDING_LEFT_OUT gives the reason.
 * `on_event` may be null.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_CODE,
 * ::TUMBLE_ERROR_NO_SUCH_UNIT of a score.
 */
tumble_status tumble_redundancy_aiding(struct tumble_redundancy *redundancy,
                                       uint64_t time,
                                       const struct tumble_aiding *aiding,
                                       tumble_on_event on_event,
                                       void *context);

/**
 * Takes in how warm a unit is, degC, from its next sample on; NaN where nobody knows. Call it before tumble_redundancy_push()
 * where the temperature changed. Units that are warmer or colder than they were when they were calibrated may differ by more.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_NO_SUCH_UNIT.
 */
tumble_status tumble_redundancy_set_temperature(struct tumble_redundancy *redundancy,
                                                uint32_t unit,
                                                float temperature);

/**
 * Asks for something, from now on.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_CODE.
 */
tumble_status tumble_redundancy_command(struct tumble_redundancy *redundancy, tumble_command command);

/**
 * Returns the unit from which the output comes; #TUMBLE_NO_SOURCE if from none.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
 */
tumble_status tumble_redundancy_get_source(const struct tumble_redundancy *redundancy, uint32_t *unit);

/**
 * Returns the stored error of a sensor of a unit, the primary or a secondary.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_NO_SUCH_UNIT,
 * ::TUMBLE_ERROR_CODE.
 */
tumble_status tumble_redundancy_get_stored(const struct tumble_redundancy *redundancy,
                                           uint32_t unit,
                                           tumble_sensor sensor,
                                           struct tumble_knowledge *stored);

/**
 * Takes a stored record; an event reports whether it was accepted. After a reset, give it before the first sample.
 * After tumble_store_roll_back(), at any time: a calibration of that unit that is under way is abandoned. That of the
 * primary, which relates its readings to the truth, becomes its own calibration of that sensor; it is taken before the
 * first sample only. `on_event` may be null.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_CODE,
 * ::TUMBLE_ERROR_BEGUN.
 */
tumble_status tumble_redundancy_restore(struct tumble_redundancy *redundancy,
                                        const struct tumble_record *record,
                                        tumble_on_event on_event,
                                        void *context);

/**
 * Checks settings for contradictions, with each other or in themselves, and describes the first in words: in the
 * `size` bytes at `text`, which the caller owns, ending in a zero byte and cut off where there is no room. Without a
 * contradiction they begin with that zero byte, also after ::TUMBLE_OK. `text` may be null.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_CODE, ::TUMBLE_ERROR_CONTRADICTION.
 */
tumble_status tumble_redundancy_check(const struct tumble_redundancy_settings *settings,
                                      char *text,
                                      size_t size);

/**
 * Checks settings as tumble_redundancy_check() does, and returns the seal with which tumble_redundancy_init_sealed() accepts
 * the same settings. Call it on a host, and give both to the device as constants.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_CODE, ::TUMBLE_ERROR_CONTRADICTION.
 */
tumble_status tumble_redundancy_seal(const struct tumble_redundancy_settings *settings,
                                     uint32_t *seal);

/**
 * Makes storage a monitor as tumble_redundancy_init() does, with settings that tumble_redundancy_seal() has checked: they are
 * refused as ::TUMBLE_ERROR_CONTRADICTION where `seal` is not theirs. A library without the check of settings has this
 * call alone.
 *
 * Errors: those of tumble_redundancy_init().
 *
 */
tumble_status tumble_redundancy_init_sealed(struct tumble_redundancy *redundancy,
                                            size_t size,
                                            const struct tumble_redundancy_settings *settings,
                                            uint32_t seal,
                                            const struct tumble_calibration *calibration,
                                            const struct tumble_unit units[],
                                            size_t count);

/**
 * Fills settings of `size` bytes and a version of the layout with their defaults; see tumble_redundancy_defaults().
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE.
 */
tumble_status tumble_redundancy_defaults_of(struct tumble_redundancy_settings *settings,
                                            size_t size,
                                            uint32_t version);

/**
 * Takes all records in force from a store, as after a reset: those of the secondaries, and those of the primary as its own
 * calibration unless tumble_redundancy_init() was given one. `on_event` may be null.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, of the monitor or the store; the first
 * of tumble_store_load(), or ::TUMBLE_ERROR_BEGUN of a record of the primary, and the other records were taken all the
 * same. That nothing is stored is no error.
 */
tumble_status tumble_redundancy_restore_from(struct tumble_redundancy *redundancy,
                                             struct tumble_store *store,
                                             tumble_on_event on_event,
                                             void *context);

/**
 * Fills in a unit of `size` bytes and a version of the layout; see tumble_unit_defaults().
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE.
 */
tumble_status tumble_unit_defaults_of(struct tumble_unit *unit,
                                      size_t size,
                                      uint32_t version,
                                      uint64_t identity);

/**
 * Makes storage a spin that has not started. `size` is `sizeof(tumble_spin)`.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE, ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SETTING.
 */
tumble_status tumble_spin_init(struct tumble_spin *spin,
                               size_t size,
                               const struct tumble_spin_settings *settings);

/**
 * Begins, or begins anew, with the next sample.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
 */
tumble_status tumble_spin_start(struct tumble_spin *spin);

/**
 * Takes in the next sample, with what the wheels did. Before the start, and after the end, samples are passed over; so
 * are those whose time is not later than of the one before, and those with each of which a slice of solving is done.
 * `event` may be null.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_CODE;
 * ::TUMBLE_ERROR_NOT_FINITE if the sample is not, which is passed over and does no harm.
 */
tumble_status tumble_spin_push(struct tumble_spin *spin,
                               const struct tumble_sample *sample,
                               tumble_wheels wheels,
                               tumble_spin_event *event);

/**
 * Advances a spin to `now`, microseconds of the unit's clock, so that it notices missing samples. `event` may be null.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
 */
tumble_status tumble_spin_tick(struct tumble_spin *spin,
                               uint64_t now,
                               tumble_spin_event *event);

/**
 * Does a slice of solving a spin that turned far enough, for those who would rather call it from an idle task than wait
 * for samples to do it; in any other phase it does nothing. `event` may be null.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
 */
tumble_status tumble_spin_work(struct tumble_spin *spin,
                               tumble_spin_event *event);

/**
 * Returns the state of a spin, and the reason if it failed.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
 */
tumble_status tumble_spin_get_state(const struct tumble_spin *spin, struct tumble_spin_state *state);

/**
 * Returns the progress of a spin.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
 */
tumble_status tumble_spin_get_progress(const struct tumble_spin *spin, struct tumble_spin_progress *progress);

/**
 * Solves for all that was seen so far: the result when the phase is ::TUMBLE_SPIN_PHASE_DONE. `true_angle` and `failure`
 * may be null. When done, and without a true angle, it was solved already; else all of it is solved within
 * this call, which takes long (docs/how-to/c.md). Slices of solving that were under way begin anew.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY; ::TUMBLE_ERROR_NOT_FINITE,
 * ::TUMBLE_ERROR_SETTING of the true angle; ::TUMBLE_ERROR_SPIN where nothing is observable, and `failure` gives the
 * reason.
 */
tumble_status tumble_spin_solve(struct tumble_spin *spin,
                                const struct tumble_spin_true_angle *true_angle,
                                struct tumble_spin_estimate *estimate,
                                struct tumble_spin_failure *failure);

/**
 * Makes a record of the bias that a spin showed of a sensor of the unit `identity`: M is that of a sensor without error,
 * and sigmas of what a spin does not show are infinite. It is the first of its sensor, `sequence` 1, at a temperature that
 * nobody knows; both may be written before it is kept.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_CODE; ::TUMBLE_ERROR_SPIN if the spin does not show this bias;
 * ::TUMBLE_ERROR_NOT_FINITE.
 */
tumble_status tumble_record_from_spin(struct tumble_record *record,
                                      uint64_t identity,
                                      tumble_sensor sensor,
                                      const struct tumble_spin_estimate *estimate);

/**
 * Fills settings of `size` bytes and a version of the layout with their defaults for a unit of a grade; see
 * tumble_spin_defaults() and tumble_spin_defaults_for_grade().
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE, ::TUMBLE_ERROR_CODE.
 */
tumble_status tumble_spin_defaults_of(struct tumble_spin_settings *settings,
                                      size_t size,
                                      uint32_t version,
                                      tumble_grade grade);

/**
 * Makes storage a store in the `length` bytes of flash from the address `start` on: an even number of pages, at least
 * two. The driver is copied; nothing is read or written yet. `size` is `sizeof(tumble_store)`. `limit` may be null.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE, ::TUMBLE_ERROR_NO_DRIVER, ::TUMBLE_ERROR_PAGES,
 * ::TUMBLE_ERROR_BOUNDS, ::TUMBLE_ERROR_TOO_SMALL.
 */
tumble_status tumble_store_init(struct tumble_store *store,
                                size_t size,
                                const struct tumble_flash *flash,
                                uint32_t start,
                                uint32_t length,
                                const struct tumble_write_limit *limit);

/**
 * Returns the number of records there is room for: three of each sensor of each unit stay, and its drift, and the more
 * room there is beside them, the less often flash is erased. Where there is none, the previous ones are dropped.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY.
 */
tumble_status tumble_store_get_entries(const struct tumble_store *store,
                                       uint32_t *entries);

/**
 * Reads one of the records of a sensor of a unit.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_CODE,
 * ::TUMBLE_ERROR_NOTHING_STORED, ::TUMBLE_ERROR_FLASH; ::TUMBLE_ERROR_VERSION, if a newer library wrote it, and all other
 * errors of tumble_record_decode().
 */
tumble_status tumble_store_load(struct tumble_store *store,
                                uint64_t identity,
                                tumble_sensor sensor,
                                tumble_which which,
                                struct tumble_record *record);

/**
 * Puts a record in force; the one adopted before it stays as the previous one. If it is in force already, nothing is
 * written, unless it was the last to be written before a reset: power may have been cut in it. Whenever that happens,
 * the old or the new record reads back whole. `now` is microseconds of any clock that does not go back. `wait`, which may be null, is how long to wait after ::TUMBLE_ERROR_TOO_SOON, microseconds.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY; ::TUMBLE_ERROR_CODE,
 * ::TUMBLE_ERROR_NOT_FINITE of the record; ::TUMBLE_ERROR_TOO_SOON, ::TUMBLE_ERROR_FULL: the old one is in force;
 * ::TUMBLE_ERROR_FLASH, ::TUMBLE_ERROR_NOT_AS_WRITTEN: the old or the new one is.
 */
tumble_status tumble_store_save(struct tumble_store *store,
                                uint64_t now,
                                const struct tumble_record *record,
                                uint64_t *wait);

/**
 * Keeps a record as the factory's; it is in force until another is saved. Everything else is as of tumble_store_save().
 */
tumble_status tumble_store_save_factory(struct tumble_store *store,
                                        uint64_t now,
                                        const struct tumble_record *record,
                                        uint64_t *wait);

/**
 * Reads what temperature does to a sensor of a unit. Calibrations that are adopted leave it as it is.
 *
 * Errors: as of tumble_store_load().
 */
tumble_status tumble_store_load_drift(struct tumble_store *store,
                                      uint64_t identity,
                                      tumble_sensor sensor,
                                      struct tumble_temperature_drift *drift);

/**
 * Keeps what temperature does to a sensor, in place of what was kept of that before. Everything else is as of
 * tumble_store_save().
 */
tumble_status tumble_store_save_drift(struct tumble_store *store,
                                      uint64_t now,
                                      const struct tumble_drift_record *drift,
                                      uint64_t *wait);

/**
 * Puts the previous or the factory's record in force again; what was in force becomes the previous one. `record` is it
 * then; it may be null, and so may `wait`. Give the record to tumble_redundancy_restore() to put it in use.
 *
 * Errors: as of tumble_store_load() and tumble_store_save().
 */
tumble_status tumble_store_roll_back(struct tumble_store *store,
                                     uint64_t now,
                                     uint64_t identity,
                                     tumble_sensor sensor,
                                     tumble_which to,
                                     struct tumble_record *record,
                                     uint64_t *wait);

/**
 * Forgets all records, those of the factory too.
 *
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_INITIALISED, ::TUMBLE_ERROR_BUSY, ::TUMBLE_ERROR_FLASH.
 */
tumble_status tumble_store_erase(struct tumble_store *store);

/**
 * Reads one of the records of the magnetometer of a unit.
 *
 * Errors: as of tumble_store_load().
 */
tumble_status tumble_store_load_magnetometer(struct tumble_store *store,
                                             uint64_t identity,
                                             tumble_which which,
                                             struct tumble_magnetometer_record *record);

/**
 * Puts a record of a magnetometer in force; the one adopted before it stays as the previous one. Everything else is as of
 * tumble_store_save().
 */
tumble_status tumble_store_save_magnetometer(struct tumble_store *store,
                                             uint64_t now,
                                             const struct tumble_magnetometer_record *record,
                                             uint64_t *wait);

/**
 * Keeps a record of a magnetometer as the factory's; it is in force until another is saved. Everything else is as of
 * tumble_store_save().
 */
tumble_status tumble_store_save_factory_magnetometer(struct tumble_store *store,
                                                     uint64_t now,
                                                     const struct tumble_magnetometer_record *record,
                                                     uint64_t *wait);

/**
 * Puts the previous or the factory's record of a magnetometer in force again; what was in force becomes the previous one.
 * `record` is it then; it may be null, and so may `wait`.
 *
 * Errors: as of tumble_store_load() and tumble_store_save().
 */
tumble_status tumble_store_roll_back_magnetometer(struct tumble_store *store,
                                                  uint64_t now,
                                                  uint64_t identity,
                                                  tumble_which to,
                                                  struct tumble_magnetometer_record *record,
                                                  uint64_t *wait);

/**
 * Takes off a reading what temperature did to it: `at_reference` is what the sensor would read at the reference, which
 * goes on to tumble_correction_apply(), to a spin or to a redundant set. `bias` is b of its calibration, m/s^2 or rad/s;
 * `temperature` is in degC, and counts as the reference where it is NaN. `reading` and `at_reference` may be the same.
 *
 * Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NOT_FINITE if the reading, its bias or what the drift makes of them is not.
 *
 */
tumble_status tumble_temperature_drift_remove(const struct tumble_temperature_drift *drift,
                                              const float bias[3],
                                              float temperature,
                                              const float reading[3],
                                              float at_reference[3]);

/**
 * Writes a drift at the start of the `size` bytes at `bytes`, ::TUMBLE_DRIFT_BYTES of them.
 *
 * Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NO_ROOM; ::TUMBLE_ERROR_CODE of the sensor; ::TUMBLE_ERROR_NOT_FINITE of the
 * numbers, also where the range is none or the reference not within it.
 */
tumble_status tumble_drift_encode(const struct tumble_drift_record *record,
                                  uint8_t *bytes,
                                  size_t size);

/**
 * Reads a drift from the `length` bytes that are it, neither more nor fewer.
 *
 * Errors: as of tumble_record_decode(); ::TUMBLE_ERROR_NOT_A_RECORD if they are a record of another kind.
 */
tumble_status tumble_drift_decode(const uint8_t *bytes, size_t length, struct tumble_drift_record *record);

/**
 * Returns the meaning of a status in words. The text is constant, in ASCII, and the library's.
 */
const char *tumble_strerror(tumble_status status);

/**
 * Returns the version of the library, to be compared with #TUMBLE_VERSION of the header. The text is constant, in ASCII,
 * and the library's.
 */
const char *tumble_version(void);

/**
 * Returns the version of the layout of the library's types, to be compared with #TUMBLE_ABI of the header.
 */
uint32_t tumble_abi(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TUMBLE_H */

#ifndef TUMBLE_H_DEFAULTS
#define TUMBLE_H_DEFAULTS
#ifdef __cplusplus
extern "C" {
#endif

/* These calls state size and version as this header has them, so that a library of another layout is found out. */

/** Fills settings with their defaults. Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE. */
static inline tumble_status tumble_redundancy_defaults(struct tumble_redundancy_settings *settings)
{
    return tumble_redundancy_defaults_of(settings, sizeof(struct tumble_redundancy_settings), TUMBLE_ABI);
}

/** Fills in a unit of that identity with six axes of unknown range on the common clock, mounted as the primary.
 * Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE. */
static inline tumble_status tumble_unit_defaults(struct tumble_unit *unit, uint64_t identity)
{
    return tumble_unit_defaults_of(unit, sizeof(struct tumble_unit), TUMBLE_ABI, identity);
}

/** Fills settings with their defaults for a consumer-grade unit. Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE. */
static inline tumble_status tumble_spin_defaults(struct tumble_spin_settings *settings)
{
    return tumble_spin_defaults_of(settings, sizeof(struct tumble_spin_settings), TUMBLE_ABI, TUMBLE_GRADE_CONSUMER);
}

/** The same for a unit of a grade: with the bias instability of its accelerometers and gyroscopes, which a spin is too
 * short to show. Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_SIZE, ::TUMBLE_ERROR_CODE. */
static inline tumble_status tumble_spin_defaults_for_grade(struct tumble_spin_settings *settings, tumble_grade grade)
{
    return tumble_spin_defaults_of(settings, sizeof(struct tumble_spin_settings), TUMBLE_ABI, grade);
}

#ifdef __cplusplus
}  // extern "C"
#endif
#endif
