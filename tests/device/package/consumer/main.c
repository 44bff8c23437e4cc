/* Makes a redundant set of as many units as the package states, and prints the outcome. */
#include <stdio.h>

#include "tumble.h"

#ifdef TUMBLE_WITHOUT_REDUNDANCY
int main(void)
{
    printf("no redundant sets: %s\n", tumble_strerror(TUMBLE_OK));
    return 0;
}
#else
static tumble_redundancy redundancy;

int main(void)
{
    struct tumble_redundancy_settings settings;
    struct tumble_unit units[TUMBLE_UNITS];
    tumble_redundancy_defaults(&settings);
    for (uint64_t unit = 0; unit < TUMBLE_UNITS; ++unit) {
        tumble_unit_defaults(&units[unit], 100 + unit);
    }
    const tumble_status status =
        tumble_redundancy_init(&redundancy, sizeof redundancy, &settings, NULL, units, TUMBLE_UNITS);
    printf("%d units: %s\n", TUMBLE_UNITS, tumble_strerror(status));
    return status == TUMBLE_OK ? 0 : 1;
}
#endif
