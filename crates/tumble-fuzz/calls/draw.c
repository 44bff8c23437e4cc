#include "fuzz.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* First state of the generator of a run, and its present one. */
static uint64_t first_state;
static uint64_t state;
static const uint8_t *input;
static size_t input_size;
static size_t taken;

void draw_begin(void)
{
    state = first_state;
    taken = 0;
}

void draw_seed(uint64_t seed)
{
    first_state = seed;
    input_size = 0;
    draw_begin();
}

void draw_input(const uint8_t *bytes, size_t size)
{
    draw_seed(0);
    input = bytes;
    input_size = size;
}

/* SplitMix64 (Steele, Lea and Flood, 2014). */
static uint64_t next_of_seed(void)
{
    uint64_t z = state += 0x9E3779B97F4A7C15;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
}

uint64_t draw_bits(void)
{
    uint64_t bits = next_of_seed();
    const size_t left = input_size - taken;
    const size_t size = left < sizeof bits ? left : sizeof bits;
    if (size > 0) {
        memcpy(&bits, input + taken, size);
        taken += size;
    }
    return bits;
}

uint32_t draw_below(uint32_t end)
{
    if (taken < input_size && end <= 256) {
        return input[taken++] % end;
    }
    return (uint32_t)(((draw_bits() >> 32) * end) >> 32);
}

bool draw_once_in(uint32_t of)
{
    return draw_below(of) == 0;
}

float draw_usual(float size)
{
    return size * ((float)(draw_bits() >> 40) / 8388608.0f - 1.0f);
}

float draw_number(void)
{
    static const float extremes[] = {NAN,     INFINITY,    -INFINITY, FLT_MAX, -FLT_MAX, FLT_MIN,
                                     1e-45f,  FLT_EPSILON, 0.0f,      -0.0f,   1.0f,     -1.0f,
                                     1.9e19f, 1e-20f,      1e30f,     -1e30f,  1e12f};
    const float extreme = extremes[draw_below(sizeof extremes / sizeof extremes[0])];
    const uint32_t bits = (uint32_t)draw_bits();
    float number;
    switch (draw_below(4)) {
    case 0:
        return draw_usual(20.0f);
    case 1:
        memcpy(&number, &bits, sizeof number);
        return number;
    case 2:
        return extreme * draw_usual(1.0f);
    default:
        return extreme;
    }
}

uint64_t draw_time(void)
{
    static const uint64_t edges[] = {0,         1,          999,       50000,      100000,
                                     1000000,   600000000,  1u << 31,  UINT32_MAX, 1ull << 40,
                                     INT64_MAX, 1ull << 63, UINT64_MAX};
    const uint64_t edge = edges[draw_below(sizeof edges / sizeof edges[0])];
    switch (draw_below(4)) {
    case 0:
        return draw_bits();
    case 1:
        return draw_bits() >> draw_below(64);
    case 2:
        return edge + draw_below(3) - 1;
    default:
        return edge;
    }
}

uint32_t draw_code(uint32_t known)
{
    return draw_once_in(16) ? (uint32_t)draw_time() : draw_below(known);
}

void draw_spoil(void *bytes, size_t size)
{
    uint8_t *at = bytes;
    const bool all = draw_once_in(8);
    const uint32_t kind = draw_below(4);
    for (size_t place = 0; place + 4 <= size; place += 4) {
        if (!all && !draw_once_in(8)) {
            continue;
        }
        const float number = draw_number();
        const uint64_t whole = kind == 1 ? draw_time() : draw_bits();
        if (kind == 1 && place % 8 == 0 && place + 8 <= size) {
            memcpy(at + place, &whole, 8);
        } else if (kind == 2) {
            memcpy(at + place, &whole, 4);
        } else {
            memcpy(at + place, &number, 4);
        }
    }
}
