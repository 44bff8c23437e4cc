/* Shared parts of all tests: laws, and checks that count. Written in what C99 and C++17 have in common. */

#ifndef LAWS_H
#define LAWS_H

#include <stdio.h>
#include <stdlib.h>

#include "tumble.h"

/* A law is a sentence that holds, and a function that tries it. */
typedef struct law {
    const char *sentence;
    void (*hold)(void);
} law;

/* Checks that failed so far. */
extern int failures;

/* Counts a check that fails, and prints its place. */
#define CHECK(holds) \
    do { \
        if (!(holds)) { \
            ++failures; \
            fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #holds); \
        } \
    } while (0)

/* Counts an answer other than the one expected, and prints both. */
#define ANSWERS(expected, call) \
    do { \
        const tumble_status answered = (call); \
        if (answered != (expected)) { \
            ++failures; \
            fprintf(stderr, "%s:%d: %s: %s\n", __FILE__, __LINE__, #call, tumble_strerror(answered)); \
        } \
    } while (0)

/* Storage from the heap, so that a memory checker sees what is written beside it. */
#define NEW(type) ((type *)new_storage(sizeof(type)))
void *new_storage(size_t size);

extern const law model_laws[];
extern const law spin_laws[];
extern const law redundancy_laws[];
extern const law record_laws[];
extern const law store_laws[];
extern const law refusal_laws[];

#endif
