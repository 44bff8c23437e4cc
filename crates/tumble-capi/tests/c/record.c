/* Records and their bytes. */

#include <math.h>
#include <string.h>

#include "laws.h"
#include "records.h"

tumble_record example_record(void)
{
    const float seen = 1.0F / 8192.0F;
    const float matrix[3][3] = {{1.0F + 1.0F / 1024.0F, 1.0F / 2048.0F, 0.0F},
                                {-1.0F / 4096.0F, 1.0F - 1.0F / 1024.0F, 0.0F},
                                {0.0F, 1.0F / 8192.0F, 1.0F}};
    tumble_record record;
    memset(&record, 0, sizeof record);
    record.identity = UINT64_C(0x0123456789ABCDEF);
    record.sensor = TUMBLE_SENSOR_ACCELEROMETER;
    record.fit_model = TUMBLE_FIT_MODEL_AFFINE_AND_LEVER_ARM;
    record.directions = 3;
    record.pairs = 412;
    record.sequence = 7;
    memcpy(record.matrix, matrix, sizeof matrix);
    for (int i = 0; i < 3; ++i) {
        record.lever_arm[i] = (i == 1 ? -1.0F : 1.0F) / (float)(4 << i);
        record.bias_sigma[i] = i == 2 ? 1.0F / 64.0F : 1.0F / 128.0F;
        record.lever_arm_sigma[i] = 1.0F / 512.0F;
        record.followed[i] = i == 0 ? 1.0F / 64.0F : i == 1 ? -1.0F / 32.0F : 0.0F;
        for (int j = 0; j < 3; ++j) {
            record.matrix_sigma[i][j] = i == 2 ? INFINITY : seen;
        }
    }
    record.bias[0] = 0.125F;
    record.bias[1] = -0.0625F;
    record.bias[2] = 0.03125F;
    record.residual = 0.0625F;
    record.residual_before = 0.5F;
    record.temperature = 36.5F;
    return record;
}

tumble_record record_of(tumble_sensor sensor, uint32_t sequence)
{
    tumble_record record = example_record();
    record.sensor = sensor;
    record.sequence = sequence;
    record.bias[0] = 0.001F * (float)sequence;
    return record;
}

bool same_record(const tumble_record *a, const tumble_record *b)
{
    uint8_t bytes[2][TUMBLE_RECORD_BYTES];
    size_t lengths[2] = {0, 0};
    ANSWERS(TUMBLE_OK, tumble_record_encode(a, bytes[0], sizeof bytes[0], &lengths[0]));
    ANSWERS(TUMBLE_OK, tumble_record_encode(b, bytes[1], sizeof bytes[1], &lengths[1]));
    return lengths[0] == lengths[1] && memcmp(bytes[0], bytes[1], lengths[0]) == 0;
}

static void has_the_bytes_of_its_documentation(void)
{
    /* Beginning and end of the example in docs/record-format.md. */
    const uint8_t head[] = {0x54, 0x52, 0x02, 0xEF, 0xCD, 0xAB, 0x89, 0x67, 0x45, 0x23, 0x01, 0x00,
                            0x03, 0x03, 0x9C, 0x01, 0x00, 0x00, 0x07, 0x00, 0x00, 0x00, 0x00, 0x20};
    const uint8_t tail[] = {0x00, 0x00, 0x12, 0x42, 0x9D, 0x42, 0xD4, 0x2C};
    const tumble_record record = example_record();
    uint8_t bytes[TUMBLE_RECORD_BYTES];
    size_t length = 0;
    ANSWERS(TUMBLE_OK, tumble_record_encode(&record, bytes, sizeof bytes, &length));
    CHECK(length == TUMBLE_RECORD_BYTES);
    CHECK(memcmp(bytes, head, sizeof head) == 0);
    CHECK(memcmp(bytes + length - sizeof tail, tail, sizeof tail) == 0);
}

