-- A roof with a valley, as a level set of coarse voxels: edges that point outwards, creases that point inwards, pits.
local command = require "testing.command"

local scene = [[
local rapid = require "rapid"
local roof = rapid.mesh.from {
  points = { {-1, 0, -1}, {1, 0, -1}, {1, 1, -1}, {0.1, 0.37, -1}, {-1, 0.9, -1},
             {-1, 0, 1}, {1, 0, 1}, {1, 1.2, 1}, {-0.1, 0.43, 1}, {-1, 0.8, 1} },
  faces = { {5, 4, 3, 2, 1}, {6, 7, 8, 9, 10}, {1, 2, 7, 6}, {2, 3, 8, 7}, {3, 4, 9, 8}, {4, 5, 10, 9},
            {5, 1, 6, 10} } }
local solid = rapid.levelset.from_mesh(roof, { voxel = 0.035 })
return rapid.create { seed = 2 }
  :emit { source = rapid.mesh.grid { size = {2.2, 2.2}, center = {0, 1.6, 0} }, rate = 4000,
          attributes = { pscale = 0.006 } }
  :points("breeze", function(p, frame) p.v = p.v + vec3(0.6 * math.sin(3 * frame.time + p.P.y), 0, 0) * p.dt end)
  :gravity {} :collide { shape = solid, bounce = 0.25, friction = 0.3 }
  :collide { shape = rapid.shape.plane {}, bounce = 0.2, friction = 0.5 } :solve { substeps = 2 }
]]

describe("a level set with edges, creases and pits", function()
  it("lets no point chatter up to the limit of contacts, and keeps it outside", function()
    local folder = command.folder()
    folder:write("scene.lua", scene)
    local result = rapid.run(folder:file "scene.lua", { frames = {1, 90} })
    assert.same({}, result.warnings)
    for _, points in result:frames() do
      assert.points(points).finite()
      if #points > 0 then assert.is_true(points:min("P").y >= 0.006 - 1e-6) end
    end
  end)
end)
