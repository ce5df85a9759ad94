-- Shell text for lines that start a process and wait for its effect:
--
--   await PID COMMAND...    waits until the command succeeds. Fails if the process ends before that, or after minutes.
--
-- A loop that ignored the process would never end if the process could not start.
return [[
await() {
  process=$1; shift
  for try in $(seq 12000); do
    ! "$@" 2>/dev/null || return 0
    # The command may succeed by what the process did just before it ended.
    kill -0 "$process" 2>/dev/null || { "$@" 2>/dev/null; return; }
    sleep 0.02
  done
  return 1
}
]]
