/* The workloads with SUNDIALS, as its manual advises for them: serial vectors, analytic Jacobian (dense, banded for the
 * chain), solver objects made once and re-initialised, output by interpolation between its own steps.
 *
 *   sundials_workloads SOLVER RTOL ATOL REPETITIONS STATES_FILE case2 STIFFNESS CUBIC_STIFFNESS INERTIA_3
 *   sundials_workloads SOLVER RTOL ATOL REPETITIONS STATES_FILE chain STIFFNESS CUBIC_STIFFNESS BODIES T_END
 *   sundials_workloads SOLVER RTOL ATOL REPETITIONS RESULTS_FILE sweep PARAMETERS_FILE
 *
 * SOLVER: adams (CVODE, fixed-point iteration), bdf, bdf2 (CVODE with Newton's method, order at most 5, 2), erk5, erk8
 * (ARKODE with Dormand-Prince 5(4), Fehlberg 8(7)). Prints one JSON object with the seconds of every repetition and the
 * counts; omega and phi of all bodies at the output times go to STATES_FILE, omega_1, omega_2, phi_1, phi_2 for case2.
 * PARAMETERS_FILE holds c and k1 of variants of case2 as native doubles, RESULTS_FILE gets the states at the end and the
 * largest |elastic moment| of each, whose times are the solvers' roots of the twist's rate. */
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sunlinsol/sunlinsol_band.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_band.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <time.h>

typedef struct {
  double stiffness, cubic_stiffness, inertia_3, viscous;
  int bodies;
} machine_t;

typedef struct {
  CVRhsFn derivative;
  CVLsJacFn jacobian;
  machine_t machine;
  int states, outputs, is_banded;
  double t_end;
} workload_t;

static const double ratio = 2.0 / 3.0;
static const double chain_damping = 1.0, chain_torque = 100.0, chain_load = 10.0;

static void give_up(const char *what)
{
  fprintf(stderr, "sundials_workloads: %s\n", what);
  exit(1);
}

static void check(int flag, const char *what)
{
  if (flag < 0) give_up(what);
}

static double moment(const machine_t *m, double twist)
{
  return (m->stiffness + m->cubic_stiffness * twist * twist) * twist;
}

static double tangent_stiffness(const machine_t *m, double twist)
{
  return m->stiffness + 3.0 * m->cubic_stiffness * twist * twist;
}

/* States omega_1, omega_2, phi_1, phi_2. */
static int case2_derivative(double t, N_Vector state, N_Vector rate, void *data)
{
  const machine_t *m = data;
  const double *y = N_VGetArrayPointer(state);
  double *f = N_VGetArrayPointer(rate);
  const double elastic = moment(m, y[3] - y[2]);
  f[0] = (200.0 - (10.0 + y[0]) * y[0] + 20.0 * sin(5.0 * t) + elastic) / 10.0;
  f[1] = -(elastic + ratio * ratio * m->viscous * y[1]) / (5.0 + ratio * ratio * m->inertia_3);
  f[2] = y[0];
  f[3] = y[1];
  return 0;
}

static int case2_jacobian(double t, N_Vector state, N_Vector rate, SUNMatrix jacobian, void *data, N_Vector a, N_Vector b,
                          N_Vector c)
{
  const machine_t *m = data;
  const double *y = N_VGetArrayPointer(state);
  const double stiffness = tangent_stiffness(m, y[3] - y[2]), inertia_23 = 5.0 + ratio * ratio * m->inertia_3;
  (void)t, (void)rate, (void)a, (void)b, (void)c;
  SM_ELEMENT_D(jacobian, 0, 0) = -(10.0 + 2.0 * y[0]) / 10.0;
  SM_ELEMENT_D(jacobian, 0, 2) = -stiffness / 10.0;
  SM_ELEMENT_D(jacobian, 0, 3) = stiffness / 10.0;
  SM_ELEMENT_D(jacobian, 1, 1) = -ratio * ratio * m->viscous / inertia_23;
  SM_ELEMENT_D(jacobian, 1, 2) = stiffness / inertia_23;
  SM_ELEMENT_D(jacobian, 1, 3) = -stiffness / inertia_23;
  SM_ELEMENT_D(jacobian, 2, 0) = 1.0;
  SM_ELEMENT_D(jacobian, 3, 1) = 1.0;
  return 0;
}

