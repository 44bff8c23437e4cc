/* The same calls, drawn from inputs of libFuzzer, which sees what code of the library they reach. */
#include "../fuzz.h"

#include <stdio.h>
#include <stdlib.h>

void fail(const char *what)
{
    fprintf(stderr, "calls: %s\n", what);
    /* By which libFuzzer keeps the input. */
    abort();
}

int LLVMFuzzerInitialize(int *count, char ***words);
int LLVMFuzzerInitialize(int *count, char ***words)
{
    (void)count;
    (void)words;
    warm_up();
    return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size)
{
    draw_input(input, size);
    play_twice();
    return 0;
}
