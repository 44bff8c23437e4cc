/* Flies the example of docs/how-to/c.md: a secondary that is off is calibrated in motion and saved, in flash that fails
   at first. */

#include <math.h>

#include "laws.h"
#include "ram_flash.h"

/* Calls of the example. */
tumble_status begin(const tumble_flash *flash);
tumble_status take(uint32_t unit, const tumble_sample *sample, tumble_output *output);
tumble_status save(uint64_t now);

static const uint64_t OFF = 1001; /* identity of unit 1 */
static const uint64_t REST = 5000000;
static const uint64_t MOTION = 50000000;
static const float force_bias[3] = {0.3F, -0.2F, 0.1F};
static const float rate_bias[3] = {0.03F, -0.02F, 0.05F};

int failures = 0;

void *new_storage(size_t size)
{
    void *storage = malloc(size);
    if (storage == NULL) {
        exit(2);
    }
    return storage;
}

/* Noise of variance one: a sum of twelve uniform numbers, from the generator of Numerical Recipes, section 7.1. */
static float noise(void)
{
    static uint32_t state = 7;
    float sum = -6.0F;
    for (int i = 0; i < 12; ++i) {
        state = 1664525U * state + 1013904223U;
        sum += (float)(state >> 8) / 16777216.0F;
    }
    return sum;
}

/* Readings of a unit: two of the three are right. */
static tumble_sample said_by(uint32_t unit, uint64_t time)
{
    const float moving = time < REST || time > REST + MOTION ? 0.0F : 1.0F;
    const float since = ((float)time - (float)REST) * 1e-6F;
    tumble_sample sample;
    sample.time = time;
    for (int i = 0; i < 3; ++i) {
        sample.specific_force[i] = moving * 3.0F * sinf((1.1F + 0.6F * (float)i) * since) + 0.02F * noise();
        sample.angular_rate[i] = moving * 0.8F * sinf((1.9F - 0.6F * (float)i) * since) + 0.001F * noise();
        if (unit == 1) {
            sample.specific_force[i] += force_bias[i];
            sample.angular_rate[i] += rate_bias[i];
        }
    }
    sample.specific_force[2] += 9.80665F;
    return sample;
}

static void fly(void)
{
    for (uint64_t time = 5000; failures == 0 && time < 2 * REST + MOTION; time += 5000) {
        for (uint32_t unit = 0; unit < TUMBLE_UNITS; ++unit) {
            const tumble_sample sample = said_by(unit, time);
            tumble_output output;
            ANSWERS(TUMBLE_OK, take(unit, &sample, &output));
        }
    }
}

static void is_stored(ram_flash *flash, tumble_sensor sensor, const float bias[3], float allowed)
{
    tumble_store *store = ram_flash_open(flash);
    tumble_record record;
    const tumble_status answer = tumble_store_load(store, OFF, sensor, TUMBLE_WHICH_IN_FORCE, &record);
    CHECK(answer == TUMBLE_OK);
    for (int i = 0; i < 3 && answer == TUMBLE_OK; ++i) {
        CHECK(fabsf(record.bias[i] - bias[i]) < allowed);
    }
    free(store);
}

int main(void)
{
    ram_flash flash;
    ram_flash_erase(&flash);
    const tumble_flash driver = ram_flash_driver(&flash);
    ANSWERS(TUMBLE_OK, begin(&driver));
    ANSWERS(TUMBLE_OK, save(0));
    CHECK(flash.written == 0);
    fly();
    flash.off = 1;
    ANSWERS(TUMBLE_ERROR_FLASH, save(2 * REST + MOTION));
    ram_flash_power(&flash);
    ANSWERS(TUMBLE_OK, save(3 * REST + MOTION));
    is_stored(&flash, TUMBLE_SENSOR_ACCELEROMETER, force_bias, 0.005F);
    is_stored(&flash, TUMBLE_SENSOR_GYROSCOPE, rate_bias, 0.0005F);
    /* A saved record is not saved again. */
    const long written = flash.written;
    ANSWERS(TUMBLE_OK, save(4 * REST + MOTION));
    CHECK(written > 0 && flash.written == written);
    /* After a reset, it is taken up: nothing is left to be calibrated. */
    ANSWERS(TUMBLE_OK, begin(&driver));
    fly();
    ANSWERS(TUMBLE_OK, save(5 * REST + 2 * MOTION));
    CHECK(flash.written == written);
    printf("%d checks failed\n", failures);
    return failures == 0 ? 0 : 1;
}
