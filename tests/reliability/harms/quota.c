/* A quota of bytes for each file whose path begins so: few file systems have one for a test.
 *
 * cc -shared -fPIC -o quota.so quota.c
 * QUOTA_FOLDER=PATH QUOTA_BYTES=NUMBER LD_PRELOAD=./quota.so PROGRAM
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int exceeded(int file, size_t more)
{
    const char *folder = getenv("QUOTA_FOLDER"), *bytes = getenv("QUOTA_BYTES");
    char link[32], path[4096];
    struct stat now;
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (!folder || !bytes || length < 0 || fstat(file, &now) != 0 || !S_ISREG(now.st_mode))
        return 0;
    path[length] = 0;
    return !strncmp(path, folder, strlen(folder)) && now.st_size + (long)more > atol(bytes);
}

ssize_t write(int file, const void *data, size_t size)
{
    ssize_t (*real)(int, const void *, size_t) = dlsym(RTLD_NEXT, "write");
    if (exceeded(file, size)) {
        errno = EDQUOT;
        return -1;
    }
    return real(file, data, size);
}
