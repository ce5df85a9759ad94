-- The error by source: a run calls a source of error 0 only if it is known to be, and names each node whose error it
-- does not estimate.
local command = require "testing.command"
local scene = require "testing.scene"
local json = require "dkjson"

-- Returns the sources of the last frame, and the summary.
local function sources_of(text, last, set)
  local run = scene.command("run", text, ("-f 1-%d --stats stats.json %s"):format(last or 5, set or ""))
  assert.equal(0, run.status, run.stderr)
  local frames = json.decode(scene.folder:read "stats.json").frames
  return frames[#frames].error_by_source, run.stdout
end

local function contains(list, text)
  for _, entry in ipairs(list or {}) do
    if entry:find(text, 1, true) then return true end
  end
end

-- Fails unless the run leaves these out: { graph = "swirl, which", shapes = ... }, and calls neither its error 0 nor
-- the run fine.
local function leaves_out(expected, text, last, set)
  local found, summary = sources_of(text, last, set)
  for _, source in ipairs { "solver", "graph", "shapes" } do
    local names = found[source].not_estimated
    if expected[source] then
      assert.truthy(contains(names, expected[source]), ("%s of %s: %s"):format(source, text, json.encode(found)))
      assert.truthy(summary:find("\nerror    [^\n]*not estimated: [^\n]*" .. expected[source]:gsub("%p", "%%%0")),
        summary)
    else
      assert.is_nil(names, ("%s of %s: %s"):format(source, text, json.encode(found)))
    end
  end
  assert.is_false(found.total.is_complete)
  assert.truthy(found.total.position_p50 > 0, text)
  for _, wrong in ipairs { "error    0", "exact", "none found", "all fine" } do
    assert.falsy(summary:find(wrong, 1, true), summary)
  end
  return found, summary
end

describe("a run calls its error 0, apart from rounding, if all motion has a closed form:", function()
  for name, nodes in pairs {
    ["uniform forces"] = ":gravity {} :drag { linear = 2 } :wind { velocity = {1, 0, 0} }",
    ["births on a source at rest"] =
      ":emit { source = rapid.mesh.sphere { radius = 1 }, rate = 200, speed = 2, spread = 20, life = 0.5 } :gravity {}",
    ["nodes on whose attributes no motion depends"] =
      ":attribute { heat = 1 } :points('cool', function(p) p.heat = p.heat * 0.9 end) :trail {} :spin {} :gravity {}"
      .. " :delete { where = function(p) return p.heat < 0.3 end }",
  } do
    it(name, function()
      local found, summary = sources_of("return rapid.create { points = two } " .. nodes .. " :solve { substeps = 3 }")
      for _, source in ipairs { "solver", "graph", "shapes" } do
        assert.same({ position_p50 = 0, position_p95 = 0, position_max = 0 }, found[source])
      end
      assert.truthy(found.rounding.position_max > 0)
      assert.equal(found.rounding.position_max, found.total.position_max)
      assert.is_true(found.total.is_complete)
      assert.truthy(summary:find "\nerror    0, but for rounding within [%d.]+ %S+\n", summary)
    end)
  end
end)

describe("an error below the rounding is no 0, without a closed form:", function()
  for _, nodes in ipairs { ":gravity {} :collide { shape = rapid.shape.plane {} }", ":turbulence { amplitude = 1e-30 }",
    ":distance { within = 2 }", ':action("still", function(p, step) p.v = p.v end)', ":drag { quadratic = 1e-9 }" } do
    it(nodes, function()
      local found, summary = sources_of("return rapid.create { points = two } " .. nodes .. " :solve {}")
      assert.is_true(found.total.is_complete)
      assert.truthy(found.solver.position_p50 >= found.rounding.position_max and found.rounding.position_max > 0)
      assert.falsy(summary:find("error    0", 1, true), summary)
    end)
  end
end)

describe("a run names what is evaluated once per frame:", function()
  local function graph(text, nodes)
    leaves_out({ graph = text }, "return rapid.create { points = two } " .. nodes .. " :solve { substeps = 4 }")
  end

  it("nodes that change what motion depends on", function()
    graph("kick, which changes v once per frame", ":points('kick', function(p) p.v = p.v + p.P * p.dt end)")
    graph("push, which changes P once per frame", ":points('push', function(p) p.P = p.P * 1.01 end)")
    graph("pull, which changes force once per frame", ":points('pull', function(p) p.force = -p.P end)")
    graph("grow, which changes pscale once per frame",
      ":points('grow', function(p) p.pscale = 2 * p.pscale end) :collide { shape = rapid.shape.plane {} }")
    graph("weigh, which changes pull once per frame",
      ":attribute { pull = 1 } :points('weigh', function(p) p.pull = p.P.y end)"
      .. " :attract { strength = rapid.attr 'pull' }")
    graph('group1, which chooses group "wet" once per frame',
      ":group { name = 'wet', where = function(p) return p.P.y < 0.5 end } :drag { linear = 1, group = 'wet' }")
    graph("wander1, which changes v once per frame", ":wander {}")
    graph("goal1, which changes force, v once per frame", ":goal { to = rapid.mesh.sphere { radius = 1 } }")
    graph("pull, which reads values of a :detail, set once per frame",
      ":detail('top', function(points) points.detail.top = points:max('P').y end)"
      .. " :action('pull', function(p, step) p.force = vec3(0, -step.detail.top, 0) end)")
    graph("thin, which removes points once per frame that others touch",
      ":points('thin', function(p) if p.age > 9 then p:kill() end end) :contact { radius = 0.1 }")
  end)

  it("functions of the frame, and moving sources of births", function()
    graph("gravity1.g, a function of the frame whose values are known once per frame",
      ":gravity { g = function(f) return {0, -9.81 * math.cos(48 * math.pi * f.time), 0} end }")
    graph("emit1.rate, a function of the frame", ":emit { source = two, rate = function(f) return 100 end }")
    graph("emit1.source, whose path is a curve through its positions once per frame",
      ":emit { source = two:transform(function(f) return rapid.rotate({0, 1, 0}, 720 * f.time) end), rate = 100 }")
  end)

  it("births from parents", function()
    leaves_out({ graph = "drops, whose births inherit the errors of their parents" }, [[
local parents = rapid.create { points = two } :gravity {} :solve {}
return rapid.create {} :spawn { name = "drops", from = parents, rate = 100 } :gravity {} :solve {}]])
  end)

  it("births among points that act on each other", function()
    leaves_out({ graph = "emit1, whose births meet other points once per frame" }, [[
      return rapid.create {} :emit { source = rapid.mesh.sphere { radius = 1 }, rate = 200 }
        :interact { radius = 0.5, separation = 1 } :solve {}]])
  end)

  it("ages on which motion depends", function()
    for node, text in pairs {
      [":drag { name = 'brake', linear = rapid.attr 'age' }"] = "brake, which reads age, constant through a frame",
      [":action('slow', function(p, step) p.v = p.v * (1 - p.age * step.dt) end)"] = "slow, which reads age",
    } do
      leaves_out({ graph = text }, "return rapid.create {} "
        .. ":emit { source = rapid.mesh.sphere {}, rate = 99, speed = 1 } " .. node .. " :solve {}")
    end
  end)

  it("ends of lives among points that act on each other, and hits that motion reads", function()
    graph("cut, which changes life", ":points('cut', function(p) p.life = 1 end) "
      .. ":interact { radius = 2, separation = 1 }")
    graph("push, which changes hitv", ":points('push', function(p) p.hitv = vec3(1, 0, 0) end) "
      .. ":action('pull', function(p, step) p.v = p.v + p.hitv * step.dt end)")
  end)

  it("nodes that change positions in a simulation without a solve", function()
    local _, summary = sources_of "return rapid.create { points = two } :points('go', function(p) p.P = 1.1 * p.P end)"
    assert.truthy(summary:find("error    not estimated: go, which changes P once per frame\n", 1, true), summary)
    assert.falsy(summary:find("all fine", 1, true), summary)
    leaves_out({ graph = "go, which changes P once per frame" }, [[
      return rapid.create { points = two } :gravity {} :solve {} :merge(
        rapid.create { points = two, name = "others" } :points("go", function(p) p.P = 1.1 * p.P end))]])
  end)

  it("nodes that change positions after the solve", function()
    leaves_out({ graph = "mirror, which changes P after solve1" },
      "return rapid.create { points = two } :gravity {} :solve {} :points('mirror', function(p) p.P = -p.P end)")
  end)

  it("with the number of subframes", function()
    leaves_out({ graph = "kick, which changes v 4 times per frame" },
      "return rapid.create { points = two, subframes = 4 } :points('kick', function(p) p.v = p.P end) :solve {}")
  end)
end)

describe("a run names what approximates a shape:", function()
  local function shapes(text, nodes)
    leaves_out({ shapes = text }, "return rapid.create { points = two } " .. nodes .. " :solve {}")
  end

  it("level sets, with their voxels", function()
    local ball = "rapid.levelset.sphere { radius = 0.6, voxel = 0.05 }"
    shapes("collide1.shape, a level set of voxel 0.05 m", ":gravity {} :collide { shape = " .. ball .. " }")
    shapes("attract1.shape, a level set of voxel 0.05 m", ":attract { shape = " .. ball .. " }")
    shapes("emit1.source, a level set of voxel 0.05 m", ":emit { source = " .. ball .. ", rate = 100 }")
  end)

  it("fogs", function()
    leaves_out({ graph = "emit1", shapes = "emit1.source, a fog" }, [[
      local fog = rapid.fog.from_points(two, { radius = 0.5, voxel = 0.2 })
      return rapid.create {} :emit { source = fog, rate = 99 } :contact { radius = 0.01 } :solve {}]])
  end)

  it("level sets and moving shapes that an action reaches", function()
    local function reached(text, shape, ball)
      leaves_out({ shapes = "pull.kernel, which reaches " .. text }, ([[
local shape = %s
return rapid.create { points = two }
  :action("pull", function(p) p.force = vec3(0, -%s:distance(p.P), 0) end) :solve {}]]):format(shape, ball))
    end
    local level_set = "rapid.levelset.sphere { radius = 0.95, voxel = 0.05 }"
    reached("a level set of voxel 0.05 m", level_set, "shape")
    reached("a level set of voxel 0.05 m", "{ balls = { " .. level_set .. " } }", "shape.balls[1]")
    reached("a shape whose motion is fitted by a track once per frame",
      "rapid.shape.sphere { radius = 0.6 }:transform(function(f) return rapid.translate(f.time, 0, 0) end)", "shape")
  end)

  it("level sets of nodes that are evaluated once per frame, too", function()
    local ball = "rapid.levelset.sphere { radius = 0.95, voxel = 0.05 }"
    leaves_out({ graph = "push, which changes v once per frame",
      shapes = "push.kernel, which reaches a level set of voxel 0.05 m" }, "local ball = " .. ball .. [[
return rapid.create { points = two }
  :points("push", function(p) p.v = p.v * (1 - ball:distance(p.P) * p.dt) + p.P end) :solve {}]])
    leaves_out({ graph = "avoid1, which changes v once per frame",
      shapes = "avoid1.shape, a level set of voxel 0.05 m" },
      "return rapid.create { points = two } :avoid { shape = " .. ball .. ", distance = 0.1 } :solve {}")
  end)

  it("kernels that reach too many values to look at", function()
    leaves_out({ shapes = "still.kernel, which reaches too many values to find the shapes among them" }, [[
local many = {}
for i = 1, 20000 do many[i] = i end
return rapid.create { points = two } :action("still", function(p) p.force = p.P * many[1] end) :solve {}]])
  end)

  it("but no mesh, no formula, and no shape that is only read for attributes on which no motion depends", function()
    local found = sources_of [[
local ball = rapid.levelset.sphere { radius = 0.95, voxel = 0.05 }
local wall, hill = rapid.shape.plane {}, rapid.mesh.sphere { radius = 0.5 }
return rapid.create { points = two }
  :attribute { heat = 1 } :points("warm", function(p) p.heat = ball:distance(p.P) end)
  :action("pull", function(p) p.force = vec3(0, -wall:distance(p.P) - hill:distance(p.P), 0) end) :solve {}]]
    assert.is_nil(found.shapes.not_estimated)
    assert.is_nil(found.graph.not_estimated)
  end)

  it("tracks of moving shapes", function()
    local moving = "function(f) return rapid.translate(f.time, 0, 0) end"
    shapes("collide1.transform, whose motion is fitted by a track once per frame",
      ":gravity {} :collide { shape = rapid.shape.plane {}, transform = " .. moving .. " }")
    shapes("pin1.target, whose motion is fitted by a track once per frame",
      ":pin { target = rapid.shape.sphere { radius = 1 }:transform(" .. moving .. ") }")
  end)
end)

describe("scenes in which twice the substeps show no error, or too small a one:", function()
  it("a kernel that kicks", function()
    leaves_out({ graph = "swirl, which changes v once per frame" }, [[
return rapid.create { points = rapid.points.grid { size = {2, 1, 2}, spacing = 0.5, center = {0, 1, 0} } }
  :points("swirl", function(p) p.v = p.v + vec3(0, 1, 0):cross(p.P) * (3 * p.dt) end) :gravity {} :solve {}]])
  end)

  it("points that are torn off a box that spins up", function()
    leaves_out({ shapes = "collide1.transform, whose motion" }, [[
local P, v = {}, {}
for i = 0, 9 do P[i + 1], v[i + 1] = {0.2 + i / 9, 0.2, 0}, {0, -3, 0} end
return rapid.create { points = rapid.points.from { P = P, v = v } }
  :collide { shape = rapid.shape.box { size = {4, 0.2, 4} }, response = "stick", adhesion = 6,
             transform = function(f) return rapid.rotate({0, 1, 0}, math.deg(2 * f.time ^ 2)) end }
  :solve { substeps = 64 }]])
  end)

  it("a bounce off a level set", function()
    leaves_out({ shapes = "collide1.shape, a level set of voxel 0.1 m" }, [[
return rapid.create { points = rapid.points.grid { size = {1, 0.2, 1}, spacing = 0.1, center = {0.013, 1.5, 0.027} } }
  :gravity {}
  :collide { shape = rapid.levelset.sphere { radius = 0.6, voxel = rapid.param("voxel", 0.05) } }
  :solve {}]], 13, "--set voxel=0.1")
  end)

  it("an emitter on a circle", function()
    leaves_out({ graph = "emit1.source, whose path" }, [[
return rapid.create {}
  :emit { source = rapid.points.from { P = {{1, 0, 0}} }
            :transform(function(f) return rapid.rotate({0, 1, 0}, 720 * f.time) end),
          from = "points", rate = 600, birth = "even" } :solve {}]])
  end)

  it("a weight of one period per frame", function()
    leaves_out({ graph = "gravity1.g, a function of the frame" }, [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }
  :gravity { g = function(f) return {0, -9.81 * math.cos(2 * math.pi * 24 * f.time), 0} end }
  :solve { substeps = 16 }]])
  end)
