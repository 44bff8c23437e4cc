/**
 * Hostile calls of the C interface, in any order: what the files of this program share.
 *
 * draw.c    all that is random in one run
 * memory.c  objects that end where memory does, so that a byte beyond them is found out
 * check.c   what has to hold of every call
 * flash.c   flash that may fail, lie and forget
 * warm.c    monitors, spins and flash in all states that they pass through
 * calls_*.c one function for each of the library's, with arguments as bad as they come
 * play.c    a run: calls in any order, twice
 * by_seed, guided
 *           programs that make runs: of seeds, and of inputs that libFuzzer chooses
 */
#ifndef FUZZ_H
#define FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "tumble.h"

/* draw.c */

/** Lets all that is drawn follow from a seed. */
void draw_seed(uint64_t seed);
/** Lets it follow from bytes, of which each draw takes the next, and where they end from a seed. */
void draw_input(const uint8_t *bytes, size_t size);
/** Begins again. */
void draw_begin(void);
uint64_t draw_bits(void);
/** From 0 up to below `end`, which is above 0. */
uint32_t draw_below(uint32_t end);
bool draw_once_in(uint32_t of);
/** Up to `size` either way. */
float draw_usual(float size);
/** Any number, the worst among them. */
float draw_number(void);
/** Any time, the worst among them. */
uint64_t draw_time(void);
/** One of `known` codes, or none of them. */
uint32_t draw_code(uint32_t known);
/** Overwrites some of the bytes, which are aligned to 4, by numbers, times and anything. */
void draw_spoil(void *bytes, size_t size);

/* memory.c */

/** Room for an object; what comes after it is no memory. Never given back. */
void *memory_ending(size_t size);

/* check.c */

#define CHECK(holds, what) ((holds) ? (void)0 : fail(what))

/** Forgets the digest of all outputs so far. */
void told_begin(void);
/** Adds output of the library to the digest; a run that is repeated has to give the same. */
void tell(const void *bytes, size_t size);
uint64_t told(void);

/** A pointer that has to lead to something, or rarely one that must not be taken. */
void *required(void *object);
/** A pointer that may be null. */
void *optional(void *object);
/** True if a pointer of the call at hand must be rejected. */
extern bool pointer_spoilt;

/** Fills an object that is to be written, so that it shows whether it was. */
void unwritten(void *object, size_t size);
/** Checks a call: if it failed, `object` was not written. Gives whether it was done. */
bool done(tumble_status status, const void *object, size_t size);
bool all_finite(const float *numbers, size_t count);

/** Checks that none of so many numbers is infinite. */
bool none_infinite(const float *numbers, size_t count);

/* flash.c */

enum { FLASH_BYTES = 8192, FLASH_START = 4096 };

extern tumble_flash flash;
extern uint8_t *flash_memory;
/** Rate at which the driver fails: once in so many operations; 0: never. */
extern uint32_t flash_faults;
/** True if the calls come from a store as it is, so that its writes can be checked. */
extern bool flash_judged;

/* warm.c */

extern tumble_redundancy *redundancy;
extern tumble_spin *spin;
extern tumble_store *store;

/** Rate at which samples are corrupted in the run at hand: one in so many. */
extern uint32_t samples_spoilt;

void warm_up(void);
/** Puts all three into a state drawn. */
void warm_begin(void);
/** Draws the next sample of a unit of the set, or of the robot; false where it sends none. */
bool next_of_set(uint32_t *unit, tumble_sample *sample);
void next_of_robot(tumble_sample *sample, tumble_wheels *wheels);
void usual_record(tumble_record *record);
void usual_redundancy_settings(tumble_redundancy_settings *settings);
void usual_units(tumble_unit units[TUMBLE_UNITS]);
void usual_spin_settings(tumble_spin_settings *settings);

/* play.c */

void play_twice(void);

/* by_seed, guided */

/** Reports a failure, and ends the run. */
_Noreturn void fail(const char *what);

/* calls_*.c */

void call_of_model(void);
void call_of_record(void);
void call_of_redundancy(void);
void call_of_spin(void);
void call_of_store(void);

/** A record, sound or not. */
void any_record(tumble_record *record);
/** Corrupts the readings of one sample in so many as the run asks for, and the time of as many. */
void spoil_sample(tumble_sample *sample);

#endif
