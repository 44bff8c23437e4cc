/* Corrects readings by an exported calibration, as a constant and as records, and prints the bits of what comes out.
   unit.h and records.h are exported, readings.h holds rows of specific force, angular rate and temperature. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "unit.h"
#include "records.h"
#include "readings.h"

#define NEED(call) if ((call) != TUMBLE_OK) return 1

static int decode(const uint8_t *error, size_t length, const uint8_t *change, tumble_error_model *model,
                  tumble_temperature_drift *drift)
{
    tumble_record record;
    tumble_drift_record of_temperature;
    NEED(tumble_record_decode(error, length, &record));
    NEED(tumble_drift_decode(change, TUMBLE_DRIFT_BYTES, &of_temperature));
    memcpy(model->matrix, record.matrix, sizeof model->matrix);
    memcpy(model->bias, record.bias, sizeof model->bias);
    *drift = of_temperature.drift;
    return 0;
}

static int correct(const tumble_calibration *calibration, const tumble_temperature_drift *of_force,
                   const tumble_temperature_drift *of_rate)
{
    tumble_correction correction;
    NEED(tumble_correction_init(&correction, calibration));
    for (size_t row = 0; row < sizeof readings / sizeof readings[0]; ++row) {
        const float *reading = readings[row], temperature = reading[6];
        tumble_sample sample = {.time = row};
        float *force = sample.specific_force, *rate = sample.angular_rate;
        NEED(tumble_temperature_drift_remove(of_force, calibration->accelerometer.bias, temperature, reading, force));
        NEED(tumble_temperature_drift_remove(of_rate, calibration->gyroscope.bias, temperature, reading + 3, rate));
        NEED(tumble_correction_apply(&correction, &sample, &sample));
        for (int i = 0; i < 6; ++i) {
            uint32_t bits;
            memcpy(&bits, i < 3 ? &force[i] : &rate[i - 3], sizeof bits);
            printf("%08lx ", (unsigned long)bits);
        }
    }
    return 0;
}

int main(void)
{
    tumble_calibration stored;
    tumble_temperature_drift of_force, of_rate;
    NEED(decode(record_accelerometer, sizeof record_accelerometer, record_accelerometer_drift, &stored.accelerometer,
                &of_force));
    NEED(decode(record_gyroscope, sizeof record_gyroscope, record_gyroscope_drift, &stored.gyroscope, &of_rate));
    return correct(&unit, &unit_accelerometer_drift, &unit_gyroscope_drift) || correct(&stored, &of_force, &of_rate);
}
