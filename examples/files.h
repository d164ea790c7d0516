/* files.h - files for programs: read whole, written whole or not at all, and no output where an input lies.
   MIT, see ssdgs.h.

   #include "files.h"
   ...
   olat_guard guard = {NULL, 0, 0}; char error[512];
   if (olat_guard_input(&guard, "in.png", error) || olat_guard_output(&guard, "out.png", error)) puts(error);
   olat_guard_free(&guard);

   CONTENTS  the system and a clock; errors and files; guarding files.

   ERRORS  Functions return 0, or 1 and one message of less than 512 bytes that names the file. Nothing in it
   steers a terminal.

   MEMORY  What olat__read_file has read is the caller's to free. A guard grows with its files, until
   olat_guard_free.

   SYSTEMS  POSIX, MinGW. All functions are static and keep no state. */

#ifndef OLAT_FILES_H
#define OLAT_FILES_H

/* ==== the system and a clock ==== */

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#ifdef _WIN32
#include <direct.h>
#ifndef WIN32_LEAN_AND_MEAN
#define WIN32_LEAN_AND_MEAN
#endif
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <io.h>
#include <process.h>
#include <windows.h>
#define OLAT__SEPARATORS "/\\"
#define OLAT__READ_FLAGS (O_RDONLY | O_BINARY)
#define OLAT__WRITE_FLAGS (O_WRONLY | O_CREAT | O_EXCL | O_BINARY)
#define OLAT__MAKE_FOLDER(path) _mkdir(path)
#else
#include <sys/time.h>
#include <unistd.h>
#define OLAT__SEPARATORS "/"
#define OLAT__READ_FLAGS (O_RDONLY | O_NONBLOCK) /* opening a FIFO must not wait for its writer */
#define OLAT__WRITE_FLAGS (O_WRONLY | O_CREAT | O_EXCL)
#define OLAT__MAKE_FOLDER(path) mkdir(path, 0777)
#endif

/* OLAT__API: a function that a program need not call. */
#if defined(__GNUC__) && !defined(__TINYC__)
#define OLAT__API static __attribute__((unused))
#define OLAT__PRINTF(text, values) __attribute__((format(printf, text, values)))
#else
#define OLAT__API static
#define OLAT__PRINTF(text, values)
#endif

enum { OLAT__MAX_FILE = 0x7fffffff, OLAT__MAX_PATH = 4096 };

/* Seconds since whenever, of a clock on the wall. */
OLAT__API double olat_seconds(void) {
#ifdef _WIN32
    LARGE_INTEGER ticks, rate;
    QueryPerformanceCounter(&ticks);
    QueryPerformanceFrequency(&rate);
    return (double)ticks.QuadPart / (double)rate.QuadPart;
#else
    struct timeval time;
    gettimeofday(&time, NULL);
    return (double)time.tv_sec + 1e-6 * (double)time.tv_usec;
#endif
}

/* ==== errors and files ==== */

/* Names come from files and must not steer a terminal. */
static void olat__tame(char *text) {
    for (; *text; text++)
        if ((unsigned char)*text < 32 || *text == 127) *text = '?';
}

OLAT__PRINTF(2, 3) static int olat__fail(char *error, const char *format, ...) {
    va_list list;
    va_start(list, format);
    vsnprintf(error, 512, format, list);
    va_end(list);
    olat__tame(error);
    return 1;
}

/* Appends to a text in so much room, up to its end. */
OLAT__PRINTF(3, 4) OLAT__API void olat__append(char *text, size_t room, const char *format, ...) {
    const size_t used = strlen(text);
    va_list list;
    va_start(list, format);
    vsnprintf(text + used, room - used, format, list);
    va_end(list);
}

/* The end of a path, which tells more than its beginning where room is short. */
static const char *olat__tail(const char *path) {
    size_t length = strlen(path);
    return length > 160 ? path + (length - 160) : path;
}

OLAT__API int olat__same_letters(const char *text, const char *lower, size_t length) {
    size_t i = 0;
    while (i < length && (text[i] >= 'A' && text[i] <= 'Z' ? text[i] + 32 : text[i]) == lower[i]) i++;
    return i == length;
}

OLAT__API int olat_exists(const char *path) {
    struct stat there;
    return stat(path, &there) == 0 && S_ISREG(there.st_mode);
}

/* Reads a regular file whole and appends a NUL. */
OLAT__API int olat__read_file(const char *path, unsigned char **data, size_t *size, char *error) {
    const char *problem = NULL;
    size_t done = 0, total = 0;
    int file = open(path, OLAT__READ_FLAGS);
    if (file < 0) return olat__fail(error, "%s: cannot be opened: %s", olat__tail(path), strerror(errno));
    struct stat info;
    if (fstat(file, &info) != 0) problem = "cannot be examined";
    else if (!S_ISREG(info.st_mode)) problem = "is not a regular file";
    else if (info.st_size < 0 || info.st_size > OLAT__MAX_FILE) problem = "is larger than 2 GiB";
    else if ((*data = (unsigned char *)malloc((size_t)info.st_size + 1)) == NULL) problem = "out of memory";
    else total = (size_t)info.st_size;
    while (!problem && done < total) {
        size_t part = total - done < 1 << 20 ? total - done : 1 << 20;
        long got = (long)read(file, *data + done, (unsigned)part);
        if (got > 0) done += (size_t)got;
        else if (got == 0 || errno != EINTR)
            problem = got == 0 ? "ended while it was read" : "cannot be read";
    }
    close(file);
    *size = total;
    if (!problem) (*data)[total] = 0;
    return problem ? olat__fail(error, "%s: %s", olat__tail(path), problem) : 0;
}

