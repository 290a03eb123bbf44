/* What a component does in its own way with each value that comes. */
#ifndef OWN_H
#define OWN_H

static inline int assign(Instance *instance, uint32_t reference, double value) {
    instance->now.values[reference] = value;
    instance->now.stale = 1;
    instance->now.unchecked |= reference >= FIRST_PARAMETER;
    return 1;
}

static inline int awaits_preview(const Instance *instance) {
    return instance->now.stale && instance->now.phase < RUNNING;
}

#endif
