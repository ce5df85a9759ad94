-- Neighbouring edits share a pass over the points. The result is bit-identical to that of separate passes.
local json = require "dkjson"
local scene = require "testing.scene"
local lehmer = require "tests.lehmer"

local head = "local ball = rapid.levelset.sphere { radius = 5, voxel = 1 } " ..
  "local function named(p, name) return p[name] end " ..
  "local noted = { index = -1 } local function either(a, b) if a.heat > 0 then return a end return b end " ..
  "return rapid.create { points = rapid.points.grid { size = {26, 20, 20}, spacing = 1 } } " ..
  ":attribute { heat = 0, seen = 0 } "

-- Appends a Solve unless one of the nodes is one.
local function scene_of(nodes)
  local chain = table.concat(nodes, " ")
  return head .. chain .. (chain:find ":solve" and "" or " :solve {}")
end

-- Separates the edits by nodes that do not edit points one by one.
local function apart(edits)
  local nodes = {}
  for k, edit in ipairs(edits) do nodes[k] = edit .. (" :detail('between%d', function() end)"):format(k) end
  return scene_of(nodes)
end

local together = scene_of

local function passes(text)
  local result = scene.command("explain", text, "--json")
  assert.equal(0, result.status, result.stderr)
  return json.decode(result.stdout).passes
end

-- Checks that the points of each frame equal those of separate passes, on any number of threads.
local function check_same(edits, frames)
  local expected = scene.run(apart(edits), { frames = frames or {1, 3}, threads = 1 })
  for _, threads in ipairs { 1, 2, 7 } do
    local result = scene.run(together(edits), { frames = frames or {1, 3}, threads = threads })
    for frame, points in result:frames() do assert.same_points(expected[frame], points) end
  end
  return expected
end

-- Checks that the message equals that of separate passes.
local function check_error(edits, expected)
  local message = scene.error(apart(edits), { threads = 1 })
  assert.truthy(message:find(expected, 1, true), message)
  for _, threads in ipairs { 1, 2, 7 } do assert.equal(message, scene.error(together(edits), { threads = threads })) end
end

