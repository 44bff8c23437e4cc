/* NOR flash in memory, with a power supply that can be cut. */

#ifndef RAM_FLASH_H
#define RAM_FLASH_H

#include "tumble.h"

enum { PAGE = 4096, PAGES = 2, FLASH_START = 0x10000 };

typedef struct ram_flash {
    uint8_t bytes[PAGE * PAGES];
    /* Bytes written and pages erased since power came. */
    long written;
    long erased;
    /* Bytes to be written, and pages to be erased, before power is cut; negative: it is not. */
    long cut_after_bytes;
    long cut_after_pages;
    /* State after a cut erasure: 0 nothing done, 1 half of the page, 2 all bits cleared, 3 all erased. */
    int remains;
    int off;
} ram_flash;

/* All erased, and power on. */
void ram_flash_erase(ram_flash *flash);

/* Power comes back. */
void ram_flash_power(ram_flash *flash);

/* Its callbacks. */
tumble_flash ram_flash_driver(ram_flash *flash);

/* A store in all of it, without limit of wear; to be freed. */
tumble_store *ram_flash_open(ram_flash *flash);

#endif
