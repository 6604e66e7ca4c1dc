// The text that all generated programs begin with.
#include <cstddef>

static const char source[] =
#include "series.inc"
  ;

extern "C" const char *nocdyn_series_source(std::size_t *length) {
  *length = sizeof(source) - 1;
  return source;
}
