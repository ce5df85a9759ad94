-- The audit of collisions in --stats: contacts, the deepest penetration, and energy.
local scene = require "testing.scene"
local json = require "dkjson"

local g = 9.81

-- Runs of the given columns through `chain`. Returns the audit of all frames, and the last frame's points by id.
local function audit(points, chain, frames)
  local ran = scene.command("run", ([[
return rapid.create { fps = 24, points = rapid.points.from { %s } } %s]]):format(points, chain),
    ("-f 1-%d --stats s.json -o a.####.csv"):format(frames))
  assert.equal(0, ran.status, ran.stderr)
  local sum = { contacts = 0, deepest = 0, added = 0, lost = 0, points = {} }
  for _, frame in ipairs(json.decode(scene.folder:read "s.json").frames) do
    sum.contacts = sum.contacts + frame.collisions
    sum.deepest = math.max(sum.deepest, frame.penetration_max)
    sum.added = sum.added + frame.contact_energy.added
    sum.lost = sum.lost + frame.contact_energy.lost
  end
  local names
  for line in scene.folder:read(("a.%04d.csv"):format(frames)):gmatch "[^\n]+" do
    local cells = {}
    for cell in line:gmatch "[^,]+" do cells[#cells + 1] = cell end
    if names then
      local point = {}
      for i, name in ipairs(names) do point[name] = tonumber(cells[i]) end
      sum.points[point.id] = point
    else
      names = cells
    end
  end
  return sum
end

local function energy(point, mass)
  local y, vx, vy, vz = point.Py, point.vx, point.vy, point.vz
  return mass * (0.5 * (vx * vx + vy * vy + vz * vz) + g * y)
end

describe("the audit of collisions", function()
  local shapes = {
    plane = "rapid.shape.plane {}",
    box = "rapid.shape.box { size = {4, 1, 4}, center = {0, -0.5, 0} }",
    ["level set"] = "rapid.levelset.box { size = {4, 1, 4}, center = {0, -0.5, 0}, voxel = 0.05 }",
  }
  for name, shape in pairs(shapes) do
    it("has the energy that one bounce takes, 1 - bounce² of it: " .. name, function()
      for _, substeps in ipairs { 1, 4 } do
        local sum = audit("P = {{0.1, 2, 0.1}}, mass = {3}", (":gravity {} :collide { shape = %s, bounce = 0.7 } "
          .. ":solve { substeps = %d }"):format(shape, substeps), 30)
        assert.equal(1, sum.contacts)
        assert.near(3 * g * 2 * (1 - 0.49), sum.lost, 1e-3)
        assert.near(0, sum.added, 1e-4)
        assert.equal(0, sum.deepest)
      end
    end)
  end

  it("has the work of a wall that strikes", function()
    local sum = audit("P = {{0.4, 0, 0}}, mass = {2}", [[:collide { shape = rapid.shape.plane { normal = {1, 0, 0} },
      bounce = 0.5, transform = function(frame) return rapid.translate(2 * frame.time, 0, 0) end } :solve {}]], 25)
    assert.near(0.5 * 2 * (1.5 * 2) ^ 2, sum.added, 1e-3)
    assert.near(0, sum.lost, 1e-6)
  end)

  it("balances: the energy gained by the points is what the method added minus what it removed", function()
    for _, method in ipairs { "continuous", "project", "backtrack" } do
      local sum = audit("P = {{0, 1, 0}, {3, 0.5, 0}}, v = {{0, 0, 0}, {0.5, 3, 0}}",
        (":gravity {} :collide { shape = rapid.shape.plane {}, bounce = 1, method = %q } :solve {}"):format(method), 97)
      local gained = energy(sum.points[0], 1) - g * 1 + energy(sum.points[1], 1) - (g * 0.5 + 0.5 * 9.25)
      assert.near(gained, sum.added - sum.lost, 2e-4)
      if method == "continuous" then
        assert.truthy(sum.added + sum.lost < 1e-3, sum.added + sum.lost)
      elseif method == "project" then
        assert.truthy(sum.added + sum.lost > 0.1, sum.added + sum.lost)
      end
    end
  end)

  it("has the energy that a point without bounce loses, and nothing of free points", function()
    local met = audit("P = {{0, 2, 0}}", ":gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0 } :solve {}",
      30)
    assert.near(9.81 * 2, met.lost, 1e-3)
    assert.equal(0, met.added)
    assert.equal(1, met.contacts)
    assert.equal(0, met.deepest)
    local free = audit("P = {{0, 2, 0}}", ":gravity {} :solve {}", 4)
    for _, name in ipairs { "lost", "added", "contacts" } do assert.equal(0, free[name]) end
  end)
end)

-- Points born at a random time, while a collider sweeps over their emitter, meet it from then on.
describe("a collider that sweeps over an emitter", function()
  for _, speed in ipairs { 12, 48, 96 } do -- m/s
    it(("leaves none of the newborn inside, at %d m/s"):format(speed), function()
      -- Back and forth by 4 m, turning at positions clear of the emitter.
      local result = scene.run(([[
local function along(time)
  local phase = (%d * time / 4) %% 2
  return phase < 1 and -2 + 4 * phase or 6 - 4 * phase
end
return rapid.create { fps = 24, seed = 5 }
  :emit { source = rapid.mesh.box { size = {0.2, 1, 1} }, from = "volume", rate = 48000, birth = "random", life = 0.5 }
  :collide { shape = rapid.levelset.sphere { radius = 0.8, voxel = 0.05 }, bounce = 0.3,
    transform = function(frame) return rapid.translate(along(frame.time), 0, 0) end }
  :solve {}
  :attribute { inside = 0 }
  :points("measure", function(p, frame)
    p.inside = 0.8 - (p.P - vec3(along(frame.time), 0, 0)):length()
  end)]]):format(speed), { frames = {1, 25} })
      local newborn = 0
      for _, points in result:frames() do
        if #points > 0 then
          newborn = newborn + #points
          -- The error of the level set's sphere is at most voxel² / (8 r): 0.4 mm.
          assert.truthy(points:max "inside" < 1e-3, points:max "inside")
        end
      end
      assert.truthy(newborn > 20000)
    end)
  end
end)
