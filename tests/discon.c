/* A controller library for the tests: does what the first word of its input file says, and a plain law besides. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int calls = 0; /* a library keeps its state */

void DISCON(float *swap, int *fail, char *infile, char *outname, char *message) {
    char what[32] = "";
    float when = 0.0f, value = 0.0f;
    float *record = swap - 1; /* record[1] is record 1 */
    FILE *file = fopen(infile, "r");
    if (file) {
        if (fscanf(file, "%31s %f %f", what, &when, &value) < 1) what[0] = 0;
        fclose(file);
    }
    if (record[1] == 0.0f) printf("hello from the library\n"), fflush(stdout);
    calls++;
    record[42] = record[43] = record[44] = 0.06f;
    record[45] = 0.07f;
    record[47] = 40000.0f;
    if (!strcmp(what, "count")) record[47] = (float)calls;
    if (!strcmp(what, "lengths")) {
        record[47] = (float)(strlen(infile) + 1 == (size_t)record[50] && strlen(outname) + 1 == (size_t)record[51]);
    }
    if (!strcmp(what, "each")) record[43] = 0.08f, record[44] = 0.10f;
    if (!strcmp(what, "yaw")) record[48] = 0.004f;
    if (!strcmp(what, "off")) record[35] = 0.0f;
    if (!strcmp(what, "brake")) record[36] = 1.0f;
    if (!strcmp(what, "override")) record[55] = 1.0f;
    if (!strcmp(what, "flap")) record[120] = 5.0f;
    if (!strcmp(what, "dump") && record[2] >= when) {
        char name[4096];
        snprintf(name, sizeof name, "%s.records", outname);
        if ((file = fopen(name, record[1] == 0.0f ? "w" : "a"))) {
            for (int i = 1; i <= 129; i++) fprintf(file, "%.9g ", record[i]);
            fprintf(file, "\n");
            fclose(file);
        }
    }
    if (record[2] < when) return;
    if (!strcmp(what, "crash")) *(volatile int *)0 = 1;
    if (!strcmp(what, "exit")) exit(3);
    if (!strcmp(what, "hang")) for (;;) {}
    if (!strcmp(what, "nan")) record[47] = NAN;
    if (!strcmp(what, "fail")) *fail = -1, strcpy(message, "the gearbox is too hot");
    if (!strcmp(what, "warn")) *fail = 1, strcpy(message, "oil is low");
}
