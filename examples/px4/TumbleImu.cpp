#include "TumbleImu.hpp"

#include <inttypes.h>
#include <stdio.h>

/* PX4's axes are forward, right, down; at rest an accelerometer reads -g down, which is +g up, as Tumble has it. */

using namespace time_literals;

/* A timer instead of a topic: the unit that publishes it may fail. */
static constexpr unsigned INTERVAL = 2500_us;

/* A task of its own: a fit takes 4 kB of stack, more than work queues have. */
static constexpr int STACK = 8192;

/* A unit that sends nothing for so long after the start is not waited for. */
static constexpr uint64_t PATIENCE = 2_s;

/* A card that is full or missing is not tried again at every step. */
static constexpr uint64_t BETWEEN_ATTEMPTS = 10_s;

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
	_began = hrt_absolute_time();

	while (!should_exit() && step()) {
		px4_usleep(INTERVAL);
	}
}

bool TumbleImu::step()
{
	for (uint32_t number = 0; number < TUMBLE_UNITS; ++number) {
		while (update(_units[number])) {
			if (_started && _units[number].seen && !take_in(number)) {
				return false;
			}
		}
	}

	if (_started) {
		use_files();
		return true;
	}

	return !may_start() || start();
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

bool TumbleImu::may_start() const
{
	for (const Unit &unit : _units) {
		if (!unit.seen) {
			return hrt_absolute_time() - _began > PATIENCE;
		}
	}

	return true;
}

bool TumbleImu::start()
{
	tumble_redundancy_settings settings;
	tumble_redundancy_defaults(&settings);
	settings.secondary_accelerometer_threshold.number = _param_tmb_acc_thr.get();
	settings.secondary_gyroscope_threshold.number = _param_tmb_gyr_thr.get();

	tumble_unit units[TUMBLE_UNITS];

	for (uint32_t number = 0; number < TUMBLE_UNITS; ++number) {
		/* The device numbers of a unit that comes late are not known yet; only the files need them. */
		tumble_unit_defaults(&units[number], number);

		if (!_units[number].seen) {
			PX4_WARN("IMU %" PRIu32 ": says nothing; started without it", number);
		}
	}

	const tumble_status status =
		tumble_redundancy_init(&_redundancy, sizeof(_redundancy), &settings, nullptr, units, TUMBLE_UNITS);

	if (status != TUMBLE_OK) {
		PX4_ERR("%s", tumble_strerror(status));
		return false;
	}

	for (uint32_t number = 0; number < TUMBLE_UNITS; ++number) {
		restore(number);
	}

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

void TumbleImu::on_event(void *context, const tumble_event *event)
{
	static_cast<TumbleImu *>(context)->tell(*event);
}

void TumbleImu::tell(const tumble_event &event)
{
	switch (event.kind) {
	case TUMBLE_EVENT_KIND_ADOPTED:
		PX4_INFO("IMU %" PRIu32 ": calibrated", event.unit);
		/* Only copied: the output waits for the push that calls this. */
		_adopted[event.unit][event.record->sensor] = {*event.record, true, 0};
		break;

	case TUMBLE_EVENT_KIND_UNHEALTHY:
		PX4_WARN("IMU %" PRIu32 ": unhealthy, reason %" PRIu32, event.unit, static_cast<uint32_t>(event.reason));
		break;

	case TUMBLE_EVENT_KIND_HEALTHY:
		PX4_INFO("IMU %" PRIu32 ": healthy", event.unit);
		break;

	case TUMBLE_EVENT_KIND_SELECTED:
		PX4_INFO("IMU %" PRIu32 ": in use", event.unit);
		break;

	case TUMBLE_EVENT_KIND_NONE_SELECTED:
		PX4_ERR("no IMU is fit");
		break;

	default:
		break;
	}
}

/* Writing a file takes longer than a sample period: never in flight, and one record per step. */
void TumbleImu::use_files()
{
	_armed_sub.update(&_armed);

	if (_armed.armed || save_one()) {
		return;
	}

	for (uint32_t number = 0; number < TUMBLE_UNITS; ++number) {
		if (!_units[number].restored) {
			restore(number);
		}
	}
}

/* Saves the next record that waits; returns whether there was one. */
bool TumbleImu::save_one()
{
	const uint64_t now = hrt_absolute_time();

	for (uint32_t number = 0; number < TUMBLE_UNITS; ++number) {
		for (Adopted &adopted : _adopted[number]) {
			if (adopted.waits && now >= adopted.again) {
				adopted.waits = !save(adopted.record, identity(_units[number]));
				adopted.again = now + BETWEEN_ATTEMPTS;
				return true;
			}
		}
	}

	return false;
}

static void name_file(char (&name)[96], const char *end, uint64_t identity, tumble_sensor sensor)
{
	snprintf(name, sizeof(name), PX4_STORAGEDIR "/tumble_%016" PRIx64 "_%" PRIu32 "%s", identity,
		 static_cast<uint32_t>(sensor), end);
}

bool TumbleImu::save(const tumble_record &record, uint64_t identity)
{
	tumble_record named = record;
	named.identity = identity;
	uint8_t bytes[TUMBLE_RECORD_BYTES];
	size_t length = 0;
	const tumble_status status = tumble_record_encode(&named, bytes, sizeof(bytes), &length);

	char name[96];
	char temporary[96];
	name_file(name, "", identity, record.sensor);
	name_file(temporary, ".new", identity, record.sensor);
	FILE *file = status == TUMBLE_OK ? fopen(temporary, "wb") : nullptr;
	bool whole = file != nullptr && fwrite(bytes, 1, length, file) == length;

	if (file != nullptr) {
		whole = fclose(file) == 0 && whole;
	}

	if (!whole || rename(temporary, name) != 0) {
		PX4_ERR("%s could not be written", name);
		return false;
	}

	return true;
}

void TumbleImu::restore(uint32_t number)
{
	if (_units[number].seen) {
		restore(number, TUMBLE_SENSOR_ACCELEROMETER);
		restore(number, TUMBLE_SENSOR_GYROSCOPE);
		_units[number].restored = true;
	}
}

void TumbleImu::restore(uint32_t number, tumble_sensor sensor)
{
	if (_adopted[number][sensor].waits) {
		/* It is newer than what is in the file. */
		return;
	}

	char name[96];
	name_file(name, "", identity(_units[number]), sensor);
	FILE *file = fopen(name, "rb");

	if (file == nullptr) {
		return;
	}

	uint8_t bytes[TUMBLE_RECORD_BYTES];
	const size_t length = fread(bytes, 1, sizeof(bytes), file);
	fclose(file);
	tumble_record record;
	const tumble_status status = tumble_record_decode(bytes, length, &record);

	if (status != TUMBLE_OK) {
		PX4_WARN("%s: %s", name, tumble_strerror(status));
		return;
	}

	/* The monitor's number of the unit. */
	record.identity = number;
	tumble_redundancy_restore(&_redundancy, &record, &on_event, this);
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
