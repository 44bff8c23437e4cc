/* A primary and its secondaries. Units beyond the two of the vectors never send a sample. */

#include <math.h>
#include <string.h>

#include "laws.h"
#include "ram_flash.h"
#include "records.h"
#include "vectors.h"

/* Events of a mission. */
typedef struct mission {
    /* Kinds of events in the order in which each came first, without evaluations. */
    tumble_event_kind order[32];
    int kinds;
    /* Records adopted. */
    tumble_record records[4];
    int adopted;
    /* Where they are saved, if anywhere. */
    tumble_store *store;
    tumble_redundancy *monitor;
    tumble_output output;
} mission;

static void on_event(void *context, const tumble_event *event)
{
    mission *told = (mission *)context;
    if (event->unit > 1) {
        CHECK(event->kind == TUMBLE_EVENT_KIND_UNHEALTHY && event->reason == TUMBLE_REASON_LATE);
        return;
    }
    if (event->kind == TUMBLE_EVENT_KIND_ADOPTED) {
        CHECK(event->record != NULL && event->unit == 1 && isnan(event->record->temperature));
        if (event->record != NULL && told->adopted < 4) {
            told->records[told->adopted++] = *event->record;
            if (told->store != NULL) {
                ANSWERS(TUMBLE_OK, tumble_store_save(told->store, event->time, event->record, NULL));
            }
        }
    } else {
        CHECK(event->record == NULL);
    }
    for (int i = 0; i < told->kinds; ++i) {
        if (told->order[i] == event->kind) {
            return;
        }
    }
    if (event->kind != TUMBLE_EVENT_KIND_EVALUATED && told->kinds < 32) {
        told->order[told->kinds++] = event->kind;
    }
}

static void fill_units(tumble_unit units[TUMBLE_UNITS])
{
    for (int i = 0; i < TUMBLE_UNITS; ++i) {
        ANSWERS(TUMBLE_OK, tumble_unit_defaults(&units[i], (uint64_t)i + 1));
    }
}

static tumble_redundancy *new_monitor(const tumble_redundancy_settings *settings)
{
    tumble_unit units[TUMBLE_UNITS];
    fill_units(units);
    tumble_redundancy *monitor = NEW(tumble_redundancy);
    ANSWERS(TUMBLE_OK,
            tumble_redundancy_init(monitor, sizeof *monitor, settings, NULL, units, TUMBLE_UNITS));
    return monitor;
}

static tumble_redundancy_settings settings_of(const cJSON *cases)
{
    tumble_redundancy_settings settings;
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    settings.rest_duration = (uint64_t)(number(cases, "rest_duration_s") * 1e6);
    settings.collect = (uint64_t)(number(cases, "collect_s") * 1e6);
    return settings;
}

/* Flies the mission of the vectors. */
static void fly(const cJSON *cases, mission *told)
{
    const uint64_t interval = (uint64_t)number(cases, "interval_us");
    const cJSON *secondary = member(cases, "secondary_counts")->child;
    const cJSON *primary = NULL;
    uint64_t time = 1000000;
    cJSON_ArrayForEach(primary, member(cases, "primary_counts"))
    {
        const cJSON *both[2] = {primary, secondary};
        for (uint32_t unit = 0; unit < 2; ++unit) {
            const tumble_sample sample = sample_of(cases, both[unit], time);
            tumble_output *output = unit == 0 ? &told->output : NULL;
            ANSWERS(TUMBLE_OK, tumble_redundancy_push(told->monitor, unit, &sample, on_event, told, output));
        }
        secondary = secondary->next;
        time += interval;
    }
}

