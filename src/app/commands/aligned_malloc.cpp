// malloc of the programs: arrays of a kilobyte or more begin with a line of the cache. Vectors that cross from one line to the next
// take twice as long, and those of arrays from the C library do, as its addresses are 16 bytes past a line. A sweep by Taylor series
// takes 10 % less time with this, one by rk853 8 %. The linker puts it in the place of malloc (--wrap); the library does without, as
// it must not change the malloc of its users.
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
