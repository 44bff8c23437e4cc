/* NOR flash as chips have it: pages are erased to ones, and writing only turns ones into zeros. Here it is in RAM. */
#ifndef FLASH_H
#define FLASH_H

#include "tumble.h"

#define FLASH_PAGE 4096u
#define FLASH_PAGES 4u

/* Functions that Tumble calls. Instead of these bodies, call the driver of your chip. */
struct tumble_flash flash_driver(void);

#endif