/* The words of the vectors for a kind of event. */
static const char *name_of(tumble_event_kind kind)
{
    switch (kind) {
    case TUMBLE_EVENT_KIND_SELECTED:
        return "selected";
    case TUMBLE_EVENT_KIND_REST_BEGAN:
        return "rest began";
    case TUMBLE_EVENT_KIND_TRIGGERED:
        return "triggered";
    case TUMBLE_EVENT_KIND_REST_ENDED:
        return "rest ended";
    case TUMBLE_EVENT_KIND_MOTION_BEGAN:
        return "motion began";
    case TUMBLE_EVENT_KIND_FITTED:
        return "fitted";
    case TUMBLE_EVENT_KIND_ADOPTED:
        return "adopted";
    default:
        return "something else";
    }
}

static void events_agree(const cJSON *cases, const mission *told)
{
    const cJSON *events = member(cases, "events");
    CHECK(cJSON_GetArraySize(events) == told->kinds);
    for (int i = 0; i < told->kinds && i < cJSON_GetArraySize(events); ++i) {
        CHECK(strcmp(element(events, i)->valuestring, name_of(told->order[i])) == 0);
    }
}

/* Checks numbers against what is expected, in the sigmas found with them. */
static void close_to(double allowed, int count, const float *expected, const float *found, const float *sigma)
{
    for (int i = 0; i < count; ++i) {
        CHECK(fabs((double)found[i] - (double)expected[i]) / (double)sigma[i] <= allowed);
    }
}

static void record_agrees(const cJSON *file, const tumble_record *record)
{
    const cJSON *cases = member(file, "cases");
    const int gyroscope = record->sensor == TUMBLE_SENSOR_GYROSCOPE;
    const char *m = gyroscope ? "gyroscope_M" : "accelerometer_M";
    const char *b = gyroscope ? "gyroscope_b" : "accelerometer_b";
    float expected[3][3];
    matrix(cases, m, expected);
    close_to(tolerance(file, m), 9, expected[0], record->matrix[0], record->matrix_sigma[0]);
    vector(cases, b, expected[0]);
    close_to(tolerance(file, b), 3, expected[0], record->bias, record->bias_sigma);
    if (!gyroscope) {
        vector(cases, "lever_arm", expected[0]);
        close_to(tolerance(file, "lever_arm"), 3, expected[0], record->lever_arm, record->lever_arm_sigma);
    }
}

static void agrees_with_the_vectors(void)
{
    cJSON *file = vectors_read("redundancy");
    const cJSON *cases = member(file, "cases");
    const tumble_redundancy_settings settings = settings_of(cases);
    mission told;
    memset(&told, 0, sizeof told);
    told.monitor = new_monitor(&settings);
    fly(cases, &told);
    events_agree(cases, &told);
    CHECK(told.adopted == 2 && told.records[0].sensor != told.records[1].sensor);
    for (int i = 0; i < told.adopted; ++i) {
        record_agrees(file, &told.records[i]);
    }
    CHECK(told.output.source == 0);
    uint32_t source = 7;
    ANSWERS(TUMBLE_OK, tumble_redundancy_get_source(told.monitor, &source));
    CHECK(source == 0);
    free(told.monitor);
    cJSON_Delete(file);
}