static int twist_rate(double t, N_Vector state, double *rate, void *data)
{
  const double *y = N_VGetArrayPointer(state);
  (void)t, (void)data;
  *rate = y[1] - y[0];
  return 0;
}

/* States omega_1, phi_1, omega_2, phi_2 ... of rotors of inertia 1: the band is narrow. */
static int chain_derivative(double t, N_Vector state, N_Vector rate, void *data)
{
  const machine_t *m = data;
  const double *y = N_VGetArrayPointer(state);
  double *f = N_VGetArrayPointer(rate);
  const int last = 2 * (m->bodies - 1);
  double before = chain_torque; /* on the rotor, from its left */
  (void)t;
  for (int i = 0; i < last; i += 2) {
    const double after = moment(m, y[i + 3] - y[i + 1]) + chain_damping * (y[i + 2] - y[i]);
    f[i] = before + after;
    f[i + 1] = y[i];
    before = -after;
  }
  f[last] = before - chain_load * y[last];
  f[last + 1] = y[last];
  return 0;
}

static int chain_jacobian(double t, N_Vector state, N_Vector rate, SUNMatrix jacobian, void *data, N_Vector a, N_Vector b,
                          N_Vector c)
{
  const machine_t *m = data;
  const double *y = N_VGetArrayPointer(state);
  const int last = 2 * (m->bodies - 1);
  double before = 0.0, damping_before = 0.0;
  (void)t, (void)rate, (void)a, (void)b, (void)c;
  for (int i = 0; i < last; i += 2) {
    const double after = tangent_stiffness(m, y[i + 3] - y[i + 1]);
    SM_ELEMENT_B(jacobian, i, i) = -(damping_before + chain_damping);
    SM_ELEMENT_B(jacobian, i, i + 1) = -(before + after);
    SM_ELEMENT_B(jacobian, i, i + 2) = chain_damping;
    SM_ELEMENT_B(jacobian, i, i + 3) = after;
    SM_ELEMENT_B(jacobian, i + 2, i) = chain_damping;
    SM_ELEMENT_B(jacobian, i + 2, i + 1) = after;
    SM_ELEMENT_B(jacobian, i + 1, i) = 1.0;
    before = after;
    damping_before = chain_damping;
  }
  SM_ELEMENT_B(jacobian, last, last) = -(damping_before + chain_load);
  SM_ELEMENT_B(jacobian, last, last + 1) = -before;
  SM_ELEMENT_B(jacobian, last + 1, last) = 1.0;
  return 0;
}

static double seconds_now(void)
{
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec + 1e-9 * now.tv_nsec;
}

static double output_time(const workload_t *w, int output)
{
  return output == w->outputs - 1 ? w->t_end : w->t_end / (w->outputs - 1) * output;
}

/* One solver behind three calls. */
typedef struct {
  void *memory;
  int is_arkode;
} solver_t;

static int restart(const solver_t *s, const workload_t *w, N_Vector y)
{
  return s->is_arkode ? ERKStepReInit(s->memory, w->derivative, 0.0, y) : CVodeReInit(s->memory, 0.0, y);
}

static int step(const solver_t *s, double t_end, N_Vector y, double *t)
{
  return s->is_arkode ? ERKStepEvolve(s->memory, t_end, y, t, ARK_ONE_STEP) : CVode(s->memory, t_end, y, t, CV_ONE_STEP);
}

static int interpolate(const solver_t *s, double t, N_Vector y)
{
  return s->is_arkode ? ERKStepGetDky(s->memory, t, 0, y) : CVodeGetDky(s->memory, t, 0, y);
}

static void count(const solver_t *s, long *steps, long *evaluations)
{
  if (s->is_arkode) {
    ERKStepGetNumStepAttempts(s->memory, steps);
    ERKStepGetNumRhsEvals(s->memory, evaluations);
  } else {
    CVodeGetNumSteps(s->memory, steps);
    CVodeGetNumRhsEvals(s->memory, evaluations);
  }
}

static solver_t new_erk(const char *name, workload_t *w, N_Vector y, double rtol, double atol, SUNContext context)
{
  solver_t s = {ERKStepCreate(w->derivative, 0.0, y, context), 1};
  check(ERKStepSStolerances(s.memory, rtol, atol), "tolerances");
  check(ERKStepSetUserData(s.memory, &w->machine), "user data");
  check(ERKStepSetTableNum(s.memory, strcmp(name, "erk8") == 0 ? ARKODE_FEHLBERG_13_7_8 : ARKODE_DORMAND_PRINCE_7_4_5), "table");
  check(ERKStepSetInterpolantDegree(s.memory, 5), "interpolant");
  return s;
}

