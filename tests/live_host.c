/* The same as live.mjs, with the same C linked into a program. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int live_begin(void);
int live_set(uint32_t reference, double value);
size_t live_run(double step, size_t steps, const uint32_t *references, size_t n, double *columns);

int main(int argc, char **argv) {
    static uint32_t references[1024];
    size_t n = 0, steps = (size_t)atol(argv[2]);
    for (char *word = strtok(argv[3], ","); word; word = strtok(NULL, ","))
        references[n++] = (uint32_t)atol(word);
    double *columns = calloc((steps + 1) * n, sizeof *columns);
    int well = live_begin();
    for (int i = 4; i < argc && well; i++)
        well = live_set((uint32_t)atol(argv[i]), atof(strchr(argv[i], '=') + 1));
    size_t done = well ? live_run(atof(argv[1]), steps, references, n, columns) : 0;
    for (size_t i = 0; i < n; i++)
        fwrite(columns + i * (steps + 1), sizeof *columns, done, stdout);
    free(columns);
    return 0;
}
