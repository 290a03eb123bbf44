#include <math.h>
#include <string.h>

#include "loop.h"

static void hand_on(const Loop *loop, const Copy *copy) {
    const void *source = loop->slaves[copy->sender].outputs[copy->type].values;
    void *target = loop->slaves[copy->receiver].inputs[copy->type].values;
    for (size_t i = 0; i < copy->n; i++) {
        if (copy->type == REAL)
            ((double *)target)[copy->to[i]] = copy->factors[i] * ((const double *)source)[copy->from[i]];
        else
            ((int *)target)[copy->to[i]] = ((const int *)source)[copy->from[i]];
    }
}

static void take_given(const Loop *loop, const Feed *feed, double value) {
    void *target = loop->slaves[feed->receiver].inputs[feed->type].values;
    if (feed->type == REAL)
        ((double *)target)[feed->to] = value;
    else
        ((int *)target)[feed->to] = (int)value;
}

static int get(const Slave *slave, int type) {
    const Block *b = &slave->outputs[type];
    if (type == REAL)
        return slave->get_real(slave->component, b->references, b->n, b->values);
    if (type == INTEGER)
        return slave->get_integer(slave->component, b->references, b->n, b->values);
    if (type == BOOLEAN)
        return slave->get_boolean(slave->component, b->references, b->n, b->values);
    return slave->get_string(slave->component, b->references, b->n, b->values);
}

static int set(const Slave *slave, int type) {
    const Block *b = &slave->inputs[type];
    if (type == REAL)
        return slave->set_real(slave->component, b->references, b->n, b->values);
    if (type == INTEGER)
        return slave->set_integer(slave->component, b->references, b->n, b->values);
    return slave->set_boolean(slave->component, b->references, b->n, b->values);
}

static void tell(volatile Watch *watch, int call, size_t slave, int type) {
    watch->slave = slave;
    watch->type = (size_t)type;
    watch->call = call;
}

/* Each of the following tells whether it went well; if not, the watch has why. */

static int fine(int status, volatile Watch *watch) {
    watch->status = status;
    return status <= fmi2Warning;
}

static int are_finite(const Loop *loop, const Block *block, int call, volatile Watch *watch) {
    const double *values = block->values;
    double sum = 0;
    for (size_t i = 0; i < block->n; i++)
        sum += values[i] * 0; /* not a number where one is not finite */
    if (sum == 0 || !loop->must_be_finite)
        return 1;
    watch->call = call;
    for (watch->variable = 0; isfinite(values[watch->variable]); watch->variable++)
        ;
    return 0;
}

static int feed(const Loop *loop, size_t receiver, const double *given, volatile Watch *watch) {
    for (size_t i = 0; i < loop->n_copies; i++)
        if (loop->copies[i].receiver == receiver)
            hand_on(loop, &loop->copies[i]);
    for (size_t i = 0; i < loop->n_feeds; i++)
        if (loop->feeds[i].receiver == receiver)
            take_given(loop, &loop->feeds[i], given[i]);
    for (int type = REAL; type < STRING; type++) {
        if (!loop->slaves[receiver].inputs[type].n)
            continue;
        tell(watch, 's', receiver, type);
        if (type == REAL && !are_finite(loop, &loop->slaves[receiver].inputs[REAL], 'f', watch))
            return 0;
        if (!fine(set(&loop->slaves[receiver], type), watch))
            return 0;
    }
    return 1;
}

static int advance(const Loop *loop, size_t slave, size_t n, volatile Watch *watch) {
    const Slave *one = &loop->slaves[slave];
    double step = loop->step * (double)one->every / (double)one->parts;
    if ((n + 1) % one->every)
        return 1;
    tell(watch, 'd', slave, 0);
    for (size_t part = 0; part < one->parts; part++) {
        double time = loop->start_time + (double)(n + 1 - one->every) * loop->step + (double)part * step;
        watch->variable = part;
        if (!fine(one->do_step(one->component, time, step, fmi2True), watch))
            return 0;
    }
    return 1;
}

static int read(const Loop *loop, size_t slave, volatile Watch *watch) {
    for (int type = REAL; type < TYPES; type++) {
        if (!loop->slaves[slave].outputs[type].n)
            continue;
        tell(watch, 'g', slave, type);
        if (!fine(get(&loop->slaves[slave], type), watch))
            return 0;
    }
    return !loop->slaves[slave].outputs[REAL].n || are_finite(loop, &loop->slaves[slave].outputs[REAL], 'n', watch);
}

