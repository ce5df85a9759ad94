-- Forces whose parameters are functions of the frame: what holding them through it is off by is in the error.
local scene = require "testing.scene"
local json = require "dkjson"

local last = 25

-- The error of the last frame, and its points.
local function run(nodes)
  local text = "return rapid.create { fps = 24, points = two } " .. nodes
  local ran = scene.command("run", text, ("-f 1-%d --quiet --stats stats.json"):format(last))
  assert.equal(0, ran.status, ran.stderr)
  local error = json.decode(scene.folder:read "stats.json").frames[last].error
  return error, scene.run(text, { frames = {last, last} })[last]
end

describe("the error of forces that are functions of the frame", function()
  it("is that of holding a uniform acceleration, within a factor of four, at any sub-steps", function()
    for _, solve in ipairs { "substeps = 1", "substeps = 16", "tolerance = 1e-4" } do
      local told, points = run(":gravity { g = function(f) return {0, -6 * f.time, 0} end } :solve { " .. solve .. " }")
      local off = math.abs(points[1].P.y - 1 + 1) -- y = 1 - t³ at 1 s
      assert.truthy(off > 0.05)
      assert.truthy(told.position_max < 4 * off and told.position_max > off / 4,
        ("%s: told %g m, it is %g m"):format(solve, told.position_max, off))
    end
  end)

  it("is none where the function gives the same in each frame", function()
    for _, force in ipairs { ":gravity { g = function() return {0, -9, 0} end }",
      ":wind { velocity = function() return {3, 0, 0} end }" } do
      assert.equal(0, (run(force .. " :solve {}")).position_max)
    end
  end)

  it("is that of the force's group alone, where it depends on the place, too", function()
    local told = run [[:group { name = "right", where = function(p) return p.P.x > 0.5 end }
      :attract { group = "right", core = 1, strength = 5, center = function(f) return {0, 4 * f.time, 0} end }
      :solve { substeps = 32 }]]
    assert.equal(0, told.position_p50) -- the lower of two
    assert.truthy(told.position_max > 0.01)
  end)

  it("is in that of coupled points", function()
    local told, points = run [[:gravity { g = function(f) return {0, -6 * f.time, 0} end }
      :distance { pairs = {{1, 2}} } :solve { substeps = 4 }]]
    local off = math.abs(points[1].P.y)
    assert.truthy(told.position_max < 4 * off and told.position_max > off / 4, told.position_max)
  end)
end)
