-- solve{ tolerance }: substeps from each point's own estimated error; and the error that every run reports.
local scene = require "testing.scene"
local command = require "testing.command"
local json = require "dkjson"

-- Points on ellipses around an attractor: far ones are easy, near ones stiff.
local orbits = [[
return rapid.create { fps = 24, points = rapid.points.from { P = {%s}, v = {%s} } }
  :attract { strength = 5 } :solve { %s }]]

local places = { "{4, 0, 0}", "{2, 0, 0}", "{0.5, 0, 0}", "{0.1, 0, 0}" }
local velocities = { "{0, 0, 1}", "{0, 0, 1.5}", "{0, 0, 3}", "{0, 0, 7}" }

local function frame_two(options, first, last)
  local P, v = table.concat(places, ", ", first or 1, last), table.concat(velocities, ", ", first or 1, last)
  return scene.run(orbits:format(P, v, options), { frames = {2, 2} })[2]
end

local function assert_within(tolerance, points, exact)
  for i = 1, #points do
    local off = (points[i].P - exact[i].P):length()
    assert.truthy(off <= tolerance, ("point %d is off by %g m"):format(i, off))
  end
end

describe("a tolerance", function()
  it("bounds the error of a frame for each point", function()
    local exact = frame_two "substeps = 4096"
    for _, tolerance in ipairs { 1e-2, 1e-3, 1e-4 } do
      local points = frame_two(("tolerance = %g, max_substeps = 1024"):format(tolerance))
      assert_within(tolerance, points, exact)
    end
  end)

  -- Runs of 1 and 2 substeps find a contact in the second half at the same position, and agree on its error.
  for _, method in ipairs { "project", "backtrack" } do
    it("holds for contacts that " .. method .. " finds after the step", function()
      local text = [[
local P, v = {}, {}
for i = 1, 50 do P[i], v[i] = {i, 0.13 * i / 50, 0}, {0, -3, 0} end
return rapid.create { fps = 24, points = rapid.points.from { P = P, v = v } } :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0.5, method = "%s" } :solve { %s }]]
      local exact = scene.run(text:format("continuous", ""), { frames = {2, 2} })[2]
      for _, tolerance in ipairs { 1e-2, 1e-3 } do
        local options = ("tolerance = %g, max_substeps = 8192"):format(tolerance)
        local points = scene.run(text:format(method, options), { frames = {2, 2} })[2]
        assert_within(tolerance, points, exact)
      end
    end)
  end

  it("takes the steps that a point needs, whatever other points there are", function()
    local options = "tolerance = 1e-4, max_substeps = 1024"
    local all = frame_two(options)
    for i = 1, #all do
      local alone = frame_two(options, i, i)
      assert.equal(all[i].P, alone[1].P)
      assert.equal(all[i].v, alone[1].v)
    end
    -- The limit of one and two substeps suffices for the first point, and not for the last.
    local one, two = frame_two "substeps = 1", frame_two "substeps = 2"
    local function tends_to(i) return two[i].P + (two[i].P - one[i].P) / 3 end
    assert.truthy((all[1].P - tends_to(1)):length() < 1e-6)
    assert.truthy((all[4].P - tends_to(4)):length() > 1e-2)
  end)

  it("does so for ten thousand of which half need many, with bounces and deaths, on any number of threads", function()
    local text = [[
local P, v, radius = {}, {}, {}
for i = 1, 10000, %d do
  local r = i %% 2 == 0 and 0.1 or 1 + i / 10000
  P[#P + 1], v[#v + 1] = {r, 0.002 * (i %% 50), 0}, {0, -0.5, math.sqrt(5 / r)}
end
return rapid.create { fps = 24, points = rapid.points.from { P = P, v = v } } :attract { strength = 5 }
  :collide { shape = rapid.shape.plane { offset = -0.03 }, bounce = 0.5 }
  :collide { shape = rapid.shape.plane { normal = {-1, 0, 0}, offset = -1.95 }, response = "die" }
  :solve { tolerance = 1e-6, max_substeps = 1024 }]]
    local function run(step, threads) return scene.run(text:format(step), { frames = {3, 3}, threads = threads })[3] end
    local all = run(1, 1)
    assert.truthy(#all > 8000 and #all < 9950, #all)
    for _, threads in ipairs { 2, 7 } do assert.same_points(all, run(1, threads)) end
    local some = run(13)
    for i = 1, #some do
      local same = all:by_id(13 * some[i].id)
      assert.equal(same.P, some[i].P)
      assert.equal(same.v, some[i].v)
    end
  end)

  it("gives the last run itself where a shape broke the way, or what the runs tend to lies in one", function()
    local text = [[
local P, v = {}, {}
for i = 1, 4000 do P[i], v[i] = {i / 100, 0.1 + 2e-5 * i, 0}, {0, -3, 0} end
return rapid.create { fps = 24, points = rapid.points.from { P = P, v = v } } :gravity {}
  :turbulence { amplitude = 20, size = 0.3 }
  :collide { shape = rapid.shape.plane {}, bounce = 0.4, method = "project" } :solve { %s }]]
    local points = scene.run(text:format "tolerance = 3e-2", { frames = {2, 2} })[2]
    local of_a_run = 0
    for _, substeps in ipairs { 2, 4, 8, 16, 32, 64 } do
      local run = scene.run(text:format("substeps = " .. substeps), { frames = {2, 2} })[2]
      for i = 1, #points do
        if points[i].P == run[i].P then
          of_a_run = of_a_run + 1
          assert.equal(run[i].v, points[i].v)
        end
      end
    end
    assert.truthy(of_a_run > 500 and of_a_run < 3900, of_a_run)
  end)

  it("takes one step of what falls past a shape without meeting it, and tries two of what meets it", function()
    local function substeps(place)
      local folder = command.folder()
      folder:write("scene.lua", ([[
local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{%g, -0.1, 0.9}}, v = {{0, -2, 0}} } } :gravity {}
  :collide { shape = rapid.shape.sphere { radius = 1, center = {0, -1, 0} }, friction = 0.3 }
  :solve { tolerance = 1e-12, max_substeps = 8 }]]):format(place))
      assert.equal(0, command.rapid("run scene.lua -f 1-9 --stats stats.json", { cwd = folder.path }).status)
      local most = 0
      for _, frame in ipairs(json.decode(folder:read "stats.json").frames) do most = math.max(most, frame.substeps) end
      return most
    end
    assert.equal(1, substeps(0.9)) -- through a corner of the box around the sphere
    assert.equal(2, substeps(0.3))
  end)

  it("works with actions, deaths and births, the same bits on 1, 2 and 7 threads", function()
    local text = [[
return rapid.create { fps = 24, seed = 2 }
  :emit { source = rapid.mesh.sphere { radius = 0.5 }, rate = 30000, speed = 2, life = 0.5, attributes = { n = 0 } }
  :attract { strength = 5, core = 0.01 }
  :action("count", function(p, step) p.n = p.n + 1 if p.P.y > 0.6 then p:kill() end end)
  :collide { shape = rapid.shape.sphere { radius = 0.2 }, response = "die" }
  :solve { tolerance = 1e-4 }]]
    local one = scene.run(text, { frames = {12, 12}, threads = 1 })[12]
    assert.points(one).finite()
    assert.truthy(#one > 1000)
    local least, most = one:min "n", one:max "n"
    assert.truthy(least >= 1 and most > 2 * least, ("%g %g"):format(least, most))
    for i = 1, #one, 11 do assert.truthy(one[i].P.y < 0.7 and one[i].P:length() > 0.19) end
    for _, threads in ipairs { 2, 7 } do
      assert.same_points(one, scene.run(text, { frames = {12, 12}, threads = threads })[12])
    end
  end)

  it("counts those that die in the run that is their result", function()
    local folder = command.folder()
    folder:write("scene.lua", [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.2, center = {0, 1, 0} } } :gravity {}
  :action("slow", function(p, step) p.v = p.v * (1 - 3 * step.dt) if p.P.y < 0.1 then p:kill() end end)
  :solve { tolerance = 1e-5 }]])
    assert.equal(0, command.rapid("run scene.lua -f 1-20 --stats stats.json", { cwd = folder.path }).status)
    local points, died = nil, 0
    for _, frame in ipairs(json.decode(folder:read "stats.json").frames) do
      if points then assert.equal(points - frame.points, frame.died) end
      points, died = frame.points, died + frame.died
    end
    assert.truthy(died > 50, died)
  end)

  it("says which points it could not keep to it", function()
    local result = scene.run(orbits:format("{0.01, 0, 0}", "{0, 0, 20}", "tolerance = 1e-9, max_substeps = 4"),
      { frames = {2, 2} })
    assert.match("some points need more than 4 substeps for an error of 1e%-09 m per frame", result.warnings[1])
  end)
