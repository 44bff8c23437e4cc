#include "fuzz.h"

#include <math.h>
#include <string.h>

bool pointer_spoilt;

enum { UNWRITTEN = 0xA5 };

static uint64_t digest;

/** Called by the library where it panics. */
_Noreturn void tumble_panic_is_reachable(void);
void tumble_panic_is_reachable(void)
{
    fail("a panic");
}

void told_begin(void)
{
    digest = 0xCBF29CE484222325;
}

/* FNV-1a, by words. */
void tell(const void *bytes, size_t size)
{
    const uint8_t *at = bytes;
    for (size_t place = 0; place < size; place += 4) {
        uint32_t word = 0;
        memcpy(&word, at + place, size - place < 4 ? size - place : 4);
        digest = (digest ^ word) * 0x100000001B3;
    }
}

uint64_t told(void)
{
    return digest;
}

static void *unaligned(void *object)
{
    pointer_spoilt = true;
    return (uint8_t *)object + 1 + draw_below(3);
}

void *required(void *object)
{
    switch (draw_below(128)) {
    case 0:
        pointer_spoilt = true;
        return NULL;
    case 1:
        return unaligned(object);
    default:
        return object;
    }
}

void *optional(void *object)
{
    switch (draw_below(32)) {
    case 0:
        return unaligned(object);
    case 1:
    case 2:
    case 3:
        return NULL;
    default:
        return object;
    }
}

void unwritten(void *object, size_t size)
{
    memset(object, UNWRITTEN, size);
}

bool done(tumble_status status, const void *object, size_t size)
{
    const bool spoilt = pointer_spoilt;
    pointer_spoilt = false;
    tell(&status, sizeof status);
    CHECK(status <= TUMBLE_ERROR_NOTHING_STORED, "a status that is none");
    CHECK(!(spoilt && status == TUMBLE_OK), "a pointer was taken that leads nowhere");
    const uint8_t *at = object;
    if (status != TUMBLE_OK) {
        for (size_t place = 0; place < size; place++) {
            CHECK(at[place] == UNWRITTEN, "it failed and wrote all the same");
        }
    }
    return status == TUMBLE_OK;
}

bool none_infinite(const float *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (isinf(numbers[i])) {
            return false;
        }
    }
    return true;
}

bool all_finite(const float *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(numbers[i])) {
            return false;
        }
    }
    return true;
}
