-- Every node in lua/nodes, by its scene in graphs/nodes: compiled without a failed trace, finite, and the same bits on
-- any number of threads.
local command = require "testing.command"
local document = require "testing.document"

local function exists(path)
  local file = io.open(path)
  if file then file:close() end
  return file ~= nil
end

-- Returns the traces of the node that LuaJIT failed to compile. A loop within a kernel becomes a separate trace, which
-- the trace of the points enters; before that LuaJIT abandons attempts to combine both. Functions of the whole set are
-- ignored, because they run once a frame. A finaliser that the collector runs during a recording ends it, and it is
-- repeated. An error would end the run.
local function failed_traces(name, aborts)
  local text, failed = document.read("lua/nodes/" .. name .. ".lua"), {}
  if text:find "\n  detail = " or text:find ":detail {" then return failed end
  local has_loop = text:find "\n    while "
  for _, abort in ipairs(aborts) do
    local nested = abort:find ": leaving loop in root trace$" or abort:find ": inner loop in root trace$"
    local finalised = abort:find ": error thrown or hook called during recording$"
    if not (has_loop and nested) and not finalised then failed[#failed + 1] = abort end
  end
  return failed
end

describe("every node in lua/nodes", function()
  for name in command.shell("ls lua/nodes").stdout:gmatch "([%w_]+)%.lua" do
    local scene = "graphs/nodes/" .. name .. ".lua"

    it(name .. " has a test, a scene that uses it, and a picture", function()
      assert.is_true(exists("tests/lua/nodes/test_" .. name .. ".lua"))
      assert.truthy(document.read(scene):find(":" .. name .. "%s*{"), scene)
      local picture = "graphs/nodes/pictures/" .. name .. ".png"
      assert.is_true(exists(picture))
      assert.is_true(#document.read(picture) < 75000, picture)
    end)

    it(name .. " declares the attributes that it uses", function()
      local frames = { frames = {12, 12} }
      local plain = rapid.run(scene, frames)
      frames.check_declarations = true
      assert.same_points(plain[12], rapid.run(scene, frames)[12])
    end)

    it(name .. " is compiled, stays finite, and is the same on 1, 2 and 7 threads", function()
      local one = rapid.run(scene, { frames = {1, 24}, threads = 1, watch_traces = true })
      assert.same({}, failed_traces(name, one.trace_aborts))
      for _, points in one:frames() do assert.points(points).finite() end
      assert.is_true(#one[24] > 4096) -- more than one chunk
      for _, threads in ipairs { 2, 7 } do
        assert.same_points(one[24], rapid.run(scene, { frames = {24, 24}, threads = threads })[24])
      end
    end)
  end
end)
