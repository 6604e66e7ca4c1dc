# Sourced by the other scripts.
# shellcheck shell=bash

# quietly LABEL COMMAND...: one line with the time it took; the end of what the command printed only if it failed.
quietly() {
  local label=$1 began=$SECONDS log status=0
  shift
  log=$(mktemp)
  printf '%s ... ' "$label"
  "$@" > "$log" 2>&1 < /dev/null || status=$?
  if ((status == 0)); then
    printf 'done (%d s)\n' $((SECONDS - began))
  else
    printf 'failed\n'
    tail -n 100 "$log" >&2
  fi
  rm -f "$log"
  return "$status"
}

# build_release: the program build/release/bin/nocdyn, up to date; to be called in the project's folder.
build_release() {
  [[ -f build/release/build.ninja ]] || quietly 'Configuring' cmake --preset release
  quietly 'Building nocdyn' cmake --build --preset release --target nocdyn_program
}

# build_bench: the programs and those of bench/, up to date; to be called in the project's folder.
build_bench() {
  quietly 'Configuring' cmake --preset release -DNOCDYN_BENCH=ON
  quietly 'Building nocdyn and the programs of bench' cmake --build --preset release --target nocdyn_program nocdyn_sweep_program \
    nocdyn_mpi_program bench_programs
}

# build_plain: in build/plain, what valgrind can count the instructions of: AVX2, and addresses as in the file.
build_plain() {
  quietly 'Configuring for AVX2' cmake --preset release -B build/plain -DNOCDYN_NATIVE=OFF -DNOCDYN_BENCH=ON -DBUILD_TESTING=OFF \
    -DNOCDYN_SWEEP=OFF -DCMAKE_Fortran_FLAGS=-march=haswell -DCMAKE_EXE_LINKER_FLAGS=-no-pie
  quietly 'Building for AVX2' cmake --build build/plain --target chunk_costs nocdyn_program
}