describe("neighbouring edits of points", function()
  it("share a pass, kernels with native ones", function()
    local edits = {
      ":points('a', function(p) p.heat = p.heat + p.id if p:rand(1) < 0.5 then p:join 'new' end end)",
      ":group { name = 'odd', where = function(p) return p.id % 2 == 1 end }",
      ":points { name = 'b', group = 'new', kernel = function(p) p.v = p.v + vec3(p.heat, p:rand(2), 0) end }",
      ":attribute { later = 3 }",
      ":delete { where = function(p) return p.id % 7 == 3 end }",
      ":points('c', function(p, frame) p.seen = p.seen + p:rand(3, frame) + (p:within 'odd' and 10 or 1) end)",
      ":delete { group = 'odd' }",
      ":points { name = 'd', group = 'new', kernel = function(p) p.later = p.later + p.seen end }",
      ":kill_slow { speed = 0.5, age = 0.01 }",
      ":points('e', function(p) p.v = p.v * 0.5 end)",
    }
    assert.same({ "attribute1", "a", "group1", "b", "attribute2", "delete1", "c", "delete2", "d", "kill_slow1", "e" },
                passes(together(edits))[1])
    local last = check_same(edits)[3]
    assert.is_true(#last > 1000 and #last < 5200, #last)
  end)

  it("skip points that an earlier one has removed", function()
    check_same {
      ":points('a', function(p) if p.id % 3 == 0 then p:kill() end end)",
      ":group { name = 'g', where = function(p) assert(p.id % 3 > 0) return p.id % 2 == 0 end }",
      ":delete { where = function(p) assert(p.id % 3 > 0) return p.P.x < -5 end }",
      -- A level set refuses a position that is NaN.
      ":delete { where = function(p) return ball:distance(p.P / (p.P.x < -5 and 0 or 1)) < 0 end }",
      ":points { name = 'b', group = 'g', kernel = function(p) assert(p.P.x >= -5) p.heat = ball:distance(p.P) end }",
    }
  end)

  it("may ask for the group that they make, and be limited to it", function()
    local last = check_same({
      ":group { name = 'g', where = function(p) return p.id % 3 == 0 end }",
      ":group { name = 'g', where = function(p) return not p:within 'g' or p.id % 2 == 0 end }",
      ":group { name = 'g', group = 'g', where = function(p) return p.id % 5 > 0 end }",
      ":points { name = 'a', group = 'g', kernel = function(p) p.heat = 1 p:leave 'g' end }",
      ":points('b', function(p) p.seen = p:within 'g' and 1 or 2 end)",
      ":group { name = 'all' }",
      ":group { name = 'copy', group = 'all' }",
      ":points('c', function(p) if p.heat == 0 then p:leave 'all' end end)",
    }, {1, 2})[2]
    assert.equal(#last, #last:group "copy")
    assert.is_true(#last:group "all" > 0 and #last:group "all" < #last)
    assert.equal(0, #last:group "g")
  end)

  it("that ask for places begin a pass behind one that removes points", function()
    local kill, place = ":delete { where = function(p) return p.id % 4 == 0 end }",
      ":points('a', function(p) p.heat = p.index end)"
    assert.same({ "attribute1", "delete1" }, passes(together { kill, place })[1])
    assert.same({ "attribute1", "a", "delete1" }, passes(together { place, kill })[1])
    check_same { kill, place, ":group { name = 'g', where = function(p) return p.index % 2 == 0 end }" }
    for _, asks in ipairs {
      ":points('b', function(p) p.heat = p['in' .. 'dex'] end)",
      ":points('b', function(p) p.heat = named(p, 'index') end)",
      ":points('b', function(p) local t = setmetatable({}, { __index = p }) p.heat = t.index end)",
      ":delete { where = function(p) return p.index % 5 == 0 end }",
      -- an index of a value that may be the point or a shared table
      ":points('b', function(p) local q = p.id > 5 and p or { index = 3 } p.heat = q.index end)",
      ":points('b', function(p) local q = p.id > 5 and p or noted p.heat = q.index end)",
      ":points('b', function(p) local q = noted for _ = 1, 2 do p.heat = q.index q = p end end)",
      ":points('b', function(p) p.heat = either(p, noted).index end)",
      ":points('b', function(p) p.heat = assert(p, noted).index end)",
      ":points('b', function(p) local q = p.id > 5 and p or noted p.heat = q['in' .. 'dex'] end)",
    } do
      check_same { kill, ":points('c', function(p) p.seen = 1 end)", asks }
    end
  end)

  it("see indices of the whole set, even if they are limited to a group", function()
    local last = check_same({
      ":group { name = 'even', where = function(p) return p.id % 2 == 0 end }",
      ":group { name = 'first', group = 'even', where = function(p) return p.index <= 10 end }",
      ":delete { group = 'even', where = function(p) return p.index > 10390 end }",
    }, {1, 2})[2]
    assert.equal(10395, #last)
    assert.equal(5, #last:group "first")
  end)

  it("may all be native, or after Solve", function()
    local edits = { ":group { name = 'g' }", ":group { name = 'h', group = 'g' }", ":delete { group = 'h' }" }
    assert.same({ "attribute1", "group1", "group2", "delete1" }, passes(together(edits))[1])
    assert.equal(0, #check_same(edits)[2])
    local last = check_same({ ":solve {}", ":group { name = 'g', where = function(p) return p.id > 9 end }",
      ":attribute { made = 2 }", ":delete { group = 'g' }", ":points('a', function(p) p.made = p.made + p.id end)" })[3]
    assert.equal(10, #last)
    assert.equal(11, last:by_id(9).made)
  end)

  it("are the same in any order of any of them", function()
    local kinds = {
      ":group { name = '%s', where = function(p) return p:rand(1) < 0.6 end }",
      ":group { name = '%s', group = '%s' }",
      ":group { name = '%s' }",
      ":group { name = '%s', where = function(p) return p:within '%s' ~= (p.heat > 1) end }",
      ":delete { group = '%s', where = function(p) return p:rand(2) < 0.2 end }",
      ":delete { where = function(p) return p.heat > 4 and p:within '%s' end }",
      ":points('k%d', function(p, frame) p.heat = p.heat + p:rand(3, frame) if p.seen > 1 then p:join '%s' end end)",
      ":points { name = 'k%d', group = '%s', kernel = function(p) p.seen = p.seen + 1 p:leave '%s' end }",
      ":points { name = 'k%d', group = '%s', kernel = function(p) p.seen = p.index end }",
      ":points { name = 'k%d', group = '%s', kernel = function(p) if p.id %% 9 == 0 then p:kill() end end }",
      ":attribute { other%d = 1 }",
    }
    local draw = lehmer.new(12345)
    local groups, shared = { "x", "y", "z" }, 0
    for _ = 1, 12 do
      local edits = { ":group { name = 'x' }", ":group { name = 'y', where = function(p) return p.id > 70 end }",
                      ":group { name = 'z', where = function(p) return p.id % 2 == 0 end }" }
      for k = 1, 6 do
        edits[#edits + 1] = draw.pick(kinds):gsub("%%%%", "\1"):gsub("%%d", k)
          :gsub("%%s", function() return draw.pick(groups) end):gsub("\1", "%%")
      end
      shared = shared + #passes(together(edits))[1]
      check_same(edits)
    end
    assert.is_true(shared > 12 * 6, shared) -- nodes of the first passes
  end)

  it("do not see an attribute that a later one makes", function()
    check_error({ ":solve {}", ":points('a', function(p) p.heat = p.made end)", ":attribute { made = 2 }" },
      'scene.lua:1: node "a": no attribute "made" here')
  end)

  it("make the first one's error known, wherever in the points it is", function()
    check_error({
      ":points('a', function(p) if p.id == 9000 then error 'late' end end)",
      ":points('b', function(p) if p.id == 10 then error 'early' end end)",
    }, 'scene.lua:1: node "a": late (point id 9000, frame 2)')
    check_error({
      ":points('a', function(p) if p.id < 100 then p:kill() end end)",
      ":group { name = 'g', where = function(p) return p.id < 9000 or nil .. '' end }",
      ":delete { where = function(p) return p.P / 0 end }",
      ":points('b', function(p) error 'too late' end)",
    }, 'scene.lua:1: node "group1": attempt to concatenate a nil value (point id 9000, frame 2)')
    check_error({
      ":group { name = 'g', where = function(p) return p.id > 20 end }",
      ":delete { group = 'g', where = function(p) p.v = p.P end }",
    }, 'scene.lua:1: node "delete1": assigns "v"; a condition must not change its point (point id 21, frame 2)')
  end)
end)
