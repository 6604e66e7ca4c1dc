/* Preloaded: counts the calls of malloc, calloc, realloc and aligned_alloc, and writes the number to the file ALLOCATIONS at the end. */
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *block, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);

static long calls;

void *malloc(size_t size) { calls++; return __libc_malloc(size); }
void *calloc(size_t count, size_t size) { calls++; return __libc_calloc(count, size); }
void *realloc(void *block, size_t size) { calls++; return __libc_realloc(block, size); }
void *aligned_alloc(size_t alignment, size_t size) { calls++; return __libc_memalign(alignment, size); }

__attribute__((destructor)) static void report(void) {
  long counted = calls;
  FILE *file = fopen(getenv("ALLOCATIONS"), "w");
  fprintf(file, "%ld\n", counted);
  fclose(file);
}
