/* Calls every function once, so that a linker keeps all of the library: what it then leaves out cannot be reached.
   Parts that the library was built without are not called. */

#include "tumble.h"

#ifdef REACH_THE_HEAP
#include <stdlib.h>
#endif

/* Written to, so that no call is for nothing. */
volatile uint32_t answers;

/* Not constant, so that nothing is computed beforehand. */
tumble_flash flash;
tumble_calibration calibration;
tumble_sample sample;
tumble_record record;
#ifndef TUMBLE_WITHOUT_AIDING
tumble_aiding aiding;
#endif

static void correct(void)
{
    tumble_correction correction;
    answers += tumble_correction_init(&correction, &calibration);
    answers += tumble_correction_from_records(&correction, &record, &record);
    answers += tumble_correction_apply(&correction, &sample, &sample);
    answers += tumble_error_model_measure(&calibration.gyroscope, sample.angular_rate, sample.angular_rate);
}

static void take_apart(void)
{
    tumble_decomposition parts;
    answers += tumble_error_model_decompose(&calibration.gyroscope, &parts);
}

#ifndef TUMBLE_WITHOUT_TEMPERATURE
static void warm(void)
{
    const tumble_temperature_drift drift = {25.0F, {-20.0F, 70.0F}, {{0.0F}}, {{0.0F}}};
    answers += tumble_temperature_drift_remove(&drift, calibration.gyroscope.bias, 30.0F, sample.angular_rate,
                                               sample.angular_rate);
}
#endif

#ifndef TUMBLE_WITHOUT_MAGNETOMETER
static void point_north(void)
{
    tumble_magnetometer_record unit = {1, {calibration.gyroscope, {0.1F, 0.2F, 0.3F}}, {{0.0F}}, {0.0F}, false};
    tumble_magnetometer_correction correction;
    answers += tumble_magnetometer_correction_init(&correction, &unit.magnetometer);
    answers += tumble_magnetometer_correction_apply(&correction, sample.angular_rate, 5.0F, sample.angular_rate);
#ifndef TUMBLE_WITHOUT_RECORDS
    uint8_t bytes[TUMBLE_MAGNETOMETER_BYTES];
    answers += tumble_magnetometer_encode(&unit, bytes, sizeof bytes);
    answers += tumble_magnetometer_decode(bytes, sizeof bytes, &unit);
#endif
}
#endif

#ifndef TUMBLE_WITHOUT_SPIN
static tumble_spin spin;

static void turn(void)
{
    tumble_spin_settings settings;
    tumble_spin_state state;
    tumble_spin_progress progress;
    tumble_spin_estimate estimate;
    answers += tumble_spin_defaults(&settings);
    answers += tumble_spin_defaults_for_grade(&settings, TUMBLE_GRADE_INDUSTRIAL);
    answers += tumble_spin_init(&spin, sizeof spin, &settings);
    answers += tumble_spin_start(&spin);
    answers += tumble_spin_push(&spin, &sample, TUMBLE_WHEELS_UNKNOWN, NULL);
    answers += tumble_spin_tick(&spin, sample.time, NULL);
    answers += tumble_spin_work(&spin, NULL);
    answers += tumble_spin_get_state(&spin, &state);
    answers += tumble_spin_get_progress(&spin, &progress);
    answers += tumble_spin_solve(&spin, NULL, &estimate, &state.failure);
    answers += tumble_record_from_spin(&record, 1, TUMBLE_SENSOR_GYROSCOPE, &estimate);
}

#endif

#ifndef TUMBLE_WITHOUT_RECORDS
static tumble_store store;