static int take_step(const Loop *loop, size_t n, const double *given, volatile Watch *watch) {
    if (loop->coupling == GAUSS_SEIDEL) {
        for (size_t i = 0; i < loop->n_slaves; i++)
            if (!feed(loop, i, given, watch) || !advance(loop, i, n, watch) || !read(loop, i, watch))
                return 0;
        return 1;
    }
    for (size_t i = 0; i < loop->n_slaves; i++)
        if (!feed(loop, i, given, watch))
            return 0;
    for (size_t i = 0; i < loop->n_slaves; i++)
        if (!advance(loop, i, n, watch))
            return 0;
    for (size_t i = 0; i < loop->n_slaves; i++)
        if (!read(loop, i, watch))
            return 0;
    return 1;
}

/* Add outputs of a block to a row, all or those to record, and return where it goes on. */
static char *record_block(char *row, const Block *block, int all, int type) {
    static const size_t sizes[] = {sizeof(double), sizeof(int), 1, TEXT_SIZE};
    const size_t n = all ? block->n : block->n_recorded, size = sizes[type];
    if (n == block->n && (type == REAL || type == INTEGER)) {
        memcpy(row, block->values, n * size);
        return row + n * size;
    }
    for (size_t i = 0; i < n; i++, row += size) {
        size_t place = all ? i : block->recorded[i];
        if (type == BOOLEAN) {
            *row = ((const int *)block->values)[place] != 0;
        } else if (type == STRING) {
            const char *text = ((const char *const *)block->values)[place];
            strncpy(row, text ? text : "", TEXT_SIZE);
        } else {
            memcpy(row, (const char *)block->values + place * size, size);
        }
    }
    return row;
}

/* Write the time and the outputs, all or those to record, and return where the next row begins. */
static char *record(const Loop *loop, int all, double time, char *row) {
    memcpy(row, &time, sizeof time);
    row += sizeof time;
    for (size_t i = 0; i < loop->n_slaves; i++)
        for (int type = REAL; type < TYPES; type++) {
            const Block *block = &loop->slaves[i].outputs[type];
            if (block->n)
                row = record_block(row, block, all, type);
        }
    return row;
}

int settle(const Loop *loop, size_t passes, const double *given, size_t size, char *rows, volatile Watch *watch) {
    Loop lenient = *loop;
    lenient.must_be_finite = 0; /* what an FMU is fed first may be far from what it will be */
    for (size_t pass = 0; pass < passes; pass++) {
        for (size_t i = 0; i < loop->n_slaves; i++)
            if (!read(&lenient, i, watch))
                return -1;
        record(loop, 1, 0, rows + pass % 2 * size); /* first, for a String lasts until the next call of its FMU */
        for (size_t i = 0; i < loop->n_slaves; i++)
            if (!feed(&lenient, i, given, watch))
                return -1;
        watch->call = 0;
        if (pass && !memcmp(rows, rows + size, size))
            return 1;
    }
    return 0;
}

int begin(const Loop *loop, char *row, volatile Watch *watch) {
    for (size_t i = 0; i < loop->n_slaves; i++)
        if (!read(loop, i, watch))
            return 0;
    record(loop, 0, loop->start_time, row);
    watch->recorded = 1;
    watch->call = 0;
    return 1;
}

/* How many rows there are after so many steps, but for the first row; as in `exchange.py`. */
static double rows_after(size_t steps, double spacing) {
    return floor((double)steps / spacing + 1e-9);
}

size_t run(const Loop *loop, size_t first, size_t count, const double *given, double spacing, char *rows, volatile Watch *watch) {
    for (size_t n = 0; n < count; n++) {
        if (watch->stop)
            return n;
        watch->step = first + n;
        if (!take_step(loop, first + n, given ? given + n * loop->n_feeds : NULL, watch))
            return n;
        watch->call = 0;
        if (rows_after(first + n + 1, spacing) > rows_after(first + n, spacing)) {
            rows = record(loop, 0, loop->start_time + (double)(first + n + 1) * loop->step, rows);
            watch->recorded++;
        }
    }
    return count;
}