/* Writes a file under a temporary name and renames it, so that path never holds half a file. */
OLAT__API int olat__write_file(const char *path, const unsigned char *data, size_t size, char *error) {
    size_t done = 0, room = strlen(path) + 40;
    int file = -1, reason = 0;
    struct stat info;
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode))
        return olat__fail(error, "%s: is not a regular file", olat__tail(path));
    char *name = (char *)malloc(room);
    if (!name) return olat__fail(error, "%s: out of memory", olat__tail(path));
    for (int attempt = 0; file < 0 && attempt < 100 && (attempt == 0 || errno == EEXIST); attempt++) {
        snprintf(name, room, "%s.tmp.%ld.%d", path, (long)getpid(), attempt);
        file = open(name, OLAT__WRITE_FLAGS, 0666);
    }
    if (file < 0) reason = errno;
    while (!reason && done < size) {
        size_t part = size - done < 1 << 20 ? size - done : 1 << 20;
        long put = (long)write(file, data + done, (unsigned)part);
        if (put >= 0) done += (size_t)put;
        else if (errno != EINTR) reason = errno;
    }
    if (file >= 0) {
        if (close(file) != 0 && !reason) reason = errno;
#ifdef _WIN32
        if (!reason) remove(path); /* rename does not replace there */
#endif
        if (!reason && rename(name, path) != 0) reason = errno;
        if (reason) remove(name);
    }
    free(name);
    return reason ? olat__fail(error, "%s: cannot be written: %s", olat__tail(path), strerror(reason)) : 0;
}

/* Whether a file could be written: neither it nor what is there changes. */
OLAT__API int olat_check_writable(const char *path, char error[512]) {
    const size_t room = strlen(path) + 40;
    struct stat info;
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode))
        return olat__fail(error, "%s: cannot be written: it is a folder or a device", olat__tail(path));
    char *name = (char *)malloc(room);
    if (!name) return olat__fail(error, "%s: out of memory", olat__tail(path));
    snprintf(name, room, "%s.tmp.%ld", path, (long)getpid());
    const int file = open(name, OLAT__WRITE_FLAGS, 0666), reason = errno;
    if (file >= 0) close(file), remove(name);
    free(name);
    return file < 0 ? olat__fail(error, "%s: cannot be written: %s", olat__tail(path), strerror(reason)) : 0;
}

/* Makes a folder, and those above it, where they are not there. */
OLAT__API int olat_make_folder(const char *path, char error[512]) {
    const size_t length = strlen(path);
    char *part = (char *)malloc(length + 1);
    if (!part) return olat__fail(error, "out of memory");
    int why = 0;
    for (size_t i = 1; i <= length; i++) {
        if (path[i] && !strchr(OLAT__SEPARATORS, path[i])) continue;
        memcpy(part, path, i);
        part[i] = 0;
        why = !OLAT__MAKE_FOLDER(part) || errno == EEXIST ? 0 : errno;
    }
    free(part);
    return why ? olat__fail(error, "%s: the folder cannot be made: %s", olat__tail(path), strerror(why)) : 0;
}

/* ==== guarding files: by what they are, whatever they are called ==== */

typedef struct olat__known {
    char *path; /* as it was given; NULL: nobody's slot */
    const char
        *name; /* behind it in memory: what lies below the folder of this id; "": the id is the file's own */
    uint64_t id[2];
    int is_output;
} olat__known;

typedef struct olat_guard { /* files that must stay as they are, and files to be written; zero it to start */
    olat__known *slots;     /* a hash table, half empty */
    size_t count, room;
} olat_guard;

/* What tells a file or folder from every other one, through links; 0 if there is none. */
static int olat__identify(const char *path, uint64_t id[2]) {
#ifdef _WIN32
    BY_HANDLE_FILE_INFORMATION info;
    const HANDLE file = CreateFileA(path, 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL,
                                    OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, NULL);
    const int found = file != INVALID_HANDLE_VALUE && GetFileInformationByHandle(file, &info);
    if (file != INVALID_HANDLE_VALUE) CloseHandle(file);
    if (!found) return 0;
    id[0] = info.dwVolumeSerialNumber;
    id[1] = (uint64_t)info.nFileIndexHigh << 32 | info.nFileIndexLow;
#else
    struct stat info;
    if (stat(path, &info) != 0) return 0;
    id[0] = (uint64_t)info.st_dev;
    id[1] = (uint64_t)info.st_ino;
#endif
    return 1;
}

