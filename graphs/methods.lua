-- methods: a sheet of grains meets a floor, by each of the three methods (figures 3 and 4 of the paper).
--
-- Left, "project": a point below the floor after a step is moved onto the floor, which makes the steps of figure 3.
-- Middle, "backtrack": it is first moved back to the floor, as in figure 4. Right, "continuous": it hits on its path.
--
-- Shows:  method, and a collider for a group.
-- Proves: continuous keeps the sheet's rows apart to rounding, backtrack to one step's fall, and project does not
--         (tests/graphs/test_methods.lua).
-- Run:    rapid run graphs/methods.lua -f 1-14 --camera 2.9,1.1,5.4,2.9,0.75,0 -o /tmp/methods.####.png
local rapid = require "rapid"

local methods = { "project", "backtrack", "continuous" }
local columns, rows, apart, lane = 30, 44, 0.028, 2

-- Each row is born above the one before it, and follows the same path later.
local P, v, Cd, of = {}, {}, {}, {}
for k = 1, #methods do
  for row = 1, rows do
    for column = 1, columns do
      P[#P + 1] = {lane * (k - 1) + apart * column, 1.7 + apart * row, 0}
      v[#v + 1] = {1.4, -11, 0}
      Cd[#Cd + 1] = {0.95 - 0.7 * row / rows, 0.45, 0.2 + 0.75 * row / rows}
      of[#of + 1] = k
    end
  end
end

local scene = rapid.create { fps = 24, points = rapid.points.from { P = P, v = v, Cd = Cd, of = of } }
  :gravity {}
-- Deeper and wider than a step goes, so that the nearest way out is the top.
local floor = rapid.levelset.box { size = {7.4, 1.3, 1.3}, center = {2.8, -0.65, 0}, voxel = 0.03 }
for k, method in ipairs(methods) do
  scene = scene
    :group   { name = method, where = function(p) return p.of == k end }
    :collide { group = method, shape = floor, method = method, bounce = 0.6 }
end
return scene:solve {}
