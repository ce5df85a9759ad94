-- The error that a run reports, accumulated since birth, compared with the true error of all points, from a run with
-- many substeps, on different kinds of scenes.
local scene = require "testing.scene"
local command = require "testing.command"
local json = require "dkjson"

local last = 25 -- one second
local grid = "local start = rapid.points.grid { size = {1, 1, 1}, spacing = 0.2, center = {0, 1, 0} } "

-- Each with the substeps of its run, inserted for %d.
local scenes = {
  orbit = { 2, [[
local P, v = {}, {}
for i = 1, 100 do P[i] = {1 + i / 100, 0, 0} v[i] = {0, 0, 2 / math.sqrt(1 + i / 100)} end
return rapid.create { points = rapid.points.from { P = P, v = v } } :attract { strength = 4 }
  :solve { substeps = %d }]] },
  turbulence = { 2, grid .. [[
return rapid.create { points = start } :turbulence { amplitude = 5, size = 1, octaves = 2 } :drag { linear = 1 }
  :solve { substeps = %d }]] },
  ["an action of first order"] = { 4, grid .. [[
return rapid.create { points = start } :gravity {}
  :action("slow", function(p, step) p.v = p.v * (1 - 3 * step.dt) end) :solve { substeps = %d }]] },
  ["edits between the frames"] = { 2, grid .. [[
return rapid.create { points = start } :vortex { strength = 3 } :attract { strength = 2, core = 0.2 }
  :points("edit", function(p)
    p.v = p.v * 0.97 + vec3(0.1, 0, 0)
    p.P = p.P + vec3(0, 0.01, 0)
  end) :solve { substeps = %d }]] },
  births = { 2, [[
return rapid.create { seed = 3 }
  :emit { source = rapid.mesh.sphere { radius = 1 }, rate = 300, speed = 1, life = {0.3, 2} }
  :attract { strength = 6, core = 0.3 } :solve { substeps = %d }]] },
  ["contacts found after the step"] = { 2, grid .. [[
return rapid.create { points = start } :gravity {} :turbulence { amplitude = 2, octaves = 1 }
  :collide { shape = rapid.shape.plane {}, method = "project", bounce = 0.4 } :solve { substeps = %d }]] },
}