static solver_t new_cvode(const char *name, workload_t *w, N_Vector y, double rtol, double atol, SUNContext context)
{
  const int is_adams = strcmp(name, "adams") == 0;
  solver_t s = {CVodeCreate(is_adams ? CV_ADAMS : CV_BDF, context), 0};
  check(CVodeInit(s.memory, w->derivative, 0.0, y), "start");
  check(CVodeSStolerances(s.memory, rtol, atol), "tolerances");
  check(CVodeSetUserData(s.memory, &w->machine), "user data");
  check(CVodeSetMaxNumSteps(s.memory, -1), "number of steps");
  if (is_adams) {
    check(CVodeSetNonlinearSolver(s.memory, SUNNonlinSol_FixedPoint(y, 0, context)), "fixed-point iteration");
    return s;
  }
  SUNMatrix matrix = w->is_banded ? SUNBandMatrix(w->states, 3, 2, context) : SUNDenseMatrix(w->states, w->states, context);
  SUNLinearSolver solver = w->is_banded ? SUNLinSol_Band(y, matrix, context) : SUNLinSol_Dense(y, matrix, context);
  check(CVodeSetLinearSolver(s.memory, solver, matrix), "linear solver");
  check(CVodeSetJacFn(s.memory, w->jacobian), "Jacobian");
  if (strcmp(name, "bdf2") == 0) check(CVodeSetMaxOrd(s.memory, 2), "order");
  return s;
}

static workload_t workload_of(char **words)
{
  workload_t w = {0};
  if (strcmp(words[0], "sweep") == 0) {
    w.machine = (machine_t){.stiffness = 100.0, .inertia_3 = 5.0};
    w.derivative = case2_derivative, w.jacobian = case2_jacobian;
    w.states = 4, w.t_end = 10.0;
    return w;
  }
  w.machine.stiffness = atof(words[1]);
  w.machine.cubic_stiffness = atof(words[2]);
  if (strcmp(words[0], "case2") == 0) {
    w.machine.inertia_3 = atof(words[3]), w.machine.viscous = 100.0;
    w.derivative = case2_derivative, w.jacobian = case2_jacobian;
    w.states = 4, w.outputs = 1001, w.t_end = 10.0;
  } else {
    w.machine.bodies = atoi(words[3]);
    w.derivative = chain_derivative, w.jacobian = chain_jacobian;
    w.states = 2 * w.machine.bodies, w.outputs = 2, w.t_end = atof(words[4]), w.is_banded = 1;
  }
  return w;
}

/* From rest to the end; states[output]. */
static void integrate(const solver_t *s, const workload_t *w, N_Vector y, N_Vector point, double *states)
{
  double t = 0.0;
  N_VConst(0.0, y);
  check(restart(s, w, y), "start");
  memcpy(states, N_VGetArrayPointer(y), w->states * sizeof *states);
  for (int next = 1; next < w->outputs;) {
    check(step(s, w->t_end, y, &t), "step");
    for (; next < w->outputs && output_time(w, next) <= t; next++) {
      N_VSetArrayPointer(states + (size_t)next * w->states, point);
      check(interpolate(s, output_time(w, next), point), "interpolation");
    }
  }
}

/* From rest to the end; results: the state there and the largest |moment|. */
static void integrate_variant(const solver_t *s, const workload_t *w, N_Vector y, double *results)
{
  const double *state = N_VGetArrayPointer(y);
  double t = 0.0, peak = 0.0;
  N_VConst(0.0, y);
  check(restart(s, w, y), "start");
  while (t < w->t_end) {
    check(s->is_arkode ? ERKStepEvolve(s->memory, w->t_end, y, &t, ARK_NORMAL) : CVode(s->memory, w->t_end, y, &t, CV_NORMAL),
          "step");
    peak = fmax(peak, fabs(moment(&w->machine, state[3] - state[2])));
  }
  memcpy(results, state, w->states * sizeof *results);
  results[w->states] = peak;
}