static void outlasts_a_reset(void)
{
    cJSON *file = vectors_read("redundancy");
    const cJSON *cases = member(file, "cases");
    const tumble_redundancy_settings settings = settings_of(cases);
    ram_flash flash;
    ram_flash_erase(&flash);
    mission told;
    memset(&told, 0, sizeof told);
    told.store = ram_flash_open(&flash);
    told.monitor = new_monitor(&settings);
    fly(cases, &told);
    CHECK(told.adopted == 2);
    tumble_knowledge before[2];
    for (uint32_t sensor = 0; sensor < 2; ++sensor) {
        ANSWERS(TUMBLE_OK, tumble_redundancy_get_stored(told.monitor, 1, (tumble_sensor)sensor, &before[sensor]));
        CHECK(before[sensor].calibrated && before[sensor].sequence == 1);
    }
    free(told.monitor);
    free(told.store);

    told.store = ram_flash_open(&flash);
    told.monitor = new_monitor(&settings);
    told.kinds = 0;
    ANSWERS(TUMBLE_OK, tumble_redundancy_restore_from(told.monitor, told.store, on_event, &told));
    CHECK(told.kinds == 1 && told.order[0] == TUMBLE_EVENT_KIND_RESTORED);
    for (uint32_t sensor = 0; sensor < 2; ++sensor) {
        tumble_knowledge after;
        ANSWERS(TUMBLE_OK, tumble_redundancy_get_stored(told.monitor, 1, (tumble_sensor)sensor, &after));
        CHECK(after.calibrated && after.sequence == before[sensor].sequence);
        CHECK(after.residual == before[sensor].residual);
        CHECK(after.factory > 0.0F && after.factory == before[sensor].factory);
        CHECK(memcmp(after.bias, before[sensor].bias, sizeof after.bias) == 0);
        for (int i = 0; i < 9; ++i) {
            CHECK(fabsf(after.matrix[i / 3][i % 3] - before[sensor].matrix[i / 3][i % 3]) < 1e-6F);
        }
    }
    free(told.monitor);
    free(told.store);
    cJSON_Delete(file);
}

/* Tries to reach the monitor from within its own call. */
static void on_event_reaching_back(void *context, const tumble_event *event)
{
    mission *told = (mission *)context;
    const tumble_sample sample = {event->time, {0.0F, 0.0F, 9.8F}, {0.0F, 0.0F, 0.0F}};
    uint32_t source = 0;
    ANSWERS(TUMBLE_ERROR_BUSY, tumble_redundancy_push(told->monitor, 0, &sample, NULL, NULL, NULL));
    ANSWERS(TUMBLE_ERROR_BUSY, tumble_redundancy_get_source(told->monitor, &source));
    ++told->kinds;
}

static void a_callback_cannot_reach_back(void)
{
    tumble_redundancy_settings settings;
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    mission told;
    memset(&told, 0, sizeof told);
    told.monitor = new_monitor(&settings);
    for (uint64_t time = 1000; time < 1000000; time += 5000) {
        const tumble_sample sample = {time, {0.0F, 0.01F * (float)(time % 7), 9.8F}, {0.0F, 0.0F, 0.0F}};
        ANSWERS(TUMBLE_OK,
                tumble_redundancy_push(told.monitor, 0, &sample, on_event_reaching_back, &told, NULL));
    }
    CHECK(told.kinds > 0);
    free(told.monitor);
}

/* Tries to reach the store from within the call that restores from it. */
static void on_restored_reaching_back(void *context, const tumble_event *event)
{
    mission *told = (mission *)context;
    tumble_record record;
    uint32_t entries = 0;
    CHECK(event->kind == TUMBLE_EVENT_KIND_RESTORED);
    ANSWERS(TUMBLE_ERROR_BUSY,
            tumble_store_load(told->store, 2, TUMBLE_SENSOR_GYROSCOPE, TUMBLE_WHICH_IN_FORCE, &record));
    ANSWERS(TUMBLE_ERROR_BUSY, tumble_store_get_entries(told->store, &entries));
    ANSWERS(TUMBLE_ERROR_BUSY, tumble_redundancy_command(told->monitor, TUMBLE_COMMAND_EVALUATE));
    ++told->kinds;
}

static void a_callback_cannot_reach_the_store_it_is_restored_from(void)
{
    tumble_redundancy_settings settings;
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    ram_flash flash;
    ram_flash_erase(&flash);
    mission told;
    memset(&told, 0, sizeof told);
    told.store = ram_flash_open(&flash);
    told.monitor = new_monitor(&settings);
    tumble_record record = record_of(TUMBLE_SENSOR_GYROSCOPE, 1);
    record.identity = 2;
    for (int i = 0; i < 3; ++i) {
        record.lever_arm[i] = 0.0F;
    }
    ANSWERS(TUMBLE_OK, tumble_store_save(told.store, 0, &record, NULL));
    ANSWERS(TUMBLE_OK,
            tumble_redundancy_restore_from(told.monitor, told.store, on_restored_reaching_back, &told));
    CHECK(told.kinds == 1);
    /* Afterwards both are free again. */
    ANSWERS(TUMBLE_OK, tumble_store_load(told.store, 2, TUMBLE_SENSOR_GYROSCOPE, TUMBLE_WHICH_IN_FORCE, &record));
    ANSWERS(TUMBLE_OK, tumble_redundancy_command(told.monitor, TUMBLE_COMMAND_EVALUATE));
    free(told.monitor);
    free(told.store);
}

