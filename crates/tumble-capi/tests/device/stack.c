/* Measures the stack of the calls that take most: paints what lies below the stack pointer, and looks afterwards how much
   of it a call has used. A set rests, moves until a secondary is calibrated, and rests; a spin is solved. */

#include <math.h>
#include <stdio.h>

#include "flash.h"
#include "tumble.h"

enum { DEPTH = 8192, WORD = 4, SAMPLES = 5600, RESTING = 500, MOVING = 4600, SPINNING = 4000 };

static const uint32_t PAINT = 0xA5C35A3Cu;
static const uint64_t INTERVAL = 10000;

enum call { INIT, PUSH, AIDING, RESTORE, RESTORE_FROM, SAVE, LOAD, SPIN_INIT, SPIN_PUSH, SPIN_SOLVE, CALLS };

static const char *const names[CALLS] = {
    "tumble_redundancy_init", "tumble_redundancy_push", "tumble_redundancy_aiding", "tumble_redundancy_restore",
    "tumble_redundancy_restore_from", "tumble_store_save", "tumble_store_load", "tumble_spin_init", "tumble_spin_push",
    "tumble_spin_solve"};

static uint32_t most[CALLS];
static int refused;

static tumble_redundancy monitor;
static tumble_spin spin;
static tumble_store store;
static tumble_record adopted;
static int adoptions;

static inline __attribute__((always_inline)) uintptr_t stack_pointer(void)
{
    uintptr_t pointer;
    __asm volatile("mov %0, sp" : "=r"(pointer));
    return pointer;
}

static inline __attribute__((always_inline)) uintptr_t paint(void)
{
    const uintptr_t pointer = stack_pointer();
    for (uintptr_t at = pointer - DEPTH; at < pointer; at += WORD) {
        *(volatile uint32_t *)at = PAINT;
    }
    return pointer;
}

static inline __attribute__((always_inline)) void look(enum call call, uintptr_t pointer, tumble_status status)
{
    uintptr_t at = pointer - DEPTH;
    while (at < pointer && *(volatile uint32_t *)at == PAINT) {
        at += WORD;
    }
    if (pointer - at > most[call]) {
        most[call] = (uint32_t)(pointer - at);
    }
    refused += status != TUMBLE_OK;
}

#define MEASURE(call, made)                                                                                                \
    do {                                                                                                                   \
        const uintptr_t pointer = paint();                                                                                 \
        const tumble_status status = (made);                                                                               \
        look(call, pointer, status);                                                                                       \
    } while (0)

static void on_event(void *context, const tumble_event *event)
{
    (void)context;
    if (event->kind == TUMBLE_EVENT_KIND_ADOPTED) {
        adopted = *event->record;
        ++adoptions;
    }
}

static float noise(void)
{
    static uint32_t state = 7;
    state = 1664525u * state + 1013904223u;
    return (float)(state >> 8) / 16777216.0F - 0.5F;
}

static tumble_sample sample_of(uint32_t unit, int number)
{
    const int moves = number > RESTING && number < RESTING + MOVING;
    const float since = moves ? 0.01F * (float)(number - RESTING) : 0.0F;
    tumble_sample sample = {.time = INTERVAL * (uint64_t)(number + 1)};
    for (int i = 0; i < 3; ++i) {
        const float off = unit == 1 ? 1.0F : 0.0F;
        sample.specific_force[i] = 3.0F * sinf((1.1F + 0.6F * (float)i) * since) + 0.2F * off + 0.05F * noise();
        sample.angular_rate[i] = 0.8F * sinf((1.9F - 0.6F * (float)i) * since) + 0.03F * off + 0.004F * noise();
    }
    sample.specific_force[2] += 9.80665F;
    return sample;
}

static void begin(const tumble_unit *units, const tumble_calibration *own)
{
    tumble_redundancy_settings settings;
    refused += tumble_redundancy_defaults(&settings) != TUMBLE_OK;
    MEASURE(INIT, tumble_redundancy_init(&monitor, sizeof monitor, &settings, own, units, TUMBLE_UNITS));
}

