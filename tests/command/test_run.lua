-- rapid run: the frames that it computes, its files and its messages.
local command = require "testing.command"
local json = require "dkjson"
local csv_rows = require "tests.csv_rows"
local scene = require "testing.scene"

-- Three points that fall from 10 m. Frame f is (f - 1) / 24 s after the start.
local falling = [[
local rapid = require "rapid"
local height = rapid.param("height", 10, "m")
return rapid.create { seed = 1, points = rapid.points.from { P = {{0, height, 0}, {1, height, 0}, {2, height, 0}} } }
  :gravity {} :solve {}
]]

local function new_folder(text)
  local folder = command.folder()
  folder:write("scene.lua", text or falling)
  function folder:run(arguments)
    return command.rapid("run scene.lua " .. arguments, { cwd = self.path })
  end
  return folder
end

local function height_at(frame, from)
  local t = (frame - 1) / 24
  return (from or 10) - 9.81 * t * t / 2
end

describe("rapid run", function()
  it("without -o writes nothing, and prints the summary", function()
    local folder = new_folder()
    local result = folder:run "-f 1-4"
    assert.equal(0, result.status)
    assert.same({ "scene.lua" }, folder:list())
    local _, _, points, frames, slowest, off, files, fine =
      result.stdout:find "\n(points[^\n]+)\n([^\n]+)\n([^\n]+)\n([^\n]+)\n([^\n]+)\n([^\n]+)\n$"
    assert.equal("points   3", points)
    assert.truthy(frames:find "^frames   4 in [%d.]+ s, [%d.,]+ %a*%s?points per second, [%d.]+ MiB of memory$", frames)
    assert.truthy(slowest:find "^slowest  [%w+ ]+, %d+ %% of the work$", slowest)
    assert.truthy(off:find "^error    0, but for rounding within [%d.]+ %S+$", off)
    assert.equal("files    none written; -o NAME.####.png writes pictures", files)
    assert.equal("result   all fine", fine)
    assert.equal("", result.stderr)
  end)

  it("computes 48 frames from the first where none are named", function()
    local folder = new_folder()
    assert.truthy(folder:run("").stdout:find("\nframes   48 in", 1, true))
    assert.truthy(folder:run("").stdout:find("\nframe 48  3 points", 1, true))
  end)

  it("prints a line for each frame where the output is no terminal", function()
    local lines = {}
    for number in new_folder():run("-f 1-5").stdout:gmatch "frame (%d+)  3 points  [%d.]+ s\n" do
      lines[#lines + 1] = number
    end
    assert.same({ "1", "2", "3", "4", "5" }, lines)
  end)

  it("draws a bar on a terminal, with frame, points, points per second and time left", function()
    local folder = new_folder()
    local result = command.shell([[TERM=xterm script -qec "stty cols 120; '$RAPID' run scene.lua -f 1-4" /dev/null]],
      { cwd = folder.path })
    assert.truthy(result.stdout:match "\r%[=+%] frame 4/4  3 points  [%d.,]+ ?%a* points/s  0.000 s left",
      result.stdout)
    assert.truthy(result.stdout:match "points   3\r?\n")
  end)

  it("warns once of a doubt that many frames share, and adds it up in the summary", function()
    -- A ball without radius bounces in a slit of a micrometre, 4 million times a frame, until it rests; then it is
    -- kicked again.
    local folder = new_folder [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{5e-7, 0, 0}}, v = {{100, 0, 0}} } }
  :points("kick", function(p) p.v = vec3(100, 0, 0) end)
  :collide { shape = rapid.shape.plane { normal = {1, 0, 0} }, bounce = 1 }
  :collide { shape = rapid.shape.plane { normal = {-1, 0, 0}, offset = -1e-6 }, bounce = 1 }
  :solve {}
]]
    local result = folder:run "-f 1-4 --stats s.json"
    assert.equal(0, result.status)
    assert.equal('warning: frame 2: node "solve1": some points reached the limit of 2,000 impacts in one step ' ..
      "and were stopped for the rest of it; give more substeps\n", result.stderr)
    assert.truthy(result.stdout:find(
      "\nlook at  points reached the limit of contacts in a step 3 times, in 3 frames from 2 to 4: "
        .. "give :solve more substeps\n$"), result.stdout)
    local counts = {}
    for _, frame in ipairs(json.decode(folder:read "s.json").frames) do counts[#counts + 1] = frame.contact_limit end
    assert.same({ 0, 1, 1, 1 }, counts)
  end)

  it("prints ten warnings of a kind as they occur, then the number of the rest and the last one", function()
    local folder = new_folder [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 9, 0}} } }
  :collide { shape = rapid.shape.sphere { radius = 0.5 }, transform = function(frame)
    return rapid.translate(0.01 * frame.number + 10 * math.floor(frame.number / 6), 0, 0) end } :solve {}
]]
    local result = folder:run "-f 1-91 --quiet"
    assert.equal(0, result.status)
    local lines = {}
    for line in result.stderr:gmatch "[^\n]+" do lines[#lines + 1] = line end
    assert.equal(11, #lines, result.stderr)
    for place = 1, 10 do
      assert.truthy(lines[place]:find(("warning: frame %d: scene.lua:3: "):format(6 * place), 1, true), lines[place])
    end
    assert.truthy(lines[11]:find("warning: 5 more warnings of this kind, the last in frame 90: scene.lua:3: ", 1, true),
      lines[11])
  end)

  it("prints the warnings of shapes and other values within frames", function()
    local folder = new_folder [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 9, 0}} } }
  :collide { shape = function(frame)
    local size = 0.5 + frame.number / 1024
    return rapid.levelset.from_mesh(rapid.mesh.box { size = {size, size, size} }, { voxel = 0.5 })
  end } :solve {}
]]
    local result = folder:run "-f 1-40 --quiet"
    assert.equal(0, result.status)
    local lines = {}
    for line in result.stderr:gmatch "[^\n]+" do lines[#lines + 1] = line end
    assert.equal(11, #lines, result.stderr)
    for place = 1, 10 do
      assert.match("^warning: frame %d+: .*a voxel of 0.5 m is at least half as large as mesh", lines[place])
    end
    assert.match("^warning: %d%d more warnings of this kind, the last in frame 40: .* is 0.539062 m long", lines[11])
  end)

  it("is silent with --quiet", function()
    local result = new_folder():run "-f 1-4 --quiet -o a.####.csv"
    assert.equal(0, result.status)
    assert.equal("", result.stdout)
    assert.equal("", result.stderr)
  end)

  it("writes the frames of -f and computes all before them", function()
    for frames, written in pairs {
      ["1-3"] = { 1, 2, 3 },
      ["3"] = { 3 },
      ["2-7x2"] = { 2, 4, 6 },
      ["1-7x3"] = { 1, 4, 7 },
      ["5-5"] = { 5 },
    } do
      local folder = new_folder()
      assert.equal(0, folder:run("-o a.####.csv -f " .. frames).status)
      local names = {}
      for i, frame in ipairs(written) do
        names[i] = ("a.%04d.csv"):format(frame)
        assert.near(height_at(frame), csv_rows(folder:read(names[i]))[1].Py, 1e-5)
      end
      table.insert(names, "scene.lua")
      assert.same(names, folder:list())
    end
  end)

  it("refuses frames before the scene's first", function()
    local result = new_folder [[return require("rapid").create { start = 10 }]]:run "-f 9-12"
    assert.equal(2, result.status)
    assert.equal("-f: frame 9 is before the scene's first, 10\n", result.stderr)
  end)

  it("begins at the create's start where no frames are named", function()
    local folder = new_folder [[return require("rapid").create { start = 1001 }]]
    assert.equal(0, folder:run("-o a.####.csv").status)
    assert.truthy(folder:read "a.1001.csv")
    assert.truthy(folder:read "a.1048.csv")
    assert.is_nil(folder:read "a.1049.csv")
  end)

  it("knows frames before zero", function()
    local folder = new_folder [[return require("rapid").create { start = -2 }]]
    assert.equal(0, folder:run("-f -2-0 -o a.####.csv").status)
    assert.same({ "a.-0001.csv", "a.-0002.csv", "a.0000.csv", "scene.lua" }, folder:list())
  end)

  it("takes ####, $F4 and %04d for the frame, and a lone # for four digits", function()
    local folder = new_folder()
    assert.equal(0, folder:run("-f 7 -o a.####.csv -o 'b.$F4.csv' -o c.%04d.csv -o d.#.csv -o e.##.csv").status)
    assert.same({ "a.0007.csv", "b.0007.csv", "c.0007.csv", "d.0007.csv", "e.07.csv", "scene.lua" }, folder:list())
  end)

  it("prints the first name of each pattern in full", function()
    local stdout = new_folder():run("-f 3-4 -o out/a.####.csv -o out/a.####.ply").stdout
    assert.truthy(stdout:find("writing out/a.0003.csv\n", 1, true), stdout)
    assert.truthy(stdout:find("writing out/a.0003.ply\n", 1, true), stdout)
    assert.falsy(stdout:find("a.0004", 1, true))
  end)

  it("makes the folders of its outputs, and reads colons in their names", function()
    local folder = new_folder()
    assert.equal(0, folder:run("-f 1 -o 'new/of:me/a.csv'").status)
    assert.same({ "new/of:me/a.csv", "scene.lua" }, folder:list())
  end)

  it("writes every format that it knows, and the same points to each", function()
    local folder = new_folder()
    local others = { "a.vdb", "a.bgeo", "a.ply", "a.npz", "a.prt", "a.usda", "a.vtp" }
    assert.equal(0, folder:run("-f 9 -o a.csv -o a.png -o " .. table.concat(others, " -o ")).status)
    for _, other in ipairs(others) do
      local result = command.rapid("diff a.csv " .. other, { cwd = folder.path })
      assert.equal(0, result.status, result.stdout .. result.stderr)
    end
    assert.equal("\137PNG\r\n\26\n", folder:read("a.png"):sub(1, 8))
  end)

  it("refuses a format that it does not know, before the first frame", function()
    local folder = new_folder()
    local result = folder:run "-f 1-4 -o a.####.xyz"
    assert.equal(2, result.status)
    assert.match('^%-o a%.####%.xyz: unknown extension "%.xyz"; it must be one of [%.%w, ]*%.csv, ' ..
      "[%.%w, ]*%.vtp[%.%w, ]*\n$", result.stderr)
    assert.equal("", result.stdout)
  end)

  it("refuses to write several frames to one file", function()
    local result = new_folder():run "-f 1-4 -o a.csv"
    assert.equal(2, result.status)
    assert.equal("-o a.csv: several frames would go into one file; put #### into the name for the frame number\n",
      result.stderr)
  end)

  it("refuses to write the same files twice", function()
    local result = new_folder():run "-f 1-4 -o a.####.csv -o a.####.csv"
    assert.equal(2, result.status)
    assert.equal("-o a.####.csv: the same files would be written twice; give each a different pattern\n", result.stderr)
  end)
end)