static void a_dead_primary_is_replaced(void)
{
    tumble_redundancy_settings settings;
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    mission told;
    memset(&told, 0, sizeof told);
    told.monitor = new_monitor(&settings);
    uint32_t source = TUMBLE_NO_SOURCE;
    for (uint64_t time = 1000; time < 4000000; time += 5000) {
        for (uint32_t unit = time < 2000000 ? 0 : 1; unit < 2; ++unit) {
            const float shake = 0.01F * (float)(time / 5000 % (unit == 0 ? 7 : 5));
            const tumble_sample sample = {time, {shake, -shake, 9.8F + shake}, {shake, shake, -shake}};
            ANSWERS(TUMBLE_OK, tumble_redundancy_push(told.monitor, unit, &sample, on_event, &told, &told.output));
        }
        ANSWERS(TUMBLE_OK, tumble_redundancy_get_source(told.monitor, &source));
        CHECK(source == 0 || time >= 2000000);
    }
    CHECK(source == 1 && told.output.source == 1);
    free(told.monitor);
}

/* Counts aiding measurements that were left out, by reason. */
static void on_left_out(void *context, const tumble_event *event)
{
    int *told = (int *)context;
    CHECK(event->kind == TUMBLE_EVENT_KIND_AIDING_LEFT_OUT);
    CHECK(event->reason == TUMBLE_REASON_NOT_FINITE || event->reason == TUMBLE_REASON_NO_SIGMA);
    told[event->reason == TUMBLE_REASON_NO_SIGMA] += 1;
}

static void an_aiding_that_cannot_be_used_is_told_of_once(void)
{
    tumble_redundancy_settings settings;
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    tumble_redundancy *monitor = new_monitor(&settings);
    int told[2] = {0, 0};
    const tumble_aiding good = {
        TUMBLE_AIDING_KIND_VELOCITY, 0, {0.0F, 0.1F, NAN}, {0.3F, 0.3F, INFINITY}, 0.0F, 0.0F};
    tumble_aiding no_number = good;
    no_number.velocity[1] = NAN;
    tumble_aiding no_sigma = good;
    no_sigma.sigma[1] = 0.0F;
    for (uint64_t time = 0; time < 1000000; time += 200000) {
        ANSWERS(TUMBLE_OK, tumble_redundancy_aiding(monitor, time, &good, on_left_out, told));
        ANSWERS(TUMBLE_OK, tumble_redundancy_aiding(monitor, time, &no_number, on_left_out, told));
        ANSWERS(TUMBLE_OK, tumble_redundancy_aiding(monitor, time, &no_sigma, on_left_out, told));
        ANSWERS(TUMBLE_OK, tumble_redundancy_aiding(monitor, time, &no_sigma, NULL, NULL));
    }
    CHECK(told[0] == 1 && told[1] == 1);
    tumble_aiding score = {TUMBLE_AIDING_KIND_SCORE, 1, {0.0F, 0.0F, 0.0F}, {0.0F, 0.0F, 0.0F}, 1.2F, 0.0F};
    ANSWERS(TUMBLE_OK, tumble_redundancy_aiding(monitor, 0, &score, on_left_out, told));
    score.unit = TUMBLE_UNITS;
    ANSWERS(TUMBLE_ERROR_NO_SUCH_UNIT, tumble_redundancy_aiding(monitor, 0, &score, on_left_out, told));
    tumble_aiding heading = {TUMBLE_AIDING_KIND_HEADING, 0, {0.0F, 0.0F, 0.0F}, {0.1F, 0.0F, 0.0F}, 0.0F, 1.0F};
    ANSWERS(TUMBLE_OK, tumble_redundancy_aiding(monitor, 0, &heading, on_left_out, told));
    score.kind = (tumble_aiding_kind)4;
    ANSWERS(TUMBLE_ERROR_CODE, tumble_redundancy_aiding(monitor, 0, &score, on_left_out, told));
    free(monitor);
}

