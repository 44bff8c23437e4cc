/* Calls that no caller may make, and their answers. */

#include <math.h>
#include <string.h>

#include "laws.h"
#include "ram_flash.h"
#include "records.h"

static const tumble_sample SAMPLE = {1000, {0.0F, 0.0F, 9.8F}, {0.0F, 0.0F, 0.0F}};

static tumble_status begin(tumble_redundancy *monitor, const tumble_redundancy_settings *settings)
{
    tumble_unit units[TUMBLE_UNITS];
    for (int i = 0; i < TUMBLE_UNITS; ++i) {
        ANSWERS(TUMBLE_OK, tumble_unit_defaults(&units[i], (uint64_t)i + 1));
    }
    return tumble_redundancy_init(monitor, sizeof *monitor, settings, NULL, units, TUMBLE_UNITS);
}

static void null_is_refused_everywhere(void)
{
    tumble_spin *spin = NEW(tumble_spin);
    tumble_redundancy *monitor = NEW(tumble_redundancy);
    ram_flash flash;
    ram_flash_erase(&flash);
    tumble_store *store = ram_flash_open(&flash);
    const tumble_flash driver = ram_flash_driver(&flash);
    tumble_spin_settings spin_settings;
    tumble_redundancy_settings settings;
    uint32_t seal;
    ANSWERS(TUMBLE_OK, tumble_spin_defaults(&spin_settings));
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    ANSWERS(TUMBLE_OK, tumble_spin_init(spin, sizeof *spin, &spin_settings));
    ANSWERS(TUMBLE_OK, begin(monitor, &settings));
    const tumble_error_model model = {{{1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}, {0.0F, 0.0F, 1.0F}}, {0.0F, 0.0F, 0.0F}};
    const tumble_calibration calibration = {model, model};
    tumble_correction correction;
    ANSWERS(TUMBLE_OK, tumble_correction_init(&correction, &calibration));
    tumble_sample sample = SAMPLE;
    tumble_record record = example_record();
    const tumble_aiding aiding = {TUMBLE_AIDING_KIND_SCORE, 0, {0.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 1.0F}, 1.0F, 0.0F};
    tumble_unit unit;
    tumble_decomposition parts;
    tumble_spin_state state;
    tumble_spin_progress progress;
    tumble_spin_estimate estimate;
    tumble_knowledge knowledge;
    uint32_t number = 0;
    uint8_t bytes[TUMBLE_RECORD_BYTES];
    size_t length = 0;
    float three[3] = {0.0F, 0.0F, 0.0F};
    tumble_drift_record drift = {1, TUMBLE_SENSOR_GYROSCOPE, {25.0F, {-20.0F, 70.0F}, {{0.0F}}, {{0.0F}}}};

    tumble_magnetometer_record compass = {1, {model, {0.0F, 0.0F, 0.0F}}, {{0.0F}}, {0.0F}, false};
    tumble_magnetometer_correction field;
    ANSWERS(TUMBLE_OK, tumble_magnetometer_correction_init(&field, &compass.magnetometer));

    const tumble_status answers[] = {
        tumble_magnetometer_correction_init(NULL, &compass.magnetometer),
        tumble_magnetometer_correction_init(&field, NULL),
        tumble_magnetometer_correction_apply(NULL, three, 0.0F, three),
        tumble_magnetometer_correction_apply(&field, NULL, 0.0F, three),
        tumble_magnetometer_correction_apply(&field, three, 0.0F, NULL),
        tumble_magnetometer_encode(NULL, bytes, sizeof bytes),
        tumble_magnetometer_encode(&compass, NULL, sizeof bytes),
        tumble_magnetometer_decode(NULL, TUMBLE_MAGNETOMETER_BYTES, &compass),
        tumble_magnetometer_decode(bytes, TUMBLE_MAGNETOMETER_BYTES, NULL),
        tumble_correction_init(NULL, &calibration),
        tumble_correction_init(&correction, NULL),
        tumble_correction_from_records(NULL, &record, &record),
        tumble_correction_from_records(&correction, NULL, &record),
        tumble_correction_from_records(&correction, &record, NULL),
        tumble_correction_apply(NULL, &sample, &sample),
        tumble_correction_apply(&correction, NULL, &sample),
        tumble_correction_apply(&correction, &sample, NULL),
        tumble_error_model_measure(NULL, three, three),
        tumble_error_model_measure(&model, NULL, three),
        tumble_error_model_measure(&model, three, NULL),
        tumble_temperature_drift_remove(NULL, three, 30.0F, three, three),
        tumble_temperature_drift_remove(&drift.drift, NULL, 30.0F, three, three),
        tumble_temperature_drift_remove(&drift.drift, three, 30.0F, NULL, three),
        tumble_temperature_drift_remove(&drift.drift, three, 30.0F, three, NULL),
        tumble_error_model_decompose(NULL, &parts),
        tumble_error_model_decompose(&model, NULL),
        tumble_spin_defaults(NULL),
        tumble_spin_defaults_for_grade(NULL, TUMBLE_GRADE_CONSUMER),
        tumble_spin_init(NULL, sizeof *spin, &spin_settings),
        tumble_spin_init(spin, sizeof *spin, NULL),
        tumble_spin_start(NULL),
        tumble_spin_push(NULL, &sample, TUMBLE_WHEELS_UNKNOWN, NULL),
        tumble_spin_push(spin, NULL, TUMBLE_WHEELS_UNKNOWN, NULL),
        tumble_spin_tick(NULL, 0, NULL),
        tumble_spin_work(NULL, NULL),
        tumble_spin_get_state(NULL, &state),
        tumble_spin_get_state(spin, NULL),
        tumble_spin_get_progress(NULL, &progress),
        tumble_spin_get_progress(spin, NULL),
        tumble_spin_solve(NULL, NULL, &estimate, NULL),
        tumble_spin_solve(spin, NULL, NULL, NULL),
        tumble_record_from_spin(NULL, 1, TUMBLE_SENSOR_GYROSCOPE, &estimate),
        tumble_record_from_spin(&record, 1, TUMBLE_SENSOR_GYROSCOPE, NULL),
        tumble_redundancy_defaults(NULL),
        tumble_redundancy_check(NULL, NULL, 0),
        tumble_redundancy_seal(NULL, &seal),
        tumble_redundancy_seal(&settings, NULL),
        tumble_redundancy_init_sealed(monitor, sizeof *monitor, NULL, 0, NULL, &unit, TUMBLE_UNITS),
        tumble_unit_defaults(NULL, 1),
        tumble_redundancy_init(monitor, sizeof *monitor, &settings, NULL, NULL, TUMBLE_UNITS),
        tumble_redundancy_init(NULL, sizeof *monitor, &settings, NULL, &unit, TUMBLE_UNITS),
        begin(monitor, NULL),
        tumble_redundancy_push(NULL, 0, &sample, NULL, NULL, NULL),
        tumble_redundancy_push(monitor, 0, NULL, NULL, NULL, NULL),
        tumble_redundancy_aiding(NULL, 0, &aiding, NULL, NULL),
        tumble_redundancy_aiding(monitor, 0, NULL, NULL, NULL),
        tumble_redundancy_set_temperature(NULL, 0, 20.0f),
        tumble_redundancy_command(NULL, TUMBLE_COMMAND_EVALUATE),
        tumble_redundancy_get_source(NULL, &number),
        tumble_redundancy_get_source(monitor, NULL),
        tumble_redundancy_get_stored(NULL, 1, TUMBLE_SENSOR_GYROSCOPE, &knowledge),
        tumble_redundancy_get_stored(monitor, 1, TUMBLE_SENSOR_GYROSCOPE, NULL),
        tumble_redundancy_restore(NULL, &record, NULL, NULL),
        tumble_redundancy_restore(monitor, NULL, NULL, NULL),
        tumble_redundancy_restore_from(NULL, store, NULL, NULL),
        tumble_redundancy_restore_from(monitor, NULL, NULL, NULL),
        tumble_record_encode(NULL, bytes, sizeof bytes, &length),
        tumble_record_encode(&record, NULL, sizeof bytes, &length),
        tumble_record_encode(&record, bytes, sizeof bytes, NULL),
        tumble_record_decode(NULL, TUMBLE_RECORD_BYTES, &record),
        tumble_record_decode(bytes, TUMBLE_RECORD_BYTES, NULL),
        tumble_drift_encode(NULL, bytes, sizeof bytes),
        tumble_drift_encode(&drift, NULL, sizeof bytes),
        tumble_drift_decode(NULL, TUMBLE_DRIFT_BYTES, &drift),
        tumble_drift_decode(bytes, TUMBLE_DRIFT_BYTES, NULL),
        tumble_store_load_drift(NULL, 1, TUMBLE_SENSOR_GYROSCOPE, &drift.drift),
        tumble_store_load_drift(store, 1, TUMBLE_SENSOR_GYROSCOPE, NULL),
        tumble_store_save_drift(NULL, 0, &drift, NULL),
        tumble_store_save_drift(store, 0, NULL, NULL),
        tumble_store_load_magnetometer(NULL, 1, TUMBLE_WHICH_LAST, &compass),
        tumble_store_load_magnetometer(store, 1, TUMBLE_WHICH_LAST, NULL),
        tumble_store_save_magnetometer(NULL, 0, &compass, NULL),
        tumble_store_save_magnetometer(store, 0, NULL, NULL),
        tumble_store_save_factory_magnetometer(store, 0, NULL, NULL),
        tumble_store_roll_back_magnetometer(NULL, 0, 1, TUMBLE_WHICH_FACTORY, NULL, NULL),
        tumble_store_init(NULL, sizeof *store, &driver, FLASH_START, 2 * PAGE, NULL),
        tumble_store_init(store, sizeof *store, NULL, FLASH_START, 2 * PAGE, NULL),
        tumble_store_get_entries(NULL, &number),
        tumble_store_get_entries(store, NULL),
        tumble_store_load(NULL, 1, TUMBLE_SENSOR_GYROSCOPE, TUMBLE_WHICH_LAST, &record),
        tumble_store_load(store, 1, TUMBLE_SENSOR_GYROSCOPE, TUMBLE_WHICH_LAST, NULL),
        tumble_store_save(NULL, 0, &record, NULL),
        tumble_store_save(store, 0, NULL, NULL),
        tumble_store_save_factory(NULL, 0, &record, NULL),
        tumble_store_save_factory(store, 0, NULL, NULL),
        tumble_store_roll_back(NULL, 0, 1, TUMBLE_SENSOR_GYROSCOPE, TUMBLE_WHICH_LAST, NULL, NULL),
        tumble_store_erase(NULL),
    };
    for (size_t i = 0; i < sizeof answers / sizeof answers[0]; ++i) {
        if (answers[i] != TUMBLE_ERROR_NULL) {
            fprintf(stderr, "call %u: %s\n", (unsigned)i, tumble_strerror(answers[i]));
        }
        CHECK(answers[i] == TUMBLE_ERROR_NULL);
    }
    free(spin);
    free(monitor);
    free(store);
}

