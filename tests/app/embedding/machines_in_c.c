/* Machines in a program in C, by nocdyn.h: each function is a sentence that it proves.
 *
 *   machines_in_c [NAME]     all of them, or those with NAME in their names
 */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "nocdyn.h"

static int failures = 0;
#define CHECK(condition) \
  do { \
    if (!(condition)) { \
      printf("%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
      failures++; \
    } \
  } while (0)
#define NEAR(value, expected, tolerance) CHECK(fabs((value) - (expected)) <= (tolerance))

enum { most_signals = 100 };
static const double integrated = 1e-8; /* rtol and atol are 1e-11 */

/* A rotor of 2 kg m2 that a torque from outside drives against a viscous load. */
static const char rotor[] =
    "&body name = 'rotor' inertia = 2.0 speed = 3.0 /\n"
    "&load name = 'work' body = 'rotor' viscous = 1.0 /\n"
    "&excitation name = 'outside' body = 'rotor' kind = 'external' amplitude = 0.0 /\n"
    "&run t_end = 10.0 rtol = 1e-11 atol = 1e-11 /\n";

/* Two rotors of 1 kg m2; a clutch of 10 N m brings the second one to the speed of the first. */
static const char clutch[] =
    "&body name = 'left' inertia = 1.0 speed = 10.0 /\n"
    "&body name = 'right' inertia = 1.0 /\n"
    "&clutch name = 'between' bodies = 'left', 'right' capacity = 10.0 /\n"
    "&excitation name = 'outside' body = 'left' kind = 'external' amplitude = 0.0 /\n"
    "&run t_end = 10.0 rtol = 1e-11 atol = 1e-11 /\n";

static nocdyn_machine *open_text(const char *text) { return nocdyn_open_text(text, "given.nml", 0, NULL, NULL); }

/* The value of a signal now. */
static double value_of(nocdyn_machine *machine, const char *name) {
  double values[most_signals];
  if (nocdyn_read(machine, values) != nocdyn_done) return NAN;
  for (int i = 0; i < nocdyn_signal_count(machine); i++)
    if (strcmp(nocdyn_signal_name(machine, i), name) == 0) return values[i];
  printf("there is no signal %s\n", name);
  return NAN;
}

static void mistakes_are_told_with_file_line_and_key(void) {
  nocdyn_machine *machine = open_text("&body name = 'rotor' inertia = -2.0 /\n&load name = 'work' body = 'roter' /\n&run /\n");
  CHECK(nocdyn_code(machine) == nocdyn_wrong_input);
  CHECK(strncmp(nocdyn_message(machine), "given.nml:1: &body 'rotor': inertia = -2.0 is out of range", 54) == 0);
  CHECK(strstr(nocdyn_message(machine), "\ngiven.nml:2: &load 'work': body: there is no &body 'roter'") != NULL);
  CHECK(strstr(nocdyn_message(machine), "\ngiven.nml:3: &run: t_end is missing") != NULL);
  CHECK(nocdyn_signal_count(machine) == 0);
  CHECK(nocdyn_signal_name(machine, 0) == NULL);
  CHECK(nocdyn_run_to(machine, 1.0) == nocdyn_wrong_input);
  CHECK(nocdyn_set(machine, "load.work.viscous", 1.0) == nocdyn_wrong_input);
  CHECK(nocdyn_keep(machine) == NULL);
  nocdyn_close(machine);
  machine = nocdyn_open("no_such.nml", 0, NULL, NULL);
  CHECK(nocdyn_code(machine) == nocdyn_file);
  nocdyn_close(machine);
}

static void settings_and_load_cases_are_those_of_the_program(void) {
  const char *settings[] = {"run.t_end=2", "body.rotor.speed_rpm=60"};
  nocdyn_machine *machine = nocdyn_open_text(rotor, "given.nml", 2, settings, NULL);
  CHECK(nocdyn_code(machine) == nocdyn_done);
  NEAR(nocdyn_end_time(machine), 2.0, 0.0);
  NEAR(value_of(machine, "omega_rotor"), 2 * acos(-1.0), 1e-14);
  CHECK(strcmp(nocdyn_signal_name(machine, 0), "t") == 0);
  CHECK(strcmp(nocdyn_signal_unit(machine, 0), "s") == 0);
  CHECK(strcmp(nocdyn_signal_name(machine, 1), "phi_rotor") == 0);
  CHECK(strcmp(nocdyn_signal_kind(machine, 1), "body") == 0);
  CHECK(strcmp(nocdyn_signal_element(machine, 1), "rotor") == 0);
  CHECK(strlen(nocdyn_signal_caption(machine, 1)) > 0);
  CHECK(nocdyn_signal_name(machine, nocdyn_signal_count(machine)) == NULL);
  nocdyn_close(machine);

  char text[1000];
  snprintf(text, sizeof text, "%s&load_case name = 'light' set = 'load.work.viscous=0.5' /\n", rotor);
  machine = nocdyn_open_text(text, "given.nml", 0, NULL, "light");
  CHECK(nocdyn_run_to(machine, 2.0) == nocdyn_done);
  NEAR(value_of(machine, "omega_rotor"), 3 * exp(-0.5), integrated);
  nocdyn_close(machine);
  machine = nocdyn_open_text(text, "given.nml", 0, NULL, "heavy");
  CHECK(nocdyn_code(machine) == nocdyn_wrong_input);
  CHECK(strstr(nocdyn_message(machine), "there is no &load_case 'heavy'") != NULL);
  nocdyn_close(machine);
}

/* Rows of a run at `count` times to 4 s, with `between` other calls before each. */
static void rows_of(const char *text, int count, int between, double *rows) {
  nocdyn_machine *machine = open_text(text);
  int signals = nocdyn_signal_count(machine);
  for (int i = 1; i <= count; i++) {
    double last = nocdyn_time(machine), next = 4.0 * i / count;
    for (int k = 1; k <= between; k++) CHECK(nocdyn_run_to(machine, last + (next - last) * k / (between + 1)) == nocdyn_done);
    CHECK(nocdyn_run_to(machine, next) == nocdyn_done);
    CHECK(nocdyn_read(machine, rows + (i - 1) * signals) == nocdyn_done);
  }
  nocdyn_close(machine);
}

static void calls_without_changes_leave_every_bit_as_it_is(void) {
  static double whole[10 * most_signals], pieces[10 * most_signals];
  const char *texts[] = {rotor, clutch};
  for (int i = 0; i < 2; i++) {
    rows_of(texts[i], 10, 0, whole);
    rows_of(texts[i], 10, 7, pieces);
    CHECK(memcmp(whole, pieces, sizeof whole) == 0);
  }
}

static void a_number_that_is_set_applies_from_then_on(void) {
  nocdyn_machine *machine = open_text(rotor);
  CHECK(nocdyn_run_to(machine, 1.0) == nocdyn_done);
  CHECK(nocdyn_set(machine, "load.work.viscous", 4.0) == nocdyn_done);
  NEAR(value_of(machine, "torque_work"), -4 * 3 * exp(-0.5), 4 * integrated);
  CHECK(nocdyn_run_to(machine, 1.5) == nocdyn_done);
  NEAR(value_of(machine, "omega_rotor"), 3 * exp(-0.5 - 1.0), integrated);
  nocdyn_close(machine);
}

static void a_number_that_is_set_before_the_first_step_is_the_one_of_the_input(void) {
  const char *setting = "load.work.viscous=4";
  double given[most_signals], set[most_signals];
  nocdyn_machine *machine = nocdyn_open_text(rotor, "given.nml", 1, &setting, NULL);
  nocdyn_run_to(machine, 1.0);
  nocdyn_read(machine, given);
  int signals = nocdyn_signal_count(machine);
  nocdyn_close(machine);
  machine = open_text(rotor);
  CHECK(nocdyn_set(machine, "load.work.viscous", 4.0) == nocdyn_done);
  nocdyn_run_to(machine, 1.0);
  nocdyn_read(machine, set);
  CHECK(memcmp(given, set, signals * sizeof *set) == 0);
  nocdyn_close(machine);
}

/* Beyond t_end of the input, with the steps of a longer run but where that of the input cuts one. */
static void the_end_moves_to_any_time_ahead(void) {
  nocdyn_machine *machine = open_text(rotor);
  CHECK(nocdyn_end_time(machine) == 10.0);
  CHECK(nocdyn_run_to(machine, 4.0) == nocdyn_done);
  nocdyn_state *state = nocdyn_keep(machine);
  CHECK(nocdyn_set_end_time(machine, 4.0) == nocdyn_wrong_input);
  CHECK(strstr(nocdyn_message(machine), "allowed: a time after the present one, 4") != NULL);
  CHECK(nocdyn_set_end_time(machine, NAN) == nocdyn_wrong_input);
  CHECK(nocdyn_set_end_time(machine, 1e300) == nocdyn_done);
  CHECK(nocdyn_end_time(machine) == 1e300);
  CHECK(nocdyn_run_to(machine, 20.0) == nocdyn_done);
  NEAR(value_of(machine, "omega_rotor"), 3 * exp(-10.0), integrated);
  CHECK(nocdyn_restore(machine, state) == nocdyn_done);
  CHECK(nocdyn_end_time(machine) == 10.0);
  CHECK(nocdyn_run_to(machine, 20.0) == nocdyn_wrong_input);
  CHECK(nocdyn_run_to(machine, 10.0) == nocdyn_done);
  CHECK(nocdyn_set_end_time(machine, 20.0) == nocdyn_wrong_input);
  nocdyn_free_state(state);
  nocdyn_close(machine);
}

/* As if t_end were that of the input, also in a step that is held. */
static void a_moved_end_is_that_of_a_run(void) {
  const char *setting = "run.t_end=3";
  double given[most_signals], moved[most_signals];
  nocdyn_machine *machine = nocdyn_open_text(clutch, "given.nml", 1, &setting, NULL);
  nocdyn_run_to(machine, 3.0);
  nocdyn_read(machine, given);
  int signals = nocdyn_signal_count(machine);
  nocdyn_close(machine);
  machine = open_text(clutch);
  CHECK(nocdyn_set_end_time(machine, 3.0) == nocdyn_done);
  CHECK(nocdyn_run_to(machine, 3.0) == nocdyn_done);
  nocdyn_read(machine, moved);
  CHECK(memcmp(given, moved, signals * sizeof *moved) == 0);
  nocdyn_close(machine);
  machine = open_text(rotor);
  CHECK(nocdyn_run_to(machine, 9.9999) == nocdyn_done); /* the step to the end is held */
  CHECK(nocdyn_set_end_time(machine, 12.0) == nocdyn_done);
  CHECK(nocdyn_run_to(machine, 12.0) == nocdyn_done);
  NEAR(value_of(machine, "omega_rotor"), 3 * exp(-6.0), integrated);
  nocdyn_close(machine);
}

static void numbers_tell_their_paths_values_and_when_they_may_change(void) {
  nocdyn_machine *machine = open_text(rotor);
  nocdyn_number number;
  CHECK(nocdyn_set(machine, "load.work.viscous", 4.0) == nocdyn_done);
  CHECK(nocdyn_number_count(machine) == 4);
  nocdyn_describe_number(machine, 0, &number);
  CHECK(strcmp(number.path, "body.rotor.inertia") == 0 && number.value == 2.0);
  CHECK(number.change == nocdyn_change_at_start);
  nocdyn_describe_number(machine, 2, &number);
  CHECK(strcmp(number.path, "load.work.viscous") == 0 && strcmp(number.unit, "N m s/rad") == 0);
  CHECK(number.value == 4.0 && number.change == nocdyn_change_by_set);
  CHECK(strstr(number.caption, "viscous of &load 'work'") == number.caption);
  nocdyn_describe_number(machine, 3, &number);
  CHECK(strcmp(number.path, "excitation.outside.amplitude") == 0 && number.change == nocdyn_change_by_torque);
  nocdyn_close(machine);
  machine = open_text("&run /");
  CHECK(nocdyn_number_count(machine) == 0);
  CHECK(strcmp(nocdyn_whole_input(machine), "") == 0);
  CHECK(nocdyn_set_end_time(machine, 1.0) == nocdyn_wrong_input);
  nocdyn_close(machine);
}

/* Of any sign, and as the start of the governor follows from it, only in a motion: the integral stays as it is. */
static void the_set_speed_of_a_governor_is_a_set_point(void) {
  nocdyn_machine *machine = open_text(
      "&body name = 'rotor' inertia = 2.0 /\n"
      "&motor name = 'drive' body = 'rotor' kind = 'inverter' torque_limit = 100.0\n"
      "  governor_speed = 4.0 governor_gain = 0.05 governor_time = 0.5 /\n"
      "&run t_end = 20.0 rtol = 1e-11 atol = 1e-11 /\n");
  nocdyn_number number;
  int count = nocdyn_number_count(machine), points = 0;
  for (int i = 0; i < count; i++) {
    nocdyn_describe_number(machine, i, &number);
    if (number.change == nocdyn_change_as_set_point) points++;
    CHECK((number.change == nocdyn_change_as_set_point) == (strcmp(number.path, "motor.drive.governor_speed") == 0));
  }
  CHECK(points == 1);
  CHECK(nocdyn_set(machine, "motor.drive.governor_speed", -4.0) == nocdyn_done);
  NEAR(value_of(machine, "torque_drive"), -100.0 * 8.0 * 0.05, 1e-10);
  CHECK(nocdyn_run_to(machine, 20.0) == nocdyn_done);
  NEAR(value_of(machine, "omega_rotor"), -4.0, 1e-6);
  CHECK(nocdyn_set(machine, "motor.drive.governor_gain", 0.1) == nocdyn_wrong_input);
  nocdyn_close(machine);
}

static void the_whole_input_is_a_file_by_itself(void) {
  const char *setting = "load.work.viscous=4";
  double given[most_signals], again[most_signals];
  nocdyn_machine *machine = nocdyn_open_text(rotor, "given.nml", 1, &setting, NULL);
  nocdyn_machine *other = open_text(nocdyn_whole_input(machine));
  nocdyn_run_to(machine, 1.0);
  nocdyn_run_to(other, 1.0);
  nocdyn_read(machine, given);
  nocdyn_read(other, again);
  CHECK(memcmp(given, again, nocdyn_signal_count(machine) * sizeof *given) == 0);
  nocdyn_close(machine);
  nocdyn_close(other);
}

static void numbers_that_cannot_be_set_are_refused(void) {
  nocdyn_machine *machine = open_text(rotor);
  CHECK(nocdyn_set(machine, "load.work.vicsous", 1.0) == nocdyn_wrong_input);
  CHECK(strstr(nocdyn_message(machine), "viscous") != NULL);
  CHECK(nocdyn_set(machine, "load.work.viscous", 0.0) == nocdyn_wrong_input);
  CHECK(strstr(nocdyn_message(machine), "has another sign than 1") != NULL);
  CHECK(nocdyn_set(machine, "load.work.viscous", NAN) == nocdyn_wrong_input);
  CHECK(nocdyn_set(machine, "body.rotor.speed", 1.0) == nocdyn_wrong_input);
  CHECK(strstr(nocdyn_message(machine), "cannot be set while the machine runs") != NULL);
  CHECK(nocdyn_set(machine, "run.rtol", 1e-3) == nocdyn_wrong_input);
  CHECK(nocdyn_set_torque(machine, "work", 1.0, 0.0) == nocdyn_wrong_input);
  CHECK(strstr(nocdyn_message(machine), "there is no &excitation kind = 'external' with the name 'work'") != NULL);
  CHECK(nocdyn_set_torque(machine, "outside", INFINITY, 0.0) == nocdyn_wrong_input);
  CHECK(nocdyn_run_to(machine, 1.0) == nocdyn_done);
  CHECK(strcmp(nocdyn_message(machine), "") == 0);
  NEAR(value_of(machine, "omega_rotor"), 3 * exp(-0.5), integrated);
  CHECK(nocdyn_run_to(machine, 0.5) == nocdyn_wrong_input);
  CHECK(strstr(nocdyn_message(machine), "allowed: from the present time, 1") != NULL);
  CHECK(nocdyn_run_to(machine, 11.0) == nocdyn_wrong_input);
  nocdyn_close(machine);
  const char *setting = "run.formulation=paper";
  machine = nocdyn_open_text(rotor, "given.nml", 1, &setting, NULL);
  CHECK(nocdyn_set(machine, "load.work.viscous", 4.0) == nocdyn_wrong_input);
  CHECK(strstr(nocdyn_message(machine), "formulation = 'reduced'") != NULL);
  nocdyn_close(machine);
}

static void torques_from_outside_drive_in_every_formulation_and_by_every_method(void) {
  const char *formulations[] = {"run.formulation=reduced", "run.formulation=paper", "run.formulation=multiplier"};
  const char *methods[] = {"run.method=auto", "run.method=taylor", "run.method=rk45", "run.method=rodas4"};
  for (int f = 0; f < 3; f++) {
    for (int m = 0; m < 4; m++) {
      if (f > 0 && m == 1) continue; /* they have no Taylor series */
      const char *settings[] = {formulations[f], methods[m], "load.work.viscous=0"};
      nocdyn_machine *machine = nocdyn_open_text(rotor, "given.nml", 3, settings, NULL);
      CHECK(nocdyn_code(machine) == nocdyn_done);
      CHECK(nocdyn_run_to(machine, 1.0) == nocdyn_done);
      CHECK(nocdyn_set_torque(machine, "outside", 6.0, 0.0) == nocdyn_done);
      CHECK(nocdyn_run_to(machine, 2.0) == nocdyn_done);
      NEAR(value_of(machine, "omega_rotor"), 3.0 + 3.0, integrated);
      CHECK(nocdyn_set_torque(machine, "outside", 6.0, -8.0) == nocdyn_done);
      CHECK(nocdyn_run_to(machine, 3.0) == nocdyn_done);
      NEAR(value_of(machine, "omega_rotor"), 6.0 + 3.0 - 2.0, integrated);
      NEAR(value_of(machine, "torque_outside"), -2.0, 1e-12);
      nocdyn_close(machine);
    }
  }
}

/* Locked after 0.5 s at 5 rad/s: a torque of 16 N m has 8 N m in the clutch, one of 30 N m makes it slip. */
static void clutches_lock_between_calls_and_slip_by_torques_from_outside(void) {
  nocdyn_machine *machine = open_text(clutch);
  CHECK(nocdyn_run_to(machine, 1.0) == nocdyn_done);
  NEAR(value_of(machine, "omega_left"), 5.0, integrated);
  NEAR(value_of(machine, "omega_right"), 5.0, integrated);
  nocdyn_set_torque(machine, "outside", 16.0, 0.0);
  CHECK(nocdyn_run_to(machine, 2.0) == nocdyn_done);
  NEAR(value_of(machine, "omega_left"), 13.0, integrated);
  NEAR(value_of(machine, "omega_right"), 13.0, integrated);
  nocdyn_set_torque(machine, "outside", 30.0, 0.0);
  CHECK(nocdyn_run_to(machine, 3.0) == nocdyn_done);
  NEAR(value_of(machine, "omega_left"), 13.0 + 20.0, integrated);
  NEAR(value_of(machine, "omega_right"), 13.0 + 10.0, integrated);
  nocdyn_set_torque(machine, "outside", -30.0, 0.0);
  CHECK(nocdyn_run_to(machine, 4.0) == nocdyn_done); /* they meet after 0.2 s, at 25 rad/s, and slip the other way */
  NEAR(value_of(machine, "omega_left"), 25.0 - 0.8 * 20.0, 2 * integrated);
  NEAR(value_of(machine, "omega_right"), 25.0 - 0.8 * 10.0, 2 * integrated);
  CHECK(nocdyn_set(machine, "clutch.between.capacity", 40.0) == nocdyn_wrong_input);
  nocdyn_close(machine);
}

static void a_motion_that_is_kept_goes_on_with_the_same_bits(void) {
  double first[most_signals], again[most_signals], at[most_signals], back[most_signals];
  nocdyn_machine *machine = open_text(clutch);
  size_t bytes = nocdyn_signal_count(machine) * sizeof *first;
  nocdyn_run_to(machine, 0.3);
  nocdyn_set_torque(machine, "outside", 5.0, 1.0);
  nocdyn_read(machine, at);
  nocdyn_state *state = nocdyn_keep(machine);
  nocdyn_run_to(machine, 3.0);
  nocdyn_read(machine, first);
  for (int i = 0; i < 2; i++) {
    CHECK(nocdyn_restore(machine, state) == nocdyn_done);
    NEAR(nocdyn_time(machine), 0.3, 0.0);
    nocdyn_read(machine, back);
    CHECK(memcmp(at, back, bytes) == 0);
    if (i == 0) { /* another way, which is forgotten */
      nocdyn_set_torque(machine, "outside", -50.0, 0.0);
      nocdyn_run_to(machine, 2.0);
      nocdyn_restore(machine, state);
    }
    nocdyn_run_to(machine, 3.0);
    nocdyn_read(machine, again);
    CHECK(memcmp(first, again, bytes) == 0);
  }
  nocdyn_close(machine);
  nocdyn_free_state(state);
}

static void a_machine_that_has_failed_says_so_again(void) {
  const char *setting = "run.max_steps=1";
  nocdyn_machine *machine = nocdyn_open_text(clutch, "given.nml", 1, &setting, NULL);
  CHECK(nocdyn_run_to(machine, 9.0) == nocdyn_failed);
  char message[400];
  snprintf(message, sizeof message, "%s", nocdyn_message(machine));
  CHECK(strstr(message, "after 1 steps, the most that max_steps allows") != NULL);
  CHECK(nocdyn_run_to(machine, 9.5) == nocdyn_failed);
  CHECK(strcmp(message, nocdyn_message(machine)) == 0);
  CHECK(nocdyn_set_torque(machine, "outside", 1.0, 0.0) == nocdyn_failed);
  nocdyn_close(machine);
}

/* Opens a machine and runs it by many calls, with refusals on the way; the last row. */
static void *run_in_thread(void *row) {
  char text[1000];
  snprintf(text, sizeof text, "%s&load name = 'work' body = 'right' viscous = 0.1 /\n", clutch);
  nocdyn_machine *machine = open_text(text);
  for (int i = 1; i <= 200; i++) {
    if (i % 20 == 0) nocdyn_set_torque(machine, "outside", 5.0 * (i % 3), 0.1 * i);
    if (i % 30 == 0) nocdyn_set(machine, "load.work.viscous", 0.1 * i);
    CHECK(nocdyn_set(machine, "load.work.viscosity", 1.0) == nocdyn_wrong_input);
    nocdyn_run_to(machine, 0.02 * i);
  }
  nocdyn_read(machine, row);
  nocdyn_close(machine);
  return NULL;
}

static void machines_in_two_threads_have_the_bits_that_they_have_alone(void) {
  static double alone[most_signals], rows[2][most_signals];
  run_in_thread(alone);
  CHECK(alone[0] == 4.0);
  for (int turn = 0; turn < 5; turn++) {
    pthread_t threads[2];
    for (int i = 0; i < 2; i++) pthread_create(&threads[i], NULL, run_in_thread, rows[i]);
    for (int i = 0; i < 2; i++) pthread_join(threads[i], NULL);
    for (int i = 0; i < 2; i++) CHECK(memcmp(alone, rows[i], sizeof alone) == 0);
  }
}

#define TEST(name) {#name, name}
static const struct {
  const char *name;
  void (*run)(void);
} tests[] = {
    TEST(mistakes_are_told_with_file_line_and_key),
    TEST(settings_and_load_cases_are_those_of_the_program),
    TEST(calls_without_changes_leave_every_bit_as_it_is),
    TEST(a_number_that_is_set_applies_from_then_on),
    TEST(a_number_that_is_set_before_the_first_step_is_the_one_of_the_input),
    TEST(the_end_moves_to_any_time_ahead),
    TEST(a_moved_end_is_that_of_a_run),
    TEST(numbers_tell_their_paths_values_and_when_they_may_change),
    TEST(the_set_speed_of_a_governor_is_a_set_point),
    TEST(the_whole_input_is_a_file_by_itself),
    TEST(numbers_that_cannot_be_set_are_refused),
    TEST(torques_from_outside_drive_in_every_formulation_and_by_every_method),
    TEST(clutches_lock_between_calls_and_slip_by_torques_from_outside),
    TEST(a_motion_that_is_kept_goes_on_with_the_same_bits),
    TEST(a_machine_that_has_failed_says_so_again),
    TEST(machines_in_two_threads_have_the_bits_that_they_have_alone),
};

int main(int count, char **words) {
  for (size_t i = 0; i < sizeof tests / sizeof *tests; i++) {
    if (count > 1 && strstr(tests[i].name, words[1]) == NULL) continue;
    int before = failures;
    tests[i].run();
    printf("%s: %s\n", failures == before ? "ok" : "FAILED", tests[i].name);
  }
  return failures > 0;
}
