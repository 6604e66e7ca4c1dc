// Shortest decimal text that reads back as the same double, by std::to_chars: Fortran's formatted write has no such form,
// and is slower by an order of magnitude.
#include <charconv>
#include <cstddef>

extern "C" void nocdyn_shortest_decimal(double value, char *buffer, std::size_t capacity, int *length) {
  const auto result = std::to_chars(buffer, buffer + capacity, value);
  *length = result.ec == std::errc{} ? static_cast<int>(result.ptr - buffer) : 0;
}

// The same without an exponent, or always with one.
extern "C" void nocdyn_shortest_form(double value, int has_exponent, char *buffer, std::size_t capacity, int *length) {
  const auto form = has_exponent ? std::chars_format::scientific : std::chars_format::fixed;
  const auto result = std::to_chars(buffer, buffer + capacity, value, form);
  *length = result.ec == std::errc{} ? static_cast<int>(result.ptr - buffer) : 0;
}