static void storage_of_another_size_is_refused(void)
{
    tumble_spin *spin = NEW(tumble_spin);
    tumble_redundancy *monitor = NEW(tumble_redundancy);
    tumble_store *store = NEW(tumble_store);
    tumble_spin_settings spin_settings;
    tumble_redundancy_settings settings;
    tumble_unit units[TUMBLE_UNITS + 1];
    ANSWERS(TUMBLE_OK, tumble_spin_defaults(&spin_settings));
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    for (int i = 0; i <= TUMBLE_UNITS; ++i) {
        ANSWERS(TUMBLE_OK, tumble_unit_defaults(&units[i], (uint64_t)i + 1));
    }
    ram_flash flash;
    const tumble_flash driver = ram_flash_driver(&flash);
    ANSWERS(TUMBLE_ERROR_SIZE, tumble_spin_init(spin, sizeof *spin - 8, &spin_settings));
    ANSWERS(TUMBLE_ERROR_SIZE,
            tumble_redundancy_init(monitor, sizeof *monitor + 8, &settings, NULL, units, TUMBLE_UNITS));
    ANSWERS(TUMBLE_ERROR_SIZE,
            tumble_store_init(store, sizeof *store - 1, &driver, FLASH_START, 2 * PAGE, NULL));
    for (size_t other = TUMBLE_UNITS - 1; other <= TUMBLE_UNITS + 1; other += 2) {
        ANSWERS(TUMBLE_ERROR_UNITS,
                tumble_redundancy_init(monitor, sizeof *monitor, &settings, NULL, units, other));
    }
    free(spin);
    free(monitor);
    free(store);
}

