/* Readings corrected, and error models taken apart. */

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "laws.h"
#include "vectors.h"

/* Checks numbers against what a case expects of a quantity; `rows` is 1 for a vector, 3 for a matrix. */
static void agrees(const cJSON *file, const cJSON *a_case, const char *quantity, int rows, const float *found)
{
    const double allowed = tolerance(file, quantity);
    for (int i = 0; i < 3 * rows; ++i) {
        const cJSON *list = member(a_case, quantity);
        const cJSON *row = rows == 1 ? list : element(list, i / 3);
        const double expected = element(row, i % 3)->valuedouble;
        CHECK(fabs((double)found[i] - expected) <= allowed);
    }
}

static void check_case(const cJSON *file, const cJSON *a_case)
{
    tumble_error_model model;
    matrix(a_case, "M", model.matrix);
    vector(a_case, "b", model.bias);

    tumble_decomposition parts;
    ANSWERS(TUMBLE_OK, tumble_error_model_decompose(&model, &parts));
    agrees(file, a_case, "scale", 1, parts.scale);
    agrees(file, a_case, "L", 3, parts.triangle[0]);
    agrees(file, a_case, "Q", 3, parts.rotation[0]);
    agrees(file, a_case, "non_orthogonality", 1, parts.non_orthogonality);
    agrees(file, a_case, "mounting", 1, parts.mounting);

    float truth[3];
    float reading[3];
    vector(a_case, "u", truth);
    ANSWERS(TUMBLE_OK, tumble_error_model_measure(&model, truth, reading));
    agrees(file, a_case, "y", 1, reading);

    const tumble_calibration calibration = {model, model};
    tumble_correction correction;
    ANSWERS(TUMBLE_OK, tumble_correction_init(&correction, &calibration));
    tumble_sample sample;
    sample.time = 42;
    memcpy(sample.specific_force, reading, sizeof reading);
    memcpy(sample.angular_rate, reading, sizeof reading);
    tumble_sample corrected;
    ANSWERS(TUMBLE_OK, tumble_correction_apply(&correction, &sample, &corrected));
    CHECK(corrected.time == 42);
    agrees(file, a_case, "corrected", 1, corrected.specific_force);
    agrees(file, a_case, "corrected", 1, corrected.angular_rate);
}

static void agrees_with_the_vectors(void)
{
    cJSON *file = vectors_read("model");
    const cJSON *cases = member(file, "cases");
    CHECK(cJSON_GetArraySize(cases) > 0);
    for (int i = 0; i < cJSON_GetArraySize(cases); ++i) {
        check_case(file, element(cases, i));
    }
    cJSON_Delete(file);
}

static tumble_temperature_drift drift_of(const cJSON *a_case)
{
    tumble_temperature_drift drift;
    drift.reference = (float)number(a_case, "reference");
    for (int i = 0; i < 2; ++i) {
        drift.range[i] = (float)element(member(a_case, "range"), i)->valuedouble;
    }
    matrix(a_case, "bias", drift.bias);
    matrix(a_case, "scale", drift.scale);
    return drift;
}

static void temperature_agrees_with_its_vectors_to_the_bit(void)
{
    cJSON *file = vectors_read("temperature");
    const cJSON *cases = member(file, "cases");
    CHECK(cJSON_GetArraySize(cases) > 0);
    for (int i = 0; i < cJSON_GetArraySize(cases); ++i) {
        const cJSON *a_case = element(cases, i);
        const tumble_temperature_drift drift = drift_of(a_case);
        const float temperature = (float)number(a_case, "temperature");
        float bias[3];
        float reading[3];
        float found[3];
        vector(a_case, "b", bias);
        vector(a_case, "y", reading);
        ANSWERS(TUMBLE_OK, tumble_temperature_drift_remove(&drift, bias, temperature, reading, found));
        agrees(file, a_case, "at_reference", 1, found);
        for (int axis = 0; axis < 3; ++axis) {
            uint32_t bits;
            memcpy(&bits, &found[axis], sizeof bits);
            CHECK((double)bits == element(member(a_case, "bits"), axis)->valuedouble);
        }
        ANSWERS(TUMBLE_OK, tumble_temperature_drift_remove(&drift, bias, temperature, reading, reading));
        CHECK(memcmp(reading, found, sizeof found) == 0);
    }
    cJSON_Delete(file);
}

static void a_failed_thermometer_counts_as_the_reference(void)
{
    const tumble_temperature_drift drift = {
        25.0F, {-20.0F, 70.0F}, {{0.01F, 0.0F, 0.0F}}, {{0.0F, 0.0F, 0.0F}}};
    const float bias[3] = {0.0F, 0.0F, 0.0F};
    float reading[3] = {1.0F, 2.0F, 3.0F};
    float found[3] = {0.0F, 0.0F, 0.0F};
    ANSWERS(TUMBLE_OK, tumble_temperature_drift_remove(&drift, bias, NAN, reading, found));
    CHECK(memcmp(reading, found, sizeof found) == 0);
    reading[1] = NAN;
    ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_temperature_drift_remove(&drift, bias, 30.0F, reading, found));
    CHECK(found[1] == 2.0F);
}

