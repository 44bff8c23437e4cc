/* A module of PX4: keeps the IMUs of a vehicle calibrated against the first, and publishes the output of the set. */
#pragma once

#include <drivers/drv_hrt.h>
#include <px4_platform_common/log.h>
#include <px4_platform_common/module.h>
#include <px4_platform_common/module_params.h>
#include <px4_platform_common/posix.h>
#include <px4_platform_common/tasks.h>
#include <uORB/Publication.hpp>
#include <uORB/Subscription.hpp>
#include <uORB/topics/actuator_armed.h>
#include <uORB/topics/sensor_accel.h>
#include <uORB/topics/sensor_gyro.h>
#include <uORB/topics/vehicle_imu.h>

#include <tumble.h>

class TumbleImu : public ModuleBase<TumbleImu>, public ModuleParams
{
public:
	TumbleImu();
	~TumbleImu() override = default;

	static int task_spawn(int argc, char *argv[]);
	static TumbleImu *instantiate(int argc, char *argv[]);
	static int custom_command(int argc, char *argv[]);
	static int print_usage(const char *reason = nullptr);
	void run() override;
	int print_status() override;

private:
	/* Last publications of one unit. */
	struct Unit {
		uORB::Subscription accel_sub;
		uORB::Subscription gyro_sub;
		sensor_accel_s accel{};
		sensor_gyro_s gyro{};
		bool seen{false};
		/* True if its files were read. */
		bool restored{false};
	};

	/* A record that goes to the memory card when there is time. */
	struct Adopted {
		tumble_record record{};
		bool waits{false};
		uint64_t again{0};
	};

	bool step();
	bool update(Unit &unit);
	bool may_start() const;
	bool start();
	bool take_in(uint32_t number);
	void publish(const tumble_output &output);
	void use_files();
	bool save_one();
	bool save(const tumble_record &record, uint64_t identity);
	void restore(uint32_t number);
	void restore(uint32_t number, tumble_sensor sensor);
	void tell(const tumble_event &event);
	static uint64_t identity(const Unit &unit);
	static void on_event(void *context, const tumble_event *event);

	uORB::Publication<vehicle_imu_s> _vehicle_imu_pub{ORB_ID(vehicle_imu)};
	uORB::Subscription _armed_sub{ORB_ID(actuator_armed)};
	actuator_armed_s _armed{};
	Unit _units[TUMBLE_UNITS];
	Adopted _adopted[TUMBLE_UNITS][2];
	tumble_redundancy _redundancy{};
	uint64_t _began{0};
	uint64_t _published{0};
	bool _started{false};

	DEFINE_PARAMETERS(
		(ParamFloat<px4::params::TMB_ACC_THR>) _param_tmb_acc_thr,
		(ParamFloat<px4::params::TMB_GYR_THR>) _param_tmb_gyr_thr
	)
};
