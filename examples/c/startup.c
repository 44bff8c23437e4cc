/* From reset to main: what a vendor's start-up file does. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define COPROCESSOR_ACCESS ((volatile uint32_t *)0xE000ED88u)
#define FLOATING_POINT_UNIT (0xFu << 20)

/* Symbols of the linker script. */
extern uint8_t data_begin[], data_end[], data_in_flash[], bss_begin[], bss_end[], stack_top[];

/* Function of newlib: opens the channel to the debugger. */
void initialise_monitor_handles(void);

int main(void);
void on_reset(void);

void on_reset(void)
{
    *COPROCESSOR_ACCESS |= FLOATING_POINT_UNIT;
    __asm volatile("dsb\n isb" ::: "memory");
    memcpy(data_begin, data_in_flash, (size_t)(data_end - data_begin));
    memset(bss_begin, 0, (size_t)(bss_end - bss_begin));
    initialise_monitor_handles();
    exit(main());
}

static void on_fault(void)
{
    static const char text[] = "fault\n";
    /* Semihosting: SYS_WRITE0, then SYS_EXIT for another reason than the end of the program. */
    register uint32_t operation __asm("r0") = 0x04;
    register uint32_t argument __asm("r1") = (uint32_t)text;
    __asm volatile("bkpt 0xAB" : "+r"(operation) : "r"(argument) : "memory");
    operation = 0x18;
    argument = 0x20023;
    __asm volatile("bkpt 0xAB" : "+r"(operation) : "r"(argument) : "memory");
    for (;;) {
    }
}

struct vectors {
    uint8_t *stack;
    void (*handlers[15])(void);
};

__attribute__((section(".vectors"), used)) static const struct vectors vectors = {
    stack_top,
    {on_reset, on_fault, on_fault, on_fault, on_fault, on_fault},
};
