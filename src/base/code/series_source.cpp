// The texts of which generated programs are made, beside what is written for a machine.
#include <cstddef>

static const char series[] =
#include "series.inc"
  ;
static const char steps[] =
#include "steps.inc"
  ;
static const char machine[] =
#include "machine.inc"
  ;

extern "C" const char *nocdyn_code_part(int part, std::size_t *length) {
  *length = (part == 1 ? sizeof(series) : part == 2 ? sizeof(steps) : sizeof(machine)) - 1;
  return part == 1 ? series : part == 2 ? steps : machine;
}
