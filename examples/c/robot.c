#include "robot.h"

#include <math.h>

static const float gravity = 9.80665f;
static const float floor_tilt = 0.02f;        /* rad */
static const float interval = 0.01f;          /* s */
static const float acceleration = 0.5f;       /* rad/s^2 */
static const float force_noise = 0.02f;       /* m/s^2, 1-sigma */
static const float rate_noise = 0.001f;       /* rad/s, 1-sigma */

const float robot_force_bias[3] = {0.15f, -0.08f, 0.2f};
const float robot_rate_bias[3] = {0.01f, -0.02f, 0.005f};

static uint64_t now;
static float heading, rate, rate_asked;

/* Noise of variance one: a sum of twelve uniform numbers, from the generator of Numerical Recipes, section 7.1. */
static float noise(void)
{
    static uint32_t state = 7;
    float sum = -6.0f;
    for (int i = 0; i < 12; ++i) {
        state = 1664525u * state + 1013904223u;
        sum += (float)(state >> 8) / 16777216.0f;
    }
    return sum;
}

static void move(void)
{
    const float change = fmaxf(-acceleration * interval, fminf(acceleration * interval, rate_asked - rate));
    rate += change;
    heading += rate * interval;
    now += 10000;
}

void robot_turn(float asked)
{
    rate_asked = asked;
}

struct tumble_sample robot_read(void)
{
    move();
    /* Uphill is forward where the heading is zero. */
    const float across = gravity * sinf(floor_tilt);
    const float force[3] = {across * cosf(heading), -across * sinf(heading), gravity * cosf(floor_tilt)};
    const float turning[3] = {0.0f, 0.0f, rate};
    struct tumble_sample sample = {.time = now};
    for (int i = 0; i < 3; ++i) {
        sample.specific_force[i] = force[i] + robot_force_bias[i] + force_noise * noise();
        sample.angular_rate[i] = turning[i] + robot_rate_bias[i] + rate_noise * noise();
    }
    return sample;
}

tumble_wheels robot_wheels(void)
{
    return rate == 0.0f && rate_asked == 0.0f ? TUMBLE_WHEELS_STOPPED : TUMBLE_WHEELS_TURNING;
}
