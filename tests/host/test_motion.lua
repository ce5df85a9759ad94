-- Motions as graphs write them: constants, products, functions of the frame, keys; and the shapes they move.
local scene = require "testing.scene"

local speck = "rapid.mesh.from { points = {{0, 0, 0}, {1e-6, 0, 0}, {0, 0, 1e-6}}, faces = {{1, 2, 3}} }"

local function births_of(source, options)
  return scene.run(("return rapid.create {} :emit { source = %s, count = 4, birth = 'even', inherit_velocity = 0, %s }")
    :format(source, options or ""), { frames = {1, 14} })
end

local function error_of(text)
  return scene.error("local m = " .. text .. " return rapid.create {} :emit { source = m, rate = 1 } :solve {}")
end

-- The tolerance covers the speck's size and single precision.
local function close(expected, found)
  assert.near(0, (found - expected):length(), 4e-6)
end

describe("a motion", function()
  it("by keys is linear between them, and holds outside", function()
    local result = births_of(speck .. ":transform { [3] = rapid.translate(0, 0, 0), [7] = rapid.translate(8, 4, 0) }")
    for k = 0, 3 do
      close(vec3(2 * (1 + (k + 1) / 4), 1 + (k + 1) / 4, 0), result[5]:by_id(12 + k).P)
      close(vec3(0, 0, 0), result[3]:by_id(4 + k).P)
      close(vec3(8, 4, 0), result[12]:by_id(40 + k).P)
    end
  end)

  -- A speck 2 m from the axis, born at the ends of frames.
  it("by keys turns by the angle between them, whole turns included", function()
    for _, degrees in ipairs { 90, 200, 360, -720 } do
      local keys = (":transform { [1] = rapid.rotate({0, 0, 1}, 0), [11] = rapid.rotate({0, 0, -1}, %d) }")
        :format(-degrees)
      local result = births_of(speck .. ":transform(rapid.translate(2, 0, 0))" .. keys)
      for frame = 2, 11 do
        local angle = math.rad(degrees) * (frame - 1) / 10
        close(vec3(2 * math.cos(angle), 2 * math.sin(angle), 0), result[frame]:by_id(4 * frame - 5).P)
      end
    end
  end)

  it("may be a function of the frame, which is called between frames and for the frames around", function()
    local result = births_of(speck .. [[:transform(function(frame)
      return rapid.translate(frame.time * 24, 0, 0) * rapid.rotate({0, 0, 1}, 30 * frame.number)
        * rapid.translate(0, 2, 0)
    end)]])
    -- Halfway the spline is at (9 (p1 + p2) - (p0 + p3)) / 16 of the positions around it: on a circle this is slightly
    -- off the arc.
    local angle, half = math.rad(30 * 9.5), math.rad(15)
    local radius = 2 * (9 * math.cos(half) - math.cos(3 * half)) / 8
    close(vec3(8.5 - radius * math.sin(angle), radius * math.cos(angle), 0), result[10]:by_id(33).P)
  end)

  it("moves a thing that is moved already", function()
    local result = births_of(speck .. ":transform { [1] = rapid.translate(0, 0, 0), [11] = rapid.translate(10, 0, 0) }"
      .. ":transform(rapid.translate(0, 7, 0) * rapid.scale(2))")
    close(vec3(2 * 4, 7, 0), result[5]:by_id(15).P)
  end)

  it("that is constant moves the thing itself, which keeps its type", function()
    local result = births_of("rapid.shape.sphere {}:transform(rapid.translate(5, 0, 0) * rapid.scale(0.5))")
    for k = 0, 3 do assert.near(0.5, (result[5]:by_id(12 + k).P - vec3(5, 0, 0)):length(), 1e-6) end
  end)

  it("that is no motion is refused with the list of motions", function()
    assert.truthy(error_of("rapid.mesh.box {}:transform(3)"):find(
      ":transform: motion = 3 has the wrong type; it must be a motion (rapid.translate, rapid.rotate, rapid.scale, "
        .. "or a product), a function of the frame that returns one, or keys {[1] = ..., [24] = ...}", 1, true))
    local message = error_of("rapid.mesh.box {}:transform(function(frame) return 3 end)")
    assert.truthy(message:find("motion is a function that returned 3; it must return a motion", 1, true), message)
    assert.truthy(message:find("(frame ", 1, true), message)
  end)

  it("that a function does not return is told with the line of the function, and the node", function()
    local text = [[
local body = rapid.mesh.box {}:transform(
  function(frame)
    return frame.number > 3 and 3 or rapid.translate(0, 0, 0)
  end)
return rapid.create {}
  :emit { source = body, rate = 100 } :solve {}]]
    local run = scene.command("run", text, "-f 1-10 --quiet")
    assert.equal(1, run.status)
    assert.truthy(run.stderr:find(':2: node "emit1": motion is a function that returned 3', 1, true), run.stderr)
  end)

  it("by keys takes constants alone", function()
    assert.truthy(error_of("rapid.mesh.box {}:transform { [1] = rapid.scale(1), [9] = 'up' }"):find(
      'motion[9] = "up" can\'t be a key; keys must be constant motions', 1, true))
    local moving_key = "{ [1] = rapid.scale(1) * function() end, [2] = rapid.scale(2) }"
    assert.truthy(error_of("rapid.mesh.box {}:transform " .. moving_key)
      :find("motion[1] = a motion that varies can't be a key", 1, true))
    assert.truthy(error_of("rapid.mesh.box {}:transform {}"):find("a motion by keys has no keys", 1, true))
  end)

  it("moves meshes and shapes, and nothing else", function()
    assert.truthy(error_of("rapid.scale(2):transform(rapid.scale(2))"):find('a motion has no "transform"', 1, true))
  end)
end)

describe("a mesh sequence", function()
  local function tetrahedron(size)
    return ("v 0 0 0\nv %g 0 0\nv 0 0 %g\nv 0 %g 0\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n"):format(size, size, size)
  end
  for frame = 1, 14 do
    scene.folder:write(("grows.%04d.obj"):format(frame), tetrahedron(frame))
    scene.folder:write(("breaks.%04d.obj"):format(frame),
      frame == 4 and "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" or tetrahedron(frame))
  end

  it("is an emitter that deforms", function()
    local result = scene.run([[return rapid.create {}
      :emit { source = rapid.mesh.read "grows.####.obj", count = 100, birth = "even" }]], { frames = {1, 8} })
    for k = 0, 99 do
      local point = result[8]:by_id(600 + k)
      local P, size = point.P, 7 + (k + 1) / 100
      assert.near(0, (point.v - P * (24 / size)):length(), 1e-3)
      assert.is_true(P.x + P.y + P.z <= size * (1 + 1e-6))
    end
  end)

  it("whose faces change ends the run at that frame, with both counts", function()
    local message = scene.error([[return rapid.create {}
      :emit { source = rapid.mesh.read "breaks.$F4.obj", rate = 10 } :solve {}]], { frames = {1, 8} })
    assert.truthy(message:find("changes at frame 4: it has 3 corners and 1 faces there and 12 corners and 4 faces at "
      .. "frame 1", 1, true), message)
  end)

  it("without a file is refused before the first frame", function()
    local result = scene.command("check",
      'return rapid.create {} :emit { source = rapid.mesh.read "none.####.obj", rate = 1 }')
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find("there is no mesh file", 1, true), result.stderr)
  end)
end)