static void storage_that_was_not_initialised_is_refused(void)
{
    /* Whatever fills it, and if it is another's: a spin given for a monitor is a mistake casts make. */
    for (int fill = 0; fill < 256; ++fill) {
        tumble_spin *spin = NEW(tumble_spin);
        tumble_redundancy *monitor = NEW(tumble_redundancy);
        tumble_store *store = NEW(tumble_store);
        memset(spin, fill, sizeof *spin);
        memset(monitor, fill, sizeof *monitor);
        memset(store, fill, sizeof *store);
        tumble_record record = example_record();
        uint32_t number = 0;
        tumble_spin_progress progress;
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_spin_start(spin));
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_spin_push(spin, &SAMPLE, TUMBLE_WHEELS_UNKNOWN, NULL));
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_spin_get_progress(spin, &progress));
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_redundancy_push(monitor, 0, &SAMPLE, NULL, NULL, NULL));
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_redundancy_set_temperature(monitor, 0, 20.0f));
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_redundancy_get_source(monitor, &number));
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_redundancy_restore(monitor, &record, NULL, NULL));
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_store_save(store, 0, &record, NULL));
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_store_get_entries(store, &number));
        tumble_redundancy_settings settings;
        ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
        ANSWERS(TUMBLE_OK, begin(monitor, &settings));
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_redundancy_restore_from(monitor, store, NULL, NULL));
        ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_spin_start((tumble_spin *)(void *)monitor));
        free(spin);
        free(monitor);
        free(store);
    }
}

