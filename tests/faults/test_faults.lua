-- System faults in a small run: a disk that is full or fails, short counts. Whatever fails, the run ends with a
-- documented status and a message, and every file that exists is complete.
--
--   RAPID_FAULTS=10000 rapid test tests/faults/test_faults.lua      number of faults (100)
--   RAPID_FAULT_SEED=2 rapid test tests/faults/test_faults.lua      seed (1)
local command = require "testing.command"
local amount = require "tests.amount"
local lehmer = require "tests.lehmer"

local faults = amount.of("RAPID_FAULTS", 100)

local scene = [[
local rapid = require "rapid"
local ball = rapid.levelset.sphere { radius = 0.5, voxel = 0.1 }
ball:write("ball.vdb")
return rapid.create { seed = 3 }
  :emit { source = rapid.points.read "points.csv", from = "points", count = 40, velocity = {0, 1, 0} }
  :gravity {} :collide { shape = ball } :solve {}
]]

local plain = [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.2 } }
  :gravity {} :collide { shape = rapid.shape.plane {} } :solve {}
]]

-- Uses the deferred library: OpenVDB, which writes nothing here.
local baked = [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.5 } }
  :gravity {} :collide { shape = rapid.levelset.sphere { radius = 0.5, voxel = 0.1 }:offset(0.01) } :solve {}
]]

-- Covers everything in Lua that a run calls: kernels with their own states, functions of the frame and of the points.
local scripted = [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.5 } }
  :points("lift", function(p, frame) p.v = p.v + vec3(0, 0.1 * p.index, 0) end)
  :detail("read", function(points, frame) local heights = {} for i = 1, #points do heights[i] = { frame.time } end end)
  :delete { where = function(p) return p.P.y < -100 end }
  :action("slow", function(p, step) p.v = 0.99 * p.v end)
  :gravity { g = function(frame) return vec3(0, -9 - frame.number, 0) end }
  :collide { shape = function(frame) return rapid.shape.sphere { radius = 0.1 * frame.number } end } :solve {}
]]

local errors = { EIO = 5, ENOMEM = 12, EACCES = 13, ENOSPC = 28, EROFS = 30, EDQUOT = 122, short = "short" }

-- The calls that may fail, the errors, and the approximate number of these calls in a run.
local kinds = {
  { call = "write", errors = { "ENOSPC", "EIO", "EDQUOT", "short" }, calls = 30 },
  { call = "close", errors = { "EIO", "ENOSPC", "EDQUOT" }, calls = 30 },
  { call = "fsync", errors = { "EIO", "ENOSPC" }, calls = 30 },
  { call = "open", errors = { "ENOSPC", "EROFS", "EACCES" }, calls = 16 },
  { call = "link", errors = { "EIO", "ENOSPC", "EACCES" }, calls = 16 },
  { call = "read", errors = { "EIO", "short" }, calls = 2 },
}

local below = lehmer.new(tonumber(os.getenv "RAPID_FAULT_SEED" or 1)).below

local library = require "tests.faults.library"

-- Runs of a scene, each in a copy of a process that has loaded its libraries.
local function folder_of(text)
  local folder = command.folder()
  folder:write("scene.lua", text)
  folder:write("points.csv", "id,Px,Py,Pz\n0,0,1,0\n1,1,1,0\n")
  return folder
end

-- Returns the files below the folder of a run, by name. The first 57 bytes of a level set include a random identifier
-- and are skipped.
local function files_of(folder, names, run)
  local files = {}
  for name in names:gmatch(("\n%d/([^\n]*)"):format(run)) do
    local text = folder:read(("%d/%s"):format(run, name))
    files[name] = name == "ball.vdb" and text:sub(58) or text
  end
  local said = files.said
  files.said = nil
  return files, said
end

local function complaint_of(status, said, files, whole)
  if status > 2 then return "status " .. status end
  if status > 0 and #said == 0 then return "no message" end
  for name, text in pairs(files) do
    if text ~= whole[name] then return name .. " is not whole" end
  end
  for name in pairs(whole) do
    if status == 0 and not files[name] then return name .. " is missing without a word" end
  end
end

-- Returns the complaints about a run with each of the faults. libraries: loaded in addition to those of every run.
local function complaints(text, outputs, list, libraries)
  local found = {}
  for first = 1, #list, 100 do
    local folder = folder_of(text)
    local some = { unpack(list, first, math.min(first + 99, #list)) }
    table.insert(some, 1, "write:0:5") -- none
    folder:write("faults", table.concat(some, "\n") .. "\n")
    local result = command.shell('RAPID_FAULT_LIST=faults LD_PRELOAD=$LIBRARIES "$RAPID" run ../scene.lua -f 1-4 ' ..
      "--quiet --durable " .. outputs .. " && find . -type f | sed 's|^\\./||' >names", {
      cwd = folder.path, environment = { LIBRARIES = library .. (libraries or "") } })
    assert.equal(0, result.status, result.stderr)
    local names, whole = "\n" .. folder:read "names"
    for run, status in result.stdout:gmatch "(%d+) (%d+)\n" do
      local files, said = files_of(folder, names, tonumber(run))
      if run == "1" then
        assert.equal("0", status, said)
        whole = files
      else
        local complaint = complaint_of(tonumber(status), said, files, whole)
        if complaint then found[#found + 1] = ("%s: %s: %s\n"):format(some[tonumber(run)], complaint, said) end
      end
    end
    assert.truthy(result.stdout:find(("\n%d %%d+\n$"):format(#some)), result.stdout)
  end
  return table.concat(found)
end

-- Returns the number of allocations while LuaJIT creates the states of a run and opens their ffi libraries.
local function requests_of_a_state(text)
  local folder = command.folder()
  folder:write("scene.lua", text)
  local result = command.rapid("check scene.lua", { cwd = folder.path, environment = {
    LD_PRELOAD = library, RAPID_FAULT = "state:1000000:" .. errors.ENOMEM, RAPID_FAULT_COUNT = "count" } })
  assert.equal(0, result.status, result.stderr)
  return tonumber(folder:read "count")
end

describe("a fault of the system", function()
  it("is an error with its status, or harmless: files are whole", function()
    local list = {}
    for i = 1, faults do
      local kind = kinds[1 + i % #kinds]
      local lasting = below(2) == 1 and "+" or ""
      list[i] = ("%s:%d:%s%s"):format(kind.call, 1 + below(kind.calls), errors[kind.errors[1 + below(#kind.errors)]],
        lasting)
    end
    local deferred = ":" .. library:gsub("[^/]*$", "librapid_deferred.so")
    assert.equal("", complaints(scene, "-o a.####.ply -o b.####.csv -o c.####.vdb", list, deferred))
  end)

  it("of memory while LuaJIT makes a state or opens its ffi library is an error, whichever request it is", function()
    local list = {}
    for n = 1, requests_of_a_state(scripted) do
      list[n] = ("state:%d:%d"):format(n, errors.ENOMEM)
    end
    assert.truthy(#list > 5, #list)
    assert.equal("", complaints(scripted, "-o a.####.ply", list))
  end)

  it("of memory is an error, too", function()
    for _, scene_of in ipairs { { text = plain, requests = 17000 }, { text = scripted, requests = 25000 },
      { text = baked, requests = 18000 } } do
      local list = {}
      for i = 1, math.floor(faults / 6) do
        list[i] = ("alloc:%d:%d%s"):format(1 + below(scene_of.requests), errors.ENOMEM, i % 2 == 1 and "+" or "")
      end
      assert.equal("", complaints(scene_of.text, "-o a.####.ply", list))
    end
  end)
end)
