/* A component has no parts. */
#include "instance.h"

int take_parts(Instance *instance, const char *resources) {
    (void)instance, (void)resources;
    return 1;
}

void drop_parts(Instance *instance) {
    (void)instance;
}

size_t size_of_parts(const Instance *instance) {
    (void)instance;
    return 0;
}

int save_parts(Instance *instance, char *bytes) {
    (void)instance, (void)bytes;
    return 1;
}

int are_parts(Instance *instance, const char *bytes) {
    (void)instance, (void)bytes;
    return 1;
}

int restore_parts(Instance *instance, const char *bytes) {
    (void)instance, (void)bytes;
    return 1;
}
