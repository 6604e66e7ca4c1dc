// The level of x86-64 that the processor has, by the psABI: 2, 3, 4; 1 if it has less, or is of another kind.

extern "C" int nocdyn_processor_level()
{
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
  if (__builtin_cpu_supports("x86-64-v4")) return 4;
  if (__builtin_cpu_supports("x86-64-v3")) return 3;
  if (__builtin_cpu_supports("x86-64-v2")) return 2;
#endif
  return 1;
}
