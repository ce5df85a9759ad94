-- The statistics of a run without values that vary between runs: times, threads and memory, and passes over the points,
-- because a run resumed from a snapshot repeats passes that are otherwise made once.
local json = require "dkjson"

local same = {}

-- text: the contents of a --stats file.
function same.of(text)
  local run = json.decode(text)
  run.seconds, run.threads, run.peak_bytes = nil, nil, nil
  for _, frame in ipairs(run.frames) do
    frame.seconds, frame.nodes = nil, nil
    if frame.contact_grids then frame.contact_grids.search_seconds = nil end
    for _, band in ipairs(frame.bands or {}) do band.seconds = nil end
  end
  return run
end

return same