describe("-o PATTERN:ATTR,ATTR", function()
  local coloured = [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }
  :attribute { heat = 2, Cd = {1, 0.5, 0} } :points("warm", function(p) p:join "warm" end) :solve {}
]]

  it("writes those attributes besides P, v and id", function()
    local folder = new_folder(coloured)
    assert.equal(0, folder:run("-f 2 -o a.csv -o b.csv:heat -o c.csv:warm,Cd").status)
    assert.equal("id,Px,Py,Pz,vx,vy,vz,Cdx,Cdy,Cdz,heat,group:warm", folder:read("a.csv"):match "^[^\n]+")
    assert.equal("id,Px,Py,Pz,vx,vy,vz,heat", folder:read("b.csv"):match "^[^\n]+")
    assert.equal("id,Px,Py,Pz,vx,vy,vz,Cdx,Cdy,Cdz,group:warm", folder:read("c.csv"):match "^[^\n]+")
  end)

  it("brings a known attribute into being, in that file alone", function()
    local folder = new_folder()
    assert.equal(0, folder:run("-f 25 -o a.csv:age -o b.csv").status)
    assert.near(1, csv_rows(folder:read "a.csv")[1].age, 1e-6)
    assert.equal("id,Px,Py,Pz,vx,vy,vz", folder:read("b.csv"):match "^[^\n]+")
  end)

  it("refuses a name that nothing makes, with the nearest", function()
    local result = new_folder(coloured):run "-f 2 -o a.csv:haet"
    assert.equal(2, result.status)
    assert.equal('-o a.csv:haet: no attribute or group "haet" to write; did you mean "heat"?\n', result.stderr)
  end)