static tumble_magnetometer_record magnetometer_of(const cJSON *a_case)
{
    tumble_magnetometer_record record;
    memset(&record, 0, sizeof record);
    record.identity = (uint64_t)number(a_case, "identity");
    matrix(a_case, "M", record.magnetometer.error.matrix);
    vector(a_case, "b", record.magnetometer.error.bias);
    vector(a_case, "current", record.magnetometer.current);
    matrix(a_case, "M_sigma", record.matrix_sigma);
    vector(a_case, "b_sigma", record.bias_sigma);
    record.of_throttle = strcmp(member(a_case, "current_unit")->valuestring, "1") == 0;
    return record;
}

static void magnetometers_agree_with_their_vectors(void)
{
    cJSON *file = vectors_read("magnetometer");
    const cJSON *cases = member(file, "cases");
    CHECK(cJSON_GetArraySize(cases) > 0);
    for (int i = 0; i < cJSON_GetArraySize(cases); ++i) {
        const cJSON *a_case = element(cases, i);
        const tumble_magnetometer_record record = magnetometer_of(a_case);
        tumble_magnetometer_correction correction;
        ANSWERS(TUMBLE_OK, tumble_magnetometer_correction_init(&correction, &record.magnetometer));
        float reading[3];
        float field[3];
        vector(a_case, "y", reading);
        const float load = (float)number(a_case, "load");
        ANSWERS(TUMBLE_OK, tumble_magnetometer_correction_apply(&correction, reading, load, field));
        agrees(file, a_case, "field", 1, field);
        ANSWERS(TUMBLE_OK, tumble_magnetometer_correction_apply(&correction, reading, load, reading));
        CHECK(memcmp(reading, field, sizeof field) == 0);

        uint8_t bytes[TUMBLE_MAGNETOMETER_BYTES];
        char text[2 * sizeof bytes + 1];
        ANSWERS(TUMBLE_OK, tumble_magnetometer_encode(&record, bytes, sizeof bytes));
        for (size_t byte = 0; byte < sizeof bytes; ++byte) {
            snprintf(&text[2 * byte], 3, "%02x", bytes[byte]);
        }
        CHECK(strcmp(text, member(a_case, "record")->valuestring) == 0);
        tumble_magnetometer_record found;
        ANSWERS(TUMBLE_OK, tumble_magnetometer_decode(bytes, sizeof bytes, &found));
        CHECK(memcmp(&found, &record, offsetof(tumble_magnetometer_record, of_throttle)) == 0);
        CHECK(found.of_throttle == record.of_throttle);
    }
    cJSON_Delete(file);
}

static const tumble_magnetometer_record some_compass = {
    7,
    {{{{1.25F, 0.0F, 0.0F}, {0.5F, 1.0F, 0.0F}, {0.0F, 0.0F, 0.5F}}, {12.0F, -36.0F, 4.5F}}, {0.5F, -0.25F, 2.0F}},
    {{0.5F, 0.5F, 0.5F}, {0.5F, 0.5F, 0.5F}, {0.5F, 0.5F, INFINITY}},
    {0.25F, 0.25F, INFINITY},
    true};

static void a_magnetometer_without_a_known_current_keeps_its_effect(void)
{
    const float reading[3] = {20.0F, -8.0F, 40.0F};
    const float spoilt[3] = {20.0F, NAN, 40.0F};
    float unknown[3];
    float none[3];
    tumble_magnetometer_correction correction;
    ANSWERS(TUMBLE_OK, tumble_magnetometer_correction_init(&correction, &some_compass.magnetometer));
    ANSWERS(TUMBLE_OK, tumble_magnetometer_correction_apply(&correction, reading, NAN, unknown));
    ANSWERS(TUMBLE_OK, tumble_magnetometer_correction_apply(&correction, reading, 0.0F, none));
    CHECK(memcmp(unknown, none, sizeof none) == 0);
    ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_magnetometer_correction_apply(&correction, spoilt, 0.0F, none));

    tumble_magnetometer flat = some_compass.magnetometer;
    memset(flat.error.matrix, 0, sizeof flat.error.matrix);
    ANSWERS(TUMBLE_ERROR_SINGULAR, tumble_magnetometer_correction_init(&correction, &flat));
    flat = some_compass.magnetometer;
    flat.current[2] = NAN;
    ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_magnetometer_correction_init(&correction, &flat));
}

