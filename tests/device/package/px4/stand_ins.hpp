/* Interfaces of PX4 that a module uses, with their names: enough to compile one for this machine and to run it. */
#pragma once

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <string>

#define __EXPORT
#define MODULE_NAME "tumble_imu"
#define PX4_OK 0
#define PX4_ERROR (-1)
#define PX4_INFO(...) (std::printf("INFO " __VA_ARGS__), std::puts(""))
#define PX4_WARN(...) (std::printf("WARN " __VA_ARGS__), std::puts(""))
#define PX4_ERR(...) (std::printf("ERROR " __VA_ARGS__), std::puts(""))
#define PRINT_MODULE_DESCRIPTION(text) std::puts(text)
#define PRINT_MODULE_USAGE_NAME(name, category) std::puts(name " " category)
#define PRINT_MODULE_USAGE_COMMAND(name) std::puts(name)
#define PRINT_MODULE_USAGE_DEFAULT_COMMANDS() std::puts("stop status")

namespace time_literals
{
constexpr unsigned long long operator""_us(unsigned long long time) { return time; }
constexpr unsigned long long operator""_ms(unsigned long long time) { return time * 1000; }
constexpr unsigned long long operator""_s(unsigned long long time) { return time * 1000000; }
}

#define SCHED_DEFAULT 0
#define SCHED_PRIORITY_DEFAULT 0

using px4_main_t = int (*)(int, char *[]);

uint64_t hrt_absolute_time();
int px4_usleep(unsigned microseconds);

/* The task runs at once, to its end. */
inline int px4_task_spawn_cmd(const char *, int, int, int, px4_main_t entry, char *const argv[])
{
	char name[] = MODULE_NAME;
	char *words[] = {name, argv[0], nullptr};
	return entry(2, words) == PX4_OK ? 1 : -1;
}

struct actuator_armed_s {
	uint64_t timestamp;
	bool armed, prearmed, ready_to_arm, lockdown, kill, termination, in_esc_calibration_mode;
};

struct sensor_accel_s {
	uint64_t timestamp, timestamp_sample;
	uint32_t device_id, error_count;
	float x, y, z, temperature;
	uint8_t clip_counter[3], samples;
	static constexpr unsigned ORB_QUEUE_LENGTH = 8;
};

struct sensor_gyro_s {
	uint64_t timestamp, timestamp_sample;
	uint32_t device_id, error_count;
	float x, y, z, temperature;
	uint8_t clip_counter[3], samples;
	static constexpr unsigned ORB_QUEUE_LENGTH = 8;
};

struct vehicle_imu_s {
	uint64_t timestamp, timestamp_sample;
	uint32_t accel_device_id, gyro_device_id;
	float delta_angle[3], delta_velocity[3];
	uint32_t delta_angle_dt, delta_velocity_dt;
	uint8_t delta_angle_clipping, delta_velocity_clipping, accel_calibration_count, gyro_calibration_count;
};

enum class ORB_ID { actuator_armed, sensor_accel, sensor_gyro, vehicle_imu };
#define ORB_ID(name) ORB_ID::name

/* Last publication on an instance of a topic, and the number of publications. */
template<class Message> struct Topic {
	std::deque<Message> queue;
	uint64_t count{0};

	static Topic &of(unsigned instance)
	{
		static Topic topics[4];
		return topics[instance];
	}

	void publish(const Message &message)
	{
		queue.push_back(message);
		++count;

		if (queue.size() > 8) {
			queue.pop_front();
		}
	}
};

namespace uORB
{
class Subscription
{
public:
	Subscription(ORB_ID, uint8_t instance = 0) : _instance(instance) {}

	template<class Message> bool update(Message *message)
	{
		const Topic<Message> &topic = Topic<Message>::of(_instance);

		if (_read == topic.count) {
			return false;
		}

		const uint64_t oldest = topic.count - topic.queue.size();
		_read = _read < oldest ? oldest : _read;
		*message = topic.queue[_read - oldest];
		++_read;
		return true;
	}

private:
	uint8_t _instance;
	uint64_t _read{0};
};

template<class Message> class Publication
{
public:
	explicit Publication(ORB_ID) {}

	bool publish(const Message &message)
	{
		Topic<Message>::of(0).publish(message);
		return true;
	}
};
}

namespace px4
{
enum class params { TMB_ACC_THR, TMB_GYR_THR };
}

template<px4::params> class ParamFloat
{
public:
	float get() const;
};

/* PX4 takes each parameter as (type) name; so does this, for the two that there are. */
#define PARAMETER_TYPE(...) __VA_ARGS__
#define PARAMETER(parameter) PARAMETER_TYPE parameter;
#define DEFINE_PARAMETERS(first, second) \
	PARAMETER(first) \
	PARAMETER(second)

class ModuleParams
{
public:
	explicit ModuleParams(ModuleParams *) {}
};

template<class Module> class ModuleBase
{
public:
	virtual ~ModuleBase() = default;
	virtual void run() = 0;
	virtual int print_status() = 0;

	static int main(int argc, char *argv[])
	{
		const std::string command = argc > 1 ? argv[1] : "";

		if (command == "start") {
			_stop = false;
			return Module::task_spawn(argc - 1, argv + 1);
		}

		if (command == "stop") {
			_stop = true;
			return PX4_OK;
		}

		return command == "status" ? get_instance()->print_status() : Module::custom_command(argc - 1, argv + 1);
	}

	static Module *get_instance() { return _object.load(); }

protected:
	bool should_exit() const { return _stop; }

	static int run_trampoline(int argc, char *argv[])
	{
		_object.store(Module::instantiate(argc - 1, argv + 1));
		_object.load()->run();
		delete _object.load();
		_object.store(nullptr);
		return PX4_OK;
	}

	inline static std::atomic<Module *> _object{nullptr};
	inline static int _task_id{-1};

private:
	inline static bool _stop{false};
};
