/* Records in flash. */

#include <math.h>
#include <string.h>

#include "laws.h"
#include "ram_flash.h"
#include "records.h"

static const uint64_t IDENTITY = UINT64_C(0x0123456789ABCDEF);

static tumble_status load(tumble_store *store, tumble_which which, tumble_record *record)
{
    return tumble_store_load(store, IDENTITY, TUMBLE_SENSOR_ACCELEROMETER, which, record);
}

static void expect(tumble_store *store, tumble_which which, uint32_t sequence)
{
    tumble_record read;
    ANSWERS(TUMBLE_OK, load(store, which, &read));
    const tumble_record written = record_of(TUMBLE_SENSOR_ACCELEROMETER, sequence);
    CHECK(same_record(&read, &written));
}

static tumble_status save(tumble_store *store, uint32_t sequence)
{
    const tumble_record record = record_of(TUMBLE_SENSOR_ACCELEROMETER, sequence);
    return tumble_store_save(store, sequence, &record, NULL);
}

static void keeps_last_previous_and_factory(void)
{
    ram_flash flash;
    ram_flash_erase(&flash);
    tumble_store *store = ram_flash_open(&flash);
    tumble_record read;
    uint32_t entries = 0;
    ANSWERS(TUMBLE_OK, tumble_store_get_entries(store, &entries));
    CHECK(entries == 21);
    ANSWERS(TUMBLE_ERROR_NOTHING_STORED, load(store, TUMBLE_WHICH_IN_FORCE, &read));
    const tumble_record factory = record_of(TUMBLE_SENSOR_ACCELEROMETER, 1);
    ANSWERS(TUMBLE_OK, tumble_store_save_factory(store, 0, &factory, NULL));
    expect(store, TUMBLE_WHICH_IN_FORCE, 1);
    ANSWERS(TUMBLE_ERROR_NOTHING_STORED, load(store, TUMBLE_WHICH_LAST, &read));
    ANSWERS(TUMBLE_ERROR_NOTHING_STORED,
            tumble_store_roll_back(store, 0, IDENTITY, TUMBLE_SENSOR_ACCELEROMETER, TUMBLE_WHICH_PREVIOUS, NULL,
                                   NULL));
    /* More than a bank holds. */
    for (uint32_t sequence = 2; sequence < 60; ++sequence) {
        ANSWERS(TUMBLE_OK, save(store, sequence));
        expect(store, TUMBLE_WHICH_IN_FORCE, sequence);
        expect(store, TUMBLE_WHICH_FACTORY, 1);
        if (sequence > 2) {
            expect(store, TUMBLE_WHICH_PREVIOUS, sequence - 1);
        }
    }
    ANSWERS(TUMBLE_OK, tumble_store_roll_back(store, 60, IDENTITY, TUMBLE_SENSOR_ACCELEROMETER,
                                              TUMBLE_WHICH_PREVIOUS, &read, NULL));
    CHECK(read.sequence == 58);
    expect(store, TUMBLE_WHICH_IN_FORCE, 58);
    ANSWERS(TUMBLE_OK, tumble_store_roll_back(store, 61, IDENTITY, TUMBLE_SENSOR_ACCELEROMETER,
                                              TUMBLE_WHICH_FACTORY, NULL, NULL));
    expect(store, TUMBLE_WHICH_IN_FORCE, 1);
    expect(store, TUMBLE_WHICH_PREVIOUS, 58);
    ANSWERS(TUMBLE_OK, tumble_store_erase(store));
    ANSWERS(TUMBLE_ERROR_NOTHING_STORED, load(store, TUMBLE_WHICH_FACTORY, &read));
    free(store);
}

static tumble_drift_record some_drift(void)
{
    const tumble_drift_record record = {
        IDENTITY,
        TUMBLE_SENSOR_ACCELEROMETER,
        {25.0F, {-20.0F, 70.0F}, {{0.001F, 0.0F, -0.002F}, {0.0F, 1e-5F, 0.0F}}, {{1e-5F, 0.0F, 0.0F}}}};
    return record;
}

