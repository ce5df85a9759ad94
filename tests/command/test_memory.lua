-- --memory: work that would need more is refused before it begins, with numbers and the parameter that would help.
local command = require "testing.command"
local json = require "dkjson"
local scene = require "testing.scene"

local grid = "rapid.points.grid { size = {40, 40, 40}, spacing = 1 }"

-- Scenes that need too much, by node and message.
local needs = {
  ["return rapid.create {} :emit { source = rapid.mesh.box {}, count = 1e9 } :solve {}"] =
    '^scene%.lua:1: node "emit1": 1000000000 births in a frame, in addition to 0 points, would need about 119%.2 ' ..
    "GiB, but only [%d.]+ [GM]iB of 1%.0 GiB are free; give a smaller count, or set %-%-memory\n$",
  ["return rapid.create {} :emit { source = rapid.mesh.box {}, rate = 2e10 } :solve {}"] =
    "give a smaller rate, or set",
  ["return rapid.create {} :emit { source = rapid.mesh.box {}, impulse = { [1] = 2e9 } } :solve {}"] =
    "give a smaller impulse, or set",
  ["return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 1e-3 } } :solve {}"] =
    "^scene%.lua:1: rapid%.points%.grid: size {1, 1, 1} with spacing 0%.001: 1e%+09 points would need about 59%.6 " ..
    "GiB, .* give a larger spacing, or set %-%-memory\n$",
  ["local s = rapid.levelset.sphere { radius = 10, voxel = 0.003 } return rapid.create {} :collide { shape = s } " ..
    ":solve {}"] = "use a voxel of at least [%d.]+ m, or set %-%-memory\n$",
  ["return rapid.create { points = " .. grid .. " } :distance { within = 1e9 } :solve {}"] =
    '^scene%.lua:1: node "distance1": within = 1e%+09: about 2e%+09 pairs of 64000 points would need about 488%.3 ' ..
    "GiB, .* give a smaller within, or set %-%-memory",
  ["return rapid.create { points = " .. grid .. " } :contact { radius = 1e9 } :solve {}"] =
    '^scene%.lua:1: node "contact1": radius = 1e%+09 m: about 2e%+09 pairs of 64000 points would need about 305%.2 ' ..
    "GiB, .* give a smaller radius, or set %-%-memory",
  ["return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 1 / 190 } } " ..
    ":interact { radius = 0.001, cohesion = 1 } :solve {}"] = '^scene%.lua:1: node "interact1": the neighbourhoods ' ..
    "of 6859000 points would need about 1%.0 GiB, but only %d+ MiB of 1%.0 GiB are free; apply it to fewer points, " ..
    "or set ",
  ["return rapid.create { points = " .. grid .. " } :contact { radius = 3 } :solve {}"] =
    'node "contact1": radius = 3 m: about 4%.[4-9]e%+07 pairs of 64000 points would need about [67]%.%d GiB',
  ["return rapid.create { points = " .. grid .. " } :clump { radius = 1e9 } :solve {}"] =
    'node "clump1": radius = 1e%+09 m: about 2e%+09 pairs of 64000 points would need about 610%.%d GiB, .* give a ' ..
    "smaller radius, or set %-%-memory",
}

