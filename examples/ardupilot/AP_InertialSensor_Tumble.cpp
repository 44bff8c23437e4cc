#include <AP_HAL/AP_HAL.h>
#include <GCS_MAVLink/GCS.h>

#include "AP_InertialSensor_Tumble.h"

/* ArduPilot's axes are forward, right, down; at rest an accelerometer reads -g down, which is +g up, as Tumble has it. */

/* A bus number of its own. The kind of device is the one that arming checks allow to be sampled at the loop rate. */
static constexpr uint8_t BUS = 31;

void AP_InertialSensor_Tumble::start()
{
    const uint16_t rate = _imu.get_loop_rate_hz();
    const auto id = [](uint8_t address) {
        return AP_HAL::Device::make_bus_id(AP_HAL::Device::BUS_TYPE_SERIAL, BUS, address, DEVTYPE_SERIAL);
    };
    /* Readings of an instance and not of a sensor are pushed, so both sensors of a unit have to have the same number. */
    const bool units_are_all = _imu.get_gyro_count() == TUMBLE_UNITS && _imu.get_accel_count() == TUMBLE_UNITS;

    if (!units_are_all) {
        GCS_SEND_TEXT(MAV_SEVERITY_CRITICAL, "Tumble: %u gyros and %u accels instead of %u", unsigned(_imu.get_gyro_count()),
                      unsigned(_imu.get_accel_count()), unsigned(TUMBLE_UNITS));
        return;
    }

    _registered = _imu.register_gyro(gyro_instance, rate, id(1)) && _imu.register_accel(accel_instance, rate, id(2));
}

/* The front end calls back ends in the order in which they were added, so that readings of the units are there. */
bool AP_InertialSensor_Tumble::update()
{
    if (!_registered) {
        return false;
    }

    _now = AP_HAL::micros64();

    if (_imu.calibrating()) {
        /* Offsets are being changed under the set. The accelerometers' calibration waits for every instance. */
        tumble_sample sample;
        _begun = false;

        if (read(0, sample)) {
            publish(_now, sample.specific_force, sample.angular_rate);
        }
    } else if (_begun || begin()) {
        for (uint32_t unit = 0; unit < TUMBLE_UNITS; ++unit) {
            take_in(unit);
        }
    }

    update_accel(accel_instance);
    update_gyro(gyro_instance);
    return true;
}

bool AP_InertialSensor_Tumble::begin()
{
    tumble_redundancy_settings settings;
    tumble_unit units[TUMBLE_UNITS];
    tumble_status status = tumble_redundancy_defaults(&settings);

    for (uint32_t unit = 0; unit < TUMBLE_UNITS && status == TUMBLE_OK; ++unit) {
        status = tumble_unit_defaults(&units[unit], unit);
    }

    if (status == TUMBLE_OK) {
        status = tumble_redundancy_init(&_redundancy, sizeof(_redundancy), &settings, nullptr, units, TUMBLE_UNITS);
    }

    _begun = status == TUMBLE_OK;

    if (!_begun) {
        /* Settings are constant, so that another attempt would end alike. */
        _registered = false;
        GCS_SEND_TEXT(MAV_SEVERITY_CRITICAL, "Tumble: %s", tumble_strerror(status));
    }

    return _begun;
}

/* Mean over the last loop of what a unit measured, corrected and turned by ArduPilot, not filtered; false if it sent nothing. */
bool AP_InertialSensor_Tumble::read(uint32_t unit, tumble_sample &sample) const
{
    Vector3f angle;
    Vector3f velocity;
    float angle_time;
    float velocity_time;

    if (!_imu.get_gyro_health(unit) || !_imu.get_accel_health(unit) || !_imu.get_delta_angle(unit, angle, angle_time) ||
        !_imu.get_delta_velocity(unit, velocity, velocity_time) || !is_positive(angle_time) || !is_positive(velocity_time)) {
        return false;
    }

    sample.time = _now;

    for (uint8_t axis = 0; axis < 3; ++axis) {
        sample.specific_force[axis] = velocity[axis] / velocity_time;
        sample.angular_rate[axis] = angle[axis] / angle_time;
    }

    return true;
}

void AP_InertialSensor_Tumble::take_in(uint32_t unit)
{
    tumble_sample sample;
    tumble_output output;

    if (!read(unit, sample)) {
        return;
    }

    const tumble_status status = tumble_redundancy_push(&_redundancy, unit, &sample, &on_event, this, &output);

    if (status == TUMBLE_OK && output.source != TUMBLE_NO_SOURCE) {
        publish(output.time, output.specific_force, output.angular_rate);
    }
}

/* Neither rotated nor corrected here: the units' readings were. */
void AP_InertialSensor_Tumble::publish(uint64_t time, const float specific_force[3], const float angular_rate[3])
{
    const Vector3f accel{specific_force[0], specific_force[1], specific_force[2]};
    const Vector3f gyro{angular_rate[0], angular_rate[1], angular_rate[2]};
    _notify_new_accel_raw_sample(accel_instance, accel, time);
    _notify_new_gyro_raw_sample(gyro_instance, gyro, time);
}

void AP_InertialSensor_Tumble::on_event(void *context, const tumble_event *event)
{
    static_cast<const AP_InertialSensor_Tumble *>(context)->report(*event);
}

/* ArduPilot counts IMUs from 1 in its messages. */
void AP_InertialSensor_Tumble::report(const tumble_event &event) const
{
    const unsigned number = unsigned(event.unit) + 1;

    switch (event.kind) {
    case TUMBLE_EVENT_KIND_ADOPTED:
        GCS_SEND_TEXT(MAV_SEVERITY_INFO, "Tumble: IMU%u calibrated", number);
        break;

    case TUMBLE_EVENT_KIND_UNHEALTHY:
        GCS_SEND_TEXT(MAV_SEVERITY_WARNING, "Tumble: IMU%u unhealthy, reason %u", number, unsigned(event.reason));
        break;

    case TUMBLE_EVENT_KIND_HEALTHY:
        GCS_SEND_TEXT(MAV_SEVERITY_INFO, "Tumble: IMU%u healthy", number);
        break;

    case TUMBLE_EVENT_KIND_SELECTED:
        GCS_SEND_TEXT(MAV_SEVERITY_WARNING, "Tumble: IMU%u in use", number);
        break;

    case TUMBLE_EVENT_KIND_NONE_SELECTED:
        GCS_SEND_TEXT(MAV_SEVERITY_CRITICAL, "Tumble: no IMU in use");
        break;

    default:
        break;
    }
}