static void keeps_what_temperature_does_beside_the_records(void)
{
    ram_flash flash;
    ram_flash_erase(&flash);
    tumble_store *store = ram_flash_open(&flash);
    tumble_temperature_drift read;
    ANSWERS(TUMBLE_ERROR_NOTHING_STORED,
            tumble_store_load_drift(store, IDENTITY, TUMBLE_SENSOR_ACCELEROMETER, &read));
    const tumble_drift_record written = some_drift();
    ANSWERS(TUMBLE_OK, tumble_store_save_drift(store, 0, &written, NULL));
    for (uint32_t sequence = 1; sequence < 60; ++sequence) {
        ANSWERS(TUMBLE_OK, save(store, sequence));
    }
    ANSWERS(TUMBLE_OK, tumble_store_load_drift(store, IDENTITY, TUMBLE_SENSOR_ACCELEROMETER, &read));
    CHECK(memcmp(&read, &written.drift, sizeof read) == 0);
    tumble_drift_record spoilt = written;
    spoilt.drift.reference = 90.0F;
    ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_store_save_drift(store, 0, &spoilt, NULL));
    free(store);
}

static tumble_magnetometer_record compass_of(float hard_iron)
{
    tumble_magnetometer_record record = {
        IDENTITY,
        {{{{1.0F, 0.0F, 0.0F}, {0.0F, 1.25F, 0.0F}, {0.0F, 0.0F, 1.0F}}, {0.0F, 12.0F, 0.0F}}, {0.5F, 0.0F, 0.0F}},
        {{0.001F, 0.001F, 0.001F}, {0.001F, 0.001F, 0.001F}, {0.001F, 0.001F, 0.001F}},
        {0.125F, 0.125F, 0.125F},
        true};
    record.magnetometer.error.bias[0] = hard_iron;
    return record;
}

static void expect_compass(tumble_store *store, tumble_which which, float hard_iron)
{
    tumble_magnetometer_record read;
    const tumble_magnetometer_record written = compass_of(hard_iron);
    ANSWERS(TUMBLE_OK, tumble_store_load_magnetometer(store, IDENTITY, which, &read));
    CHECK(memcmp(&read, &written, offsetof(tumble_magnetometer_record, of_throttle)) == 0 && read.of_throttle);
}

static void keeps_a_magnetometer_beside_the_other_sensors(void)
{
    ram_flash flash;
    ram_flash_erase(&flash);
    tumble_store *store = ram_flash_open(&flash);
    tumble_magnetometer_record compass = compass_of(1.0F);
    ANSWERS(TUMBLE_ERROR_NOTHING_STORED,
            tumble_store_load_magnetometer(store, IDENTITY, TUMBLE_WHICH_IN_FORCE, &compass));
    ANSWERS(TUMBLE_OK, tumble_store_save_factory_magnetometer(store, 0, &compass, NULL));
    expect_compass(store, TUMBLE_WHICH_IN_FORCE, 1.0F);
    for (int number = 2; number < 4; ++number) {
        compass = compass_of((float)number);
        ANSWERS(TUMBLE_OK, tumble_store_save_magnetometer(store, 0, &compass, NULL));
    }
    for (uint32_t sequence = 1; sequence < 60; ++sequence) {
        ANSWERS(TUMBLE_OK, save(store, sequence));
    }
    expect_compass(store, TUMBLE_WHICH_FACTORY, 1.0F);
    expect_compass(store, TUMBLE_WHICH_PREVIOUS, 2.0F);
    expect_compass(store, TUMBLE_WHICH_IN_FORCE, 3.0F);
    expect(store, TUMBLE_WHICH_IN_FORCE, 59);
    ANSWERS(TUMBLE_ERROR_CODE, tumble_store_roll_back_magnetometer(store, 0, IDENTITY, TUMBLE_WHICH_IN_FORCE, NULL, NULL));
    ANSWERS(TUMBLE_OK, tumble_store_roll_back_magnetometer(store, 0, IDENTITY, TUMBLE_WHICH_PREVIOUS, &compass, NULL));
    CHECK(compass.magnetometer.error.bias[0] == 2.0F);
    expect_compass(store, TUMBLE_WHICH_IN_FORCE, 2.0F);
    compass.bias_sigma[1] = NAN;
    ANSWERS(TUMBLE_ERROR_NOT_FINITE, tumble_store_save_magnetometer(store, 0, &compass, NULL));
    free(store);
}

