#include "TumbleImu.hpp"

#include <inttypes.h>
#include <stdio.h>

/* PX4's axes are forward, right, down; at rest an accelerometer reads -g down, which is +g up, as Tumble has it. */

using namespace time_literals;

/* Not woken by a topic: the unit that wakes may be the one that dies. */
static constexpr unsigned INTERVAL = 2500_us;

/* A fit takes 10 kB, more than work queues have: so this is a task. */
static constexpr int STACK = 16384;

TumbleImu::TumbleImu() :
	ModuleParams(nullptr),
	_units{
		{{ORB_ID(sensor_accel), 0}, {ORB_ID(sensor_gyro), 0}},
		{{ORB_ID(sensor_accel), 1}, {ORB_ID(sensor_gyro), 1}},
		{{ORB_ID(sensor_accel), 2}, {ORB_ID(sensor_gyro), 2}},
	}
{
	static_assert(TUMBLE_UNITS == 3, "one line above for each unit");
}

void TumbleImu::run()
{
	while (!should_exit() && step()) {
		px4_usleep(INTERVAL);
	}
}

bool TumbleImu::step()
{
	update_parameters();

	for (uint32_t number = 0; number < TUMBLE_UNITS; ++number) {
		while (update(_units[number])) {
			if (_started && !take_in(number)) {
				return false;
			}
		}
	}

	return _started || !all_are_seen() || start();
}

void TumbleImu::update_parameters()
{
	if (_parameter_update_sub.updated()) {
		parameter_update_s update;
		_parameter_update_sub.copy(&update);
		/* Thresholds are taken at the start; a monitor is not changed while it runs. */
		updateParams();
	}
}

bool TumbleImu::update(Unit &unit)
{
	if (!unit.gyro_sub.update(&unit.gyro)) {
		return false;
	}

	unit.accel_sub.update(&unit.accel);
	unit.seen = unit.seen || unit.accel.timestamp_sample != 0;
	return true;
}

bool TumbleImu::all_are_seen() const
{
	for (const Unit &unit : _units) {
		if (!unit.seen) {
			return false;
		}
	}

	return true;
}

bool TumbleImu::start()
{
	tumble_redundancy_settings settings;
	tumble_redundancy_defaults(&settings);
	settings.third_threshold.number = _param_tmb_acc_thr.get();
	settings.fourth_threshold.number = _param_tmb_gyr_thr.get();

	tumble_unit units[TUMBLE_UNITS];

	for (uint32_t number = 0; number < TUMBLE_UNITS; ++number) {
		tumble_unit_defaults(&units[number], identity(_units[number]));
	}

	const tumble_status status =
		tumble_redundancy_init(&_redundancy, sizeof(_redundancy), &settings, nullptr, units, TUMBLE_UNITS);

	if (status != TUMBLE_OK) {
		PX4_ERR("%s", tumble_strerror(status));
		return false;
	}

	restore();
	_started = true;
	return true;
}

bool TumbleImu::take_in(uint32_t number)
{
	const Unit &unit = _units[number];
	const tumble_sample sample{
		unit.gyro.timestamp_sample,
		{unit.accel.x, unit.accel.y, unit.accel.z},
		{unit.gyro.x, unit.gyro.y, unit.gyro.z},
	};
	tumble_output output;
	const tumble_status status = tumble_redundancy_push(&_redundancy, number, &sample, &on_event, this, &output);

	if (status != TUMBLE_OK) {
		PX4_ERR("%s", tumble_strerror(status));
		return false;
	}

	if (output.source != TUMBLE_NO_SOURCE) {
		publish(output);
	}

	return true;
}

void TumbleImu::publish(const tumble_output &output)
{
	const uint64_t elapsed = output.time - _published;
	const bool usual = _published != 0 && output.time > _published && elapsed < 100_ms;
	_published = output.time;

	if (!usual) {
		return;
	}

	const float seconds = static_cast<float>(elapsed) * 1e-6f;
	vehicle_imu_s imu{};
	imu.timestamp_sample = output.time;
	imu.accel_device_id = _units[output.source].accel.device_id;
	imu.gyro_device_id = _units[output.source].gyro.device_id;
	imu.delta_angle_dt = static_cast<uint32_t>(elapsed);
	imu.delta_velocity_dt = static_cast<uint32_t>(elapsed);

	for (int axis = 0; axis < 3; ++axis) {
		imu.delta_angle[axis] = output.angular_rate[axis] * seconds;
		imu.delta_velocity[axis] = output.specific_force[axis] * seconds;
	}

	imu.timestamp = hrt_absolute_time();
	_vehicle_imu_pub.publish(imu);
}

