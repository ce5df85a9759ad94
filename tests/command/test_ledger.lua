-- The ledger of constrained points, in --stats, against closed forms.
local command = require "testing.command"
local json = require "dkjson"

-- Returns the change of energy by cause over the frames from `first` to 25, and the ledger of frame 25.
local function ledger(text, first)
  local folder = command.folder()
  folder:write("scene.lua", 'local rapid = require "rapid"\nreturn rapid.create { fps = 24, points = ' .. text)
  local result = command.rapid("run scene.lua -f 1-25 --stats stats.json", { cwd = folder.path })
  assert.equal(0, result.status, result.stderr)
  local sums, last = {}, nil
  for _, frame in ipairs(json.decode(folder:read "stats.json").frames) do
    for name, value in pairs(frame.frame >= (first or 1) and frame.ledger or {}) do
      if name:find "^by_" then sums[name] = (sums[name] or 0) + value end
    end
    last = frame.ledger
  end
  return sums, last
end

-- Checks the sums over one second; all that are not named are 0.
local function check(expected, sums, tolerance)
  for name, value in pairs(sums) do assert.near(expected[name] or 0, value, tolerance, name) end
  for name in pairs(expected) do assert.truthy(sums[name], name) end
end

local g = 9.81

describe("the ledger", function()
  it("has (1 - e²) m v²/2 of a bounce", function()
    local sums, last = ledger [[rapid.points.from { P = {{0, 1, 0}}, v = {{0.5, -4, 0}} } }
  :attribute { mass = 3 } :collide { shape = rapid.shape.plane {}, bounce = 0.6 }
  :contact { radius = 0.1 } :solve { substeps = 2 }]]
    local lost = (1 - 0.6 ^ 2) * 3 * 4 ^ 2 / 2
    check({ by_contacts = -lost }, sums, 1e-4)
    assert.near(3 / 2 * (0.5 ^ 2 + (0.6 * 4) ^ 2), last.kinetic, 1e-4)
  end)

  it("has μ m g cos d of a slide, as friction where forces are recorded", function()
    local angle, mu, mass = 0.6, 0.3, 2
    local text = ([[rapid.points.from { P = { 0.1 * vec3(%.9g, %.9g, 0) } } }
  :attribute { mass = %g } :gravity {} :contact { radius = 0.1, RECORD } :collide { bounce = 0, friction = %g,
    shape = rapid.shape.plane { normal = {%.9g, %.9g, 0} } } :solve { substeps = 4 }]]):format(math.sin(angle),
      math.cos(angle), mass, mu, math.sin(angle), math.cos(angle))
    local way = g * (math.sin(angle) - mu * math.cos(angle)) / 2
    local lost = mu * mass * g * math.cos(angle) * way
    check({ by_friction = -lost, by_shapes = 0 }, (ledger(text:gsub("RECORD", "record = true"))), 1e-4 * lost)
    check({ by_contacts = -lost }, (ledger(text:gsub("RECORD", ""))), 1e-4 * lost)
  end)

  it("has the integral of drag, while a point falls, too", function()
    local k, mass = 2, 1.5
    local sums = ledger [[rapid.points.from { P = {{0, 9, 0}}, v = {{3, 0, 0}} } } :attribute { mass = 1.5 }
  :drag { linear = 2 } :contact { radius = 0.1 } :solve { substeps = 3 }]]
    check({ by_drag = mass / 2 * 9 * (math.exp(-2 * k) - 1) }, sums, 1e-5)

    sums = ledger [[rapid.points.from { P = {{0, 9, 0}} } } :attribute { mass = 1.5 }
  :gravity {} :drag { linear = 2 } :contact { radius = 0.1 } :solve { substeps = 3 }]]
    local fall = (1 - 2 * (1 - math.exp(-k)) / k + (1 - math.exp(-2 * k)) / (2 * k)) -- ∫ (1 - e^(-kt))²
    check({ by_drag = -mass * k * (g / k) ^ 2 * fall }, sums, 1e-4)
  end)

  it("has the energy of a spring to a surface, which its damping takes, as drag", function()
    local sums = ledger [[rapid.points.from { P = {{1.4, 0, 0}} } } :attribute { mass = 1.5 }
  :spring { target = rapid.shape.sphere { radius = 1 }, stiffness = 2000, damping = 60 }
  :contact { radius = 0.1 } :solve { substeps = 3 }]]
    local stored = 2000 / 2 * 0.4 ^ 2
    check({ by_drag = -stored, by_motion = stored }, sums, 1e-3 * stored)
  end)

  it("has m g h of what sticks to a shape that jumps", function()
    local sums = ledger([[rapid.points.from { P = {{0, 0.1, 0}} } } :attribute { mass = 3 } :gravity {}
  :collide { response = "stick", bounce = 0, cut = {9},
    shape = rapid.shape.box { size = {2, 2, 2}, center = {0, -1, 0} },
    transform = function(frame) return rapid.translate(0, frame.number >= 9 and 0.7 or 0, 0) end }
  :contact { radius = 0.1 } :solve { substeps = 4 }]], 4)
    check({ by_contacts = 3 * g * 0.7 }, sums, 1e-4 * 3 * g)
  end)

  it("has nothing of shapes that rigid pins hold points against, awake or asleep", function()
    for _, sleep in ipairs { 0.1, math.huge } do
      local sums = ledger(([[rapid.points.from { P = {{0, 0.2, 0}, {1, 0.2, 0}}, held = {1, 0} } }
  :group { name = "held", where = function(p) return p.held == 1 end }
  :pin { group = "held" } :distance { pairs = {{1, 2}}, compliance = 1e-6 } :contact { radius = 0.01 }
  :collide { shape = rapid.shape.sphere { radius = 0.5 }, group = "held",
    transform = function(f) return rapid.translate(0, f.number > 12 and 0.1 or (12 - f.number) / 12, 0) end }
  :solve { substeps = 4, sleep = %g }]]):format(sleep))
      check({}, sums, 1e-9)
    end
  end)

  it("has no more of drag than drag takes, where a method puts a point back after the step", function()
    for _, method in ipairs { "project", "backtrack" } do
      local sums = ledger(([[rapid.points.from { P = {{0, 0.5, 0}}, v = {{1, -4, 0}} } }
  :drag { linear = 0.5 } :collide { shape = rapid.shape.plane {}, bounce = 0, method = %q }
  :contact { radius = 0.1 } :solve {}]]):format(method))
      assert.near(0, sums.by_motion, 1e-4, method)
      assert.truthy(sums.by_drag < 0 and sums.by_contacts < -5, method)
    end
  end)

  it("has what restitution and friction take of an oblique impact, apart", function()
    -- They touch along x: p = (1 + e) 4/W, q = μ p, W = 1 + 1/3.
    local sums = ledger [[rapid.points.from { P = {{-0.3, -0.075, 0}, {0, 0, 0}}, v = {{4, 3, 0}, {0, 0, 0}},
    mass = {1, 3} } } :contact { radius = 0.1, bounce = 0.5, friction = 0.2, record = true } :solve { substeps = 2 }]]
    local q = 0.2 * 1.5 * 4 * 0.75
    local normal, friction = -0.75 / 2 * 16 * (1 - 0.5 ^ 2), -q * 3 + q ^ 2 / 2 / 0.75
    check({ by_contacts = normal, by_friction = friction, by_shapes = 0 }, sums, 1e-5)
  end)

  it("has what a shape puts into the spring of a point that sticks to it", function()
    local sums = ledger [[rapid.points.from { P = {{0, 0, 0}, {0, 2, 0}} } } :group { name = "held",
  where = function(p) return p.id == 1 end } :pin { group = "held" } :distance { pairs = {{1, 2}}, compliance = 2e-4 }
  :collide { shape = rapid.shape.plane {}, bounce = 0, response = "stick",
    transform = function(frame) return rapid.translate(0, -0.5 * frame.time ^ 2, 0) end } :solve { substeps = 4 }]]
    check({ by_contacts = 5000 / 2 * 0.25 + 0.5 }, sums, 0.01)
  end)

  it("has what a shape drives by a rod from a point that sticks to it, as contacts where there is no pin", function()
    local sums = ledger [[rapid.points.from { P = {{0, 0, 0}, {0, 1, 0}} } } :attribute { mass = 2 }
  :distance { pairs = {{1, 2}} } :collide { shape = rapid.shape.plane {}, bounce = 0, response = "stick",
    transform = function(frame) return rapid.translate(0, 0.5 * frame.time ^ 2, 0) end } :solve { substeps = 4 }]]
    check({ by_contacts = 2 * 2 / 2 }, sums, 1e-3) -- m v²/2 of both, at 1 m/s
  end)

  it("has m g h of a floor that lifts, as the work of shapes", function()
    local sums = ledger([[rapid.points.from { P = {{0, 0.1, 0}}, v = {{0, 0.5, 0}} } } :attribute { mass = 3 }
  :gravity {} :contact { radius = 0.1, record = true } :collide { bounce = 0, shape = rapid.shape.plane {},
    transform = function(frame) return rapid.translate(0, 0.5 * frame.time, 0) end } :solve { substeps = 4 }]], 4)
    local h = 0.5 * 22 / 24
    check({ by_shapes = 3 * g * h, by_friction = 0 }, sums, 1e-3 * 3 * g * h)
  end)

  it("has what pins put into springs, where they jump, hold a point twice, or draw it against a force", function()
    local spring = 5000 -- N/m
    for name, case in pairs {
      ["a jump"] = [[:pin { group = "held", target = {-0.5, 0.6, 0.9} }
  :distance { pairs = {{1, 2}}, compliance = 1 / 5000 }]],
      ["two pins"] = [[:pin { group = "held", compliance = 1 / 5000 }
  :pin { group = "held", transform = function(frame) return rapid.translate(0, 0.5 * frame.time, 0) end }]],
      ["a force"] = [[:spring { stiffness = 5000, target = {0, 0, 0}, group = "held" } :pin { group = "held",
  transform = function(frame) return rapid.translate(0, 0.5 * frame.time, 0) end }]],
    } do
      local sums = ledger([[rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}} } } :group { name = "held",
  where = function(p) return p.id == 0 end } ]] .. case .. " :solve { substeps = 4 }")
      if name == "a jump" then

        local stretch = (vec3(-0.5, 0.6, 0.9) - vec3(1, 0, 0)):length() - 1
        assert.near(spring / 2 * stretch ^ 2, sums.by_pins, 0.01 * spring * stretch ^ 2, name)
        assert.near(0, sums.by_motion, 1e-3 * spring, name)
      else
        assert.near(spring / 2 * 0.25, sums.by_pins, 1e-3 * spring, name)
        assert.near(name == "a force" and -spring / 2 * 0.25 or 0, sums.by_motion, 1e-3 * spring, name)
      end
    end
  end)

  it("has m g h of a pin that lifts, and of what hangs from it", function()
    local text = [[rapid.points.from { P = {{0, 0, 0}, {0, -1, 0}}, v = {{0, 0.5, 0}, {0, 0.5, 0}} } }
  :attribute { mass = 2 } :gravity {} ROD :group { name = "held", where = function(p) return HELD end }
  :pin { group = "held", transform = function(frame) return rapid.translate(0, 0.5 * frame.time, 0) end }
  :solve { substeps = 4 }]]
    local h = 0.5 * 22 / 24
    for _, case in ipairs { { ":distance { pairs = {{1, 2}} }", "p.id == 0" }, { "", "true" } } do
      local sums = ledger(text:gsub("ROD", case[1]):gsub("HELD", case[2]), 4)
      check({ by_pins = 4 * g * h }, sums, 1e-4 * 4 * g * h)
    end
  end)
end)
