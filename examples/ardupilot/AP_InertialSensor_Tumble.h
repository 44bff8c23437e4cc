/*
  A back end of AP_InertialSensor whose readings are the output of a redundant set: the instances before it are the set's
  units, kept calibrated against the first and excluded when they fail.
 */
#pragma once

#include "AP_InertialSensor.h"
#include "AP_InertialSensor_Backend.h"

#include <tumble.h>

class AP_InertialSensor_Tumble : public AP_InertialSensor_Backend
{
public:
    using AP_InertialSensor_Backend::AP_InertialSensor_Backend;

    void start() override;
    bool update() override;

private:
    bool begin();
    bool read(uint32_t unit, tumble_sample &sample) const;
    void take_in(uint32_t unit);
    void publish(uint64_t time, const float specific_force[3], const float angular_rate[3]);
    void report(const tumble_event &event) const;
    static void on_event(void *context, const tumble_event *event);

    tumble_redundancy _redundancy{};
    uint64_t _now{0};
    bool _registered{false};
    bool _begun{false};
};