static void settings_that_cannot_be_are_refused(void)
{
    tumble_spin *spin = NEW(tumble_spin);
    tumble_spin_settings spin_settings;
    ANSWERS(TUMBLE_OK, tumble_spin_defaults(&spin_settings));
    spin_settings.largest_step = NAN;
    ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_spin_init(spin, sizeof *spin, &spin_settings));
    ANSWERS(TUMBLE_OK, tumble_spin_defaults(&spin_settings));
    spin_settings.gravity = 0.0F;
    ANSWERS(TUMBLE_ERROR_SETTING, tumble_spin_init(spin, sizeof *spin, &spin_settings));
    ANSWERS(TUMBLE_OK, tumble_spin_defaults(&spin_settings));
    spin_settings.block = 0;
    ANSWERS(TUMBLE_ERROR_SETTING, tumble_spin_init(spin, sizeof *spin, &spin_settings));
    ANSWERS(TUMBLE_OK, tumble_spin_defaults(&spin_settings));
    spin_settings.still_timeout = spin_settings.still;
    ANSWERS(TUMBLE_ERROR_SETTING, tumble_spin_init(spin, sizeof *spin, &spin_settings));
    ANSWERS(TUMBLE_ERROR_NOT_INITIALISED, tumble_spin_start(spin));
    free(spin);

    tumble_redundancy *monitor = NEW(tumble_redundancy);
    tumble_redundancy_settings settings;
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    ANSWERS(TUMBLE_OK, tumble_redundancy_check(&settings, NULL, 0));
    char nothing[] = "words of before";
    ANSWERS(TUMBLE_OK, tumble_redundancy_check(&settings, nothing, sizeof nothing));
    CHECK(nothing[0] == '\0');
    settings.rest_specific_force_scatter = NAN;
    ANSWERS(TUMBLE_ERROR_CONTRADICTION, begin(monitor, &settings));
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    settings.gate = (tumble_gate)3;
    ANSWERS(TUMBLE_ERROR_CODE, begin(monitor, &settings));
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    settings.rest_duration = settings.window;
    ANSWERS(TUMBLE_ERROR_CONTRADICTION, begin(monitor, &settings));
    /* With every amount of room, words are as long as there is room for, and end. */
    const char *words = "rest_duration has to be longer than window";
    for (size_t room = 0; room < 60; ++room) {
        char *text = (char *)new_storage(room + 1);
        ANSWERS(TUMBLE_ERROR_CONTRADICTION, tumble_redundancy_check(&settings, text, room));
        CHECK(room == 0 || strlen(text) == (room <= strlen(words) ? room - 1 : strlen(words)));
        CHECK(room == 0 || strncmp(text, words, strlen(text)) == 0);
        free(text);
    }
    free(monitor);
}

