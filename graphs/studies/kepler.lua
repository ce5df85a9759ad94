-- kepler: a thousand ellipses about one sun, round and long, compared with Kepler's equation.
--
-- Shows:  why each point chooses its own sub-steps. With a fixed number, the points that pass close to the sun need
--         many, and all others take them too; with a tolerance each takes its own.
-- Proves: by sub-steps the order is 2; by tolerance each increase of the effort reduces the error
--         (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/kepler.lua -o /tmp/kepler
local rapid = require "rapid"

local count, strength, a = 1000, 4, 1 -- m³/s², m
local period = 2 * math.pi * math.sqrt(a ^ 3 / strength)

local function eccentricity(i) return 0.8 * i / count end

-- Returns the eccentric anomaly E of E - e sin E = M, by Newton's method.
local function anomaly(e, M)
  local E = M + e * math.sin(M)
  for _ = 1, 20 do E = E - (E - e * math.sin(E) - M) / (1 - e * math.cos(E)) end
  return E
end

-- Each point starts at its aphelion, the point of its ellipse farthest from the sun.
local function on_ellipses(time)
  local P, v = {}, {}
  for i = 1, count do
    local e = eccentricity(i)
    local b = a * math.sqrt(1 - e ^ 2)
    local E = anomaly(e, math.pi + 2 * math.pi * time / period)
    local turning = 2 * math.pi / period / (1 - e * math.cos(E)) -- rate of E, rad/s
    P[i] = {a * (math.cos(E) - e), 0, b * math.sin(E)}
    v[i] = {-a * math.sin(E) * turning, 0, b * math.cos(E) * turning}
  end
  return { P = P, v = v }
end

local ways = {
  substeps  = function(effort) return { substeps = effort } end,
  tolerance = function(effort) return { tolerance = 0.005 / effort ^ 2, max_substeps = 1024 } end,
}

return rapid.study {
  name   = "Kepler's ellipses",
  scene  = function(k)
    return rapid.create { points = rapid.points.from(on_ellipses(0)) }
      :attract { strength = strength, falloff = 2 }
      :solve(ways[k.way](k.effort))
  end,
  frames = {1, 77}, -- one revolution
  sweep  = { way = {"substeps", "tolerance"}, effort = {2, 4, 8, 16, 32} },
  lines  = "way",
  reference = function(frame) return on_ellipses(frame.time) end,
  error  = "p95",
}