end)

describe("a graph of several outputs", function()
  local several = [[
local rapid = require "rapid"
local function at(x) return rapid.create { points = rapid.points.from { P = {{x, 0, 0}} } } :solve {} end
return { %s = at(1), smoke = at(2) }
]]

  it("writes each by its name where the pattern has {output}", function()
    local folder = new_folder(several:format "sparks")
    assert.equal(0, folder:run("-f 1-2 -o '{output}/a.####.csv'").status)
    assert.same({ "scene.lua", "smoke/a.0001.csv", "smoke/a.0002.csv", "sparks/a.0001.csv", "sparks/a.0002.csv" },
      folder:list())
    assert.equal(1, csv_rows(folder:read "sparks/a.0002.csv")[1].Px)
    assert.equal(2, csv_rows(folder:read "smoke/a.0002.csv")[1].Px)
  end)

  it("writes the output main to a pattern without", function()
    local folder = new_folder(several:format "main")
    assert.equal(0, folder:run("-f 1 -o a.csv").status)
    assert.equal(1, csv_rows(folder:read "a.csv")[1].Px)
  end)

  it("needs {output} where none is called main", function()
    local result = new_folder(several:format "sparks"):run "-f 1 -o a.csv"
    assert.equal(2, result.status)
    assert.equal("-o a.csv: the graph has several outputs, and none is called main (smoke, sparks); " ..
      "put {output} into the pattern\n", result.stderr)
  end)
end)

