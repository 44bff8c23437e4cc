/* A robot that stands still and then turns on the spot. */

#include <math.h>
#include <string.h>

#include "laws.h"
#include "vectors.h"

static tumble_spin *new_spin(const tumble_spin_settings *settings)
{
    tumble_spin *spin = NEW(tumble_spin);
    ANSWERS(TUMBLE_OK, tumble_spin_init(spin, sizeof *spin, settings));
    return spin;
}

static tumble_spin_phase phase_of(const tumble_spin *spin)
{
    tumble_spin_state state;
    ANSWERS(TUMBLE_OK, tumble_spin_get_state(spin, &state));
    return state.phase;
}

/* State of the wheels in the recording at a time, microseconds. */
static tumble_wheels wheels_at(const cJSON *cases, uint64_t time)
{
    const double seconds = (double)time * 1e-6;
    const cJSON *rests = member(cases, "rests_s");
    for (int i = 0; i < cJSON_GetArraySize(rests); ++i) {
        const cJSON *rest = element(rests, i);
        if (element(rest, 0)->valuedouble <= seconds && seconds <= element(rest, 1)->valuedouble) {
            return TUMBLE_WHEELS_STOPPED;
        }
    }
    return TUMBLE_WHEELS_TURNING;
}

/* Settings of the vectors. */
static tumble_spin_settings settings_of(const cJSON *cases)
{
    tumble_spin_settings settings;
    ANSWERS(TUMBLE_OK, tumble_spin_defaults(&settings));
    settings.gravity = (float)number(cases, "gravity");
    /* Blocks of four samples begin and end where the rests do. */
    settings.block = 4 * (uint64_t)number(cases, "interval_us");
    /* All blocks of the first rest. */
    settings.still = (uint64_t)(element(element(member(cases, "rests_s"), 0), 1)->valuedouble * 1e6);
    settings.still -= settings.block;
    /* More than is turned, so that all of it is used. */
    settings.turn = 1000.0F;
    return settings;
}

/* Pushes all samples; gives how many events came, of which the first eight are in `order`. A rest counts when it has
   ended, so the wheels turn over the last block, and the last sample comes once more to complete it. */
static int push_all(tumble_spin *spin, const cJSON *cases, tumble_spin_event order[9])
{
    const uint64_t interval = (uint64_t)number(cases, "interval_us");
    const cJSON *counts = member(cases, "counts");
    const int samples = cJSON_GetArraySize(counts);
    const cJSON *row = counts->child;
    int events = 0;
    for (int k = 0; k <= samples; ++k) {
        const uint64_t time = (uint64_t)k * interval;
        const tumble_sample sample = sample_of(cases, row, time);
        const tumble_wheels wheels = k > samples - 4 ? TUMBLE_WHEELS_TURNING : wheels_at(cases, time);
        tumble_spin_event *event = &order[events < 8 ? events : 8];
        ANSWERS(TUMBLE_OK, tumble_spin_push(spin, &sample, wheels, event));
        events += *event != TUMBLE_SPIN_EVENT_NONE;
        row = row->next != NULL ? row->next : row;
    }
    return events;
}

/* Pushes samples until the robot has turned far enough; gives the one after. */
static int push_until_solving(tumble_spin *spin, const cJSON *cases)
{
    const uint64_t interval = (uint64_t)number(cases, "interval_us");
    int k = 0;
    for (const cJSON *row = member(cases, "counts")->child; row != NULL; row = row->next, ++k) {
        if (phase_of(spin) == TUMBLE_SPIN_PHASE_SOLVING) {
            break;
        }
        const uint64_t time = (uint64_t)k * interval;
        const tumble_sample sample = sample_of(cases, row, time);
        ANSWERS(TUMBLE_OK, tumble_spin_push(spin, &sample, wheels_at(cases, time), NULL));
    }
    return k;
}

/* Checks three numbers against what is expected, in its sigmas. */
static void agrees(const cJSON *file, const char *quantity, const char *sigma, const float found[3])
{
    const cJSON *cases = member(file, "cases");
    const double allowed = tolerance(file, quantity);
    for (int i = 0; i < 3; ++i) {
        const double expected = element(member(cases, quantity), i)->valuedouble;
        const double apart = fabs((double)found[i] - expected) / element(member(cases, sigma), i)->valuedouble;
        CHECK(apart <= allowed);
    }
}

