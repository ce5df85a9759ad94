-- Level sets from sequences of files: between two files, surfaces follow straight lines in time.
local amount = require "tests.amount"
local scene = require "testing.scene"

local voxel = 0.02

-- Balls in files first, first + step, ..., last: radius(frame), center(frame).
local function write_balls(name, first, last, step, radius, center)
  local lines = {}
  for file = first, last, step do
    lines[#lines + 1] = ([[rapid.levelset.sphere { radius = %.9g, center = {%.9g, 0, 0}, voxel = %g }:write(%q)]])
      :format(radius(file), center(file), voxel, ("%s.%04d.vdb"):format(name, file))
  end
  local made = scene.command("run", table.concat(lines, "\n") ..
    "\nreturn rapid.create { points = two } :solve {}", "-f 1 --quiet")
  assert.equal(0, made.status, made.stderr)
end

local growth, speed = 0.6, 0.96 -- m/s
local function grown(frame) return 0.3 + growth * (frame - 1) / 24 end
local function gone(frame) return speed * (frame - 1) / 24 end
write_balls("grow", 1, 9, 1, grown, function() return 0 end)
write_balls("gaps", 1, 9, 4, grown, function() return 0 end)
write_balls("move", 1, 9, 1, function() return 0.3 end, gone)

-- Eight points around the ball, or one per direction.
local function run(shape, P, chain, frame, options)
  options = options or {}
  return scene.run(([[
local ball = rapid.levelset.read(%q, { %s })
return rapid.create { fps = 24, points = rapid.points.from { P = {%s}, v = {%s}, pscale = {%s} } }
  %s :solve { substeps = %d }]]):format(shape, options.read or "", P, options.v or "{0, 0, 0}",
    options.pscale or "0", chain, options.substeps or 1), { frames = {1, frame}, threads = options.threads })
end

local bounce = ":collide { shape = ball, bounce = %g, friction = 0 }"
-- Error of a ball's level set: a few times the sag of a straight line over a voxel.
local sag = 3 * voxel * voxel / (8 * 0.3)
-- Error of its normal: its turn over a voxel.
local turn = voxel / 0.3

describe("a level set that grows in a sequence of files", function()
  it("meets a point at rest when and where the ball does, and throws it off", function()
    local directions = { {1 / 3, 2 / 3, -2 / 3}, {1, 0, 0}, {0, -1, 0}, {0.6, 0, 0.8} }
    for _, name in ipairs { "grow", "gaps" } do
      for k = 1, amount.thorough and #directions or 1 do
        local direction = directions[k]
        local x, y, z = direction[1] * 0.4, direction[2] * 0.4, direction[3] * 0.4
        for _, how in ipairs { { 1, 1 }, { 0.25, 4 } } do
          local restitution, substeps = how[1], how[2]
          local p = run(name .. ".####.vdb", ("{%.9g, %.9g, %.9g}"):format(x, y, z), bounce:format(restitution), 8,
            { substeps = substeps })[8][1]
          -- Met at 0.1 m / growth; afterwards it moves with (1 + restitution) times the speed of the surface.
          local time = 7 / 24 - 0.1 / growth
          local away = (1 + restitution) * growth
          assert.near(away, p.v:length(), turn * away)
          assert.near(0.4 + away * time, p.P:length(), sag + turn * away * time)
          assert.near(1, (p.P.x * direction[1] + p.P.y * direction[2] + p.P.z * direction[3]) / p.P:length(), turn ^ 2)
        end
      end
    end
  end)

  it("carries points with a radius that stick to it or rest on it", function()
    for _, response in ipairs { "stick", "bounce" } do
      local p = run("gaps.####.vdb", "{0, 0.4, 0}",
        (response == "bounce" and ":gravity { g = {0, -5, 0} }" or "") ..
        (":collide { shape = ball, bounce = 0, response = %q }"):format(response), 9, { pscale = "0.03", substeps = 2 })
      for frame = 6, 8 do
        local at = p[frame][1]
        assert.near(grown(frame) + 0.03, at.P.y, sag + 1e-3)
        assert.near(growth, at.v.y, 0.03 * growth)
      end
    end
  end)

  it("gives kernels its distance, gradient and velocity", function()
    local p = run("grow.####.vdb", "{0, 0.35, 0}", [[:attribute { d = 0, u = {0, 0, 0}, n = {0, 0, 0} }
  :points("ask", function(p) p.d, p.u, p.n = ball:distance(p.P), ball:velocity(p.P), ball:gradient(p.P) end)]], 5)
    for frame = 2, 5 do
      assert.near(0.35 - grown(frame), p[frame][1].d, sag)
      assert.near({0, growth, 0}, p[frame][1].u, turn * growth)
      assert.near({0, 1, 0}, p[frame][1].n, turn)
    end
  end)

  it("holds before its first file and after its last, at rest", function()
    local stick = ":gravity {} :collide { shape = ball, response = 'stick' }"
    local p = run("grow.####.vdb", "{0, 0.6, 0}", stick, 48)[48][1]
    assert.near(grown(9), p.P.y, sag)
    assert.near({0, 0, 0}, p.v, 1e-6)
    p = run("grow.####.vdb", "{0, 0.32, 0}", bounce:format(0), 6, { read = "offset = 10" })[6][1]
    assert.near({0, 0.32, 0}, p.P, 1e-7)
  end)
end)

describe("a level set that moves in a sequence of files", function()
  it("pushes points in front of it, and leaves points behind it at rest", function()
    local result = run("move.####.vdb", "{0.4, 0, 0}, {-0.31, 0, 0}", bounce:format(1), 9,
      { v = "{0, 0, 0}, {0, 0, 0}", pscale = "0, 0" })
    local time = 8 / 24 - 0.1 / speed
    local p = result[9]:by_id(0)
    assert.near(2 * speed, p.v.x, 0.04 * speed)
    assert.near(0.4 + 2 * speed * time, p.P.x, 0.01)
    assert.near({-0.31, 0, 0}, result[9]:by_id(1).P, 1e-7)
  end)

  it("lets no point in that it sweeps over, on any number of threads", function()
    local text = [[
local ball = rapid.levelset.read "move.####.vdb"
return rapid.create { fps = 24, points = rapid.points.grid { size = {1.2, 0.9, 0.9}, spacing = 0.06,
    center = {0.9, 0, 0} } }
  :collide { shape = ball, bounce = 0.3 } :solve {}]]
    local result = scene.run(text, { frames = {1, 9}, threads = 1 })
    local swept = 0
    for frame = 2, 9 do
      local points = result[frame]
      for i = 1, #points do
        local P = points[i].P
        local distance = math.sqrt((P.x - gone(frame)) ^ 2 + P.y ^ 2 + P.z ^ 2) - 0.3
        assert.is_true(distance > -sag, distance)
        if points[i].v:length() > 0 then swept = swept + 1 end
      end
    end
    assert.is_true(swept > 100, swept)
    for _, threads in ipairs { 2, 5 } do
      assert.same_points(result[9], scene.run(text, { frames = {9, 9}, threads = threads })[9])
    end
  end)

  it("jumps where it goes farther than half of its size: nothing is swept along", function()
    write_balls("leap", 1, 3, 1, function() return 0.3 end, function(file) return 2 * file end)
    local result = run("leap.####.vdb", "{3, 0, 0}, {4.27, 0, 0}", bounce:format(0), 3,
      { v = "{0, 0, 0}, {0, 0, 0}", pscale = "0, 0" })
    assert.near({3, 0, 0}, result[3]:by_id(0).P, 0)
    assert.near(0.3, math.abs(result[2]:by_id(1).P.x - 4), sag)
  end)
end)

describe("a sequence of level sets as a value", function()
  it("emits points from the file of the frame, and can be called by other functions", function()
    local text = [[
local ball = rapid.levelset.read "grow.####.vdb"
return rapid.create { fps = 24 } :emit { source = %s, count = 40, birth = "end", life = 0.03 } :solve {}]]
    local late = "function(frame) return ball { number = frame.number + 2 } end"
    local now = scene.run(text:format "ball", { frames = {2, 6} })
    local later = scene.run(text:format(late), { frames = {2, 6} })
    for frame = 2, 6 do
      for i = 1, 40 do
        assert.near(grown(frame), now[frame][i].P:length(), sag)
        assert.near(grown(frame + 2), later[frame][i].P:length(), sag)
      end
    end
  end)

  it("reports wrong arguments", function()
    assert.matches('frame 2 of "gaps.####.vdb" is missing', scene.error [[
return rapid.create {} :emit { source = rapid.levelset.read "gaps.####.vdb", count = 1 } :solve {}]], 1, true)
    assert.matches("a mesh can't be called", scene.error "rapid.mesh.sphere {} {}", 1, true)
  end)
end)
