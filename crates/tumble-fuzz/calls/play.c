#include "fuzz.h"

/** Makes calls in any order, most of them of one kind; returns the digest of all outputs. */
static uint64_t play(void)
{
    static void (*const calls[])(void) = {call_of_model, call_of_record, call_of_redundancy, call_of_spin,
                                          call_of_store};
    draw_begin();
    told_begin();
    warm_begin();
    const uint32_t mostly = draw_below(5);
    const uint32_t count = 4 + draw_below(28);
    for (uint32_t call = 0; call < count; call++) {
        calls[draw_once_in(8) ? draw_below(5) : mostly]();
    }
    return told();
}

void play_twice(void)
{
    const uint64_t first = play();
    CHECK(play() == first, "a second run is told something else");
}
