/* Tries all laws of the interface: `laws FOLDER`, where FOLDER holds the conformance vectors. */

#include <string.h>

#include "laws.h"
#include "vectors.h"

int failures = 0;

void *new_storage(size_t size)
{
    void *storage = malloc(size);
    if (storage == NULL) {
        fputs("no memory\n", stderr);
        exit(2);
    }
    /* Storage holds remains like a stack, not zeros like loaded memory. */
    memset(storage, 0xA5, size);
    return storage;
}

static int hold(const law *laws)
{
    int tried = 0;
    for (; laws->sentence != NULL; ++laws, ++tried) {
        const int before = failures;
        laws->hold();
        printf("%s: %s\n", failures == before ? "holds" : "BROKEN", laws->sentence);
    }
    return tried;
}

int main(int count, char **arguments)
{
    if (count != 2) {
        fputs("usage: laws FOLDER_OF_VECTORS\n", stderr);
        return 2;
    }
    vectors_folder = arguments[1];
    int tried = hold(model_laws);
    tried += hold(spin_laws);
    tried += hold(redundancy_laws);
    tried += hold(record_laws);
    tried += hold(store_laws);
    tried += hold(refusal_laws);
    printf("%d laws tried, %d checks failed\n", tried, failures);
    return failures == 0 && tried > 0 ? 0 : 1;
}