/* Record of one bias, saved and loaded; all else in it is unknown. */
static tumble_record record_of_bias(const tumble_spin_estimate *estimate, tumble_sensor sensor)
{
    const tumble_spin_vector *const bias =
        sensor == TUMBLE_SENSOR_GYROSCOPE ? &estimate->gyroscope_bias : &estimate->accelerometer_bias;
    tumble_record record;
    uint8_t bytes[TUMBLE_RECORD_BYTES];
    size_t length = 0;
    ANSWERS(TUMBLE_OK, tumble_record_from_spin(&record, 4711, sensor, estimate));
    ANSWERS(TUMBLE_OK, tumble_record_encode(&record, bytes, sizeof bytes, &length));
    ANSWERS(TUMBLE_OK, tumble_record_decode(bytes, length, &record));
    CHECK(record.identity == 4711 && record.sensor == sensor && record.sequence == 1);
    CHECK(record.fit_model == TUMBLE_FIT_MODEL_OFFSET && record.pairs == 0 && isnan(record.temperature));
    CHECK(memcmp(record.bias, bias->value, sizeof record.bias) == 0);
    CHECK(memcmp(record.bias_sigma, bias->sigma, sizeof record.bias_sigma) == 0);
    for (int i = 0; i < 3; ++i) {
        CHECK(isinf(record.lever_arm_sigma[i]));
        for (int j = 0; j < 3; ++j) {
            CHECK(record.matrix[i][j] == (i == j ? 1.0F : 0.0F) && isinf(record.matrix_sigma[i][j]));
        }
    }
    return record;
}

/* Biases of a spin are subtracted from readings, also by way of flash. */
static void corrects_by_records(const tumble_spin_estimate *estimate)
{
    const tumble_record accelerometer = record_of_bias(estimate, TUMBLE_SENSOR_ACCELEROMETER);
    const tumble_record gyroscope = record_of_bias(estimate, TUMBLE_SENSOR_GYROSCOPE);
    tumble_correction correction;
    ANSWERS(TUMBLE_OK, tumble_correction_from_records(&correction, &accelerometer, &gyroscope));
    const tumble_sample reading = {7, {0.5F, -0.25F, 9.75F}, {0.125F, 0.0F, -0.5F}};
    tumble_sample truth;
    ANSWERS(TUMBLE_OK, tumble_correction_apply(&correction, &reading, &truth));
    for (int i = 0; i < 3; ++i) {
        CHECK(truth.specific_force[i] == reading.specific_force[i] - estimate->accelerometer_bias.value[i]);
        CHECK(truth.angular_rate[i] == reading.angular_rate[i] - estimate->gyroscope_bias.value[i]);
    }

    tumble_record record = gyroscope;
    tumble_spin_estimate other = *estimate;
    ANSWERS(TUMBLE_ERROR_CODE, tumble_record_from_spin(&record, 1, (tumble_sensor)2, &other));
    other.accelerometer_bias.observed = false;
    ANSWERS(TUMBLE_ERROR_SPIN, tumble_record_from_spin(&record, 1, TUMBLE_SENSOR_ACCELEROMETER, &other));
    other.gyroscope_bias.sigma[1] = NAN;
    ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_record_from_spin(&record, 1, TUMBLE_SENSOR_GYROSCOPE, &other));
    CHECK(record.identity == 4711);
}

static void agrees_with_the_vectors(void)
{
    cJSON *file = vectors_read("spin");
    const cJSON *cases = member(file, "cases");
    const tumble_spin_settings settings = settings_of(cases);
    tumble_spin *spin = new_spin(&settings);
    ANSWERS(TUMBLE_OK, tumble_spin_start(spin));
    tumble_spin_event order[9];
    CHECK(push_all(spin, cases, order) == 3);
    CHECK(order[0] == TUMBLE_SPIN_EVENT_STILL_BEGAN);
    CHECK(order[1] == TUMBLE_SPIN_EVENT_STILL_DONE);
    CHECK(order[2] == TUMBLE_SPIN_EVENT_TURN_BEGAN);

    tumble_spin_estimate estimate;
    memset(&estimate, 0, sizeof estimate);
    ANSWERS(TUMBLE_OK, tumble_spin_solve(spin, NULL, &estimate, NULL));
    CHECK(estimate.level_free.observed && estimate.gyroscope_bias.observed && estimate.floor_tilt.observed);
    agrees(file, "accelerometer_bias", "accelerometer_bias_sigma", estimate.level_free.value);
    agrees(file, "gyroscope_bias", "gyroscope_bias_sigma", estimate.gyroscope_bias.value);
    const double tilt = (double)estimate.floor_tilt.value - number(cases, "floor_tilt");
    CHECK(fabs(tilt) / number(cases, "floor_tilt_sigma") <= tolerance(file, "floor_tilt"));
    corrects_by_records(&estimate);
    free(spin);
    cJSON_Delete(file);
}

