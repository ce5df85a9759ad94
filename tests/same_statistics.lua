-- The statistics of a run without what differs from run to run: times, threads and memory; and passes over the points,
-- of which a run that goes on behind a snapshot makes those again that are made once.
local json = require "dkjson"

local same = {}

-- text: of a file of --stats.
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