local function p95(values)
  table.sort(values)
  return values[math.ceil(0.95 * #values)]
end

local function estimated(text)
  local folder = command.folder()
  folder:write("scene.lua", "local rapid = require 'rapid'\n" .. text)
  local ran = command.rapid(("run scene.lua -f 1-%d --quiet --stats stats.json"):format(last), { cwd = folder.path })
  assert.equal(0, ran.status, ran.stderr)
  return json.decode(folder:read "stats.json").frames[last].error.position_p95
end

describe("the p95 error of a run since birth is within a factor of four of the true one:", function()
  for name, entry in pairs(scenes) do
    it(name, function()
      local substeps, text = entry[1], entry[2]
      local function run(steps) return scene.run(text:format(steps), { frames = {last, last} })[last] end
      local points, right, off = run(substeps), run(32 * substeps), {}
      for i = 1, #points do
        local reference = right:by_id(points[i].id)
        if reference then off[#off + 1] = (points[i].P - reference.P):length() end
      end
      local true_error, reported = p95(off), estimated(text:format(substeps))
      assert.truthy(reported < 4 * true_error and reported > true_error / 4,
        ("it is told as %g m, and is %g m"):format(reported, true_error))
    end)
  end
end)

describe("the drift of the energy of motion", function()
  local function reported(text)
    local folder = command.folder()
    folder:write("scene.lua", "local rapid = require 'rapid'\n" .. text)
    local ran = command.rapid(("run scene.lua -f 1-%d --stats stats.json"):format(last), { cwd = folder.path })
    assert.equal(0, ran.status, ran.stderr)
    local undefined = {}
    local drift = json.decode(folder:read "stats.json", 1, undefined).frames[last].energy_drift
    assert.truthy(drift, "it is there in every frame")
    return drift ~= undefined and drift or nil
  end

  it("is that of each point's velocity and place, since its birth", function()
    local text = [[
local P, v = {}, {}
for i = 1, 50 do P[i] = {1 + i / 50, 0, 0} v[i] = {0, 0, 1.2 / math.sqrt(1 + i / 50)} end
return rapid.create { points = rapid.points.from { P = P, v = v } } :attract { strength = 4 } :gravity {}
  :attract { strength = -1, falloff = 1, core = 0.5, center = {0, 3, 0} }
  :spring { stiffness = 2, target = {1, 1, 1} } :solve {}]]
    local result = scene.run(text, { frames = {1, last} })
    local function energy(p)
      return p.v:dot(p.v) / 2 - 4 / p.P:length() + 9.81 * p.P.y + (p.P - vec3(1, 1, 1)):dot(p.P - vec3(1, 1, 1))
        - 0.5 * math.log((p.P - vec3(0, 3, 0)):dot(p.P - vec3(0, 3, 0)) + 0.25)
    end
    local mean, most = 0, 0
    for i = 1, 50 do
      local drift = energy(result[last][i]) - energy(result[1][i])
      mean, most = mean + drift / 50, math.max(most, math.abs(drift))
    end
    assert.truthy(most > 1e-3)
    local drift = reported(text)
    assert.near(mean, drift.mean, 1e-5)
    assert.near(most, drift.max, 1e-5)
  end)

  it("is none where a closed form moves points, and rounding where they bounce besides, or swing", function()
    local points = "return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.25, "
      .. "center = {0, 2, 0} } } "
    assert.same({ mean = 0, max = 0 }, reported(points .. ":gravity {} :solve {}"))
    for _, chain in ipairs {
      ":gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.7 } :solve {}", -- which removes half of 20 J/kg
      ":gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.7 } :solve { tolerance = 1e-3 }",
      ":spring { stiffness = 1000 } :solve {}",
    } do
      assert.truthy(reported(points .. chain).max < 2e-3, chain) -- of up to 3 kJ/kg, in single precision
    end
  end)

  it("is of those that are born in the run, too, and of each no longer than it lives", function()
    local drift = reported([[
return rapid.create { seed = 3 } :emit { source = rapid.mesh.sphere { radius = 1 }, rate = 3000, life = 0.2 }
  :attract { strength = 6, core = 0.5 } :solve { substeps = 4 }]])
    assert.truthy(drift.max > 1e-6 and drift.max < 1e-2, drift.max)
  end)

  it("is not defined where something else spends energy, or gives it", function()
    for _, node in ipairs { ":drag { linear = 1 }", ":spring { damping = 1 }", ":turbulence {}", ":wind {}",
      ':action("a", function(p, step) p.v = p.v * 0.9 end)', ":interact { radius = 2, drag = 1 }",
      ':points("b", function(p) p.force = vec3(1, 0, 0) end)' } do
      local drift = reported("return rapid.create { points = rapid.points.from { P = {{1, 0, 0}, {1, 1, 0}} } } "
        .. node .. " :solve {}")
      assert.is_nil(drift, node)
    end
  end)
end)

describe("where points act on one another, the error is told, and bits are the same with or without it, by", function()
  for _, nodes in ipairs {
    ":distance { within = 2 } :vortex {}", ":contact { radius = 0.4 } :attract { center = {0.5, 0, 0} }",
    ":clump { radius = 0.6 } :vortex {}", ":pin { compliance = 0.01 }",
    ":interact { radius = 2, separation = 5 } :vortex {}",
  } do
    for _, substeps in ipairs { 1, 4 } do
      it(("%s at %d sub-steps"):format(nodes, substeps), function()
        local text = ("return rapid.create { points = two } :gravity {} %s :solve { substeps = %d }")
          :format(nodes, substeps)
        local run = scene.command("run", text, "-f 1-12 --stats stats.json -o told.##.csv")
        assert.equal(0, run.status, run.stderr)
        assert.match("\nerror    [^\n]*all[%a ]* within [%d.]+ %S*m\n", run.stdout)
        local frames = json.decode(scene.folder:read "stats.json").frames
        assert.truthy(frames[12].error.position_max > 1e-6, frames[12].error.position_max)
        assert.falsy(frames[12].left_out_of_errors)
        run = scene.command("run", text, "-f 1-12 --quiet -o untold.##.csv")
        assert.equal(0, run.status, run.stderr)
        assert.equal(scene.folder:read "told.12.csv", scene.folder:read "untold.12.csv")
      end)
    end
  end
end)

describe("of more than 1,000 points that act on one another", function()
  local text = [[
local P, v = {}, {}
for i = 1, 1100 do P[i], v[i] = {0.1 * (i %% 11), 0.1 * math.floor(i / 11), 0}, {math.sin(i), math.cos(i), 0} end
return rapid.create { points = rapid.points.from { P = P, v = v } } :gravity {}
  :contact { radius = 0.05, friction = 0.2 } :solve { substeps = %d, sleep = math.huge }]]

  it("the error is the same on any number of threads", function()
    local found = {}
    for i, threads in ipairs { 1, 2, 7 } do
      local run = scene.command("run", text:format(4), "-f 1-9 --quiet --stats stats.json --threads " .. threads)
      assert.equal(0, run.status, run.stderr)
      found[i] = json.decode(scene.folder:read "stats.json").frames[9].frame_error
      assert.same(found[1], found[i])
    end
    assert.truthy(found[1].position_max > 0)
  end)

  it("the error of a frame is estimated within a factor of four in frames 1, 2, 4, 8, ... and each 40th", function()
    local run = scene.command("run", text:format(4), "-f 1-42 --stats stats.json")
    assert.equal(0, run.status, run.stderr)
    assert.match("\nerror    from substeps: [^\n]+, in one frame %(7 of 42 estimated%); not estimated: the sum " ..
      "since birth,"
      .. " as more than 1,000 points act on one another\n", run.stdout)
    for _, frame in ipairs(json.decode(scene.folder:read "stats.json").frames) do
      assert.falsy(frame.error)
      local n = frame.frame - 1 -- of those that are solved
      local due = n == 1 or n == 2 or n == 4 or n == 8 or n == 16 or n == 32 or n == 40
      assert.equal(due, frame.frame_error ~= nil, frame.frame)
    end
    local reported = json.decode(scene.folder:read "stats.json").frames[2].frame_error.position_p95
    local found, truth = scene.run(text:format(4), { frames = {2, 2} })[2],
      scene.run(text:format(256), { frames = {2, 2} })[2]
    local off = {}
    for i = 1, #found do off[i] = (found[i].P - truth[i].P):length() end
    local real = p95(off)
    assert.truthy(reported < 4 * real and reported > real / 4,
      ("it is told as %g m, and is %g m"):format(reported, real))
  end)
end)

describe("the summary names what the error leaves out:", function()
  local unmeasured = "; twice the substeps give the same positions within rounding\n"

  local function reported(nodes)
    local run = scene.command("run", "return rapid.create { points = two } " .. nodes, "-f 1-4 --stats stats.json")
    assert.equal(0, run.status, run.stderr)
    return run.stdout, json.decode(scene.folder:read "stats.json").frames[4].left_out_of_errors
  end

  it("functions of the frame that are held through it", function()
    local nodes = ":collide { name = 'wall', shape = rapid.shape.plane {}, response = %s } :solve {}"
    local text, left_out = reported(nodes:format "function(f) return f.time > 1 and 'slide' or 'bounce' end")
    assert.match("not estimated: wall.response, a function of the frame that is called once in each" .. unmeasured,
      text)
    assert.same({ "wall.response, a function of the frame that is called once in each" }, left_out)
    for _, in_it in ipairs { ":wind { velocity = function(f) return {f.time, 0, 0} end }",
      ":interact { radius = 2, separation = function(f) return f.time end }",
      ":contact { radius = 0.6, friction = function(f) return f.time end }" } do
      assert.is_nil(select(2, reported(in_it .. " :solve {}")), in_it)
    end
  end)

  it("kicks among neighbours that are at the ends of frames", function()
    local text = reported ":interact { name = 'flock', radius = 2, separation = 5 } :solve { tolerance = 1e-3 }"
    assert.match("not estimated: flock, whose kicks with a tolerance are at the ends of frames" .. unmeasured, text)
  end)

  it("and nothing where there is nothing", function()
    for _, nodes in ipairs { ":gravity {} :solve {}", ":gravity {} :contact { radius = 0.1 } :solve {}" } do
      local text, left_out = reported(nodes)
      assert.falsy(text:find("not estimated", 1, true), text)
      assert.is_nil(left_out)
    end
  end)
end)
