-- The load of a column of grain on the floor of a square silo with rough walls: Janssen's law. The floor consists of
-- grains on compliant pins, whose displacement gives the load. It descends by half a grain per second, so that the
-- friction of the walls acts upwards everywhere (Bertho, Giorgiutti-Dauphiné, Hulin 2003). The grains rotate, as the
-- law assumes.
local scene = require "testing.scene"

local give, sinking, friction = 1e-3, 0.01, 0.3  -- m/N; m/s, from 3 s on; friction of the walls
local width, g = 0.2, 9.81 -- m

local silo = [[
local layers, d, a = rapid.param("layers", 20, "of grain at first"), 0.02, 0.2
local friction, give = rapid.param("friction", 0.3, "of the walls"), rapid.param("give", 1e-3, "of the floor, m/N")
local sinking = rapid.param("sinking", 0.01, "of the floor, m/s")
local P, pscale, mass, floor = {}, {}, {}, {}
local function grain(x, y, z, r, is_floor)
  P[#P + 1], pscale[#P + 1], mass[#P + 1], floor[#P + 1] = {x, y, z}, r, 2500 * 4 / 3 * math.pi * r ^ 3, is_floor
end
for i = 0, 9 do
  for j = 0, 9 do grain((i + 0.5) * d - a / 2, -d / 2, (j + 0.5) * d - a / 2, d / 2, 1) end
end
for k = 0, 81 * layers - 1 do
  local i, j, layer = k % 9, math.floor(k / 9) % 9, math.floor(k / 81)
  grain(a * ((i + 0.5) / 9 - 0.5), 1.06 * d * (layer + 0.5), a * ((j + 0.5) / 9 - 0.5),
    d / 2 * (0.85 + 0.3 * ((k * 0.618034) % 1)), 0)
end
local grains = rapid.points.from { P = P, pscale = pscale, mass = mass, floor = floor }
local chain = rapid.create { fps = 24, points = grains }
  :points("shake", function(p, frame)
    if frame.number == 2 and p.floor == 0 then p.v = vec3(p:rand(1) - 0.5, p:rand(2) - 0.5, p:rand(3) - 0.5) / 2 end
  end)
  :group { name = "floor", where = function(p) return p.floor == 1 end }
  :group { name = "sand", where = function(p) return p.floor == 0 end }
  :gravity { group = "sand" }
for _, normal in ipairs { {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1} } do
  chain = chain:collide { group = "sand", bounce = 0, friction = friction,
    shape = rapid.shape.plane { normal = normal, offset = -a / 2 } }
end
return chain
  :pin { group = "floor", compliance = give,
    transform = function(f) return rapid.translate(0, -sinking * math.max(0, f.time - 3), 0) end }
  :contact { friction = 0.3, spin = true }
  :solve { substeps = 12, iterations = 4, sleep = math.huge }]]

-- Returns the height, weight and floor load for this number of layers, averaged over the fifth second, in m and N.
local function loads(layers)
  local result = scene.run(silo, { frames = {97, 120},
    set = { layers = layers, friction = friction, give = give, sinking = sinking } })
  local load, top, bottom, weight = 0, 0, 0, nil
  for frame, points in result:frames() do
    local floor = -sinking * ((frame - 1) / 24 - 3)
    weight = 0
    for i = 1, #points do
      local p = points[i]
      if p.floor == 1 then load = load + (floor - 0.01 - p.P.y) / give / 24 else weight = weight + p.mass * g end
    end
    top, bottom = top + points:max("P").y / 24, bottom + floor / 24
  end
  return { height = top - bottom, weight = weight, load = load }
end

-- Returns Janssen's load of a column, given the length over which the walls support it.
local function janssen(column, length)
  return column.weight / column.height * length * (1 - math.exp(-column.height / length))
end

local function worst(columns, length)
  local most = 0
  for _, column in ipairs(columns) do most = math.max(most, math.abs(column.load / janssen(column, length) - 1)) end
  return most
end

-- The columns and the best-fitting length, measured once.
local measured
local function fit()
  if measured then return unpack(measured) end
  local columns, best = {}, width
  for i, layers in ipairs { 10, 20, 40, 60 } do columns[i] = loads(layers) end
  for step = 1, 500 do
    local length = width * step / 50
    if worst(columns, length) < worst(columns, best) then best = length end
  end
  measured = { columns, best }
  return columns, best
end

return {
  {
    feature = "contact, collide", law = "load on the floor of a silo, 0.9 to 4.5 widths high: error of the best fit",
    reference = "Janssen 1895", at_most = 0.15, long = true,
    measure = function() return worst(fit()) end,
  },
  {
    feature = "contact, collide", law = "the same: ratio of the stress on the walls to the vertical one, by that fit",
    reference = "1/3 (Rankine) to 1", at_least = 1 / 3, at_most = 1, long = true,
    measure = function()
      local _, length = fit()
      return width / (4 * friction * length)
    end,
  },
}
