/* The elements are FMUs of their own, unpacked in folders below the resources: their binaries are loaded. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#include "elements.h"

#if defined(_WIN32) && defined(__aarch64__)
#define PLATFORM "aarch64-windows"
#define SUFFIX ".dll"
#elif defined(_WIN32)
#define PLATFORM "win64"
#define SUFFIX ".dll"
#elif defined(__APPLE__)
#define PLATFORM "darwin64"
#define SUFFIX ".dylib"
#elif defined(__aarch64__)
#define PLATFORM "aarch64-linux"
#define SUFFIX ".so"
#else
#define PLATFORM "linux64"
#define SUFFIX ".so"
#endif

enum { PATH_SIZE = 4096 };

const int are_linked = 0;

typedef struct {
    Functions functions; /* first: a pointer to it is one to all */
    void *library;
} Opened;

#ifdef _WIN32

static void *open_library(const char *path) {
    wchar_t wide[PATH_SIZE];
    if (!MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, PATH_SIZE))
        return NULL;
    return LoadLibraryExW(wide, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
}

static void *find(void *library, const char *function) {
    return (void *)GetProcAddress(library, function);
}

static void close_library(void *library) {
    FreeLibrary(library);
}

static const char *why(char text[NUMBER_SIZE]) {
    snprintf(text, NUMBER_SIZE, "error %lu", (unsigned long)GetLastError());
    return text;
}

#else

static void *open_library(const char *path) {
    return dlopen(path, RTLD_NOW | RTLD_LOCAL);
}

static void *find(void *library, const char *function) {
    return dlsym(library, function);
}

static void close_library(void *library) {
    dlclose(library);
}

static const char *why(char text[NUMBER_SIZE]) {
    const char *said = dlerror();
    (void)text;
    return said ? said : "unknown reason";
}

#endif

static int digit(char c) {
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* Make a path of the location of a file, in place: of a file: URL, or a path already. */
static void to_path(char *location) {
    const char *from = location;
    char *to = location;
    int is_url = !strncmp(from, "file:", 5);
    if (is_url)
        from += !strncmp(from, "file:///", 8) ? 7 : 5;
#ifdef _WIN32
    if (is_url && from[0] == '/' && from[1] && from[2] == ':')
        from++;
#endif
    while (*from) {
        if (is_url && from[0] == '%' && digit(from[1]) >= 0 && digit(from[2]) >= 0) {
            *to++ = (char)(digit(from[1]) * 16 + digit(from[2]));
            from += 3;
        } else {
            *to++ = *from++;
        }
    }
    *to = 0;
}

void location_of(size_t element, const char *resources, char *location, size_t size) {
    size_t length = strlen(resources);
    const char *slash = length && resources[length - 1] == '/' ? "" : "/";
    snprintf(location, size, "%s%s%s/resources", resources, slash, elements_table[element].folder);
}

const Functions *open_element(size_t element, const char *resources, Message failure) {
    const Element *e = &elements_table[element];
    char path[PATH_SIZE], text[NUMBER_SIZE];
    const char *missing = NULL;
    size_t length = resources ? strlen(resources) : 0;
    if (!length || length > PATH_SIZE / 2) {
        say(failure, "The location of the resources is %.200s; expected a file URL: the elements of this system lie there.",
            resources ? resources : "NULL");
        return NULL;
    }
    Opened *opened = calloc(1, sizeof *opened);
    if (!opened) {
        say(failure, "There is no memory for the element %s.", e->name);
        return NULL;
    }
    location_of(element, resources, path, sizeof path);
    size_t end = strlen(path) - strlen("resources");
    snprintf(&path[end], sizeof path - end, "binaries/" PLATFORM "/%s" SUFFIX, e->library);
    to_path(path);
    opened->library = open_library(path);
    if (!opened->library) {
        say(failure, "%s: its binary cannot be loaded: %.600s", e->name, why(text));
        free(opened);
        return NULL;
    }
#define FIND(name)                                                                                                     \
    if (!missing) {                                                                                                    \
        void *found = find(opened->library, "fmi2" #name);                                                             \
        memcpy(&opened->functions.name, &found, sizeof found);                                                         \
        missing = found || strstr(#name, "state") ? NULL : "fmi2" #name;                                               \
    }
    EACH_FUNCTION(FIND)
    if (missing) {
        say(failure, "%s: its binary has no function %s.", e->name, missing);
        close_element(&opened->functions);
        return NULL;
    }
    return &opened->functions;
}

void close_element(const Functions *functions) {
    Opened *opened = (Opened *)(void *)functions;
    close_library(opened->library);
    free(opened);
}
