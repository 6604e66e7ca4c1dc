// Tells ThreadSanitizer how OpenMP orders what threads do: gfortran's OpenMP library is not compiled for it, and without this every
// access that follows a critical section or the end of a parallel region looks like a race. scripts/sanitize links it. Each procedure
// below takes away one kind of false report, and says why it is false.
#include <dlfcn.h>

extern "C" {
void __tsan_acquire(void *);
void __tsan_release(void *);

// The library's own procedure of that name.
#define LIBRARY(name) static const auto library = reinterpret_cast<decltype(&name)>(dlsym(RTLD_NEXT, #name))

static char fork_point, join_point, barrier, unnamed;

struct region_t {
  void (*run)(void *);
  void *data;
};

static void run_region(void *argument) {
  const auto region = static_cast<region_t *>(argument);
  __tsan_acquire(&fork_point);
  region->run(region->data);
  __tsan_release(&join_point);
}

// What was written before a parallel region is read in it, and what its threads wrote is read behind it: they start after the fork, and
// the join waits for all of them.
void GOMP_parallel(void (*run)(void *), void *data, unsigned threads, unsigned flags) {
  LIBRARY(GOMP_parallel);
  region_t region{run, data};
  __tsan_release(&fork_point);
  library(run_region, &region, threads, flags);
  __tsan_acquire(&join_point);
}

// What one thread wrote before a barrier others read behind it: none passes before all have come.
void GOMP_barrier(void) {
  LIBRARY(GOMP_barrier);
  __tsan_release(&barrier);
  library();
  __tsan_acquire(&barrier);
}

// What one thread wrote in a critical section the next one reads in it: they are in it one after the other.
void GOMP_critical_start(void) {
  LIBRARY(GOMP_critical_start);
  library();
  __tsan_acquire(&unnamed);
}

void GOMP_critical_end(void) {
  LIBRARY(GOMP_critical_end);
  __tsan_release(&unnamed);
  library();
}

// The same for a critical section with a name, which has an order of its own.
void GOMP_critical_name_start(void **name) {
  LIBRARY(GOMP_critical_name_start);
  library(name);
  __tsan_acquire(name);
}

void GOMP_critical_name_end(void **name) {
  LIBRARY(GOMP_critical_name_end);
  __tsan_release(name);
  library(name);
}

// What the holder of a lock wrote the next holder reads. The names are those that gfortran gives the procedures.
void omp_set_lock_(void *lock) {
  LIBRARY(omp_set_lock_);
  library(lock);
  __tsan_acquire(lock);
}

int omp_test_lock_(void *lock) {
  LIBRARY(omp_test_lock_);
  const int is_set = library(lock);
  if (is_set) __tsan_acquire(lock);
  return is_set;
}

void omp_unset_lock_(void *lock) {
  LIBRARY(omp_unset_lock_);
  __tsan_release(lock);
  library(lock);
}
}
