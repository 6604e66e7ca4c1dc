// Shortest decimal text that reads back as the same double, by std::to_chars: Fortran's formatted write has no such form,
// and is slower by an order of magnitude. The number of a text by std::from_chars, for the same reason.
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

// The number of a whole text, such as 2.5e-3; returns 0 if the text has another form, or is beyond the range of doubles.
extern "C" int nocdyn_number_of(const char *text, std::size_t length, double *value) {
  const char *const end = text + length;
  if (length > 0 && *text == '+') {
    ++text;
    if (text != end && *text == '-') return 0;
  }
  const char *const digits = text != end && *text == '-' ? text + 1 : text;
  if (digits == end || !((*digits >= '0' && *digits <= '9') || *digits == '.')) return 0;  // inf and nan
  const auto result = std::from_chars(text, end, *value);
  return result.ec == std::errc{} && result.ptr == end;
}