describe("--memory", function()
  it("refuses what needs more, with numbers, the node and the parameter", function()
    for text, expected in pairs(needs) do
      local result = scene.command("run", text, "-f 1-3 --quiet --memory 1G")
      assert.truthy(result.status == 1 or result.status == 2, text)
      assert.match(expected, result.stderr)
    end
  end)

  it("ends a run that takes more memory than estimated, and names the node", function()
    for text, expected in pairs {
      [ [[return rapid.create { points = two } :detail("d", function(points, frame)
  for i = 1, 1e6 do points.detail[("x"):rep(100) .. i .. "_" .. frame.number] = i end
end) :solve {}]] ] = '^scene%.lua:1: node "d": the run uses [23]%d%d MiB of memory, and the limit is 200 MiB; ',
      [ [[local n = rapid.create { points = two } :solve {}
for i = 1, 8000 do n = n:merge(rapid.create { points = two } :solve {}) end
return n]] ] = "^scene%.lua: the run uses [23]%d%d MiB of memory, and the limit is 200 MiB; ",
      [ [[local t = {}
for i = 1, 1e8 do t[i] = { i } end]] ] = "^scene%.lua: the run uses [23]%d%d MiB of memory, and the limit is 200 MiB; ",
    } do
      local result = scene.command("run", text, "-f 1-20 --quiet --memory 200M --script-memory 4G --stats peak.json")
      assert.match(expected .. ".*or set %-%-memory\n$", result.stderr)
      assert.equal(1, result.status)
      local peak = json.decode(scene.folder:read "peak.json").peak_bytes
      assert.truthy(peak < 400 * 2 ^ 20, peak)
    end
  end)

  it("leaves to trace the lives that are known when it is reached", function()
    local result = scene.command("trace", [[return rapid.create { points = two } :detail("d", function(points, frame)
  for i = 1, frame.number > 3 and 1e6 or 0 do points.detail[("x"):rep(50) .. i .. "_" .. frame.number] = i end
end) :solve {}]], "--id 0 -f 1-9 --memory 200M --script-memory 4G")
    assert.match('^scene%.lua:1: node "d": the run uses 2%d%d MiB of memory, and the limit is 200 MiB; ', result.stderr)
    assert.equal(1, result.status)
    assert.match("^point 0 of create1\n.*\n +3 +0%.08333 s ", result.stdout)
  end)

  it("counts the neighbourhoods of a group, not those of all points", function()
    local text = "return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 1 / 80 } } " ..
      ":group { name = 'few', where = function(p) return p.id < %s end } " ..
      ":interact { group = 'few', radius = 0.01, cohesion = 1 } :solve {}"
    local few = scene.command("run", text:format "10", "-f 1-2 --quiet --memory 110M")
    assert.equal("", few.stderr)
    assert.equal(0, few.status)
    local all = scene.command("run", text:format "1e9", "-f 1-2 --quiet --memory 110M")
    assert.match('^scene%.lua:1: node "interact1": the neighbourhoods of 512000 points would need about 78 MiB, ',
      all.stderr)
  end)

  it("is what is free where it is not given", function()
    local result = scene.command("run", "return rapid.create {} :emit { source = rapid.mesh.box {}, count = 2e9 } " ..
      ":solve {}", "-f 1-3 --quiet")
    assert.match("2000000000 births in a frame, .* of [%d.]+ [GM]iB are free; give a smaller count", result.stderr)
    assert.equal(1, result.status)
  end)

  it("lets pass what fits, and what is small whatever it is", function()
    for _, memory in ipairs { "1", "1G" } do
      local result = scene.command("run", "return rapid.create { points = " .. grid .. " } :gravity {} :solve {}",
        "-f 1-3 --quiet --memory " .. memory)
      assert.equal("", result.stderr)
      assert.equal(0, result.status)
    end
  end)
end)

-- A file declares its size; one with holes, or a compressed one, is small on disk.
describe("a file that is larger than the memory that a run may take", function()
  local function read(file)
    return scene.command("run", "return rapid.create { points = rapid.points.read '" .. file .. "' } :solve {}",
      "-f 1 --quiet --memory 64M")
  end

  it("is refused before it is read", function()
    command.shell("truncate -s 300G hole.ply hole.obj; truncate -s 60M small.ply", { cwd = scene.folder.path })
    local result = read "hole.ply"
    assert.equal(2, result.status)
    assert.match("^scene%.lua:1: rapid%.points%.read: hole%.ply: the whole file would need about " ..
      "300%.0 GiB, but only %d+ MiB of 64 MiB are free; read a smaller file, or set %-%-memory\n$", result.stderr)
    assert.match("small%.ply: not a PLY", read "small.ply".stderr)
  end)

  it("is refused before compressed data or text is unpacked", function()
    local points = "return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 1 / 106 } }"
    assert.equal(0, scene.command("run", points, "-f 1 --quiet -o big.prt -o big.csv").status)
    assert.match("big%.prt: %d+ points, decompressed, would need about 7%d MiB", read "big.prt".stderr)
    assert.match("big%.csv: %d+ lines of 7 numbers would need about 127 MiB", read "big.csv".stderr)
  end)

  it("is refused while text grows in memory", function()
    scene.folder:write("big.obj", "v 0 0 0\nl" .. (" 1"):rep(2200000) .. "\n")
    assert.match("big%.obj: lines of at least 2097152 positions would need about 112 MiB", read "big.obj".stderr)
    scene.folder:write("big.usda",
      '#usda 1.0\ndef Points "a" { point3f[] points = [' .. ("(0,0,0),"):rep(1500000) .. "] }")
    assert.match("big%.usda: an array of at least %d+ rows would need about %d+ MiB", read "big.usda".stderr)
  end)
end)

