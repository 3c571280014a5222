/* The time of day as a file says: seconds to be added to what the system says.
 *
 * cc -shared -fPIC -o clock_jumps.so clock_jumps.c
 * CLOCK_JUMP=FILE LD_PRELOAD=./clock_jumps.so PROGRAM
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define A_TIME_OF_DAY 1000000000L /* s: a time since the start of the machine is less */
#define SLICE 50000000L            /* ns, after which a wait looks at the file again */

static long jump(void)
{
    const char *name = getenv("CLOCK_JUMP");
    FILE *file = name ? fopen(name, "r") : NULL;
    long seconds = 0;
    if (file) {
        if (fscanf(file, "%ld", &seconds) != 1)
            seconds = 0;
        fclose(file);
    }
    return seconds;
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    int failed = (int)syscall(SYS_clock_gettime, clock, now);
    if (!failed && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        now->tv_sec += jump();
    return failed;
}

int gettimeofday(struct timeval *restrict now, void *restrict zone)
{
    int failed = (int)syscall(SYS_gettimeofday, now, zone);
    if (!failed)
        now->tv_sec += jump();
    return failed;
}

time_t time(time_t *out)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (out)
        *out = now.tv_sec;
    return now.tv_sec;
}

/* A wait until a time of day ends by the time that the file says, also if it changes meanwhile.
 *
 * SLICED: waits again and again for a short time of the system's clock, as long as FAILED says that
 * the time was up.
 */
#define SLICED(WAIT, FAILED)                                                                  \
    for (;;) {                                                                                \
        struct timespec now, until;                                                           \
        clock_gettime(CLOCK_REALTIME, &now);                                                  \
        long left = (end->tv_sec - now.tv_sec) * 1000000000L + end->tv_nsec - now.tv_nsec;    \
        syscall(SYS_clock_gettime, CLOCK_REALTIME, &until);                                   \
        until.tv_nsec += left < 0 ? 0 : left < SLICE ? left : SLICE;                          \
        until.tv_sec += until.tv_nsec / 1000000000L;                                          \
        until.tv_nsec %= 1000000000L;                                                         \
        int ended = WAIT;                                                                     \
        if (!(FAILED) || left <= SLICE)                                                       \
            return ended;                                                                     \
    }

int pthread_cond_timedwait(pthread_cond_t *restrict condition, pthread_mutex_t *restrict mutex,
                           const struct timespec *restrict end)
{
    static int (*wait)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
    if (!wait)
        wait = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
    if (end->tv_sec < A_TIME_OF_DAY)
        return wait(condition, mutex, end);
    SLICED(wait(condition, mutex, &until), ended == ETIMEDOUT)
}

int pthread_mutex_timedlock(pthread_mutex_t *restrict mutex, const struct timespec *restrict end)
{
    static int (*lock)(pthread_mutex_t *, const struct timespec *);
    if (!lock)
        lock = dlsym(RTLD_NEXT, "pthread_mutex_timedlock");
    SLICED(lock(mutex, &until), ended == ETIMEDOUT)
}

int sem_timedwait(sem_t *restrict semaphore, const struct timespec *restrict end)
{
    static int (*wait)(sem_t *, const struct timespec *);
    if (!wait)
        wait = dlsym(RTLD_NEXT, "sem_timedwait");
    SLICED(wait(semaphore, &until), ended && errno == ETIMEDOUT)
}
