// Programs in C that nocdyn has written, compiled by the compiler of the system and loaded: C++ has what this needs of POSIX, texts
// and folders, and threads may call it.
//
// A compiled program stays in the user's cache folder, with its source: it is loaded only if that source, which names the compiler
// and the processor, is the same to the last byte. Nothing is loaded from a folder that others could write.
#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <dlfcn.h>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <spawn.h>
#include <sstream>
#include <string>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

extern char **environ;

namespace {

namespace fs = std::filesystem;

constexpr int days_kept = 30;   // of a program that is not used
const std::vector<std::string> options = {"-x", "c", "-std=gnu11", "-O2", "-march=native", "-ffp-contract=off", "-fno-math-errno",
                                          "-fPIC", "-shared", "-w"};

// A folder for this process alone, removed at the end, if there is no cache.
struct temporary_folder {
  std::string path;
  ~temporary_folder() {
    std::error_code failure;
    if (!path.empty()) fs::remove_all(path, failure);
  }
};

std::string environment(const char *name) {
  const char *value = std::getenv(name);
  return value ? value : "";
}

std::string compiler() {
  const std::string chosen = environment("CC");
  return chosen.empty() || chosen.find(' ') != std::string::npos ? "cc" : chosen;
}

// Runs a program; what it prints is added to `output` if that is not null. The exit code, or -1.
int run(const std::vector<std::string> &words, std::string *output) {
  std::vector<char *> arguments;
  for (const std::string &word : words) arguments.push_back(const_cast<char *>(word.c_str()));
  arguments.push_back(nullptr);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return -1;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
  posix_spawn_file_actions_adddup2(&actions, ends[1], 2);
  pid_t child;
  const int failure = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  char part[4096];
  for (;;) {
    const ssize_t length = failure ? 0 : read(ends[0], part, sizeof part);
    if (length < 0 && errno == EINTR) continue;
    if (length <= 0) break;
    if (output) output->append(part, length);
  }
  close(ends[0]);
  if (failure) return -1;
  int status;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// The file of a program with its size and time, which change with its version; "" if it is not there. To ask the compiler itself
// takes milliseconds.
std::string file_of(const std::string &program) {
  std::vector<std::string> paths;
  std::istringstream folders(environment("PATH"));
  if (program.find('/') != std::string::npos)
    paths.push_back(program);
  else
    for (std::string folder; std::getline(folders, folder, ':');)
      if (!folder.empty()) paths.push_back(folder + "/" + program);
  for (const std::string &path : paths) {
    struct stat about;
    if (access(path.c_str(), X_OK) != 0 || stat(path.c_str(), &about) != 0 || !S_ISREG(about.st_mode)) continue;
    std::error_code failure;
    return fs::canonical(path, failure).string() + ", " + std::to_string(about.st_size) + " bytes, time " +
           std::to_string(about.st_mtim.tv_sec) + "." + std::to_string(about.st_mtim.tv_nsec);
  }
  return "";
}

std::string first_line(const std::string &text) { return text.substr(0, text.find('\n')); }

// What a compiled program depends on beside its source: name and abilities of the processor.
std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  std::string line, text;
  while (std::getline(file, line) && !line.empty())
    if (line.rfind("model name", 0) == 0 || line.rfind("flags", 0) == 0 || line.rfind("Features", 0) == 0 ||
        line.rfind("CPU part", 0) == 0)
      text += line + "; ";
  return text;
}

// The hash of Fowler, Noll and Vo, FNV-1a; it only names files, whose sources are compared.
std::string hash(const std::string &text) {
  std::uint64_t value = 14695981039346656037u;
  for (unsigned char byte : text) value = (value ^ byte) * 1099511628211u;
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(value));
  return digits;
}

// Whether a folder is the user's own, and nobody else may write or read it.
bool is_private(const std::string &folder) {
  struct stat about;
  return lstat(folder.c_str(), &about) == 0 && S_ISDIR(about.st_mode) && about.st_uid == geteuid() && (about.st_mode & 077) == 0;
}

