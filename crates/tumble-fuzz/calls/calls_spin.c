#include "fuzz.h"

#include <string.h>

/* Arguments of one call. */
static tumble_spin_settings *settings;
static tumble_sample *sample;
static tumble_spin_event *event;
static tumble_spin_state *state;
static tumble_spin_progress *progress;
static tumble_spin_true_angle *angle;
static tumble_spin_estimate *estimate;
static tumble_spin_failure *failure;
static tumble_record *record;

static void make_room(void)
{
    if (settings != NULL) {
        return;
    }
    settings = memory_ending(sizeof *settings);
    sample = memory_ending(sizeof *sample);
    event = memory_ending(sizeof *event);
    state = memory_ending(sizeof *state);
    progress = memory_ending(sizeof *progress);
    angle = memory_ending(sizeof *angle);
    estimate = memory_ending(sizeof *estimate);
    failure = memory_ending(sizeof *failure);
    record = memory_ending(sizeof *record);
}

/** A call that reports failure has changed nothing. */
static bool left(tumble_status status, const void *object, size_t size, const tumble_spin *before)
{
    if (done(status, object, size)) {
        return true;
    }
    CHECK(memcmp(before, spin, sizeof *before) == 0, "it failed, and the spin has changed");
    return false;
}

static void begin(const tumble_spin *before)
{
    usual_spin_settings(settings);
    if (draw_once_in(2)) {
        draw_spoil(settings, sizeof *settings);
    }
    const size_t size = draw_once_in(32) ? (size_t)draw_time() : sizeof *spin;
    if (left(tumble_spin_init(required(spin), size, required(settings)), NULL, 0, before)) {
        CHECK(size == sizeof *spin, "storage of another library was taken");
    }
}

static void push(const tumble_spin *before)
{
    tumble_wheels wheels;
    next_of_robot(sample, &wheels);
    spoil_sample(sample);
    wheels = draw_once_in(8) ? draw_code(3) : wheels;
    unwritten(event, sizeof *event);
    tumble_spin_event *const place = optional(event);
    const tumble_status status = tumble_spin_push(required(spin), required(sample), wheels, place);
    if (left(status, event, sizeof *event, before) && place == event) {
        CHECK(*event <= TUMBLE_SPIN_EVENT_FAILED, "an event of no kind");
        tell(event, sizeof *event);
    }
}

static void ask(void)
{
    unwritten(state, sizeof *state);
    if (done(tumble_spin_get_state(required(spin), required(state)), state, sizeof *state)) {
        CHECK(state->phase <= TUMBLE_SPIN_PHASE_FAILED &&
                  state->failure.fault <= TUMBLE_SPIN_FAULT_UNSOLVABLE,
              "a state of no kind");
        CHECK((state->phase == TUMBLE_SPIN_PHASE_FAILED) == (state->failure.fault != TUMBLE_SPIN_FAULT_NONE),
              "failed without a failure");
        tell(&state->phase, sizeof state->phase);
    }
    unwritten(progress, sizeof *progress);
    if (done(tumble_spin_get_progress(required(spin), required(progress)), progress, sizeof *progress)) {
        tell(&progress->turned, sizeof progress->turned);
    }
}

/** Saves the bias that the spin shows, or claims to show, as a record. */
static void keep(void)
{
    if (draw_once_in(4)) {
        draw_spoil(estimate, sizeof *estimate);
    }
    unwritten(record, sizeof *record);
    if (done(tumble_record_from_spin(required(record), draw_bits(), draw_code(2), required(estimate)), record,
             sizeof *record)) {
        uint8_t bytes[TUMBLE_RECORD_BYTES];
        size_t length;
        CHECK(tumble_record_encode(record, bytes, sizeof bytes, &length) == TUMBLE_OK,
              "a record of a spin cannot be kept");
        tell(bytes, length);
    }
}

static void solve(void)
{
    angle->clockwise = draw_number();
    angle->counter_clockwise = draw_number();
    angle->sigma = draw_number();
    unwritten(estimate, sizeof *estimate);
    const tumble_status status =
        tumble_spin_solve(required(spin), optional(angle), required(estimate), optional(failure));
    if (done(status, estimate, sizeof *estimate)) {
        const tumble_spin_vector *const bias = &estimate->accelerometer_bias;
        CHECK(!bias->observed || all_finite(bias->value, 3), "a bias is shown and not finite");
        CHECK(all_finite(estimate->gyroscope_bias.value, 3), "a bias of the gyroscope is not finite");
        CHECK(all_finite(estimate->up, 3), "up is not finite");
        tell(bias->value, sizeof bias->value);
        keep();
    }
}

void call_of_spin(void)
{
    static tumble_spin before;
    make_room();
    before = *spin;
    switch (draw_below(64)) {
    case 0:
        begin(&before);
        break;
    case 1:
        left(tumble_spin_start(required(spin)), NULL, 0, &before);
        break;
    case 2:
        solve();
        break;
    case 3:
        unwritten(event, sizeof *event);
        left(tumble_spin_tick(required(spin), draw_time(), optional(event)), event, sizeof *event, &before);
        break;
    case 4:
        unwritten(event, sizeof *event);
        left(tumble_spin_work(required(spin), optional(event)), event, sizeof *event, &before);
        break;
    case 5:
    case 6:
        ask();
        break;
    default:
        push(&before);
        break;
    }
}
