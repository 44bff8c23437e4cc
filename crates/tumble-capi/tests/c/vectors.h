/* The conformance vectors, read by cJSON. A missing value ends the program: no check may pass for want of a number. */

#ifndef VECTORS_H
#define VECTORS_H

#include <cjson/cJSON.h>

#include "tumble.h"

/* Where they are. */
extern const char *vectors_folder;

/* Reads a file of vectors, to be given back to cJSON_Delete(). */
cJSON *vectors_read(const char *name);

/* A member of an object. */
const cJSON *member(const cJSON *object, const char *name);

/* A number of an object. */
double number(const cJSON *object, const char *name);

/* An element of a list. */
const cJSON *element(const cJSON *list, int index);

/* Three numbers of an object. */
void vector(const cJSON *object, const char *name, float numbers[3]);

/* Nine numbers of an object, row by row. */
void matrix(const cJSON *object, const char *name, float numbers[3][3]);

/* Tolerance of a quantity of a file in single precision. */
double tolerance(const cJSON *file, const char *quantity);

/* A sample of counts, six in a row, in the steps that `cases` gives. */
tumble_sample sample_of(const cJSON *cases, const cJSON *counts, uint64_t time);

#endif