static int olat__separates(char c) { return c && strchr(OLAT__SEPARATORS, c) != NULL; }

/* The place that a file has or would have: the nearest folder that exists, and what comes below it in small
   letters and without names that mean nothing. `name` holds the path, and then the latter. */
static void olat__place(char *name, uint64_t id[2]) {
    size_t cut = strlen(name);
    char *to = name;
    id[0] = id[1] = 0;
    for (;;) {
        while (cut > 0 && !olat__separates(name[cut - 1])) cut--;
        const char c = name[cut];
        name[cut] = 0;
        const int found = olat__identify(cut ? name : ".", id);
        name[cut] = c;
        if (found || cut == 0) break;
        while (cut > 0 && olat__separates(name[cut - 1])) cut--;
    }
    for (size_t from = cut; name[from]; from++) {
        const char c = name[from], next = name[from + 1];
        const int starts = to == name || to[-1] == '/';
        if (starts && c == '.' && (olat__separates(next) || !next)) continue;
        if (!olat__separates(c)) *to++ = (char)(c >= 'A' && c <= 'Z' ? c + 32 : c);
        else if (!starts) *to++ = '/';
    }
    *to = 0;
}

/* The slot that holds it, else the free one where it belongs. */
static olat__known *olat__slot(const olat_guard *guard, const olat__known *file) {
    uint64_t hash = (file->id[0] * 31 + file->id[1]) * UINT64_C(0x9E3779B97F4A7C15);
    const size_t last = guard->room - 1;
    for (const char *c = file->name; *c; c++) hash = (hash ^ (unsigned char)*c) * UINT64_C(0x100000001B3);
    size_t at;
    for (at = (size_t)(hash ^ hash >> 32) & last; guard->slots[at].path; at = (at + 1) & last) {
        const olat__known *other = &guard->slots[at];
        if (other->id[0] == file->id[0] && other->id[1] == file->id[1] && !strcmp(other->name, file->name))
            break;
    }
    return &guard->slots[at];
}

/* Notes the file by its own id, or by its place where that is NULL; fails where an output is known
   already. */
static int olat__guard_add(olat_guard *guard, const char *path, const uint64_t *id, int is_output,
                           char *error) {
    const size_t size = strlen(path) + 1;
    if (2 * (guard->count + 1) > guard->room) {
        olat_guard grown;
        grown.count = guard->count;
        grown.room = guard->room ? 2 * guard->room : 64;
        if ((grown.slots = (olat__known *)calloc(grown.room, sizeof *grown.slots)) == NULL) {
            return olat__fail(error, "%s: out of memory", olat__tail(path));
        }
        for (size_t i = 0; i < guard->room; i++)
            if (guard->slots[i].path) *olat__slot(&grown, &guard->slots[i]) = guard->slots[i];
        free(guard->slots);
        *guard = grown;
    }
    olat__known file;
    if ((file.path = (char *)malloc(2 * size)) == NULL)
        return olat__fail(error, "%s: out of memory", olat__tail(path));
    memcpy(file.path, path, size);
    char *name;
    file.name = name = file.path + size;
    file.is_output = is_output;
    memcpy(name, path, size);
    if (id) memcpy(file.id, id, sizeof file.id), *name = 0;
    else olat__place(name, file.id);
    olat__known *slot = olat__slot(guard, &file);
    if (!slot->path) {
        *slot = file;
        guard->count++;
        return 0;
    }
    free(file.path);
    if (!is_output) return 0;
    return olat__fail(error,
                      slot->is_output
                          ? "%s: would be written twice, also as %s: give the outputs different names"
                          : "%s: would replace an input, %s: choose another output",
                      olat__tail(path), olat__tail(slot->path));
}

/* A file that must stay as it is; there need not be one. Inputs come before outputs. Fails only for want of
   memory. */
OLAT__API int olat_guard_input(olat_guard *guard, const char *path, char error[512]) {
    uint64_t id[2];
    return olat__guard_add(guard, path, olat__identify(path, id) ? id : NULL, 0, error);
}

/* A file to be written: fails where its name is empty, it is an input, or was named as an output before, if
   only in other case. */
OLAT__API int olat_guard_output(olat_guard *guard, const char *path, char error[512]) {
    olat__known file;
    if (!*path) return olat__fail(error, "an output's name is empty");
    file.name = "";
    const olat__known *input;
    if (guard->room && olat__identify(path, file.id) && (input = olat__slot(guard, &file))->path) {
        return olat__fail(error, "%s: would replace an input, %s: choose another output", olat__tail(path),
                          olat__tail(input->path));
    }
    return olat__guard_add(guard, path, NULL, 1, error);
}

OLAT__API void olat_guard_free(olat_guard *guard) {
    for (size_t i = 0; i < guard->room; i++) free(guard->slots[i].path);
    free(guard->slots);
    memset(guard, 0, sizeof *guard);
}

#endif /* OLAT_FILES_H */
