// The number of the last failure of a system call: `errno` is a macro, which Fortran cannot bind to.
#include <cerrno>

extern "C" int nocdyn_errno() { return errno; }