describe("--set", function()
  it("gives parameters of the graph their values, each of them", function()
    local folder = new_folder [[
local rapid = require "rapid"
local x, up = rapid.param("x", 1), rapid.param("up", false)
return rapid.create { points = rapid.points.from { P = {{x, up and 1 or 0, 0}} } }
]]
    assert.equal(0, folder:run("-f 1 -o a.csv --set x=2.5 --set up=true").status)
    local row = csv_rows(folder:read "a.csv")[1]
    assert.equal(2.5, row.Px)
    assert.equal(1, row.Py)
  end)

  it("refuses a name that the graph has not, with the nearest", function()
    local result = new_folder():run "-f 1 --set hieght=3"
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find('no parameter "hieght"; did you mean "height"?', 1, true), result.stderr)
  end)

  -- Drops fall from 1 m and burst on impact; each piece bursts again when it dies, 0.2 s later.
  local bursts = [[
local drops = rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }
  :gravity {} :collide { shape = rapid.shape.plane {}, record = true } :solve {}
local pieces = rapid.create {} :spawn { from = drops, on = "hittotal >= 1", count = 2, life = 0.2 } :solve {}
return rapid.create {} :spawn { from = pieces, on = "death", count = 3 } :solve {}
]]

  it("reaches the chains whose points emit others, and their parents in turn", function()
    for _, g in ipairs { 1, 3, 9 } do
      local lands = math.sqrt(2 / g) + 0.2
      local result = scene.run(bursts, { frames = {1, 40}, set = { ["gravity1.g"] = {0, -g, 0} } })
      for frame, points in result:frames() do assert.equal((frame - 1) / 24 >= lands and 6 or 0, #points) end
    end
  end)

  it("refuses a parameter that the node has not, with the nearest, wherever the node is", function()
    local result = scene.command("run", bursts, "-f 1 --set gravity1.G=1")
    assert.equal(2, result.status)
    assert.equal('scene.lua:2: node "gravity1": unknown parameter "G"; did you mean "g"?\n', result.stderr)
  end)
end)