// The user's cache folder, made if it is not there; "" if there is none that is private.
std::string cache_folder() {
  std::string parent = environment("XDG_CACHE_HOME");
  if (parent.empty() || parent[0] != '/') {
    parent = environment("HOME");
    if (parent.empty() || parent[0] != '/') return "";
    parent += "/.cache";
    mkdir(parent.c_str(), 0700);
  }
  const std::string folder = parent + "/nocdyn";
  mkdir(folder.c_str(), 0700);
  return is_private(folder) ? folder : "";
}

std::string read_file(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

bool write_file(const std::string &path, const std::string &text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  return !file.fail();
}

// Removes files that have not been used for long.
void remove_old(const std::string &folder) {
  std::error_code failure;
  const std::time_t oldest = std::time(nullptr) - days_kept * 86400;
  for (fs::directory_iterator file(folder, failure), end; !failure && file != end; file.increment(failure)) {
    struct stat about;
    if (lstat(file->path().c_str(), &about) == 0 && S_ISREG(about.st_mode) && about.st_mtime < oldest) unlink(file->path().c_str());
  }
}

// Compiles a source file to a library, which appears whole or not at all; what the compiler says if it fails.
bool compile(const std::string &source, const std::string &library, std::string &message) {
  const std::string unfinished = library + "." + std::to_string(getpid());
  std::vector<std::string> words = {compiler()};
  words.insert(words.end(), options.begin(), options.end());
  words.insert(words.end(), {"-o", unfinished, source});
  std::string output;
  const int code = run(words, &output);
  if (code == 0 && std::rename(unfinished.c_str(), library.c_str()) == 0) return true;
  unlink(unfinished.c_str());
  message = code == -1 ? "there is no compiler " + compiler() : compiler() + " failed: " + first_line(output);
  return false;
}

}  // namespace

// Compiles and loads a program, or loads it from the cache: its procedures with some names, which follow one another. 0 if it is
// loaded, else why it is not.
extern "C" int nocdyn_load_code(const char *text, std::size_t length, const char *names, int count, void **procedures,
                                char *message, std::size_t capacity) {
  std::string failure;
  const std::string version = file_of(compiler());
  temporary_folder temporary;
  void *handle = nullptr;
  std::fill(procedures, procedures + count, nullptr);
  if (version.empty()) {
    failure = "there is no compiler " + compiler();
  } else {
    std::string source = "/* " + compiler() + ": " + version + "; " + processor();
    for (const std::string &option : options) source += option + " ";
    source += "*/\n" + std::string(text, length);
    std::string folder = cache_folder();
    const bool is_kept = !folder.empty();
    if (!is_kept) {
      std::error_code missing;
      std::string name_of_folder = (fs::temp_directory_path(missing) / "nocdyn-XXXXXX").string();
      if (!missing && mkdtemp(name_of_folder.data())) folder = temporary.path = name_of_folder;
    }
    const std::string stem = folder + "/" + hash(source), c_file = stem + ".c", library = stem + ".so", lock_file = stem + ".lock";
    const int lock = open(lock_file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (lock < 0) {
      failure = "the folder " + folder + " cannot be written: " + std::strerror(errno);
    } else {
      while (flock(lock, LOCK_EX) != 0 && errno == EINTR) {}   // another process that compiles the program is waited for
      bool is_there = access(library.c_str(), R_OK) == 0 && read_file(c_file) == source;
      if (is_there) {
        utimensat(AT_FDCWD, library.c_str(), nullptr, 0);
        utimensat(AT_FDCWD, c_file.c_str(), nullptr, 0);
      } else {
        unlink(library.c_str());
        if (!write_file(c_file, source))
          failure = "the folder " + folder + " cannot be written";
        else
          is_there = compile(c_file, library, failure);
      }
      if (is_there) {
        handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (!handle) failure = dlerror();
      }
      if (is_kept) remove_old(folder);
      close(lock);
    }
  }
  if (handle) {
    const char *name = names;
    for (int i = 0; i < count; i++, name += std::strlen(name) + 1) {
      procedures[i] = dlsym(handle, name);
      if (!procedures[i]) failure = "the compiled program has no procedure " + std::string(name);
    }
  }
  std::snprintf(message, capacity, "%s", failure.c_str());
  return failure.empty() ? 0 : 1;
}
