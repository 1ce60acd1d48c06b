/* A controller of meltemi as a library with the Bladed interface. The law is compiled in another object; constants.h is
   generated with it. Records, units and signs are those of OpenFAST 5; record n is swap[n - 1]. */
#define _GNU_SOURCE
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(__unix__) || defined(__APPLE__)
#include <dlfcn.h>
#define BESIDE 1
#endif
#ifdef _WIN32
#define PUBLIC __declspec(dllexport)
#define HIDDEN
#else
#define PUBLIC __attribute__((visibility("default")))
#define HIDDEN __attribute__((visibility("hidden")))
#endif
#include "constants.h"

typedef long long Long;
/* Numba's convention: result, exception, then for each vector owner, parent, items, size of one, data, shape, stride */
int meltemi_law(void **, void **, void *, void *, Long, Long, double *, Long, Long, void *, void *, Long, Long, double *, Long,
                Long, void *, void *, Long, Long, double *, Long, Long, double);

/* for vectors that Python owns: here none is */
HIDDEN void NRT_MemInfo_call_dtor(void *owner) { (void)owner; }

static double state[N_STATE], measured[N_MEASURED], demands[N_DEMANDS];
static Long calls, every;
static FILE *file;

static void message(char *text, int *fail, int value, const char *words) {
    *fail = value;
    snprintf(text, MESSAGE_SIZE, "%s", words);
    if (file) { fprintf(file, "%s\n", words); fflush(file); }
}

/* Parameters: lines "name value"; # begins a comment. Returns 0, or 1 with words. */
static int read_parameters(const char *path, char *words) {
    char line[512], name[256], rest[256], *end;
    FILE *input = fopen(path, "r");
    if (!input) { snprintf(words, 600, "%s: cannot be read", path); return 1; }
    for (int number = 1; fgets(line, sizeof line, input); number++) {
        if ((end = strchr(line, '#'))) *end = 0;
        int found = sscanf(line, "%255s %255s", name, rest);
        if (found < 1) continue;
        double value = found == 2 ? strtod(rest, &end) : NAN;
        int entry = 0;
        while (entry < N_STATE && strcmp(name, NAMES[entry])) entry++;
        if (found < 2 || *end || isnan(value) || entry == N_STATE) {
            snprintf(words, 600, "%s, line %d: expected the name of a parameter of " CONTROLLER " and a number, found: %.100s %.100s",
                     path, number, name, found == 2 ? rest : "");
            fclose(input);
            return 1;
        }
        state[entry] = value;
    }
    fclose(input);
    return 0;
}

/* Name of the parameter file beside this library: its own name with the ending .in; empty if there is none. */
static void beside(char *path, size_t size) {
    path[0] = 0;
#ifdef BESIDE
    Dl_info about;
    if (dladdr((void *)beside, &about) && about.dli_fname && strlen(about.dli_fname) + 4 < size) {
        strcpy(path, about.dli_fname);
        char *dot = strrchr(path, '.'), *slash = strrchr(path, '/');
        if (dot && (!slash || dot > slash)) *dot = 0;
        strcat(path, ".in");
        FILE *there = fopen(path, "r");
        if (there) fclose(there); else path[0] = 0;
    }
#endif
}

/* State at the operating point in which the run begins: rules that the export found. */
static void begin(const double *start) {
    for (int i = 0; i < N_RULES; i++) {
        const StartRule *r = &RULES[i];
        double x = start[r->input];
        if (r->kind == 0) state[r->entry] = r->a + x * (r->b + x * r->c);
        else if (r->kind == 1) state[r->entry] = x < r->a ? r->b : r->c;
        else {
            double at = (x - r->a) / (r->b - r->a) * (TABLE - 1);
            at = at < 0.0 ? 0.0 : at > TABLE - 1 ? TABLE - 1 : at;
            int low = at > TABLE - 2 ? TABLE - 2 : (int)at;
            state[r->entry] = r->table[low] + (at - low) * (r->table[low + 1] - r->table[low]);
        }
    }
}

static void measure(const float *swap, double dt) {
    double before = measured[YAW_ROW], azimuth = swap[59], y, z;
    for (int i = 0; i < N_READ; i++) measured[READ[i].row] = swap[READ[i].record - 1];
    if (fabs(calls * dt - measured[TIME_ROW]) < 1e-4 * (1.0 + measured[TIME_ROW])) measured[TIME_ROW] = calls * dt;
    measured[WIND_DIRECTION_ROW] = -swap[23] - measured[YAW_ROW];
    measured[YAW_RATE_ROW] = calls ? (measured[YAW_ROW] - before) / dt : 0.0;
    if (swap[12] > 0.0f) measured[POWER_REFERENCE_ROW] = swap[12];
    /* without records of fixed axes, those of axes that turn with blade 1 */
    y = swap[72], z = swap[73];
    if (swap[74] == 0.0f && swap[75] == 0.0f) {
        measured[HUB_MOMENT_ROW + 1] = y * cos(azimuth) - z * sin(azimuth);
        measured[HUB_MOMENT_ROW + 2] = z * cos(azimuth) + y * sin(azimuth);
    }
    measured[YAW_BEARING_ROW + 1] = swap[76];
    measured[YAW_BEARING_ROW + 2] = swap[77];
}