static void reads_back_as_it_was_written(void)
{
    for (int known = 0; known < 2; ++known) {
        tumble_record record = example_record();
        if (!known) {
            record.temperature = NAN;
        }
        uint8_t *bytes = (uint8_t *)new_storage(TUMBLE_RECORD_BYTES);
        size_t length = 0;
        ANSWERS(TUMBLE_OK, tumble_record_encode(&record, bytes, TUMBLE_RECORD_BYTES, &length));
        CHECK(length == (known ? 171U : 167U));
        tumble_record read;
        ANSWERS(TUMBLE_OK, tumble_record_decode(bytes, length, &read));
        CHECK(same_record(&record, &read));
        CHECK(read.identity == record.identity && read.matrix[0][1] == record.matrix[0][1]);
        CHECK(read.matrix[1][0] == record.matrix[1][0] && isinf(read.matrix_sigma[2][0]));
        CHECK(read.followed[1] == record.followed[1]);
        CHECK(known ? read.temperature == 36.5F : isnan(read.temperature));
        free(bytes);
    }
}

static void every_single_bit_flip_is_refused(void)
{
    const tumble_record record = example_record();
    uint8_t bytes[TUMBLE_RECORD_BYTES];
    size_t length = 0;
    ANSWERS(TUMBLE_OK, tumble_record_encode(&record, bytes, sizeof bytes, &length));
    for (size_t bit = 0; bit < 8 * length; ++bit) {
        bytes[bit / 8] ^= (uint8_t)(1U << bit % 8);
        tumble_record read;
        const tumble_status answer = tumble_record_decode(bytes, length, &read);
        CHECK(answer == (bit < 16 ? TUMBLE_ERROR_NOT_A_RECORD : TUMBLE_ERROR_CORRUPT));
        bytes[bit / 8] ^= (uint8_t)(1U << bit % 8);
    }
}

/* A refusal leaves buffer and length as they were. */
static void refuses_to_encode(tumble_status answer, const tumble_record *record, size_t room)
{
    uint8_t bytes[TUMBLE_RECORD_BYTES];
    uint8_t untouched[TUMBLE_RECORD_BYTES];
    memset(bytes, 0x5A, sizeof bytes);
    memset(untouched, 0x5A, sizeof untouched);
    size_t length = 77;
    ANSWERS(answer, tumble_record_encode(record, bytes, room, &length));
    CHECK(length == 77 && memcmp(bytes, untouched, sizeof bytes) == 0);
}

static void every_other_length_is_refused(void)
{
    const tumble_record record = example_record();
    uint8_t *bytes = (uint8_t *)new_storage(TUMBLE_RECORD_BYTES + 1);
    size_t length = 0;
    ANSWERS(TUMBLE_OK, tumble_record_encode(&record, bytes, TUMBLE_RECORD_BYTES, &length));
    tumble_record read;
    for (size_t fewer = 0; fewer < length; ++fewer) {
        const tumble_status expected = fewer < 7 ? TUMBLE_ERROR_TOO_SHORT : TUMBLE_ERROR_CORRUPT;
        ANSWERS(expected, tumble_record_decode(bytes, fewer, &read));
    }
    ANSWERS(TUMBLE_ERROR_CORRUPT, tumble_record_decode(bytes, length + 1, &read));
    ANSWERS(TUMBLE_ERROR_CORRUPT, tumble_record_decode(bytes, SIZE_MAX, &read));
    for (size_t room = 0; room < length; ++room) {
        refuses_to_encode(TUMBLE_ERROR_NO_ROOM, &record, room);
    }
    free(bytes);
}