static void sealed_settings_are_taken_by_their_seal_alone(void)
{
    tumble_redundancy *monitor = NEW(tumble_redundancy);
    tumble_redundancy_settings settings;
    tumble_unit units[TUMBLE_UNITS];
    uint32_t seal;
    for (int i = 0; i < TUMBLE_UNITS; ++i) {
        ANSWERS(TUMBLE_OK, tumble_unit_defaults(&units[i], (uint64_t)i + 1));
    }
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    settings.noise_ratio += 1.0F;
    ANSWERS(TUMBLE_OK, tumble_redundancy_seal(&settings, &seal));
    for (int bit = 0; bit < 32; ++bit) {
        ANSWERS(TUMBLE_ERROR_CONTRADICTION,
                tumble_redundancy_init_sealed(monitor, sizeof *monitor, &settings, seal ^ (1U << bit), NULL, units,
                                              TUMBLE_UNITS));
    }
    ANSWERS(TUMBLE_OK,
            tumble_redundancy_init_sealed(monitor, sizeof *monitor, &settings, seal, NULL, units, TUMBLE_UNITS));
    settings.calibrated_only = !settings.calibrated_only;
    ANSWERS(TUMBLE_ERROR_CONTRADICTION,
            tumble_redundancy_init_sealed(monitor, sizeof *monitor, &settings, seal, NULL, units, TUMBLE_UNITS));
    settings.rest_duration = settings.window;
    ANSWERS(TUMBLE_ERROR_CONTRADICTION, tumble_redundancy_seal(&settings, &seal));
    free(monitor);
}

