/* The motor-driven shaft with LuGre friction, integrated by SUNDIALS CVODE (BDF): the reference for valve-model.
 *
 * Same equations as valve-model: J w' = Th sin(N(cmd - th)) - D w - F,  F = s0 z + s1 z' + s2 w,
 * z' = w - s0 |w| z / g(w),  g(w) = Tc + (Ts - Tc) exp(-(w/ws)^2). The command is linear within each cycle, so the
 * solver is started anew at every cycle's beginning only where the command's slope jumps.
 *
 * usage: cvode_lugre RTOL CYCLES PERIOD_S J Th N D Tc Ts ws s0 s1 s2 [RING] < command angles, CYCLES + 1 of them
 * prints per cycle: angle speed z friction_torque; the time per cycle in us on stderr.
 * Build: cc -O3 -o cvode_lugre cvode_lugre.c -lsundials_cvode -lsundials_nvecserial -lsundials_sunmatrixdense
 *        -lsundials_sunlinsoldense -lm
 */
#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <time.h>

typedef struct {
    double J, Th, N, D, Tc, Ts, ws, s0, s1, s2;
    double cmd, rate, t0;
} Valve;

static void curve(const Valve *p, double w, double *g, double *dg) {
    double x = w / p->ws;
    double e = exp(-x * x);
    *g = p->Tc + (p->Ts - p->Tc) * e;
    *dg = -2.0 * x / p->ws * (p->Ts - p->Tc) * e;
}

static double friction(const Valve *p, double w, double z, double *zdot) {
    double g, dg;
    curve(p, w, &g, &dg);
    *zdot = w - p->s0 * fabs(w) * z / g;
    return p->s0 * z + p->s1 * *zdot + p->s2 * w;
}

static int rates(realtype t, N_Vector y, N_Vector ydot, void *data) {
    const Valve *p = data;
    const double *s = NV_DATA_S(y);
    double *d = NV_DATA_S(ydot), zdot;
    double F = friction(p, s[1], s[2], &zdot);
    double motor = p->Th * sin(p->N * (p->cmd + p->rate * (t - p->t0) - s[0])) - p->D * s[1];
    d[0] = s[1];
    d[1] = (motor - F) / p->J;
    d[2] = zdot;
    return 0;
}

static int jacobian(realtype t, N_Vector y, N_Vector fy, SUNMatrix A, void *data, N_Vector a, N_Vector b, N_Vector c) {
    const Valve *p = data;
    const double *s = NV_DATA_S(y);
    double g, dg, w = s[1], z = s[2], sign = w < 0 ? -1.0 : 1.0;
    (void)fy, (void)a, (void)b, (void)c;
    curve(p, w, &g, &dg);
    double zw = 1.0 - sign * p->s0 * z / g + p->s0 * fabs(w) * z / (g * g) * dg;
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

static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void need(int flag, const char *what) {
    if (flag < 0) {
        fprintf(stderr, "cvode_lugre: %s failed: %d\n", what, flag);
        exit(1);
    }
}

int main(int argc, char **argv) {
    if (argc != 14) {
        fprintf(stderr, "usage: cvode_lugre RTOL CYCLES PERIOD_S J Th N D Tc Ts ws s0 s1 s2 < commands\n");
        return 2;
    }
    double v[14];
    for (int i = 1; i < 14; i++) v[i] = atof(argv[i]);
    double rtol = v[1], period = v[3];
    int cycles = (int)v[2];
    Valve p = {v[4], v[5], v[6], v[7], v[8], v[9], v[10], v[11], v[12], v[13], 0, 0, 0};
    double *command = malloc(((size_t)cycles + 1) * sizeof *command);
    double *out = malloc((size_t)cycles * 4 * sizeof *out);
    for (int k = 0; k <= cycles; k++) {
        if (scanf("%lf", &command[k]) != 1) {
            fprintf(stderr, "cvode_lugre: command %d of %d missing\n", k, cycles + 1);
            return 2;
        }
    }
    SUNContext context;
    need(SUNContext_Create(NULL, &context), "SUNContext_Create");
    N_Vector y = N_VNew_Serial(3, context), atol = N_VNew_Serial(3, context);
    double *s = NV_DATA_S(y), *tol = NV_DATA_S(atol);
    s[0] = s[1] = s[2] = 0.0;
    /* Absolute tolerances in proportion to what each state reaches. */
    tol[0] = rtol * 0.2;
    tol[1] = rtol * 1.0;
    tol[2] = rtol * p.Ts / p.s0;
    void *cv = CVodeCreate(CV_BDF, context);
    SUNMatrix A = SUNDenseMatrix(3, 3, context);
    SUNLinearSolver ls = SUNLinSol_Dense(y, A, context);
    need(CVodeInit(cv, rates, 0.0, y), "CVodeInit");
    need(CVodeSVtolerances(cv, rtol, atol), "CVodeSVtolerances");
    need(CVodeSetLinearSolver(cv, ls, A), "CVodeSetLinearSolver");
    need(CVodeSetJacFn(cv, jacobian), "CVodeSetJacFn");
    need(CVodeSetUserData(cv, &p), "CVodeSetUserData");
    need(CVodeSetMaxNumSteps(cv, 100000000), "CVodeSetMaxNumSteps");
    need(CVodeSetMaxErrTestFails(cv, 100), "CVodeSetMaxErrTestFails");
    need(CVodeSetMaxConvFails(cv, 1000), "CVodeSetMaxConvFails");
    double begin = seconds();
    for (int k = 0; k < cycles; k++) {
        realtype t = k * period, end = (k + 1) * period;
        p.cmd = command[k];
        p.rate = (command[k + 1] - command[k]) / period;
        p.t0 = t;
        /* The command's slope jumps at a cycle's beginning: never step across it, and drop to low order where it is
         * a large jump, as a user of the solver would. */
        double before = k == 0 ? 0.0 : (command[k] - command[k - 1]) / period;
        if (fabs(p.rate - before) > 0.1) need(CVodeReInit(cv, t, y), "CVodeReInit");
        need(CVodeSetStopTime(cv, end), "CVodeSetStopTime");
        need(CVode(cv, end, y, &t, CV_NORMAL), "CVode");
        double zdot;
        out[4 * k] = s[0];
        out[4 * k + 1] = s[1];
        out[4 * k + 2] = s[2];
        out[4 * k + 3] = friction(&p, s[1], s[2], &zdot);
    }
    double spent = seconds() - begin;
    for (int k = 0; k < cycles; k++)
        printf("%.17g %.17g %.17g %.17g\n", out[4 * k], out[4 * k + 1], out[4 * k + 2], out[4 * k + 3]);
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
