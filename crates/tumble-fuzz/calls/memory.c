#define _DEFAULT_SOURCE
#include "fuzz.h"

#include <sys/mman.h>
#include <unistd.h>

void *memory_ending(size_t size)
{
    const size_t page = (size_t)sysconf(_SC_PAGESIZE);
    const size_t room = (size + page - 1) / page * page;
    uint8_t *const memory = mmap(NULL, room + 2 * page, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    CHECK(memory != MAP_FAILED && mprotect(memory + page, room, PROT_READ | PROT_WRITE) == 0, "no memory");
    return memory + page + room - size;
}