static void units_that_cannot_be_are_refused(void)
{
    tumble_redundancy *monitor = NEW(tumble_redundancy);
    tumble_redundancy_settings settings;
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    const struct {
        tumble_status answer;
        int unit;
        int what;
    } mistakes[] = {
        {TUMBLE_ERROR_PRIMARY, 0, 0},    {TUMBLE_OK, 1, 0},
        {TUMBLE_ERROR_SETTING, 1, 1},    {TUMBLE_ERROR_MOUNTING, 1, 2},
        {TUMBLE_ERROR_NOT_FINITE, 1, 3}, {TUMBLE_ERROR_SAME_IDENTITY, 1, 4},
        {TUMBLE_ERROR_SETTING, 1, 5},    {TUMBLE_ERROR_NOT_FINITE, 1, 6},
    };
    for (size_t i = 0; i < sizeof mistakes / sizeof mistakes[0]; ++i) {
        tumble_unit units[TUMBLE_UNITS];
        for (int j = 0; j < TUMBLE_UNITS; ++j) {
            ANSWERS(TUMBLE_OK, tumble_unit_defaults(&units[j], (uint64_t)j + 1));
        }
        tumble_unit *unit = &units[mistakes[i].unit];
        switch (mistakes[i].what) {
        case 0:
            unit->axes = 0;
            break;
        case 1:
            unit->axes = 0x40;
            break;
        case 2:
            unit->sensor_from_primary[0][0] = -1.0F;
            break;
        case 3:
            unit->sensor_from_primary[2][1] = NAN;
            break;
        case 4:
            unit->identity = 1;
            break;
        case 5:
            unit->angular_rate_range = -1.0F;
            break;
        default:
            unit->lever_arm_known = true;
            unit->lever_arm[2] = INFINITY;
            break;
        }
        ANSWERS(mistakes[i].answer,
                tumble_redundancy_init(monitor, sizeof *monitor, &settings, NULL, units, TUMBLE_UNITS));
    }
    ANSWERS(TUMBLE_OK, begin(monitor, &settings));
    ANSWERS(TUMBLE_ERROR_NO_SUCH_UNIT,
            tumble_redundancy_push(monitor, TUMBLE_UNITS, &SAMPLE, NULL, NULL, NULL));
    ANSWERS(TUMBLE_ERROR_NO_SUCH_UNIT, tumble_redundancy_set_temperature(monitor, TUMBLE_UNITS, 20.0f));
    ANSWERS(TUMBLE_OK, tumble_redundancy_set_temperature(monitor, 1, NAN));
    tumble_knowledge knowledge;
    ANSWERS(TUMBLE_ERROR_NO_SUCH_UNIT,
            tumble_redundancy_get_stored(monitor, UINT32_MAX, TUMBLE_SENSOR_GYROSCOPE, &knowledge));
    ANSWERS(TUMBLE_ERROR_CODE, tumble_redundancy_get_stored(monitor, 1, (tumble_sensor)2, &knowledge));
    ANSWERS(TUMBLE_ERROR_CODE, tumble_redundancy_command(monitor, (tumble_command)2));
    free(monitor);
}

static void readings_that_are_no_numbers_do_no_harm(void)
{
    tumble_spin *spin = NEW(tumble_spin);
    tumble_spin_settings spin_settings;
    ANSWERS(TUMBLE_OK, tumble_spin_defaults(&spin_settings));
    ANSWERS(TUMBLE_OK, tumble_spin_init(spin, sizeof *spin, &spin_settings));
    ANSWERS(TUMBLE_OK, tumble_spin_start(spin));
    tumble_redundancy *monitor = NEW(tumble_redundancy);
    tumble_redundancy_settings settings;
    ANSWERS(TUMBLE_OK, tumble_redundancy_defaults(&settings));
    ANSWERS(TUMBLE_OK, begin(monitor, &settings));
    const float bad[4] = {NAN, INFINITY, -INFINITY, 3.4e38F};
    for (uint64_t k = 0; k < 4000; ++k) {
        tumble_sample sample = SAMPLE;
        sample.time = k * 5000;
        float *channels = k % 2 == 0 ? sample.specific_force : sample.angular_rate;
        channels[k % 3] = bad[k % 4];
        const tumble_status expected = k % 4 == 3 ? TUMBLE_OK : TUMBLE_ERROR_NOT_FINITE;
        ANSWERS(expected, tumble_spin_push(spin, &sample, TUMBLE_WHEELS_UNKNOWN, NULL));
        tumble_output output;
        ANSWERS(TUMBLE_OK,
                tumble_redundancy_push(monitor, (uint32_t)(k % TUMBLE_UNITS), &sample, NULL, NULL, &output));
        CHECK(output.source == TUMBLE_NO_SOURCE ||
              (isfinite(output.specific_force[0]) && isfinite(output.angular_rate[0])));
    }
    ANSWERS(TUMBLE_ERROR_CODE, tumble_spin_push(spin, &SAMPLE, (tumble_wheels)3, NULL));
    tumble_spin_estimate estimate;
    const tumble_spin_true_angle angle = {NAN, 0.0F, 0.1F};
    ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_spin_solve(spin, &angle, &estimate, NULL));
    const tumble_spin_true_angle certain = {1.0F, 0.0F, 0.0F};
    ANSWERS(TUMBLE_ERROR_SETTING, tumble_spin_solve(spin, &certain, &estimate, NULL));
    free(spin);
    free(monitor);
}

