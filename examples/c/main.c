/* Calibrates the IMU of a robot by a spin, keeps the result in flash, and corrects a reading with it after a reset. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "flash.h"
#include "robot.h"
#include "tumble.h"

#define IDENTITY 4711u

/* Stops with the reason: without a result there is nothing left to do. */
static void need(tumble_status status, const char *what)
{
    if (status != TUMBLE_OK) {
        printf("%s: %s\n", what, tumble_strerror(status));
        exit(1);
    }
}

/* Whole thousandths, so that printf needs no floating point. */
static void print_vector(const char *name, const float value[3])
{
    printf("%s %ld %ld %ld\n", name, lroundf(1000.0f * value[0]), lroundf(1000.0f * value[1]),
           lroundf(1000.0f * value[2]));
}

/* Stands still, turns, and stands still again, as the state machine asks. */
static void spin(struct tumble_spin_estimate *estimate)
{
    static tumble_spin storage;
    struct tumble_spin_settings settings;
    need(tumble_spin_defaults(&settings), "spin");
    need(tumble_spin_init(&storage, sizeof storage, &settings), "spin");
    need(tumble_spin_start(&storage), "spin");
    tumble_spin_event event = TUMBLE_SPIN_EVENT_NONE;
    while (event != TUMBLE_SPIN_EVENT_DONE) {
        const struct tumble_sample sample = robot_read();
        need(tumble_spin_push(&storage, &sample, robot_wheels(), &event), "spin");
        if (event == TUMBLE_SPIN_EVENT_STILL_DONE) {
            printf("stood for %lu ms, turning\n", (unsigned long)(sample.time / 1000));
            robot_turn(settings.rate);
        } else if (event == TUMBLE_SPIN_EVENT_FAILED) {
            struct tumble_spin_state state;
            need(tumble_spin_get_state(&storage, &state), "spin");
            printf("the spin failed: fault %lu\n", (unsigned long)state.failure.fault);
            exit(1);
        }
    }
    robot_turn(0.0f);
    need(tumble_spin_solve(&storage, NULL, estimate, NULL), "solve");
}

static void open_store(tumble_store *store)
{
    const struct tumble_flash flash = flash_driver();
    need(tumble_store_init(store, sizeof *store, &flash, 0, FLASH_PAGES * FLASH_PAGE, NULL), "store");
}

static void keep(tumble_store *store, tumble_sensor sensor, const struct tumble_spin_estimate *estimate, uint64_t now)
{
    struct tumble_record record;
    need(tumble_record_from_spin(&record, IDENTITY, sensor, estimate), "record");
    need(tumble_store_save(store, now, &record, NULL), "save");
}

/* Reads the calibration from flash at the start of the firmware. */
static void start(struct tumble_correction *correction)
{
    tumble_store store;
    struct tumble_record accelerometer, gyroscope;
    open_store(&store);
    need(tumble_store_load(&store, IDENTITY, TUMBLE_SENSOR_ACCELEROMETER, TUMBLE_WHICH_IN_FORCE, &accelerometer), "load");
    need(tumble_store_load(&store, IDENTITY, TUMBLE_SENSOR_GYROSCOPE, TUMBLE_WHICH_IN_FORCE, &gyroscope), "load");
    need(tumble_correction_from_records(correction, &accelerometer, &gyroscope), "correction");
}

int main(void)
{
    struct tumble_spin_estimate estimate;
    spin(&estimate);
    print_vector("accelerometer bias, mm/s^2:", estimate.accelerometer_bias.value);
    print_vector("its truth:                 ", robot_force_bias);
    print_vector("gyroscope bias, mrad/s:", estimate.gyroscope_bias.value);
    print_vector("its truth:             ", robot_rate_bias);

    static tumble_store store;
    open_store(&store);
    need(tumble_store_erase(&store), "erase");
    const uint64_t now = robot_read().time;
    keep(&store, TUMBLE_SENSOR_ACCELEROMETER, &estimate, now);
    keep(&store, TUMBLE_SENSOR_GYROSCOPE, &estimate, now);

    struct tumble_correction correction;
    start(&correction);
    const struct tumble_sample reading = robot_read();
    struct tumble_sample truth;
    need(tumble_correction_apply(&correction, &reading, &truth), "apply");
    print_vector("a reading, mm/s^2:", reading.specific_force);
    print_vector("corrected:        ", truth.specific_force);
    return 0;
}