static void keep(void)
{
    uint8_t bytes[TUMBLE_RECORD_BYTES];
    size_t length = 0;
    uint32_t entries;
    uint64_t wait;
    answers += tumble_record_encode(&record, bytes, sizeof bytes, &length);
    answers += tumble_record_decode(bytes, length, &record);
    answers += tumble_store_init(&store, sizeof store, &flash, 0, 8192, NULL);
    answers += tumble_store_get_entries(&store, &entries);
    answers += tumble_store_load(&store, 1, TUMBLE_SENSOR_GYROSCOPE, TUMBLE_WHICH_IN_FORCE, &record);
    answers += tumble_store_save(&store, 0, &record, &wait);
    answers += tumble_store_save_factory(&store, 0, &record, &wait);
    answers += tumble_store_roll_back(&store, 0, 1, TUMBLE_SENSOR_GYROSCOPE, TUMBLE_WHICH_FACTORY, NULL, NULL);
#ifndef TUMBLE_WITHOUT_TEMPERATURE
    tumble_drift_record drift = {1, TUMBLE_SENSOR_GYROSCOPE, {25.0F, {-20.0F, 70.0F}, {{0.0F}}, {{0.0F}}}};
    answers += tumble_drift_encode(&drift, bytes, sizeof bytes);
    answers += tumble_drift_decode(bytes, TUMBLE_DRIFT_BYTES, &drift);
    answers += tumble_store_save_drift(&store, 0, &drift, &wait);
    answers += tumble_store_load_drift(&store, 1, TUMBLE_SENSOR_GYROSCOPE, &drift.drift);
#endif
#ifndef TUMBLE_WITHOUT_MAGNETOMETER
    tumble_magnetometer_record compass;
    answers += tumble_store_load_magnetometer(&store, 1, TUMBLE_WHICH_IN_FORCE, &compass);
    answers += tumble_store_save_magnetometer(&store, 0, &compass, &wait);
    answers += tumble_store_save_factory_magnetometer(&store, 0, &compass, &wait);
    answers += tumble_store_roll_back_magnetometer(&store, 0, 1, TUMBLE_WHICH_FACTORY, NULL, NULL);
#endif
    answers += tumble_store_erase(&store);
}
#endif

#ifndef TUMBLE_WITHOUT_REDUNDANCY
static tumble_redundancy monitor;

static void on_event(void *context, const tumble_event *event)
{
    (void)context;
    answers += event->kind;
}

static void watch(void)
{
    tumble_redundancy_settings settings;
    tumble_unit units[TUMBLE_UNITS];
    tumble_output output;
    tumble_knowledge knowledge;
    uint32_t source;
    answers += tumble_redundancy_defaults(&settings);
#ifndef TUMBLE_WITHOUT_SETTINGS_CHECK
    char text[64];
    answers += tumble_redundancy_check(&settings, text, sizeof text);
#endif
    for (uint32_t i = 0; i < TUMBLE_UNITS; ++i) {
        answers += tumble_unit_defaults(&units[i], i);
    }
#ifdef TUMBLE_WITHOUT_SETTINGS_CHECK
    answers +=
        tumble_redundancy_init_sealed(&monitor, sizeof monitor, &settings, answers, &calibration, units, TUMBLE_UNITS);
#else
    uint32_t seal;
    answers += tumble_redundancy_seal(&settings, &seal);
    answers +=
        tumble_redundancy_init_sealed(&monitor, sizeof monitor, &settings, seal, &calibration, units, TUMBLE_UNITS);
    answers += tumble_redundancy_init(&monitor, sizeof monitor, &settings, &calibration, units, TUMBLE_UNITS);
#endif
#ifndef TUMBLE_WITHOUT_RECORDS
    answers += tumble_redundancy_restore_from(&monitor, &store, on_event, NULL);
#endif
    answers += tumble_redundancy_restore(&monitor, &record, on_event, NULL);
    answers += tumble_redundancy_push(&monitor, 0, &sample, on_event, NULL, &output);
#ifndef TUMBLE_WITHOUT_AIDING
    answers += tumble_redundancy_aiding(&monitor, sample.time, &aiding, on_event, NULL);
#endif
    answers += tumble_redundancy_set_temperature(&monitor, 0, 25.0f);
    answers += tumble_redundancy_command(&monitor, TUMBLE_COMMAND_EVALUATE);
    answers += tumble_redundancy_get_source(&monitor, &source);
    answers += tumble_redundancy_get_stored(&monitor, 1, TUMBLE_SENSOR_GYROSCOPE, &knowledge);
}
#endif

int main(void)
{
    correct();
    take_apart();
#ifndef TUMBLE_WITHOUT_TEMPERATURE
    warm();
#endif
#ifndef TUMBLE_WITHOUT_MAGNETOMETER
    point_north();
#endif
#ifndef TUMBLE_WITHOUT_SPIN
    turn();
#endif
#ifndef TUMBLE_WITHOUT_RECORDS
    keep();
#endif
#ifndef TUMBLE_WITHOUT_REDUNDANCY
    watch();
#endif
#ifdef REACH_DOUBLE_PRECISION
    answers = (uint32_t)(1.5 * answers);
#endif
#ifdef REACH_THE_HEAP
    answers += (uint32_t)(uintptr_t)malloc(answers);
#endif
    answers += tumble_abi();
    return tumble_strerror(answers)[0] + tumble_version()[0];
}