/* Error of the primary by itself, in the form of a record: y = M u + b. */
static tumble_record record_of_primary(tumble_sensor sensor)
{
    tumble_record record = record_of(sensor, 3);
    record.identity = 1;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            record.matrix[i][j] = i == j ? 1.0F + 0.01F * (float)(i + 1) : 0.003F * (float)(i - j);
        }
        record.bias[i] = 0.1F * (float)(i + 1);
        record.lever_arm[i] = 0.0F;
    }
    record.residual = sensor == TUMBLE_SENSOR_GYROSCOPE ? 0.001F : 0.02F;
    return record;
}

static tumble_calibration calibration_of_primary(void)
{
    tumble_calibration calibration;
    tumble_error_model *const models[2] = {&calibration.accelerometer, &calibration.gyroscope};
    for (uint32_t sensor = 0; sensor < 2; ++sensor) {
        const tumble_record record = record_of_primary((tumble_sensor)sensor);
        memcpy(models[sensor]->matrix, record.matrix, sizeof record.matrix);
        memcpy(models[sensor]->bias, record.bias, sizeof record.bias);
    }
    return calibration;
}

/* Flash with the records of the primary in it, and a monitor of default settings. */
static void begin_with_records_of_primary(ram_flash *flash, mission *told, const tumble_calibration *given)
{
    tumble_redundancy_settings settings;
    tumble_unit units[TUMBLE_UNITS];
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    memset(told, 0, sizeof *told);
    ram_flash_erase(flash);
    told->store = ram_flash_open(flash);
    for (uint32_t sensor = 0; sensor < 2; ++sensor) {
        const tumble_record record = record_of_primary((tumble_sensor)sensor);
        ANSWERS(TUMBLE_OK, tumble_store_save_factory(told->store, 0, &record, NULL));
    }
    fill_units(units);
    told->monitor = NEW(tumble_redundancy);
    ANSWERS(TUMBLE_OK, tumble_redundancy_init(told->monitor, sizeof *told->monitor, &settings, given, units,
                                              TUMBLE_UNITS));
}

static void the_primary_is_calibrated_from_flash(void)
{
    ram_flash flash;
    mission told;
    tumble_correction correction;
    const tumble_calibration calibration = calibration_of_primary();
    tumble_sample truth, sample = {5000, {0.3F, -0.2F, 9.8F}, {0.1F, 0.2F, -0.3F}};
    begin_with_records_of_primary(&flash, &told, NULL);
    ANSWERS(TUMBLE_OK, tumble_redundancy_restore_from(told.monitor, told.store, on_event, &told));
    CHECK(told.kinds == 1 && told.order[0] == TUMBLE_EVENT_KIND_RESTORED);
    for (uint32_t sensor = 0; sensor < 2; ++sensor) {
        const tumble_record record = record_of_primary((tumble_sensor)sensor);
        tumble_knowledge known;
        ANSWERS(TUMBLE_OK, tumble_redundancy_get_stored(told.monitor, 0, (tumble_sensor)sensor, &known));
        CHECK(known.calibrated && known.residual == record.residual);
        CHECK(memcmp(known.matrix, record.matrix, sizeof known.matrix) == 0);
        CHECK(memcmp(known.bias, record.bias, sizeof known.bias) == 0);
        /* Compensated data count from the residual of the calibration, over three axes. */
        CHECK(fabsf(known.factory - 1.7320508F * record.residual) < 1e-6F);
    }
    ANSWERS(TUMBLE_OK, tumble_correction_init(&correction, &calibration));
    ANSWERS(TUMBLE_OK, tumble_correction_apply(&correction, &sample, &truth));
    ANSWERS(TUMBLE_OK, tumble_redundancy_push(told.monitor, 0, &sample, NULL, NULL, &told.output));
    CHECK(told.output.source == 0);
    for (int i = 0; i < 3; ++i) {
        CHECK(told.output.specific_force[i] == truth.specific_force[i]);
        CHECK(told.output.angular_rate[i] == truth.angular_rate[i]);
    }
    /* A monitor that has begun accepts no other calibration of the primary. */
    const tumble_record late = record_of_primary(TUMBLE_SENSOR_GYROSCOPE);
    ANSWERS(TUMBLE_ERROR_BEGUN, tumble_redundancy_restore(told.monitor, &late, on_event, &told));
    free(told.monitor);
    free(told.store);
}

