// Shortest decimal text that reads back as the same double: std::to_chars, which Fortran's formatted write cannot do
// and which is an order of magnitude faster.
#include <charconv>
#include <cstddef>

extern "C" int nocdyn_shortest_decimal(double value, char *buffer, std::size_t capacity) {
  const auto result = std::to_chars(buffer, buffer + capacity, value);
  return result.ec == std::errc{} ? static_cast<int>(result.ptr - buffer) : 0;
}
