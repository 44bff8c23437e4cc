#include "fuzz.h"

#include <string.h>

uint8_t *flash_memory;
uint32_t flash_faults;
bool flash_judged;

/** Fails the driver, or lets it go on. */
static bool faulty(void)
{
    return flash_faults != 0 && draw_once_in(flash_faults);
}

static bool is_inside(uint32_t address, uint32_t length)
{
    const bool inside =
        address >= FLASH_START && length <= FLASH_BYTES && address - FLASH_START <= FLASH_BYTES - length;
    CHECK(inside || !flash_judged, "flash was used outside of the store's range");
    return inside;
}

static void *context_of(void)
{
    return &flash;
}

/** A call from within a call is refused. */
static void call_within(void)
{
    if (draw_once_in(64)) {
        uint32_t entries;
        CHECK(tumble_store_get_entries(store, &entries) != TUMBLE_OK, "a store was used from its own driver");
        CHECK(tumble_store_erase(store) != TUMBLE_OK, "a store was erased from its own driver");
    }
}

static int flash_read(void *context, uint32_t address, uint8_t *bytes, uint32_t length)
{
    CHECK(context == context_of(), "another context than was given");
    CHECK(address % 32 == 0 && length % 32 == 0 && (uintptr_t)bytes % 4 == 0,
          "a read that is not whole words");
    call_within();
    if (!is_inside(address, length) || faulty()) {
        return -1;
    }
    memcpy(bytes, flash_memory + (address - FLASH_START), length);
    if (faulty()) {
        bytes[draw_below(length)] ^= (uint8_t)(1u << draw_below(8));
    }
    return 0;
}

static int flash_write(void *context, uint32_t address, const uint8_t *bytes, uint32_t length)
{
    CHECK(context == context_of(), "another context than was given");
    CHECK(address % 32 == 0 && length % 32 == 0 && (uintptr_t)bytes % 4 == 0,
          "a write that is not whole words");
    call_within();
    if (!is_inside(address, length)) {
        return -1;
    }
    const bool cut = faulty();
    const uint32_t count = cut ? draw_below(length) : length;
    uint8_t *const at = flash_memory + (address - FLASH_START);
    for (uint32_t i = 0; i < count; i++) {
        CHECK(at[i] == 0xFF || !flash_judged, "it was written to flash that is not erased");
        at[i] &= bytes[i];
    }
    return cut && draw_once_in(2) ? -1 : 0;
}

static int flash_erase(void *context, uint32_t address)
{
    CHECK(context == context_of(), "another context than was given");
    call_within();
    if (flash.page == 0 || !is_inside(address, flash.page)) {
        return -1;
    }
    const bool cut = faulty();
    memset(flash_memory + (address - FLASH_START), 0xFF, cut ? draw_below(flash.page) : flash.page);
    return cut && draw_once_in(2) ? 1 : 0;
}

tumble_flash flash = {
    .context = &flash,
    .read = flash_read,
    .write = flash_write,
    .erase = flash_erase,
    .page = 2048,
};