static void what_is_given_of_the_primary_goes_before_flash(void)
{
    ram_flash flash;
    mission told;
    tumble_calibration given = calibration_of_primary();
    tumble_knowledge known;
    given.gyroscope.bias[0] = -0.5F;
    begin_with_records_of_primary(&flash, &told, &given);
    ANSWERS(TUMBLE_OK, tumble_redundancy_restore_from(told.monitor, told.store, on_event, &told));
    CHECK(told.kinds == 0);
    ANSWERS(TUMBLE_OK, tumble_redundancy_get_stored(told.monitor, 0, TUMBLE_SENSOR_GYROSCOPE, &known));
    CHECK(known.calibrated && known.bias[0] == -0.5F && known.residual == 0.0F);
    free(told.monitor);
    free(told.store);
}

static void a_primary_without_a_record_is_taken_for_right(void)
{
    tumble_redundancy_settings settings;
    tumble_knowledge known;
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    mission told;
    memset(&told, 0, sizeof told);
    told.monitor = new_monitor(&settings);
    tumble_record record = record_of_primary(TUMBLE_SENSOR_ACCELEROMETER);
    memset(record.matrix, 0, sizeof record.matrix);
    /* It has no inverse. */
    ANSWERS(TUMBLE_OK, tumble_redundancy_restore(told.monitor, &record, on_event, &told));
    CHECK(told.kinds == 1 && told.order[0] == TUMBLE_EVENT_KIND_RECORD_REJECTED);
    ANSWERS(TUMBLE_OK, tumble_redundancy_get_stored(told.monitor, 0, TUMBLE_SENSOR_ACCELEROMETER, &known));
    CHECK(!known.calibrated && known.matrix[0][0] == 1.0F && known.bias[0] == 0.0F && known.residual == 0.0F);
    free(told.monitor);
}

const law redundancy_laws[] = {
    {"a redundant set agrees with its vectors", agrees_with_the_vectors},
    {"what was adopted and stored is there after a reset", outlasts_a_reset},
    {"a callback cannot reach back into the monitor that calls it", a_callback_cannot_reach_back},
    {"a callback cannot reach the store that a monitor is restored from",
     a_callback_cannot_reach_the_store_it_is_restored_from},
    {"what an aiding measurement says that cannot be used is told of once", an_aiding_that_cannot_be_used_is_told_of_once},
    {"a primary that dies is replaced by the secondary", a_dead_primary_is_replaced},
    {"the primary's own records in flash are its calibration", the_primary_is_calibrated_from_flash},
    {"a calibration of the primary that is given goes before that in flash",
     what_is_given_of_the_primary_goes_before_flash},
    {"a primary without a record that can be one is taken for right",
     a_primary_without_a_record_is_taken_for_right},
    {NULL, NULL},
};
