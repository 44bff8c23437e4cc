/* Flies three made IMUs: a rest, motion in which the first secondary is calibrated, and then the others die; the vehicle is
   armed from the end of the first rest until just before the end. `flight [UNIT TIME]`: that unit sends nothing before that
   time, s. */
#include <cstdlib>

#include <TumbleImu.hpp>

#include "../made_imus.hpp"

using namespace made_imus;

static uint64_t now = 1000000;

uint64_t hrt_absolute_time() { return now; }

template<> float ParamFloat<px4::params::TMB_ACC_THR>::get() const { return 0.1f; }
template<> float ParamFloat<px4::params::TMB_GYR_THR>::get() const { return 0.01f; }

extern "C" int tumble_imu_main(int argc, char *argv[]);

static constexpr float interval = 0.005f; /* s */

/* Files that were touched, and when they must not be. */
static bool pushing, armed;
static int touched, touched_in_a_push, touched_while_armed;

static void touch()
{
	++touched;
	touched_in_a_push += pushing;
	touched_while_armed += armed;
}

/* The linker leads calls of the module here, and the real ones are called from here. */
extern "C" {
FILE *__real_fopen(const char *name, const char *mode);
size_t __real_fread(void *bytes, size_t size, size_t count, FILE *file);
size_t __real_fwrite(const void *bytes, size_t size, size_t count, FILE *file);
int __real_fclose(FILE *file);
int __real_rename(const char *from, const char *to);
tumble_status __real_tumble_redundancy_push(tumble_redundancy *redundancy, uint32_t unit, const tumble_sample *sample,
		tumble_on_event on_event, void *context, tumble_output *output);

FILE *__wrap_fopen(const char *name, const char *mode)
{
	touch();
	return __real_fopen(name, mode);
}

size_t __wrap_fread(void *bytes, size_t size, size_t count, FILE *file)
{
	touch();
	return __real_fread(bytes, size, count, file);
}

size_t __wrap_fwrite(const void *bytes, size_t size, size_t count, FILE *file)
{
	touch();
	return __real_fwrite(bytes, size, count, file);
}

int __wrap_fclose(FILE *file)
{
	touch();
	return __real_fclose(file);
}

int __wrap_rename(const char *from, const char *to)
{
	touch();
	return __real_rename(from, to);
}

tumble_status __wrap_tumble_redundancy_push(tumble_redundancy *redundancy, uint32_t unit, const tumble_sample *sample,
		tumble_on_event on_event, void *context, tumble_output *output)
{
	pushing = true;
	const tumble_status status = __real_tumble_redundancy_push(redundancy, unit, sample, on_event, context, output);
	pushing = false;
	return status;
}
}

static void arm(bool wanted)
{
	if (armed != wanted) {
		armed = wanted;
		actuator_armed_s state{};
		state.timestamp = now;
		state.armed = wanted;
		Topic<actuator_armed_s>::of(0).publish(state);
	}
}

static void publish(unsigned unit, const float force[3], const float rate[3])
{
	sensor_accel_s accel{};
	sensor_gyro_s gyro{};
	accel.timestamp = accel.timestamp_sample = gyro.timestamp = gyro.timestamp_sample = now;
	accel.device_id = 100 + unit;
	gyro.device_id = 200 + unit;
	float *said_force[3] = {&accel.x, &accel.y, &accel.z};
	float *said_rate[3] = {&gyro.x, &gyro.y, &gyro.z};
	measure(unit, force, rate, said_force, said_rate);
	Topic<sensor_accel_s>::of(unit).publish(accel);
	Topic<sensor_gyro_s>::of(unit).publish(gyro);
}

static void call(const char *command)
{
	char name[] = "tumble_imu";
	char word[16];
	std::snprintf(word, sizeof(word), "%s", command);
	char *words[] = {name, word};
	tumble_imu_main(2, words);
}

static double force_error[3], rate_error[3];
static int outputs;
static uint32_t device;

static void compare(const float force[3], const float rate[3])
{
	const vehicle_imu_s &last = Topic<vehicle_imu_s>::of(0).queue.back();
	const float seconds = static_cast<float>(last.delta_angle_dt) * 1e-6f;
	device = last.accel_device_id;
	++outputs;

	for (int axis = 0; axis < 3; ++axis) {
		force_error[axis] += static_cast<double>(last.delta_velocity[axis] / seconds - force[axis]);
		rate_error[axis] += static_cast<double>(last.delta_angle[axis] / seconds - rate[axis]);
	}
}

/* Unit that sends nothing at first, if any. */
static unsigned absent = 3;
static float comes;

/* While the module sleeps, the vehicle flies on. */
int px4_usleep(unsigned)
{
	static float time, force[3], rate[3];
	static uint64_t published;
	const uint64_t count = Topic<vehicle_imu_s>::of(0).count;

	if (time > dies + 1.0f && count != published) {
		compare(force, rate);
	}

	published = count;
	time += interval;
	now += 5000;
	truth(time, force, rate);

	arm(time > rest && time < end - 0.2f);

	for (unsigned unit = 0; unit < 3; ++unit) {
		if (unit == absent && time < comes) {
			continue;
		}

		if (unit == 1 || time <= dies) {
			publish(unit, force, rate);
		}
	}

	if (time > end) {
		call("status");
		call("stop");
	}

	return 0;
}

int main(int argc, char *argv[])
{
	if (argc == 3) {
		absent = static_cast<unsigned>(std::atoi(argv[1]));
		comes = static_cast<float>(std::atof(argv[2]));
	}

	call("start");
	std::printf("files touched %d, in a push %d, while armed %d\n", touched, touched_in_a_push, touched_while_armed);
	std::printf("outputs %d of device %u, error", outputs, static_cast<unsigned>(device));

	for (int axis = 0; axis < 3; ++axis) {
		std::printf(" %.4f %.5f", force_error[axis] / outputs, rate_error[axis] / outputs);
	}

	std::puts("");
	return TumbleImu::get_instance() == nullptr ? 0 : 1;
}
