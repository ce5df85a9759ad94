-- Faults of the system in a small run: a disk that is full or breaks, short counts. Whatever fails, the run ends with a
-- documented status and says what was wrong, and every file that is there is whole.
--
--   RAPID_FAULTS=10000 rapid test tests/faults      as many faults (1,000)
local command = require "testing.command"
local lehmer = require "tests.lehmer"

local faults = tonumber(os.getenv "RAPID_FAULTS" or 1000)

local scene = [[
local rapid = require "rapid"
local ball = rapid.levelset.sphere { radius = 0.5, voxel = 0.1 }
ball:write("out/ball.vdb")
return rapid.create { seed = 3 }
  :emit { source = rapid.points.read "points.csv", from = "points", count = 40, velocity = {0, 1, 0} }
  :gravity {} :collide { shape = ball } :solve {}
]]

local plain = [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.2 } }
  :gravity {} :collide { shape = rapid.shape.plane {} } :solve {}
]]

-- Everything in Lua that a run calls: kernels, with states of their own, functions of the frame and of the points.
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

-- What may fail, how, and how many calls of it a run makes, about.
local kinds = {
  { call = "write", errors = { "ENOSPC", "EIO", "EDQUOT", "short" }, calls = 30 },
  { call = "close", errors = { "EIO", "ENOSPC", "EDQUOT" }, calls = 30 },
  { call = "fsync", errors = { "EIO", "ENOSPC" }, calls = 30 },
  { call = "open", errors = { "ENOSPC", "EROFS", "EACCES" }, calls = 16 },
  { call = "link", errors = { "EIO", "ENOSPC", "EACCES" }, calls = 16 },
  { call = "read", errors = { "EIO", "short" }, calls = 2 },
}

local below = lehmer.new(1).below

local library = require "tests.faults.library"

-- Runs a scene with a fault, and compares its files with those of a run without: `complaint` is what is wrong with it.
local judge = [[
fault() {
  rm -rf out && mkdir out
  RAPID_FAULT=$1 LD_PRELOAD=$LIBRARY "$RAPID" run $SCENE --quiet --durable $OUTPUTS >said 2>&1
  status=$?
  complaint=
  case $status in 0 | 1 | 2) ;; *) complaint="status $status" ;; esac
  [ $status = 0 ] || [ -s said ] || complaint="no message"
  cd out
  for file in * .r*; do
    [ -e "$file" ] || continue
    # A level set's file has an identifier of its own before its 57th byte.
    [ "$file" = ball.vdb ] && skip=57 || skip=0
    cmp -s -i $skip "$file" "../whole/$file" || complaint="$complaint $file is not whole"
  done
  cd ..
  [ $status != 0 ] || [ "$(ls -A out)" = "$(ls -A whole)" ] || complaint="$complaint files are missing without a word"
  [ -z "$complaint" ] || echo "$1: $complaint: $(cat said)"
}
mkdir out
"$RAPID" run $SCENE --quiet $OUTPUTS || exit 1
mv out whole
]]

-- The complaints about a run with each of the faults.
local function complaints(text, outputs, list)
  local folder = command.folder()
  folder:write("scene.lua", text)
  folder:write("points.csv", "id,Px,Py,Pz\n0,0,1,0\n1,1,1,0\n")
  local script = judge
  for _, fault in ipairs(list) do script = script .. "fault " .. fault .. "\n" end
  local result = command.shell(script, { cwd = folder.path, environment = {
    LIBRARY = library, SCENE = "scene.lua -f 1-4", OUTPUTS = outputs } })
  assert.equal(0, result.status, result.stderr)
  return result.stdout
end

describe("a fault of the system", function()
  it("is an error, or harmless: files are whole, and the status tells", function()
    local list = {}
    for i = 1, faults do
      local kind = kinds[1 + i % #kinds]
      local lasting = below(2) == 1 and "+" or ""
      list[i] = ("%s:%d:%s%s"):format(kind.call, 1 + below(kind.calls), errors[kind.errors[1 + below(#kind.errors)]],
        lasting)
    end
    assert.equal("", complaints(scene, "-o out/a.####.ply -o out/b.####.csv -o out/c.####.vdb", list))
  end)

  it("of memory is an error, too", function()
    for text, requests in pairs { [plain] = 12000, [scripted] = 22000 } do
      local list = {}
      for i = 1, math.floor(faults / 6) do
        list[i] = ("alloc:%d:%d%s"):format(1 + below(requests), errors.ENOMEM, i % 2 == 1 and "+" or "")
      end
      assert.equal("", complaints(text, "-o out/a.####.ply", list))
    end
  end)
end)
