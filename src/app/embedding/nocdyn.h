/* nocdyn in another program: machines that are run from time to time, with signals read and numbers and torques set between.
 *
 * A machine is used by one thread at a time; several machines may be used by several threads at once. Nothing is printed, and
 * nothing ends the program but a fault of nocdyn itself. Texts that are returned belong to the machine and last until its next
 * call, or, of signals, until it is closed.
 */
#ifndef NOCDYN_H
#define NOCDYN_H

#ifdef __cplusplus
extern "C" {
#endif

typedef struct nocdyn_machine nocdyn_machine;
typedef struct nocdyn_state nocdyn_state;

/* What calls return: the exit codes of the program. */
enum { nocdyn_done = 0, nocdyn_failed = 1, nocdyn_wrong_input = 2, nocdyn_file = 3 };

/* The version of nocdyn, such as "0.2.0". */
const char *nocdyn_release(void);

/* A machine at its start, from a file, or from a text that messages call `name`. `overrides` are as of --set, 'run.t_end=2', and
 * `load_case` is a load case of the input, or NULL: the machine by itself. Tables are looked for beside the file. The result is
 * never NULL; `nocdyn_code` tells whether the machine was refused. `nocdyn_close` frees it in any case. */
nocdyn_machine *nocdyn_open(const char *file, int count, const char *const *overrides, const char *load_case);
nocdyn_machine *nocdyn_open_text(const char *text, const char *name, int count, const char *const *overrides,
                                 const char *load_case);
void nocdyn_close(nocdyn_machine *machine);

/* The code of the last call, its message, '' or a line for each error, and the notes that a run prints before it begins. */
int nocdyn_code(const nocdyn_machine *machine);
const char *nocdyn_message(const nocdyn_machine *machine);
const char *nocdyn_notes(const nocdyn_machine *machine);

/* The signals, in the order of the columns of trajectory.csv: 0 is the time. What a signal is of is the kind and the name of a
 * group of the input, '' of the whole machine. A signal that does not exist has NULL. */
int nocdyn_signal_count(const nocdyn_machine *machine);
const char *nocdyn_signal_name(const nocdyn_machine *machine, int signal);
const char *nocdyn_signal_unit(const nocdyn_machine *machine, int signal);
const char *nocdyn_signal_caption(const nocdyn_machine *machine, int signal);
const char *nocdyn_signal_positive(const nocdyn_machine *machine, int signal);
const char *nocdyn_signal_kind(const nocdyn_machine *machine, int signal);
const char *nocdyn_signal_element(const nocdyn_machine *machine, int signal);

/* The whole input, with settings, numbers that have been set and tables: a file by itself; '' of a machine that was refused. */
const char *nocdyn_whole_input(nocdyn_machine *machine);

/* The numbers that elements of the input give, which may take other values: by a setting when a machine is opened, by `nocdyn_set`
 * too, as a set point to any sign, or by `nocdyn_set_torque`. The count finds them; texts last until the next count. */
enum { nocdyn_change_at_start = 0, nocdyn_change_by_set = 1, nocdyn_change_by_torque = 2, nocdyn_change_as_set_point = 3 };
typedef struct {
  const char *path, *unit, *caption;
  double value;
  int change;
} nocdyn_number;
int nocdyn_number_count(nocdyn_machine *machine);
void nocdyn_describe_number(const nocdyn_machine *machine, int number, nocdyn_number *described);

/* The present time, the end of the run, beyond which it does not go, t_end of the input if it has not been moved [s], and the steps
 * so far. The end may be moved to any time ahead before it is reached. */
double nocdyn_time(const nocdyn_machine *machine);
double nocdyn_end_time(const nocdyn_machine *machine);
int nocdyn_set_end_time(nocdyn_machine *machine, double t);
int nocdyn_steps(const nocdyn_machine *machine);

/* Integrates to a time that is not before the present one. */
int nocdyn_run_to(nocdyn_machine *machine, double t);

/* The values of all signals at the present time. */
int nocdyn_read(nocdyn_machine *machine, double *values);

/* From the present time on: gives a number of an element a value, by its path, 'load.work.viscous', and the torque of an
 * `&excitation kind = 'external'`, at the present time [N m], with the rate at which it changes from there on [N m/s]. */
int nocdyn_set(nocdyn_machine *machine, const char *path, double value);
int nocdyn_set_torque(nocdyn_machine *machine, const char *name, double torque, double rate);

/* A copy of all that changes in a motion, NULL if the machine cannot go on; going back to it, as often as is wanted, in the machine
 * that it is of; and freeing it, before or after the machine is closed. */
nocdyn_state *nocdyn_keep(nocdyn_machine *machine);
int nocdyn_restore(nocdyn_machine *machine, const nocdyn_state *state);
void nocdyn_free_state(nocdyn_state *state);

#ifdef __cplusplus
}
#endif

#endif
