/* The program that all packages link, as ESP-IDF calls it. */
#define main consumer
#include "../../../consumer/main.c"
#undef main

void app_main(void);

void app_main(void)
{
    consumer();
}
