# Sourced by the other scripts.

# quietly LABEL COMMAND...: one line with the time it took; what the command printed only if it failed.
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
    cat "$log" >&2
  fi
  rm -f "$log"
  return "$status"
}
