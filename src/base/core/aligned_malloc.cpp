// Arrays that begin with a line of the cache: vectors of 64 bytes that cross from one line to the next take twice as long, and
// those of arrays from malloc do, as it returns addresses 16 bytes from there. The linker puts this in its place (--wrap).
#include <cstddef>
#include <cstdlib>

extern "C" void *__real_malloc(std::size_t bytes);

extern "C" void *__wrap_malloc(std::size_t bytes)
{
    constexpr std::size_t line = 64, smallest_array = 1024;
    if (bytes < smallest_array || bytes > std::size_t(-1) - line)
        return __real_malloc(bytes);
    return std::aligned_alloc(line, (bytes + line - 1) / line * line);
}