end)

it("more than 1,000 coupled points have no error of the solver since birth", function()
  local found = leaves_out({ solver = "the sum since birth, as more than 1,000 points act on one another" }, [[
local P, v = {}, {}
for i = 1, 1100 do P[i], v[i] = {0.1 * (i % 11), 0.1 * math.floor(i / 11), 0}, {math.sin(i), math.cos(i), 0} end
return rapid.create { points = rapid.points.from { P = P, v = v } } :gravity {}
  :contact { radius = 0.05, friction = 0.2 } :solve { substeps = 4, sleep = math.huge }]], 3)
  assert.truthy(found.total.position_max > 1e-5) -- the error of the frame
end)

describe("a study", function()
  local folder = command.folder()
  local function study(text, arguments)
    folder:write("scene.lua", [[
local rapid = require "rapid"
local two = rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}} }
]] .. text)
    local run = command.rapid("study scene.lua --repeat 1 -f 1-5 " .. arguments, { cwd = folder.path })
    assert.equal(0, run.status, run.stderr)
    return run.stdout, json.decode(folder:read "study.json")
  end
  local kicked = [[
return rapid.create { points = two } :points("swirl", function(p) p.v = p.v + p.P * p.dt end) :gravity {} :solve {}]]

  it("is exact only if no source of error is left out", function()
    local text, found = study("return rapid.create { points = two } :gravity {} :solve {}",
      "--sweep solve.substeps=1,2 --reference 8")
    assert.truthy(text:find("exact: every error is at rounding", 1, true), text)
    assert.same({}, found.held_fixed)

    text, found = study(kicked, "--sweep solve.substeps=1,2 --reference 8")
    assert.falsy(text:find("exact", 1, true), text)
    assert.falsy(folder:read("study.svg"):find("exact", 1, true))
    assert.truthy(text:find("\nheld fixed: swirl, which changes v once per frame\n", 1, true), text)
    assert.same({ "swirl, which changes v once per frame" }, found.held_fixed)
  end)

  it("does not hold fixed what it varies", function()
    local text, found = study(kicked, "--sweep create.subframes=1,2,4 --reference 32")
    assert.same({}, found.held_fixed)
    assert.falsy(text:find("held fixed", 1, true), text)
    assert.near(1, found.lines[1].order, 0.2)
  end)
end)
