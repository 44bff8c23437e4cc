#include "fuzz.h"

#include <string.h>

/* Arguments of one call. */
static tumble_flash *driver;
static tumble_write_limit *limit;
static tumble_record *record;
static tumble_magnetometer_record *compass;
static uint64_t *waiting;
static uint32_t *entries;

static void make_room(void)
{
    if (driver != NULL) {
        return;
    }
    driver = memory_ending(sizeof *driver);
    limit = memory_ending(sizeof *limit);
    record = memory_ending(sizeof *record);
    compass = memory_ending(sizeof *compass);
    waiting = memory_ending(sizeof *waiting);
    entries = memory_ending(sizeof *entries);
}

static void begin(void)
{
    *driver = flash;
    driver->page = draw_once_in(2) ? flash.page : (uint32_t)draw_time();
    if (draw_once_in(8)) {
        driver->read = draw_once_in(2) ? driver->read : NULL;
        driver->write = draw_once_in(2) ? driver->write : NULL;
        driver->erase = NULL;
    }
    limit->shortest_between = draw_once_in(2) ? draw_time() : 1000;
    limit->at_once = (uint32_t)draw_time();
    const uint32_t start = draw_once_in(2) ? FLASH_START : (uint32_t)draw_time();
    const uint32_t length = draw_once_in(2) ? FLASH_BYTES : (uint32_t)draw_time();
    const size_t size = draw_once_in(16) ? (size_t)draw_time() : sizeof *store;
    const tumble_status status =
        tumble_store_init(required(store), size, required(driver), start, length, optional(limit));
    if (done(status, NULL, 0)) {
        CHECK(size == sizeof *store && driver->erase != NULL, "storage or driver of no use was taken");
        flash_judged &= start == FLASH_START && length == FLASH_BYTES && driver->page == flash.page;
    }
}

static void load(void)
{
    const uint64_t identity = 10 + draw_below(TUMBLE_UNITS + 1);
    const tumble_sensor sensor = draw_code(2);
    unwritten(record, sizeof *record);
    if (done(tumble_store_load(required(store), identity, sensor, draw_code(4), required(record)), record,
             sizeof *record)) {
        CHECK(record->identity == identity && record->sensor == sensor, "the record of another unit");
        tell(record->matrix, sizeof record->matrix);
    }
}

static void save(void)
{
    any_record(record);
    unwritten(waiting, sizeof *waiting);
    uint64_t *const place = optional(waiting);
    const bool factory = draw_once_in(8);
    const tumble_status status =
        factory ? tumble_store_save_factory(required(store), draw_time(), required(record), place)
                : tumble_store_save(required(store), draw_time(), required(record), place);
    done(status, NULL, 0);
    if (status == TUMBLE_OK && !factory && flash_judged) {
        static tumble_record kept;
        CHECK(tumble_store_load(store, record->identity, record->sensor, TUMBLE_WHICH_IN_FORCE, &kept) ==
                      TUMBLE_OK &&
                  memcmp(kept.matrix, record->matrix, sizeof kept.matrix) == 0 &&
                  kept.sequence == record->sequence,
              "what was saved is not in force");
    }
}

static void roll_back(void)
{
    const uint64_t identity = 10 + draw_below(TUMBLE_UNITS + 1);
    unwritten(record, sizeof *record);
    done(tumble_store_roll_back(required(store), draw_time(), identity, draw_code(2), draw_code(4),
                                optional(record), optional(waiting)),
         record, sizeof *record);
}

static void keep_magnetometer(void)
{
    memset(compass, 0, sizeof *compass);
    compass->identity = 10 + draw_below(TUMBLE_UNITS + 1);
    for (int i = 0; i < 3; i++) {
        compass->magnetometer.error.matrix[i][i] = 1.0f;
        compass->magnetometer.error.bias[i] = draw_usual(40.0f);
    }
    if (draw_once_in(4)) {
        draw_spoil(compass, sizeof *compass);
    }
    uint64_t *const place = optional(waiting);
    done(draw_once_in(8)
             ? tumble_store_save_factory_magnetometer(required(store), draw_time(), required(compass), place)
             : tumble_store_save_magnetometer(required(store), draw_time(), required(compass), place),
         NULL, 0);
}

static void find_magnetometer(void)
{
    const uint64_t identity = 10 + draw_below(TUMBLE_UNITS + 1);
    unwritten(compass, sizeof *compass);
    if (draw_once_in(8)) {
        done(tumble_store_roll_back_magnetometer(required(store), draw_time(), identity, draw_code(4), optional(compass),
                                                 optional(waiting)),
             compass, sizeof *compass);
    } else if (done(tumble_store_load_magnetometer(required(store), identity, draw_code(4), required(compass)), compass,
                    sizeof *compass)) {
        CHECK(compass->identity == identity, "the magnetometer of another unit");
    }
}

void call_of_store(void)
{
    make_room();
    switch (draw_below(32)) {
    case 0:
        begin();
        break;
    case 1:
        unwritten(entries, sizeof *entries);
        done(tumble_store_get_entries(required(store), required(entries)), entries, sizeof *entries);
        break;
    case 2:
        roll_back();
        break;
    case 3:
        if (draw_once_in(8)) {
            done(tumble_store_erase(required(store)), NULL, 0);
        }
        break;
    case 4:
        keep_magnetometer();
        break;
    case 5:
        find_magnetometer();
        break;
    default:
        if (draw_once_in(2)) {
            load();
        } else {
            save();
        }
        break;
    }
}
