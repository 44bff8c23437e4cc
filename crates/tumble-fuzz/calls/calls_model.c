#include "fuzz.h"

#include <math.h>
#include <string.h>

/* Arguments of one call. */
static tumble_calibration *calibration;
static tumble_correction *correction;
static tumble_error_model *model;
static tumble_decomposition *decomposition;
static tumble_sample *reading;
static tumble_sample *truth;
static float *vector;
static float *measured;
static tumble_record *record;
static tumble_record *other;
static uint8_t *bytes;
static size_t *length;

static void make_room(void)
{
    if (calibration != NULL) {
        return;
    }
    calibration = memory_ending(sizeof *calibration);
    correction = memory_ending(sizeof *correction);
    model = memory_ending(sizeof *model);
    decomposition = memory_ending(sizeof *decomposition);
    reading = memory_ending(sizeof *reading);
    truth = memory_ending(sizeof *truth);
    vector = memory_ending(3 * sizeof *vector);
    measured = memory_ending(3 * sizeof *measured);
    record = memory_ending(sizeof *record);
    other = memory_ending(sizeof *other);
    bytes = memory_ending(TUMBLE_RECORD_BYTES + 1);
    length = memory_ending(sizeof *length);
}

static void any_model(tumble_error_model *any)
{
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            any->matrix[i][j] = (i == j ? 1.0f : 0.0f) + draw_usual(0.1f);
        }
        any->bias[i] = draw_usual(1.0f);
    }
    if (draw_once_in(2)) {
        draw_spoil(any, sizeof *any);
    }
}

void spoil_sample(tumble_sample *sample)
{
    if (draw_once_in(samples_spoilt)) {
        draw_spoil(sample->specific_force, 6 * sizeof(float));
    }
    if (draw_once_in(samples_spoilt)) {
        sample->time = draw_once_in(2) ? draw_time() : sample->time + draw_time();
    }
}

void any_record(tumble_record *any)
{
    usual_record(any);
    if (draw_once_in(4)) {
        draw_spoil(any, sizeof *any);
    }
    any->sensor = draw_code(2);
    any->fit_model = draw_code(4);
}

static void correct(void)
{
    any_model(&calibration->accelerometer);
    any_model(&calibration->gyroscope);
    any_record(record);
    any_record(other);
    unwritten(correction, sizeof *correction);
    const tumble_status status =
        draw_once_in(2) ? tumble_correction_init(required(correction), required(calibration))
                        : tumble_correction_from_records(required(correction), required(record), required(other));
    if (!done(status, correction, sizeof *correction)) {
        draw_spoil(correction, sizeof *correction);
    }
    uint32_t unit;
    next_of_set(&unit, reading);
    spoil_sample(reading);
    unwritten(truth, sizeof *truth);
    if (done(tumble_correction_apply(required(correction), required(reading), required(truth)), truth,
             sizeof *truth)) {
        CHECK(truth->time == reading->time, "correction changes the time");
        tell(truth, sizeof *truth);
    }
}

static void take_apart(void)
{
    any_model(model);
    for (int axis = 0; axis < 3; axis++) {
        vector[axis] = draw_number();
    }
    unwritten(measured, 3 * sizeof *measured);
    if (done(tumble_error_model_measure(required(model), required(vector), required(measured)), measured,
             3 * sizeof *measured)) {
        tell(measured, 3 * sizeof *measured);
    }
    unwritten(decomposition, sizeof *decomposition);
    if (done(tumble_error_model_decompose(required(model), required(decomposition)), decomposition,
             sizeof *decomposition)) {
        tell(decomposition, sizeof *decomposition);
    }
}

void call_of_model(void)
{
    make_room();
    if (draw_once_in(2)) {
        correct();
    } else {
        take_apart();
    }
    const char *const words = tumble_strerror(draw_code(TUMBLE_ERROR_NOTHING_STORED + 1));
    CHECK(words != NULL && words[0] != '\0' && memchr(words, 0, 200) != NULL, "a status without words");
}

void call_of_record(void)
{
    make_room();
    /* So that it ends where memory does, whatever its size. */
    const size_t size = draw_once_in(4) ? draw_below(TUMBLE_RECORD_BYTES + 2) : TUMBLE_RECORD_BYTES + 1;
    uint8_t *const buffer = bytes + TUMBLE_RECORD_BYTES + 1 - size;
    any_record(record);
    unwritten(buffer, size);
    unwritten(length, sizeof *length);
    const bool null = draw_once_in(64);
    if (done(tumble_record_encode(required(record), null ? NULL : buffer, size, required(length)), length,
             sizeof *length)) {
        CHECK(!null && *length <= size, "it was written where there is no room");
        tell(buffer, *length);
    } else {
        *length = size;
    }
    if (draw_once_in(2)) {
        const size_t place = *length == 0 ? 0 : draw_below((uint32_t)*length);
        draw_spoil(buffer, draw_once_in(2) ? *length & ~(size_t)3 : 0);
        if (*length != 0) {
            buffer[place] ^= (uint8_t)(1u << draw_below(8));
        }
    }
    unwritten(record, sizeof *record);
    const size_t claimed = draw_once_in(64) ? draw_below((uint32_t)size + 1) : *length;
    if (done(tumble_record_decode(null ? NULL : buffer, claimed, required(record)), record, sizeof *record)) {
        CHECK(!null, "a record was read from nowhere");
        uint8_t again[TUMBLE_RECORD_BYTES];
        size_t written;
        CHECK(tumble_record_encode(record, again, sizeof again, &written) == TUMBLE_OK,
              "what was read is not written");
        CHECK(written == claimed && memcmp(again, buffer, written) == 0, "other bytes than it was read from");
    }
}
