-- The mechanical energy of a scene of passive_scenes in a frame, J: of motion, gravity, springs and compliant rows.
--
--   local mechanical_energy = require "tests.verification.mechanical_energy"
--   local energy = mechanical_energy.of(scene, result)
--   energy[frame].total, .lively (motion and stretched springs), .rounding (from the state's single precision)
--   mechanical_energy.gain(scene, result)   the largest gain over the first frame, beyond rounding: as a fraction of
--                                           the largest lively energy in the run; its frame; in J. nil without a gain
--
-- A scene in the frame of its shapes (stability/driven_scenes.lua) has points with the original distance `far`, m, and
-- speed `fast`, m/s, which determine the rounding.
--
-- Gravity's potential is 0 at the lowest position that a point reaches, so that a dying point removes energy.
local mechanical_energy = {}

local ulp = 2 ^ -23  -- of single precision, relative

local function length(P) return math.sqrt(P:dot(P)) end
local function far(scene, p) return scene.motion and p.far or length(p.P) end

-- Returns the energy stored in a stretch, and its error from rounding at the distance `size` from the origin.
local function stored(stiffness, stretch, size)
  local error = ulp * size
  return stiffness * stretch ^ 2 / 2, stiffness * (math.abs(stretch) * error + error ^ 2)
end

-- Functions that sum over a node's springs. by_id: living points of the frame.
local stretches = {}
function stretches.spring(node, scene, by_id, add)
  for id = 0, #scene.points - 1 do
    local p = by_id[id]
    if p then
      local stretch = node.radius and length(p.P) - node.radius or length(p.P - vec3(unpack(node.target)))
      add(node.stiffness, stretch, far(scene, p) + (node.radius or 1))
    end
  end
end
function stretches.distance(node, scene, by_id, add, place_of)
  if node.compliance == 0 then return end
  for _, pair in ipairs(node.pairs) do
    local a, b = by_id[place_of[pair[1]] - 1], by_id[place_of[pair[2]] - 1]
    if a and b then
      local first = length(vec3(unpack(pair[1].P)) - vec3(unpack(pair[2].P)))
      add(1 / node.compliance, length(a.P - b.P) - (node.rest or first), far(scene, a) + far(scene, b))
    end
  end
end
function stretches.pin(node, scene, by_id, add, place_of, t)
  if node.compliance == 0 then return end
  for _, point in ipairs(node.points) do
    local p = by_id[place_of[point] - 1]
    local target = vec3(unpack(point.P)) + (node.way and node.way(t) or vec3(0, 0, 0))
    if p then add(1 / node.compliance, length(p.P - target), 2 * far(scene, p)) end
  end
end

local function of_frame(scene, points, lowest, place_of, t)
  local by_id, moving, height, elastic, rounding = {}, 0, 0, 0, 0
  for i = 1, #points do
    local p = points[i]
    by_id[p.id] = p
    local mass, speed2 = scene.points[p.id + 1].mass, p.v:dot(p.v)
    moving = moving + mass * speed2 / 2
    height = height + mass * scene.g * (p.P.y - lowest)
    local slip = ulp * (far(scene, p) + p.pscale) * scene.fps * scene.substeps  -- of P, as a speed
    if scene.motion then slip = slip + ulp * p.fast end
    rounding = rounding + mass * (ulp * (speed2 + scene.g * far(scene, p)) + slip * (math.sqrt(speed2) + slip))
  end
  for _, node in ipairs(scene.nodes) do
    if stretches[node.kind] then
      stretches[node.kind](node, scene, by_id, function(stiffness, stretch, size)
        local energy, error = stored(stiffness, stretch, size)
        elastic, rounding = elastic + energy, rounding + error
      end, place_of, t)
    end
  end
  return { total = moving + height + elastic, lively = moving + elastic, rounding = rounding }
end

function mechanical_energy.of(scene, result)
  local lowest, place_of, energies = math.huge, {}, {}
  for i, point in ipairs(scene.points) do place_of[point] = i end
  for _, points in result:frames() do
    if #points > 0 then lowest = math.min(lowest, points:min("P").y) end
  end
  for frame, points in result:frames() do
    energies[frame] = of_frame(scene, points, lowest, place_of, (frame - 1) / scene.fps)
  end
  return energies
end

function mechanical_energy.gain(scene, result)
  local energies, lively = mechanical_energy.of(scene, result), 0
  for _, energy in ipairs(energies) do lively = math.max(lively, energy.lively) end
  local rounding, most, at = 0, 0, nil
  for frame, energy in ipairs(energies) do
    rounding = rounding + energy.rounding
    local gain = energy.total - energies[1].total
    if gain - rounding > most then most, at = gain - rounding, frame end
  end
  if at then return most / lively, at, most end
end

return mechanical_energy
