#include "fuzz.h"

#include <math.h>
#include <string.h>

/* Arguments of one call. */
static tumble_redundancy_settings *settings;
static tumble_calibration *calibration;
static tumble_unit *units;
static tumble_sample *sample;
static tumble_output *output;
static tumble_record *record;
static tumble_knowledge *knowledge;
static uint32_t *source;
static char *text;

enum { TEXT = 100 };

static void make_room(void)
{
    if (settings != NULL) {
        return;
    }
    settings = memory_ending(sizeof *settings);
    calibration = memory_ending(sizeof *calibration);
    units = memory_ending(TUMBLE_UNITS * sizeof *units);
    sample = memory_ending(sizeof *sample);
    output = memory_ending(sizeof *output);
    record = memory_ending(sizeof *record);
    knowledge = memory_ending(sizeof *knowledge);
    source = memory_ending(sizeof *source);
    text = memory_ending(TEXT);
}

static void hear(void *context, const tumble_event *event)
{
    CHECK(context == source, "another context than was given");
    CHECK(event->kind <= TUMBLE_EVENT_KIND_ALL_SATURATED && event->reason <= TUMBLE_REASON_NONE_FIT &&
              event->check <= TUMBLE_CHECK_VECTOR && event->fit_model <= TUMBLE_FIT_MODEL_AFFINE_AND_LEVER_ARM,
          "an event of no kind");
    CHECK(event->unit < TUMBLE_UNITS, "an event of a unit that is not there");
    CHECK((event->record != NULL) == (event->kind == TUMBLE_EVENT_KIND_ADOPTED), "a record without adoption");
    if (event->record != NULL) {
        uint8_t bytes[TUMBLE_RECORD_BYTES];
        size_t length;
        CHECK(tumble_record_encode(event->record, bytes, sizeof bytes, &length) == TUMBLE_OK,
              "adopted, but cannot be stored");
    }
    tell(&event->time, sizeof event->time);
    tell(&event->kind, sizeof event->kind);
    tell(&event->value, sizeof event->value);
    if (draw_once_in(8)) {
        uint32_t unit;
        CHECK(tumble_redundancy_get_source(redundancy, &unit) != TUMBLE_OK &&
                  tumble_redundancy_command(redundancy, TUMBLE_COMMAND_EVALUATE) != TUMBLE_OK,
              "a monitor was used while it was at work");
    }
}

/** A call that reports failure has changed nothing. */
static bool left(tumble_status status, const void *object, size_t size, const tumble_redundancy *before)
{
    if (done(status, object, size)) {
        return true;
    }
    CHECK(memcmp(before, redundancy, sizeof *before) == 0, "it failed, and the monitor has changed");
    return false;
}

static void begin(const tumble_redundancy *before)
{
    usual_redundancy_settings(settings);
    usual_units(units);
    memset(calibration, 0, sizeof *calibration);
    for (int i = 0; i < 3; i++) {
        calibration->accelerometer.matrix[i][i] = calibration->gyroscope.matrix[i][i] = 1.0f;
    }
    if (draw_once_in(2)) {
        draw_spoil(settings, sizeof *settings);
    }
    if (draw_once_in(4)) {
        draw_spoil(calibration, sizeof *calibration);
    }
    if (draw_once_in(4)) {
        draw_spoil(units, TUMBLE_UNITS * sizeof *units);
    }
    /* Drawn before the check: the pointers that are corrupt have to be known for this call. */
    const size_t room = draw_below(TEXT + 1);
    done(tumble_redundancy_check(required(settings), draw_once_in(4) ? NULL : text + TEXT - room, room), NULL,
         0);
    const size_t size = draw_once_in(32) ? (size_t)draw_time() : sizeof *redundancy;
    const size_t count = draw_once_in(32) ? draw_below(TUMBLE_UNITS) : TUMBLE_UNITS;
    const tumble_status status = tumble_redundancy_init(required(redundancy), size, required(settings),
                                                        optional(calibration), required(units), count);
    if (left(status, NULL, 0, before)) {
        CHECK(size == sizeof *redundancy && count == TUMBLE_UNITS, "storage of another library was taken");
    }
}

static void push(const tumble_redundancy *before)
{
    uint32_t unit;
    const bool says = next_of_set(&unit, sample);
    if (!says && !draw_once_in(4)) {
        return;
    }
    spoil_sample(sample);
    unit = draw_once_in(32) ? (uint32_t)draw_time() : unit;
    unwritten(output, sizeof *output);
    tumble_output *const place = optional(output);
    const tumble_status status = tumble_redundancy_push(required(redundancy), unit, required(sample),
                                                        draw_once_in(16) ? NULL : hear, source, place);
    if (left(status, output, sizeof *output, before) && place == output) {
        const bool given = output->source != TUMBLE_NO_SOURCE;
        CHECK(!given || output->source == unit, "an output of another unit than said it");
        /* It has no number on axes that its source does not measure. */
        CHECK(!given || (none_infinite(output->specific_force, 3) && none_infinite(output->angular_rate, 3)),
              "an output that is infinite");
        tell(output, offsetof(tumble_output, source) + sizeof output->source);
    }
}

static void ask(void)
{
    unwritten(source, sizeof *source);
    if (done(tumble_redundancy_get_source(required(redundancy), required(source)), source, sizeof *source)) {
        CHECK(*source < TUMBLE_UNITS || *source == TUMBLE_NO_SOURCE, "a source that is not there");
        tell(source, sizeof *source);
    }
    unwritten(knowledge, sizeof *knowledge);
    const tumble_status status = tumble_redundancy_get_stored(required(redundancy), draw_code(TUMBLE_UNITS),
                                                              draw_code(2), required(knowledge));
    if (done(status, knowledge, sizeof *knowledge)) {
        CHECK(all_finite(&knowledge->matrix[0][0], 9) && all_finite(knowledge->bias, 3) &&
                  all_finite(knowledge->lever_arm, 3),
              "what is stored is not finite");
        tell(knowledge->matrix, sizeof knowledge->matrix);
    }
}

void call_of_redundancy(void)
{
    static tumble_redundancy before;
    make_room();
    before = *redundancy;
    switch (draw_below(32)) {
    case 0:
        begin(&before);
        break;
    case 1:
        left(tumble_redundancy_command(required(redundancy), draw_code(2)), NULL, 0, &before);
        break;
    case 2:
        any_record(record);
        left(tumble_redundancy_restore(required(redundancy), required(record), hear, source), NULL, 0,
             &before);
        break;
    case 3:
        done(tumble_redundancy_restore_from(required(redundancy), required(store), hear, source), NULL, 0);
        break;
    case 4:
    case 5:
        ask();
        break;
    default:
        for (uint32_t samples = 1 + draw_below(6); samples > 0; samples--) {
            push(&before);
            before = *redundancy;
        }
        break;
    }
}
