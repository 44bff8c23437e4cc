/* Records to test with. */

#ifndef RECORDS_H
#define RECORDS_H

#include "tumble.h"

/* The example of docs/record-format.md. */
tumble_record example_record(void);

/* The same, the so-manieth calibration of a sensor. */
tumble_record record_of(tumble_sensor sensor, uint32_t sequence);

/* Checks that two records are the same, bit for bit. */
bool same_record(const tumble_record *a, const tumble_record *b);

#endif