end)

describe("the error of a run", function()
  local function reported(options)
    local folder = command.folder()
    folder:write("scene.lua", "local rapid = require 'rapid'\n" .. orbits:format(table.concat(places, ", "),
      table.concat(velocities, ", "), options))
    local ran = command.rapid("run scene.lua -f 2 --stats stats.json", { cwd = folder.path })
    assert.equal(0, ran.status)
    return json.decode(folder:read "stats.json").frames[2].error, ran.stdout
  end

  it("is within a factor of four of the true one", function()
    local exact = frame_two "substeps = 4096"
    for _, substeps in ipairs { 4, 16, 64 } do
      local points, largest = frame_two("substeps = " .. substeps), 0
      for i = 1, #points do largest = math.max(largest, (points[i].P - exact[i].P):length()) end
      local error = reported("substeps = " .. substeps)
      assert.truthy(error.position_max < 4 * largest and error.position_max > largest / 4,
        ("%g for %g"):format(error.position_max, largest))
      assert.truthy(error.position_p50 <= error.position_p95 and error.position_p95 <= error.position_max)
    end
  end)

  it("is reported in the summary", function()
    local _, summary = reported "substeps = 4"
    assert.match("error    estimated: [^\n]*all[%a ]* within [%d.]+ %S*m\n", summary)
  end)
end)