describe("a number of steps", function()
  it("that no run would end with is refused, with the most", function()
    for text, expected in pairs {
      [":solve { substeps = 1e9 }"] = "substeps = 1000000000 is out of range; it must be from 1 to 1048576",
      [":solve { iterations = 1e9 }"] = "iterations = 1000000000 is out of range; it must be from 1 to 10000",
      [":solve { tolerance = 1, max_substeps = 1e9 }"] =
        "max_substeps = 1000000000 is out of range; it must be from 1 to 1048576",
    } do
      local message = scene.error("return rapid.create { points = two } " .. text)
      assert.truthy(message:find('^scene.lua:1: .*node "solve1": ' .. expected) or message:find(expected, 1, true),
        message)
    end
    local message = scene.error "return rapid.create { points = two, subframes = 1e9 } :solve {}"
    assert.truthy(message:find("subframes = 1000000000 is out of range; it must be from 1 to 10000", 1, true), message)
  end)
end)

describe("a neighbourhood of all points", function()
  it("is refused where no run would end with it, and slow else", function()
    local text = "return rapid.create { points = " .. grid .. " } :interact { radius = %g, cohesion = 1 } " ..
      ":contact { radius = 0.1 } :solve { substeps = 1000 }"
    local result = scene.command("run", text:format(1e9), "-f 1-2 --quiet")
    assert.equal(1, result.status)
    -- 64,000 neighbours of 64,000 points, at 1,000 steps, from 4 to 6 times.
    assert.match('^scene%.lua:1: node "interact1": radius = 1e%+09 m gives about 6%.4e%+04 neighbours for each of ' ..
      "64000 points, 1%.6e%+13 pairs in a frame of 1000 steps; at most 1e%+12 are possible; give a smaller radius\n$",
      result.stderr)
    -- The check counts pairs within the radius, not all pairs, so the same scene with few neighbours passes.
    local near = text:format(1.1):gsub(":contact { radius = 0.1 }", ""):gsub("1000 }", "%%d }")
    assert.match("pairs in a frame of 62 steps", scene.command("run", text:format(1e9):gsub("1000 }", "62 }"),
      "-f 1-2 --quiet").stderr)
    assert.equal("", scene.command("run", near:format(62), "-f 1-2 --quiet").stderr)
  end)
end)

describe("a graph without end", function()
  it("of a node that expands into itself is an error", function()
    scene.folder:write("selfish.lua", [[
return require "rapid".node { name = "selfish", doc = "Asks itself.", expand = function(input)
  return input:selfish {}
end }]])
    assert.match("stack overflow: a function calls itself endlessly",
      scene.error "return rapid.create { points = two } :selfish {} :solve {}")
  end)

  it("of 30,000 nodes is named in a time that grows with their number", function()
    local result = scene.command("check", "local n = rapid.create { points = two } for i = 1, 30000 do " ..
      "n = n:gravity {} end return n:solve {}")
    assert.equal(0, result.status)
    assert.match("30002 of 30002 nodes", result.stdout)
    assert.match('node "gravity30001"', scene.error("local n = rapid.create { points = two } for i = 1, 30000 do " ..
      "n = n:gravity {} end return n:gravity { wrong = 1 }"))
  end)

  it("is told in a message of bounded length", function()
    for _, text in ipairs {
      "return rapid.create {} :gravity { [('x'):rep(1e6)] = 1 } :solve {}",
      "return rapid.create {} :gravity { name = ('ä'):rep(5e5), wrong = 1 } :solve {}",
      "error(('x'):rep(1e6))", "require(('x'):rep(1e6))", "return rapid.create {} [('x'):rep(1e6)] {}",
    } do
      local message = scene.command("check", text).stderr
      assert.truthy(#message > 20 and #message < 5000, #message)
      assert.match("%[%.%.%. %d+ bytes %.%.%.%]", message)
      assert.falsy(message:find "[\192-\255][ \"]", "half of a character") -- part of a UTF-8 character
    end
  end)
end)
