/* Hostile calls of the C interface. `tumble-calls [--runs N] [--from SEED]` makes N runs of seeds from SEED
 * on, in as many processes as there are processors; `--seed SEED` repeats one run, with a program that the
 * same compiler made: the order in which arguments are drawn is the compiler's choice. Ends with 1 where anything was
 * found. */
#define _POSIX_C_SOURCE 200809L
#include "../fuzz.h"

#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/** That of the run at hand. */
static uint64_t run_seed;

static void on_signal(int number)
{
    static char what[] = "signal ..";
    what[7] = (char)('0' + number / 10);
    what[8] = (char)('0' + number % 10);
    fail(what);
}

void fail(const char *what)
{
    char line[256];
    const int length = snprintf(line, sizeof line, "\ncalls --seed %" PRIu64 ": %s\n", run_seed, what);
    /* Nothing can be done where even that cannot be reported. */
    (void)!write(STDOUT_FILENO, line, (size_t)length);
    _exit(1);
}

static void run(uint64_t seed)
{
    run_seed = seed;
    draw_seed(seed);
    play_twice();
}

static void run_some(uint64_t from, uint64_t count, uint64_t worker, uint64_t workers)
{
    const time_t began = time(NULL);
    for (uint64_t at = worker; at < count; at += workers) {
        run(from + at);
        if (worker == 0 && at / workers % 65536 == 0) {
            const double seconds = difftime(time(NULL), began);
            fprintf(stderr, "\rcalls: %" PRIu64 " of %" PRIu64 " runs, %.0f a second ", at, count,
                    seconds > 0.0 ? (double)at / seconds : 0.0);
        }
    }
}

static int run_all(uint64_t from, uint64_t count)
{
    const long workers = sysconf(_SC_NPROCESSORS_ONLN) > 0 ? sysconf(_SC_NPROCESSORS_ONLN) : 1;
    int failures = 0;
    fflush(stdout);
    for (long worker = 0; worker < workers; worker++) {
        const pid_t child = fork();
        if (child < 0) {
            perror("tumble-calls");
            return 2;
        }
        if (child == 0) {
            run_some(from, count, (uint64_t)worker, (uint64_t)workers);
            _exit(0);
        }
    }
    for (long worker = 0; worker < workers; worker++) {
        int status = 0;
        failures += wait(&status) < 0 || !WIFEXITED(status) || WEXITSTATUS(status) != 0;
    }
    printf("\ncalls: a failure in %d of %ld processes, which ends with the first\n", failures, workers);
    return failures != 0;
}

static int usage(void)
{
    fprintf(stderr, "usage: tumble-calls [--runs N] [--from SEED] | [--seed SEED]\n");
    return 2;
}

static bool is_number(const char *word, uint64_t *number)
{
    char *end = NULL;
    *number = strtoull(word, &end, 10);
    /* A sign would be taken for one that wraps around. */
    return *word >= '0' && *word <= '9' && *end == '\0';
}

int main(int count, char **words)
{
    uint64_t runs = 10000000;
    uint64_t from = 1;
    bool once = false;
    for (int word = 1; word < count; word += 2) {
        uint64_t number = 0;
        if (word + 1 == count || !is_number(words[word + 1], &number)) {
            return usage();
        }
        if (strcmp(words[word], "--runs") == 0) {
            runs = number;
        } else if (strcmp(words[word], "--from") == 0) {
            from = number;
        } else if (strcmp(words[word], "--seed") == 0) {
            from = number;
            once = true;
        } else {
            return usage();
        }
    }
    static const int signals[] = {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL};
    for (size_t i = 0; i < sizeof signals / sizeof signals[0]; i++) {
        signal(signals[i], on_signal);
    }
    warm_up();
    if (once) {
        run(from);
        return 0;
    }
    return run_all(from, runs);
}