static void is_done_when_it_turned_far_enough(void)
{
    cJSON *file = vectors_read("spin");
    const cJSON *cases = member(file, "cases");
    tumble_spin_settings settings = settings_of(cases);
    settings.turn = 6.5F;
    tumble_spin *spin = new_spin(&settings);
    tumble_spin_event order[9];
    CHECK(push_all(spin, cases, order) == 0);
    CHECK(phase_of(spin) == TUMBLE_SPIN_PHASE_IDLE);

    ANSWERS(TUMBLE_OK, tumble_spin_start(spin));
    CHECK(phase_of(spin) == TUMBLE_SPIN_PHASE_STILL);
    CHECK(push_all(spin, cases, order) == 4);
    CHECK(order[3] == TUMBLE_SPIN_EVENT_DONE);
    CHECK(phase_of(spin) == TUMBLE_SPIN_PHASE_DONE);
    tumble_spin_progress progress;
    ANSWERS(TUMBLE_OK, tumble_spin_get_progress(spin, &progress));
    CHECK(progress.turned >= 6.5F && progress.still == (float)settings.still * 1e-6F);

    tumble_spin_estimate estimate;
    memset(&estimate, 0, sizeof estimate);
    const tumble_spin_true_angle angle = {0.0F, progress.turned, 0.05F};
    ANSWERS(TUMBLE_OK, tumble_spin_solve(spin, &angle, &estimate, NULL));
    /* The angle seen is given for the true one, so there is no scale error to be found. */
    CHECK(estimate.scale.observed && fabsf(estimate.scale.value) < 3.0F * estimate.scale.sigma);
    CHECK(estimate.covariance[0][0] > 0.0F && estimate.covariance[5][5] > 0.0F);
    CHECK(estimate.covariance[0][5] == estimate.covariance[5][0]);
    free(spin);
    cJSON_Delete(file);
}

/* Compares numbers to the bit, but not the bytes that a compiler leaves between fields. */
static bool same_vector(const tumble_spin_vector *a, const tumble_spin_vector *b)
{
    return memcmp(a->value, b->value, sizeof a->value) == 0 && memcmp(a->sigma, b->sigma, sizeof a->sigma) == 0 &&
           a->observed == b->observed;
}

static void is_solved_from_an_idle_task_as_with_samples(void)
{
    cJSON *file = vectors_read("spin");
    const cJSON *cases = member(file, "cases");
    tumble_spin_settings settings = settings_of(cases);
    settings.turn = 6.5F;
    tumble_spin *spin = new_spin(&settings);
    tumble_spin *other = NEW(tumble_spin);
    ANSWERS(TUMBLE_OK, tumble_spin_start(spin));
    ANSWERS(TUMBLE_OK, tumble_spin_work(spin, NULL));
    CHECK(phase_of(spin) == TUMBLE_SPIN_PHASE_STILL);
    const int next = push_until_solving(spin, cases);
    CHECK(phase_of(spin) == TUMBLE_SPIN_PHASE_SOLVING);
    memcpy(other, spin, sizeof *spin);

    int slices = 0;
    tumble_spin_event event = TUMBLE_SPIN_EVENT_NONE;
    for (; event == TUMBLE_SPIN_EVENT_NONE && slices < 100; ++slices) {
        ANSWERS(TUMBLE_OK, tumble_spin_work(spin, &event));
    }
    CHECK(event == TUMBLE_SPIN_EVENT_DONE && phase_of(spin) == TUMBLE_SPIN_PHASE_DONE);
    for (int k = 0; k < slices; ++k) {
        CHECK(phase_of(other) == TUMBLE_SPIN_PHASE_SOLVING);
        const cJSON *row = element(member(cases, "counts"), next + k);
        const tumble_sample sample = sample_of(cases, row, (uint64_t)(next + k) * 20000);
        ANSWERS(TUMBLE_OK, tumble_spin_push(other, &sample, TUMBLE_WHEELS_UNKNOWN, &event));
    }
    CHECK(event == TUMBLE_SPIN_EVENT_DONE);
    tumble_spin_estimate found[2];
    ANSWERS(TUMBLE_OK, tumble_spin_solve(spin, NULL, &found[0], NULL));
    ANSWERS(TUMBLE_OK, tumble_spin_solve(other, NULL, &found[1], NULL));
    CHECK(memcmp(found[0].covariance, found[1].covariance, sizeof found[0].covariance) == 0);
    CHECK(same_vector(&found[0].accelerometer_bias, &found[1].accelerometer_bias));
    CHECK(same_vector(&found[0].gyroscope_bias, &found[1].gyroscope_bias));
    free(other);
    free(spin);
    cJSON_Delete(file);
}