describe("--seed", function()
  local random = [[
local rapid = require "rapid"
return rapid.create { seed = 3, points = rapid.points.from { P = {{0, 0, 0}} } }
  :points("shake", function(p) p.v = vec3(p:rand(0), p:rand(1), p:rand(2)) end) :solve {}
]]

  it("replaces the seed of every create", function()
    local folder = new_folder(random)
    folder:run "-f 2 -o own.csv"
    folder:run "-f 2 -o three.csv --seed 3"
    folder:run "-f 2 -o four.csv --seed 4"
    assert.equal(folder:read "own.csv", folder:read "three.csv")
    assert.not_equal(folder:read "own.csv", folder:read "four.csv")
  end)
end)

describe("--threads", function()
  it("changes no bit of the result", function()
    local folder = new_folder [[
local rapid = require "rapid"
return rapid.create { seed = 5, points = rapid.points.grid { size = {4, 4, 4}, spacing = 0.1 } }
  :points("shake", function(p) p.v = p.v + vec3(p:rand(0) - 0.5, p:rand(1), p:rand(2) - 0.5) end)
  :gravity {} :collide { shape = rapid.shape.plane { normal = {0, 1, 0}, offset = -3 }, bounce = 0.5 }
  :solve { substeps = 2 }
]]
    for _, threads in ipairs { 1, 2, 7 } do
      assert.equal(0, folder:run(("-f 12-24x6 --threads %d -o %d.####.bgeo"):format(threads, threads)).status)
    end
    for _, frame in ipairs { 12, 18, 24 } do
      local one = folder:read(("1.%04d.bgeo"):format(frame))
      assert.truthy(#one > 64000 * 24)
      assert.is_true(one == folder:read(("2.%04d.bgeo"):format(frame)))
      assert.is_true(one == folder:read(("7.%04d.bgeo"):format(frame)))
    end
  end)
end)

describe("--stats", function()
  it("writes what each frame had and cost", function()
    local folder = new_folder()
    assert.equal(0, folder:run("-f 2-6x2 -o a.####.csv --stats deep/stats.json --threads 1").status)
    local stats = json.decode(folder:read "deep/stats.json")
    assert.equal("scene.lua", stats.graph)
    assert.equal(1, stats.threads)
    assert.truthy(stats.peak_bytes > 1e6 and stats.seconds > 0)
    assert.equal(6, #stats.frames)
    for i, frame in ipairs(stats.frames) do
      assert.equal(i, frame.frame)
      assert.equal(3, frame.points)
      assert.equal(0, frame.born)
      assert.equal(0, frame.died)
      local s = frame.seconds
      assert.near(s.total, s.graph + s.script + s.solve + s.write, 1e-9)
      assert.equal(i % 2 == 0, s.write > 0)
      for _, name in ipairs { "substeps", "penetration_max", "constraint_residual_max", "collisions" } do
        assert.equal("number", type(frame[name]), name)
      end
      if i == 1 then
        assert.falsy(frame.error) -- nothing has moved yet
      else
        assert.same({ position_p50 = 0, position_p95 = 0, position_max = 0 }, frame.error)
      end
    end
  end)

  it("counts the points that sleep", function()
    local folder = new_folder [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 0.1, 0}, {1, 0.1, 0}, {2, 99, 0}} } }
  :gravity {} :contact { radius = 0.1 } :collide { shape = rapid.shape.plane {}, bounce = 0 }
  :solve { substeps = 4, sleep = 0.25 }
]]
    local result = folder:run("-f 1-12 --stats stats.json")
    assert.equal(0, result.status)
    local frames = json.decode(folder:read "stats.json").frames
    assert.equal(0, frames[6].asleep) -- 5/24 s after the first
    assert.equal(2, frames[12].asleep)
  end)

  it("counts births, deaths and collisions", function()
    local folder = new_folder [[
local rapid = require "rapid"
return rapid.create {}
  :emit { source = rapid.points.from { P = {{0, 0.01, 0}} }, from = "points", impulse = { [2] = 5 }, life = 0.1 }
  :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0 } :solve {}
]]
    assert.equal(0, folder:run("-f 1-6 --stats stats.json").status)
    local frames = json.decode(folder:read "stats.json").frames
    local born, died, collisions = 0, 0, 0
    for _, frame in ipairs(frames) do
      born, died, collisions = born + frame.born, died + frame.died, collisions + frame.collisions
    end
    assert.equal(5, frames[2].born)
    assert.equal(5, born)
    assert.equal(5, died)
    assert.truthy(collisions >= 5)
    assert.equal(0, frames[6].points)
  end)
