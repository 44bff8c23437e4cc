/* Interfaces of ArduPilot that a back end of AP_InertialSensor uses, with their names: enough to compile one for this machine
   and to run it. */
#pragma once

#include <cfloat>
#include <cstdint>
#include <cstdio>

#define GCS_SEND_TEXT(severity, format, args...) std::printf(#severity " " format "\n", ##args)

inline bool is_positive(float value) { return value >= FLT_EPSILON; }

struct Vector3f {
    float x{0}, y{0}, z{0};

    Vector3f() = default;
    Vector3f(float x0, float y0, float z0) : x(x0), y(y0), z(z0) {}
    const float &operator[](uint8_t axis) const { return (&x)[axis]; }
};

namespace AP_HAL
{
uint64_t micros64();

class Device
{
public:
    enum BusType {
        BUS_TYPE_SERIAL = 6,
    };

    static uint32_t make_bus_id(enum BusType bus_type, uint8_t bus, uint8_t address, uint8_t devtype)
    {
        return bus_type | uint32_t(bus) << 3 | uint32_t(address) << 8 | uint32_t(devtype) << 16;
    }
};
}

class AP_InertialSensor_Backend;

/* The front end: readings of the last loop of each instance, which either a test or a back end gives. */
class AP_InertialSensor
{
public:
    struct Instance {
        uint32_t gyro_id, accel_id;
        bool healthy;
        Vector3f gyro, accel;
    };

    bool register_gyro(uint8_t &instance, uint16_t raw_sample_rate_hz, uint32_t id)
    {
        instance = gyros;
        instances[gyros++].gyro_id = id;
        return raw_sample_rate_hz >= 40;
    }

    bool register_accel(uint8_t &instance, uint16_t raw_sample_rate_hz, uint32_t id)
    {
        instance = accels;
        instances[accels++].accel_id = id;
        return raw_sample_rate_hz >= 40;
    }

    bool calibrating() const { return is_calibrating; }
    uint16_t get_loop_rate_hz(void) const { return 400; }
    uint8_t get_gyro_count(void) const { return gyros; }
    uint8_t get_accel_count(void) const { return accels; }
    bool get_gyro_health(uint8_t instance) const { return instances[instance].healthy; }
    bool get_accel_health(uint8_t instance) const { return instances[instance].healthy; }

    bool get_delta_angle(uint8_t i, Vector3f &delta_angle, float &delta_angle_dt) const
    {
        return over_a_loop(i, instances[i].gyro, delta_angle, delta_angle_dt);
    }

    bool get_delta_velocity(uint8_t i, Vector3f &delta_velocity, float &delta_velocity_dt) const
    {
        return over_a_loop(i, instances[i].accel, delta_velocity, delta_velocity_dt);
    }

    Instance instances[5]{};
    uint8_t gyros{0}, accels{0};
    bool is_calibrating{false};

private:
    bool over_a_loop(uint8_t i, const Vector3f &mean, Vector3f &sum, float &time) const
    {
        time = 1.0f / get_loop_rate_hz();
        sum = {mean.x * time, mean.y * time, mean.z * time};
        return instances[i].healthy;
    }
};

class AP_InertialSensor_Backend
{
public:
    AP_InertialSensor_Backend(AP_InertialSensor &imu) : _imu(imu) {}
    virtual ~AP_InertialSensor_Backend(void) {}
    virtual bool update() = 0;
    virtual void start() {}

    enum DevTypes {
        DEVTYPE_SERIAL = 0x32,
    };

protected:
    AP_InertialSensor &_imu;
    uint8_t gyro_instance{0};
    uint8_t accel_instance{0};

    /* ArduPilot's header calls the rate so. */
    void _notify_new_gyro_raw_sample(uint8_t instance, const Vector3f &accel, uint64_t sample_us=0)
    {
        _imu.instances[instance].gyro = accel;
        _gyro_time = sample_us;
    }

    void _notify_new_accel_raw_sample(uint8_t instance, const Vector3f &accel, uint64_t sample_us=0, bool fsync_set=false)
    {
        _imu.instances[instance].accel = accel;
        _accel_time = fsync_set ? 0 : sample_us;
    }

    void update_gyro(uint8_t instance) { _imu.instances[instance].healthy = _gyro_time == AP_HAL::micros64(); }

    void update_accel(uint8_t instance) { _imu.instances[instance].healthy = _accel_time == AP_HAL::micros64(); }

private:
    uint64_t _gyro_time{0}, _accel_time{0};
};