static void fly(void)
{
    for (int number = 0; number < SAMPLES; ++number) {
        for (uint32_t unit = 0; unit < TUMBLE_UNITS; ++unit) {
            const tumble_sample sample = sample_of(unit, number);
            tumble_output output;
            MEASURE(PUSH, tumble_redundancy_push(&monitor, unit, &sample, on_event, NULL, &output));
        }
        if (number % 20 == 0) {
            const tumble_aiding aiding = {.kind = TUMBLE_AIDING_KIND_VELOCITY,
                                          .velocity = {0.0F, 0.0F, 0.0F},
                                          .sigma = {0.5F, 0.5F, 0.5F}};
            MEASURE(AIDING, tumble_redundancy_aiding(&monitor, INTERVAL * (uint64_t)(number + 1), &aiding, on_event, NULL));
        }
    }
}

static void turn(void)
{
    tumble_spin_settings settings;
    tumble_spin_estimate estimate;
    tumble_spin_event event = TUMBLE_SPIN_EVENT_NONE;
    const tumble_spin_true_angle angle = {.counter_clockwise = 12.6F, .sigma = 0.01F};
    refused += tumble_spin_defaults(&settings) != TUMBLE_OK;
    MEASURE(SPIN_INIT, tumble_spin_init(&spin, sizeof spin, &settings));
    refused += tumble_spin_start(&spin) != TUMBLE_OK;
    float heading = 0.0F;
    for (int number = 0; number < SPINNING && event != TUMBLE_SPIN_EVENT_DONE; ++number) {
        const float rate = number < 1200 ? 0.0F : 1.0F;
        heading += 0.01F * rate;
        const tumble_sample sample = {
            .time = INTERVAL * (uint64_t)(number + 1),
            .specific_force = {0.2F * cosf(heading) + 0.05F * noise(), 0.2F * sinf(heading) + 0.05F * noise(),
                               9.80F + 0.05F * noise()},
            .angular_rate = {0.004F * noise(), 0.004F * noise(), rate + 0.004F * noise()},
        };
        MEASURE(SPIN_PUSH, tumble_spin_push(&spin, &sample, TUMBLE_WHEELS_UNKNOWN, &event));
    }
    MEASURE(SPIN_SOLVE, tumble_spin_solve(&spin, &angle, &estimate, NULL));
}

int main(void)
{
    const tumble_flash flash = flash_driver();
    const tumble_calibration own = {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0}}, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0}}};
    tumble_unit units[TUMBLE_UNITS];
    uint64_t wait;
    for (uint32_t unit = 0; unit < TUMBLE_UNITS; ++unit) {
        refused += tumble_unit_defaults(&units[unit], 7001 + unit) != TUMBLE_OK;
    }
    for (uint32_t page = 0; page < FLASH_PAGES; ++page) {
        refused += flash.erase(flash.context, page * FLASH_PAGE);
    }
    refused += tumble_store_init(&store, sizeof store, &flash, 0, FLASH_PAGES * FLASH_PAGE, NULL) != TUMBLE_OK;
    begin(units, &own);
    fly();
    MEASURE(SAVE, tumble_store_save(&store, 0, &adopted, &wait));
    MEASURE(LOAD, tumble_store_load(&store, adopted.identity, adopted.sensor, TUMBLE_WHICH_IN_FORCE, &adopted));
    begin(units, NULL);
    MEASURE(RESTORE, tumble_redundancy_restore(&monitor, &adopted, on_event, NULL));
    MEASURE(RESTORE_FROM, tumble_redundancy_restore_from(&monitor, &store, on_event, NULL));
    turn();
    for (int call = 0; call < CALLS; ++call) {
        printf("stack %lu bytes: %s\n", (unsigned long)most[call], names[call]);
    }
    printf("%d adopted, %d refused\n", adoptions, refused);
    return 0;
}