static void bytes_that_are_no_magnetometer_are_refused(void)
{
    uint8_t bytes[TUMBLE_MAGNETOMETER_BYTES];
    tumble_magnetometer_record found;
    tumble_drift_record drift;
    tumble_record record;
    ANSWERS(TUMBLE_ERROR_NO_ROOM, tumble_magnetometer_encode(&some_compass, bytes, sizeof bytes - 1));
    ANSWERS(TUMBLE_OK, tumble_magnetometer_encode(&some_compass, bytes, sizeof bytes));
    ANSWERS(TUMBLE_ERROR_NOT_A_RECORD, tumble_drift_decode(bytes, sizeof bytes, &drift));
    ANSWERS(TUMBLE_ERROR_NOT_A_RECORD, tumble_record_decode(bytes, sizeof bytes, &record));
    ANSWERS(TUMBLE_ERROR_CORRUPT, tumble_magnetometer_decode(bytes, sizeof bytes - 1, &found));
    bytes[40] ^= 1;
    ANSWERS(TUMBLE_ERROR_CORRUPT, tumble_magnetometer_decode(bytes, sizeof bytes, &found));
}

/* A unit whose accelerometer and gyroscope err differently. */
static tumble_correction some_correction(void)
{
    const tumble_calibration calibration = {
        {{{1.01F, 0.002F, 0.0F}, {0.0F, 0.98F, -0.01F}, {0.003F, 0.0F, 1.0F}}, {0.1F, -0.2F, 0.3F}},
        {{{0.99F, 0.0F, 0.004F}, {0.01F, 1.02F, 0.0F}, {0.0F, -0.002F, 1.0F}}, {0.01F, 0.02F, -0.03F}},
    };
    tumble_correction correction;
    ANSWERS(TUMBLE_OK, tumble_correction_init(&correction, &calibration));
    return correction;
}

static void may_be_corrected_in_place(void)
{
    const tumble_correction correction = some_correction();
    tumble_sample sample = {7, {1.0F, -2.0F, 9.0F}, {0.5F, -0.25F, 0.125F}};
    tumble_sample truth;
    ANSWERS(TUMBLE_OK, tumble_correction_apply(&correction, &sample, &truth));
    ANSWERS(TUMBLE_OK, tumble_correction_apply(&correction, &sample, &sample));
    CHECK(sample.time == truth.time);
    CHECK(memcmp(sample.specific_force, truth.specific_force, sizeof truth.specific_force) == 0);
    CHECK(memcmp(sample.angular_rate, truth.angular_rate, sizeof truth.angular_rate) == 0);
}

static void not_finite_is_refused_and_leaves_the_place_alone(void)
{
    const tumble_correction correction = some_correction();
    const float bad[3] = {NAN, INFINITY, -INFINITY};
    for (int channel = 0; channel < 6; ++channel) {
        for (int i = 0; i < 3; ++i) {
            tumble_sample sample = {7, {1.0F, -2.0F, 9.0F}, {0.5F, -0.25F, 0.125F}};
            float *channels = channel < 3 ? sample.specific_force : sample.angular_rate;
            channels[channel % 3] = bad[i];
            tumble_sample truth = {1, {1.0F, 1.0F, 1.0F}, {1.0F, 1.0F, 1.0F}};
            ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_correction_apply(&correction, &sample, &truth));
            CHECK(truth.time == 1 && truth.specific_force[0] == 1.0F);
        }
    }
}

static void no_inverse_is_refused(void)
{
    tumble_calibration calibration = {
        {{{1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}, {0.0F, 0.0F, 1.0F}}, {0.0F, 0.0F, 0.0F}},
        {{{1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}, {0.0F, 0.0F, 1.0F}}, {0.0F, 0.0F, 0.0F}},
    };
    tumble_correction correction;
    tumble_decomposition parts;
    ANSWERS(TUMBLE_OK, tumble_correction_init(&correction, &calibration));
    calibration.gyroscope.matrix[2][2] = -1.0F;
    ANSWERS(TUMBLE_OK, tumble_correction_init(&correction, &calibration));
    ANSWERS(TUMBLE_ERROR_LEFT_HANDED, tumble_error_model_decompose(&calibration.gyroscope, &parts));
    calibration.gyroscope.matrix[2][2] = 0.0F;
    ANSWERS(TUMBLE_ERROR_SINGULAR, tumble_correction_init(&correction, &calibration));
    ANSWERS(TUMBLE_ERROR_SINGULAR, tumble_error_model_decompose(&calibration.gyroscope, &parts));
    calibration.accelerometer.bias[1] = NAN;
    ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_correction_init(&correction, &calibration));
}

const law model_laws[] = {
    {"the error model agrees with its vectors", agrees_with_the_vectors},
    {"what temperature does agrees with its vectors to the bit", temperature_agrees_with_its_vectors_to_the_bit},
    {"a thermometer that failed counts as the reference", a_failed_thermometer_counts_as_the_reference},
    {"magnetometers agree with their vectors, and their bytes to the bit", magnetometers_agree_with_their_vectors},
    {"a magnetometer whose current is not known keeps its effect", a_magnetometer_without_a_known_current_keeps_its_effect},
    {"bytes that are no magnetometer are refused", bytes_that_are_no_magnetometer_are_refused},
    {"a sample may be corrected in place", may_be_corrected_in_place},
    {"a sample that is not finite is refused and leaves the result alone",
     not_finite_is_refused_and_leaves_the_place_alone},
    {"a matrix without an inverse is refused", no_inverse_is_refused},
    {NULL, NULL},
};
