/* The motor-driven shaft with each friction law, integrated by SUNDIALS CVODE (BDF): the reference for valve-model.
 *
 * Same equations: J w' = Th sin(N(cmd - th)) - D w - F, and F by law, with g(w) = Tc + (Ts - Tc) exp(-(w/ws)^2):
 *   lugre     F = s0 z + s1 z' + s2 w,    z' = w - s0 |w| z / g(w)
 *   leuven    F = Fh + s1 z' + s2 w,      z' = w (1 - sgn(w Fh) |Fh/g|^n),  Fh the sum of M equal springs of s0/M that
 *             slip at W_i, in proportion to i and adding up to ratio Ts
 *   dahl      F = s0 z + s2 w,            z' = w |r|^i sgn(r),  r = 1 - sgn(w) s0 z / Tc
 *   stribeck  F = g(w) tanh(w/wr) + s2 w
 * The command is linear within each cycle, so the solver is started anew at a cycle's beginning only where the
 * command's slope jumps. LuGre has its Jacobian in closed form; for the others CVODE takes differences.
 *
 * usage: cvode_valve RTOL CYCLES PERIOD_S LAW J Th N D Tc Ts ws s0 s1 s2 X M RATIO < command angles, CYCLES + 1 of them
 *        X is Dahl's i, Leuven's n or Stribeck's wr; M and RATIO are Leuven's
 * prints per cycle: angle speed friction_torque; the time per cycle in us on stderr.
 */
#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <time.h>

enum { ELEMENTS = 16 };

typedef struct {
    char law;
    double J, Th, N, D, Tc, Ts, ws, s0, s1, s2, x;
    int elements;
    double slip[ELEMENTS];
    double cmd, rate, t0;
} Valve;

static double curve(const Valve *p, double w, double *dg) {
    double x = w / p->ws;
    double e = exp(-x * x);
    *dg = -2.0 * x / p->ws * (p->Ts - p->Tc) * e;
    return p->Tc + (p->Ts - p->Tc) * e;
}

static double sgn(double x) { return (x > 0) - (x < 0); }

/* The friction torque and the rates of the contact's own states s (z, then Leuven's springs). */
static double friction(const Valve *p, double w, const double *s, double *rates) {
    double dg, z = s[0], rate = 0.0, spring = p->s0 * z;
    switch (p->law) {
    case 'l':
        rate = w - p->s0 * fabs(w) * z / curve(p, w, &dg);
        break;
    case 'v': {
        spring = 0.0;
        for (int i = 0; i < p->elements; i++) spring += s[1 + i];
        double reached = spring / curve(p, w, &dg);
        rate = w * (1.0 - sgn(w * spring) * pow(fabs(reached), p->x));
        for (int i = 0; i < p->elements; i++) {
            int slips = fabs(s[1 + i]) >= p->slip[i] && s[1 + i] * rate > 0.0;
            rates[1 + i] = slips ? 0.0 : p->s0 / p->elements * rate;
        }
        break;
    }
    case 'd': {
        double r = 1.0 - sgn(w) * p->s0 * z / p->Tc;
        rate = w * pow(fabs(r), p->x) * sgn(r);
        break;
    }
    default:
        rates[0] = 0.0;
        return curve(p, w, &dg) * tanh(w / p->x) + p->s2 * w;
    }
    rates[0] = rate;
    return spring + (p->law == 'd' ? 0.0 : p->s1) * rate + p->s2 * w;
}

static int rates(realtype t, N_Vector y, N_Vector ydot, void *data) {
    const Valve *p = data;
    const double *s = NV_DATA_S(y);
    double *d = NV_DATA_S(ydot);
    double F = friction(p, s[1], s + 2, d + 2);
    d[0] = s[1];
    d[1] = (p->Th * sin(p->N * (p->cmd + p->rate * (t - p->t0) - s[0])) - p->D * s[1] - F) / p->J;
    return 0;
}

static int lugre_jacobian(realtype t, N_Vector y, N_Vector fy, SUNMatrix A, void *data, N_Vector a, N_Vector b,
                          N_Vector c) {
    const Valve *p = data;
    const double *s = NV_DATA_S(y);
    double dg, w = s[1], z = s[2], g = curve(p, w, &dg);
    (void)fy, (void)a, (void)b, (void)c;
    double zw = 1.0 - (w < 0 ? -1.0 : 1.0) * p->s0 * z / g + p->s0 * fabs(w) * z / (g * g) * dg;
    double zz = -p->s0 * fabs(w) / g;
    double k = p->Th * p->N * cos(p->N * (p->cmd + p->rate * (t - p->t0) - s[0]));
    SUNMatZero(A);
    SM_ELEMENT_D(A, 0, 1) = 1.0;
    SM_ELEMENT_D(A, 1, 0) = -k / p->J;
    SM_ELEMENT_D(A, 1, 1) = -(p->D + p->s1 * zw + p->s2) / p->J;
    SM_ELEMENT_D(A, 1, 2) = -(p->s0 + p->s1 * zz) / p->J;
    SM_ELEMENT_D(A, 2, 1) = zw;
    SM_ELEMENT_D(A, 2, 2) = zz;
    return 0;
}

