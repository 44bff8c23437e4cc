/* Flies the made IMUs: they are calibrated by ArduPilot first, at rest; the primary and the second secondary die at the end.
   `flight UNITS`: that many IMUs are there. */
#include <cstdlib>

#include <AP_InertialSensor_Tumble.h>

#include "../made_imus.hpp"

using namespace made_imus;

static uint64_t now = 1000000;
static constexpr float interval = 0.0025f; /* s */
static constexpr float calibration = 1.0f; /* s */

uint64_t AP_HAL::micros64() { return now; }

static AP_InertialSensor front_end;
static AP_InertialSensor_Tumble back_end(front_end);
static const uint8_t output = 3;
static int outputs[3]; /* while ArduPilot calibrates, in flight, and after the primary died */
static double force_error[3], rate_error[3];

static void compare(int phase, const float force[3], const float rate[3])
{
	const AP_InertialSensor::Instance &said = front_end.instances[output];
	outputs[phase] += said.healthy;

	for (int axis = 0; axis < 3 && phase == 2 && said.healthy; ++axis) {
		force_error[axis] += static_cast<double>(said.accel[axis] - force[axis]);
		rate_error[axis] += static_cast<double>(said.gyro[axis] - rate[axis]);
	}
}

static void loop(float time)
{
	float force[3], rate[3];
	truth(time, force, rate);
	now += 2500;
	front_end.is_calibrating = time < calibration;

	for (unsigned unit = 0; unit < 3; ++unit) {
		AP_InertialSensor::Instance &instance = front_end.instances[unit];
		float *said_force[3] = {&instance.accel.x, &instance.accel.y, &instance.accel.z};
		float *said_rate[3] = {&instance.gyro.x, &instance.gyro.y, &instance.gyro.z};
		measure(unit, force, rate, said_force, said_rate);
		instance.healthy = unit == 1 || time <= dies;
	}

	/* The vehicle flies on by the others while the fault is found. */
	const int phase = time < calibration ? 0 : time <= dies ? 1 : 2;

	if (back_end.update() && (phase < 2 || time > dies + 1.0f)) {
		compare(phase, force, rate);
	}
}

int main(int, char *argv[])
{
	for (int unit = 0; unit < std::atoi(argv[1]); ++unit) {
		uint8_t instance = 0;
		front_end.register_gyro(instance, 1000, 10);
		front_end.register_accel(instance, 1000, 20);
	}

	back_end.start();
	float time = 0.0f;

	for (int count = 0; time < end; ++count) {
		time = interval * static_cast<float>(count);
		loop(time);
	}

	std::printf("outputs %d %d %d, error", outputs[0], outputs[1], outputs[2]);

	for (int axis = 0; axis < 3; ++axis) {
		std::printf(" %.4f %.5f", force_error[axis] / outputs[2], rate_error[axis] / outputs[2]);
	}

	std::puts("");
	return 0;
}
