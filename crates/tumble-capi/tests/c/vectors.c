#include "vectors.h"

#include <stdio.h>
#include <stdlib.h>

const char *vectors_folder = "";

static void give_up(const char *what, const char *name)
{
    fprintf(stderr, "vectors: %s: %s\n", what, name);
    exit(2);
}

static char *read_text(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        give_up("cannot open", path);
    }
    fseek(file, 0, SEEK_END);
    const long size = ftell(file);
    rewind(file);
    char *text = (char *)malloc((size_t)size + 1);
    if (text == NULL || fread(text, 1, (size_t)size, file) != (size_t)size) {
        give_up("cannot read", path);
    }
    text[size] = '\0';
    fclose(file);
    return text;
}

cJSON *vectors_read(const char *name)
{
    char path[1024];
    const int length = snprintf(path, sizeof path, "%s/%s.json", vectors_folder, name);
    if (length < 0 || (size_t)length >= sizeof path) {
        give_up("path too long", vectors_folder);
    }
    char *text = read_text(path);
    cJSON *file = cJSON_Parse(text);
    free(text);
    if (file == NULL) {
        give_up("not JSON", path);
    }
    return file;
}

const cJSON *member(const cJSON *object, const char *name)
{
    const cJSON *found = cJSON_GetObjectItemCaseSensitive(object, name);
    if (found == NULL) {
        give_up("no member", name);
    }
    return found;
}

static double value(const cJSON *item, const char *name)
{
    if (!cJSON_IsNumber(item)) {
        give_up("no number", name);
    }
    return item->valuedouble;
}

double number(const cJSON *object, const char *name)
{
    return value(member(object, name), name);
}

const cJSON *element(const cJSON *list, int index)
{
    const cJSON *found = cJSON_GetArrayItem(list, index);
    if (found == NULL) {
        give_up("list too short", list->string != NULL ? list->string : "");
    }
    return found;
}

static void numbers_of(const cJSON *list, const char *name, float numbers[3])
{
    for (int i = 0; i < 3; ++i) {
        numbers[i] = (float)value(element(list, i), name);
    }
}

void vector(const cJSON *object, const char *name, float numbers[3])
{
    numbers_of(member(object, name), name, numbers);
}

void matrix(const cJSON *object, const char *name, float numbers[3][3])
{
    for (int i = 0; i < 3; ++i) {
        numbers_of(element(member(object, name), i), name, numbers[i]);
    }
}

double tolerance(const cJSON *file, const char *quantity)
{
    return number(member(member(file, "tolerance"), quantity), "f32");
}

tumble_sample sample_of(const cJSON *cases, const cJSON *counts, uint64_t time)
{
    const float steps[2] = {(float)number(cases, "force_step"), (float)number(cases, "rate_step")};
    tumble_sample sample;
    sample.time = time;
    for (int i = 0; i < 3; ++i) {
        sample.specific_force[i] = (float)value(element(counts, i), "counts") * steps[0];
        sample.angular_rate[i] = (float)value(element(counts, i + 3), "counts") * steps[1];
    }
    return sample;
}
