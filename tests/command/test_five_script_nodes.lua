-- A scene with five kinds of scripts, run from the command line, writes the same files with any number of threads.
local command = require "testing.command"

local folder = command.folder()
folder:write("curl.lua", [[
return require "rapid".node {
  name = "curl", doc = "Turns points about an axis, the more the hotter they are.",
  params = {
    axis     = { "vec3", default = {0, 1, 0}, doc = "axis of rotation" },
    strength = { "float", default = 1, unit = "1/s", doc = "angular acceleration at a heat of 1" },
  },
  points = function(p, frame, params)
    p.v = p.v + params.axis:cross(p.P) * (params.strength * p.heat * p.dt)
    if p.heat < 0.2 and p:rand(1, frame) < 0.1 then p:kill() end
  end,
}]])
folder:write("five.lua", [[
local rapid = require "rapid"
local rock = rapid.shape.sphere { radius = 0.4, center = {0, 0.5, 0} }
return rapid.create { fps = 24, seed = 5 }
  :emit { source = rapid.mesh.torus { radius = 0.5, tube = 0.2, center = {0, 1, 0} }, birth = "random", speed = 1,
          spread = 40, attributes = { heat = 1 }, rate = function(frame) return 90000 * (1 + frame.time) end }
  :attribute { crowd = 0, side = 0 }
  :points("cool", function(p, frame)
      p.heat = p.heat * math.exp(-p.dt / (0.2 + 0.2 * p:rand(1)))
      p.side = rock:distance(p.P)
      if p.side < 0 then p:join "inside" else p:leave "inside" end
    end)
  :detail("crowd", function(points, frame)
      points.detail.mean = points:mean "heat"
      points.detail.center = points:sum "P" / #points
      for i = 1, #points, 100 do points[i].crowd = #points:neighbours(i, 0.05) end
    end)
  :curl { strength = 4, axis = function(frame) return vec3(math.sin(frame.time), 1, 0) end }
  :action("drawn", function(p, step)
      p.force = p.force + (step.detail.center - p.P) * (2 * step.detail.mean) + vec3(0, p:rand(2, step), 0)
    end)
  :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0.5 }
  :solve { substeps = 2 }
  :points("paint", function(p) p.heat = rapid.math.fit(p.heat, 0, 1, 0.1, 1) end)
]])

describe("a scene with kernels, an action, a :detail, a Lua node and parameters that are functions", function()
  for _, threads in ipairs { 1, 2, 7 } do
    local result = command.rapid(("run five.lua -f 1-8 --threads %d --quiet -o %d.####.csv"):format(threads, threads),
      { cwd = folder.path })
    assert(result.status == 0, result.stderr)
  end

  it("has points enough for several chunks, some of them in its group", function()
    local info = command.rapid("info 1.0008.csv", { cwd = folder.path })
    assert.truthy(tonumber(info.stdout:match "points +(%d+)") > 20000, info.stdout)
    local text = folder:read "1.0008.csv"
    assert.truthy(text:find "group:inside")
    assert.truthy(text:find ",1\n" and text:find ",0\n")
  end)

  it("writes the same points on 1, 2 and 7 threads", function()
    for _, threads in ipairs { 2, 7 } do
      local result = command.rapid(("diff 1.####.csv %d.####.csv --tolerance 0"):format(threads), { cwd = folder.path })
      assert.equal(0, result.status, result.stdout)
    end
  end)

  it("writes the same bytes", function()
    for frame = 1, 8 do
      local one = folder:read(("1.%04d.csv"):format(frame))
      assert.is_true(one == folder:read(("2.%04d.csv"):format(frame)))
      assert.is_true(one == folder:read(("7.%04d.csv"):format(frame)))
    end
  end)

  it("is free of races", function()
    local result = command.rapid("check five.lua --races", { cwd = folder.path })
    assert.equal(0, result.status, result.stderr)
  end)
end)