static void a_drift_is_a_record_of_its_own(void)
{
    const tumble_drift_record written = some_drift();
    uint8_t bytes[TUMBLE_DRIFT_BYTES];
    tumble_drift_record read;
    tumble_record error;
    ANSWERS(TUMBLE_ERROR_NO_ROOM, tumble_drift_encode(&written, bytes, sizeof bytes - 1));
    ANSWERS(TUMBLE_OK, tumble_drift_encode(&written, bytes, sizeof bytes));
    ANSWERS(TUMBLE_OK, tumble_drift_decode(bytes, sizeof bytes, &read));
    CHECK(read.identity == IDENTITY && read.sensor == TUMBLE_SENSOR_ACCELEROMETER);
    CHECK(memcmp(&read.drift, &written.drift, sizeof read.drift) == 0);
    ANSWERS(TUMBLE_ERROR_NOT_A_RECORD, tumble_record_decode(bytes, sizeof bytes, &error));
    bytes[20] ^= 1;
    ANSWERS(TUMBLE_ERROR_CORRUPT, tumble_drift_decode(bytes, sizeof bytes, &read));
}

/* After a cut, the old or the new record is in force, whole; and the store goes on. Gives which. */
static uint32_t whole_after_cut(ram_flash *flash, uint32_t old)
{
    ram_flash_power(flash);
    tumble_store *store = ram_flash_open(flash);
    tumble_record read;
    memset(&read, 0, sizeof read);
    ANSWERS(TUMBLE_OK, load(store, TUMBLE_WHICH_IN_FORCE, &read));
    CHECK(read.sequence == old || read.sequence == old + 1);
    expect(store, TUMBLE_WHICH_IN_FORCE, read.sequence);
    ANSWERS(TUMBLE_OK, save(store, old + 2));
    expect(store, TUMBLE_WHICH_IN_FORCE, old + 2);
    free(store);
    return read.sequence;
}

/* Cuts power at every byte of an update, and at every page that it erases, leaving each kind of remains. */
static void cut_everywhere(const ram_flash *before, uint32_t old)
{
    ram_flash flash = *before;
    tumble_store *store = ram_flash_open(&flash);
    ANSWERS(TUMBLE_OK, save(store, old + 1));
    free(store);
    const long bytes = flash.written;
    const long pages = flash.erased;
    long kept_old = 0;
    for (long cut = 0; cut < bytes + 4 * pages; ++cut) {
        flash = *before;
        if (cut < bytes) {
            flash.cut_after_bytes = cut;
        } else {
            flash.cut_after_pages = (cut - bytes) / 4;
            flash.remains = (int)((cut - bytes) % 4);
        }
        store = ram_flash_open(&flash);
        ANSWERS(TUMBLE_ERROR_FLASH, save(store, old + 1));
        free(store);
        kept_old += whole_after_cut(&flash, old) == old;
    }
    CHECK(bytes > 0 && kept_old > 0);
}

static void a_power_cut_leaves_the_old_or_the_new_record(void)
{
    ram_flash flash;
    ram_flash_erase(&flash);
    tumble_store *store = ram_flash_open(&flash);
    ANSWERS(TUMBLE_OK, save(store, 1));
    long turnovers = 0;
    for (uint32_t old = 1; old < 24; ++old) {
        ram_flash_power(&flash);
        ram_flash next = flash;
        tumble_store *trial = ram_flash_open(&next);
        ANSWERS(TUMBLE_OK, save(trial, old + 1));
        free(trial);
        /* Updates within a bank are all alike; the ones that turn over are not. */
        if (old == 1 || next.erased > 0) {
            cut_everywhere(&flash, old);
            turnovers += next.erased > 0;
        }
        memcpy(flash.bytes, next.bytes, sizeof flash.bytes);
    }
    CHECK(turnovers > 0);
    free(store);
}

