-- :picture and rapid.camera: the input that they refuse, and that they change no point. Their effect on pictures is
-- tested in tests/command/test_run.lua.
local scene = require "testing.scene"

local function message(says)
  return scene.error(("return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } } " ..
    ":gravity {} :solve {} :picture { %s }"):format(says), { frames = {1, 2} })
end

describe(":picture", function()
  it("changes no point", function()
    local text = [[
local rapid = require "rapid"
local chain = rapid.create { seed = 3 }
  :emit { source = rapid.shape.sphere { radius = 1 }, rate = 500, life = 0.1 } :gravity {} :solve {}
return %s]]
    local plain = rapid.run(scene.folder:write("plain.lua", text:format "chain"), { frames = {1, 12} })
    local says = 'chain:picture { blend = "add", shutter = 1, camera = rapid.camera { position = {0, 0, 4} } }'
    local shown = rapid.run(scene.folder:write("shown.lua", text:format(says)), { frames = {1, 12} })
    for frame, points in plain:frames() do assert.same_points(points, shown[frame]) end
  end)

  it("refuses arguments that it can't draw, and names the right ones", function()
    for says, right in pairs {
      ['blend = "screen"'] = 'blend = "screen"',
      ['draw = "discs"'] = 'draw = "discs" is unknown; it must be one of balls, cards',
      ["shutter = 2"] = "shutter = 2 is out of range; it must be from 0 to 1",
      ["camera = {0, 1, 5}"] = "it must be a rapid.camera { ... }, cameras by frame {[1] = a, [48] = b}, or a function",
      ["camera = { [3] = 2 }"] = "it must be a rapid.camera { ... }",
      ["camera = rapid.camera { position = {0, 1, 0}, target = {0, 1, 0} }"] = "position and target are equal",
      ["camera = rapid.camera { fov = 0 }"] = "fov = 0 is out of range; it must be from 1 to 170",
      ["camera = rapid.camera { postion = {0, 1, 0} }"] = 'did you mean "position"?',
      ['camera = rapid.camera { group = "pear" }'] = '"pear"',
      ['group = "pear"'] = '"pear"',
    } do
      local text = message(says)
      assert.truthy(text:find(right, 1, true), says .. ": " .. text)
    end
  end)
end)