static void says_why_it_failed(void)
{
    tumble_spin_settings settings;
    ANSWERS(TUMBLE_OK, tumble_spin_defaults(&settings));
    tumble_spin *spin = new_spin(&settings);
    ANSWERS(TUMBLE_OK, tumble_spin_start(spin));
    const tumble_sample sample = {1000, {0.0F, 0.0F, 9.8F}, {0.0F, 0.0F, 0.0F}};
    ANSWERS(TUMBLE_OK, tumble_spin_push(spin, &sample, TUMBLE_WHEELS_UNKNOWN, NULL));

    tumble_spin_estimate estimate;
    memset(&estimate, 0x5A, sizeof estimate);
    const tumble_spin_estimate untouched = estimate;
    tumble_spin_failure failure;
    ANSWERS(TUMBLE_ERROR_SPIN, tumble_spin_solve(spin, NULL, &estimate, &failure));
    CHECK(failure.fault == TUMBLE_SPIN_FAULT_NO_REST);
    CHECK(memcmp(&estimate, &untouched, sizeof estimate) == 0);

    tumble_spin_event event = TUMBLE_SPIN_EVENT_NONE;
    ANSWERS(TUMBLE_OK, tumble_spin_tick(spin, 1000 + settings.longest_gap, &event));
    CHECK(event == TUMBLE_SPIN_EVENT_NONE);
    ANSWERS(TUMBLE_OK, tumble_spin_tick(spin, 1001 + settings.longest_gap, &event));
    CHECK(event == TUMBLE_SPIN_EVENT_FAILED);
    tumble_spin_state state;
    ANSWERS(TUMBLE_OK, tumble_spin_get_state(spin, &state));
    CHECK(state.phase == TUMBLE_SPIN_PHASE_FAILED);
    CHECK(state.failure.fault == TUMBLE_SPIN_FAULT_STREAM_STOPPED && state.failure.time == 1000);
    free(spin);
}

static void storage_may_be_moved(void)
{
    cJSON *file = vectors_read("spin");
    const cJSON *cases = member(file, "cases");
    const tumble_spin_settings settings = settings_of(cases);
    tumble_spin *spin = new_spin(&settings);
    ANSWERS(TUMBLE_OK, tumble_spin_start(spin));
    tumble_spin *elsewhere = NEW(tumble_spin);
    memcpy(elsewhere, spin, sizeof *spin);
    memset(spin, 0, sizeof *spin);
    free(spin);
    tumble_spin_event order[9];
    CHECK(push_all(elsewhere, cases, order) == 3);
    free(elsewhere);
    cJSON_Delete(file);
}

const law spin_laws[] = {
    {"a spin agrees with its vectors", agrees_with_the_vectors},
    {"a spin is done when the robot turned far enough, and not before it was started",
     is_done_when_it_turned_far_enough},
    {"a spin is solved from an idle task as it is with samples", is_solved_from_an_idle_task_as_with_samples},
    {"a spin that fails says why and leaves the result alone", says_why_it_failed},
    {"storage may be moved between calls", storage_may_be_moved},
    {NULL, NULL},
};