static void writing_too_often_is_refused_with_the_time_to_wait(void)
{
    ram_flash flash;
    ram_flash_erase(&flash);
    const tumble_flash driver = ram_flash_driver(&flash);
    const tumble_write_limit limit = {1000, 2};
    tumble_store *store = NEW(tumble_store);
    ANSWERS(TUMBLE_OK, tumble_store_init(store, sizeof *store, &driver, FLASH_START, PAGE * PAGES, &limit));
    const tumble_record records[3] = {record_of(TUMBLE_SENSOR_ACCELEROMETER, 1),
                                      record_of(TUMBLE_SENSOR_ACCELEROMETER, 2),
                                      record_of(TUMBLE_SENSOR_ACCELEROMETER, 3)};
    uint64_t wait = 0;
    ANSWERS(TUMBLE_OK, tumble_store_save(store, 5000, &records[0], &wait));
    ANSWERS(TUMBLE_OK, tumble_store_save(store, 5000, &records[1], &wait));
    CHECK(wait == 0);
    ANSWERS(TUMBLE_OK, tumble_store_save(store, 5000, &records[1], &wait));
    ANSWERS(TUMBLE_ERROR_TOO_SOON, tumble_store_save(store, 5000, &records[2], &wait));
    CHECK(wait == 1000);
    expect(store, TUMBLE_WHICH_IN_FORCE, 2);
    ANSWERS(TUMBLE_OK, tumble_store_save(store, 5000 + wait, &records[2], NULL));
    free(store);
}

static void flash_that_cannot_be_is_refused(void)
{
    ram_flash flash;
    ram_flash_erase(&flash);
    const tumble_flash driver = ram_flash_driver(&flash);
    tumble_store *store = NEW(tumble_store);
    const size_t size = sizeof *store;
    const struct {
        tumble_status answer;
        uint32_t page;
        uint32_t start;
        uint32_t length;
    } ranges[] = {
        {TUMBLE_OK, PAGE, FLASH_START, 2 * PAGE},
        {TUMBLE_OK, 1024, FLASH_START, 2 * 1024},
        {TUMBLE_ERROR_PAGES, PAGE, FLASH_START + 32, 2 * PAGE},
        {TUMBLE_ERROR_PAGES, PAGE, FLASH_START, 3 * PAGE},
        {TUMBLE_ERROR_PAGES, PAGE, FLASH_START, PAGE},
        {TUMBLE_ERROR_PAGES, PAGE, FLASH_START, 2 * PAGE + 1},
        {TUMBLE_ERROR_PAGES, 0, FLASH_START, 2 * PAGE},
        {TUMBLE_ERROR_PAGES, 100, 0, 2000},
        {TUMBLE_ERROR_BOUNDS, PAGE, FLASH_START, 0},
        {TUMBLE_ERROR_BOUNDS, PAGE, UINT32_MAX - PAGE + 1, 2 * PAGE},
        {TUMBLE_ERROR_TOO_SMALL, 256, FLASH_START, 1024},
    };
    for (size_t i = 0; i < sizeof ranges / sizeof ranges[0]; ++i) {
        tumble_flash other = driver;
        other.page = ranges[i].page;
        ANSWERS(ranges[i].answer,
                tumble_store_init(store, size, &other, ranges[i].start, ranges[i].length, NULL));
    }
    tumble_flash other = driver;
    other.read = NULL;
    ANSWERS(TUMBLE_ERROR_NO_DRIVER, tumble_store_init(store, size, &other, FLASH_START, 2 * PAGE, NULL));
    other = driver;
    other.write = NULL;
    ANSWERS(TUMBLE_ERROR_NO_DRIVER, tumble_store_init(store, size, &other, FLASH_START, 2 * PAGE, NULL));
    other = driver;
    other.erase = NULL;
    ANSWERS(TUMBLE_ERROR_NO_DRIVER, tumble_store_init(store, size, &other, FLASH_START, 2 * PAGE, NULL));
    free(store);
}

