-- rapid run --profile: a trace in Chrome's format.
local scene = require "testing.scene"

local text = [[
return rapid.create { fps = 24, subframes = 2, points = two } :gravity {}
  :points("spin", function(p) p.v = vec3(1, p.v.y, 0) end)
  :solve {}]]

-- Returns the members of the events with one name, in order.
local function events_of(json, name)
  local events = {}
  for line in json:gmatch "[^\n]+" do
    if line:find('{"name":"' .. name .. '"', 1, true) then
      events[#events + 1] = {
        ts = tonumber(line:match '"ts":([%d.e+-]+)'), dur = tonumber(line:match '"dur":([%d.e+-]+)'),
        points = tonumber(line:match '"points":(%d+)'), bytes = tonumber(line:match '"bytes":(%d+)'),
        category = line:match '"cat":"(%w+)"', ended = line:match ",$" == nil,
      }
    end
  end
  return events
end

describe("--profile", function()
  it("has each pass within its frame, once a sub-frame, with its stage and points", function()
    local result = scene.command("run", text, "-f 1-4 --quiet --profile out.json -o p.####.csv")
    assert.equal(0, result.status, result.stderr)
    local json = scene.folder:read "out.json"
    assert.equal('{"displayTimeUnit": "ms", "traceEvents": [', json:match "^[^\n]+")
    assert.equal("]}\n", json:sub(-3))
    local passes, solves = events_of(json, "spin"), events_of(json, "solve1")
    assert.equal(7, #passes) -- the first frame has no interval, and so no subframes
    assert.equal(7, #solves)
    for number = 1, 4 do
      local frame = events_of(json, "frame " .. number)
      assert.equal(1, #frame)
      local within = 0
      for _, solve in ipairs(solves) do
        local ends = solve.ts + solve.dur
        if solve.ts >= frame[1].ts and ends <= frame[1].ts + frame[1].dur + 1 then within = within + 1 end
      end
      assert.equal(number == 1 and 1 or 2, within)
    end
    assert.equal("script", passes[2].category)
    assert.equal("solve", solves[2].category)
    assert.equal(2, solves[2].points)
    assert.is_true(solves[2].bytes >= 2 * (12 + 12 + 8))
    for number = 1, 4 do assert.equal(1, #events_of(json, ("write p.%04d.csv"):format(number))) end
  end)

  it("keeps the frames before an error", function()
    local result = scene.command("run", [[
return rapid.create { fps = 24, points = two } :points("stop", function(p, frame)
  if frame.number == 3 then error "here" end end) :solve {}]], "-f 1-4 --quiet --profile out.json")
    assert.equal(1, result.status)
    local json = scene.folder:read "out.json"
    assert.equal(1, #events_of(json, "frame 2"))
    assert.equal("]}\n", json:sub(-3))
  end)

  it("says that its file can't be written, and writes the others", function()
    local result = scene.command("run", text, "-f 1-2 --quiet --profile . --stats s.json")
    assert.equal(1, result.status, result.stderr)
    assert.truthy(result.stderr:find "is not a regular file", result.stderr)
    assert.truthy(scene.folder:read "s.json":find '"frame":2')
  end)
end)
