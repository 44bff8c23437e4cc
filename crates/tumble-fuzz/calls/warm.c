#include "fuzz.h"

#include <math.h>
#include <string.h>

enum {
    SETS = 6,
    /* Samples of all units of a mission of 12 s. */
    STEPS = 9000,
    BETWEEN = 20,
    SCENES = STEPS / BETWEEN + 1,
    /* Samples of a spin, until shortly after it is done. */
    SPIN_STEPS = 500,
    IMAGES = 8,
};

static const uint64_t SECOND = 1000000;

tumble_redundancy *redundancy;
tumble_spin *spin;
tumble_store *store;

static tumble_redundancy monitors[SETS][SCENES];
static tumble_spin spins[SPIN_STEPS];
static uint8_t images[IMAGES][FLASH_BYTES];
static tumble_store usual_store;

/* Scenes after which something happens soon: of which set, and which. */
static uint16_t eventful[SETS * SCENES][2];
static uint32_t eventful_scenes;

uint32_t samples_spoilt;

/* Step of the next sample of the set. */
static uint32_t set_step;
static uint32_t spin_step;

void usual_redundancy_settings(tumble_redundancy_settings *settings)
{
    CHECK(tumble_redundancy_defaults(settings) == TUMBLE_OK, "no defaults");
    settings->window = 20000;
    settings->rest_settle = 100000;
    settings->rest_duration = 400000;
    settings->evaluate_every = 5 * SECOND;
    settings->collect = 4 * SECOND;
    settings->collect_timeout = 8 * SECOND;
    settings->motion_timeout = 5 * SECOND;
    settings->fewest_pairs = 40;
    settings->data = draw_below(2);
    settings->gate = draw_below(3);
    settings->scope = draw_below(2);
    settings->largest_fit_model = draw_below(4);
    settings->vector_check = draw_once_in(2);
    settings->fit_rests = !draw_once_in(4);
    settings->calibrated_only = draw_once_in(2);
    settings->return_after = draw_once_in(2) ? SECOND : 0;
}

void usual_units(tumble_unit units[TUMBLE_UNITS])
{
    for (uint32_t number = 0; number < TUMBLE_UNITS; number++) {
        CHECK(tumble_unit_defaults(&units[number], 10 + number) == TUMBLE_OK, "no defaults");
        units[number].lever_arm_known = draw_once_in(2);
    }
}

void usual_spin_settings(tumble_spin_settings *settings)
{
    CHECK(tumble_spin_defaults(settings) == TUMBLE_OK, "no defaults");
    settings->still = 800000;
    settings->turn = 12.0f;
    settings->block = 50000;
    settings->shortest_stop = 300000;
}

void usual_record(tumble_record *record)
{
    memset(record, 0, sizeof *record);
    record->identity = 10 + draw_below(TUMBLE_UNITS + 1);
    record->sensor = draw_below(2);
    record->fit_model = draw_below(4);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            record->matrix[i][j] = (i == j ? 1.0f : 0.0f) + draw_usual(0.05f);
            record->matrix_sigma[i][j] = INFINITY;
        }
        record->bias[i] = draw_usual(0.5f);
        record->bias_sigma[i] = 0.01f;
        record->followed[i] = draw_usual(0.1f);
    }
    record->residual = 0.02f;
    record->residual_before = 0.3f;
    record->temperature = draw_once_in(2) ? NAN : draw_usual(80.0f);
    record->pairs = 200;
    record->sequence = (uint32_t)draw_bits();
    record->directions = 3;
}

static void noise(float *axes, float size)
{
    for (int axis = 0; axis < 3; axis++) {
        axes[axis] += draw_usual(size);
    }
}

/** Rest, motion, rest, motion in which the primary falls silent. */
static bool say_of_set(uint32_t step, uint32_t *unit, tumble_sample *sample)
{
    const float seconds = (float)step * 4e-3f / TUMBLE_UNITS;
    const bool rests = seconds < 1.2f || (seconds >= 7.0f && seconds < 8.4f);
    const float share = rests ? 0.0f : 1.0f;
    const float wrong = (float)(step % TUMBLE_UNITS);
    *unit = step % TUMBLE_UNITS;
    sample->time = 40 * SECOND + (uint64_t)step * 4000 / TUMBLE_UNITS;
    for (int axis = 0; axis < 3; axis++) {
        const float shift = (float)axis;
        const float force =
            3.0f * share * sinf((4.0f + shift) * seconds + shift) + (axis == 2 ? 9.80665f : 0.0f);
        const float rate = share * sinf((6.0f - shift) * seconds + shift);
        sample->specific_force[axis] = force * (1.0f + 0.01f * wrong) + 0.2f * wrong;
        sample->angular_rate[axis] = rate * (1.0f - 0.01f * wrong) + 0.02f * wrong;
    }
    noise(sample->specific_force, 0.02f);
    noise(sample->angular_rate, 0.002f);
    return !(*unit == 0 && seconds >= 10.5f);
}

bool next_of_set(uint32_t *unit, tumble_sample *sample)
{
    return say_of_set(set_step++, unit, sample);
}

/** A robot on a floor that tilts: it stands for a second, turns, and stands. */
static void say_of_robot(uint32_t step, tumble_sample *sample, tumble_wheels *wheels)
{
    const bool turns = step >= 100 && step < 500;
    const float rate = turns ? 3.2f : 0.0f;
    const float heading = 0.032f * (float)(step < 100 ? 0 : turns ? step - 100 : 400);
    sample->time = 7 * SECOND + 10000 * (uint64_t)step;
    sample->specific_force[0] = 0.2f * cosf(heading) - 0.1f * rate * rate;
    sample->specific_force[1] = -0.2f * sinf(heading);
    sample->specific_force[2] = 9.80665f;
    sample->angular_rate[0] = 0.01f;
    sample->angular_rate[1] = -0.02f;
    sample->angular_rate[2] = rate;
    noise(sample->specific_force, 0.02f);
    noise(sample->angular_rate, 0.002f);
    *wheels = turns ? TUMBLE_WHEELS_TURNING : TUMBLE_WHEELS_STOPPED;
}