end)

describe("a picture", function()
  local ball = [[
local rapid = require "rapid"
local points = rapid.points.grid { size = {2, 0.1, 2}, spacing = 0.1, center = {0, 2, 0} }
local scene = rapid.create { points = points } :gravity {}
if rapid.param("ball", true) then scene = scene:collide { shape = rapid.shape.sphere { radius = 0.8 } } end
return scene:solve {}
]]

  -- Reads width and height from a PNG header.
  local function size_of(png)
    local wide, wide_low = png:byte(19, 20)
    local high, high_low = png:byte(23, 24)
    return 256 * wide + wide_low, 256 * high + high_low
  end

  it("has 1280 x 720 pixels, or those of --size", function()
    local folder = new_folder(ball)
    assert.equal(0, folder:run("-f 1 -o usual.png").status)
    assert.equal(0, folder:run("-f 1 -o small.png --size 64x48").status)
    assert.same({ 1280, 720 }, { size_of(folder:read "usual.png") })
    assert.same({ 64, 48 }, { size_of(folder:read "small.png") })
  end)

  it("is taken from where --camera says", function()
    local folder = new_folder(ball)
    for name, camera in pairs { a = "0,3,6,0,1,0", b = "0,3,6,0,1,0,35", c = "0,3,6,0,1,0,90", d = "0,1,6,0,1,0" } do
      assert.equal(0, folder:run(("-f 2 -o %s.png --size 64x48 --camera %s"):format(name, camera)).status)
    end
    local a = folder:read "a.png"
    assert.is_true(a ~= folder:read "c.png" and a ~= folder:read "d.png")
    local wrong = folder:run "-f 1 --camera 0,3,6,0,1"
    assert.equal(2, wrong.status)
    assert.truthy(wrong.stderr:find('--camera = "0,3,6,0,1"; it must be PX,PY,PZ,TX,TY,TZ', 1, true), wrong.stderr)
  end)

  it("is taken by the scene's camera, is blended and shows shapes as :picture says", function()
    local folder = new_folder(ball)
    local function picture(name, says, options)
      local text = ball:gsub("return scene:solve {}", "return scene:solve {}:picture { " .. says .. " }")
      folder:write(name .. ".lua", text)
      local result = command.rapid(("run %s.lua -f 3 -o %s.png --size 64x48 %s"):format(name, name, options or ""),
        { cwd = folder.path })
      assert.equal(0, result.status, result.stderr)
      return folder:read(name .. ".png")
    end
    local camera = "camera = rapid.camera { position = {0, 3, 6}, target = {0, 1, 0}, fov = 35 }"
    local usual = picture("usual", "", "--camera 0,3,6,0,1,0,35")
    assert.is_true(usual == picture("same", camera))
    local other = "camera = rapid.camera { position = {9, 9, 9} }"
    assert.is_true(usual == picture("option", other, "--camera 0,3,6,0,1,0,35"))
    local keyed = "camera = { [1] = rapid.camera { position = {0, 3, 6}, target = {0, 1, 0}, fov = 35 }, " ..
      "[5] = rapid.camera { position = {0, 3, 4}, target = {0, 1, 0}, fov = 35 } }"
    assert.is_true(picture("keyed", keyed) == picture("between", (camera:gsub("{0, 3, 6}", "{0, 3, 5}"))))
    assert.is_true(usual == picture("called", "camera = function(frame) return rapid.camera { " ..
      "position = {0, 3, 2 * frame.number}, target = {0, 1, 0}, fov = 35 } end"))
    assert.is_true(usual ~= picture("add", camera .. ", blend = 'add'"))
    assert.is_true(usual ~= picture("shutter", camera .. ", shutter = 1"))
    assert.is_true(picture("bare", camera .. ", colliders = false") ~= usual)
  end)

  it("shows the shapes that points are born on, unless the scene says no", function()
    local folder = new_folder ""
    local function picture(name, source, says)
      folder:write(name .. ".lua", ([[
local rapid = require "rapid"
return rapid.create {} :emit { source = %s, rate = 0 } :solve {}
  :picture { camera = rapid.camera { position = {0, 2, 5}, target = {0, 0, 0} }, %s }]]):format(source, says))
      local result = command.rapid(("run %s.lua -f 1 -o %s.png --size 64x48"):format(name, name), { cwd = folder.path })
      assert.equal(0, result.status, result.stderr)
      return folder:read(name .. ".png")
    end
    local hidden = picture("hidden", "rapid.mesh.torus {}", "emitters = false")
    assert.is_true(picture("shown", "rapid.mesh.torus {}", "") ~= hidden)
    assert.is_true(picture("points", "rapid.points.from { P = {{0, 0, 0}} }", "") == hidden)
  end)

  it("becomes a film of all frames", function()
    local folder = new_folder(ball)
    assert.equal(0, folder:run("-f 1-6x2 -o 'films/{output}.mp4' --size 64x48").status)
    local frames = command.shell("ffprobe -v error -count_frames -show_entries stream=nb_read_frames,r_frame_rate " ..
      "-of csv=p=0 films/main.mp4", { cwd = folder.path }).stdout
    assert.equal("24/1,3\n", frames)
    local function refused(arguments, message)
      local result = folder:run(arguments)
      assert.equal(2, result.status)
      assert.truthy(result.stderr:find(message, 1, true), result.stderr)
    end
    refused("-f 1-2 -o a.####.mp4", "a film is one file for all frames; remove the frame number from its name")
    refused("-f 1-2 -o a.mp4 --size 63x48", "a .mp4 film needs even edges; give another --size than 63x48")
    refused("-f 1-2 -o a.mp4 --untrusted", "films need the program ffmpeg, which --untrusted does not allow")
  end)

  it("becomes no film where a frame fails", function()
    local folder = new_folder(ball:gsub("return scene:solve {}",
      "return scene:solve {}:points('fails', function(p, frame) if frame.number == 4 then error 'four' end end)"))
    assert.equal(1, folder:run("-f 1-6 -o a.mp4 --size 64x48").status)
    assert.same({ "scene.lua" }, folder:list())
  end)

  it("shows the shapes that the points collide with", function()
    local folder = new_folder(ball)
    local camera = " --size 64x48 --camera 0,1,6,0,1,0"
    assert.equal(0, folder:run("-f 1 -o with.png" .. camera).status)
    assert.equal(0, folder:run("-f 1 -o without.png --set ball=false" .. camera).status)
    assert.is_true(folder:read "with.png" ~= folder:read "without.png")
  end)
end)

