-- Passive scenes (verification/passive_scenes.lua) whose shapes and pins move. Each number and seed gives the same
-- scene on every machine.
--
--   local driven_scenes = require "tests.stability.driven_scenes"
--   driven_scenes.together(seed, number)   all move alike and uniformly: the scene is passive in their frame
--   driven_scenes.apart(seed, number)      each has its own motion
--
-- For the first kind there are also:
--
--   driven_scenes.seen(scene, result)   the scene and its result in the frame of the shapes
--   driven_scenes.at_rest(scene)        the equivalent passive scene in that frame
local lehmer = require "tests.lehmer"
local passive_scenes = require "tests.verification.passive_scenes"

local driven_scenes = {}

local draw = lehmer.new()
local pick, chance, between, magnitude = draw.pick, draw.chance, draw.between, draw.magnitude
local function short(x) return tonumber(("%.6g"):format(x)) end

-- Returns a motion shared by all shapes: a velocity, m/s, and an acceleration along y.
local function going()
  local speed = magnitude(-1, 1.3)
  local function along() return short(speed * between(-1, 1)) end
  return { x = along(), y = along(), z = along(), a = pick { 0, 0, short(between(-5, 20)) } }
end
local function way(motion, t) return vec3(motion.x * t, motion.y * t + motion.a / 2 * t ^ 2, motion.z * t) end

local function function_text(formula, ...)
  return ("function(f) local t = f.time return %s end"):format(formula:format(...))
end
local function text_of(motion)
  return function_text("rapid.translate(%.9g * t, %.9g * t + %.9g * t ^ 2, %.9g * t)", motion.x, motion.y, motion.a / 2,
    motion.z)
end

-- Motions of a single shape.
local apart = {
  function() return text_of(going()) end,
  function()
    local size, rate = magnitude(-2, 0), magnitude(0, 1.8)
    return function_text("rapid.translate(%.6g * math.sin(%.6g * t), %.6g * math.sin(%.6g * t), 0)",
      size * pick { 0, 1 }, rate, size, rate)
  end,
  function()
    return function_text("rapid.rotate({%.6g, 1, %.6g}, %.6g * t)", between(-1, 1), between(-1, 1), magnitude(1, 3.2))
  end,
  function()
    return function_text("rapid.translate(0, %.6g * t, 0) * rapid.rotate({0.3, 0, 1}, %.6g * t)", between(-2, 2),
      magnitude(0, 2.5))
  end,
  function()  -- a jump
    return ("{ [1] = rapid.translate(0, 0, 0), [8] = rapid.translate(0, %.6g, 0), [9] = rapid.translate(%.6g, 0, 0) }")
      :format(between(-0.3, 0.3), between(-3, 3))
  end,
}

-- Returns the first passive scene, counting from `number`, that has a shape and a node that couples points.
local function passive(seed, number)
  local scene
  repeat
    scene = passive_scenes.scene(seed, number)
    number = number + 100003
    local has = {}
    for _, node in ipairs(scene.nodes) do has[node.kind] = true end
  until has.collide and (has.contact or has.distance or has.clump or has.pin)
  return scene
end

function driven_scenes.together(seed, number)
  local scene = passive(seed, number)
  draw.start(seed, number)
  scene.motion = going()
  local nodes, text = {}, text_of(scene.motion)
  for _, node in ipairs(scene.nodes) do
    if node.kind == "collide" or node.kind == "pin" then node.transform = text end
    if node.kind == "spring" then  -- to a sphere that moves along; its damping would be relative to the world
      node.radius, node.target, node.damping = node.radius or 2 * scene.spacing, nil, 0
      node.along = text
    end
    if node.kind ~= "drag" then nodes[#nodes + 1] = node end
  end
  scene.nodes = nodes
  return scene
end

function driven_scenes.apart(seed, number)
  local scene = passive(seed, number)
  draw.start(seed, number)
  for _, node in ipairs(scene.nodes) do
    if node.kind == "collide" then node.transform = pick(apart)() end
    if node.kind == "pin" and chance(0.7) then
      if node.compliance == 0 then
        node.transform = pick(apart)()
      else
        local motion = going()
        node.transform, node.way = text_of(motion), function(t) return way(motion, t) end
      end
    end
    if node.kind == "contact" and chance(0.5) then node.record = "true" end
  end
  return scene
end

-- Returns a point's state in the frame of shapes that have moved for t seconds.
local function seen_from(motion, t, p)
  return p.P - way(motion, t), p.v - vec3(motion.x, motion.y + motion.a * t, motion.z)
end

function driven_scenes.seen(scene, result)
  local motion, frames = scene.motion, {}
  for frame, points in result:frames() do
    local list = {}
    for i = 1, #points do
      local p = points[i]
      local P, v = seen_from(motion, (frame - 1) / scene.fps, p)
      list[i] = { P = P, v = v, id = p.id, pscale = p.pscale, far = p.P:length(), fast = p.v:length() }
    end
    function list:min(name)
      local least = self[1][name]
      for i = 2, #self do least = vec3(math.min(least.x, self[i].P.x), math.min(least.y, self[i].P.y),
        math.min(least.z, self[i].P.z)) end
      return least
    end
    frames[frame] = list
  end
  local view = setmetatable({ g = scene.g + motion.a }, { __index = scene })
  return view, { frames = function() return ipairs(frames) end }
end

function driven_scenes.at_rest(scene)
  local motion, points, nodes, still = scene.motion, {}, {}, {}
  for i, point in ipairs(scene.points) do
    local P, v = vec3(unpack(point.P)), vec3(unpack(point.v))
    local _, seen = seen_from(motion, 0, { P = P, v = v })
    points[i] = setmetatable({ v = { seen.x, seen.y, seen.z } }, { __index = point })
    still[point] = points[i]
  end
  for i, node in ipairs(scene.nodes) do
    nodes[i] = setmetatable({ transform = false, along = false }, { __index = node })
    if node.points then
      nodes[i].points = {}
      for k, point in ipairs(node.points) do nodes[i].points[k] = still[point] end
    end
    if node.pairs then
      nodes[i].pairs = {}
      for k, pair in ipairs(node.pairs) do nodes[i].pairs[k] = { still[pair[1]], still[pair[2]] } end
    end
  end
  return setmetatable({ points = points, nodes = nodes, g = scene.g + motion.a, motion = false },
    { __index = scene })
end

return driven_scenes
