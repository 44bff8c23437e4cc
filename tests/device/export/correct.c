/* Corrects readings by an exported calibration, as a constant and as records, and prints the bits of what comes out.
   unit.h and records.h are exported, readings.h holds rows of specific force, angular rate and temperature. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "unit.h"
#include "records.h"
#include "readings.h"

#define NEED(call) if ((call) != TUMBLE_OK) return 1

static int correct(const tumble_correction *correction, const tumble_temperature_drift *of_force,
                   const tumble_temperature_drift *of_rate)
{
    for (size_t row = 0; row < sizeof readings / sizeof readings[0]; ++row) {
        const float *reading = readings[row], temperature = reading[6];
        tumble_sample sample = {.time = row};
        float *force = sample.specific_force, *rate = sample.angular_rate;
        NEED(tumble_temperature_drift_remove(of_force, correction->accelerometer.bias, temperature, reading, force));
        NEED(tumble_temperature_drift_remove(of_rate, correction->gyroscope.bias, temperature, reading + 3, rate));
        NEED(tumble_correction_apply(correction, &sample, &sample));
        for (int i = 0; i < 6; ++i) {
            uint32_t bits;
            memcpy(&bits, i < 3 ? &force[i] : &rate[i - 3], sizeof bits);
            printf("%08lx ", (unsigned long)bits);
        }
    }
    return 0;
}

static int correct_by_constant(void)
{
    tumble_correction correction;
    NEED(tumble_correction_init(&correction, &unit));
    return correct(&correction, &unit_accelerometer_drift, &unit_gyroscope_drift);
}

static int correct_by_records(void)
{
    tumble_record force, rate;
    tumble_drift_record of_force, of_rate;
    tumble_correction correction;
    NEED(tumble_record_decode(record_accelerometer, sizeof record_accelerometer, &force));
    NEED(tumble_record_decode(record_gyroscope, sizeof record_gyroscope, &rate));
    NEED(tumble_drift_decode(record_accelerometer_drift, TUMBLE_DRIFT_BYTES, &of_force));
    NEED(tumble_drift_decode(record_gyroscope_drift, TUMBLE_DRIFT_BYTES, &of_rate));
    NEED(tumble_correction_from_records(&correction, &force, &rate));
    return correct(&correction, &of_force.drift, &of_rate.drift);
}

int main(void)
{
    return correct_by_constant() || correct_by_records();
}
