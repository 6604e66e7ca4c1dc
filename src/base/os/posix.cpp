// What of POSIX Fortran cannot bind to: `errno` is a macro, `open` takes arguments in a variable number, its flags are macros,
// `stat` and `statvfs` fill structures.
#include <cerrno>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>

extern "C" int nocdyn_errno() { return errno; }

extern "C" int nocdyn_open_new(const char *path) { return open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666); }

extern "C" int nocdyn_open_existing(const char *path, int is_to_change) {
  return open(path, (is_to_change ? O_RDWR : O_RDONLY) | O_CLOEXEC);
}

// Whether a path leads to a pipe, socket, device or folder: to open it may wait, to read it may never end.
extern "C" int nocdyn_is_irregular(const char *path) {
  struct stat about;
  return stat(path, &about) == 0 && !S_ISREG(about.st_mode);
}

// The bytes that a user may still write to the file system of a path, negative if there is no such path.
extern "C" double nocdyn_free_bytes(const char *path) {
  struct statvfs room;
  return statvfs(path, &room) == 0 ? static_cast<double>(room.f_bavail) * room.f_frsize : -1.0;
}