describe(":write", function()
  it("writes the points as they are there, of the frames of -f", function()
    local folder = new_folder [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 10, 0}}, heat = {3} } }
  :gravity {} :solve {} :write { file = "inner/a.####.csv", attributes = {"heat"} } :attribute { late = 1 }
]]
    local result = folder:run "-f 3-5x2 -o outer.####.csv"
    assert.equal(0, result.status, result.stderr)
    assert.same({ "inner/a.0003.csv", "inner/a.0005.csv", "outer.0003.csv", "outer.0005.csv", "scene.lua" },
      folder:list())
    local rows, header = csv_rows(folder:read "inner/a.0005.csv")
    assert.same({ "id", "Px", "Py", "Pz", "vx", "vy", "vz", "heat" }, header)
    assert.near(height_at(5), rows[1].Py, 1e-5)
    assert.truthy(folder:read("outer.0005.csv"):find "^[^\n]*,late\n")
  end)
end)

describe("an empty scene", function()
  it("just works", function()
    local folder = new_folder [[return require("rapid").create {} :gravity {} :solve {}]]
    local result = folder:run "-f 1-3 -o a.####.csv -o a.####.vdb -o a.####.png --stats stats.json"
    assert.equal(0, result.status, result.stderr)
    assert.equal("id,Px,Py,Pz,vx,vy,vz\n", folder:read "a.0003.csv")
    assert.truthy(result.stdout:find("\npoints   0\n", 1, true))
  end)
end)
