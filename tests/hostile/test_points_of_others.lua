-- Point files with values that no scene can use: nodes handle them, or report the point.
local command = require "testing.command"

local nodes = { ":clump {}", ":contact {}", ":interact { radius = 0.5 }", ":distance { within = 0.5 }", ":gravity {}",
  ":collide { shape = rapid.shape.plane { offset = -1 } }" }

-- Px, Py, Pz, pscale, vx of the first point.
local rows = { "inf,0,0,0.1,0", "nan,0,0,0.1,0", "0,0,0,inf,0", "0,0,0,nan,0", "0,0,0,-1,0", "0,0,0,0.1,nan",
  "0,0,0,0.1,inf" }
local uses_no_radius = { [":interact { radius = 0.5 }"] = true, [":distance { within = 0.5 }"] = true,
  [":gravity {}"] = true }

describe("a point with a number that is none", function()
  it("is an error of the file in P and v, and otherwise of a node that asks for it", function()
    local folder = command.folder()
    for _, row in ipairs(rows) do
      folder:write("points.csv", "id,Px,Py,Pz,pscale,vx,vy,vz\n5," .. row ..
        ",0,0\n6,0,0.1,0,0.1,0,0,0\n7,0.1,0.1,0,0.1,0,0,0\n")
      for _, node in ipairs(nodes) do
        folder:write("scene.lua", 'local rapid = require "rapid"\n' ..
          'return rapid.create { points = rapid.points.read "points.csv" } ' .. node .. " :solve {}\n")
        local result = command.shell('ulimit -t 20; exec "$RAPID" run scene.lua -f 1-3 --quiet', { cwd = folder.path })
        local what = row .. " " .. node .. ": " .. result.stderr
        if row:find "^%a" or row:find "%a$" then
          assert.equal(2, result.status, what)
          assert.match('^scene%.lua:2: rapid%.points%.read: "points%.csv": the point in row 1, with id 5, has '
            .. "[Pv] = {%a+, 0, 0}; it must be finite\n$", result.stderr, what)
        elseif row:find "^0,0,0,[^,]*,0$" and uses_no_radius[node] then
          assert.equal(0, result.status, what)
        else
          assert.equal(1, result.status, what)
          assert.match('^scene%.lua:2: node "%w+": ', result.stderr, what)
        end
      end
    end
  end)

  it("has no position on a shape, and ends no run by a signal", function()
    local folder = command.folder()
    local shapes = [[
local rapid = require "rapid"
local sheet = rapid.mesh.from { points = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}}, faces = {{1, 2, 3}},
                                values = { heat = {1, 1, 1} } }
local turning = sheet:transform(function(frame) return rapid.rotate({0, 1, 0}, 20 * frame.number) end)
local ball = rapid.levelset.sphere { radius = 0.5, voxel = 0.1 }
local moving = rapid.shape.sphere { radius = 0.5 }:transform { [1] = rapid.translate(0, 0, 0),
                                                               [3] = rapid.translate(1, 0, 0) }
]]
    for _, row in ipairs { "0,0,0,nan,0", "0,0,0,inf,0", "1e38,1e38,0,0.1,0", "0,0,0,0.1,1e38" } do
      folder:write("points.csv", "id,Px,Py,Pz,pscale,vx,vy,vz\n5," .. row .. ",0,0\n6,0,0.1,0,0.1,0,0,0\n")
      for _, node in ipairs { ":transfer { source = sheet }", ":transfer { source = turning }",
        ":pin { target = turning }", ":pin { target = moving }", ":pin { compliance = 0.1 }",
        ":attract { shape = sheet }", ":attract { shape = turning }", ":attract { shape = ball }",
        ":spring { target = turning }", ":spring { target = ball }",
        ":collide { shape = moving, response = 'stick' }", ":collide { shape = ball, response = 'stick' }",
        ":goal { to = turning, by = 'nearest' }", ":goal { to = ball, by = 'nearest' }", ":goal { to = sheet }",
        ":goal { to = rapid.points.from { P = {{0, 0, 0}} }, by = 'nearest' }",
        ":curve_force { curve = {{0, 0, 0}, {1, 0, 0}} }",
        ":points('k', function(p) p.v = p.v * turning:distance(p.P) end)", ":trail { places = 3 } :picture {}" } do
        folder:write("scene.lua", shapes .. 'return rapid.create { points = rapid.points.read "points.csv" } ' ..
          node .. " :solve {}\n")
        local result = command.shell('ulimit -t 20; exec "$RAPID" run scene.lua -f 1-3 --quiet -o a.####.png ' ..
          "--size 32x32", { cwd = folder.path })
        local what = row .. " " .. node .. ": " .. result.stderr
        assert.truthy(result.status <= 1, what)
      end
    end
  end)
end)