static void too_many_units_are_refused_and_lose_nothing(void)
{
    ram_flash flash;
    ram_flash_erase(&flash);
    tumble_store *store = ram_flash_open(&flash);
    tumble_status answer = TUMBLE_OK;
    uint64_t units = 0;
    for (; answer == TUMBLE_OK && units < 100; ++units) {
        tumble_record record = example_record();
        record.identity = units;
        answer = tumble_store_save_factory(store, 0, &record, NULL);
    }
    CHECK(answer == TUMBLE_ERROR_FULL && units == 22);
    for (uint64_t unit = 0; unit + 1 < units; ++unit) {
        tumble_record read;
        ANSWERS(TUMBLE_OK, tumble_store_load(store, unit, TUMBLE_SENSOR_ACCELEROMETER, TUMBLE_WHICH_FACTORY, &read));
        CHECK(read.identity == unit);
    }
    free(store);
}

/* Flash whose driver tries to use the store that calls it. */
typedef struct reaching_flash {
    tumble_store *store;
    int reads;
} reaching_flash;

static int read_reaching_back(void *context, uint32_t address, uint8_t *bytes, uint32_t length)
{
    reaching_flash *flash = (reaching_flash *)context;
    uint32_t entries = 0;
    (void)address;
    ANSWERS(TUMBLE_ERROR_BUSY, tumble_store_get_entries(flash->store, &entries));
    ANSWERS(TUMBLE_ERROR_BUSY, tumble_store_erase(flash->store));
    memset(bytes, 0xFF, length);
    ++flash->reads;
    return 0;
}

static int write_never(void *context, uint32_t address, const uint8_t *bytes, uint32_t length)
{
    (void)context;
    (void)address;
    (void)bytes;
    (void)length;
    return -1;
}

static int erase_never(void *context, uint32_t address)
{
    (void)context;
    (void)address;
    return -1;
}

static void a_driver_cannot_use_the_store_that_calls_it(void)
{
    reaching_flash flash = {NEW(tumble_store), 0};
    const tumble_flash driver = {&flash, read_reaching_back, write_never, erase_never, PAGE};
    ANSWERS(TUMBLE_OK,
            tumble_store_init(flash.store, sizeof *flash.store, &driver, FLASH_START, 2 * PAGE, NULL));
    tumble_record read;
    ANSWERS(TUMBLE_ERROR_NOTHING_STORED, load(flash.store, TUMBLE_WHICH_IN_FORCE, &read));
    CHECK(flash.reads > 0);
    free(flash.store);
}

static void a_limit_of_none_at_once_is_a_limit_of_one(void)
{
    ram_flash flash;
    ram_flash_erase(&flash);
    const tumble_flash driver = ram_flash_driver(&flash);
    const tumble_write_limit limit = {1000, 0};
    tumble_store *store = NEW(tumble_store);
    ANSWERS(TUMBLE_OK, tumble_store_init(store, sizeof *store, &driver, FLASH_START, PAGE * PAGES, &limit));
    const tumble_record records[2] = {record_of(TUMBLE_SENSOR_ACCELEROMETER, 1),
                                      record_of(TUMBLE_SENSOR_ACCELEROMETER, 2)};
    ANSWERS(TUMBLE_OK, tumble_store_save(store, 5000, &records[0], NULL));
    ANSWERS(TUMBLE_ERROR_TOO_SOON, tumble_store_save(store, 5000, &records[1], NULL));
    free(store);
}

const law store_laws[] = {
    {"the last, the previous and the factory's record are kept, and come back", keeps_last_previous_and_factory},
    {"what temperature does is kept beside the records", keeps_what_temperature_does_beside_the_records},
    {"a magnetometer is kept beside the other sensors of its unit", keeps_a_magnetometer_beside_the_other_sensors},
    {"what temperature does is a record of its own", a_drift_is_a_record_of_its_own},
    {"a power cut at any byte leaves the old or the new record, whole",
     a_power_cut_leaves_the_old_or_the_new_record},
    {"writing too often is refused with the time to wait", writing_too_often_is_refused_with_the_time_to_wait},
    {"a limit of none at once is one of one at once", a_limit_of_none_at_once_is_a_limit_of_one},
    {"a driver of flash cannot use the store that calls it", a_driver_cannot_use_the_store_that_calls_it},
    {"flash that cannot hold records is refused", flash_that_cannot_be_is_refused},
    {"too many units for the flash are refused, and nothing is lost", too_many_units_are_refused_and_lose_nothing},
    {NULL, NULL},
};
