// What of POSIX Fortran cannot bind to: `errno` is a macro, `open` takes arguments in a variable number, its flags are macros.
#include <cerrno>
#include <fcntl.h>

extern "C" int nocdyn_errno() { return errno; }

extern "C" int nocdyn_open_new(const char *path) { return open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666); }

extern "C" int nocdyn_open_existing(const char *path, int is_to_change) {
  return open(path, (is_to_change ? O_RDWR : O_RDONLY) | O_CLOEXEC);
}