/* All variants of a file of c and k1; results[variant]. */
static double *sweep(const solver_t *s, workload_t *w, N_Vector y, const char *file_name, long *variants, double *seconds,
                     long *steps, long *evaluations)
{
  FILE *file = fopen(file_name, "rb");
  if (!file || fseek(file, 0, SEEK_END) != 0) give_up("the parameters cannot be read");
  *variants = ftell(file) / (2 * (long)sizeof(double));
  double (*parameters)[2] = malloc(*variants * sizeof *parameters);
  double *results = malloc(*variants * (w->states + 1) * sizeof *results);
  rewind(file);
  if (fread(parameters, sizeof *parameters, *variants, file) != (size_t)*variants) give_up("the parameters cannot be read");
  fclose(file);
  check(s->is_arkode ? ERKStepRootInit(s->memory, 1, twist_rate) : CVodeRootInit(s->memory, 1, twist_rate), "roots");
  *seconds = seconds_now();
  for (long i = 0; i < *variants; i++) {
    long these_steps, these_evaluations;
    w->machine.viscous = parameters[i][0], w->machine.cubic_stiffness = parameters[i][1];
    integrate_variant(s, w, y, results + i * (w->states + 1));
    count(s, &these_steps, &these_evaluations);
    *steps += these_steps, *evaluations += these_evaluations;
  }
  *seconds = seconds_now() - *seconds;
  free(parameters);
  return results;
}

/* The chain's states by kind: omega of all bodies, then phi. */
static void sort_chain(const workload_t *w, double *states)
{
  double *sorted = malloc(w->states * sizeof *sorted);
  for (int output = 0; output < w->outputs; output++) {
    double *y = states + (size_t)output * w->states;
    for (int i = 0; i < w->machine.bodies; i++) {
      sorted[i] = y[2 * i];
      sorted[w->machine.bodies + i] = y[2 * i + 1];
    }
    memcpy(y, sorted, w->states * sizeof *y);
  }
  free(sorted);
}

static void write_and_report(const char *file_name, const double *numbers, size_t count, long steps, long evaluations,
                             const double *seconds, int repetitions)
{
  FILE *file = fopen(file_name, "wb");
  if (!file || fwrite(numbers, sizeof *numbers, count, file) != count || fclose(file) != 0) {
    give_up("the results cannot be written");
  }
  printf("{\"steps\": %ld, \"evaluations\": %ld, \"seconds\": [", steps, evaluations);
  for (int i = 0; i < repetitions; i++) printf("%s%.6e", i > 0 ? ", " : "", seconds[i]);
  printf("]}\n");
}

int main(int arguments, char **words)
{
  if (arguments < 8) give_up("wrong number of arguments");
  const int is_sweep = strcmp(words[6], "sweep") == 0, is_chain = strcmp(words[6], "chain") == 0;
  if (arguments != (is_sweep ? 8 : is_chain ? 11 : 10)) give_up("wrong number of arguments");
  const char *name = words[1];
  const double rtol = atof(words[2]), atol = atof(words[3]);
  const int repetitions = is_sweep ? 1 : atoi(words[4]);
  workload_t w = workload_of(words + 6);
  SUNContext context;
  check(SUNContext_Create(NULL, &context), "context");
  N_Vector y = N_VNew_Serial(w.states, context), point = N_VNewEmpty_Serial(w.states, context);
  N_VConst(0.0, y);
  const solver_t s = strncmp(name, "erk", 3) == 0 ? new_erk(name, &w, y, rtol, atol, context)
                                                   : new_cvode(name, &w, y, rtol, atol, context);
  long steps = 0, evaluations = 0;
  double *seconds = malloc(repetitions * sizeof *seconds);
  if (is_sweep) {
    long variants;
    double *results = sweep(&s, &w, y, words[7], &variants, seconds, &steps, &evaluations);
    write_and_report(words[5], results, (size_t)variants * (w.states + 1), steps, evaluations, seconds, repetitions);
    return 0;
  }
  double *states = malloc((size_t)w.outputs * w.states * sizeof *states);
  for (int i = 0; i < repetitions; i++) {
    seconds[i] = seconds_now();
    integrate(&s, &w, y, point, states);
    seconds[i] = seconds_now() - seconds[i];
  }
  count(&s, &steps, &evaluations);
  if (w.is_banded) sort_chain(&w, states);
  write_and_report(words[5], states, (size_t)w.outputs * w.states, steps, evaluations, seconds, repetitions);
  return 0;
}
