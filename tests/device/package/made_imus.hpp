/* Three made IMUs on one vehicle: a rest, motion, a rest. The first secondary has errors, which motion shows. */
#pragma once

#include <cmath>
#include <random>

namespace made_imus
{
static constexpr float gravity = 9.80665f;
static constexpr float rest = 5.0f;    /* s, twice: before and after the motion */
static constexpr float motion = 50.0f; /* s */
/* The others die, so that the unit that takes over has to be the one that was calibrated. */
static constexpr float dies = rest + motion + 2.0f;
static constexpr float end = rest + motion + rest;
static const float force_bias[3][3] = {{0, 0, 0}, {0.3f, -0.2f, 0.1f}, {0, 0, 0}};
static const float rate_bias[3][3] = {{0, 0, 0}, {0.03f, -0.02f, 0.05f}, {0, 0, 0}};

inline void truth(float time, float force[3], float rate[3])
{
	const float moving = time < rest || time > rest + motion ? 0.0f : 1.0f;
	const float since = time - rest;

	for (int axis = 0; axis < 3; ++axis) {
		force[axis] = moving * 3.0f * std::sin((1.1f + 0.6f * static_cast<float>(axis)) * since);
		rate[axis] = moving * 0.8f * std::sin((1.9f - 0.6f * static_cast<float>(axis)) * since);
	}

	force[2] -= gravity;
}

/* A reading of a unit, of each axis: the truth, its errors and its noise. */
inline void measure(unsigned unit, const float force[3], const float rate[3], float *said_force[3], float *said_rate[3])
{
	static std::mt19937 generator(7);
	static std::normal_distribution<float> noise;

	for (int axis = 0; axis < 3; ++axis) {
		*said_force[axis] = force[axis] + force_bias[unit][axis] + 0.02f * noise(generator);
		*said_rate[axis] = rate[axis] + rate_bias[unit][axis] + 0.001f * noise(generator);
	}
}
}
