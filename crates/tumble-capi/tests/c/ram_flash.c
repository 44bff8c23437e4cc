#include "ram_flash.h"

#include <string.h>

#include "laws.h"

enum { WORD = 32 };

/* Where an address lies in memory; an address beyond the flash is a mistake of the library. */
static size_t place_of(uint32_t address, uint32_t length)
{
    CHECK(address >= FLASH_START && address - FLASH_START + length <= PAGE * PAGES);
    return address - FLASH_START;
}

static int read_bytes(void *context, uint32_t address, uint8_t *bytes, uint32_t length)
{
    ram_flash *flash = (ram_flash *)context;
    CHECK(address % WORD == 0 && length % WORD == 0 && (uintptr_t)bytes % 4 == 0);
    if (flash->off) {
        return -1;
    }
    memcpy(bytes, flash->bytes + place_of(address, length), length);
    return 0;
}

static int write_bytes(void *context, uint32_t address, const uint8_t *bytes, uint32_t length)
{
    ram_flash *flash = (ram_flash *)context;
    const size_t place = place_of(address, length);
    CHECK(address % WORD == 0 && length % WORD == 0 && (uintptr_t)bytes % 4 == 0);
    for (uint32_t i = 0; i < length; ++i) {
        if (flash->off || flash->written == flash->cut_after_bytes) {
            flash->off = 1;
            return -1;
        }
        CHECK(flash->bytes[place + i] == 0xFF);
        flash->bytes[place + i] &= bytes[i];
        ++flash->written;
    }
    return 0;
}

static void leave(const ram_flash *flash, uint8_t *page)
{
    switch (flash->remains) {
    case 1:
        memset(page + PAGE / 2, 0xFF, PAGE / 2);
        break;
    case 2:
        memset(page, 0, PAGE);
        break;
    case 3:
        memset(page, 0xFF, PAGE);
        break;
    default:
        break;
    }
}

static int erase_page(void *context, uint32_t address)
{
    ram_flash *flash = (ram_flash *)context;
    uint8_t *page = flash->bytes + place_of(address, PAGE);
    CHECK(address % PAGE == 0);
    if (flash->off) {
        return -1;
    }
    if (flash->erased == flash->cut_after_pages) {
        leave(flash, page);
        flash->off = 1;
        return -1;
    }
    memset(page, 0xFF, PAGE);
    ++flash->erased;
    return 0;
}

void ram_flash_erase(ram_flash *flash)
{
    memset(flash->bytes, 0xFF, sizeof flash->bytes);
    ram_flash_power(flash);
}

void ram_flash_power(ram_flash *flash)
{
    flash->written = 0;
    flash->erased = 0;
    flash->cut_after_bytes = -1;
    flash->cut_after_pages = -1;
    flash->remains = 0;
    flash->off = 0;
}

tumble_flash ram_flash_driver(ram_flash *flash)
{
    const tumble_flash driver = {flash, read_bytes, write_bytes, erase_page, PAGE};
    return driver;
}

tumble_store *ram_flash_open(ram_flash *flash)
{
    const tumble_flash driver = ram_flash_driver(flash);
    const tumble_write_limit unlimited = {0, 1};
    tumble_store *store = NEW(tumble_store);
    ANSWERS(TUMBLE_OK,
            tumble_store_init(store, sizeof *store, &driver, FLASH_START, PAGE * PAGES, &unlimited));
    return store;
}
