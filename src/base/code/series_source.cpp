// The texts of which generated programs are made, beside what is written for a machine.
#include <cstddef>

static const char series[] =
#include "series.inc"
  ;
static const char steps[] =
#include "steps.inc"
  ;
static const char crossings[] =
#include "crossings.inc"
  ;
static const char turns[] =
#include "turns.inc"
  ;
static const char machine[] =
#include "machine.inc"
  ;

extern "C" const char *nocdyn_code_part(int part, std::size_t *length) {
  static const char *const parts[] = {series, steps, crossings, turns, machine};
  static const std::size_t lengths[] = {sizeof(series), sizeof(steps), sizeof(crossings), sizeof(turns), sizeof(machine)};
  *length = lengths[part - 1] - 1;
  return parts[part - 1];
}
