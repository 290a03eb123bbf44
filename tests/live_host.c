/* The same as live.mjs, with the same C linked into a program. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int live_begin(void);
int live_set(uint32_t reference, double value);
size_t live_run(double step, size_t steps, size_t every, const uint32_t *references, size_t n, double *rows);

int main(int argc, char **argv) {
    static uint32_t references[1024];
    size_t n = 0, steps = (size_t)atol(argv[2]);
    for (char *word = strtok(argv[4], ","); word; word = strtok(NULL, ","))
        references[n++] = (uint32_t)atol(word);
    double *rows = calloc((steps + 1) * n, sizeof *rows);
    int well = live_begin();
    for (int i = 5; i < argc && well; i++)
        well = live_set((uint32_t)atol(argv[i]), atof(strchr(argv[i], '=') + 1));
    size_t done = well ? live_run(atof(argv[1]), steps, (size_t)atol(argv[3]), references, n, rows) : 0;
    fwrite(rows, sizeof *rows * n, done, stdout);
    free(rows);
    return 0;
}