uint64_t TumbleImu::identity(const Unit &unit)
{
	return (static_cast<uint64_t>(unit.accel.device_id) << 32) | unit.gyro.device_id;
}

void TumbleImu::on_event(void *, const tumble_event *event)
{
	switch (event->kind) {
	case TUMBLE_EVENT_KIND_ADOPTED:
		PX4_INFO("IMU %" PRIu32 ": calibrated", event->unit);
		keep(*event->record);
		break;

	case TUMBLE_EVENT_KIND_UNHEALTHY:
		PX4_WARN("IMU %" PRIu32 ": unhealthy, reason %" PRIu32, event->unit, static_cast<uint32_t>(event->reason));
		break;

	case TUMBLE_EVENT_KIND_SELECTED:
		PX4_INFO("IMU %" PRIu32 ": in use", event->unit);
		break;

	case TUMBLE_EVENT_KIND_NONE_SELECTED:
		PX4_ERR("no IMU is fit");
		break;

	default:
		break;
	}
}

static void name_file(char (&name)[96], const char *end, uint64_t identity, tumble_sensor sensor)
{
	snprintf(name, sizeof(name), PX4_STORAGEDIR "/tumble_%016" PRIx64 "_%" PRIu32 "%s", identity,
		 static_cast<uint32_t>(sensor), end);
}

void TumbleImu::keep(const tumble_record &record)
{
	uint8_t bytes[TUMBLE_RECORD_BYTES];
	size_t length = 0;

	if (tumble_record_encode(&record, bytes, sizeof(bytes), &length) != TUMBLE_OK) {
		return;
	}

	char name[96];
	char temporary[96];
	name_file(name, "", record.identity, record.sensor);
	name_file(temporary, ".new", record.identity, record.sensor);
	FILE *file = fopen(temporary, "wb");
	bool whole = file != nullptr && fwrite(bytes, 1, length, file) == length;

	if (file != nullptr) {
		whole = fclose(file) == 0 && whole;
	}

	if (!whole || rename(temporary, name) != 0) {
		PX4_ERR("%s could not be written", name);
	}
}

void TumbleImu::restore()
{
	for (const Unit &unit : _units) {
		for (tumble_sensor sensor : {TUMBLE_SENSOR_ACCELEROMETER, TUMBLE_SENSOR_GYROSCOPE}) {
			char name[96];
			name_file(name, "", identity(unit), sensor);
			FILE *file = fopen(name, "rb");

			if (file == nullptr) {
				continue;
			}

			uint8_t bytes[TUMBLE_RECORD_BYTES];
			const size_t length = fread(bytes, 1, sizeof(bytes), file);
			fclose(file);
			tumble_record record;
			const tumble_status status = tumble_record_decode(bytes, length, &record);

			if (status == TUMBLE_OK) {
				tumble_redundancy_restore(&_redundancy, &record, &on_event, this);
			} else {
				PX4_WARN("%s: %s", name, tumble_strerror(status));
			}
		}
	}
}

int TumbleImu::task_spawn(int, char *argv[])
{
	_task_id = px4_task_spawn_cmd(MODULE_NAME, SCHED_DEFAULT, SCHED_PRIORITY_DEFAULT, STACK, &run_trampoline, argv);

	if (_task_id < 0) {
		_task_id = -1;
		return PX4_ERROR;
	}

	return PX4_OK;
}

TumbleImu *TumbleImu::instantiate(int, char *[])
{
	return new TumbleImu();
}

int TumbleImu::print_status()
{
	uint32_t source = TUMBLE_NO_SOURCE;

	if (_started && tumble_redundancy_get_source(&_redundancy, &source) == TUMBLE_OK && source != TUMBLE_NO_SOURCE) {
		PX4_INFO("IMU %" PRIu32 " in use", source);
	} else {
		PX4_INFO("no IMU in use");
	}

	return PX4_OK;
}

int TumbleImu::custom_command(int, char *[])
{
	return print_usage("unknown command");
}

int TumbleImu::print_usage(const char *reason)
{
	if (reason != nullptr) {
		PX4_WARN("%s", reason);
	}

	PRINT_MODULE_DESCRIPTION("Keeps redundant IMUs calibrated against the first, and replaces it when it fails.");
	PRINT_MODULE_USAGE_NAME("tumble_imu", "estimator");
	PRINT_MODULE_USAGE_COMMAND("start");
	PRINT_MODULE_USAGE_DEFAULT_COMMANDS();
	return PX4_OK;
}

extern "C" __EXPORT int tumble_imu_main(int argc, char *argv[])
{
	return TumbleImu::main(argc, argv);
}