static void what_a_record_may_not_hold_is_refused(void)
{
    tumble_record record = example_record();
    record.bias[2] = NAN;
    refuses_to_encode(TUMBLE_ERROR_NOT_FINITE, &record, TUMBLE_RECORD_BYTES);
    record = example_record();
    record.matrix_sigma[1][1] = NAN;
    refuses_to_encode(TUMBLE_ERROR_NOT_FINITE, &record, TUMBLE_RECORD_BYTES);
    record = example_record();
    record.temperature = INFINITY;
    refuses_to_encode(TUMBLE_ERROR_NOT_FINITE, &record, TUMBLE_RECORD_BYTES);
    record = example_record();
    record.fit_model = (tumble_fit_model)4;
    refuses_to_encode(TUMBLE_ERROR_CODE, &record, TUMBLE_RECORD_BYTES);
    record = example_record();
    record.sensor = (tumble_sensor)UINT32_MAX;
    refuses_to_encode(TUMBLE_ERROR_CODE, &record, TUMBLE_RECORD_BYTES);
}

static void corrects_as_the_calibration_does_that_it_holds(void)
{
    const tumble_record accelerometer = record_of(TUMBLE_SENSOR_ACCELEROMETER, 1);
    const tumble_record gyroscope = record_of(TUMBLE_SENSOR_GYROSCOPE, 2);
    tumble_calibration calibration;
    memcpy(calibration.accelerometer.matrix, accelerometer.matrix, sizeof accelerometer.matrix);
    memcpy(calibration.accelerometer.bias, accelerometer.bias, sizeof accelerometer.bias);
    memcpy(calibration.gyroscope.matrix, gyroscope.matrix, sizeof gyroscope.matrix);
    memcpy(calibration.gyroscope.bias, gyroscope.bias, sizeof gyroscope.bias);
    tumble_correction expected, found;
    ANSWERS(TUMBLE_OK, tumble_correction_init(&expected, &calibration));
    ANSWERS(TUMBLE_OK, tumble_correction_from_records(&found, &accelerometer, &gyroscope));
    CHECK(memcmp(&expected, &found, sizeof found) == 0);
}

static void records_that_make_no_correction_are_refused(void)
{
    const tumble_record accelerometer = record_of(TUMBLE_SENSOR_ACCELEROMETER, 1);
    const tumble_record gyroscope = record_of(TUMBLE_SENSOR_GYROSCOPE, 2);
    tumble_correction correction, untouched;
    memset(&correction, 0x5A, sizeof correction);
    untouched = correction;
    ANSWERS(TUMBLE_ERROR_CODE, tumble_correction_from_records(&correction, &gyroscope, &accelerometer));
    tumble_record other = gyroscope;
    other.sensor = (tumble_sensor)2;
    ANSWERS(TUMBLE_ERROR_CODE, tumble_correction_from_records(&correction, &accelerometer, &other));
    other = gyroscope;
    other.identity ^= 1;
    ANSWERS(TUMBLE_ERROR_NO_SUCH_UNIT, tumble_correction_from_records(&correction, &accelerometer, &other));
    other = gyroscope;
    other.bias[1] = NAN;
    ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_correction_from_records(&correction, &accelerometer, &other));
    memset(other.matrix, 0, sizeof other.matrix);
    other.bias[1] = 0.0F;
    ANSWERS(TUMBLE_ERROR_SINGULAR, tumble_correction_from_records(&correction, &accelerometer, &other));
    CHECK(memcmp(&correction, &untouched, sizeof correction) == 0);
}

const law record_laws[] = {
    {"a record has the bytes of its documentation", has_the_bytes_of_its_documentation},
    {"a record reads back as it was written", reads_back_as_it_was_written},
    {"every single bit that changes in a record has it refused", every_single_bit_flip_is_refused},
    {"every other length than a record's is refused, and leaves the buffer alone", every_other_length_is_refused},
    {"what a record may not hold is refused, and leaves the buffer alone", what_a_record_may_not_hold_is_refused},
    {"records correct as the calibration does that they hold", corrects_as_the_calibration_does_that_it_holds},
    {"records that make no correction together are refused, and leave it alone",
     records_that_make_no_correction_are_refused},
    {NULL, NULL},
};