static void a_pointer_that_is_not_aligned_is_refused(void)
{
    unsigned char *bytes = (unsigned char *)new_storage(sizeof(tumble_redundancy) + 8);
    void *crooked = bytes + 1;
    tumble_spin_settings settings;
    ANSWERS(TUMBLE_OK, tumble_spin_defaults(&settings));
    ANSWERS(TUMBLE_ERROR_UNALIGNED, tumble_spin_init((tumble_spin *)crooked, sizeof(tumble_spin), &settings));
    ANSWERS(TUMBLE_ERROR_UNALIGNED, tumble_spin_start((tumble_spin *)crooked));
    tumble_sample sample = SAMPLE;
    ANSWERS(TUMBLE_ERROR_UNALIGNED,
            tumble_redundancy_push((tumble_redundancy *)crooked, 0, &sample, NULL, NULL, NULL));
    ANSWERS(TUMBLE_ERROR_UNALIGNED, tumble_store_erase((tumble_store *)crooked));
    uint8_t encoded[TUMBLE_RECORD_BYTES];
    size_t length = 0;
    const tumble_record record = example_record();
    ANSWERS(TUMBLE_ERROR_UNALIGNED,
            tumble_record_encode((const tumble_record *)crooked, encoded, sizeof encoded, &length));
    ANSWERS(TUMBLE_OK, tumble_record_encode(&record, encoded, sizeof encoded, &length));
    ANSWERS(TUMBLE_ERROR_UNALIGNED, tumble_record_decode(encoded, length, (tumble_record *)crooked));
    /* A pointer that may be null may all the same not be unaligned. */
    tumble_spin *spin = NEW(tumble_spin);
    ANSWERS(TUMBLE_OK, tumble_spin_init(spin, sizeof *spin, &settings));
    ANSWERS(TUMBLE_ERROR_UNALIGNED,
            tumble_spin_push(spin, &sample, TUMBLE_WHEELS_UNKNOWN, (tumble_spin_event *)crooked));
    free(spin);
    free(bytes);
}

static void every_status_has_words_of_its_own(void)
{
    const char *none = tumble_strerror((tumble_status)(TUMBLE_ERROR_NOTHING_STORED + 1));
    CHECK(strcmp(none, tumble_strerror((tumble_status)UINT32_MAX)) == 0);
    for (uint32_t a = 0; a <= TUMBLE_ERROR_NOTHING_STORED; ++a) {
        CHECK(strlen(tumble_strerror((tumble_status)a)) > 0);
        CHECK(strcmp(tumble_strerror((tumble_status)a), none) != 0);
        for (uint32_t b = 0; b < a; ++b) {
            CHECK(strcmp(tumble_strerror((tumble_status)a), tumble_strerror((tumble_status)b)) != 0);
        }
    }
}

const law refusal_laws[] = {
    {"null is refused everywhere", null_is_refused_everywhere},
    {"storage of another size, and another number of units, are refused", storage_of_another_size_is_refused},
    {"storage that was not initialised, or is another's, is refused", storage_that_was_not_initialised_is_refused},
    {"settings that cannot be are refused, in words", settings_that_cannot_be_are_refused},
    {"sealed settings are taken by their seal alone", sealed_settings_are_taken_by_their_seal_alone},
    {"units that cannot be are refused", units_that_cannot_be_are_refused},
    {"readings that are no numbers do no harm", readings_that_are_no_numbers_do_no_harm},
    {"a pointer that is not aligned is refused", a_pointer_that_is_not_aligned_is_refused},
    {"every status has words of its own", every_status_has_words_of_its_own},
    {NULL, NULL},
};