void next_of_robot(tumble_sample *sample, tumble_wheels *wheels)
{
    say_of_robot(spin_step++, sample, wheels);
}

/** The states that a run may begin in are proof of nothing if the library never gets there. */
struct reached {
    bool adopted;
    bool failed_over;
    bool anything;
};

static void reach(void *context, const tumble_event *event)
{
    struct reached *const reached = context;
    reached->anything = true;
    reached->adopted |= event->kind == TUMBLE_EVENT_KIND_ADOPTED;
    reached->failed_over |=
        event->kind == TUMBLE_EVENT_KIND_SELECTED && event->reason == TUMBLE_REASON_PRIMARY_FAILED;
}

static void fly(uint16_t set, struct reached *reached)
{
    tumble_redundancy_settings settings;
    tumble_unit units[TUMBLE_UNITS];
    usual_redundancy_settings(&settings);
    usual_units(units);
    CHECK(tumble_redundancy_init(redundancy, sizeof *redundancy, &settings, NULL, units, TUMBLE_UNITS) ==
              TUMBLE_OK,
          "a usual set was refused");
    for (uint32_t step = 0; step < STEPS; step++) {
        if (step % BETWEEN == 0) {
            monitors[set][step / BETWEEN] = *redundancy;
            reached->anything = false;
        }
        uint32_t unit;
        tumble_sample sample;
        if (say_of_set(step, &unit, &sample)) {
            tumble_redundancy_push(redundancy, unit, &sample, reach, reached, NULL);
        }
        if (step % BETWEEN == BETWEEN - 1 && reached->anything) {
            eventful[eventful_scenes][0] = set;
            eventful[eventful_scenes][1] = (uint16_t)(step / BETWEEN);
            eventful_scenes++;
        }
    }
}

static void turn(void)
{
    tumble_spin_settings settings;
    tumble_spin_state state;
    usual_spin_settings(&settings);
    CHECK(tumble_spin_init(spin, sizeof *spin, &settings) == TUMBLE_OK, "a usual spin was refused");
    CHECK(tumble_spin_start(spin) == TUMBLE_OK, "a spin was not started");
    for (uint32_t step = 0; step < SPIN_STEPS; step++) {
        tumble_sample sample;
        tumble_wheels wheels;
        spins[step] = *spin;
        say_of_robot(step, &sample, &wheels);
        tumble_spin_push(spin, &sample, wheels, NULL);
    }
    tumble_spin_get_state(spin, &state);
    CHECK(state.phase == TUMBLE_SPIN_PHASE_DONE, "a usual spin was not done");
}

static void keep(void)
{
    const tumble_write_limit limit = {.shortest_between = 0, .at_once = 1};
    CHECK(tumble_store_init(store, sizeof *store, &flash, FLASH_START, FLASH_BYTES, &limit) == TUMBLE_OK,
          "a usual store was refused");
    usual_store = *store;
    memset(flash_memory, 0xFF, FLASH_BYTES);
    for (int image = 0; image < IMAGES; image++) {
        memcpy(images[image], flash_memory, FLASH_BYTES);
        for (int record = 0; record < 7; record++) {
            tumble_record kept;
            usual_record(&kept);
            CHECK(tumble_store_save(store, 0, &kept, NULL) == TUMBLE_OK, "a usual record was not kept");
        }
    }
}

void warm_up(void)
{
    struct reached reached = {false, false, false};
    redundancy = memory_ending(sizeof *redundancy);
    spin = memory_ending(sizeof *spin);
    store = memory_ending(sizeof *store);
    flash_memory = memory_ending(FLASH_BYTES);
    draw_seed(0);
    for (uint16_t set = 0; set < SETS; set++) {
        fly(set, &reached);
    }
    CHECK(reached.adopted && reached.failed_over, "a usual mission does not go as it should");
    turn();
    keep();
}

void warm_begin(void)
{
    uint32_t set = draw_below(SETS);
    uint32_t scene = draw_below(SCENES);
    if (draw_once_in(2)) {
        const uint16_t *const chosen = eventful[draw_below(eventful_scenes)];
        set = chosen[0];
        scene = chosen[1];
    }
    *redundancy = monitors[set][scene];
    set_step = scene * BETWEEN;
    spin_step = draw_below(SPIN_STEPS);
    *spin = spins[spin_step];
    *store = usual_store;
    memcpy(flash_memory, images[draw_below(IMAGES)], FLASH_BYTES);
    static const uint32_t often[] = {1, 4, 16, 64, 1024};
    samples_spoilt = often[draw_below(sizeof often / sizeof often[0])];
    flash_faults = draw_once_in(2) ? 0 : 1 + draw_below(200);
    flash_judged = flash_faults == 0;
    if (draw_once_in(8)) {
        draw_spoil(flash_memory, FLASH_BYTES);
        flash_judged = false;
    }
    if (draw_once_in(8)) {
        draw_spoil(redundancy, sizeof *redundancy);
        memset(redundancy, draw_below(256), 4);
        draw_spoil(spin, sizeof *spin);
        memset(spin, draw_below(256), 4);
        draw_spoil(store, sizeof *store);
        memset(store, draw_below(256), 4);
    }
}
