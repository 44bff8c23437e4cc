#include "flash.h"

#include <string.h>

static uint8_t cells[FLASH_PAGES * FLASH_PAGE];

static int lies_outside(uint32_t address, uint32_t length)
{
    return address > sizeof cells || length > sizeof cells - address;
}

static int read(void *context, uint32_t address, uint8_t *bytes, uint32_t length)
{
    (void)context;
    if (lies_outside(address, length)) {
        return -1;
    }
    memcpy(bytes, cells + address, length);
    return 0;
}

static int write(void *context, uint32_t address, const uint8_t *bytes, uint32_t length)
{
    (void)context;
    if (lies_outside(address, length)) {
        return -1;
    }
    for (uint32_t i = 0; i < length; ++i) {
        cells[address + i] &= bytes[i];
    }
    return 0;
}

static int erase(void *context, uint32_t address)
{
    (void)context;
    if (lies_outside(address, FLASH_PAGE)) {
        return -1;
    }
    memset(cells + address, 0xFF, FLASH_PAGE);
    return 0;
}

struct tumble_flash flash_driver(void)
{
    const struct tumble_flash flash = {NULL, read, write, erase, FLASH_PAGE};
    return flash;
}