/* Of the processor, not of the clock on the wall: what else runs on the machine does not count. */
static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void need(int flag, const char *what) {
    if (flag < 0) {
        fprintf(stderr, "cvode_valve: %s failed: %d\n", what, flag);
        exit(1);
    }
}

static Valve read_valve(char **argv) {
    double v[13];
    for (int i = 0; i < 13; i++) v[i] = atof(argv[5 + i]);
    char law = strcmp(argv[4], "leuven") == 0 ? 'v' : argv[4][0];
    Valve p = {law, v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9], v[10], 0, {0}, 0, 0, 0};
    if (law == 'v') {
        p.elements = (int)v[11];
        for (int i = 0; i < p.elements; i++)
            p.slip[i] = 2.0 * (i + 1) / (p.elements * (p.elements + 1.0)) * v[12] * p.Ts;
    }
    return p;
}

int main(int argc, char **argv) {
    if (argc != 18 || atoi(argv[16]) > ELEMENTS) {
        fprintf(stderr, "usage: cvode_valve RTOL CYCLES PERIOD_S LAW J Th N D Tc Ts ws s0 s1 s2 X M RATIO < commands\n");
        return 2;
    }
    double rtol = atof(argv[1]), period = atof(argv[3]);
    int cycles = atoi(argv[2]);
    Valve p = read_valve(argv);
    int size = 3 + p.elements;
    double *command = malloc(((size_t)cycles + 1) * sizeof *command);
    double *out = malloc((size_t)cycles * 3 * sizeof *out);
    for (int k = 0; k <= cycles; k++) {
        if (scanf("%lf", &command[k]) != 1) {
            fprintf(stderr, "cvode_valve: command %d of %d missing\n", k, cycles + 1);
            return 2;
        }
    }
    SUNContext context;
    need(SUNContext_Create(NULL, &context), "SUNContext_Create");
    N_Vector y = N_VNew_Serial(size, context), atol = N_VNew_Serial(size, context);
    double *s = NV_DATA_S(y), *tol = NV_DATA_S(atol);
    memset(s, 0, (size_t)size * sizeof *s);
    s[0] = command[0];
    /* Absolute tolerances in proportion to what each state reaches. */
    tol[0] = rtol * 0.2;
    tol[1] = rtol * 1.0;
    tol[2] = rtol * p.Ts / p.s0;
    for (int i = 3; i < size; i++) tol[i] = rtol * p.Ts / p.elements;
    void *cv = CVodeCreate(CV_BDF, context);
    SUNMatrix A = SUNDenseMatrix(size, size, context);
    SUNLinearSolver ls = SUNLinSol_Dense(y, A, context);
    need(CVodeInit(cv, rates, 0.0, y), "CVodeInit");
    need(CVodeSVtolerances(cv, rtol, atol), "CVodeSVtolerances");
    need(CVodeSetLinearSolver(cv, ls, A), "CVodeSetLinearSolver");
    if (p.law == 'l') need(CVodeSetJacFn(cv, lugre_jacobian), "CVodeSetJacFn");
    need(CVodeSetUserData(cv, &p), "CVodeSetUserData");
    need(CVodeSetMaxNumSteps(cv, 100000000), "CVodeSetMaxNumSteps");
    need(CVodeSetMaxErrTestFails(cv, 100), "CVodeSetMaxErrTestFails");
    need(CVodeSetMaxConvFails(cv, 1000), "CVodeSetMaxConvFails");
    double scratch[1 + ELEMENTS], begin = seconds();
    for (int k = 0; k < cycles; k++) {
        realtype t = k * period, end = (k + 1) * period;
        p.cmd = command[k];
        p.rate = (command[k + 1] - command[k]) / period;
        p.t0 = t;
        /* Never step across the beginning of a cycle, where the command's slope jumps; begin anew where it jumps by
         * much, as a user of the solver would. */
        double before = k == 0 ? 0.0 : (command[k] - command[k - 1]) / period;
        if (fabs(p.rate - before) > 0.1) need(CVodeReInit(cv, t, y), "CVodeReInit");
        need(CVodeSetStopTime(cv, end), "CVodeSetStopTime");
        need(CVode(cv, end, y, &t, CV_NORMAL), "CVode");
        out[3 * k] = s[0];
        out[3 * k + 1] = s[1];
        out[3 * k + 2] = friction(&p, s[1], s + 2, scratch);
    }
    double spent = seconds() - begin;
    for (int k = 0; k < cycles; k++) printf("%.17g %.17g %.17g\n", out[3 * k], out[3 * k + 1], out[3 * k + 2]);
    fprintf(stderr, "us_per_cycle %.4f\n", spent / cycles * 1e6);
    CVodeFree(&cv);
    SUNLinSolFree(ls);
    SUNMatDestroy(A);
    N_VDestroy(y);
    N_VDestroy(atol);
    SUNContext_Free(&context);
    free(command);
    free(out);
    return 0;
}