PUBLIC void DISCON(float *swap, int *fail, char *infile, char *outname, char *text) {
    int status = (int)lroundf(swap[0]);
    /* the whole fraction of a second, or decimal number, of which the record has seven digits */
    double dt = (double)swap[2], rate = round(1.0 / dt);
    dt = fabs(rate * dt - 1.0) < 2e-7 ? 1.0 / rate : round(1e6 * dt) / 1e6;
    char words[700], path[4096];
    *fail = 0;
    if (status == 0) {
        memcpy(state, FIRST, sizeof state);
        memcpy(measured, CONSTANT, sizeof measured);
        memset(demands, 0, sizeof demands);
        if (file) fclose(file);
        snprintf(path, sizeof path, "%.4000s.controller.log", outname);
        file = outname[0] ? fopen(path, "w") : NULL;
        if (file) fprintf(file, CONTROLLER " for " TURBINE ", exported by meltemi " VERSION "\n");
        double start[5] = {swap[19], swap[3], swap[22], swap[26], swap[26]};
        begin(start);
        if (infile[0]) snprintf(path, sizeof path, "%.4090s", infile); else beside(path, sizeof path);
        if (path[0]) {
            if (read_parameters(path, words)) { message(text, fail, -1, words); return; }
            if (file) fprintf(file, "parameters of %s\n", path);
        }
        every = SAMPLE_TIME > 0.0 ? llround(SAMPLE_TIME / dt) : 1;
        if (!(dt > 0.0) || every < 1 || (SAMPLE_TIME > 0.0 && fabs(every * dt - SAMPLE_TIME) > 1e-6 * SAMPLE_TIME)) {
            snprintf(words, sizeof words, CONTROLLER ": its sample time, %g s, is not a multiple of the interval of calls, %g s",
                     SAMPLE_TIME, dt);
            message(text, fail, -1, words);
            return;
        }
        if (lroundf(swap[60]) != N_BLADES) {
            snprintf(words, sizeof words, CONTROLLER ": made for " TURBINE " with %d blades, called for %ld", N_BLADES, lroundf(swap[60]));
            message(text, fail, -1, words);
            return;
        }
        calls = 0;
        demands[TORQUE_ROW] = swap[22];
        for (int b = 0; b < N_BLADES; b++) demands[PITCH_ROW + b] = swap[b ? 31 + b : 3];
    }
    if (status < 0) {
        if (file) { fprintf(file, "%.3f s: end after %lld calls\n", measured[TIME_ROW], calls); fclose(file); file = NULL; }
        return;
    }
    measure(swap, dt);
    if (calls++ % every == 0) {
        void *result = NULL, *raised = NULL;
        double before = demands[STATE_ROW], power = demands[POWER_STATE_ROW];
        int failed = meltemi_law(&result, &raised, NULL, NULL, N_STATE, 8, state, N_STATE, 8, NULL, NULL, N_MEASURED, 8,
                                 measured, N_MEASURED, 8, NULL, NULL, N_DEMANDS, 8, demands, N_DEMANDS, 8, every * dt);
        int finite = 1;
        for (int i = 0; i < N_DEMANDS; i++) finite &= isfinite(demands[i]) != 0;
        if (failed || !finite) {
            snprintf(words, sizeof words, CONTROLLER " %s at %.3f s", failed ? "raised an exception" : "gave a demand that is not finite",
                     measured[TIME_ROW]);
            message(text, fail, -1, words);
            return;
        }
        if (file && before != demands[STATE_ROW])
            fprintf(file, "%.3f s: state of operation %g -> %g\n", measured[TIME_ROW], before, demands[STATE_ROW]);
        if (file && power != demands[POWER_STATE_ROW])
            fprintf(file, "%.3f s: state of power control %g -> %g\n", measured[TIME_ROW], power, demands[POWER_STATE_ROW]);
    }
    swap[34] = 1.0f;
    swap[35] = demands[BRAKE_ROW] > 0.0 ? 1.0f : 0.0f;
    swap[40] = swap[45] = swap[54] = swap[55] = swap[64] = swap[71] = swap[78] = swap[79] = swap[80] = 0.0f;
    double mean = 0.0;
    for (int b = 0; b < N_BLADES; b++) {
        swap[41 + b] = (float)demands[PITCH_ROW + b];
        mean += demands[PITCH_ROW + b] / N_BLADES;
        if (N_FLAPS) swap[119 + b] = (float)(demands[FLAP_ROW + b] * 57.29577951308232);
    }
    swap[44] = (float)mean;
    swap[46] = (float)demands[TORQUE_ROW];
    swap[47] = (float)demands[YAW_RATE_DEMAND_ROW];
}
